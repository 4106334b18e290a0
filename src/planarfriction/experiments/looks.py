"""How models look in every figure of the report: one colour for each."""

from __future__ import annotations

from planarfriction.plots.style import DISTRIBUTED, ELLIPSOID, EXACT, MOMENTS, OTHER, PARTS
from planarfriction.plots.style import PUBLISHED as REDUCED

__all__ = ["DISTRIBUTED", "ELLIPSOID", "EXACT", "MOMENTS", "OF_CAUSE", "OF_MODEL", "OTHER", "PARTS", "REDUCED"]

OF_MODEL = {"d": DISTRIBUTED, "r": REDUCED, "e": ELLIPSOID}
"""Letter of a model in the names of curves -> its colour."""

OF_CAUSE = {
    "reduced model instead": REDUCED,
    "default tolerances": DISTRIBUTED,
    "three times finer grid": OTHER,
    "published reduced": REDUCED,
    "ReducedModel": MOMENTS,
    "ReducedModel, 4 parts": OTHER,
    'ReducedModel, parts="auto"': PARTS,
}
"""What moves the end of an in-hand run -> its colour; a change of friction is black."""
