"""A gripper to try estimators and controllers on: parts held by two soft fingers, simulated in one batch."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction._support.equality import ByValue
from planarfriction.coupling import CoupledPatches, HostStep
from planarfriction.errors import InvalidValueError
from planarfriction.laws import LuGre
from planarfriction.models import DistributedModel
from planarfriction.online.observer import GRAVITY, Measurement, Sensors
from planarfriction.patch import ContactPatch, SoftFinger

DT = 1e-3
"""Time step, and time between samples of force and torque [s]."""

LEAST = 1e-3
"""Load [N] below which the contact shrinks no further: a part that was let go has no contact at all."""

UNIT = 0.01
"""Radius [m] of the patch in which bristles are simulated; that of a finger is a scale of lengths."""

PROPORTIONAL, INTEGRAL, EVERY = 100.0, 2.0, 2
"""Gains of the loop of the grip force [1/s, 1/s^2], and steps between its samples (500 Hz)."""


@dataclass(frozen=True, eq=False)
class Parts(ByValue):
    """Parts and the fingers that hold each, P of them: all that a controller does not know.

    Raises InvalidValueError for arrays of other lengths and values out of range.
    """

    mass: Any
    """Mass `[P]` [kg]."""
    inertia: Any
    """Inertia about the centre of mass `[P]` [kg m^2]."""
    centre: Any
    """Centre of mass in the hand `[P, 2]` [m]; the grip's centre is the origin."""
    mu_c: Any
    """Coulomb coefficient, the mean of the two fingers, `[P]` [-]."""
    _: KW_ONLY
    mu_ratio: float = 1.1
    """`mu_s/mu_c` [-]."""
    v_s: float = 2e-3
    """Stribeck speed [m/s]."""
    sigma_0: float = 2e5
    """Bristle stiffness over the friction coefficient [1/m]."""
    sigma_2: float = 0.2
    """Viscous friction over the friction coefficient [s/m]."""
    radius: Any = 6e-3
    """Radius of the contact at 1 N, `[P]` or one [m]."""
    growth: float = 0.25
    """Growth n of the radius, `R = radius f_N^n` [-]."""
    exponent: float = 4.0
    """Exponent k of the pressure `(1 - (s/R)^k)^(1/k)` [-]."""
    delay: Any = 0.0
    """Delay of all measurements `[P]` or one [s]."""
    bias: Any = (0.0, 0.0, 0.0)
    """Bias of the measured wrench `[P, 3]` or one [N, N, N m]."""
    tap: Any = ((0.0, 0.0, 0.0),)
    """Largest wrench of a tap on the part, half a sine about the centre of mass, `[P, 3]` or one [N, N, N m]."""
    tap_time: Any = 1.0
    """Time of the tap [s], `[P]` or one."""
    tap_duration: float = 0.03
    """Duration of the tap [s]."""
    tilt: Any = 0.0
    """Angle by which the hand tilts `[P]` or one [rad]: gravity turns in its axes."""
    tilt_time: Any = 1.0
    """Time at which the tilt begins, `[P]` or one [s]."""
    tilt_duration: float = 0.5
    """Duration of the tilt [s]."""

    def __post_init__(self) -> None:
        count = len(validation.positive_array("mass", self.mass, (None,)))
        for name in ("mass", "inertia", "mu_c", "radius"):
            self._set(
                **{
                    name: validation.positive_array(
                        name, self._full(name, (count,)), (count,)
                    )
                }
            )
        for name in ("delay", "tap_time", "tilt_time"):
            self._set(
                **{
                    name: validation.non_negative_array(
                        name, self._full(name, (count,)), (count,)
                    )
                }
            )
        self._set(tilt=validation.array("tilt", self._full("tilt", (count,)), (count,)))
        for name, width in (("centre", 2), ("bias", 3), ("tap", 3)):
            self._set(
                **{
                    name: validation.array(
                        name, self._full(name, (count, width)), (count, width)
                    )
                }
            )
        for name in ("v_s", "sigma_0", "exponent", "tap_duration", "tilt_duration"):
            self._set(**{name: validation.positive(name, getattr(self, name))})
        for name in ("sigma_2", "growth"):
            self._set(**{name: validation.non_negative(name, getattr(self, name))})
        if validation.number("mu_ratio", self.mu_ratio) < 1.0:
            raise InvalidValueError("mu_ratio", "be >= 1", self.mu_ratio)

    def _full(self, name: str, shape: tuple[int, ...]) -> np.ndarray:
        """Return a field for every part."""
        return validation.filled(name, getattr(self, name), shape)

    def __len__(self) -> int:
        return len(self.mass)


class Gripper:
    """Closed loop of parts between two fingers: bristles, body, a grip that is rate-limited, sensors with a delay.

    Each finger carries half of its part. Bristles are those of a `DistributedModel` whose patch is scaled to the radius
    at the present load, `R = radius f_N^growth`, and whose load is scaled by mu: both are symmetries of the equations,
    so that all parts of a batch are one call of `CoupledPatches`. Two fingers of different mu turn and slide as one, so
    that the mean of mu is theirs, if all else is the same and the stiffness of each is proportional to its mu. The
    grip follows its command by `f_N' = 100 e + 2 int e`, at 500 Hz.

    Raises InvalidValueError for what is not `Parts` or `Sensors`, and values out of range.
    """

    def __init__(
        self,
        parts: Parts,
        grip: ArrayLike,
        *,
        sensors: Sensors | None = None,
        rate_limit: float = 150.0,
        cells: int = 7,
        seed: int = 0,
    ) -> None:
        self.parts = validation.instance("parts", parts, Parts, "Parts")
        self.sensors = (
            Sensors()
            if sensors is None
            else validation.instance("sensors", sensors, Sensors, "Sensors")
        )
        self.rate_limit = validation.positive("rate_limit", rate_limit)
        self._random = np.random.default_rng(validation.count("seed", seed, 0))
        finger = SoftFinger(c=UNIT, k=parts.exponent)
        law = LuGre(
            mu_c=1.0,
            mu_s=parts.mu_ratio,
            v_s=parts.v_s,
            sigma_0=parts.sigma_0,
            sigma_1=0.5 * parts.sigma_0 * DT,
            sigma_2=parts.sigma_2,
            elasto_plastic=0.9,
        )
        self.model = DistributedModel(
            ContactPatch.disc(
                UNIT, validation.count("cells", cells, 3), pressure=finger
            ),
            law,
        )
        self._patches = CoupledPatches([self.model])
        count = len(parts)
        self.normal_force = validation.filled("grip", grip, (count,))
        if not (self.normal_force > 0.0).all():
            raise InvalidValueError("grip", "be > 0", float(self.normal_force.min()))
        self._bristles = self._patches.rest(count)
        self._lag = np.zeros(count)
        self._rate = np.zeros(count)
        self.steps = 0
        self.centre = parts.centre.copy()
        self.angle = np.zeros(count)
        self._velocity = np.zeros((count, 3))
        self._scaled_wrench = np.zeros((count, 3))
        self.slip = np.zeros((count, 3))
        self._counted = np.zeros((count, 3))
        self._ticked = 0
        self._late = np.rint(parts.delay / DT).astype(int)
        self._settle()
        self._past = np.empty((int(self._late.max()) + 1, count, 8))
        for step in range(-len(self._past) + 1, 1):  # so far the part was held
            self._record(step)

    def step(self, command: ArrayLike) -> Measurement:
        """Advance by a millisecond with the commanded grip force `[P]` [N]; return what the sensors say now.

        Raises InvalidValueError for a command that is not `[P]` or one, or not >= 0.
        """
        command = validation.non_negative_numbers("command", command)
        if self.steps % EVERY == 0:
            error = command - self.normal_force
            self._lag = self._lag + EVERY * DT * error
            rate = PROPORTIONAL * error + INTEGRAL * self._lag
            self._rate = np.clip(rate, -self.rate_limit, self.rate_limit)
        self.normal_force = np.maximum(self.normal_force + DT * self._rate, 0.0)
        self._advance()
        self._record(self.steps)
        return self.measurement

    @property
    def measurement(self) -> Measurement:
        """Sensors as they have arrived: each part's by its delay ago."""
        late = self._past[
            (self.steps - self._late) % len(self._past), np.arange(len(self.parts))
        ]
        return Measurement(
            late[:, 0].copy(),
            late[:, 1:4].copy(),
            late[:, 4].copy(),
            late[:, 5:].copy(),
        )

    def empty_hand(self, samples: int = 100) -> Iterator[Measurement]:
        """Return what the sensors said before the hand gripped: bias and noise, from which an observer learns the bias.

        Raises InvalidValueError for a number of samples that is not >= 1.
        """
        samples = validation.count("samples", samples, 1)
        first = len(self._past) + samples
        return (self._empty(DT * (k - first)) for k in range(samples))

    def _empty(self, time: float) -> Measurement:
        sensed = self._sensed()
        return Measurement(np.full(len(sensed), time), sensed[:, :3], sensed[:, 3])

    def _sensed(self) -> np.ndarray:
        """Return bias and noise of the wrenches and the grip force `[P, 4]`."""
        force = self.sensors.force_noise
        torque = self.sensors.torque_noise
        sensed = self._random.normal(size=(4, len(self.parts))).T * (
            force,
            force,
            torque,
            force,
        )
        sensed[:, :3] += self.parts.bias
        return sensed

    def _record(self, step: int) -> None:
        """Sample the sensors."""
        sensors = self.sensors
        row = self._past[step % len(self._past)]
        row[:, 0] = step * DT
        row[:, 5:] = np.nan
        row[:, 1:5] = self._sensed()
        row[:, 1:4] += self.wrench
        row[:, 4] += self.normal_force
        if (
            int((step + 1) * DT * sensors.slip_rate)
            > int(step * DT * sensors.slip_rate)
            and step > 0
        ):
            unit = (
                sensors.quantum
                / sensors.slip_rate
                * np.array([1.0, 1.0, 1.0 / sensors.base])
            )
            places = np.rint(self.slip / unit)
            row[:, 5:] = (places - self._counted) * unit / ((step - self._ticked) * DT)
            self._counted = places
            self._ticked = step

    # ------------------------------------------------------------------ truth

    @property
    def time(self) -> float:
        """Time [s]."""
        return self.steps * DT

    @property
    def radius(self) -> np.ndarray:
        """Radius of the contacts at the present grip force `[P]` [m]."""
        return (
            self.parts.radius
            * np.maximum(self.normal_force, LEAST) ** self.parts.growth
        )

    @property
    def wrench(self) -> np.ndarray:
        """Friction wrench of one finger on each part, about the grip's centre `[P, 3]` [N, N, N m]."""
        return self._scaled_wrench * self._scale()

    @property
    def twist(self) -> np.ndarray:
        """Velocity of the part at the grip's centre `[P, 3]` [m/s, m/s, rad/s]."""
        u = self._velocity
        (x, y) = self.centre.T
        return np.stack(
            [u[:, 0] + u[:, 2] * y, u[:, 1] - u[:, 2] * x, u[:, 2]], axis=-1
        )

    def load(self) -> np.ndarray:
        """Return gravity and taps on half of each part, about the grip's centre `[P, 3]` [N, N, N m]."""
        parts = self.parts
        now = self.time
        tilt = parts.tilt * np.clip(
            (now - parts.tilt_time) / parts.tilt_duration, 0.0, 1.0
        )
        weight = parts.mass * GRAVITY
        phase = (now - parts.tap_time) / parts.tap_duration
        tap = (
            np.where((phase > 0.0) & (phase < 1.0), np.sin(np.pi * phase), 0.0)[:, None]
            * parts.tap
        )
        fx = tap[:, 0] - weight * np.sin(tilt)
        fy = tap[:, 1] - weight * np.cos(tilt)
        torque = tap[:, 2] + self.centre[:, 0] * fy - self.centre[:, 1] * fx
        return 0.5 * np.stack([fx, fy, torque], axis=-1)

    def _scale(self) -> np.ndarray:
        """Return the factors `[P, 3]` between wrenches of the patch of radius `UNIT` and those of the fingers."""
        scale = np.ones((len(self.parts), 3))
        scale[:, 2] = self.radius / UNIT
        return scale

    def _settle(self) -> None:
        """Let the bristles take up the load at the present grip, and count slip from there."""
        for _ in range(50):
            self._advance()
            self._velocity[:] = 0.0
        self.centre = self.parts.centre.copy()
        self.angle = np.zeros(len(self.parts))
        self.slip[:] = 0.0
        self.steps = 0

    def _advance(self) -> None:
        """Advance bodies and bristles by `DT`: the bristles find the twist at its end."""
        parts = self.parts
        (x, y) = self.centre.T
        scale = self._scale()
        # The twist at the grip of that of the centre of mass.
        levers = np.zeros((len(parts), 3, 3))
        levers[:, (0, 1, 2), (0, 1, 2)] = 1.0
        levers[:, 0, 2] = y
        levers[:, 1, 2] = -x
        per_mass = 2.0 / np.stack([parts.mass, parts.mass, parts.inertia], axis=-1)
        response = DT * np.einsum("pij,pj,pkj->pik", levers, per_mass, levers)
        free = self.twist + np.einsum("pij,pj->pi", response, self.load() + self.wrench)
        step = self._patches.step(
            self._bristles,
            HostStep(
                (scale * free)[:, None],
                (parts.mu_c * self.normal_force)[:, None],
                self._scaled_wrench[:, None],
                scale[:, :, None] * response * scale[:, None, :],
            ),
            DT,
        )
        self._bristles = step.state
        self._scaled_wrench = step.wrench[:, 0]
        vx, vy, omega = (step.twist[:, 0] / scale).T
        self._velocity = np.stack([vx - omega * y, vy + omega * x, omega], axis=-1)
        self.slip += DT * self.twist
        self.centre = self.centre + DT * self._velocity[:, :2]
        self.angle = self.angle + DT * omega
        self.steps += 1
