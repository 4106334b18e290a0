"""The least-squares problem: logs, a model whose parameters vary, residuals over the noise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.derivatives import PARAMETERS, parameters_of
from planarfriction.errors import InvalidValueError
from planarfriction.identify import parameters as known
from planarfriction.identify.least_squares import covariance
from planarfriction.identify.logs import Log
from planarfriction.identify.nuisance import GROUPS, Rig
from planarfriction.identify.parameters import Coordinates, Shape
from planarfriction.identify.prediction import Prediction
from planarfriction.identify.sensors import QUIET, SmoothTwist, as_measured, smoothed, wrench_noise
from planarfriction.identify.simulators import MODELS, RADIUS, simulator
from planarfriction.laws import LuGre
from planarfriction.limit_surface import LimitSurface
from planarfriction.limit_surface.base import scaling
from planarfriction.models import ReducedModelPublished
from planarfriction.patch import ContactPatch, SoftFinger

COARSE = 0.2
"""Error that the steps make, as a share of a standard error, above which they are halved."""

KNOWN = 0.3
"""Standard error, as a share of an estimate, up to which that estimate is used for this."""

FINEST = 32
"""Most steps between two samples."""

CONSTANT = 0.1
"""Share by which the load of a log may stray from its mean where the patch changes with the load."""


class Problem:
    """Logs, a model, the rig, and the values that vary: F of the contact, then K of the rig."""

    def __init__(self, logs, patch, names, law, surface: Any, begins, refine, model="reduced-published", groups=GROUPS):
        self.logs, self.names, self.law, self.patch = logs, names, law, patch
        self.kind, self.surface = model, surface
        finger = [name for name in names if name in known.SOFT_FINGER]
        if finger:
            _check_finger(patch, finger)
        loads = [mean_load(log) for log in logs]
        _check_wrenches(logs)
        if patch.depends_on_load:
            _check_constant(logs, loads)
        self.reference = float(np.median(loads))
        self.model = fixed_model(patch, law, surface, self.reference)
        base = parameters_of(self.model)
        self.shapes = [Shape(names, base, patch, load) for load in loads]
        if patch.depends_on_load and not finger:
            for shape, load in zip(self.shapes, loads, strict=True):
                _follow_load(shape.base, patch, load)
        self.begins, self.refine = begins, refine
        self.rig = Rig(logs, groups)
        self.twists = [smoothed(log) if "twist" in groups else as_measured(log) for log in logs]
        # A log at rest has no sample before its first step; its first wrench shows bristles that nobody knows.
        self.used = [slice(1 if begins == "rest" else 0, None) for _ in logs]
        self.use(model)

    def use(self, kind: str) -> None:
        """Predict by another model from now on."""
        self.kind = kind
        self.simulator = simulator(kind, self.model.patch, self.law, self.surface)
        if kind != MODELS[0]:  # a contact radius as the patch has it, where that of a surface is a number of its own
            for shape in self.shapes:
                shape.base[RADIUS] = float(self.model.patch.contact_radius())
        self.predictions = self._predictions(self.refine)
        self._last: tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]] | None = None

    def _predictions(self, refine: int) -> list[Prediction]:
        return [
            Prediction(self.simulator, log, twist.values, begins=self.begins, refine=refine)
            for log, twist in zip(self.logs, self.twists, strict=True)
        ]

    @property
    def work(self) -> float:
        """Rough time of one evaluation with derivatives [s]."""
        return 2e-6 * sum(each.steps for each in self.predictions) * self.simulator.work(len(self.names))

    def refine_by(self, factor: int) -> None:
        """Take so many times as many steps."""
        self.refine *= factor
        self.predictions = self._predictions(self.refine)
        self._last = None

    def finer(self, values: np.ndarray, spread: Sequence[np.ndarray]) -> int:
        """Factor of steps that keeps an estimate from moving by more than `COARSE` of its standard error; 1 if none.

        From what twice as many steps would move, as errors fall with the square of their number.
        """
        if self.refine >= FINEST:
            return 1
        off, jacobian = self.linearised(values, spread)
        finer = self._scaled(self.shown(values, self._predictions(2 * self.refine)), spread)
        count = len(self.names)
        pull = np.diag(1.0 / self.rig.widths)
        rows = np.concatenate([np.zeros((len(pull), count)), pull], axis=1)
        inverse = covariance(np.concatenate([jacobian, rows]), np.full(len(values), True))
        errors = np.sqrt(np.diag(inverse))[:count]
        known = errors < KNOWN * np.abs(values[:count])
        moved = (np.where(np.isfinite(inverse), inverse, 0.0) @ (jacobian.T @ (finer - off)))[:count]
        most = float((np.abs(moved)[known] / (COARSE * errors[known])).max(initial=0.0))
        return min(int(2 ** np.ceil(0.5 * np.log2(most))), FINEST // self.refine) if most > 1.0 else 1

    def start_values(self, law: LuGre) -> np.ndarray:
        """Values `[F]` of the names in a law, a patch and its pressure."""
        base = dict(zip(PARAMETERS, parameters_of(self.model), strict=True))
        values = {**base, **{name: getattr(law, name) for name in known.LAW if name != "breakaway_ratio"}}
        if any(name in known.SOFT_FINGER for name in self.names):
            values |= {name: getattr(self.patch.pressure, name) for name in known.SOFT_FINGER}
        return np.array([float(values[name]) for name in self.names])

    def split(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values of the contact `[F]` and of the rig `[K]` (zeros where there are none)."""
        count = len(self.names)
        rig = values[count:] if len(values) > count else np.zeros(len(self.rig.columns))
        return values[:count], rig

    def shown(self, values: np.ndarray, predictions: Sequence[Prediction] | None = None) -> list[np.ndarray]:
        """Wrenches `[T, 3]` that the sensors of each log should show, for values `[F]` or `[F + K]`."""
        if predictions is None and self._last is not None and np.array_equal(self._last[0], values):
            return [shown for shown, _ in self._last[1]]
        contact, rig = self.split(values)
        result = []
        for i, (p, shape) in enumerate(zip(predictions or self.predictions, self.shapes, strict=True)):
            wrench = p.wrenches(shape.vector(contact), self.rig.delay(rig))
            result.append(self.rig.added(i, rig, wrench, np.zeros_like(wrench))[0])
        return result

    def residuals(self, coordinates: Coordinates, spread: Sequence[np.ndarray]):
        """Function of the coordinates that returns predicted minus measured over their spread, and derivatives.

        Coordinates `[F + K]`: those of the contact, then the values of the rig over their widths.
        """
        count, widths = len(self.names), self.rig.widths

        def evaluate(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            off, slopes = self.linearised(np.concatenate([coordinates.values(x[:count]), x[count:] * widths]), spread)
            pull, per_pull = coordinates.prior(x[:count])
            inner = block_diag(coordinates.slopes(x[:count]), np.diag(widths))
            return (
                np.concatenate([off, pull, x[count:]]),
                np.concatenate([slopes @ inner, block_diag(per_pull, np.eye(len(widths)))]),
            )

        return evaluate

    def linearised(self, values: np.ndarray, spread: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Scaled residuals `[M]` and their derivatives `[M, F + K]` with respect to the values."""
        offs, slopes = [], []
        both = zip(self._derived(values), self.logs, self.used, spread, strict=True)
        for (shown, derivatives), log, used, each in both:
            seen = (log.channels / each)[used]
            offs.append(((shown - log.wrench)[used] * seen).ravel())
            slopes.append((derivatives[used] * seen[:, :, None]).reshape(-1, derivatives.shape[-1]))
        return np.concatenate(offs), np.concatenate(slopes)

    def _derived(self, values: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Wrenches `[T, 3]` that the sensors should show and their derivatives `[T, 3, F + K]`; the last are kept."""
        if self._last is None or not np.array_equal(self._last[0], values):
            contact, rig = self.split(values)
            found = []
            for i, (prediction, shape) in enumerate(zip(self.predictions, self.shapes, strict=True)):
                per_value = shape.slopes(contact)
                rows = np.flatnonzero(per_value.any(axis=1))
                wrench, slope, later = prediction.sensitivities(
                    shape.vector(contact), [PARAMETERS[row] for row in rows], self.rig.delay(rig)
                )
                shown, factor, of_rig = self.rig.added(i, rig, wrench, later)
                slope = factor[:, None, None] * (slope @ per_value[rows])
                found.append((shown, np.concatenate([slope, of_rig], axis=-1)))
            self._last = values.copy(), found
        return self._last[1]

    def off(self, values: np.ndarray, spread: Sequence[np.ndarray]) -> np.ndarray:
        """Scaled residuals `[M]`."""
        return self._scaled(self.shown(values), spread)

    def _scaled(self, wrenches: Sequence[np.ndarray], spread: Sequence[np.ndarray]) -> np.ndarray:
        """Wrenches minus the measured ones over their spread, all used samples flat."""
        both = zip(wrenches, self.logs, self.used, spread, strict=True)
        return np.concatenate(
            [((wrench - log.wrench) * (log.channels / each))[used].ravel() for wrench, log, used, each in both]
        )

    def noise(self, values: np.ndarray) -> np.ndarray:
        """Noise of each channel `[3]`, from the jitter of the signals or of the residuals."""
        return wrench_noise(self.logs, [m - log.wrench for m, log in zip(self.shown(values), self.logs, strict=True)])

    def evenly(self, noise: np.ndarray) -> list[np.ndarray]:
        """The same noise for all samples, `[T, 3]` of each log."""
        return [np.broadcast_to(noise, log.wrench.shape) for log in self.logs]

    def spread(self, values: np.ndarray, noise: np.ndarray) -> list[np.ndarray]:
        """Spread of the residuals `[T, 3]` of each log: noise of the wrench, and what that of the twist makes of it.

        To first order: how each sample answers if the twists before it were all off by what smoothing left of them.
        """
        contact, _ = self.split(values)
        result = []
        for p, shape, log, twist in zip(self.predictions, self.shapes, self.logs, self.twists, strict=True):
            square = np.broadcast_to(noise**2, log.wrench.shape).copy()
            vector = shape.vector(contact)
            base = None
            for k in np.flatnonzero(self._noisy(twist)):
                base = p.wrenches(vector) if base is None else base
                square += (p.moved(vector, twist.left[k] * np.eye(3)[k]) - base) ** 2
            result.append(np.sqrt(square))
        return result

    def _noisy(self, twist: SmoothTwist) -> np.ndarray:
        """Channels whose noise counts, `[3]` of bool."""
        size = np.maximum(np.sqrt(np.mean(twist.values**2, axis=0)), np.finfo(float).tiny)
        return (twist.left > QUIET * size) & ("twist" in self.rig.groups)

    def shaken(self, values: np.ndarray, spread: Sequence[np.ndarray], draws: int) -> np.ndarray | None:
        """What `draws` errors of the twists make of the scaled residuals, `[draws, M]`; None without noise.

        The draws are always the same ones.
        """
        if not any(self._noisy(twist).any() for twist in self.twists):
            return None
        contact, rig = self.split(values)
        random, base = np.random.default_rng(0), self.shown(values)
        result = []
        for _ in range(draws):
            shown = []
            for i, (log, twist, shape) in enumerate(zip(self.logs, self.twists, self.shapes, strict=True)):
                moved = twist.values + np.where(self._noisy(twist), twist.error(random), 0.0)
                p = Prediction(self.simulator, log, moved, begins=self.begins, refine=self.refine)
                wrench = p.wrenches(shape.vector(contact), self.rig.delay(rig))
                shown.append(self.rig.added(i, rig, wrench, np.zeros_like(wrench))[0])
            change = [new - old + log.wrench for new, old, log in zip(shown, base, self.logs, strict=True)]
            result.append(self._scaled(change, spread))
        return np.array(result)

    def sliding(self, values: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Sliding speed `|V_S|` and its part from spin [m/s], `[T]` each, of each log."""
        contact, _ = self.split(values)
        result = []
        for twist, shape in zip(self.twists, self.shapes, strict=True):
            vector = dict(zip(PARAMETERS, shape.vector(contact), strict=True))
            centre = np.array([vector["centre_x"], vector["centre_y"]])
            scaled = twist.values @ scaling(centre, vector["contact_radius"]).T
            result.append((np.linalg.norm(scaled, axis=1), np.abs(scaled[:, 2])))
        return result


def block_diag(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Two matrices along a diagonal."""
    result = np.zeros((one.shape[0] + other.shape[0], one.shape[1] + other.shape[1]))
    result[: one.shape[0], : one.shape[1]] = one
    result[one.shape[0] :, one.shape[1] :] = other
    return result


def fixed_model(patch: ContactPatch, law: LuGre, surface: Any, load: float) -> ReducedModelPublished:
    """The reduced model of the patch's shape at one load."""
    if not (isinstance(surface, type) and issubclass(surface, LimitSurface)):
        raise InvalidValueError("surface", "be a class of limit surfaces", surface)
    if patch.depends_on_load:
        weights = patch.weights(load)
        patch = ContactPatch(patch.positions, patch.areas, weights / patch.areas, patch.grid, patch.name)
    return ReducedModelPublished(patch, law, surface=surface(patch))


def _follow_load(vector: np.ndarray, patch: ContactPatch, load: float) -> None:
    """Write the moments of the patch at a load into the vector of the model."""
    x, y = patch.centre_of_pressure(load)
    shape = {"contact_radius": patch.contact_radius(load), "second_moment": patch.second_moment(load)}
    for name, value in {**shape, "centre_x": x, "centre_y": y}.items():
        vector[PARAMETERS.index(name)] = float(value)


def _check_finger(patch: ContactPatch, names: Sequence[str]) -> None:
    if not isinstance(patch.pressure, SoftFinger):
        raise InvalidValueError("patch", f"have a SoftFinger pressure to estimate {', '.join(names)}", patch.name)
    for name in ("k", "k_per_newton"):
        if name in names and getattr(patch.pressure, name) is None:
            raise InvalidValueError("parameters", f"contain {name} only if the SoftFinger has it", name)


def mean_load(log: Log) -> float:
    loaded = log.normal_force[log.normal_force > 0.0]
    if not len(loaded):
        raise InvalidValueError(f"normal_force of {log.name}", "be > 0 somewhere", "0 everywhere")
    return float(loaded.mean())


def _check_wrenches(logs: Sequence[Log]) -> None:
    for log in logs:
        if not log.wrench.any():
            raise InvalidValueError(f"wrench of {log.name}", "not be 0 throughout", "0 in every sample")


def _check_constant(logs: Sequence[Log], loads: Sequence[float]) -> None:
    for log, load in zip(logs, loads, strict=True):
        if np.abs(log.normal_force / load - 1.0).max() > CONSTANT:
            rule = "stay within 10 % of its mean if the patch changes with the load (make one log for each load)"
            raise InvalidValueError(
                f"normal_force of {log.name}", rule, f"{log.normal_force.min():g} .. {log.normal_force.max():g} N"
            )


def given_noise(noise: Any) -> np.ndarray:
    values = validation.vector("noise", noise, 3)
    if not (values > 0.0).all():
        raise InvalidValueError("noise", "be > 0", values.tolist())
    return values
