"""Arrays of Warp that kernels read and write by their addresses: shapes, parameters, and what was wrong in them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import warp as wp

from planarfriction._support import validation
from planarfriction.errors import InvalidValueError

PRECISIONS = {wp.float32: "float", wp.float64: "double"}
"""Names of precisions in C, by Warp's types."""


def precision_of(dtype: Any) -> str:
    """Return the name of a precision in C.

    Raises InvalidValueError for other types.
    """
    if dtype not in PRECISIONS:
        raise InvalidValueError("dtype", "be wp.float32 or wp.float64", dtype)
    return PRECISIONS[dtype]


def address(
    name: str, given: Any, shape: tuple[int, ...], dtype: Any, device: Any
) -> int:
    """Return the address of a contiguous array.

    Raises InvalidValueError for arrays of another shape, type or device.
    """
    if not isinstance(given, wp.array):
        raise InvalidValueError(name, "be an array of Warp", type(given).__name__)
    found = given.shape, given.dtype, given.device
    if found != (shape, dtype, device):
        rule = f"have shape {shape}, {dtype.__name__}, on {device}"
        raise InvalidValueError(
            name,
            rule,
            f"{found[0]}, {getattr(found[1], '__name__', found[1])}, {found[2]}",
        )
    if not given.is_contiguous:
        raise InvalidValueError(name, "be contiguous", f"strides {given.strides}")
    return given.ptr or 0


def parameter_rows(
    default: Mapping[str, float], given: Mapping[str, Any], count: int
) -> np.ndarray:
    """Return the parameters of each contact in a row, of all in one row if they share them.

    Raises InvalidValueError for parameters of another name or shape.
    """
    validation.keys("parameters", dict(given), (), default)
    values = {
        name: validation.finite_numbers(name, value) for name, value in given.items()
    }
    for name, value in values.items():
        if value.shape not in ((), (count,)):
            raise InvalidValueError(
                name, f"be a number or have shape ({count},)", value.shape
            )
    rows = count if any(value.shape for value in values.values()) else 1
    return np.stack(
        [np.broadcast_to(values.get(name, own), rows) for name, own in default.items()],
        axis=1,
    )


def check(status: wp.array[Any], wrong: Mapping[int, str], owners: str) -> None:
    """Wait for the device, and set the bits of `status` to zero.

    Raises InvalidValueError that names the first bits of `wrong` that are set, and the places.
    """
    found = status.numpy().copy()  # on the CPU, `numpy` gives the same memory
    status.zero_()
    places = np.flatnonzero(found)
    if len(places):
        names = " and ".join(
            text for bit, text in wrong.items() if found[places[0]] & bit
        )
        raise InvalidValueError(
            names,
            "be finite and in range",
            f"other numbers in {owners} {places.tolist()}",
        )
