"""Patch friction inside MJX: like `planarfriction.adapters.mujoco`, for many environments at once and with derivatives.

Needs MJX and JAX: `pip install 'planarfriction[mjx]'`.
"""

import contextlib as _contextlib
import sys as _sys

from planarfriction.errors import needing

# MJX prints which of its back ends it misses
with needing("mjx", "mjx"), _contextlib.redirect_stdout(_sys.stderr):
    from planarfriction.adapters.mjx.friction import Friction
    from planarfriction.adapters.mujoco.patches import PatchContact, prepare

__all__ = ["Friction", "PatchContact", "prepare"]
