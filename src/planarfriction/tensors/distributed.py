"""The distributed model over `xp`: the bristles of `kernels`, in every cell of a patch of points or discs.

A state `[..., d, N]` has d bristles in each of N cells, two in points and three in discs. Twists are `[..., 3]`; the
law's parameters and time steps are `[..., 1, 1]`, or plain numbers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.bristles.asymmetric_cells import Leaning
from planarfriction._engine.bristles.elastic import Elastic
from planarfriction._engine.cells.cell_loops import KINDS, CellKind
from planarfriction.formulas import LawNumbers
from planarfriction.models import DistributedModel
from planarfriction.pads import AtLoad
from planarfriction.tensors.elements import Vector, joined, split


class Cells(NamedTuple):
    """A patch as arrays."""

    levers: Any
    """Numbers of the cells as levers read them (see `cells.cells.Lever`), any asymmetry behind, `[numbers, N]`."""
    weights: Any
    """Share of the load that each cell carries [-], `[N]`."""
    remainder: Any
    """Digits of the positions, x then y [m], that the numbers of `levers` have no room for, `[2, N]`."""
    stiff: Any = None
    """`elastic.Elastic.stiff` [N] of the pieces of a pad; None without one."""
    kind: Any = None
    """Key of `cell_loops.KINDS`."""
    compliance: Any = None
    """Common compliance of these pieces `[3, 3]` [m/N, rad/(N m)]; None without one."""


def cells_of(
    model: DistributedModel, normal_force: float | None, precision: Any
) -> Cells:
    """Return the cells of a model at a load [N] as NumPy arrays, for levers of a number type of NumPy.

    `stiff` are the stiffnesses of the pieces of a pad [N/m], or the load [N] of a `Pad.at_load`.
    """
    compiled = model.compiled
    kind = model.patch.bristles, model.patch.anisotropic, compiled.sort
    numbers = compiled.numbers()[: KINDS[kind].rows - KINDS[kind].pad]
    levers = numbers.astype(precision)
    remainder = model.patch.positions.T - positions_of(np, levers.astype(float))
    pad: Any = model.pad
    stiff = pad and pad.pieces(model.patch, model.law)
    if isinstance(pad, AtLoad):
        stiff = np.array(pad.normal_force)
    common = pad and pad.compliance(model.patch)
    weights = model.patch.weights(normal_force)
    return Cells(levers, weights, remainder, stiff, kind, common)


def positions_of(xp, levers):
    """Return the positions of the cells to the digits of their levers, x then y [m], `[2, N]`."""
    if len(levers) < 5:
        return levers[:2]
    xx, xy, yy, x, y = (levers[k] for k in range(5))
    return xp.stack([xx * y - xy * x, xy * y - yy * x], 0) / (xx * yy - xy * xy)


def _lever(shape: Cells) -> tuple[CellKind, tuple[Any, ...]]:
    """Return the kind of the cells, and the numbers of their levers."""
    kind = KINDS[shape.kind]
    return kind, tuple(shape.levers[k] for k in range(kind.numbers))


def _bristle(xp, name: str, law: Any, shape: Cells, z, u, load, *dt):
    """Return two arrays `[..., d, N]`, the results of a function of the bristles."""
    kind = KINDS[shape.kind]
    # The source of discs names components.
    vector = Vector if kind.element.size == 2 else split
    if kind.leans:
        law = Leaning(law, Vector(shape.levers[-2:]))  # pyright: ignore[reportArgumentType]
    elif kind.pad:
        law = Elastic(law, shape.stiff, shape.weights * load)
    found = xp.over(getattr(kind.element, name))(law, vector(z), vector(u), *dt)
    return tuple(joined(xp, each) for each in found)


# ---------------------------------------------------------------------- steps


def wide(state):
    """Return a state as bristles `[..., d, N]`, which it is."""
    return state


narrow = wide
"""Return bristles `[..., d, N]` as a state, which they are."""


def drive(xp, law: LawNumbers, shape: Cells, twist) -> tuple[Any]:
    """Return the velocities that the cells see at a twist `[..., d, N]`, as a tuple of this array."""
    kind, lever = _lever(shape)
    seen = xp.over(kind.lever.seen)(lever, split(twist[..., None]))
    return (joined(xp, seen),)


def evaluate(xp, law: LawNumbers, shape: Cells, z, by, load):
    """Return the rates of the bristles, and the tractions per unit load."""
    return _bristle(xp, "evaluate", law, shape, z, *by, load)


def advance(xp, law: LawNumbers, shape: Cells, z, by, load, dt):
    """Return the bristles after `dt` of a constant twist, and the tractions per unit load."""
    return _bristle(xp, "step", law, shape, z, *by, load, dt)


def wrench(xp, shape: Cells, pull):
    """Return the wrench about the origin per unit load `[..., 3]`."""
    kind, lever = _lever(shape)
    found = xp.over(kind.lever.wrench)(lever, split(shape.weights * pull))
    return xp.concatenate([each.sum(-1) for each in found], -1)
