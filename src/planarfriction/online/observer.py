"""Estimate the friction of a grip while it holds and slips, from the sensors of a gripper."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from planarfriction._support import validation
from planarfriction._support.equality import ByValue, by_parts, checked
from planarfriction.errors import InvalidValueError
from planarfriction.limit_surface import LimitSurface
from planarfriction.models import FrictionModel
from planarfriction.online.loops import friction_filter as kernels
from planarfriction.online.loops.filter_state import BIAS, MU, STATE

GRAVITY = 9.81
"""Gravity [m/s^2]."""


@by_parts
class Measurement(NamedTuple):
    """Sensors at one instant; leading axes are parts."""

    time: Any
    """Time of the samples [s], `[...]`."""
    wrench: Any
    """Friction wrench of one finger on the part, about the grip's centre, axes of the hand `[..., 3]` [N, N, N m]."""
    normal_force: Any
    """Grip force [N], `[...]`."""
    slip_velocity: Any = None
    """Mean velocity of the part over its finger since the last such sample, `[..., 3]` [m/s, m/s, rad/s]; NaN or None
    between samples."""


@dataclass(frozen=True, eq=False)
class Sensors(ByValue):
    """Noise and rates of the sensors of a gripper.

    Raises InvalidValueError for a value out of range.
    """

    force_noise: float = checked(validation.non_negative, default=0.02)
    """Standard deviation of the forces, also of the grip force [N]."""
    torque_noise: float = checked(validation.non_negative, default=2e-4)
    """Standard deviation of the torque [N m]."""
    slip_rate: float = checked(validation.non_negative, default=120.0)
    """Rate of the slip velocity [Hz]; 0 for no such sensor."""
    quantum: float = checked(validation.positive, default=0.95e-3)
    """Smallest slip velocity [m/s]: the sensor counts places, so that what a sample leaves out is in the next."""
    base: float = checked(validation.positive, default=0.01)
    """Distance of the two counters whose difference is the spin [m]."""


PARAMETERS = ("mu_c", "mu_s", "radius")
"""Names of what is estimated beside the twist, in the order of `Estimate.determined` and `covariance`."""

FLAGS = {
    1: "no wrench, or no load since the hand gripped",
    2: "time does not go on, or jumps",
    4: "sensor is saturated",
    8: "bias of the wrench is unknown: no sample of an empty hand agrees with it",
    16: "friction drives the slip: the wrench or the slip velocity has the wrong sign",
    32: "friction or radius are far from the assumed values: check the units of wrench and load",
    64: "wrench and slip velocity contradict the friction that was found",
}
"""Meaning of the bits of `Estimate.flags`; those from 8 on last as long as their cause, and nothing is determined."""

_SEGMENTS = 20
"""Planes around the limit surface along a quadrant: they miss the gauge of a wrench by 0.2 % at most [-]."""

_LEAST_NOISE = 1e-6
"""Least standard deviation of a scaled wrench [N]."""

_TWO_SIDED = 1.959964
"""Standard deviations on either side of 95 % of a normal distribution."""


@by_parts
class Estimate(NamedTuple):
    """State of a grip after a sample; leading axes are parts."""

    twist: np.ndarray
    """Velocity of the part at the grip, `[..., 3]` [m/s, m/s, rad/s]; zero while it sticks."""
    mu_c: np.ndarray
    """Coulomb coefficient `[...]` [-]."""
    mu_s: np.ndarray
    """Static coefficient `[...]`, not below the largest friction seen while the part stuck [-]."""
    radius: np.ndarray
    """Contact radius `[...]` [m]."""
    covariance: np.ndarray
    """Covariance of the logs of mu_c, mu_s and the radius, `[..., 3, 3]`."""
    determined: np.ndarray
    """True where the 95 % interval of mu_c, mu_s or the radius is within `tolerance`, bool `[..., 3]`."""
    slip: np.ndarray
    """Probability that the part slips `[...]`."""
    about_to_slip: np.ndarray
    """Probability that it sticks, but slips at a tenth more load `[...]`; the rest is that it sticks safely."""
    margin: np.ndarray
    """`1 - |W|/|W_s|`: distance of the wrench from the limit surface at mu_s, of the way there `[...]`."""
    gauge: np.ndarray
    """Friction coefficient that holds the present wrench, `holding_load(W, mu=1)/f_N` `[...]` [-]."""
    flags: np.ndarray
    """Sum of what was odd about the sample, int `[...]`: see `planarfriction.online.observer.FLAGS`."""

    def interval(self, probability: float = 0.95) -> np.ndarray:
        """Return the bounds `[..., 3, 2]` of mu_c, mu_s and the radius.

        Raises InvalidValueError unless the probability is between 0 and 1.
        """
        from scipy.special import ndtri

        if not 0.0 < validation.number("probability", probability) < 1.0:
            raise InvalidValueError("probability", "be between 0 and 1", probability)
        mean = np.stack([self.mu_c, self.mu_s, self.radius], axis=-1)
        sd = np.sqrt(np.diagonal(self.covariance, axis1=-2, axis2=-1))
        reach = np.exp(ndtri(0.5 + 0.5 * probability) * sd)
        return np.stack([mean / reach, mean * reach], axis=-1)


class FrictionObserver:
    """Kalman filter for friction and slip from wrench, load and slip velocity, one call per sample.

    While a part slips, its wrench is that of steady sliding, `W = (g(|V|) + sigma_2 |V|) f_N h(V)`, of the limit
    surface and the law, with unknown `mu_c`, `mu_s/mu_c` and a scale of the radius; a square-root filter updates their
    logs, the twist and the bias of the sensor with the Jacobians of the surface. It learns from the mean wrench between
    two slip velocities once the next one shows that the part slipped throughout; errors of the counted place do not add
    up over a slip. While the part sticks, the wrench only bounds mu_s from below. Peaks of the wrench at the beginning
    of a slip are mu_s. Samples of an empty hand (a load below `least_load`) give the bias of the wrench. The
    probability of slip follows a hidden Markov chain. Without slip velocities nothing but that bound is learnt.

    `flags` doubt what cannot be: friction that drives the slip, friction or a radius more than 4 standard deviations
    from what was assumed, and a bias that no empty hand has shown, unless `bias` (standard deviations) is at most the
    noise of the sensors. Nothing is determined then.

    `information()` is that of the motion so far. `state` `[...]`, records of dtype
    `planarfriction.online.loops.filter_state.STATE`, is all that changes: a copy of it is a checkpoint. With `batch`,
    the observer watches so many parts at once; measurements have that leading shape.

    Raises InvalidValueError for what is neither a model nor a limit surface, asymmetric friction, and values out of
    range.
    """

    def __init__(
        self,
        model: FrictionModel,
        *,
        batch: Any = (),
        surface: LimitSurface | None = None,
        normal_force: float = 5.0,
        mu_spread: float = 0.32,
        ratio_spread: float = 0.1,
        radius_spread: float = 0.2,
        bias: Any = (0.03, 0.03, 3e-4),
        sensors: Sensors | None = None,
        model_error: float = 0.02,
        drift: float = 0.0,
        tolerance: float = 0.05,
        saturation: float = 1e3,
        least_load: float = 0.1,
    ) -> None:
        validation.instance(
            "model", model, FrictionModel, "a friction model, such as ReducedModel"
        )
        load = validation.positive("normal_force", normal_force)
        if surface is None:
            from planarfriction.limit_surface import LimitSurfaceTable

            surface = LimitSurfaceTable(
                model.patch, normal_force=load if model.depends_on_load else None
            )
        self.model = model
        self.surface = validation.instance(
            "surface", surface, LimitSurface, "a limit surface"
        )
        if surface.patch.asymmetric:
            raise InvalidValueError(
                "model", "have symmetric friction", "a patch with an asymmetry"
            )
        sensors = Sensors() if sensors is None else sensors
        self.sensors = validation.instance("sensors", sensors, Sensors, "Sensors")
        self.tolerance = validation.positive("tolerance", tolerance)
        prior = np.array(
            [
                validation.positive("mu_spread", mu_spread),
                validation.positive("ratio_spread", ratio_spread),
                validation.positive("radius_spread", radius_spread),
            ]
        )
        numbers = model.law.numbers
        middle = np.log([numbers.mu_c, numbers.mu_s / numbers.mu_c, 1.0])
        frame = surface._frame()
        back = np.linalg.inv(frame)
        growth = 0.0  # d log r/d log f_N of the contact radius
        if model.depends_on_load:
            small, large = (model.patch.contact_radius(c * load) for c in (0.5, 2.0))
            growth = math.log(large / small) / math.log(4.0)
        quantum = sensors.quantum
        place = quantum / max(sensors.slip_rate, 1.0)
        noise = np.abs(back.T) @ (
            sensors.force_noise,
            sensors.force_noise,
            sensors.torque_noise,
        )
        self._filter = kernels.Filter(
            *surface.numbers,
            _planes(surface),
            frame,
            back,
            -back.T.copy(),
            surface.contact_radius,
            load,
            growth,
            numbers.v_s,
            numbers.gamma,
            numbers.sigma_2,
            np.maximum(noise, _LEAST_NOISE) ** 2,
            quantum,
            place,
            np.abs(frame) @ (place, place, place / sensors.base) / math.sqrt(12.0),
            validation.positive("model_error", model_error),
            validation.non_negative("drift", drift),
            validation.positive("saturation", saturation),
            validation.positive("least_load", least_load),
            (math.log1p(self.tolerance) / _TWO_SIDED) ** 2,
            middle,
            prior,
        )
        unsure = np.abs(self._filter.conjugate) @ validation.non_negative_array(
            "bias", bias, (3,)
        )
        fresh = [kernels.FRESH] * 3
        root = np.diag(
            np.concatenate(
                [self._filter.remainder, fresh, prior, np.maximum(unsure, 1e-9)]
            )
        )
        self.state = state = np.zeros(validation.batched(batch, ()), STATE)
        state["x"][..., MU:BIAS] = middle
        state["root"] = root
        state["tared"] = (unsure <= np.sqrt(self._filter.noise)).all()
        state["slip"] = 1e-3
        state["time"] = -math.inf
        state["bound"] = state["peak"] = -10.0
        state["gauge"] = kernels.NONE

    def update(self, measurement: Measurement) -> Estimate:
        """Take a sample of every part, with NaN or None for what is missing; return what is known now.

        Raises InvalidValueError for a measurement whose arrays do not have the shape of the batch.
        """
        return estimate_of(self._take(measurement))

    def _take(self, measurement: Measurement) -> np.ndarray:
        """Take a sample of every part; return the compiled filter's records of what is known, one a part.

        Raises InvalidValueError as `update` does.
        """
        validation.instance("measurement", measurement, Measurement, "a Measurement")
        batch = self.state.shape
        velocity = measurement.slip_velocity
        samples = np.empty((*batch, 8))
        try:
            samples[..., 0], samples[..., 1:4], samples[..., 4] = measurement[:3]
            samples[..., 5:] = math.nan if velocity is None else velocity
        except (TypeError, ValueError):
            raise InvalidValueError(
                "measurement", f"hold numbers of the batch {list(batch)}", measurement
            ) from None
        found = np.empty(batch, kernels.ESTIMATE)
        kernels.update(
            self._filter,
            self.state.reshape(-1),
            samples.reshape(-1, 8),
            found.reshape(-1),
        )
        return found

    @property
    def bias(self) -> np.ndarray:
        """Estimated bias of the measured wrench, `[..., 3]` [N, N, N m]."""
        return -self.state["x"][..., BIAS:] @ self._filter.frame

    def information(self) -> np.ndarray:
        """Return the information of the samples so far on the logs of mu_c, mu_s/mu_c and the radius, `[..., 3, 3]`.

        The inverse covariance less that of the prior; a direction without information is not determined by the motion.
        """
        root = self.state["root"][..., MU:BIAS, :]
        return np.linalg.inv(root @ np.swapaxes(root, -1, -2)) - np.diag(
            1.0 / self._filter.prior_spread**2
        )


def estimate_of(found: np.ndarray) -> Estimate:
    """Return the estimate in records of the compiled filter."""
    return Estimate._make(found[name] for name in Estimate._fields)._replace(
        determined=found["determined"] > 0
    )


def _planes(surface: LimitSurface) -> np.ndarray:
    """Return directions of half a sphere over their dissipation `[M, 3]`, scaled: planes around the surface."""
    angle = 0.5 * np.pi / _SEGMENTS * np.arange(4 * _SEGMENTS)
    polar, azimuth = np.meshgrid(angle[: _SEGMENTS + 1], angle, indexing="ij")
    across = np.sin(polar)
    units = np.stack(
        [across * np.cos(azimuth), across * np.sin(azimuth), np.cos(polar)], axis=-1
    ).reshape(-1, 3)
    return units / np.einsum("mi,mi->m", surface.direction(units), units)[:, None]
