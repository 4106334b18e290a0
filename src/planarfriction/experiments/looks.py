"""How models look in every figure of the report: one colour for each."""

from __future__ import annotations

from planarfriction.plots.style import PALETTE

DISTRIBUTED, REDUCED, ELLIPSOID, MOMENTS, PARTS, OTHER, EXACT = PALETTE
"""Colours: sums over cells and their model, the published table and its model, the ellipsoid and its model,
`ReducedModel` with one part, with several, something else, what is exact."""

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
