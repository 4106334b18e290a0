"""Patch friction inside MuJoCo: MuJoCo keeps the normal contact, and this package supplies friction for chosen geoms.

Needs MuJoCo: `pip install 'planarfriction[mujoco]'`.
"""

try:
    import mujoco as _mujoco  # noqa: F401
except ImportError:
    from planarfriction.errors import MissingExtraError

    raise MissingExtraError("mujoco", "mujoco") from None

from planarfriction.adapters.mujoco.friction import Friction
from planarfriction.adapters.mujoco.patches import PatchContact, prepare

__all__ = ["Friction", "PatchContact", "prepare"]
