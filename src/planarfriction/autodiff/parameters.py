"""The physical parameters of a reduced model as one vector, and as the rows that compiled loops read."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.kernels.law import law_numbers
from planarfriction.models import ReducedModelPublished
from planarfriction.patch.metric import refuse_anisotropy

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
"""Names of the parameters, in the order of their vector; units as in `LuGre`, [m], [m^2], [m], [m]."""

_POSITIVE = ("sigma_0", "mu_c", "mu_s", "v_s", "gamma", "contact_radius")
_NON_NEGATIVE = ("sigma_1", "sigma_2", "second_moment")

COLUMNS = np.array([0, 1, 2, 3, 4, 5, 6, 8, 11, 12, 9, 10])
"""Where each parameter stands in a row of `kernels.reduced_adjoint`; column 7 says which bristles these are."""


class Packed(NamedTuple):
    """A reduced model as compiled loops see it."""

    rows: np.ndarray
    """`[..., 13]`, batch axes as those of the parameters."""
    surface: np.ndarray
    """Kind, start and size of the limit surface, int [3]."""
    data: np.ndarray
    """Numbers of the limit surface, flat."""


def parameters_of(model: Any) -> np.ndarray:
    """Parameters of a reduced model, shape `[12]`; plain bristles have a breakaway ratio without effect."""
    return _model_row(model)[COLUMNS]


def pack(model: Any, parameters: Any = None) -> Packed:
    """The model as compiled loops see it, with `parameters` `[..., 12]` instead of its own if given.

    A friction coefficient `mu_s` below `mu_c`, which a law refuses, is let through: the formulas are smooth there.
    A model that is packed already, as the tensor front ends hold them, is taken as it is.
    """
    if isinstance(model, Packed):
        row, surface, data = model
    else:
        row, numbers = _model_row(model), model.shape_at(1.0).surface.numbers
        surface, data = np.array([numbers.kind, 0, numbers.size]), numbers.data
    if parameters is not None:
        values = _checked(parameters)
        row = np.broadcast_to(row, (*values.shape[:-1], len(row))).copy()
        row[..., COLUMNS] = values
    return Packed(row, surface, data)


def _model_row(model: Any) -> np.ndarray:
    if not isinstance(model, ReducedModelPublished):
        raise InvalidValueError("model", "be a ReducedModelPublished", type(model).__name__)
    if model.patch.depends_on_load and model.on_load_change != "keep":
        raise InvalidValueError(
            "model",
            "have a shape that does not follow the load: a patch of fixed shape, or on_load_change='keep'",
            f"on_load_change={model.on_load_change!r}",
        )
    refuse_anisotropy(model.patch, "derivatives of roll-outs")
    return np.array([*law_numbers(model.law), *model.shape_at(1.0).numbers])


def _checked(parameters: Any) -> np.ndarray:
    values = validation.numbers("parameters", parameters)
    if values.shape[-1:] != (len(PARAMETERS),):
        raise InvalidValueError("parameters", f"have shape [..., {len(PARAMETERS)}]", f"shape {list(values.shape)}")
    for name, column in zip(PARAMETERS, np.moveaxis(values, -1, 0), strict=True):
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
