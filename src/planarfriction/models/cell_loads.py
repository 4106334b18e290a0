"""Pressure that is given anew at each step, by the loads that the cells of a patch bear.

Each cell belongs to one disc for good, or is one. A disc has the load of its cells, and centre and second moment of the
part of it that is pressed. On a pad only that has stiffness, and cells that come into contact are unstressed: with the
stiffness k_f of cell f and its pressed share c_f (`cover`),

    K_i = sum_f k_f c_f,     z_i <- z_i sum_f k_f min(c_f, c_f before)/K_i.

The energy `K_i z_i^2/2` can only fall in this, however the pressure changes (docs/physics.md, "Elastic pads").
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.cells.gathering import Discs, gather
from planarfriction._engine.records.pressing import Pressing
from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.patch.discs import Membership


class Cells(NamedTuple):
    """Cells of a patch, and the discs that stand for them."""

    discs: Discs
    """Cells, and discs of them, in lever coordinates from `middle`; cells that are bristles of their own stay."""
    middle: np.ndarray
    """Middle of the cells `[2]` [m], so that little is lost where they lie far from the origin."""
    count: int
    """Number N of cells."""

    @classmethod
    def alone(cls, count: int, stiffness: np.ndarray | None = None) -> Cells:
        """Return cells each of which is a bristle of its own, which does not move."""
        every = np.arange(count)
        return cls.of(Membership(every, np.ones(count), every), stiffness)

    @classmethod
    def of(
        cls,
        members: Membership,
        stiffness: np.ndarray | None,
        discs: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None,
    ) -> Cells:
        """Return cells in discs; `discs` are their shares, places `[N, 2]` and own second moments, if these move."""
        count = int(members.cells.max()) + 1
        begins = np.append(members.begins, len(members.cells))
        stiffness = np.zeros(0) if stiffness is None else np.array(stiffness)
        middle = np.zeros(2)
        numbers = np.zeros((4, 0))
        if discs is not None:
            shares, places, squares = discs
            middle = places.mean(axis=0)
            x, y = (places - middle).T
            numbers = np.array([shares, x, y, x * x + y * y + squares])
        alike = members.cells, members.parted, begins
        held = Discs(*alike, stiffness, numbers, np.zeros((3, len(members.begins))))
        cells = cls(held, middle, count)
        if discs is not None:
            every = np.ones((1, count))
            held.whole[:] = cells._gathered(every, every, every)[2]
        return cells

    def loads(self, cells: np.ndarray) -> np.ndarray:
        """Return loads `[..., n]` of discs, or changes of them, from those of cells `[..., N]`."""
        parts = cells[..., self.discs.cells] * self.discs.parted
        return np.add.reduceat(parts, self.discs.begins[:-1], axis=-1)

    def spread(self, discs: np.ndarray) -> np.ndarray:
        """Return slopes `[..., N]` by the loads of cells from those by the loads of discs `[..., n]`."""
        slopes = np.zeros((self.count, *discs.shape[:-1]))
        parts = (
            np.repeat(discs, np.diff(self.discs.begins), axis=-1) * self.discs.parted
        )
        np.add.at(slopes, self.discs.cells, np.moveaxis(parts, -1, 0))
        return np.moveaxis(slopes, 0, -1)

    def under(self, loads: Any, cover: Any = None) -> Pressing:
        """Return the discs under `loads` `[..., N]` [N], now or (before, now), with the pressed shares of cells.

        Raises InvalidValueError for loads of another shape, negative or not finite, for shares outside [0, 1], and for
        shares of 0 where there is load.
        """
        (earlier, now) = _pair("loads", loads, self.count)
        (covered_before, covered) = (None, (now > 0.0).astype(float))
        if cover is not None:
            covered_before, covered = _pair("cover", cover, self.count)
        if covered_before is None:
            covered_before = covered if earlier is None else (earlier > 0.0) + 0.0
        largest = max(each.max(initial=0.0) for each in (covered, covered_before))
        if largest > 1.0:
            raise InvalidValueError("cover", "be in [0, 1]", float(largest))
        shapes = now.shape, covered.shape, covered_before.shape
        batch = validation.common_shape("loads", shapes, "broadcast with cover")
        given = [
            np.ascontiguousarray(np.broadcast_to(each, batch)).reshape(-1, self.count)
            for each in (now, covered, covered_before)
        ]
        if ((given[1] == 0.0) & (given[0] > 0.0)).any():
            raise InvalidValueError("cover", "be > 0 if a cell is loaded", 0.0)
        weights, pads, moved = self._gathered(*given)
        moved[:, :2] += self.middle[:, None]
        load = given[0].sum(-1)
        rows = load, weights, moved[:, :2], moved[:, 2], pads[:, 0], pads[:, 1]
        return Pressing(
            *(
                None
                if 0 in each.shape[1:]
                else each.reshape((*batch[:-1], *each.shape[1:]))
                for each in rows
            )
        )

    def _gathered(
        self, now: np.ndarray, cover: np.ndarray, before: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return what `gather` writes."""
        n = self.discs.whole.shape[1]
        weights = np.empty((len(now), n))
        pads = np.empty((len(now), 2, n if self.discs.stiffness.size else 0))
        moved = np.empty((len(now), 3, n if self.discs.numbers.size else 0))
        gather(now, cover, before, self.discs, weights, pads, moved)
        return weights, pads, moved


def sequence_of(name: str, value: Any, ends: tuple[int, ...]) -> tuple[Any, Any]:
    """Return what was before each step of a rollout, and what is then, of a value of shape `[..., *ends]`.

    The value may be a tuple of what was before the first step, `[..., N]`, and of the steps; else nothing changes then.
    """
    (first, value) = in_time(value)
    steps = validation.numbers(name, value)
    if steps.shape[-2:] != ends:
        wanted = ", ".join(map(str, ends))
        rule = f"have shape [..., {wanted}], the steps of the rollout and the cells"
        raise InvalidValueError(name, rule, f"shape {list(steps.shape)}")
    before = steps[..., :1, :]
    if first is not None:
        before = validation.numbers(name, first)[..., None, :]
        shapes = before.shape, steps[..., :1, :].shape
        lead = validation.common_shape(name, shapes)[:-2]
        before, steps = (
            np.broadcast_to(each, (*lead, *each.shape[-2:])) for each in (before, steps)
        )
    return np.concatenate([before, steps], axis=-2)[..., : ends[0], :], steps


def in_time(value: Any) -> tuple[Any, Any]:
    """Return what was before, or None, and what is now, of a value that may be both."""
    return value if isinstance(value, tuple) and len(value) == 2 else (None, value)


def _pair(name: str, value: Any, count: int) -> tuple[np.ndarray | None, np.ndarray]:
    """Return the arrays before, or None, and now."""
    pair = in_time(value)
    arrays = [None if each is None else _checked(name, each, count) for each in pair]
    if arrays[1] is None:
        raise InvalidValueError(name, "be an array or (before, now)", value)
    return arrays[0], arrays[1]


def _checked(name: str, value: Any, count: int) -> np.ndarray:
    array = validation.non_negative_numbers(name, value)
    if array.shape[-1:] != (count,):
        rule = f"have shape [..., {count}], one number for each cell"
        raise InvalidValueError(name, rule, f"shape {list(array.shape)}")
    return array
