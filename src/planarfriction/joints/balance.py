"""Torque balance of a joint along a measured motion: the model, its least squares, and the spread of its numbers.

`tau = J a + o + gravity + friction`, smoothed as the measured torque is. In sliding, friction is `S(v) level +
asymmetry + sigma_2 v + viscous_asymmetry |v|` with `level = mu_c + rise exp(-(v/v_s)^2) + load |tau_motor -
tau_external|`; the bristles of LuGre are a lag of its first two parts over the path, exactly. A joint without bristles
needs no stiffness: its friction is a sign. An asymmetric level and an offset o of the sensor look alike, so there is
one of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planarfriction.joints.loops.balance import Balance, slide
from planarfriction.joints.numbers import PARAMETERS, Values, least, slopes
from planarfriction.joints.smoothing import DELAYS, NORMAL, Rows

TERMS: dict[str, tuple[str, ...]] = {
    "gravity": ("gravity_sin", "gravity_cos"),
    "stribeck": ("rise", "v_s"),
    "load": ("load",),
    "bristles": ("sigma_0", "sigma_1"),
    "asymmetry": ("viscous_asymmetry", "asymmetry"),
}
"""Terms beside Coulomb and viscous friction, with their numbers."""

HUBER = 3.0
"""Error, in standard deviations, from which on it counts linearly."""

STEPS = 12
"""Most steps of a search."""


def predict(rows: Sequence[Rows], values: Values) -> list[np.ndarray]:
    """Compute the smoothed torque of each log at all of its rows, `[R]` [N m]."""
    numbers = Balance(**values)
    return [_predict(each, numbers) for each in rows]


def _predict(rows: Rows, numbers: Balance) -> np.ndarray:
    level = np.full_like(rows.speed, numbers.mu_c)
    if numbers.rise:
        level += numbers.rise * np.exp(-((rows.speed / numbers.v_s) ** 2))
    gravity = [numbers.gravity_sin, numbers.gravity_cos] @ rows.linear[2:]
    viscous = [numbers.sigma_2, numbers.viscous_asymmetry] @ rows.linear[:2]
    rest = numbers.inertia * rows.acceleration + viscous + gravity
    weights = rows.weights
    # The damping of bristles is a slope, which their smoothing takes as well.
    if numbers.sigma_0:
        weights = weights - numbers.sigma_1 / numbers.sigma_0 * rows.sloping
    # the motor's torque less that of all else
    driving = rest + gravity - 2.0 * rows.external
    friction = slide(numbers, weights, rows.path, rows.direction, level, driving)
    return numbers.torque_offset + rows.low_passed(rest + friction, numbers.low_pass)


def errors(rows: Sequence[Rows], values: Values) -> np.ndarray:
    """Compute modelled less measured torque at the fitted rows of all logs [N m]."""
    pairs = zip(predict(rows, values), rows, strict=True)
    return np.concatenate(
        [
            torque[log.fitted] - log.measured(values.get("delay", 0.0))
            for torque, log in pairs
        ]
    )


class Refined(NamedTuple):
    """Least squares of the model with one set of terms."""

    terms: tuple[str, ...]
    """Terms beside Coulomb and viscous friction."""
    values: dict[str, float]
    """Estimates by name."""
    spread: dict[str, float]
    """Standard errors by name, of logarithms for those that are searched by them."""
    error: np.ndarray
    """Model less measured torque at the fitted rows of all logs [N m]."""
    freedom: int
    """Degrees of freedom of the spread."""
    scores: np.ndarray
    """Error of each block as if it had been left out, squared and over the scatter."""
    scatter: np.ndarray
    """Scatter of the rows that are far from a reversal, and of those near one [N m]."""

    @property
    def score(self) -> float:
        """Sum of the scores."""
        return float(self.scores.sum())


def names_of(terms: Sequence[str], late: str = "delay") -> list[str]:
    """Return the names of what is estimated; `late` is "delay" or "low_pass"."""
    offset = [] if "asymmetry" in terms else ["torque_offset"]
    more = [name for term in TERMS if term in terms for name in TERMS[term]]
    return ["inertia", "mu_c", "sigma_2", *offset, late, *more]


RANGES = {
    "load": (-np.inf, PARAMETERS["load"].high),
    "delay": (float(DELAYS[0]), float(DELAYS[-1])),
}
"""Ranges in which the errors change: beyond, an estimate is at its bound."""


def limited(values: Values) -> dict[str, float]:
    """Return numbers within `RANGES`."""
    inside = {
        name: min(max(values[name], low), high)
        for name, (low, high) in RANGES.items()
        if name in values
    }
    return {**values, **inside}


def refine(
    rows: Sequence[Rows],
    start: Values,
    terms: Sequence[str],
    scatter: np.ndarray | None = None,
    late: str = "delay",
) -> Refined:
    """Minimise the errors of the model, softened by Huber's function, with a delay or a low pass of the torque.

    Rows near reversals and others count by the `scatter` of each, which is estimated unless it is given. Standard
    errors are those of a sandwich over blocks, whose errors may be correlated.
    """
    names = names_of(terms, late)
    # an asymmetric level and an offset of the torque are one number
    offset = start.get("torque_offset", start.get("asymmetry", 0.0))
    values = {
        name: ({"torque_offset": offset, "asymmetry": offset, "delay": 0.0} | start)[
            name
        ]
        for name in names
    }
    reversing = np.concatenate([each.reversing for each in rows])
    sizes = np.ones(2) if scatter is None else scatter

    def weighted(values: Values) -> np.ndarray:
        return errors(rows, limited(values)) / sizes[reversing]

    for _ in range(2 if scatter is None else 1):
        if scatter is None:
            sizes = _scatter(weighted(values) * sizes[reversing], reversing)
        values = limited(
            least(
                weighted,
                values,
                names,
                False,
                loss="huber",
                f_scale=HUBER,
                max_nfev=STEPS,
            )
        )
    error = weighted(values)
    size = np.abs(error)
    pull = np.minimum(1.0, HUBER / np.maximum(size, 1e-9))
    jacobian = slopes(weighted, values, names, error)
    norms = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    jacobian /= norms
    inverse = np.linalg.pinv(jacobian.T @ (pull[:, None] * jacobian), rcond=1e-13)
    begins = np.flatnonzero(np.diff(blocks_of(rows), prepend=-1))
    gradients = np.add.reduceat((pull * error)[:, None] * jacobian, begins)
    spare = len(begins) - len(names)
    covariance = (
        inverse @ (gradients.T @ gradients) @ inverse * (len(begins) / max(spare, 1))
    )
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0)) / norms
    softened = np.where(size < HUBER, size**2, 2.0 * HUBER * size - HUBER**2)
    # to first order, what leaving a block out adds to its error
    leverage = 2.0 * np.einsum("bi,ij,bj->b", gradients, inverse, gradients)
    scores = np.add.reduceat(softened, begins) + leverage
    named = dict(zip(names, spread.tolist(), strict=True))
    return Refined(
        tuple(terms),
        values,
        named,
        error * sizes[reversing],
        max(spare, 2),
        scores,
        sizes,
    )


def _scatter(error: np.ndarray, reversing: np.ndarray) -> np.ndarray:
    """Estimate the scatter of rows far from a reversal, and of those near one, by their medians."""
    size = np.abs(error)
    least = max(0.3 * float(np.median(size)), 1e-12)
    groups = [size[reversing == kind] for kind in (0, 1)]
    return np.array(
        [
            max(NORMAL * np.median(each), least) if len(each) > 20 else least
            for each in groups
        ]
    )


def blocks_of(rows: Sequence[Rows]) -> np.ndarray:
    """Return the number of the block of each fitted row of all logs."""
    return np.concatenate([each.block + 100_000 * i for i, each in enumerate(rows)])
