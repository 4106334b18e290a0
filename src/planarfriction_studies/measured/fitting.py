"""Fits of a few numbers to the training half."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from planarfriction_studies.measured.questions import Case, SlideQuestion

MU = 0.22
"""Initial guess of the friction coefficient of a slide [-]."""

DIFFERENCE = 0.02
"""Share of a number over which its derivative is taken."""

Slides = Callable[[np.ndarray, Sequence[SlideQuestion]], list[np.ndarray]]
"""Poses `[T, 3]` of slides for given numbers."""


def fit_slides(predict: Slides, begin: Sequence[float], cases: Sequence[Case], length: float) -> np.ndarray:
    """Return numbers with the least mean square of the position error at the end and `length` times the error in
    yaw."""
    from scipy.optimize import least_squares

    questions, ends = [case.question for case in cases], np.array([case.answer[-1] for case in cases])
    scale = np.asarray(begin, dtype=float)

    def off(shares: np.ndarray) -> np.ndarray:
        found = np.array([poses[-1] for poses in predict(shares * scale, questions)])
        return ((found - ends) * [1.0, 1.0, length]).ravel()

    # sharing 1e-3 of a number is a tenth of its standard error; the path of a slide is nearly linear in 1/mu
    found = least_squares(off, np.ones(len(scale)), diff_step=DIFFERENCE, xtol=1e-3, ftol=1e-4, bounds=(0.2, 5.0))
    return found.x * scale


def fit_angles(errors: Callable[[float], float], low: float, high: float) -> float:
    """Return the number between `low` and `high` with the least mean error, by a search over 24 of them and a finer
    one."""
    tried = np.geomspace(low, high, 24)
    best = tried[np.argmin([errors(value) for value in tried])]
    fine = best * np.geomspace(low / high, high / low, 25) ** (1.0 / 23.0)
    return float(fine[np.argmin([errors(value) for value in fine])])
