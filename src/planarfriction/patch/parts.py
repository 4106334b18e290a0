"""A patch in compact parts: which cells belong together, and some of the cells as a patch of their own."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planarfriction.equality import ByValue
from planarfriction.patch.grid import point_shares
from planarfriction.patch.pressure import Pressure

if TYPE_CHECKING:
    from planarfriction.patch.contact_patch import ContactPatch

SAME = 1e-9
"""Relative difference of two second moments below which they are a tie: far above rounding."""

ON_LINE = 1e-7
"""Angle [rad] below which two cells lie on one line through the middle, and share of the largest distance from there
within which a cell lies in the middle: far above rounding."""

FEW, MANY, MOST = 4, 6, 8
"""Numbers of parts that `automatic` chooses from."""

WORTH = 0.75
"""Share of what `FEW` parts leave of the second moment, down to which `MANY` have to come.

Parts of slender and of separate shapes leave `1/n^2`, of which 4/9; those of broad ones `1/n` at best, of which 2/3,
and of even ones, which six parts divide unevenly, 3/4 and more.
"""


PEAKED = 6.0
"""Kurtosis `<d^4>` of the load, d the distance from the centre of pressure in units in which its second moments are 1
along each axis, above which `MOST` parts are taken.

An even ellipse has 16/3, an even rectangle 5.6, a paraboloid under a square root (Hertz) 5.7; a cone 6.3, a Gaussian 8.
Where the pressure peaks, the bristles of a part differ most around the peak, and four parts meet there.
"""


def split(positions: np.ndarray, weights: np.ndarray, parts: int) -> np.ndarray:
    """Return the labels `[N]`, 0 to parts - 1, of N cells in compact parts; with `parts` >= N each cell is its own.

    Again and again the part with the largest second moment `sum(w |rho - CoP|^2)` is halved by the line through its
    centre of pressure that takes most of it away: `|s|^2 (1/w_one + 1/w_other)`, s the sum of `w (rho - CoP)` over one
    side. Gaps attract the line, so that separate pads tend to come out whole. Parts turn, move, mirror and scale with
    the cells. Of equal lines (a square, a disc) the one wins that separates most along the way from the middle of the
    patch to that of the part, and of those the one that leaves the first cells together.
    """
    if parts >= len(positions):
        return np.arange(len(positions))
    labels = np.zeros(len(positions), dtype=int)
    w = weights / weights.sum()
    x = positions - w @ positions
    moments = [second_moment(x, w)]
    reach = np.sqrt(moments[0])
    for new in range(1, parts):
        largest = max(moments)
        old = next(k for k, moment in enumerate(moments) if moment >= largest * (1.0 - SAME))
        if largest <= 0.0:  # cells at one place: one by one
            old = int(np.bincount(labels).argmax())
        cells = np.flatnonzero(labels == old)
        outwards = w[cells] @ x[cells] / w[cells].sum()
        if np.hypot(*outwards) <= ON_LINE * reach:
            outwards = np.zeros(2)  # a part about the middle of the patch
        far_side = _far_side(x[cells], w[cells], outwards)
        labels[cells[far_side]] = new
        halves = cells[~far_side], cells[far_side]
        moments[old], newest = (second_moment(x[half], w[half]) for half in halves)
        moments.append(newest)
    return labels


def automatic(positions: np.ndarray, weights: np.ndarray) -> int:
    """Return the number of parts for "auto": `MANY` for slender or separate shapes that are `WORTH` it, else `FEW`.

    Of the others, those that are `PEAKED` take `MOST`.
    """
    count = len(positions)
    if count < MANY:
        return min(count, FEW)
    left = {}
    for parts in (FEW, MANY):
        labels = split(positions, weights, parts)
        cells = [labels == label for label in range(labels.max() + 1)]
        left[parts] = sum(second_moment(positions[part], weights[part]) for part in cells)
    if left[MANY] <= WORTH * left[FEW]:
        return MANY
    return MOST if count >= MOST and kurtosis(positions, weights) > PEAKED else FEW


def kurtosis(positions: np.ndarray, weights: np.ndarray) -> float:
    """Return the kurtosis `<(rho' C^-1 rho)^2>`, rho from the centre of pressure, with `C = <rho rho'>`."""
    w = weights / weights.sum()
    x = positions - w @ positions
    moments = (w[:, None] * x).T @ x
    if np.linalg.det(moments) <= ON_LINE**2 * moments.trace() ** 2:
        return 0.0  # all on one line
    return float(w @ np.einsum("ni,ij,nj->n", x, np.linalg.inv(moments), x) ** 2)


def second_moment(positions: np.ndarray, weights: np.ndarray) -> float:
    """Return `sum(w |rho - CoP|^2)`."""
    return float(weights @ ((positions - weights @ positions / weights.sum()) ** 2).sum(1))


def _far_side(x: np.ndarray, w: np.ndarray, outwards: np.ndarray) -> np.ndarray:
    """Return the cells beyond the best line through the centre of pressure, seen from the first cell; `[N]` of bool.

    A line that turns half a turn passes all cells, those in one direction at once: between two directions lies one
    candidate, whose sums differ from the last one's by the cells in between. Cells in the middle stay with the first.
    """
    r = x - w @ x / w.sum()
    distance = np.hypot(*r.T)
    if not distance.max() > 0.0:
        return np.arange(len(x)) > 0
    around = np.flatnonzero(distance > ON_LINE * distance.max())
    r, own = r[around] / distance.max(), w[around]
    ahead, turn = _passing(r)
    order = np.argsort(turn, kind="stable")
    last = np.flatnonzero(np.diff(turn[order], append=turn.max() + 1))
    moves = np.where(ahead, -own, own)[:, None] * np.column_stack([np.ones(len(r)), r])
    load, *s = (np.cumsum(moves[order], axis=0)[last] - moves[ahead].sum(0)).T  # on the side ahead of each line
    line, side = np.tile(np.arange(len(last)), 2), np.repeat([True, False], len(last))
    share = np.concatenate([load, own.sum() - load])
    gain = np.tile(s[0] ** 2 + s[1] ** 2, 2) * (1.0 / share + 1.0 / (w.sum() - share))
    pull = np.tile(np.abs(s[0] * outwards[0] + s[1] * outwards[1]), 2)
    if around[0] == 0:
        gain[(ahead[0] == (turn[0] > line)) == side] = 0.0  # the first cell stays
    best = gain >= gain.max() * (1.0 - SAME)
    best &= pull >= pull[best].max() * (1.0 - ON_LINE)
    chosen = np.ones(len(x), dtype=bool)
    for k in np.flatnonzero(best):
        cells = np.zeros(len(x), dtype=bool)
        cells[around] = (ahead == (turn > line[k])) == side[k]
        if chosen[np.argmax(cells != chosen)]:
            chosen = cells
    return chosen


def _passing(r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return True for cells ahead of a line that begins to turn `[N]`, and their ranks in the order of its passing."""
    angle = np.arctan2(r[:, 1], r[:, 0])
    lines = np.sort(angle % np.pi)
    gaps = np.diff(lines, append=lines[0] + np.pi)
    begin = lines[gaps.argmax()] + 0.5 * gaps.max()  # in the widest gap, away from all cells
    angle = (angle - begin) % (2.0 * np.pi)
    ahead = angle < np.pi
    along = np.where(ahead, angle, angle - np.pi)
    order = np.argsort(along)
    turn = np.empty(len(r), dtype=int)
    turn[order] = np.cumsum(np.diff(along[order], prepend=along[order[0]]) > ON_LINE)
    return ahead, turn


# ---------------------------------------------------------------------- parts of a patch


def labels_of(patch: ContactPatch, parts: int | None) -> np.ndarray:
    """Return `split` of the cells of a patch `[N]`, None for as many parts as `automatic` says.

    By the load where all loads spread alike; a patch that depends on the load is split once for all loads, by the areas
    of its cells. One friction metric for all cells: by the places at which they see spins (`lever_coordinates`).
    """
    positions = patch.positions
    if patch.root is not None and patch.root.ndim == 2:
        positions = np.stack(patch.lever_coordinates(*positions.T), -1)
    weights = patch.areas if patch.depends_on_load else patch.weights()
    return split(positions, weights, automatic(positions, weights) if parts is None else parts)


def part_of(patch: ContactPatch, cells: np.ndarray) -> ContactPatch:
    """Return the `cells` `[N]` (bool) of a patch as a patch, whose weights are their shares in their own load.

    A normal force is that of the whole patch. Where it leaves these cells without load, they carry none of it evenly.
    If the whole has `point_shares`, so has the part, of its own area: points and areas have the same centre in each
    part. Second moments that they cannot give (one or two rows of cells) are those of the areas at points.
    """
    whole = {field.name: getattr(patch, field.name) for field in dataclasses.fields(patch)}
    part = object.__new__(type(patch))  # what the whole has been checked for holds, and it has been warned of its size
    part.__dict__.update(whole, grid=None, outline=None)
    for name, of_one in (("positions", 1), ("areas", 0), ("metric", 2), ("asymmetry", 1)):
        values = whole[name]
        if values is not None and values.ndim > of_one:
            part.__dict__[name] = values[cells]
    part.__dict__["pressure"] = OfPart(patch.pressure, patch.positions, cells)
    if patch.point_shares is not None:
        part.__dict__["point_shares"] = point_shares(part.positions, part.areas, part.cell_size)
    if not patch.depends_on_load:
        weights = patch.tile_weights()[cells] * (1.0 if part.point_shares is None else part.point_shares)
        part.__dict__["_fixed_weights"] = weights / weights.sum()
    return part


@dataclass(frozen=True, eq=False)
class OfPart(ByValue, Pressure):
    """The pressure on some cells of a patch, as the whole patch has it there."""

    whole: Pressure
    positions: np.ndarray
    """Positions of all cells, `[N, 2]` [m]."""
    cells: np.ndarray
    """Mask of the cells that belong to the part, bool `[N]`."""

    @property
    def depends_on_load(self) -> bool:
        return self.whole.depends_on_load

    def relative(self, positions: np.ndarray, normal_force: np.ndarray | None = None) -> np.ndarray:
        pressure = self.whole.relative(self.positions, normal_force)[..., self.cells]
        return np.where((pressure > 0.0).any(-1, keepdims=True), pressure, 1.0)

    def ever_loaded(self, positions: np.ndarray, between: tuple[float, float] | None = None) -> np.ndarray:
        return np.ones(len(positions), dtype=bool)
