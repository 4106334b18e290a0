"""Pressure of discs that stand for the cells of a patch whose shape depends on the load."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction import validation
from planarfriction.equality import ByValue
from planarfriction.patch.pressure import Pressure

if TYPE_CHECKING:
    from planarfriction.patch.contact_patch import ContactPatch

PROBED = np.geomspace(1e-6, 1e6, 1001)
"""Loads [N] at which a patch is looked at to find where its shape changes."""

MOVED = 0.1
"""Share of the load that moves between cells from one load to the next over whose shapes cells are clustered."""


def loads_of_change(patch: ContactPatch) -> np.ndarray:
    """Return loads [N] from the lowest to the highest at which the shape changes, by equal changes of the shape."""
    moved = 0.5 * np.abs(np.diff(patch.weights(PROBED), axis=0)).sum(axis=1)
    changes = np.flatnonzero(moved > 0.0)
    if len(changes) == 0:  # the shape stays, or changes at loads beyond all that exist
        return PROBED[[0, -1]]
    span = slice(changes[0], changes[-1] + 2)
    total = np.r_[0.0, np.cumsum(moved[changes[0] : changes[-1] + 1])]
    wanted = np.linspace(0.0, total[-1], max(2, math.ceil(total[-1] / MOVED)) + 1)
    return np.exp(np.interp(wanted, total, np.log(PROBED[span])))


@dataclass(frozen=True, eq=False)
class SharedPressure(ByValue, Pressure):
    """Pressure of discs, each of which carries the load of its cells.

    A cell on a mirror of the patch may be parted between discs: disc k carries `sum_m parted_m w_(cell m)` over its
    memberships m, from `begins[k]` on.
    """

    law = "shared"
    patch: Any
    """Patch with all cells."""
    cells: Any
    """Cell of each membership, `[M]`."""
    parted: Any
    """Part of the cell that belongs to the disc, `[M]` [-]."""
    begins: Any
    """First membership of each disc, `[n]`."""
    areas: Any
    """Areas of the discs, `[n]` [m^2]."""

    def __post_init__(self) -> None:
        if isinstance(self.patch, Mapping):
            from planarfriction.patch.contact_patch import ContactPatch

            self._set(patch=ContactPatch.from_dict(self.patch))
        members = len(np.atleast_1d(self.cells))
        for name in ("cells", "begins"):
            numbers = validation.array(name, getattr(self, name), (members if name == "cells" else None,)).astype(int)
            self._set(**{name: numbers})
        self._set(parted=validation.non_negative_array("parted", self.parted, (members,)))
        self._set(areas=validation.positive_array("areas", self.areas, self.begins.shape))

    @property
    def depends_on_load(self) -> bool:
        return self.patch.depends_on_load

    def relative(self, positions: np.ndarray, normal_force: np.ndarray | None = None) -> np.ndarray:
        """Return the pressures of the discs, `[..., n]` for loads `[...]`."""
        loads = None if normal_force is None else np.asarray(normal_force, dtype=float)
        if not self.depends_on_load or loads is None:
            return self._sums(self.patch.weights(loads)) / self.areas
        different, place = np.unique(loads, return_inverse=True)
        return (self._sums(self.patch.weights(different)) / self.areas)[place.reshape(loads.shape)]

    def ever_loaded(self, positions: np.ndarray, between: tuple[float, float] | None = None) -> np.ndarray:
        loaded = self.patch.pressure.ever_loaded(self.patch.positions, between)
        return self._sums(loaded.astype(float)) > 0.0

    def _sums(self, values: np.ndarray) -> np.ndarray:
        """Return the sums `[..., n]` of values `[..., N]` of cells over those of each disc."""
        return np.add.reduceat(values[..., self.cells] * self.parted, self.begins, axis=-1)

    def to_dict(self) -> dict[str, Any]:
        fields = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        plain = {name: each.tolist() if isinstance(each, np.ndarray) else each for name, each in fields.items()}
        return {"law": self.law, **plain, "patch": self.patch.to_dict()}
