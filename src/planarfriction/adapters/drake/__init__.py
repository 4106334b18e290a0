"""Patch friction inside Drake: Drake keeps the normal contact, this package adds friction of chosen geometries.

Needs Drake: `pip install 'planarfriction[drake]'`.
"""

try:
    import pydrake as _pydrake  # noqa: F401
except ImportError:
    from planarfriction.errors import MissingExtraError

    raise MissingExtraError("drake", "drake") from None

from planarfriction.adapters.drake.friction import Friction, Report
from planarfriction.adapters.drake.patches import PatchContact, prepare

__all__ = ["Friction", "PatchContact", "Report", "prepare"]
