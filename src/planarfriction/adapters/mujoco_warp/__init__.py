"""Patch friction inside MuJoCo Warp: for thousands of environments on GPUs and CPUs.

Needs MuJoCo Warp: `pip install 'planarfriction[mujoco-warp]'`.
"""

from planarfriction.errors import needing

with needing("mujoco-warp", "mujoco-warp"):
    from planarfriction.adapters.mujoco.patches import PatchContact, prepare
    from planarfriction.adapters.mujoco_warp.friction import Friction

__all__ = ["Friction", "PatchContact", "prepare"]
