"""Patch friction inside MuJoCo: MuJoCo keeps the normal contact, and this package supplies friction for chosen geoms.

Needs MuJoCo: `pip install 'planarfriction[mujoco]'`.
"""

from planarfriction.errors import needing

with needing("mujoco", "mujoco"):
    from planarfriction.adapters.mujoco.friction import Friction
    from planarfriction.adapters.mujoco.patches import PatchContact, prepare

__all__ = ["Friction", "PatchContact", "prepare"]
