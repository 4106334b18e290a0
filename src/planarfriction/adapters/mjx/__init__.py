"""Patch friction inside MJX: as `planarfriction.adapters.mujoco`, many environments at once, with derivatives.

Needs MJX and JAX: `pip install 'planarfriction[mjx]'`.
"""

try:
    import jax as _jax  # noqa: F401
    import mujoco.mjx as _mjx  # noqa: F401
except ImportError:
    from planarfriction.errors import MissingExtraError

    raise MissingExtraError("mjx", "mjx") from None

from planarfriction.adapters.mjx.friction import Friction
from planarfriction.adapters.mujoco import Patch, prepare

__all__ = ["Friction", "Patch", "prepare"]
