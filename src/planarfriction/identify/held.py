"""Parameters that a fit held at given values, and how far its residuals would move them: a score test.

For each, one Gauss-Newton step of it together with all that was fitted, from where the fit ended.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction.identify.parameters import ALL, LAW, fitted_law
from planarfriction.identify.uncertainty import RIDGE, Fit, Uncertainty

DENIED = 4.0
"""Standard errors by which the residuals must move a held value to deny it."""


class Pull(NamedTuple):
    """Parameter that was held, and the step that the residuals ask of it."""

    name: str
    value: float
    """Value at which it was held [SI]."""
    step: float
    """Step [SI]."""
    error: float
    """Standard error of the step [SI]."""
    moves: np.ndarray
    """Steps of the estimates along with it [SI], `[F]`."""

    @property
    def agrees(self) -> bool:
        """True if the residuals agree with the value."""
        return abs(self.step) <= DENIED * self.error

    def __str__(self) -> str:
        unit = ALL[self.name].unit.replace("-", "")
        text = f"{self.name} is held at {self.value:.3g} {unit}".rstrip()
        if not self.error < abs(self.value):
            return f"{text}; the data do not show it"
        to, low = self.value + self.step, ALL[self.name].low
        free = f"{to:.3g} +/- {self.error:.2g}" if to > low else f"below {low:g}"
        return f"{text}; the residuals {'agree' if self.agrees else 'contradict it'}: {free} if it were free"


def pulls_of_held(fit: Fit, u: Uncertainty) -> list[Pull]:
    """Return the parameters of the law that a fit of logs held, with the steps that its residuals ask of them."""
    problem = fit.problem
    count = len(problem.names)
    held = [name for name in LAW if name not in (*problem.names, "breakaway_ratio")]
    if not held:
        return []
    law = fitted_law(problem.law, problem.by_name(fit.values))
    values = [float(getattr(law, name)) for name in held]
    residual, slopes = problem.slopes_of(held, np.array(values), fit.values, fit.sigma)
    free = np.concatenate([~fit.at_bound[:count], np.full(len(fit.values) - count, True)])
    rows, result = np.concatenate([u.jacobian, u.pull]), []
    below = np.concatenate([residual, np.zeros(len(u.pull))])
    for i, (name, value) in enumerate(zip(held, values, strict=True)):
        if not slopes[:, i].any():
            result.append(Pull(name, value, 0.0, np.inf, np.zeros(count)))
            continue
        column = np.concatenate([slopes[:, i], np.zeros(len(u.pull))])
        both = np.column_stack([rows * free, column])
        size = np.maximum(np.linalg.norm(both, axis=0), np.finfo(float).tiny)
        curvature = np.linalg.inv((both / size).T @ (both / size) + RIDGE * np.eye(len(size)))
        # at the minimum, what was fitted has no slope left; its remainder is the pull's
        score = np.append(np.zeros(len(size) - 1), column @ below) / size
        step = -(curvature @ score) / size
        error = float(np.sqrt(curvature[-1, -1] * max(u.reduced_chi2, 1.0)) / size[-1])
        result.append(Pull(name, value, float(step[-1]), error, step[:count]))
    return result
