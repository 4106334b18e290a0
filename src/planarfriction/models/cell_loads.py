"""Pressure that is given anew at each step, by the loads that the cells of a patch bear.

Each cell belongs to one disc for good, or is one. A disc has the load of its cells, and centre and second moment of the
part of it that is pressed. On a pad only that has stiffness, and cells that come into contact are unstressed: with the
stiffness k_f of cell f and its pressed share c_f (`cover`),

    K_i = sum_f k_f c_f,     z_i <- z_i sum_f k_f min(c_f, c_f before)/K_i.

The energy `K_i z_i^2/2` can only fall in this, so that no pressure, however it changes, makes energy (docs/pads.md).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.records.pressing import Pressing
from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.patch.discs import Membership


class Cells(NamedTuple):
    """Cells of a patch, and the discs that stand for them."""

    count: int
    """Number N of cells."""
    stiffness: np.ndarray | None = None
    """Stiffness of the cells on their pad `[N]`, but for a factor; None without a pad."""
    members: Membership | None = None
    """Discs of the cells; None where each cell is one of its own, which does not move."""
    places: np.ndarray | None = None
    """Lever coordinates of the cells `[N, 2]` [m]."""
    squares: np.ndarray | None = None
    """Second moments of the cells about themselves `[N]` [m2]."""
    shares: np.ndarray | None = None
    """Shares of the load of the patch `[N]`, by which discs have their centres."""

    def under(self, loads: Any, cover: Any = None) -> Pressing:
        """Return the discs under `loads` `[..., N]` [N], now or (before, now), with the pressed shares of cells.

        Raises InvalidValueError for loads of another shape, negative or not finite, for shares outside [0, 1], and for
        shares of 0 where there is load.
        """
        (earlier, now) = _pair("loads", loads, self.count)
        (covered_before, covered) = (None, (now > 0.0).astype(float))
        if cover is not None:
            covered_before, covered = _pair("cover", cover, self.count)
            largest = float(covered.max(initial=0.0))
            if largest > 1.0:
                raise InvalidValueError("cover", "be in [0, 1]", largest)
        if covered_before is None:
            covered_before = covered if earlier is None else (earlier > 0.0) + 0.0
        shapes = now.shape, covered.shape, covered_before.shape
        batch = validation.common_shape("loads", shapes, "broadcast with cover")
        now, covered, covered_before = (
            np.broadcast_to(each, batch) for each in (now, covered, covered_before)
        )
        if ((covered == 0.0) & (now > 0.0)).any():
            raise InvalidValueError("cover", "be > 0 where a cell bears load", 0.0)
        load = now.sum(-1)
        per_load = 1.0 / np.where(load > 0.0, load, 1.0)[..., None]
        places = radii = stiffer = kept = None
        if self.places is not None:
            places, radii = self._gathered(covered)
        if self.stiffness is not None:
            whole = self._sums(self.stiffness)
            pressed = self._sums(self.stiffness * covered)
            stays = self._sums(self.stiffness * np.minimum(covered, covered_before))
            stiffer = pressed / whole
            kept = np.divide(
                stays, pressed, out=np.zeros_like(stays), where=pressed > 0.0
            )
        return Pressing(load, self._sums(now) * per_load, places, radii, stiffer, kept)

    def _sums(self, values: np.ndarray) -> np.ndarray:
        return values + 0.0 if self.members is None else self.members.sums(values)

    def _gathered(self, cover: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return centres and radii of the pressed parts of the discs; those of all cells where nothing is pressed."""
        borne = self.shares * cover  # pyright: ignore[reportOptionalOperand]
        total = self._sums(borne)
        bare = total <= 0.0
        total = np.where(bare, self._sums(np.ones(self.count)), total)

        def mean(values: np.ndarray) -> np.ndarray:
            return (
                np.where(bare, self._sums(values), self._sums(borne * values)) / total
            )

        # About the middle, so that little is lost where the patch lies far from the origin.
        middle = self.places.mean(axis=0)  # pyright: ignore[reportOptionalMemberAccess]
        x, y = (self.places - middle).T
        centre = np.stack([mean(x), mean(y)], -1)
        second = mean(x * x + y * y + self.squares) - (centre**2).sum(-1)
        return centre + middle, np.sqrt(2.0 * np.maximum(second, 0.0))


def _pair(name: str, value: Any, count: int) -> tuple[np.ndarray | None, np.ndarray]:
    """Return the arrays before, or None, and now."""
    pair = value if isinstance(value, tuple) and len(value) == 2 else (None, value)
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
