"""The physical parameters of a model as one vector, and as the rows that compiled loops read."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.bristles.law import LAW
from planarfriction._engine.cells import cells_rollout
from planarfriction._engine.cells.cell_kinds import rollouts_of_cells
from planarfriction._engine.cells.rollouts import ShapesByLoad
from planarfriction._engine.published import published_step
from planarfriction._engine.published.published_rollouts import (
    gradient,
    rollout,
    sensitivities,
    tangent,
)
from planarfriction._engine.records.packed import cells_by_load
from planarfriction._engine.records.pressing import Pressing
from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.geometry import transformed
from planarfriction.laws.base import is_rate_law
from planarfriction.models import DistributedModel, ReducedModelPublished
from planarfriction.models.base import FrictionModel, refuse_common
from planarfriction.models.reduced_published import axes_of

PARAMETERS = (
    *cells_rollout.PARAMETERS,
    "contact_radius",
    "second_moment",
    "centre_x",
    "centre_y",
)
"""Parameters of `ReducedModelPublished`, in the order of their vector; units as in `LuGre`, [m], [m^2], [m], [m]."""

POSITIVE = ("sigma_0", "mu_c", "mu_s", "v_s", "gamma", "contact_radius")
NON_NEGATIVE = ("sigma_1", "sigma_2", "second_moment")
"""Parameters by their ranges; the breakaway ratio is in [0, 1), the centre of pressure anywhere."""


class RolloutFunctions(NamedTuple):
    """Parameters and compiled rollouts of one kind of model."""

    names: tuple[str, ...]
    """Names of its parameters."""
    columns: np.ndarray
    """Column of each parameter in a row."""
    rollout: Callable[..., None]
    gradient: Callable[..., None]
    sensitivities: Callable[..., None]
    tangent: Callable[..., None]
    """Compiled loops (see `cells.rollouts`), which add to their outputs but write the state."""


_COLUMNS = np.array([published_step.NAMES.index(name) for name in PARAMETERS])
PUBLISHED = RolloutFunctions(
    PARAMETERS, _COLUMNS, rollout, gradient, sensitivities, tangent
)
"""`ReducedModelPublished`."""


@functools.cache
def _cells(size: int, turned: bool, sort: str) -> RolloutFunctions:
    """Return the rollouts of `DistributedModel` of points, size 2, or of discs, 3 (see `cell_loops.KINDS`)."""
    return RolloutFunctions(
        cells_rollout.PARAMETERS,
        np.array(cells_rollout.COLUMNS),
        *rollouts_of_cells(size, turned, sort),
    )


class PackedRollout(NamedTuple):
    """A model as compiled loops see it."""

    family: RolloutFunctions
    rows: np.ndarray
    """Numbers of law and shape `[..., N]`, with the batch axes of the parameters."""
    shapes: ShapesByLoad | Callable[[np.ndarray, bool], ShapesByLoad]
    """Limit surface or cells; a function of loads where cells follow the load (see `CompiledDistributed.at_loads`)."""
    axes: np.ndarray | None = None
    """Symmetric `[3, 3]`, or None: twists go in through it, wrenches come out."""
    inner: tuple[int, ...] = (3,)
    """Shape of the state of one contact."""
    springs: float = 1.0
    """See `cells.rollouts.Inputs`."""
    batch: tuple[int, ...] = ()
    """Axes `[..., 1 or T]` of the rows of `shapes`, if contacts or steps differ in the weights of cells."""
    bristles: Any = None
    """Machine form of the bristles of a model with cells, which can bear given loads."""

    def under(self, given: Pressing) -> PackedRollout:
        """Return the model under given loads `[..., T]`."""
        rows = given.spread(given.load.shape)
        numbers = self.bristles.numbers_under(rows)
        shapes = cells_by_load(numbers, rows.weights, kept=rows.kept)
        return self._replace(shapes=shapes, batch=given.load.shape)

    def turned(self, vectors: np.ndarray) -> np.ndarray:
        """Turn twists into the axes of the compiled loops, or wrenches back, `[..., 3]`."""
        return vectors if self.axes is None else transformed(self.axes, vectors)


def parameter_names(model: Any) -> tuple[str, ...]:
    """Return the names of the P parameters of a model, in the order of the parameter vector.

    `ReducedModelPublished` has `PARAMETERS`, `DistributedModel` the parameters of the law.

    Raises InvalidValueError for a model that has no rollouts.
    """
    return _family(model).names


def parameters_of(model: Any) -> np.ndarray:
    """Return the parameters of a model `[P]`; the breakaway ratio of plain bristles has no effect.

    Raises InvalidValueError for a model that has no rollouts.
    """
    packed = pack(model)
    return packed.rows[packed.family.columns]


def pack(model: Any, parameters: Any = None) -> PackedRollout:
    """Return a model as compiled loops see it, with `parameters` `[..., P]` if given, else its own.

    A friction coefficient `mu_s` below `mu_c`, which a law refuses, is let through: the formulas are smooth there.
    A model that is packed already, as the tensor front ends hold them, is taken as it is.
    """
    packed = model if isinstance(model, PackedRollout) else _packed(model)
    if parameters is None:
        return packed
    values = _checked(parameters, packed.family.names)
    rows = np.broadcast_to(
        packed.rows, (*values.shape[:-1], packed.rows.shape[-1])
    ).copy()
    rows[..., packed.family.columns] = values
    if packed.springs == 0.0:  # `sigma_0` cancels at that of the pieces' `stiff`
        rows[..., 0] = packed.rows[..., 0]
    return packed._replace(rows=rows)


def _family(model: Any) -> RolloutFunctions:
    model = getattr(model, "reduction", model)
    if isinstance(model, ReducedModelPublished):
        return PUBLISHED
    if isinstance(model, DistributedModel) and not is_rate_law(model.law):
        return _cells(
            model.patch.bristles, model.patch.anisotropic, model.compiled.sort
        )
    kind = (
        "cells with a RateLaw"
        if isinstance(model, DistributedModel)
        else type(model).__name__
    )
    raise InvalidValueError("model", "be one that has compiled rollouts", kind)


def made_before(model: Any) -> Any:
    """Return what `pack` made of a model before, or the model itself."""
    if not isinstance(model, FrictionModel):
        return model
    compiled = model.reduction.__dict__.get("compiled")
    return getattr(compiled, "rollouts", None) or model


def is_compiled(model: Any) -> bool:
    """Return True for a model that compiled rollouts know."""
    try:
        _family(model)
    except InvalidValueError:
        return False
    return not _refusal(model.reduction)


def _refusal(model: Any) -> tuple[str, str, Any] | None:
    """Return the rule that keeps a model from compiled rollouts, as `InvalidValueError` takes it, or None."""
    if isinstance(model, DistributedModel) or not model.depends_on_load:
        return None
    return (
        "model",
        "have a shape that does not follow the load, or be a ReducedModel: a fixed patch, or on_load_change='keep'",
        f"on_load_change={model.on_load_change!r}",
    )


def _packed(model: Any) -> PackedRollout:
    """Return a model as compiled loops see it, packed once: models do not change."""
    _family(model)  # knows some alone
    model = model.reduction
    if model.compiled.rollouts is None:
        model.compiled.rollouts = _packed_anew(model)
    return model.compiled.rollouts


def _packed_anew(model: Any) -> PackedRollout:
    refusal = _refusal(model)
    if refusal is not None:
        raise InvalidValueError(*refusal)
    law = model.law.numbers
    if isinstance(model, DistributedModel):
        refuse_common(model, "rollouts")
        return bristles_of(model)
    shape = model.shape_at(1.0)
    surface = shape.surface.numbers
    axes = None if (shape.root == np.eye(2)).all() else shape.axes
    return _on_surface(
        np.array([*law, *shape.numbers]), surface.kind, surface.size, surface.data, axes
    )


def bristles_of(model: DistributedModel) -> PackedRollout:
    """Return a `DistributedModel` at the twist of the face of its pad as compiled loops see it."""
    cells: Any = model.compiled.bristles
    at_loads = cells.at_loads
    shapes = at_loads if model.depends_on_load else at_loads(np.ones(1), False)
    return PackedRollout(
        _family(model),
        np.array(model.law.numbers),
        shapes,
        inner=cells.state_shape,
        springs=cells.springs,
        bristles=cells,
    )


def _on_surface(
    row: np.ndarray, kind: int, size: int, data: np.ndarray, axes: np.ndarray | None
) -> PackedRollout:
    none = np.zeros((1, 0))
    return PackedRollout(
        PUBLISHED,
        row,
        ShapesByLoad(np.array([kind, 0, size]), none, none, data, none),
        axes,
    )


def pack_surface(
    elasto_plastic: bool,
    kind: int,
    size: int,
    data: np.ndarray,
    root: np.ndarray | None = None,
) -> PackedRollout:
    """Return a `ReducedModelPublished` by its limit surface, for rollouts at given parameters of law and shape."""
    row = np.array(
        [*_any_law(elasto_plastic), *np.zeros(len(published_step.NAMES) - LAW)]
    )
    axes = None if root is None else axes_of(root)
    return _on_surface(row, kind, size, np.ascontiguousarray(data, dtype=float), axes)


def pack_cells(
    kind: tuple[int, bool, str],
    elasto_plastic: bool,
    of_law: bool,
    weights: np.ndarray,
    levers: np.ndarray,
    stiffness: Any = None,
) -> PackedRollout:
    """Return a `DistributedModel` by its cells and their weights `[..., N]`, for rollouts at given parameters.

    `kind` is a key of `cell_loops.KINDS`, `levers` are the numbers of the cells `[numbers, N]`. Of a pad `stiffness` is
    that of its pieces `[N]` [N/m], or if it is that `of_law`, the load [N] at which it is.

    Raises InvalidValueError for contacts with different weights on a pad with the stiffness of the law.
    """
    weights = np.asarray(weights, dtype=float)
    levers = np.asarray(levers, dtype=float)
    rows = weights.reshape(-1, weights.shape[-1])
    same = len(rows) > 0 and (rows == rows[0]).all()
    if same:
        rows = rows[:1]
    if stiffness is not None:
        if of_law and len(rows) > 1:
            rule = "be those of all contacts, on a pad with the stiffness of the law (or method='eager')"
            raise InvalidValueError("weights", rule, f"{len(rows)} different ones")
        # at a `sigma_0` of 1
        stiff = stiffness * rows[0] if of_law else stiffness
        levers = np.vstack([levers, stiff])
    return PackedRollout(
        _cells(*kind),
        np.array(_any_law(elasto_plastic)),
        cells_by_load(levers[None], rows),
        inner=(kind[0], weights.shape[-1]),
        springs=1.0 if stiffness is None or of_law else 0.0,
        batch=() if same else (*weights.shape[:-1], 1),
    )


def _any_law(elasto_plastic: bool) -> LawNumbers:
    return LawNumbers(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, float(elasto_plastic))


def _checked(parameters: Any, names: tuple[str, ...]) -> np.ndarray:
    values = validation.numbers("parameters", parameters)
    if values.shape[-1:] != (len(names),):
        raise InvalidValueError(
            "parameters",
            f"have shape [..., {len(names)}]",
            f"shape {list(values.shape)}",
        )
    for name, column in zip(names, np.moveaxis(values, -1, 0), strict=True):
        low = float(column.min(initial=np.inf))
        high = float(column.max(initial=-np.inf))
        if not np.isfinite(column).all():
            raise InvalidValueError(name, "be finite", "NaN or infinity")
        check_range(name, low, high)
    return values


def check_range(name: str, low: float, high: float) -> None:
    """Raise InvalidValueError unless a parameter may have values from `low` to `high`."""
    if name in POSITIVE and not low > 0.0:
        raise InvalidValueError(name, "be > 0", low)
    if name in NON_NEGATIVE and not low >= 0.0:
        raise InvalidValueError(name, "be >= 0", low)
    if name == "breakaway_ratio" and not (low >= 0.0 and high < 1.0):
        raise InvalidValueError(name, "be in [0, 1)", low if low < 0.0 else high)
