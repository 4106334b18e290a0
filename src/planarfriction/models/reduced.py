"""The reduced model: three states, which are moments of the bristle field."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.kernels import reduced_contact, reduced_step, step_slopes
from planarfriction.kernels.pointers import place_of
from planarfriction.kernels.records import rows_of
from planarfriction.kernels.reduced_contact import ReducedContact, Shape
from planarfriction.laws.base import refuse_creep
from planarfriction.models.base import PackedModel
from planarfriction.models.part_shapes import Part, PartShapes, together
from planarfriction.models.reduced_map import POINT, ReducedShape, is_point, slip_factor
from planarfriction.models.shapes_by_load import ShapesByLoad, places_of, slopes_by_load
from planarfriction.models.three_states import ThreeStateModel
from planarfriction.patch.parts import labels_of, part_of

MOST_SEGMENTS, MOST_SPEEDS = 256, 64
"""Sizes of the maps that are taken: some 0.6 GB for a fixed shape; errors fall with their fourth power."""

MOST_PARTS = 1024
"""Parts that are taken with maps of 24 segments or less, a GB; of larger ones as many as take that."""

_TOGETHER = 32
"""Loads whose shapes are asked for at once."""


@dataclass(frozen=True, eq=False)
class ReducedModel(ThreeStateModel):
    """Reduced LuGre friction: the first moments of the bristle field of the patch, three states for each of its parts.

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

    _kernels = reduced_step
    step_function, jacobian_function = step_slopes.reduced, step_slopes.reduced_jacobian
    _shared = ("_parts",)

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
        refuse_creep(self.law, "ReducedModel")  # its stored steady state is that of bristles without creep
        object.__setattr__(self, "segments", validation.count("segments", self.segments, 4, MOST_SEGMENTS))
        object.__setattr__(self, "speeds", validation.count("speeds", self.speeds, 5, MOST_SPEEDS))
        object.__setattr__(self, "load_error", validation.non_negative("load_error", self.load_error))
        parts = _count_of(self.parts, int(MOST_PARTS * min(1.0, 24.0 / self.segments) ** 2))
        if not self.patch.depends_on_load and is_point(self.patch):
            shown = f"{1.0 - self.patch.weights().max():.1g} of it"
            raise InvalidValueError("patch", f"carry more than {POINT} of its load outside its heaviest cell", shown)
        if parts is not None and parts > self.patch.cells:
            raise InvalidValueError("parts", f"be at most the {self.patch.cells} cells that can carry load", parts)
        object.__setattr__(self, "labels", labels_of(self.patch, parts))
        object.__setattr__(self, "parts", int(self.labels.max()) + 1)
        _ = self._parts

    @property
    def state_shape(self) -> tuple[int, ...]:
        """`(3,)`, or `(parts, 3)` with several parts."""
        return (3,) if self.parts == 1 else (self.parts, 3)

    def shape_at(self, normal_force: float | None) -> ReducedShape:
        """Second moments of slip and stored steady state of a model of one part at a load [N]; see `parts_at`.

        Raises InvalidValueError as `shapes_at` does.
        """
        return self.shapes_at([normal_force])[0]

    def shapes_at(self, loads) -> list[ReducedShape]:
        """`shape_at` for many loads [N] at once, which is cheaper than one by one.

        Raises InvalidValueError for a model in parts, and for loads that are not > 0.
        """
        if self.parts > 1:
            raise InvalidValueError(
                "parts", "be 1 for shape_at and shapes_at (parts_at gives the shape of each part)", self.parts
            )
        return self._parts[0].at(self._checked(loads))

    def parts_at(self, normal_force: float | None) -> tuple[Part, ...]:
        """Share of the load and shape of each part at a load [N]; recent loads are cached.

        Raises InvalidValueError for a load that is not > 0.
        """
        if not self.patch.depends_on_load:
            return self._fixed_parts
        return self._parts_together([normal_force])[0]

    @property
    def load_rungs(self) -> list[float]:
        """Loads [N] for which maps have been computed so far, if the patch depends on the load."""
        return sorted({load for part in self._parts for load in part.rungs})

    def _checked(self, loads) -> list[float | None]:
        if not self.patch.depends_on_load:
            return list(loads)
        if isinstance(loads, np.ndarray) and (loads > 0.0).all() and (loads < np.inf).all():
            return loads.tolist()  # one by one takes longer than all else
        return [validation.positive_load("normal_force", load) for load in loads]

    def _parts_at(self, loads: Sequence[float | None]) -> Iterator[tuple[Part, ...]]:
        for first in range(0, len(loads), _TOGETHER):
            yield from self._parts_together(loads[first : first + _TOGETHER])

    def _parts_together(self, loads: Sequence[float | None]) -> list[tuple[Part, ...]]:
        """`parts_at` of loads [N]."""
        loads = self._checked(loads)
        shapes = zip(*(part.at(loads) for part in self._parts), strict=True)
        if self.parts == 1:
            return [(Part(1.0, shape),) for (shape,) in shapes]
        weights = self.patch.weights(None if loads[0] is None else np.array(loads)).reshape(-1, self.patch.cells)
        # rows that lie in one piece: NumPy sums others in an order that depends on how many there are
        each = (np.ascontiguousarray(weights[:, self.labels == k]) for k in range(self.parts))
        shares = np.stack([part.sum(-1) for part in each], -1).tolist()
        return [tuple(map(Part, *loaded)) for loaded in zip(shares, shapes, strict=True)]

    @property
    def _labels(self) -> np.ndarray:
        return self.labels

    # ------------------------------------------------------------------ parts

    @functools.cached_property
    def _parts(self) -> tuple[PartShapes, ...]:
        maps = self.law.numbers.gamma, self.segments, self.speeds
        cells = (self.labels == k for k in range(self.parts))
        patches = [self.patch] if self.parts == 1 else [part_of(self.patch, each) for each in cells]
        return tuple(PartShapes(patch, maps, self.load_error, self.parts) for patch in patches)

    @functools.cached_property
    def _fixed_parts(self) -> tuple[Part, ...]:
        return self._parts_together([None])[0]

    def _radius(self, load: float | None) -> float:
        return float(slip_factor(self.patch, load)[2, 2])

    def _arrays(self, shape: ReducedShape) -> tuple[np.ndarray, ...]:
        return (shape.data,) if shape.other is None else (shape.data, shape.other)

    def _packed(self, parts: Sequence[tuple[Part, ...]], widest: Sequence[float | None]) -> PackedModel:
        if self.parts == 1:
            return super()._packed(parts, widest)
        radius = max(map(self._radius, widest))
        each = [self._records([loaded[k].shape for loaded in parts], radius) for k in range(self.parts)]
        return together(each, np.array([[part.share for part in loaded] for loaded in parts]))

    def _records(self, shapes: Sequence[ReducedShape], radius: float) -> PackedModel:
        maps = {id(data): data for shape in shapes for data in (shape.data, shape.other) if data is not None}
        at = {name: place_of(data) for name, data in maps.items()}
        data = np.array([at[id(shape.data)] for shape in shapes])
        other = np.array([at[id(shape.data if shape.other is None else shape.other)] for shape in shapes])
        factors = np.array([shape.factor for shape in shapes])[:, *np.triu_indices(3)]
        numbers = np.column_stack([factors, [shape.blend for shape in shapes]])
        record = ReducedContact(self.law.numbers, Shape(*numbers[0]), 0, 0)
        kept = tuple(maps.values())
        rows = rows_of(record, len(shapes), shape=numbers, data=data, other=(other - data) // kept[0].itemsize)
        natural = np.full(3, self.law.largest_deflection)
        return PackedModel(reduced_contact.FUNCTIONS, rows, 3, reduced_contact.LINEAR, natural, radius, kept)

    def _maps(self, shape: ReducedShape) -> tuple[np.ndarray, np.ndarray]:
        if shape.other is None:
            return np.zeros(3, dtype=int), shape.data
        # compiled loops reach both maps from the one that lies first in memory: they take no negative numbers
        apart = (place_of(shape.other) - place_of(shape.data)) // shape.data.itemsize
        return np.array([max(-apart, 0), max(apart, 0), 0]), shape.data if apart > 0 else shape.other

    def _at_loads(self, loads: np.ndarray, slopes: bool) -> ShapesByLoad:
        parts = list(self._parts_at(loads.tolist()))
        shares = np.array([[part.share for part in loaded] for loaded in parts]).T
        shapes = [[loaded[k].shape for loaded in parts] for k in range(self.parts)]
        numbers, by_load = np.array([[shape.numbers for shape in each] for each in shapes]), None
        if slopes:
            found = [part.followed(loads.tolist(), each) for part, each in zip(self._parts, shapes, strict=True)]
            shapes = [[shape for shape, _ in each] for each in found]
            blends = np.array([[slope for _, slope in each] for each in found])
            by_load = [self._slopes(k, loads, numbers[k], shares[k], blends[k]) for k in range(self.parts)]
        maps = [(shape.data, shape.data if shape.other is None else shape.other) for each in shapes for shape in each]
        begin, data = places_of([data for pair in maps for data in pair])
        surface = np.zeros((*shares.shape, 3), dtype=int)
        surface[:, :, :2] = begin.reshape(*shares.shape, 2)
        by_load = np.zeros((*shares.shape, 8)) if by_load is None else np.array(by_load)
        return ShapesByLoad(np.ascontiguousarray(shares), surface, numbers, by_load, data)

    def _slopes(self, k: int, loads: np.ndarray, shape: np.ndarray, share: np.ndarray, blend: np.ndarray) -> np.ndarray:
        """Slopes of the numbers of part k and of its share by the load `[L, 8]`, given those of the blend."""
        mine, patch = self.labels == k, self._parts[k].patch

        def factor_and_share(loads: np.ndarray) -> np.ndarray:
            share = np.ones(len(loads)) if self.parts == 1 else self.patch.weights(loads)[:, mine].sum(-1)
            return np.column_stack([slip_factor(patch, loads)[:, *np.triu_indices(3)], share])

        middle = np.column_stack([shape[:, :6], share])
        return np.insert(slopes_by_load(factor_and_share, loads, middle), 6, blend, axis=1)

    def _levers(self, shape: ReducedShape) -> tuple[np.ndarray, np.ndarray]:
        return shape.factor, shape.factor

    def _rate_slopes(self, shape: ReducedShape, lin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        by_z, by_v = (lin[:, at : at + 9].reshape(-1, 3, 3) for at in (reduced_contact.BY_Z, reduced_contact.BY_V))
        return by_z, by_v @ shape.factor


def _count_of(parts: Any, most: int) -> int | None:
    """A number of parts, None for "auto"."""
    if isinstance(parts, str):
        if parts != "auto":
            raise InvalidValueError("parts", 'be "auto" or an integer >= 1', validation.quoted(parts))
        return None
    return validation.count("parts", parts, at_most=most)
