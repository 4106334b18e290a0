"""Parameters that can be identified: names, units, bounds, and how each enters the law, the patch and the model.

A *vector* is the model's own: `derivatives.PARAMETERS` in order. *Values* are the requested parameters by name; the
optimiser sees *coordinates*, in which a factor counts the same up and down (a logarithm) wherever a value must be > 0.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction.derivatives import PARAMETERS
from planarfriction.errors import InvalidValueError
from planarfriction.identify.logs import Linear
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.patch import ContactPatch
from planarfriction.patch.metric import refuse_anisotropy


@dataclass(frozen=True)
class Parameter:
    """Quantity that can be identified."""

    unit: str
    """SI unit."""
    low: float
    """Smallest value that the fit may try [unit]."""
    high: float
    """Largest value that the fit may try [unit]."""
    logarithmic: bool = True
    """True if the optimiser sees the logarithm of the quantity."""


LAW = {
    "mu_c": Parameter("-", 1e-3, 20.0),
    "mu_s": Parameter("-", 1e-3, 40.0),
    "v_s": Parameter("m/s", 1e-7, 10.0),
    "gamma": Parameter("-", 0.2, 8.0),
    "sigma_0": Parameter("1/m", 1.0, 1e9),
    "sigma_1": Parameter("s/m", 0.0, 1e6, logarithmic=False),
    "sigma_2": Parameter("s/m", 0.0, 1e3, logarithmic=False),
    "breakaway_ratio": Parameter("-", 0.0, 0.99, logarithmic=False),
}
"""Parameters of the friction law."""

SHAPE = {
    "contact_radius": Parameter("m", 1e-6, 10.0),
    "centre_x": Parameter("m", -10.0, 10.0, logarithmic=False),
    "centre_y": Parameter("m", -10.0, 10.0, logarithmic=False),
}
"""Parameters of the shape of the contact; `<rho^2>` follows the square of the contact radius."""

SOFT_FINGER = {
    "c": Parameter("m", 1e-6, 10.0),
    "n": Parameter("-", 0.0, 2.0, logarithmic=False),
    "k": Parameter("-", 0.1, 50.0),
    "k_per_newton": Parameter("1/N", 1e-3, 50.0),
}
"""Constants of a `SoftFinger`: its radius `c f_N^n`, the exponent `k` of its profile."""

ALL = {**LAW, **SHAPE, **SOFT_FINGER}
"""All parameters by name."""

USUAL = (
    "mu_c",
    "mu_s",
    "v_s",
    "gamma",
    "sigma_0",
    "sigma_1",
    "sigma_2",
    "contact_radius",
)
"""Parameters that `identify_lugre` estimates by default."""

STIFFNESS = PARAMETERS.index("sigma_0")
"""Place of the stiffness in the vector of a model."""

RADIUS = PARAMETERS.index("contact_radius")
"""Place of the contact radius in the vector of a model."""

SECOND_MOMENT = PARAMETERS.index("second_moment")
"""Place of the second moment in the vector of a model."""

PRIOR = 3.0
"""Standard deviation a priori of logarithms, a factor of 20."""

SHAPE_PRIOR = 1.0
"""Standard deviation a priori of the Stribeck exponent and of `mu_s/mu_c - 1`."""

CONSTANT = 0.1
"""Share by which the load of a log may stray from its mean if the patch changes with the load."""


def check_names(
    names: Sequence[str], known: Collection[str] = tuple(ALL)
) -> tuple[str, ...]:
    """Return the names as a tuple, each one of the `known` and given once, or raise InvalidValueError."""
    names = tuple(
        validation.choices(
            "parameters", (names,) if isinstance(names, str) else names, known
        )
    )
    for name in names:
        if names.count(name) > 1:
            raise InvalidValueError(
                "parameters",
                "contain each name once",
                f"{name!r} {names.count(name)} times",
            )
    if not names:
        raise InvalidValueError("parameters", "contain at least one name", "none")
    if any(name in SOFT_FINGER for name in names) and "contact_radius" in names:
        raise InvalidValueError(
            "parameters",
            "contain contact_radius or soft-finger constants, not both",
            ", ".join(names),
        )
    return names


def check_patch(patch: Any, by: str) -> None:
    """Raise InvalidValueError unless `by` can take a patch: a ContactPatch without a friction metric."""
    validation.instance("patch", patch, ContactPatch, "a ContactPatch")
    refuse_anisotropy(patch, by)


class Coordinates:
    """Map between values `[F + K]` of the contact and of the rig and the optimiser's coordinates `[F + K]`.

    `mu_s` becomes `mu_s/mu_c - 1 >= 0`, so that no step can bring it below `mu_c`; other parameters > 0 become the
    logarithm of their ratio to the start, the rest multiples of their scale. Values of the rig begin at zero and become
    multiples of their `widths` `[K]`, up to `limits` `[K]` of them.
    """

    def __init__(
        self,
        names: Sequence[str],
        start: np.ndarray,
        held_mu_c: float,
        widths: Any = (),
        limits: Any = (),
    ) -> None:
        self.names = tuple(names)
        count = len(names)
        self.rig = np.arange(count + len(widths)) >= count
        self.start = np.append(start[:count], np.zeros(len(widths)))
        self._held_mu_c = held_mu_c
        self._limits = np.asarray(limits, dtype=float)
        places = {name: i for i, name in enumerate(names)}
        self._mu_s = places.get("mu_s")
        self._mu_c = places.get("mu_c")
        self.logarithmic = np.zeros(len(self.start), dtype=bool)
        self.logarithmic[:count] = [ALL[name].logarithmic for name in names]
        self.scale = np.where(self.start != 0.0, np.abs(self.start), 1.0)
        self.scale[self.rig] = widths
        if self._mu_s is not None:
            self.logarithmic[self._mu_s] = False
            self.scale[self._mu_s] = 1.0

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and the upper bounds of the coordinates, `[F + K]` each."""
        low = np.append([ALL[name].low for name in self.names], -self._limits)
        high = np.append([ALL[name].high for name in self.names], self._limits)
        for bound in (low, high):
            bound[~self.rig] /= self.scale[~self.rig]
            bound[self.logarithmic] = np.log(bound[self.logarithmic])
        if self._mu_s is not None:
            low[self._mu_s] = 0.0
            high[self._mu_s] = 5.0
        return low, high

    def of(self, values: np.ndarray) -> np.ndarray:
        """Return the coordinates of values `[F]` or `[F + K]`, moved inside the bounds; the rig's are 0 without any."""
        padded = np.concatenate([values, np.zeros(len(self.scale) - len(values))])
        result = padded / self.scale
        result[self.logarithmic] = np.log(np.maximum(result[self.logarithmic], 1e-300))
        if self._mu_s is not None:
            result[self._mu_s] = values[self._mu_s] / self._mu(values) - 1.0
        return np.clip(result, *self.bounds())

    def prior(self, coordinates: np.ndarray) -> Linear:
        """Compute a weak pull to the start, `[F + K]`, and its derivatives `[F + K, F + K]`.

        It keeps parameters that the data cannot determine at their start. In units of the noise of one residual it is
        one for every factor of `PRIOR`, so that a parameter known to 10 % is moved by a thousandth of its error. The
        linear coordinates of the contact, whose scale is a guess, are left alone.
        """
        width = np.where(self.rig, 1.0, np.where(self.logarithmic, PRIOR, np.inf))
        width[: len(self.names)][np.isin(self.names, ("gamma", "mu_s"))] = SHAPE_PRIOR
        return (coordinates - self.of(self.start)) / width, np.diag(1.0 / width)

    def values(self, coordinates: np.ndarray) -> np.ndarray:
        """Return the values `[F + K]` of coordinates."""
        result = self.scale * np.where(
            self.logarithmic,
            np.exp(np.where(self.logarithmic, coordinates, 0.0)),
            coordinates,
        )
        if self._mu_s is not None:
            result[self._mu_s] = self._mu(result) * (1.0 + coordinates[self._mu_s])
        return result

    def slopes(self, coordinates: np.ndarray) -> np.ndarray:
        """Compute the derivatives of the values with respect to the coordinates, `[F + K, F + K]`."""
        values = self.values(coordinates)
        result = np.diag(np.where(self.logarithmic, values, self.scale))
        if self._mu_s is not None:
            result[self._mu_s, self._mu_s] = self._mu(values)
            if self._mu_c is not None:
                # mu_c is logarithmic: by its coordinate, mu_s grows by itself
                result[self._mu_s, self._mu_c] = values[self._mu_s]
        return result

    def _mu(self, values: np.ndarray) -> float:
        return self._held_mu_c if self._mu_c is None else values[self._mu_c]


def fitted_law(law: LuGre, given: Mapping[str, float]) -> LuGre:
    """Return the law with estimates by name; a `mu_s` that was held grows with a `mu_c` that passes it."""
    fields: dict[str, Any] = {name: given[name] for name in LAW if name in given}
    ratio = fields.pop("breakaway_ratio", None)
    fields["mu_s"] = max(fields.get("mu_s", law.mu_s), fields.get("mu_c", law.mu_c))
    if ratio is not None:
        fields["elasto_plastic"] = ElastoPlastic(ratio)
    return dataclasses.replace(law, **fields)


def bristles_of(law: LuGre, pad: Any, names: Sequence[str]) -> str:
    """Return the kind of bristles of a law, on a pad or None, in words; `names` are estimated."""
    kind = "plain bristles"
    if isinstance(law.elasto_plastic, ElastoPlastic):
        kind = "elasto-plastic bristles"
        if "breakaway_ratio" not in names:
            kind += f" ({law.elasto_plastic.breakaway_ratio:g})"
    if pad is not None:
        kind += " of a stiffness that does not grow with the load"
    return kind


def scaled_patch(patch: ContactPatch, scale: float, centre: Any = None) -> ContactPatch:
    """Return the patch times `scale` about its centre of pressure, its grid too, with that centre moved to `centre`.

    The new centre `[2]` [m] is the old one by default.
    """
    old = patch.centre_of_pressure()
    new = old if centre is None else centre
    changes: dict[str, Any] = {
        "positions": new + scale * (patch.positions - old),
        "pressure": None,
        "areas": scale**2 * patch.areas,
        "radii": scale * patch.radii,
    }
    if patch.point_shares is None:
        changes["pressure"] = patch.weights() / patch.areas
    if patch.cell_size is not None:
        changes["cell_size"] = tuple(scale * each for each in patch.cell_size)
    if (grid := patch.grid) is not None:
        x, y = new + scale * (np.array([grid.x_min, grid.y_min]) - old)
        changes["grid"] = dataclasses.replace(
            grid,
            x_min=float(x),
            y_min=float(y),
            cell_width=scale * grid.cell_width,
            cell_height=scale * grid.cell_height,
        )
    return dataclasses.replace(patch, **changes)


class VectorMap:
    """Map from values to the vector of the model at one load: the law directly, the shape through its constants.

    A stiffness that is `sigma_0` at the load `reference`, and does not grow with the load, is `sigma_0 reference/f_N`.
    """

    def __init__(
        self,
        names: Sequence[str],
        base: np.ndarray,
        patch: Any,
        normal_force: float,
        reference: float | None = None,
    ):
        self.names = tuple(names)
        self.base = np.array(base, dtype=float)
        self.load = normal_force
        self._stiffness = 1.0 if reference is None else reference / normal_force
        self._ratio = base[SECOND_MOMENT] / base[RADIUS] ** 2
        self._finger = (
            patch.pressure if any(name in SOFT_FINGER for name in names) else None
        )

    def vector(self, values: np.ndarray) -> np.ndarray:
        """Return the vector `[P]` of the model for values `[F]`."""
        return self.linearised(values)[0]

    def linearised(self, values: np.ndarray) -> Linear:
        """Compute the vector and its derivatives with respect to the values, `[P, F]`."""
        vector = self.base.copy()
        slopes = np.zeros((len(PARAMETERS), len(self.names)))
        for i, (name, value) in enumerate(zip(self.names, values, strict=True)):
            if name in PARAMETERS:
                row = PARAMETERS.index(name)
                vector[row] = value
                slopes[row, i] = 1.0
            if name == "contact_radius":
                vector[SECOND_MOMENT] = self._ratio * value**2
                slopes[SECOND_MOMENT, i] = 2.0 * self._ratio * value
        if self._finger is not None:
            moments = soft_finger_moments(
                self._finger, self.load, dict(zip(self.names, values, strict=True))
            )
            for row, (moment, by) in zip((RADIUS, SECOND_MOMENT), moments, strict=True):
                vector[row] = moment
                slopes[row] += [by.get(name, 0.0) for name in self.names]
        vector[STIFFNESS] *= self._stiffness
        slopes[STIFFNESS] *= self._stiffness
        return vector, slopes


def soft_finger_moments(finger: Any, normal_force: float, given: dict[str, Any]):
    """Compute contact radius and `<rho^2>` of a soft finger with their derivatives: `((r, {name: dr}), (m, {...}))`.

    The profile `p ~ (1 - (s/R)^k)^(1/k)` on the continuous disc has the moments
    `<s^j> = R^j B((j+2)/k, 1+1/k) / B(2/k, 1+1/k)`.
    `given` replaces constants of the `finger` by name.
    """
    from scipy.special import betaln

    c: Any = given.get("c", finger.c)
    n: Any = given.get("n", finger.n)
    exponent = "k" if finger.k is not None else "k_per_newton"
    per_exponent = 1.0 if finger.k is not None else normal_force
    k: Any = given.get(exponent, getattr(finger, exponent)) * per_exponent
    largest = np.inf if finger.radius_max is None else finger.radius_max
    grown: Any = c * normal_force**n
    size = min(grown, largest)
    results = []
    for power in (1, 2):
        value = size**power * np.exp(
            betaln((power + 2) / k, 1 + 1 / k) - betaln(2 / k, 1 + 1 / k)
        )
        of_k = value * (_log_beta_slope(power + 2, k) - _log_beta_slope(2, k))
        slopes = {exponent: of_k * per_exponent}
        if grown < largest:
            slopes["c"] = power * value / c
            slopes["n"] = power * value * np.log(normal_force)
        results.append((value, slopes))
    return results


def _log_beta_slope(a: float, k: float) -> float:
    """Compute `d/dk log B(a/k, 1 + 1/k)`."""
    from scipy.special import digamma

    both = digamma((a + 1) / k + 1)
    return -(a * (digamma(a / k) - both) + (digamma(1 + 1 / k) - both)) / k**2
