"""Pressure laws: how the normal load is distributed over a patch. Only ratios matter; the patch scales to the load."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from planarfriction import formulas
from planarfriction._support import validation
from planarfriction._support.equality import ByValue, Checked, checked
from planarfriction.errors import InvalidValueError, shown
from planarfriction.families import PRESSURES

SAME_DISTANCE = 1e-9
"""Relative difference below which two cells are equally far from the origin (rounding: 1e-16, cells: 1e-2)."""


class Pressure(Checked):
    """Base of the pressure laws: a relative pressure at each position, which may depend on the normal force."""

    law: ClassVar[str] = ""
    """Name of the law in files."""

    @property
    def depends_on_load(self) -> bool:
        """True if the shape of the pressure, and not only its scale, changes with the normal force."""
        return False

    def relative(
        self, positions: np.ndarray, normal_force: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the relative pressure at `positions` `[N, 2]` [m], at any scale [-].

        Shape `[N]`; for laws that depend on the load `[..., N]` for `normal_force` `[...]`, all > 0 [N].
        """
        raise NotImplementedError

    def ever_loaded(
        self, positions: np.ndarray, between: tuple[float, float] | None = None
    ) -> np.ndarray:
        """Return which of `positions` `[N, 2]` [m] can carry pressure at any load, or one `between` two [N], `[N]`."""
        return self.relative(positions) > 0.0

    def only(self, kept: np.ndarray) -> Pressure:
        """Return the law for the cells of a patch that are `kept`, `[N]` of bool."""
        return self

    def repeated(self, times: int) -> Pressure:
        """Return the law for a patch whose cells are each divided into `times` new ones."""
        return self

    def to_dict(self) -> dict[str, Any] | list[float]:
        """Return the law as plain data: `{"law": name, parameter: value, ...}`, or a list of one pressure per cell."""
        table: dict[str, Any] = {"law": self.law}
        for field in dataclasses.fields(self):  # pyright: ignore
            value = getattr(self, field.name)
            if isinstance(value, (tuple, np.ndarray)):
                value = np.asarray(value).tolist()
            if value is not None:
                table[field.name] = value
        return table

    @staticmethod
    def from_dict(data: Mapping[str, Any]) -> Pressure:
        """Return the law described by `{"law": name, parameter: value, ...}`.

        Raises InvalidValueError if this is not such a table, or the law does not exist.
        """
        if not isinstance(data, Mapping) or "law" not in data:
            raise InvalidValueError(
                "pressure", f"be a table with law = {' or '.join(PRESSURES)}", data
            )
        kind = PRESSURES.choose(data["law"])
        given = {name: value for name, value in data.items() if name != "law"}
        fields = dataclasses.fields(kind)
        needed = [each.name for each in fields if each.default is dataclasses.MISSING]
        names = [each.name for each in fields]
        validation.keys(f"{kind.law} pressure", given, needed, names)
        return kind(**given)


@dataclass(frozen=True)
class Uniform(Pressure):
    """The same pressure everywhere on the patch."""

    law = "uniform"

    def relative(
        self, positions: np.ndarray, normal_force: np.ndarray | None = None
    ) -> np.ndarray:
        return np.ones(len(positions))


@dataclass(frozen=True)
class LinearGradient(Pressure):
    """Pressure that changes linearly over the patch: `p ~ 1 + gx x + gy y`.

    A patch on which it would be negative anywhere is refused.

    Raises InvalidValueError for gradients that are not finite.
    """

    law = "linear_gradient"
    gradient: tuple[float, float]
    """(gx, gy): change of the pressure per metre, relative to the pressure at the origin [1/m]."""

    def __post_init__(self) -> None:
        gradient = validation.vector("gradient", self.gradient, 2)
        self._set(gradient=tuple(gradient.tolist()))

    def relative(
        self, positions: np.ndarray, normal_force: np.ndarray | None = None
    ) -> np.ndarray:
        gx, gy = self.gradient
        return 1.0 + gx * positions[:, 0] + gy * positions[:, 1]


@dataclass(frozen=True, kw_only=True)
class SoftFinger(Pressure):
    """Soft fingertip whose contact grows with the load: `p(s) ~ (1 - (s/R)^k)^(1/k)`, `R = min(c f_N^n, radius_max)`.

    s is the distance from the origin. Give exactly one of `k` and `k_per_newton` (`k = k_per_newton f_N`). With `n = 0`
    and a constant `k` the shape is fixed. A cell is loaded if its position is inside R; if none is, the nearest ones
    share the load.

    Raises InvalidValueError for a parameter out of range, and unless one of `k` and `k_per_newton` is given.

    Sources: Xydas and Kao 1999; Waltersson and Karayiannidis 2024.
    """

    law = "soft_finger"
    c: float = checked(validation.positive)
    """Radius of the contact at 1 N [m]."""
    n: float = checked(validation.non_negative, default=0.0)
    """Growth of the radius with the load [-]: 1/3 for Hertz contact, 0 for a radius that does not grow."""
    k: float | None = checked(validation.positive, default=None)
    """Exponent of the profile [-]: 2 for Hertz contact; larger values give a flatter profile."""
    k_per_newton: float | None = checked(validation.positive, default=None)
    """Exponent of the profile per normal force [1/N]."""
    radius_max: float | None = checked(validation.positive, default=None)
    """Largest radius [m], or None."""

    def __post_init__(self) -> None:
        if (self.k is None) == (self.k_per_newton is None):
            given = f"k={shown(self.k)}, k_per_newton={shown(self.k_per_newton)}"
            raise InvalidValueError(
                "SoftFinger", "have exactly one of k and k_per_newton", given
            )
        super().__post_init__()
        if self.n > 1.0:
            rule = "be at most 1: a contact does not grow faster than its load"
            raise InvalidValueError("n", rule, self.n)

    @property
    def depends_on_load(self) -> bool:
        return self.n != 0.0 or self.k is None

    def radius(self, normal_force: ArrayLike) -> np.ndarray:
        """Return the contact radius `R = min(c f_N^n, radius_max)` [m] at `normal_force` `[...]` [N].

        Raises InvalidValueError for a load below zero.
        """
        load = validation.non_negative_numbers("normal_force", normal_force)
        return self._radius(load)

    def _radius(self, load: np.ndarray) -> np.ndarray:
        # A radius of 0 would divide by zero.
        with np.errstate(over="ignore", under="ignore"):
            radius = np.maximum(self.c * load**self.n, validation.SMALLEST)
        most = np.inf if self.radius_max is None else self.radius_max
        return np.minimum(radius, most)

    def exponent(self, normal_force: ArrayLike) -> np.ndarray:
        """Return the exponent `k` of the profile [-] at `normal_force` `[...]` [N].

        Raises InvalidValueError for a load below zero.
        """
        load = validation.non_negative_numbers("normal_force", normal_force)
        return self._exponent(load)

    def _exponent(self, load: np.ndarray) -> np.ndarray:
        if self.k_per_newton is None:
            return np.full_like(load, self.k)
        return np.maximum(self.k_per_newton * load, validation.SMALLEST)

    def relative(
        self, positions: np.ndarray, normal_force: np.ndarray | None = None
    ) -> np.ndarray:
        load = np.array([1.0]) if normal_force is None else normal_force[..., None]
        k = self._exponent(load)
        distance, nearest = _distances(positions)
        ratio = distance / self._radius(load)
        inside = ratio < 1.0
        # In logarithms, relative to the largest value: at small k the profile underflows everywhere but at s = 0.
        with np.errstate(divide="ignore"):
            profile = formulas.soft_finger(np, np.where(inside, ratio, 0.5), k)
        profile = np.where(inside, profile, -np.inf)
        some = inside.any(-1, keepdims=True)
        profile = np.where(some, profile, np.where(nearest, 0.0, -np.inf))
        return np.exp((profile - profile.max(-1, keepdims=True)) / k)

    def ever_loaded(
        self, positions: np.ndarray, between: tuple[float, float] | None = None
    ) -> np.ndarray:
        if not self.depends_on_load:
            return super().ever_loaded(positions)
        distance, nearest = _distances(positions)
        highest = np.inf if between is None else between[1]
        largest = self._radius(np.array(1.0 if self.n == 0.0 else highest))
        return (distance < largest) | nearest


def _distances(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return distances `[N]` [m] from the origin, and which of them are the smallest."""
    distance = np.hypot(positions[:, 0], positions[:, 1])
    return distance, distance <= distance.min() * (1.0 + SAME_DISTANCE)


@dataclass(frozen=True, eq=False)
class PerCell(ByValue, Pressure):
    """One relative pressure for each cell of a patch: measured maps, profiles, functions evaluated at the cells.

    Raises InvalidValueError for what is not one row of finite numbers >= 0.
    """

    values: np.ndarray
    """Relative pressures, shape `[N]` [-]."""

    def __post_init__(self) -> None:
        values = pressure_array("pressure values", self.values, (None,))
        values.setflags(write=False)
        self._set(values=values)

    def relative(
        self, positions: np.ndarray, normal_force: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the pressures of the cells, `[N]`. Raises InvalidValueError for another number of positions."""
        if len(self.values) != len(positions):
            rule = f"have shape [{len(positions)}]"
            raise InvalidValueError("pressure", rule, f"shape [{len(self.values)}]")
        return self.values

    def only(self, kept: np.ndarray) -> PerCell:
        return PerCell(self.values[kept])

    def repeated(self, times: int) -> PerCell:
        return PerCell(np.repeat(self.values, times))

    def to_dict(self) -> list[float]:
        return self.values.tolist()


def as_law(pressure: Any, positions: np.ndarray) -> Pressure:
    """Return the pressure law meant by `pressure`: None (uniform), a law, a function `p(x, y)`, or `[N]` numbers."""
    if pressure is None:
        return Uniform()
    if isinstance(pressure, Pressure):
        return pressure
    if isinstance(pressure, (str, type)):
        rule = "be a law such as Uniform(), a function of x and y, or numbers"
        raise InvalidValueError("pressure", rule, repr(pressure))
    if callable(pressure):
        pressure = evaluated("pressure", pressure, positions.tolist())
    return PerCell(pressure_array("pressure", pressure, (len(positions),)))


def pressure_array(name: str, value: Any, shape: tuple[int | None, ...]) -> np.ndarray:
    """Return relative pressures as a new float array; a mask is taken as zeros and ones, and any scale will do."""
    if type(value) is np.ndarray and value.dtype.kind == "b":
        value = value.astype(float)
    return validation.array(name, value, shape, largest=np.inf)


def evaluated(
    name: str, function: Callable[..., Any], points: list[list[float]]
) -> list[Any]:
    """Return the values of a function that a user gave as `name`, at each of the points."""
    try:
        return [function(*point) for point in points]
    except Exception as error:
        rule = f"be a function of {' and '.join('xy'[: len(points[0])])} [m] that gives a number"
        given = f"{type(error).__name__}: {error}"
        raise InvalidValueError(name, rule, given) from error


def non_negative_array(
    name: str, value: Any, shape: tuple[int | None, ...]
) -> np.ndarray:
    """Return relative pressures as `pressure_array` does, or raise an error that shows the first below zero."""
    values = pressure_array(name, value, shape)
    return validation.non_negative_array(name, values, values.shape, largest=np.inf)


def check_pressure(values: np.ndarray, positions: np.ndarray) -> None:
    """Raise where a pressure is not finite or negative, naming the cell."""
    for rule, broken in (
        ("be finite", ~np.isfinite(values)),
        ("be >= 0", values < 0.0),
    ):
        if broken.any():
            index = int(broken.argmax())
            x, y = positions[index].tolist()
            given = f"{values[index]} at index {index}, position ({x:g}, {y:g}) m"
            raise InvalidValueError("pressure", rule, given)
