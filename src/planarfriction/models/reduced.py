"""The reduced model: the moments of the bristle field, three states."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.kernels import reduced_contact, reduced_step
from planarfriction.kernels.pointers import place_of
from planarfriction.kernels.records import rows_of
from planarfriction.kernels.reduced_contact import ReducedContact, Shape
from planarfriction.laws.base import refuse_creep
from planarfriction.models.base import PackedModel
from planarfriction.models.load_family import LoadFamily
from planarfriction.models.reduced_map import POINT, ReducedShape, is_point, reduced_shape
from planarfriction.models.three_states import ThreeStateModel

MOST_SEGMENTS, MOST_SPEEDS = 256, 64
"""Sizes of the maps that are taken: some 0.6 GB for a fixed shape; errors fall with their fourth power."""

_TOGETHER = 32
"""Loads whose shapes are asked for at once."""


@dataclass(frozen=True, eq=False)
class ReducedModel(ThreeStateModel):
    """Reduced LuGre friction: the first moments of the bristle field of the patch, three states.

    With `V_G = F V`, `|V_G|` the root mean square of the cells' speeds, and the patch's own steady state `z_ss(V)`, the
    sum over its cells at their own speeds: `zdot = V_G - beta (lambda (z - s z_ss) + s V_G)`, `s = z.z_ss/|z_ss|^2`,
    `lambda = |V_G|^2/(V_G.z_ss)`, `W = -F' (sigma_0 z + sigma_1 zdot + sigma_2 V_G) f_N`; beta as for one bristle, from
    `|z|/|z_ss|` and the angle between z and z_ss. Exact: pre-sliding stiffness, viscous friction, steady sliding, and
    translation. State: `(z_x, z_y, z_theta)` [m]; the third is the moment over the radius of gyration of the pressure.

    `z_ss` comes from a stored map over direction and speed with continuous slopes. A patch that depends on the load has
    maps at a ladder of loads, blended in between; they are built where loads are asked for (see `LoadFamily`). The
    state is kept when the shape changes. Where one cell carries all but a millionth of the load, the contact is a point
    without torque about it.

    Friction that depends on the direction: `|V_G|` is the root mean square of `|B_i V|` (see `ContactPatch.levers`),
    and `z_ss` sums `u/|u| + a`; an asymmetry takes maps of twice the size. It enters z_ss alone: bristles are measured
    from z = 0, and not from `a g/sigma_0` as those of the distributed model are.
    """

    _kernels = reduced_step

    segments: int = 24
    """Squares of the map along a quarter of a face of its cube; 24 leave errors of 1e-5 (median) of z_ss."""
    speeds: int = 14
    """Nodes of the map over the speed, for the Stribeck part."""
    load_error: float = 4e-3
    """Largest relative error of z_ss from blending maps over the load; 0 builds a map for each load, which is slow."""

    def __post_init__(self) -> None:
        super().__post_init__()
        refuse_creep(self.law, "ReducedModel")  # its stored steady state is that of bristles without creep
        object.__setattr__(self, "segments", validation.count("segments", self.segments, 4, MOST_SEGMENTS))
        object.__setattr__(self, "speeds", validation.count("speeds", self.speeds, 5, MOST_SPEEDS))
        object.__setattr__(self, "load_error", validation.non_negative("load_error", self.load_error))
        if not self.patch.depends_on_load:
            if is_point(self.patch):
                shown = f"{1.0 - self.patch.weights().max():.1g} of it"
                raise InvalidValueError("patch", f"carry more than {POINT} of its load beside its heaviest cell", shown)
            _ = self._reference

    def shape_at(self, normal_force: float | None) -> ReducedShape:
        """Second moments of slip and stored steady state at a load [N]; recent loads are remembered."""
        return self.shapes_at([normal_force])[0]

    def shapes_at(self, loads) -> list[ReducedShape]:
        """`shape_at` of many loads [N], which costs less than one by one."""
        if not self.patch.depends_on_load:
            return [self._reference for _ in loads]
        if isinstance(loads, np.ndarray) and (loads > 0.0).all() and (loads < np.inf).all():
            loads = loads.tolist()  # one by one takes longer than all else
        else:
            loads = [validation.positive_load("normal_force", load) for load in loads]
        return self._family.shapes(loads) if self.load_error > 0.0 else [self._built_at(load) for load in loads]

    @property
    def load_rungs(self) -> list[float]:
        """Loads [N] at which maps have been built so far, of a patch that depends on the load."""
        return self._family.rungs

    def _shapes_at(self, loads: Sequence[float | None]) -> Iterator[ReducedShape]:
        for first in range(0, len(loads), _TOGETHER):
            yield from self.shapes_at(loads[first : first + _TOGETHER])

    def _arrays(self, shape: ReducedShape) -> tuple[np.ndarray, ...]:
        return (shape.data,) if shape.other is None else (shape.data, shape.other)

    def _records(self, shapes: Sequence[ReducedShape], radius: float | None = None) -> PackedModel:
        maps = {id(data): data for shape in shapes for data in (shape.data, shape.other) if data is not None}
        at = {name: place_of(data) for name, data in maps.items()}
        data = np.array([at[id(shape.data)] for shape in shapes])
        other = np.array([at[id(shape.data if shape.other is None else shape.other)] for shape in shapes])
        factors = np.array([shape.factor for shape in shapes])[:, *np.triu_indices(3)]
        numbers = np.column_stack([factors, [shape.blend for shape in shapes]])
        record = ReducedContact(self.law.numbers, Shape(*numbers[0]), 0, 0)
        rows = rows_of(record, len(shapes), shape=numbers, data=data, other=(other - data) // 8)
        radius = max(shape.contact_radius for shape in shapes) if radius is None else radius
        natural = np.full(3, self.law.largest_deflection)
        kept = tuple(maps.values())
        return PackedModel(reduced_contact.FUNCTIONS, rows, 3, reduced_contact.LINEAR, natural, radius, kept)

    # ------------------------------------------------------------------ one shape

    @functools.cached_property
    def _reference(self) -> ReducedShape:
        return reduced_shape(self.patch, None, self.law.numbers.gamma, self.segments, self.speeds)

    @functools.cached_property
    def _family(self) -> LoadFamily:
        return LoadFamily(self.patch, self.law.numbers.gamma, self.segments, self.speeds, self.load_error)

    def _built_at(self, load: float) -> ReducedShape:
        def build() -> ReducedShape:
            return reduced_shape(self.patch, load, self.law.numbers.gamma, self.segments, self.speeds)

        return self._recent.get(load, build)

    def _shapes_of(self, loads: np.ndarray):
        values = np.unique(loads[loads > 0.0])
        if self.load_error > 0.0:
            self.shapes_at(values)  # all at once
        return super()._shapes_of(values)

    def _maps(self, shape: ReducedShape) -> tuple[np.ndarray, np.ndarray]:
        if shape.other is None:
            return np.zeros(3, dtype=int), shape.data
        # compiled loops reach both maps from the one that lies first in memory: they take no negative numbers
        apart = (place_of(shape.other) - place_of(shape.data)) // shape.data.itemsize
        return np.array([max(-apart, 0), max(apart, 0), 0]), shape.data if apart > 0 else shape.other

    def _levers(self, shape: ReducedShape) -> tuple[np.ndarray, np.ndarray]:
        return shape.factor, shape.factor

    def _rate_slopes(self, shape: ReducedShape, lin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        by_z, by_v = (lin[:, at : at + 9].reshape(-1, 3, 3) for at in (reduced_contact.BY_Z, reduced_contact.BY_V))
        return by_z, by_v @ shape.factor
