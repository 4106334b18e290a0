"""The least-squares problem: logs, a model whose parameters vary, residuals over the noise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.autodiff import PARAMETERS, parameters_of
from planarfriction.errors import InvalidValueError
from planarfriction.identify import parameters as known
from planarfriction.identify.least_squares import covariance
from planarfriction.identify.logs import Log
from planarfriction.identify.parameters import Coordinates, Shape
from planarfriction.identify.prediction import Prediction
from planarfriction.laws import LuGre
from planarfriction.limit_surface import LimitSurface
from planarfriction.limit_surface.base import scaling
from planarfriction.models import ReducedModelPublished
from planarfriction.patch import ContactPatch, SoftFinger

COARSE = 0.2
"""Error that the steps make, as a share of a standard error, above which they are halved."""

TOLD = 0.3
"""Standard error, as a share of an estimate, up to which that estimate has a say in this."""

FINEST = 32
"""Most steps between two samples."""

LEAST_NOISE = 1e-6
"""Noise below this share of the largest value of a channel is none that a sensor has."""

CONSTANT = 0.1
"""Share by which the load of a log may stray from its mean where the patch changes with the load."""


class Problem:
    """Logs, model and the values that vary."""

    def __init__(self, logs, patch, names, law, surface, begins, refine):
        self.logs, self.names, self.law, self.patch = logs, names, law, patch
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
        self.predictions = self._predictions(refine)
        # A log at rest has no sample before its first step; its first wrench shows bristles that nobody knows.
        self.used = [slice(1 if begins == "rest" else 0, None) for _ in logs]

    def _predictions(self, refine: int) -> list[Prediction]:
        return [Prediction(self.model, log, begins=self.begins, refine=refine) for log in self.logs]

    def refine_twice(self) -> None:
        """Take twice as many steps."""
        self.refine *= 2
        self.predictions = self._predictions(self.refine)

    def coarse(self, values: np.ndarray, noise: np.ndarray) -> bool:
        """Whether twice as many steps would move an estimate by more than `COARSE` of its standard error."""
        if self.refine >= FINEST:
            return False
        off, jacobian = self.linearised(values, noise)
        finer = [
            p.wrenches(s.vector(values)) for p, s in zip(self._predictions(2 * self.refine), self.shapes, strict=True)
        ]
        change = self._scaled(finer, noise) - off
        spread = covariance(jacobian, np.full(len(values), True))
        errors = np.sqrt(np.diag(spread))
        told = errors < TOLD * np.abs(values)
        moved = np.where(np.isfinite(spread), spread, 0.0) @ (jacobian.T @ change)
        return bool((np.abs(moved)[told] > COARSE * errors[told]).any())

    def start_values(self, law: LuGre) -> np.ndarray:
        """Values `[F]` of the names in a law, a patch and its pressure."""
        base = dict(zip(PARAMETERS, parameters_of(self.model), strict=True))
        values = {**base, **{name: getattr(law, name) for name in known.LAW if name != "breakaway_ratio"}}
        if any(name in known.SOFT_FINGER for name in self.names):
            values |= {name: getattr(self.patch.pressure, name) for name in known.SOFT_FINGER}
        return np.array([float(values[name]) for name in self.names])

    def wrenches(self, values: np.ndarray) -> list[np.ndarray]:
        """Predicted wrenches `[T, 3]` of each log."""
        return [p.wrenches(s.vector(values)) for p, s in zip(self.predictions, self.shapes, strict=True)]

    def residuals(self, coordinates: Coordinates, noise: np.ndarray):
        """Function of the coordinates that returns predicted minus measured over noise, and its derivatives."""

        def evaluate(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            values = coordinates.values(x)
            off, slopes = self.linearised(values, noise)
            pull, per_pull = coordinates.prior(x)
            return np.concatenate([off, pull]), np.concatenate([slopes @ coordinates.slopes(x), per_pull])

        return evaluate

    def linearised(self, values: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Scaled residuals `[M]` and their derivatives `[M, F]` with respect to the values."""
        offs, slopes = [], []
        for prediction, shape, used in zip(self.predictions, self.shapes, self.used, strict=True):
            per_value = shape.slopes(values)
            rows = np.flatnonzero(per_value.any(axis=1))
            wrench, slope = prediction.sensitivities(shape.vector(values), [PARAMETERS[row] for row in rows])
            seen = prediction.log.channels / noise
            offs.append(((wrench - prediction.log.wrench) * seen)[used].ravel())
            slopes.append(((slope @ per_value[rows]) * seen[:, None])[used].reshape(-1, len(self.names)))
        return np.concatenate(offs), np.concatenate(slopes)

    def off(self, values: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Scaled residuals `[M]`."""
        return self._scaled(self.wrenches(values), noise)

    def _scaled(self, wrenches: Sequence[np.ndarray], noise: np.ndarray) -> np.ndarray:
        """Wrenches minus the measured ones over the noise, all used samples flat."""
        both = zip(wrenches, self.logs, self.used, strict=True)
        return np.concatenate(
            [((wrench - log.wrench) * (log.channels / noise))[used].ravel() for wrench, log, used in both]
        )

    def noise(self, values: np.ndarray) -> np.ndarray:
        """Spread of the residuals of each channel `[3]`, with the degrees of freedom that the parameters took."""
        off = self.off(values, np.ones(3)).reshape(-1, 3)
        both = zip(self.logs, self.used, strict=True)
        samples = np.sum([len(log.time[used]) * log.channels for log, used in both], axis=0)
        free = max(samples.sum() - len(self.names), 1)
        spread = np.sqrt((off**2).sum(axis=0) / np.maximum(samples, 1) * samples.sum() / free)
        return np.where(samples > 0, np.maximum(spread, _least_noise(self.logs)), np.inf)

    def sliding(self, values: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Sliding speed `|V_S|` and its part from spin [m/s], `[T]` each, of each log."""
        result = []
        for log, shape in zip(self.logs, self.shapes, strict=True):
            vector = dict(zip(PARAMETERS, shape.vector(values), strict=True))
            centre = np.array([vector["centre_x"], vector["centre_y"]])
            scaled = log.twist @ scaling(centre, vector["contact_radius"]).T
            result.append((np.linalg.norm(scaled, axis=1), np.abs(scaled[:, 2])))
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
            raise InvalidValueError("parameters", f"hold {name} only where the SoftFinger has it", name)


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
            rule = "stay within 10 % of its mean where the patch changes with the load (make one log of each load)"
            raise InvalidValueError(
                f"normal_force of {log.name}", rule, f"{log.normal_force.min():g} .. {log.normal_force.max():g} N"
            )


def given_noise(noise: Any) -> np.ndarray:
    values = validation.vector("noise", noise, 3)
    if not (values > 0.0).all():
        raise InvalidValueError("noise", "be > 0", values.tolist())
    return values


def _least_noise(logs: Sequence[Log]) -> np.ndarray:
    largest = np.max([np.abs(log.wrench).max(axis=0) for log in logs], axis=0)
    force = max(largest[:2].max(), np.finfo(float).tiny)
    return LEAST_NOISE * np.array([force, force, max(largest[2], np.finfo(float).tiny)])


def first_noise(logs: Sequence[Log]) -> np.ndarray:
    """Noise `[3]` from the jitter of the wrenches: the median second difference, which slow changes do not touch."""
    measured = np.any([log.channels for log in logs], axis=0)
    jitter = np.concatenate([np.abs(np.diff(log.wrench, 2, axis=0)) for log in logs])
    largest = np.max([np.abs(log.wrench).max(axis=0) for log in logs], axis=0)
    spread = np.maximum(1.4826 * np.median(jitter, axis=0) / np.sqrt(6.0), 1e-3 * largest)
    return np.where(measured, np.maximum(spread, _least_noise(logs)), np.inf)
