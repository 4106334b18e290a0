"""The distributed model over `xp`: the bristles of `kernels`, in every cell of a patch of points or discs.

A state `[..., d, N]` has d bristles in each of N cells, two in points and three in discs. Twists are `[..., 3]`; the
law's parameters and time steps are `[..., 1, 1]`, or plain numbers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.bristles import (
    asymmetric_cells,
    bristle_limit,
    discs,
    points,
)
from planarfriction._engine.bristles.asymmetric_cells import Leaning
from planarfriction._engine.cells import cells
from planarfriction.formulas import LawNumbers
from planarfriction.models import DistributedModel
from planarfriction.patch import ContactPatch
from planarfriction.tensors.elements import Vector, joined, split


class CellType(NamedTuple):
    """Functions of a kind of cell, in numbers as `kernels` has them."""

    bristles: int
    lever: cells.Lever
    evaluate: Any
    step: Any


KINDS = {
    2: CellType(2, cells.POSITIONS, points.evaluate, points.step),
    3: CellType(3, cells.DISC_POSITIONS, discs.evaluate, discs.step),
    5: CellType(2, cells.LEVERS, points.evaluate, points.step),
    6: CellType(3, cells.DISC_LEVERS, discs.evaluate, discs.step),
    7: CellType(2, cells.LEVERS, asymmetric_cells.evaluate, asymmetric_cells.step),
    8: CellType(
        3, cells.DISC_LEVERS, asymmetric_cells.evaluate_disc, asymmetric_cells.step_disc
    ),
}
"""Kinds of cells by how many numbers each has: points, discs, both with a friction metric, and with asymmetry too.

Numbers are those of the lever, with the asymmetry behind them.
"""


class Cells(NamedTuple):
    """A patch as arrays."""

    levers: Any
    """Numbers of the cells as their levers read them: see `cells.cells.Lever`, `[numbers, N]`."""
    weights: Any
    """Share of the load that each cell carries [-], `[N]`."""
    remainder: Any
    """Digits of the positions, x then y [m], that the numbers of `levers` have no room for, `[2, N]`."""


def cells_of(
    patch: ContactPatch, law: Any, normal_force: float | None, precision: Any
) -> Cells:
    """Return the cells of a patch at a load [N] as NumPy arrays, for levers of a number type of NumPy."""
    numbers = DistributedModel(patch, law).compiled.numbers()
    if patch.anisotropic and not patch.asymmetric:
        numbers = numbers[:-2]
    levers = numbers.astype(precision)
    remainder = patch.positions.T - positions_of(np, levers.astype(float))
    return Cells(levers, patch.weights(normal_force), remainder)


def positions_of(xp, levers):
    """Return the positions of the cells to the digits of their levers, x then y [m], `[2, N]`."""
    if len(levers) < 5:
        return levers[:2]
    xx, xy, yy, x, y = (levers[k] for k in range(5))
    return xp.stack([xx * y - xy * x, xy * y - yy * x], 0) / (xx * yy - xy * xy)


def _numbers(shape: Cells) -> tuple[Any, Any]:
    """Return the numbers of the levers of the cells, and their asymmetry or None."""
    count = len(shape.levers)
    lever = tuple(shape.levers[k] for k in range(count if count < 7 else count - 2))
    return lever, None if count < 7 else Vector(shape.levers[-2:])


def _bristle(xp, name: str, law: Any, shape: Cells, z, u, *dt):
    """Return two arrays `[..., d, N]`, the results of a function of the bristles."""
    kind = KINDS[len(shape.levers)]
    (_, asymmetry) = _numbers(shape)
    # The source of discs names components.
    vector = Vector if kind.bristles == 2 else split
    law = law if asymmetry is None else Leaning(law, asymmetry)
    found = xp.over(getattr(kind, name))(law, vector(z), vector(u), *dt)
    return tuple(joined(xp, each) for each in found)


def middle(xp, law: LawNumbers, shape: Cells):
    """Return the middle of the limit of every bristle at rest `[..., d, N]`, or 0.0 (see `bristles.bristle_limit`)."""
    _, asymmetry = _numbers(shape)
    if asymmetry is None:
        return 0.0
    lean = asymmetry.array
    if KINDS[len(shape.levers)].bristles == 3:
        lean = xp.concatenate([lean, 0.0 * lean[:1]], -2)
    return law.mu_s / law.sigma_0 * lean


# ---------------------------------------------------------------------- steps


def wide(state):
    """Return a state as bristles `[..., d, N]`, which it is."""
    return state


narrow = wide
"""Return bristles `[..., d, N]` as a state, which they are."""


def drive(xp, law: LawNumbers, shape: Cells, twist) -> tuple[Any]:
    """Return the velocities that the cells see at a twist `[..., d, N]`, as a tuple of this array."""
    seen = xp.over(KINDS[len(shape.levers)].lever.seen)
    return (joined(xp, seen(_numbers(shape)[0], split(twist[..., None]))),)


def limited(xp, law: LawNumbers, shape: Cells, z):
    """Return bristles brought back onto their limits (see `bristles.bristle_limit`)."""
    seen_from = middle(xp, law, shape)
    return seen_from + xp.over(bristle_limit.within)(law, Vector(z - seen_from)).array


def evaluate(xp, law: LawNumbers, shape: Cells, z, by):
    """Return the rates of the bristles, and the tractions per unit load."""
    return _bristle(xp, "evaluate", law, shape, z, *by)


def advance(xp, law: LawNumbers, shape: Cells, z, by, dt):
    """Return the bristles after `dt` of a constant twist, and the tractions per unit load."""
    return _bristle(xp, "step", law, shape, z, *by, dt)


def wrench(xp, shape: Cells, pull):
    """Return the wrench about the origin per unit load `[..., 3]`."""
    found = xp.over(KINDS[len(shape.levers)].lever.wrench)(
        _numbers(shape)[0], split(shape.weights * pull)
    )
    return xp.concatenate([each.sum(-1) for each in found], -1)
