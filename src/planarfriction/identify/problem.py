"""Least-squares problems: predictions of a model whose parameters vary minus measurements, over noise; and options."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction._support.equality import Checked, checked
from planarfriction.derivatives import PARAMETERS, parameters_of
from planarfriction.errors import InvalidValueError
from planarfriction.identify.decimation import redrawn
from planarfriction.identify.logs import Arrays, Linear, Log, mean_load
from planarfriction.identify.parameters import (
    CONSTANT,
    RADIUS,
    SECOND_MOMENT,
    SOFT_FINGER,
    Coordinates,
    VectorMap,
)
from planarfriction.identify.sensor_errors import (
    GROUPS,
    Rig,
    as_measured,
    check_groups,
    smoothed,
    wrench_noise,
)
from planarfriction.identify.simulators import (
    CENTRE,
    SIMULATORS,
    Prediction,
    PublishedSimulator,
)
from planarfriction.identify.uncertainty import NEAR, covariance, finite
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import LimitSurface, LimitSurfaceTablePublished
from planarfriction.limit_surface.base import scaling
from planarfriction.pads import AtLoad
from planarfriction.patch import ContactPatch, SoftFinger


def check_noise(name: str, noise: Any) -> np.ndarray:
    """Return the noise `[3]`, all of it > 0, or raise InvalidValueError."""
    values = validation.vector(name, noise, 3)
    if not (values > 0.0).all():
        raise InvalidValueError(name, "be > 0", values.tolist())
    return values


def _noise(name: str, noise: Any) -> tuple[float, ...]:
    return tuple(check_noise(name, noise).tolist())


def _surface(name: str, value: Any) -> type[LimitSurface]:
    if not (isinstance(value, type) and issubclass(value, LimitSurface)):
        raise InvalidValueError(name, "be a class of limit surfaces", value)
    return value


def _bristles(_: str, value: Any) -> ElastoPlastic | float | str | None:
    if isinstance(value, str) and value == "auto":
        return value
    return LuGre(elasto_plastic=value).elasto_plastic  # pyright: ignore[reportArgumentType]


@dataclass(frozen=True)
class FitOptions(Checked):
    """Options of `identify_lugre` that few fits change.

    Raises InvalidValueError for an option that breaks its rule.
    """

    nuisance: Sequence[str] = checked(check_groups, default=GROUPS)
    """Sensor errors that the fit may include: "delay" between motion and wrench, "bias" (zeros of the wrench and their
    drift), "load" (scale and drift of the load cell), "twist" (noise of the twist). All by default."""
    noise: Sequence[float] | None = checked(_noise, default=None)
    """Standard deviation of the measured fx, fy [N] and tau [N m]; None estimates each from its jitter."""
    begins: str = checked(validation.choice, ("rest", "steady"), default="rest")
    """Bristles at the begin of every log: relaxed ("rest"), or as in steady sliding at the first twist ("steady")."""
    refine: int | None = checked(validation.count, default=None)
    """Steps between two samples; None doubles them until no estimate changes by more than a fifth of its error."""
    starts: int = checked(validation.count, default=4)
    """Number of starting points."""
    seed: int = checked(validation.count, 0, default=0)
    """Random seed that scatters the starting points."""
    samples: int = checked(validation.count, 1000, default=20_000)
    """Most samples that a fit takes of all logs together: of longer logs, the windows that differ most are taken, and
    the result says so."""
    elasto_plastic: ElastoPlastic | float | str | None = checked(
        _bristles, default="auto"
    )
    """Kind of bristles, None for plain ones, unless a whole law is given as start. "auto" takes what fits better: plain
    ones or a breakaway ratio of 0.9; and for loads that clearly differ, a stiffness that grows with the load or one
    that does not (`Pad.at_load`)."""
    loss: str = checked(validation.choice, ("linear", "soft_l1"), default="linear")
    """Loss of a residual: its square, or "soft_l1" as SciPy has it. A fit with the latter ends without samples off by
    more than six times the noise, if these are fewer than a tenth."""
    surface: type[LimitSurface] = checked(_surface, default=LimitSurfaceTablePublished)
    """Class of the limit surface of the model "reduced-published"."""


COARSE = 0.2
"""Largest error of an estimate from the size of the steps, as a share of its standard error."""

KNOWN = 0.3
"""Standard error, as a share of an estimate, up to which that estimate decides on the steps."""

FINEST = 32
"""Most steps between two samples."""

NEARBY = 0.03
"""Change of the values, as a share, up to which derivatives are kept.

Derivatives only decide on the way to the minimum. There they meet residuals of noise, so that old ones move no estimate
by more than this share of its standard error.
"""

SOFT = 3.0
"""Residual over the noise at which "soft_l1" passes from squares to sizes."""

SPOILED = 6.0
"""Residual over the noise above which it is no noise."""

FEW = 0.1
"""Share of spoiled residuals up to which a robust fit ends without them."""


def softened(residual: np.ndarray) -> Linear:
    """Return residuals whose squares are the loss "soft_l1" at a scale of `SOFT`, `[M]`, and their derivatives."""
    root = np.sqrt(1.0 + (residual / SOFT) ** 2)
    # No difference of like numbers at small residuals.
    factor = np.sqrt(2.0 / (1.0 + root))
    return residual * factor, 1.0 / (root * factor)


class LeastSquaresProblem:
    """Measurements, a model, and the values that vary: F of the contact, then K of the rig.

    Subclasses predict what was measured, and estimate its noise from `values` and the `noise` of before. Samples of all
    logs or slides stand one after the other, T in all. Given `sigma` `[T, 3]`, `linearised` computes the residuals over
    it, `[M]`, and their derivatives by the values, `[M, F + K]`.
    """

    numbers: Any
    """Number of measured numbers."""
    owner: np.ndarray
    """Number of the log or slide of each sample that is fitted."""
    linearised: Any
    """Return `Linear` residuals for values `[F + K]` and `sigma`."""
    even_sigma: Any
    """Return the same noise for all samples, `[T, 3]`, from that of the channels."""
    estimate_noise: Any
    """Return the noise of the channels and sigma `[T, 3]` for values and the noise of before."""

    names: tuple[str, ...]
    """Names of the parameters of the contact, `[F]`."""
    law: LuGre
    """Law that holds the values of parameters that are not estimated."""
    far = np.inf
    """Cost above which a search is far from the data."""
    least_change = 0.0
    """Least relative change of the cost for which a search goes on."""
    steps = 1
    """Number of steps between two samples."""
    progress: Callable[[str], Any] | None = None
    """Receives lines of text about the progress."""
    so_far: np.ndarray | None = None
    """Best values that a search has found."""

    def report(self, text: str) -> None:
        """Tell the progress."""
        if self.progress is not None:
            self.progress(text)

    def coordinates(self, start: np.ndarray) -> Coordinates:
        """Return the optimiser's coordinates for a search from values `[F]`."""
        return Coordinates(self.names, start, self.law.mu_c)

    def refine_steps(self, values: np.ndarray, sigma: np.ndarray) -> bool:
        """Take more steps between two samples if the estimates ask for it; returns True if they do."""
        return False

    def forget(self) -> None:
        """Forget derivatives that were kept, from other steps or other values."""

    def residuals(
        self, coordinates: Coordinates, sigma: np.ndarray
    ) -> Callable[[np.ndarray], Linear]:
        """Return the function of the coordinates that least squares minimises, with its derivatives."""

        def evaluate(x: np.ndarray) -> Linear:
            residual, jacobian = self.linearised(coordinates.values(x), sigma)
            pull, per_pull = coordinates.prior(x)
            return np.concatenate([residual, pull]), np.concatenate(
                [jacobian @ coordinates.slopes(x), per_pull]
            )

        return evaluate

    def by_name(self, values: np.ndarray) -> dict[str, float]:
        """Return the values of the contact by name."""
        return dict(zip(self.names, values.tolist(), strict=False))

    def by_log(self, rows: np.ndarray) -> Iterator[np.ndarray]:
        """Yield the rows `[T, 3, C]` of each log or slide among flat ones `[M, C]`."""
        samples = rows.reshape(len(self.owner), 3, -1)
        for i in range(self.owner[-1] + 1):
            yield samples[self.owner == i]


@dataclass(eq=False)
class LogProblem(LeastSquaresProblem):
    """Logs of twist and wrench, a model, and the rig that measured them."""

    logs: Sequence[Log]
    patch: ContactPatch
    names: tuple[str, ...]
    law: LuGre
    options: FitOptions
    model: str = "reduced-published"
    progress: Callable[[str], Any] | None = None
    pad: AtLoad | None = None

    def __post_init__(self) -> None:
        logs = self.logs
        patch = self.patch
        options = self.options
        self.kind = SIMULATORS[self.model]
        self.fingers = [name for name in self.names if name in SOFT_FINGER]
        loads = [mean_load(log) for log in logs]
        if self.fingers and not isinstance(patch.pressure, SoftFinger):
            raise InvalidValueError(
                "patch",
                f"have a SoftFinger pressure to estimate {', '.join(self.fingers)}",
                patch.name,
            )
        for name in ("k", "k_per_newton"):
            if name in self.fingers and getattr(patch.pressure, name) is None:
                raise InvalidValueError(
                    "parameters", f"contain {name} only if the SoftFinger has it", name
                )
        for log, load in zip(logs, loads, strict=True):
            if not log.wrench.any():
                raise InvalidValueError(
                    f"wrench of {log.name}", "not be 0 throughout", "0 in every sample"
                )
            varies = np.abs(log.normal_force / load - 1.0).max() > CONSTANT
            if patch.depends_on_load and varies:
                raise InvalidValueError(
                    f"normal_force of {log.name}",
                    "stay within 10 % of its mean if the patch changes with the load (make one log for each load)",
                    f"{log.normal_force.min():g} .. {log.normal_force.max():g} N",
                )
        self.reference_load = np.median(loads)
        self.fixed_patch = patch
        if patch.depends_on_load:
            density = patch.weights(self.reference_load) / patch.areas
            self.fixed_patch = dataclasses.replace(patch, pressure=density)
        self.maps = self._maps(loads)
        self.rig = Rig(logs, options.nuisance)
        known_twist = "twist" not in options.nuisance
        self.twists = [(as_measured if known_twist else smoothed)(log) for log in logs]
        # A log at rest has no sample before its first step; its first wrench shows bristles that nobody knows.
        first = int(options.begins == "rest")
        used = [np.isin(np.arange(len(log.time)), log.inner[first:]) for log in logs]
        self._log = np.repeat(np.arange(len(logs)), [len(each) for each in used])
        self.used = np.concatenate(used)
        self.owner = self._log[self.used]
        self.measured = np.concatenate([log.wrench for log in logs])
        self.channels = np.array([log.channels for log in logs])[self._log]
        pad = None if self.kind.own_radius else self.pad
        self.simulator = self.kind(self.fixed_patch, self.law, options.surface, pad)
        self.far = 0.5 * NEAR * self.numbers
        self.steps = options.refine or 1
        self.predictions = self._predictions(self.steps)
        self._shown: Any = None
        self._slopes: Any = None

    def _maps(self, loads: Sequence[float]) -> list[VectorMap]:
        """Make the map from values to the vector of the model at the load of each log."""
        patch = self.patch
        base = parameters_of(
            PublishedSimulator.model(self.fixed_patch, self.law, self.options.surface)
        )
        self.base: dict[str, float] = dict(zip(PARAMETERS, base.tolist(), strict=True))
        own = self.kind.own_radius
        # The published model takes the stiffness at the mean load of a log.
        reference = self.pad.normal_force if self.pad and own else None
        maps = [VectorMap(self.names, base, patch, load, reference) for load in loads]
        for each in maps:
            if patch.depends_on_load and not self.fingers:
                each.base[RADIUS] = patch.contact_radius(each.load)
                each.base[SECOND_MOMENT] = patch.second_moment(each.load)
                each.base[CENTRE] = patch.centre_of_pressure(each.load)
            # The radius of the cells, where that of a surface is its own.
            if not own:
                each.base[RADIUS] = self.fixed_patch.contact_radius()
        return maps

    def _predictions(
        self,
        steps: int,
        twists: Arrays | None = None,
        logs: Sequence[Log] | None = None,
    ) -> list[Prediction]:
        twists = twists or [each.values for each in self.twists]
        begins = self.options.begins
        return [
            Prediction(self.simulator, log, twist, begins=begins, refine=steps)
            for log, twist in zip(logs or self.logs, twists, strict=True)
        ]

    def report(self, text: str) -> None:
        super().report(f"{self.model}: {text}")

    @property
    def work(self) -> float:
        """Rough time of one evaluation with derivatives [s]."""
        return (
            2e-6
            * sum(each.steps for each in self.predictions)
            * self.simulator.work(len(self.names))
        )

    @property
    def numbers(self) -> int:
        return self.channels.sum()

    def split_logs(self, rows: np.ndarray) -> Arrays:
        """Split rows `[T, ...]` of all samples into those of each log."""
        return [rows[self._log == i] for i in range(len(self.logs))]

    def coordinates(self, start: np.ndarray) -> Coordinates:
        return Coordinates(
            self.names, start, self.law.mu_c, self.rig.widths, self.rig.limits
        )

    def refine_steps(self, values: np.ndarray, sigma: np.ndarray) -> bool:
        """Take as many steps as keep the estimates within `COARSE` standard errors; returns True if these are more.

        Their number follows from the change of the residuals with twice as many steps, as errors fall with its square.
        """
        if self.options.refine is not None or self.steps >= FINEST:
            return False
        jacobian = self.linearised(values, sigma)[1]
        finer = self._predictions(2 * self.steps)
        twice = self._wrenches(values, finer)
        count = len(self.names)
        pull = np.eye(len(values))[count:] / self.rig.widths[:, None]
        inverse = covariance(
            np.concatenate([jacobian, pull]), np.full(len(values), True)
        )
        errors = np.sqrt(np.diag(inverse))[:count]
        sure = errors < KNOWN * np.abs(values[:count])
        change = self._scaled(twice - self.shown(values), sigma)
        moved = (finite(inverse) @ (jacobian.T @ change))[:count]
        most = (np.abs(moved)[sure] / (COARSE * errors[sure])).max(initial=0.0)
        if most <= 1.0:
            return False
        self.steps *= min(int(2 ** np.ceil(0.5 * np.log2(most))), FINEST // self.steps)
        self.predictions = self._predictions(self.steps)
        self._shown = None
        return True

    def forget(self) -> None:
        self._slopes = None

    def start_values(self) -> np.ndarray:
        """Return the values `[F]` of the names in the law, the patch and its pressure."""
        finger = self.patch.pressure
        values = [
            getattr(finger, name) if name in self.fingers else self.base[name]
            for name in self.names
        ]
        return np.array(values, dtype=float)

    def split(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Split values into those of the contact `[F]` and of the rig `[K]` (zeros if there are none)."""
        count = len(self.names)
        rig = values[count:]
        return values[:count], rig if len(rig) else np.zeros(len(self.rig.columns))

    def shown(self, values: np.ndarray) -> np.ndarray:
        """Compute the wrenches `[T, 3]` that the sensors should show, for values `[F]` or `[F + K]`."""
        if self._shown is None or not np.array_equal(self._shown[0], values):
            self._shown = values.copy(), self._wrenches(values, self.predictions)
        return self._shown[1]

    def _vectors(self, values: np.ndarray) -> Arrays:
        """Return the vector of the model for each log."""
        contact, _ = self.split(values)
        return [each.vector(contact) for each in self.maps]

    def _wrenches(
        self, values: np.ndarray, predictions: Sequence[Prediction]
    ) -> np.ndarray:
        _, rig = self.split(values)
        result = []
        both = zip(predictions, self._vectors(values), strict=True)
        for i, (prediction, vector) in enumerate(both):
            wrench = prediction.wrenches(vector, self.rig.delay(rig))
            result.append(self.rig.added(i, rig, wrench, np.zeros_like(wrench))[0])
        return np.concatenate(result)

    def linearised(self, values: np.ndarray, sigma: np.ndarray) -> Linear:
        """Compute the residuals over `sigma`, `[M]`, and derivatives `[M, F + K]`, at `values` or nearby (`NEARBY`)."""
        contact, _ = self.split(np.abs(values))
        centre = np.isin(self.names, ("centre_x", "centre_y"))
        sizes = np.maximum(contact, self.base["contact_radius"] * centre)
        most = NEARBY * np.append(sizes, self.rig.widths)
        known = self._slopes
        if known is None or (np.abs(values - known[0]) > most).any():
            self._slopes = self._derive(values)
        rows = self._slopes[1] * (self.channels / sigma)[..., None]
        residual, factor = self._counted(values, sigma)
        return residual, factor[:, None] * rows[self.used].reshape(len(factor), -1)

    def slopes_of(
        self,
        names: Sequence[str],
        held: np.ndarray,
        values: np.ndarray,
        sigma: np.ndarray,
    ) -> Linear:
        """Compute the residuals `[M]` at `values`, and derivatives `[M, H]` by `names` of the law, `held` at these."""
        wide = copy.copy(self)
        wide.names = (*self.names, *names)
        wide._slopes = None
        wide._shown = None
        wide.maps = wide._maps([each.load for each in self.maps])
        count = len(self.names)
        residual, slopes = wide.linearised(
            np.concatenate([values[:count], held, values[count:]]), sigma
        )
        return residual, slopes[:, count : count + len(names)]

    def _derive(self, values: np.ndarray) -> Linear:
        """Compute shown wrenches `[T, 3]` and their derivatives `[T, 3, F + K]`, and remember the wrenches."""
        contact, rig = self.split(values)
        wrenches = []
        slopes = []
        both = zip(self.predictions, self.maps, strict=True)
        for i, (prediction, each) in enumerate(both):
            vector, per_value = each.linearised(contact)
            rows = np.flatnonzero(per_value.any(axis=1))
            names = [PARAMETERS[row] for row in rows]
            wrench, slope, later = prediction.sensitivities(
                vector, names, self.rig.delay(rig)
            )
            shown, factor, of_rig = self.rig.added(i, rig, wrench, later)
            slope = factor[:, None, None] * (slope @ per_value[rows])
            wrenches.append(shown)
            slopes.append(np.concatenate([slope, of_rig], axis=-1))
        self._shown = values.copy(), np.concatenate(wrenches)
        return values.copy(), np.concatenate(slopes)

    def residual(self, values: np.ndarray, sigma: np.ndarray) -> np.ndarray:
        """Compute the residuals over `sigma`, `[M]`, as the loss counts them."""
        return self._counted(values, sigma)[0]

    def _counted(self, values: np.ndarray, sigma: np.ndarray) -> Linear:
        """Compute the residuals `[M]` as the loss counts them, and their derivatives by those over `sigma`."""
        residual = self.distances(values, sigma)
        if self.options.loss == "linear":
            return residual, np.ones_like(residual)
        return softened(residual)

    def distances(self, values: np.ndarray, sigma: np.ndarray) -> np.ndarray:
        """Compute the residuals over `sigma`, `[M]`, whatever the loss."""
        return self._scaled(self.shown(values) - self.measured, sigma)

    def _scaled(self, change: np.ndarray, sigma: np.ndarray) -> np.ndarray:
        """Divide changes `[T, 3]` of the wrenches by `sigma`; returns all used samples flat, `[M]`."""
        return (change * (self.channels / sigma))[self.used].ravel()

    def even_sigma(self, noise: np.ndarray) -> np.ndarray:
        return np.broadcast_to(noise, self.measured.shape)

    def estimate_noise(self, values: np.ndarray, noise: np.ndarray) -> Linear:
        """Estimate the noise of each channel `[3]`, unless it is given, and sigma `[T, 3]` of the residuals."""
        shown = self.shown(values)
        if self.options.noise is None:
            noise = wrench_noise(self.logs, self.split_logs(shown - self.measured))
        sigma = self.sigma(values, noise)
        if self.options.loss != "linear":
            left = np.where(self.channels, shown - self.measured, 0.0)
            spoiled = np.abs(left) > SPOILED * sigma
            if spoiled.sum() < FEW * self.numbers:
                sigma = np.where(spoiled, np.inf, sigma)
        return noise, sigma

    def sigma(self, values: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Compute the standard deviation `[T, 3]` of the residuals from the noise `[3]` and that of the twist.

        The latter adds, to first order, the change of each sample if the twists before it were all off by the error
        that smoothing left of them.
        """
        squares = []
        for prediction, vector, twist in zip(
            self.predictions, self._vectors(values), self.twists, strict=True
        ):
            square = np.tile(noise**2, (len(twist.values), 1))
            channels = np.eye(3)[twist.noisy]
            base = prediction.wrenches(vector) if len(channels) else None
            for one in channels:
                square += (
                    prediction.moved(vector, one * twist.left, one * twist.noise) - base
                ) ** 2
            squares.append(square)
        return np.sqrt(np.concatenate(squares))

    def twist_residuals(
        self, values: np.ndarray, sigma: np.ndarray, draws: int
    ) -> np.ndarray:
        """Compute the changes `[draws, M]` of the residuals over `sigma` for drawn errors of the twists.

        The draws are always the same ones. Returns one row of zeros if no twist has noise.
        """
        if not any(twist.noisy.any() for twist in self.twists):
            return np.zeros((1, 3 * self.used.sum()))
        random = np.random.default_rng(0)
        result = []
        for _ in range(draws):
            drawn = [
                twist.values + np.where(twist.noisy, twist.error(random), 0.0)
                for twist in self.twists
            ]
            logs = [
                redrawn(log, twist.noise * twist.noisy, random)
                for log, twist in zip(self.logs, self.twists, strict=True)
            ]
            shown = self._wrenches(values, self._predictions(self.steps, drawn, logs))
            result.append(self._scaled(shown - self.shown(values), sigma))
        return np.array(result)

    def coefficients(self, values: np.ndarray) -> np.ndarray:
        """Compute friction over load [-], `[T]`; NaN without load."""
        result = []
        for log, vector in zip(self.logs, self._vectors(values), strict=True):
            size = np.linalg.norm(log.wrench / [1.0, 1.0, vector[RADIUS]], axis=1)
            load = np.where(log.normal_force > 0.0, log.normal_force, np.nan)
            result.append(size / load)
        return np.concatenate(result)

    def sliding(self, values: np.ndarray) -> Linear:
        """Compute the sliding speeds `|V_S|` and their parts from spin [m/s], `[T]` each."""
        scaled = np.concatenate(
            [
                twist.values @ scaling(vector[CENTRE], vector[RADIUS]).T
                for twist, vector in zip(
                    self.twists, self._vectors(values), strict=True
                )
            ]
        )
        return np.linalg.norm(scaled, axis=1), np.abs(scaled[:, 2])
