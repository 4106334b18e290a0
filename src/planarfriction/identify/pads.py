"""Stiffness of a pad, and its common part, from logs of small cycles and large slips."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction._support.described import described
from planarfriction._support.equality import ByValue
from planarfriction.derivatives import rollout
from planarfriction.errors import InvalidValueError
from planarfriction.identify.logs import Log, as_tuple
from planarfriction.identify.parameters import check_patch
from planarfriction.identify.verdicts import CORRELATED, TWO_SIDED, Verdict
from planarfriction.laws import LuGre
from planarfriction.models import DistributedModel
from planarfriction.pads import HalfSpace, Layer, Measured, Pad
from planarfriction.patch import ContactPatch

OF_PAD: dict[type[Pad], tuple[str, ...]] = {
    Layer: ("shear_modulus",),
    HalfSpace: ("shear_modulus",),
    Measured: ("stiffness", "common"),
}
"""Parameters of a pad that are estimated, by its kind."""

UNITS = {"shear_modulus": "Pa", "stiffness": "N/m", "common": "-", "mu_c": "-"}
"""Units of the estimates."""

LOGARITHMIC = "shear_modulus", "stiffness", "mu_c"
"""Estimates that are fitted as logarithms."""

PRIOR = {"shear_modulus": 3.0, "stiffness": 3.0, "common": 0.5, "mu_c": 1.0}
"""Standard deviations of fitted numbers a priori."""

VAGUE = 0.1
"""Standard error of a fitted number above which it is not identifiable."""

REMEDIES = {
    "shear_modulus": "add small cycles in which the contact sticks",
    "stiffness": "add small cycles in which the contact sticks",
    "common": "add rotations, which have no common part, beside shifts",
    "mu_c": "add a slip of the whole contact",
}
"""Motion that the logs lack if an estimate is not identifiable."""

SMALL = 0.01
"""Residual, as a share of the largest value of its channel, below which its pattern does not matter."""

LARGEST_COMMON = 0.95
"""Largest common part that is tried [-]."""

FARTHEST = 10.0
"""Largest change of a logarithm, a factor of 22,000."""

STARTS = np.logspace(-1.5, 1.5, 7)
"""Factors of a first guess of the stiffness from which the best is taken."""

PASSES = 3
"""Fits, each with the noise that the one before left."""

CHANGE = 1e-3
"""Change of a fitted number for derivatives."""


@described
@dataclass(frozen=True, eq=False)
class PadFit(ByValue):
    """Estimates of a pad, and verdicts on them."""

    names: tuple[str, ...]
    """Names of the estimates, those of the pad first, then mu_c."""
    values: np.ndarray
    """Estimates [SI], `[F]`."""
    standard_errors: np.ndarray
    """Standard errors [SI], `[F]`."""
    verdicts: tuple[Verdict, ...]
    """Verdicts on a pad that does not explain the logs, and on estimates that are not identifiable."""
    noise: np.ndarray
    """Standard deviation of what is left of fx, fy and tau [N, N, N m], `[3]`; infinite for a channel without data."""
    pad: Pad
    """Pad with the estimates."""
    law: LuGre
    """Law with the estimate of mu_c."""

    def intervals(self) -> dict[str, tuple[float, float]]:
        """Return intervals of 95 % by name, `(low, high)` [SI]; of a stiffness and mu_c with equal factors."""
        found = {}
        for name, value, error in zip(
            self.names, self.values, self.standard_errors, strict=True
        ):
            half = TWO_SIDED * float(error)
            if name in LOGARITHMIC:
                factor = math.exp(half / value)
                found[name] = float(value / factor), float(value * factor)
            else:
                found[name] = max(float(value) - half, 0.0), float(value) + half
        return found

    def identifiable(self, name: str) -> bool:
        """Return True if the logs determine an estimate. Raises InvalidValueError for an unknown name."""
        validation.choice("name", name, self.names)
        return all(
            each.identifiable for each in self.verdicts if each.parameter == name
        )

    def __str__(self) -> str:
        lines = [str(each) for each in self.verdicts]
        for name, (low, high) in self.intervals().items():
            if self.identifiable(name):
                value = self.values[self.names.index(name)]
                span = f"{low:.4g} to {high:.4g} {UNITS[name]}"
                lines.append(f"{name} = {value:.4g} ({span})")
        return "\n".join(lines)


def identify_pad(
    log: Log | Sequence[Log], patch: ContactPatch, pad: Pad, law: LuGre
) -> PadFit:
    """Estimate the stiffness of a pad, its common part and mu_c from logs of twist and wrench that begin at rest.

    Nonlinear least squares for the wrenches of `DistributedModel(patch, law, pad=pad)`, over the noise that the fit
    leaves; a patch of about 100 cells is quick. Of a `Pad.layer` and a `Pad.half_space` the shear modulus is estimated,
    of a `Pad.measured` the stiffness and `common`; `mu_s` keeps its ratio to `mu_c`, all else is as given. Twists are
    taken as exact. If neighbouring residuals are correlated, a verdict says that the model does not explain the logs,
    and intervals are wrong.

    Raises InvalidValueError for what is not a log, patch, pad or law of these kinds, and as `DistributedModel` does.
    """
    logs = as_tuple("log", log, Log)
    check_patch(patch, "identify_pad")
    validation.instance("law", law, LuGre, "a LuGre")
    if type(pad) not in OF_PAD:
        rule = "be a Pad.layer, Pad.half_space or Pad.measured"
        raise InvalidValueError("pad", rule, type(pad).__name__)
    problem = _Problem(logs, patch, pad, law)
    weights = problem.channels / np.abs(problem.measured).max(axis=0, initial=1e-12)
    x = problem.start(weights)
    for _ in range(PASSES):
        x, slopes, left = problem.fitted(x, weights)
        spread = np.sqrt((left**2).sum(axis=0) / max(len(left) - len(x) / 3.0, 1.0))
        weights = problem.channels / np.maximum(spread, 1e-12)
    scaled = (slopes * weights[:, None]).reshape(-1, len(x))
    prior = np.array([PRIOR[name] for name in problem.names])
    told = np.linalg.inv(scaled.T @ scaled + np.diag(prior**-2.0))
    errors = np.sqrt(np.diag(told))
    verdicts = problem.verdicts(left)
    verdicts += [
        Verdict(name, False, REMEDIES[name])
        for name, error in zip(problem.names, errors, strict=True)
        if error > VAGUE
    ]
    values = problem.values(x)
    per = np.where(problem.logarithmic, values, 1.0)
    noise = np.where(problem.channels, spread, np.inf)
    pad, law = problem.with_values(x)
    return PadFit(problem.names, values, per * errors, tuple(verdicts), noise, pad, law)


class _Problem:
    """Logs, and the wrenches of a model with fitted numbers x."""

    def __init__(
        self, logs: Sequence[Log], patch: ContactPatch, pad: Pad, law: LuGre
    ) -> None:
        self._logs = logs
        self._patch = patch
        self._pad = pad
        self._law = law
        self.names = (*OF_PAD[type(pad)], "mu_c")
        self.logarithmic = np.isin(self.names, LOGARITHMIC)
        self.measured = np.concatenate([each.wrench[1:] for each in logs])
        self.channels = np.any([each.channels for each in logs], axis=0).astype(float)
        own = [float(getattr(pad, name)) for name in self.names[:-1]]
        self._first = self._numbers(np.array([*own, law.mu_c]))
        least = np.where(self.logarithmic, self._first - FARTHEST, 0.0)
        most = np.where(self.logarithmic, self._first + FARTHEST, LARGEST_COMMON)
        self.bounds = least, most

    def _numbers(self, values: np.ndarray) -> np.ndarray:
        safe = np.where(self.logarithmic, values, 1.0)
        return np.where(self.logarithmic, np.log(safe), values)

    def values(self, x: np.ndarray) -> np.ndarray:
        """Return the values of fitted numbers."""
        return np.where(self.logarithmic, np.exp(np.where(self.logarithmic, x, 0.0)), x)

    def with_values(self, x: np.ndarray) -> tuple[Pad, LuGre]:
        """Return pad and law with fitted numbers."""
        *own, mu_c = self.values(x).tolist()
        changes = dict(zip(self.names, own, strict=False))
        pad: Any = dataclasses.replace(self._pad, **changes)  # pyright: ignore
        mu_s = max(mu_c * self._law.mu_s / self._law.mu_c, mu_c)
        return pad, dataclasses.replace(self._law, mu_c=mu_c, mu_s=mu_s)

    def wrenches(self, x: np.ndarray) -> np.ndarray:
        """Return the wrenches at all samples but the first of each log, `[T, 3]`."""
        pad, law = self.with_values(x)
        model = DistributedModel(self._patch, law, pad=pad)
        found = []
        for log in self._logs:
            twist = log.twist[1:]
            if not log.held:
                twist = 0.5 * (twist + log.twist[:-1])
            steps = np.diff(log.time)
            load = log.normal_force[1:]
            found.append(rollout(model, None, twist, load, steps).wrenches)
        return np.concatenate(found)

    def verdicts(self, left: np.ndarray) -> list[Verdict]:
        """Return a verdict on the fit if neighbouring residuals `[T, 3]` are correlated, as noise is not."""
        square = (left**2).sum(axis=0)
        large = np.sqrt(square / len(left)) > SMALL * np.abs(self.measured).max(axis=0)
        large &= self.channels > 0.0
        pairs = (left[1:] * left[:-1]).sum(axis=0)
        alike = np.max(pairs[large] / square[large], initial=0.0)
        if alike <= CORRELATED:
            return []
        reason = f"neighbouring residuals are correlated ({alike:.2f})"
        cause = "the kind of pad, the law, the patch or the measurement is wrong"
        return [Verdict("fit", False, f"{reason}: {cause}")]

    def start(self, weights: np.ndarray) -> np.ndarray:
        """Return the best of some numbers, with the friction that the largest force asks for."""
        loads = np.concatenate([each.normal_force[1:] for each in self._logs])
        size = np.hypot(*self.measured[:, :2].T)
        first = self._first.copy()
        pressed = loads > 0.0
        if size.any() and pressed.any():
            first[-1] = np.log(np.quantile(size[pressed] / loads[pressed], 0.98))
        if "common" in self.names:
            first[1] = 0.5
        tried = []
        for factor in STARTS:
            x = first.copy()
            x[0] += np.log(factor)
            left = (self.wrenches(x) - self.measured) * weights
            tried.append(((left**2).sum(), x))
        return min(tried, key=lambda each: each[0])[1]

    def fitted(
        self, x: np.ndarray, weights: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the numbers that fit, with derivatives of wrenches `[T, 3, F]` and residuals `[T, 3]` there."""
        from scipy.optimize import least_squares

        prior = np.array([PRIOR[name] for name in self.names])

        def misfit(x: np.ndarray) -> np.ndarray:
            left = (self.wrenches(x) - self.measured) * weights
            return np.append(left.ravel(), (x - self._first) / prior)

        def slopes(x: np.ndarray) -> np.ndarray:
            found = (self._slopes(x) * weights[:, None]).reshape(-1, len(x))
            return np.vstack([found, np.diag(1.0 / prior)])

        low, high = self.bounds
        x = np.clip(x, low + 1e-6, high - 1e-6)
        fit = least_squares(
            misfit,
            x,
            slopes,  # pyright: ignore[reportArgumentType]
            self.bounds,
            xtol=1e-5,
            max_nfev=30,
        )
        return fit.x, self._slopes(fit.x), self.wrenches(fit.x) - self.measured

    def _slopes(self, x: np.ndarray) -> np.ndarray:
        columns = []
        for i in range(len(x)):
            step = CHANGE * (np.arange(len(x)) == i)
            above = np.minimum(x + step, self.bounds[1])
            below = np.maximum(x - step, self.bounds[0])
            ends = self.wrenches(above) - self.wrenches(below)
            columns.append(ends / (above - below)[i])
        return np.stack(columns, -1)
