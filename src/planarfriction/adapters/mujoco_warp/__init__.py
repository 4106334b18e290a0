"""Patch friction inside MuJoCo Warp: for thousands of environments on GPUs and CPUs.

Needs MuJoCo Warp: `pip install 'planarfriction[mujoco-warp]'`.
"""

try:
    import mujoco_warp as _mujoco_warp  # noqa: F401
except ImportError:
    from planarfriction.errors import MissingExtraError

    raise MissingExtraError("mujoco-warp", "mujoco-warp") from None

from planarfriction.adapters.mujoco.patches import PatchContact, prepare
from planarfriction.adapters.mujoco_warp.friction import Friction

__all__ = ["Friction", "PatchContact", "prepare"]
