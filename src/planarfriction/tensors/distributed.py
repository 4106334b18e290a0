"""The distributed model over `xp`: the bristles of `kernels`, in every cell of a patch of points or discs.

A state `[..., d, N]` has d bristles in each of N cells, two in points and three in discs. Twists are `[..., 3]`; the
law's parameters and time steps are `[..., 1]`, or plain numbers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction.formulas import LawNumbers
from planarfriction.kernels import cells, disc_cells, discs, distributed_step, leaning_cells
from planarfriction.kernels.contacts import traction
from planarfriction.kernels.leaning_cells import Leaning
from planarfriction.kernels.vectors import plus
from planarfriction.models import DistributedModel
from planarfriction.patch import ContactPatch
from planarfriction.tensors.elements import over


def _point(law, z, u):
    """Return z' and the traction of a point that moves at u."""
    rate = plus(u, -cells._decay(law, z, u), z)
    return rate, traction(law, z, rate, u)


class Kind(NamedTuple):
    """Functions of a kind of cell, in numbers as `kernels` has them."""

    bristles: int
    lever: cells.Lever
    evaluate: Any
    step: Any


KINDS = {
    2: Kind(2, cells.POSITIONS, _point, distributed_step.cell),
    3: Kind(3, disc_cells.POSITIONS, discs.evaluate, discs.step),
    5: Kind(2, cells.LEVERS, _point, distributed_step.cell),
    6: Kind(3, disc_cells.LEVERS, discs.evaluate, discs.step),
    7: Kind(2, cells.LEVERS, leaning_cells.evaluate, leaning_cells.step),
    8: Kind(3, disc_cells.LEVERS, disc_cells.evaluate_leaning, disc_cells.step_leaning),
}
"""Kinds of cells by how many numbers each has: points, discs, both with a friction metric, and with asymmetry too.

Numbers are those of the lever, with the asymmetry behind them.
"""

class Cells(NamedTuple):
    """A patch as arrays."""

    levers: Any
    """Numbers of the cells as their levers read them: see `kernels.cells.Lever`, `[numbers, N]`."""
    weights: Any
    """Share of the load that each cell carries [-], `[N]`."""


def cells_of(patch: ContactPatch, law: Any, normal_force: float | None) -> Cells:
    """Return the cells of a patch at a load [N] as NumPy arrays."""
    numbers = DistributedModel(patch, law).compiled.numbers()
    if patch.anisotropic and not patch.asymmetric:
        numbers = numbers[:-2]
    return Cells(numbers, patch.weights(normal_force))


def obstacle(levers) -> str:
    """Return the reason why compiled rollouts do not take cells of such numbers, or an empty text."""
    return "for friction that is not the same forwards and backwards" if len(levers) > 6 else ""


def positions_of(xp, shape: Cells):
    """Return the positions of the cells, x then y [m], `[2, N]`."""
    if len(shape.levers) < 5:
        return shape.levers[:2]
    xx, xy, yy, x, y = (shape.levers[k] for k in range(5))
    return xp.stack([xx * y - xy * x, xy * y - yy * x], 0) / (xx * yy - xy * xy)


def _lever(shape: Cells) -> tuple[Any, ...]:
    count = len(shape.levers)
    return tuple(shape.levers[k] for k in range(count if count < 7 else count - 2))


def _law(law: LawNumbers, shape: Cells) -> Any:
    """Return the law as the bristles of the cells read it."""
    return Leaning(law, (shape.levers[-2], shape.levers[-1])) if len(shape.levers) > 6 else law


# ---------------------------------------------------------------------- steps


def split(state) -> tuple[Any, ...]:
    """Return the bristles of a state as a vector of arrays `[..., N]`."""
    return tuple(state[..., k, :] for k in range(state.shape[-2]))


def joined(xp, z):
    """Return a state of a vector of arrays."""
    return xp.stack(xp.broadcast_arrays(*z), -2)


def drive(xp, law: LawNumbers, shape: Cells, twist) -> tuple[Any, ...]:
    """Return the velocities that the cells see at a twist."""
    twist = tuple(twist[..., k, None] for k in range(3))
    return over(xp)(KINDS[len(shape.levers)].lever.seen)(_lever(shape), twist)


def evaluate(xp, law: LawNumbers, shape: Cells, z, u):
    """Return the rates of the bristles, and the tractions per unit load."""
    return over(xp)(KINDS[len(shape.levers)].evaluate)(_law(law, shape), z, u)


def advance(xp, law: LawNumbers, shape: Cells, z, u, dt):
    """Return the bristles after `dt` of a constant twist, and the tractions per unit load."""
    return over(xp)(KINDS[len(shape.levers)].step)(_law(law, shape), z, u, dt)


def wrench(xp, shape: Cells, pull):
    """Return the wrench about the origin per unit load `[..., 3]`."""
    pull = tuple(shape.weights * each for each in pull)
    found = over(xp)(KINDS[len(shape.levers)].lever.wrench)(_lever(shape), pull)
    return xp.stack([each.sum(-1) for each in found], -1)
