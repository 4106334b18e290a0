"""Pressure of discs that stand for the cells of a patch whose shape depends on the load."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction._support import validation
from planarfriction._support.equality import ByValue
from planarfriction.patch.disc_friction import disc_friction
from planarfriction.patch.pressure import Pressure

if TYPE_CHECKING:
    from planarfriction.patch.contact_patch import ContactPatch

PROBED = np.geomspace(1e-6, 1e6, 1001)
"""Loads [N] at which a patch is looked at to find where its shape changes."""

MOVED = 0.1
"""Share of the load that moves between cells from one load to the next over whose shapes cells are clustered."""

ROUNDS = 10
"""Largest number of times that shares are corrected."""

MOST_LOST = 0.8
"""Largest part of itself that a share loses in a correction, which is shortened to it."""

INDEPENDENT = 1e-10
"""Relative singular value below which sums over the discs count as dependent."""


def mean_weights(patch: ContactPatch) -> np.ndarray:
    """Return the mean of the weights of a patch over the loads at which its shape changes, `[N]`.

    Loads count as much as the radius of gyration of the contact: small contacts move little torque.
    """
    if not patch.depends_on_load:
        return patch.weights()
    loads = loads_of_change(patch)
    sizes = np.sqrt(patch.second_moment(loads))
    sizes = sizes if sizes.any() else np.ones_like(sizes)
    return sizes @ patch.weights(loads) / sizes.sum()


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
    """Pressure of discs, each of which carries about the load of its cells.

    A cell on a mirror of the patch may be parted between discs: disc k takes `sum_m parted_m w_(cell m)` over its
    memberships m, from `begins[k]` on. Where the shape depends on the load, centres and radii of clusters would move
    with it, but those of discs stay: the shares w then change by the least `sum (dw)^2/w` that gives the moments of all
    cells up to the second degree, and the contact radius. Changes that would make shares negative are shortened.
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
    radii: Any
    """Radii of the discs, `[n]` [m]."""

    def __post_init__(self) -> None:
        members = len(np.atleast_1d(self.cells))
        cells = validation.array("cells", self.cells, (members,)).astype(int)
        begins = validation.array("begins", self.begins, (None,)).astype(int)
        parted = validation.non_negative_array("parted", self.parted, (members,))
        radii = validation.non_negative_array("radii", self.radii, begins.shape)
        self._set(cells=cells, begins=begins, parted=parted, radii=radii)

    @property
    def depends_on_load(self) -> bool:
        return self.patch.depends_on_load

    def relative(
        self, positions: np.ndarray, normal_force: np.ndarray | None = None
    ) -> np.ndarray:
        areas = self.sums(self.patch.areas)
        if not self.depends_on_load:
            return self.sums(self.patch.weights()) / areas
        loads = np.ones(()) if normal_force is None else normal_force
        different, place = np.unique(loads, return_inverse=True)
        shares = np.array(
            [self._at(positions, weights) for weights in self.patch.weights(different)]
        )
        return (shares / areas)[place.reshape(loads.shape)]

    def ever_loaded(
        self, positions: np.ndarray, between: tuple[float, float] | None = None
    ) -> np.ndarray:
        loaded = self.patch.pressure.ever_loaded(self.patch.positions, between)
        return self.sums(loaded.astype(float)) > 0.0

    def sums(self, values: np.ndarray) -> np.ndarray:
        """Return the sums `[..., n]` of values `[..., N]` of cells over those of each disc."""
        return np.add.reduceat(
            values[..., self.cells] * self.parted, self.begins, axis=-1
        )

    def _at(self, positions: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Return the shares of discs at `positions` `[n, 2]` for `weights` `[N]` of all cells."""
        shares = self.sums(weights)
        cells = self.patch.positions
        centre = weights @ cells
        radii = self.patch.radii
        squares = ((cells - centre) ** 2).sum(axis=1) + 0.5 * radii**2
        size = math.sqrt(weights @ squares) or 1.0
        wanted = _moments((cells - centre) / size, radii / size) @ weights
        moments = _moments((positions - centre) / size, self.radii / size)
        for _ in range(ROUNDS):
            gram = moments * shares @ moments.T
            missing = wanted - moments @ shares
            change = moments.T @ np.linalg.lstsq(gram, missing, rcond=INDEPENDENT)[0]
            length = min(1.0, MOST_LOST / max(-change.min(), MOST_LOST))
            shares = shares * (1.0 + length * change)
            if length == 1.0:
                break
        return shares

    def to_dict(self) -> dict[str, Any]:
        return {**super().to_dict(), "patch": self.patch.to_dict()}  # pyright: ignore[reportGeneralTypeIssues]


def _moments(places: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return the moments of unit loads on discs, up to degree 2 and the mean distance from the origin, `[7, n]`."""
    (x, y) = places.T
    own = 0.25 * radii**2
    distance = disc_friction(x**2 + y**2, radii**2)[2]
    return np.array([np.ones_like(x), x, y, x * x + own, x * y, y * y + own, distance])
