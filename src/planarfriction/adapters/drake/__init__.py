"""Patch friction inside Drake: Drake keeps the normal contact, this package adds friction of chosen geometries.

Needs Drake: `pip install 'planarfriction[drake]'`.
"""

from planarfriction.errors import needing

with needing("drake", "drake"):
    from planarfriction.adapters.drake.friction import Friction, Report
    from planarfriction.adapters.drake.patches import PatchContact, prepare

__all__ = ["Friction", "PatchContact", "Report", "prepare"]
