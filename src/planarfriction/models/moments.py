"""The moment model: three states for each part of a patch, which are moments of its bristle field."""

from __future__ import annotations

import functools
from dataclasses import KW_ONLY, dataclass, field
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.compiled.reduced import REDUCED
from planarfriction.errors import InvalidValueError
from planarfriction.laws.base import refuse_creep, refuse_rate_law
from planarfriction.models.part_shapes import ReducedShapes
from planarfriction.models.reduced_map import POINT, ReducedShape, is_point
from planarfriction.models.three_states import ThreeStateModel
from planarfriction.patch.parts import labels_of

MOST_SEGMENTS, MOST_SPEEDS = 256, 64
"""Sizes of the maps that are taken: some 0.6 GB for a fixed shape; errors fall with their fourth power."""

MOST_PARTS = 1024
"""Parts that are taken with maps of 24 segments or less, a GB; of larger ones as many as take that."""


@dataclass(frozen=True, eq=False)
class MomentModel(ThreeStateModel):
    """First moments of the bristle field of a patch, three states for each of its parts (`ReducedModel(parts=...)`).

    With `V_G = F V`, `|V_G|` the root mean square of the cells' speeds, and the patch's own steady state `z_ss(V)`, the
    sum over its cells at their own speeds: `zdot = V_G - beta (lambda (z - s z_ss) + s V_G)`, `s = z.z_ss/|z_ss|^2`,
    `lambda = |V_G|^2/(V_G.z_ss)`, `W = -F' (sigma_0 z + sigma_1 zdot + sigma_2 V_G) f_N`; beta as for one bristle, from
    `|z|/|z_ss|` and the angle between z and z_ss. Pre-sliding stiffness, viscous friction, steady sliding and
    translation are exact. State: `(z_x, z_y, z_theta)` [m]; the third is the moment divided by the radius of gyration
    of the pressure.

    With several `parts`, each is a patch with moments of its own, and the state is `[parts, 3]`. They share the twist
    and the load; the wrench is the sum of theirs. With as many parts as cells this is the distributed model
    (docs/physics.md).

    `z_ss` comes from a stored map over direction and speed with continuous slopes. A patch that depends on the load has
    maps at a series of loads, which are interpolated; they are computed when a load is needed (see `LoadFamily`). The
    state is kept when the shape changes. If one cell carries all but a millionth of the load, the contact is a point
    without torque about it.

    With direction-dependent friction, `|V_G|` is the root mean square of `|B_i V|` (see `ContactPatch.levers`), and
    `z_ss` sums `u/|u| + a`; with an asymmetry the maps are twice as large. The asymmetry affects z_ss alone:
    deflections are measured from z = 0, not from `a g/sigma_0` as in the distributed model.

    Raises InvalidValueError for a patch with all of its load on one cell, more parts than cells, and settings out of
    range.
    """

    _kind = REDUCED

    _: KW_ONLY
    parts: Any = 1
    """Number of compact parts, each with its own moments and map, up to the number of cells that carry load; "auto"
    means 6 for slender or separate shapes, 8 for others whose pressure has a peak, else 4."""
    segments: int = 24
    """Squares of the map along a quarter of a face of its cube; 24 give a median error of 1e-5 of z_ss."""
    speeds: int = 16
    """Number of speeds in the map, for the Stribeck effect."""
    load_error: float = 4e-3
    """Largest error of z_ss from interpolating maps over the load, of each part relative to the whole patch [-]; 0
    computes a map for each load, which is slow."""
    labels: np.ndarray = field(init=False, repr=False, compare=False)
    """Part to which each cell belongs, `[N]`."""

    def __post_init__(self) -> None:
        super().__post_init__()
        refuse_rate_law(self.law, "ReducedModel in parts")
        refuse_creep(self.law, "ReducedModel in parts")  # its stored steady state is that of bristles without creep
        check_maps(self)
        parts = _count_of(self.parts, int(MOST_PARTS * min(1.0, 24.0 / self.segments) ** 2))
        if not self.patch.depends_on_load and is_point(self.patch):
            shown = f"{1.0 - self.patch.weights().max():.1g} of it"
            raise InvalidValueError("patch", f"carry more than {POINT} of its load outside its heaviest cell", shown)
        if parts is not None and parts > self.patch.cells:
            raise InvalidValueError("parts", f"be at most the {self.patch.cells} cells that can carry load", parts)
        object.__setattr__(self, "labels", labels_of(self.patch, parts))
        object.__setattr__(self, "parts", int(self.labels.max()) + 1)
        _ = self.shapes

    @property
    def state_shape(self) -> tuple[int, ...]:
        """`(3,)`, or `(parts, 3)` with several parts."""
        return (3,) if self.parts == 1 else (self.parts, 3)

    def shape_at(self, normal_force: float | None) -> ReducedShape:
        """Return second moments of slip and stored steady state of a model of one part at a load [N] (see `parts_at`).

        Raises InvalidValueError as `shapes_at` does.
        """
        return self.shapes_at([normal_force])[0]

    def shapes_at(self, loads) -> list[ReducedShape]:
        """Return the shapes at many loads [N] at once (see `shape_at`), which is cheaper than one by one.

        Raises InvalidValueError for a model in parts, and for loads that are not > 0.
        """
        if self.parts > 1:
            raise InvalidValueError(
                "parts", "be 1 for shape_at and shapes_at (parts_at gives the shape of each part)", self.parts
            )
        return [part.shape for (part,) in self.shapes.at(loads)]

    @property
    def load_rungs(self) -> list[float]:
        """Loads [N] for which maps have been computed so far, if the patch depends on the load."""
        return self.shapes.rungs

    @functools.cached_property
    def shapes(self) -> ReducedShapes:
        """Shapes of the parts at any load."""
        maps = self.law.numbers.gamma, self.segments, self.speeds
        return ReducedShapes(self.patch, self.labels, maps, self.load_error)

    @property
    def _labels(self) -> np.ndarray:
        return self.labels


def check_maps(model: Any) -> None:
    """Check and convert the settings of the maps of a model."""
    object.__setattr__(model, "segments", validation.count("segments", model.segments, 4, MOST_SEGMENTS))
    object.__setattr__(model, "speeds", validation.count("speeds", model.speeds, 5, MOST_SPEEDS))
    object.__setattr__(model, "load_error", validation.non_negative("load_error", model.load_error))


def _count_of(parts: Any, most: int) -> int | None:
    """Return a number of parts, None for "auto"."""
    if isinstance(parts, str):
        if parts != "auto":
            raise InvalidValueError("parts", 'be "auto" or an integer >= 1', validation.quoted(parts))
        return None
    return validation.count("parts", parts, at_most=most)
