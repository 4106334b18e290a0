"""Patch friction inside Drake: Drake keeps the normal contact, and this package supplies friction for chosen
geometries.

Needs Drake: `pip install 'planarfriction[drake]'`.
"""

try:
    import pydrake as _pydrake  # noqa: F401
except ImportError:
    from planarfriction.errors import MissingExtraError

    raise MissingExtraError("drake", "drake") from None

from planarfriction.adapters.drake.friction import PatchFriction, Report
from planarfriction.adapters.drake.patches import Patch, prepare

__all__ = ["Patch", "PatchFriction", "Report", "prepare"]
