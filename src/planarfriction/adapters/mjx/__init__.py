"""Patch friction inside MJX: like `planarfriction.adapters.mujoco`, for many environments at once and with derivatives.

Needs MJX and JAX: `pip install 'planarfriction[mjx]'`.
"""

import contextlib as _contextlib
import sys as _sys

try:
    import jax as _jax  # noqa: F401

    with _contextlib.redirect_stdout(_sys.stderr):  # MJX prints which of its back ends it misses
        import mujoco.mjx as _mjx  # noqa: F401
except ImportError:
    from planarfriction.errors import MissingExtraError

    raise MissingExtraError("mjx", "mjx") from None

from planarfriction.adapters.mjx.friction import Friction
from planarfriction.adapters.mujoco import PatchContact, prepare

__all__ = ["Friction", "PatchContact", "prepare"]
