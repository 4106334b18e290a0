"""Numbers of joints that are estimated: their units and ranges, least squares over them, and their intervals."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

Values = Mapping[str, float]
"""Numbers by name."""


class Parameter(NamedTuple):
    """Range and scale of a number."""

    unit: str
    scale: float = 1e-4
    """Size at which a step of a search begins, where the start is smaller."""
    low: float = 0.0
    high: float = np.inf
    logarithmic: bool = False
    """True for a number that is searched by its logarithm."""


PARAMETERS = {
    "inertia": Parameter("kg m^2"),
    "offset": Parameter("rad", 0.02, -2.0 * np.pi, 2.0 * np.pi),
    "gravity": Parameter("N m"),
    "gravity_sin": Parameter("N m"),
    "gravity_cos": Parameter("N m"),
    "torque_offset": Parameter("N m", low=-np.inf),
    "delay": Parameter("s", 1e-3, -6e-3, 40e-3),
    "low_pass": Parameter("s", 1e-3, high=40e-3),
    "torque_gain": Parameter("N m/V", 1e-3, 1e-9),
    "back_emf": Parameter("N m s/rad", 1e-3),
    "mu_c": Parameter("N m", low=1e-9),
    "sigma_2": Parameter("N m s/rad"),
    "load": Parameter("-", 0.05, high=0.95),
    "load_external": Parameter("-", 0.05, high=0.95),
    "rise": Parameter("N m"),
    "v_s": Parameter("rad/s", 1.0, 1e-4, 1e3, True),
    "sigma_0": Parameter("N m/rad", 1.0, 1e-6, 1e9, True),
    "sigma_1": Parameter("N m s/rad"),
    "asymmetry": Parameter("N m", low=-np.inf),
    "viscous_asymmetry": Parameter("N m s/rad", low=-np.inf),
}
"""Numbers by name: `rise` is `mu_s - mu_c`, `load` is b_m, and b_e too where that is not estimated. Ranges are those of
fits to goals; those to torques may leave them, which then refuses the log."""

FINE = 1e-5
"""Share of the squared errors that a step of a search must gain, far below what one log more or less changes."""

DIFFERENCE = 1e-5
"""Step of differences, over the size of a number."""

FARTHEST = 30.0
"""Largest logarithm of a number."""


def slopes(
    errors: Callable[[Values], np.ndarray],
    values: Values,
    names: Sequence[str],
    here: np.ndarray,
) -> np.ndarray:
    """Compute the slopes of errors `[T]`, which are `here` now, by some numbers or their logarithms, `[T, P]`."""
    columns = []
    for name in names:
        step = DIFFERENCE * max(abs(values[name]), PARAMETERS[name].scale)
        factor = values[name] if PARAMETERS[name].logarithmic else 1.0
        columns.append(
            (errors({**values, name: values[name] + step}) - here) * factor / step
        )
    return np.column_stack(columns)


def least(
    errors: Callable[[Values], np.ndarray],
    start: Values,
    names: Sequence[str],
    bounded: bool,
    **settings: Any,
) -> dict[str, float]:
    """Return the numbers of least squared errors `[T]`, from a start, within their ranges if they are `bounded`."""
    from scipy.optimize import least_squares

    log = np.array([PARAMETERS[name].logarithmic for name in names])

    def by_name(x: np.ndarray) -> dict[str, float]:
        numbers = np.exp(np.clip(x, -FARTHEST, FARTHEST), out=x.copy(), where=log)
        return dict(zip(names, numbers.tolist(), strict=True))

    def coordinates(numbers: list[float]) -> np.ndarray:
        return np.log(numbers, out=np.array(numbers), where=log)

    ends = [
        coordinates([getattr(PARAMETERS[name], end) for name in names])
        for end in ("low", "high")
    ]
    x = coordinates([start[name] for name in names])

    @functools.lru_cache(maxsize=1)
    def at(coordinates: bytes) -> np.ndarray:
        return errors(by_name(np.frombuffer(coordinates)))

    found = least_squares(
        lambda x: at(x.tobytes()).copy(),
        np.clip(x, *ends) if bounded else x,
        lambda x: slopes(errors, by_name(x), names, at(x.tobytes())),
        ends if bounded else (-np.inf, np.inf),
        **{"x_scale": "jac", "ftol": FINE, **settings},
    )
    return by_name(found.x)


def quantile(freedom: int, share: float) -> float:
    """Return a quantile of Student's t."""
    from scipy.special import stdtrit  # `scipy.stats` takes a second to load

    return float(stdtrit(freedom, share))


AT_BOUND = 1e-3
"""Distance from a bound, over the size of a number or in its logarithm, within which an estimate ended there."""


def interval(name: str, value: float, reach: float) -> tuple[float, float] | None:
    """Return the interval of an estimate from its reach, by factors for a logarithm; None for one at its bound."""
    kind = PARAMETERS[name]
    if kind.logarithmic:
        if min(np.log(value / kind.low), np.log(kind.high / value)) < AT_BOUND:
            return None
        factor = float(np.exp(min(reach / value, 700.0)))
        return value / factor, value * factor
    near = AT_BOUND * max(abs(value), kind.scale)
    if kind.high - value < near or (kind.low < 0.0 and value - kind.low < near):
        return None
    return max(value - reach, kind.low), min(value + reach, kind.high)
