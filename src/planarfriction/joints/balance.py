"""Torque balance of a joint along a measured motion: the model, its least squares, and the spread of its numbers.

`tau = J a + o + gravity + friction`, smoothed as the measured torque is. In sliding, friction is `S(v) level +
asymmetry + sigma_2 v + viscous_asymmetry |v|` with `level = mu_c + rise exp(-(v/v_s)^2) + load |tau_motor -
tau_external|`; the bristles of LuGre are a lag of its first two parts over the path, exactly. A joint without bristles
needs no stiffness: its friction is a sign. An asymmetric level and an offset o of the sensor look alike, so there is
one of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction.joints.loops.runs import follow_path
from planarfriction.joints.smoothing import DELAYS, NORMAL, Rows

Values = Mapping[str, float]
"""Numbers of the model by name."""

ALWAYS = ("inertia", "mu_c", "sigma_2")
"""Numbers of every model, beside an offset of the torque or an asymmetry."""

TERMS: dict[str, tuple[str, ...]] = {
    "gravity": ("gravity_sin", "gravity_cos"),
    "stribeck": ("rise", "v_s"),
    "load": ("load",),
    "bristles": ("sigma_0", "sigma_1"),
    "asymmetry": ("viscous_asymmetry", "asymmetry"),
}
"""Terms beside Coulomb and viscous friction, with their numbers."""

FACTORS = ("v_s", "sigma_0")
"""Numbers that are searched by their logarithm."""

MOST_LOAD = 0.95
"""Largest growth of the level with the torque: a joint of 1 would lock itself."""

ROUNDS = 3
"""Rounds in which a level that grows with the model's own torque converges."""

FINE = 1e-5
"""Share of the squared errors that a step of a search must gain, far below what one log more or less changes."""

HUBER = 3.0
"""Error, in standard deviations, from which on it counts linearly."""


def predict(
    rows: Sequence[Rows], values: Values, terms: Sequence[str]
) -> list[np.ndarray]:
    """Compute the smoothed torque of each log at all of its rows, `[R]` [N m]."""
    return [_predict(each, values, terms) for each in rows]


def errors(rows: Sequence[Rows], values: Values, terms: Sequence[str]) -> np.ndarray:
    """Compute modelled less measured torque at the fitted rows of all logs [N m]."""
    pairs = zip(predict(rows, values, terms), rows, strict=True)
    return np.concatenate(
        [
            torque[log.fitted] - log.measured(values.get("delay", 0.0))
            for torque, log in pairs
        ]
    )


def miss(rows: Sequence[Rows], values: Values, terms: Sequence[str]) -> float:
    """Compute the mean absolute error of the model [N m]."""
    return float(np.abs(errors(rows, values, terms)).mean())


def _predict(rows: Rows, values: Values, terms: Sequence[str]) -> np.ndarray:
    speed = rows.speed
    direction = rows.direction
    gravity = np.zeros_like(speed)
    if "gravity" in terms:
        gravity = values["gravity_sin"] * np.sin(rows.angle) + values[
            "gravity_cos"
        ] * np.cos(rows.angle)
    level = np.full_like(speed, values["mu_c"])
    if "stribeck" in terms:
        level += values["rise"] * np.exp(-((speed / values["v_s"]) ** 2))
    viscous = values["sigma_2"] * speed
    if "asymmetry" in terms:
        viscous = viscous + values["viscous_asymmetry"] * np.abs(speed)
    inertial = values["inertia"] * rows.acceleration
    # torque of the motor less that of all else, but for friction
    driving = inertial + 2.0 * (gravity - rows.external)
    share = values["load"] if "load" in terms else 0.0
    uneven = values.get("asymmetry", 0.0)
    through = driving + direction * level + viscous
    through = np.abs(through) / (
        1.0 - share * np.clip(np.sign(through) * direction, -1.0, 1.0)
    )
    for _ in range(ROUNDS if share else 1):
        even = level + share * through
        friction = _bent(
            rows, direction * even + uneven, even + direction * uneven, values, terms
        )
        through = (
            np.abs(driving + rows.smoothed(friction + viscous)) if share else through
        )
    found = inertial + rows.smoothed(friction + viscous + gravity)
    return values.get("torque_offset", 0.0) + rows.low_passed(
        found, values.get("low_pass", 0.0)
    )


def _bent(
    rows: Rows,
    sliding: np.ndarray,
    level: np.ndarray,
    values: Values,
    terms: Sequence[str],
) -> np.ndarray:
    """Compute the torque of bristles that follow sliding friction over the path, plus their damping."""
    if "bristles" not in terms:
        return sliding
    stiffness = values["sigma_0"]
    lagged = np.empty((len(sliding), 1))
    follow_path(
        sliding[:, None], rows.path * stiffness / np.maximum(level, 1e-9), lagged
    )
    torque = lagged[:, 0]
    return torque + values["sigma_1"] / stiffness * np.gradient(torque, rows.spacing)


class Refined(NamedTuple):
    """Least squares of the model with one set of terms."""

    terms: tuple[str, ...]
    """Terms beside Coulomb and viscous friction."""
    values: dict[str, float]
    """Estimates by name."""
    spread: dict[str, float]
    """Standard errors by name, of logarithms for `FACTORS`."""
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


def names_of(terms: Sequence[str], late: str) -> list[str]:
    """Return the names of what is estimated; `late` is "delay" or "low_pass"."""
    offset = [] if "asymmetry" in terms else ["torque_offset"]
    return [
        *ALWAYS,
        *offset,
        late,
        *(name for term in TERMS if term in terms for name in TERMS[term]),
    ]


class _Scaled:
    """Numbers of a model as coordinates of similar size."""

    def __init__(self, rows: Sequence[Rows], values: Values, names: Sequence[str]):
        level = max(abs(values["mu_c"]), 1e-9)
        fastest = max(np.abs(each.speed).max() for each in rows)
        hardest = max(np.abs(each.acceleration).max() for each in rows)
        offset = values.get("torque_offset", values.get("asymmetry", 0.0))
        values = {"asymmetry": offset, "torque_offset": offset, **values}
        least = {
            "torque_offset": 0.1 * level, "asymmetry": 0.1 * level, "mu_c": level, "rise": 0.3 * level,
            "gravity_sin": 0.3 * level, "gravity_cos": 0.3 * level, "delay": 1e-3, "low_pass": 1e-3, "load": 0.1,
            "sigma_1": 0.005 * values.get("sigma_0", 1.0), "inertia": 0.1 * level / hardest,
            "sigma_2": 0.1 * level / fastest, "viscous_asymmetry": 0.1 * level / fastest,
        }  # fmt: skip
        self.names = names
        self.scale = np.array(
            [
                1.0 if each in FACTORS else max(abs(values[each]), least[each])
                for each in names
            ]
        )
        self.start = (
            np.array(
                [
                    np.log(values[each]) if each in FACTORS else values[each]
                    for each in names
                ]
            )
            / self.scale
        )

    def values(self, x: np.ndarray) -> dict[str, float]:
        """Return numbers by name, within their ranges."""
        scaled = (x * self.scale).tolist()
        found = {
            name: float(np.exp(np.clip(value, -30.0, 30.0)))
            if name in FACTORS
            else value
            for name, value in zip(self.names, scaled, strict=True)
        }
        if "load" in found:
            found["load"] = min(found["load"], MOST_LOAD)
        if "delay" in found:
            found["delay"] = float(np.clip(found["delay"], DELAYS[0], DELAYS[-1]))
        return found


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
    from scipy.optimize import least_squares

    scaled = _Scaled(rows, start, names_of(terms, late))
    reversing = np.concatenate([each.reversing for each in rows])

    def at(x: np.ndarray) -> np.ndarray:
        return errors(rows, scaled.values(x), terms)

    x = scaled.start
    for _ in range(2 if scatter is None else 1):
        sizes = _scatter(at(x), reversing) if scatter is None else scatter
        weighted: Callable[[np.ndarray], Any] = lambda x: at(x) / sizes[reversing]  # noqa: B023
        x = least_squares(
            weighted,
            x,
            diff_step=1e-5,
            max_nfev=12,
            ftol=FINE,
            loss="huber",
            f_scale=HUBER,
        ).x
    return _judged(scaled, x, at, sizes, rows, tuple(terms))


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


def _judged(
    scaled: _Scaled,
    x: np.ndarray,
    errors: Callable[[np.ndarray], np.ndarray],
    sizes: np.ndarray,
    rows: Sequence[Rows],
    terms: tuple[str, ...],
) -> Refined:
    """Compute standard errors and scores of a solution."""
    reversing = np.concatenate([each.reversing for each in rows])
    error = errors(x)
    weighted = error / sizes[reversing]
    size = np.abs(weighted)
    pull = np.minimum(1.0, HUBER / np.maximum(size, 1e-9))
    steps = 1e-4 * np.eye(len(x))
    jacobian = np.stack(
        [(errors(x + h) - error) / 1e-4 / sizes[reversing] for h in steps], axis=1
    )
    inverse = np.linalg.pinv(jacobian.T @ (pull[:, None] * jacobian), rcond=1e-13)
    parts = blocks_of(rows)
    gradients = np.array(
        [(jacobian[part] * (pull * weighted)[part, None]).sum(axis=0) for part in parts]
    )
    count = len(parts)
    freedom = max(count - len(x), 2)
    inflated = count / max(count - len(x), 1)
    covariance = inverse @ (gradients.T @ gradients) @ inverse * inflated
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0)) * scaled.scale
    softened = np.where(size < HUBER, size**2, 2.0 * HUBER * size - HUBER**2)
    # to first order, what leaving a block out adds to its error
    leverage = 2.0 * np.einsum("bi,ij,bj->b", gradients, inverse, gradients)
    scores = np.array([softened[part].sum() for part in parts]) + leverage
    values = scaled.values(x)
    named = dict(zip(scaled.names, spread.tolist(), strict=True))
    return Refined(terms, values, named, error, freedom, scores, sizes)


def blocks_of(rows: Sequence[Rows]) -> list[np.ndarray]:
    """Return the mask of each block among the fitted rows of all logs."""
    labels = np.concatenate([each.block + 100_000 * i for i, each in enumerate(rows)])
    return [labels == each for each in np.unique(labels)]
