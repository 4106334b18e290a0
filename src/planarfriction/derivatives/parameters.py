"""The physical parameters of a reduced model as one vector, and as the rows that compiled loops read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction import validation
from planarfriction.compiled.shapes_by_load import ShapesByLoad
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.geometry import transformed
from planarfriction.kernels import published_rollout, published_step, reduced_loads, reduced_rollout, reduced_step
from planarfriction.models import ReducedModel, ReducedModelPublished
from planarfriction.models.map_sizes import MapSizes, maps_of
from planarfriction.models.published_shapes import PublishedShape, axes_of
from planarfriction.models.reduced_map import ReducedShape

PARAMETERS = (
    "sigma_0",
    "sigma_1",
    "sigma_2",
    "mu_c",
    "mu_s",
    "v_s",
    "gamma",
    "breakaway_ratio",
    "contact_radius",
    "second_moment",
    "centre_x",
    "centre_y",
)
"""Parameters of `ReducedModelPublished`, in the order of their vector; units as in `LuGre`, [m], [m^2], [m], [m]."""

_POSITIVE = ("sigma_0", "mu_c", "mu_s", "v_s", "gamma", "contact_radius")
_NON_NEGATIVE = ("sigma_1", "sigma_2", "second_moment")


class Family(NamedTuple):
    """Parameters and compiled roll-outs of one kind of model."""

    names: tuple[str, ...]
    """Names of its parameters."""
    columns: np.ndarray
    """Column of each parameter in a row."""
    rollout: Callable[..., None]
    gradient: Callable[..., None]
    sensitivities: Callable[..., None]
    tangent: Callable[..., None]
    """Compiled loops (see `kernels.rollouts`)."""


def _family_of(names: tuple[str, ...], numbers: tuple[str, ...], many: Any, one: Any) -> Family:
    columns = np.array([numbers.index(name) for name in names])
    return Family(names, columns, many.rollout, many.gradient, one.sensitivities, one.tangent)


PUBLISHED = _family_of(PARAMETERS, published_step.NAMES, published_rollout, published_step)
"""`ReducedModelPublished`."""

_OF_LAW = tuple(name for name in PARAMETERS[:8] if name != "gamma")

REDUCED = _family_of(_OF_LAW, reduced_step.NAMES, reduced_rollout, reduced_loads)
"""`ReducedModel`; gamma and the shape are built into its stored map."""

REDUCED_BY_LOAD = _family_of(_OF_LAW, reduced_step.NAMES, reduced_loads, reduced_loads)
"""The same where the shape follows the load."""


class Packed(NamedTuple):
    """A part of a reduced model as compiled loops see it; most models have one."""

    rows: np.ndarray
    """Numbers of law and shape `[..., N]`, batch axes as those of the parameters."""
    surface: np.ndarray
    """Kind, start and size of the limit surface, int [3]; where the maps of a shape begin."""
    data: np.ndarray
    """Numbers of the limit surface or of the map, flat."""
    family: Family = PUBLISHED
    share: float = 1.0
    """Share of the load [-]."""
    axes: np.ndarray | None = None
    """Symmetric `[3, 3]`, or None: twists go in through it, wrenches come out."""
    at_loads: Callable[[np.ndarray, bool], ShapesByLoad] | None = None
    """All parts at given loads, of a model whose shape depends on the load (see `CompiledThreeStates.at_loads`)."""

    def turned(self, vectors: np.ndarray) -> np.ndarray:
        """Turn twists into the axes of the compiled loops, or wrenches out of them, `[..., 3]`."""
        return vectors if self.axes is None else transformed(self.axes, vectors)


def parameter_names(model: Any) -> tuple[str, ...]:
    """Return the names of the P parameters of a reduced model, in the order of the parameter vector.

    Those of `ReducedModelPublished` are `PARAMETERS`. Those of `ReducedModel` are the parameters of the law without
    gamma, because its stored map depends on gamma, as it does on the shape of the patch.

    Raises InvalidValueError for a model that has no roll-outs.
    """
    return _family(model).names


def parameters_of(model: Any) -> np.ndarray:
    """Return the parameters of a reduced model `[P]`; the breakaway ratio of plain bristles has no effect.

    Raises InvalidValueError for a model that has no roll-outs.
    """
    packed = pack(model)[0]
    return packed.rows[packed.family.columns]


def pack(model: Any, parameters: Any = None) -> tuple[Packed, ...]:
    """Return the parts of a model as compiled loops see them, with `parameters` `[..., P]` if given, else its own.

    A friction coefficient `mu_s` below `mu_c`, which a law refuses, is let through: the formulas are smooth there.
    A model that is packed already, as the tensor front ends hold them, is taken as it is.
    """
    if isinstance(model, Packed):
        model = (model,)
    packed = model if isinstance(model, tuple) else _packed(model)
    if parameters is None:
        return packed
    values = _checked(parameters, packed[0].family.names)
    return tuple(_with(part, values) for part in packed)


def _with(packed: Packed, values: np.ndarray) -> Packed:
    row = np.broadcast_to(packed.rows, (*values.shape[:-1], packed.rows.shape[-1])).copy()
    row[..., packed.family.columns] = values
    return packed._replace(rows=row)


def _family(model: Any) -> Family:
    if isinstance(model, ReducedModel):
        return REDUCED
    if isinstance(model, ReducedModelPublished):
        return PUBLISHED
    raise InvalidValueError("model", "be a ReducedModel or a ReducedModelPublished", type(model).__name__)


def is_compiled(model: Any) -> bool:
    """Return True for a reduced model that compiled roll-outs know."""
    return isinstance(model, ReducedModel | ReducedModelPublished) and not _refusal(model)


def _refusal(model: ReducedModel | ReducedModelPublished) -> tuple[str, str, Any] | None:
    """Return the rule that keeps a model from compiled roll-outs, as `InvalidValueError` takes it, or None."""
    if not model.depends_on_load:
        return None
    if isinstance(model, ReducedModel):
        if model.load_error > 0.0:
            return None
        rule = "be > 0 for derivatives and parameters of roll-outs, which interpolate the shape over the load"
        return "load_error", rule, model.load_error
    return (
        "model",
        "have a shape that does not follow the load, or be a ReducedModel: a fixed patch, or on_load_change='keep'",
        f"on_load_change={model.on_load_change!r}",
    )


def _packed(model: Any) -> tuple[Packed, ...]:
    _family(model)
    refusal = _refusal(model)
    if refusal is not None:
        raise InvalidValueError(*refusal)
    law = model.law.numbers
    if not model.depends_on_load:
        return tuple(pack_shape(law, shape)._replace(share=share) for share, shape in model.parts_at(1.0))
    row = np.array([*law, *np.zeros(len(reduced_step.NAMES) - len(law))])
    part = Packed(
        row, np.zeros(3, dtype=int), np.zeros(0, dtype=np.float32), REDUCED_BY_LOAD, at_loads=model.compiled.at_loads
    )
    return (part,) * model.parts


def pack_shape(law: LawNumbers, shape: ReducedShape | PublishedShape) -> Packed:
    """Return a law and the shape of a patch at one load as compiled loops see them."""
    row = np.array([*law, *shape.numbers])
    if isinstance(shape, ReducedShape):
        return Packed(row, np.zeros(3, dtype=int), shape.data, REDUCED)
    numbers = shape.surface.numbers
    axes = None if (shape.root == np.eye(2)).all() else axes_of(shape.root)
    return Packed(row, np.array([numbers.kind, 0, numbers.size]), numbers.data, PUBLISHED, axes=axes)


def pack_maps(
    elasto_plastic: bool, sizes: Sequence[MapSizes], shares: np.ndarray, factors: np.ndarray, data: np.ndarray
) -> tuple[Packed, ...]:
    """Return a `ReducedModel` by its parts, for roll-outs at given parameters, which take the place of those here.

    `shares` `[P]` of the load, F `[P, 3, 3]`, and the maps one behind the other.
    """
    law, data = _any_law(elasto_plastic), np.ascontiguousarray(data, dtype=np.float32)
    shapes = (ReducedShape(factor, each) for factor, each in zip(factors, maps_of(data, sizes), strict=True))
    return tuple(
        pack_shape(law, shape)._replace(share=float(share)) for share, shape in zip(shares, shapes, strict=True)
    )


def pack_surface(
    elasto_plastic: bool, kind: int, size: int, data: np.ndarray, root: np.ndarray | None = None
) -> tuple[Packed]:
    """Return a `ReducedModelPublished` by its limit surface, for roll-outs at given parameters of law and shape."""
    row = np.array([*_any_law(elasto_plastic), *np.zeros(len(published_step.NAMES) - len(LawNumbers._fields))])
    data = np.ascontiguousarray(data, dtype=float)
    return (Packed(row, np.array([kind, 0, size]), data, PUBLISHED, axes=None if root is None else axes_of(root)),)


def _any_law(elasto_plastic: bool) -> LawNumbers:
    return LawNumbers(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, float(elasto_plastic))


def _checked(parameters: Any, names: tuple[str, ...]) -> np.ndarray:
    values = validation.numbers("parameters", parameters)
    if values.shape[-1:] != (len(names),):
        raise InvalidValueError("parameters", f"have shape [..., {len(names)}]", f"shape {list(values.shape)}")
    for name, column in zip(names, np.moveaxis(values, -1, 0), strict=True):
        low, high = float(column.min(initial=np.inf)), float(column.max(initial=-np.inf))
        if not np.isfinite(column).all():
            raise InvalidValueError(name, "be finite", "NaN or infinity")
        if name in _POSITIVE and not low > 0.0:
            raise InvalidValueError(name, "be > 0", low)
        if name in _NON_NEGATIVE and not low >= 0.0:
            raise InvalidValueError(name, "be >= 0", low)
        if name == "breakaway_ratio" and not (low >= 0.0 and high < 1.0):
            raise InvalidValueError(name, "be in [0, 1)", low if low < 0.0 else high)
    return values
