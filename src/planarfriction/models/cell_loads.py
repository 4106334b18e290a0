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

from planarfriction._engine.cells.gathering import (
    COVERED,
    COVERED_BEFORE,
    Bearing,
    gather,
)
from planarfriction._engine.compiler.memory import StructBuffer
from planarfriction._engine.records.pressing import Pressing
from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.patch.discs import Membership

NOTHING = np.zeros(0)
"""Numbers that do not change."""


class Cells(NamedTuple):
    """Cells of a patch, and the bristles that stand for them."""

    members: Membership
    """Cells of each bristle."""
    bearing: StructBuffer
    """The same, as compiled loops read them (see `gathering.Bearing`)."""
    rooms: list[Any]
    """Memory for steps, which threads take and give back (see `CompiledModel.step_borne`)."""

    @classmethod
    def alone(cls, bristles: Any) -> Cells:
        """Return cells each of which is a bristle of its own, which does not move."""
        every = np.arange(len(bristles.patch.positions))
        members = Membership(every, np.ones(len(every)), every)
        return cls.of(members, bristles, np.ones(len(every)))

    @classmethod
    def of(
        cls,
        members: Membership,
        bristles: Any,
        stiffness: np.ndarray,
        levers: np.ndarray | None = None,
    ) -> Cells:
        """Return cells in `bristles`, of a machine form; those of a pad have a `stiffness` `[N]`, in any unit.

        `levers` `[4, N]` are shares of the load, lever coordinates and own second moments of cells, if bristles move.
        """
        (cells, parted, begins) = members
        whole = bristles.numbers()
        (rows, n) = whole.shape
        begins = np.append(begins, len(cells))
        owner = np.repeat(np.arange(n), np.diff(begins))
        shares = np.zeros(0)
        if bristles.of_pad:
            shares = parted * stiffness[cells] / members.sums(stiffness)[owner]
        first = 3 if bristles.patch.anisotropic else 0
        moments = np.zeros(0)
        if levers is not None:
            (share, x, y, squares) = levers[:, cells]
            x, y = ((-y, x) if first else (x, y)) - whole[first : first + 2, owner]
            seconds = x * x + y * y + squares
            moments = (parted * share * [np.ones_like(x), x, y, seconds]).T.copy()
        count = int(cells.max()) + 1
        bearing = Bearing(
            count, n, rows, first, np.array(cells), begins, np.array(parted), shares, moments, whole
        )  # fmt: skip
        return cls(members, StructBuffer(bearing), [])

    @property
    def count(self) -> int:
        """Number N of cells."""
        return self.bearing.record.count

    def spread(self, discs: np.ndarray) -> np.ndarray:
        """Return slopes `[..., N]` by the loads of cells from those by the loads of discs `[..., n]`."""
        (cells, parted, begins) = self.members
        slopes = np.zeros((self.count, *discs.shape[:-1]))
        sizes = np.diff(begins, append=len(cells))
        parts = np.repeat(discs, sizes, axis=-1) * parted
        np.add.at(slopes, cells, np.moveaxis(parts, -1, 0))
        return np.moveaxis(slopes, 0, -1)

    def under(self, loads: Any, cover: Any = None) -> Pressing:
        """Return the discs under `loads` `[..., N]` [N], now or (before, now), with the pressed shares of cells.

        Raises InvalidValueError for loads of another shape, negative or not finite, for shares outside [0, 1], and for
        shares of 0 where there is load.
        """
        loads = _pair("loads", loads, self.count)
        cover = _pair("cover", cover, self.count)
        for each in cover:
            if each is not None and (largest := each.max(initial=0.0)) > 1.0:
                raise InvalidValueError("cover", "be in [0, 1]", float(largest))
        (*given, known) = seen(loads, cover)
        shapes = [each.shape for each in given]
        batch = validation.common_shape("loads", shapes, "broadcast with cover")
        given = tuple(np.broadcast_to(each, batch).flatten() for each in given)
        own = self.bearing.record
        (*lead, _) = batch
        weights = np.empty((*lead, own.bristles))
        numbers = kept = None
        if own.stiffness.size or own.moments.size:
            numbers = np.broadcast_to(own.whole, (*lead, *own.whole.shape)).copy()
        if own.stiffness.size:
            kept = np.empty_like(weights)
        pressing = Pressing(np.empty(lead), weights, numbers, kept)
        rows = [NOTHING if each is None else each.reshape(-1) for each in pressing]
        gather(self.bearing.words, given, known, *rows)
        if (pressing.load < 0.0).any():
            raise InvalidValueError("cover", "be > 0 if a cell is loaded", 0.0)
        return pressing


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


def seen(loads: Any, cover: Any) -> tuple[Any, Any, Any, Any, int]:
    """Return loads and covers, now and before, as `gathering.bear` reads them."""
    (earlier, now) = in_time(loads)
    (before, covered) = in_time(cover)
    known = 0 if covered is None else COVERED
    if known and before is None and earlier is None:
        before = covered
    known += 0 if before is None else COVERED_BEFORE
    earlier = now if earlier is None else earlier
    covered = now if covered is None else covered
    return now, earlier, covered, earlier if before is None else before, known


def _pair(
    name: str, value: Any, count: int
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Return the arrays before, or None, and now, or two times None."""
    if value is None:
        return None, None
    pair = in_time(value)
    if pair[1] is None:
        raise InvalidValueError(name, "be an array or (before, now)", value)
    (before, now) = (
        None if each is None else _checked(name, each, count) for each in pair
    )
    return before, now


def _checked(name: str, value: Any, count: int) -> np.ndarray:
    array = validation.non_negative_numbers(name, value)
    if array.shape[-1:] != (count,):
        rule = f"have shape [..., {count}], one number for each cell"
        raise InvalidValueError(name, rule, f"shape {list(array.shape)}")
    return array
