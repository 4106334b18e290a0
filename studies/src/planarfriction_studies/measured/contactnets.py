"""Slides whose friction is their own: what differs from toss to toss is estimated from the first poses of each.

A slide has friction `(mu_0 W(V) - mu_1 (vx, vy, k^2 omega)) e^a` about a centre of pressure that is off by `c` across
its way, with the contact radius `r e^b`; `a`, `c` and `b` differ from toss to toss with spreads that all tosses share.
With a start and these three free, the first poses are fitted by least squares with the spreads as priors.

The poses miss the model for two reasons: the camera, and pushes that the model does not know, strong right after the
cube has landed. Pushes make errors that are correlated, so the poses are weighed with the covariance that white pushes
of intensity `q_0^2 exp(-t/tau) + q_1^2` leave behind, seen from the last of them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from planarfriction.identify.slides import weights
from planarfriction.limit_surface import LimitSurfaceExact
from planarfriction.patch import ContactPatch
from planarfriction_studies.measured import slide_integrator
from planarfriction_studies.measured.end_regions import (
    LEVELS,
    EndRegions,
    moved_to,
    shares,
)
from planarfriction_studies.measured.models import quick
from planarfriction_studies.measured.questions import (
    FIRST_POSES,
    BatchModel,
    Case,
    SlideQuestion,
)

LANDED = 3.4e-3
"""Time over which the pushes of the landing die away [s]: half a sample."""

SEEN = np.array([2e-5, 2e-5, 5e-4])
"""Noise of the camera [m, m, rad]: what a smooth curve leaves over."""

CHANGES = np.array([*slide_integrator.CHANGES, 0.02, 1e-3, 0.05])
"""Changes of twist, a, c and b that derivatives are taken over."""

BEGIN = np.array([0.3, 0.02, 8.0, 1.0, 0.05, 4e-3, 0.2])
"""Initial guess of the spreads: q_0 and q_1 of the position [m s^-1.5], of the angle, spreads of a, c [m] and b."""

LOOSE = 1.5
"""Spread of their logarithms about `BEGIN`, which keeps what the tosses do not tell from running away."""

STEPS = 25
"""Steps of the fit of the spreads: more change the errors by less than 0.01 mm and 0.01 deg."""

FAR, ROUNDS = 5.0, 4
"""Misfit of a pose in usual misfits beyond which it counts less, by the fourth power of what it is beyond that, and
rounds of reweighting: two more change no error by 1 %."""

SIGMA = 1.4826
"""Standard deviation over the median of the magnitudes of normal numbers."""

FOLDS = 4
"""Parts of the training tosses, each left out once to size the regions of the end."""


def friction(
    patch: ContactPatch, mu_0: float, mu_1: float, share: float
) -> slide_integrator.Friction:
    """Return the friction of slides with numbers of their own `(a, c_x, c_y, b)`, in the axes of the body, or with
    none.

    `share` is the contact radius over that of the patch.
    """
    wrench = quick(LimitSurfaceExact(patch))
    radius_squared = patch.weights() @ (patch.positions**2).sum(axis=1)

    def of(twist: np.ndarray, own: np.ndarray) -> np.ndarray:
        a, x, y, b = own.T if own.shape[1] else np.zeros((4, len(twist)))
        size = share * np.exp(b)
        vx = twist[:, 0] - twist[:, 2] * y
        vy = twist[:, 1] + twist[:, 2] * x
        spin = size * twist[:, 2]
        fx, fy, tau = mu_0 * wrench(np.stack([vx, vy, spin], axis=1)).T
        fx = np.exp(a) * (fx - mu_1 * vx)
        fy = np.exp(a) * (fy - mu_1 * vy)
        tau = np.exp(a) * size * (tau - mu_1 * radius_squared * spin)
        return np.stack([fx, fy, tau + x * fy - y * fx], axis=1)

    return of


@dataclass(frozen=True)
class SpeedModel(BatchModel):
    """The limit surface of the patch, friction that grows with the speed, and a fitted contact radius; slides only."""

    tasks = ("slides",)

    mu_0: float = 0.2
    mu_1: float = 0.05
    """Growth of the friction coefficient per speed [s/m]."""
    share: float = 1.2
    """Contact radius over that of the patch [-]."""

    def _answers(self, questions: Sequence[Any]) -> list[np.ndarray]:
        return slide_integrator.slides(
            friction(questions[0].patch, *dataclasses.astuple(self)), questions
        )

    def _fitted(self, cases: Sequence[Case]) -> SpeedModel:
        patch = cases[0].question.patch
        predict = lambda values, asked: slide_integrator.slides(
            friction(patch, *values), asked
        )
        return SpeedModel(
            *slide_integrator.fit_slides(
                predict, dataclasses.astuple(self), cases
            ).tolist()
        )

    def fitted_values(self) -> dict[str, float]:
        """Return the fitted numbers by name."""
        return {"mu": self.mu_0, "mu per m/s": self.mu_1, "lever/radius": self.share}


class Linear(NamedTuple):
    """Slides about a start each, as linear functions of it and of their own numbers."""

    start: np.ndarray
    """Pose, twist, a, c, b `[K, 9]`."""
    poses: np.ndarray
    """`[K, T, 3]`."""
    slopes: np.ndarray
    """`[K, T, 3, 9]`."""
    time: np.ndarray
    """`[T]`."""

    def rows(self, which: np.ndarray) -> Linear:
        """Return the slides `which`."""
        return Linear(
            self.start[which], self.poses[which], self.slopes[which], self.time
        )


@dataclass(frozen=True)
class TossModel(BatchModel):
    """`SpeedModel` with friction, radius and centre of pressure of each toss, from its first poses; slides only."""

    tasks = ("slides",)

    common: SpeedModel = SpeedModel()
    spreads: tuple[float, ...] = (*BEGIN, 0.0, 0.0)
    """Spreads as in `BEGIN`, then the means of a and b."""
    usual: np.ndarray | None = None
    """Usual misfits of first poses `[F, 3]` (see `estimate`): robust standard deviations over the training slides."""
    sized: EndRegions = field(default_factory=EndRegions)
    """Sizes of the regions of the end."""

    def _answers(self, questions: Sequence[Any]) -> list[np.ndarray]:
        linear = self.linear(questions)
        found = linear.start + self._estimate(linear, questions)[0]
        poses = slide_integrator.integrate(
            self._friction(questions),
            _state(found, _ways(questions)),
            linear.time,
            _radius(questions),
        )
        return [poses[i, : len(each.time)] for i, each in enumerate(questions)]

    def _fitted(self, cases: Sequence[Case]) -> TossModel:
        """Fit common friction, spreads between tosses and regions of the end to the training slides."""
        model = dataclasses.replace(self, common=self.common._fitted(cases))
        linear = model.linear([case.question for case in cases])
        full = model._with_spreads(linear, cases)
        # regions are sized on tosses that spreads were not fitted to, their errors over those that they were fitted to
        names = sorted({case.group for case in cases})
        fold = np.array([names.index(case.group) % FOLDS for case in cases])
        far = own = full.distances(cases)
        for k in range(min(FOLDS, len(names)) if len(names) > 1 else 0):
            known = fold != k
            other = fold == k
            rows = np.flatnonzero(known)
            part = model._with_spreads(
                linear.rows(rows), [cases[i] for i in rows.tolist()]
            ).distances(cases)
            far = np.where(
                other[:, None],
                part * np.median(own[known], axis=0) / np.median(part[known], axis=0),
                far,
            )
        questions = [case.question for case in cases]
        return dataclasses.replace(
            full,
            sized=EndRegions.fitted(moved_to(questions, full.ends(questions)[0]), far),
        )

    def _with_spreads(self, linear: Linear, cases: Sequence[Case]) -> TossModel:
        """Fit the spreads that predict the training slides best, with the weights of `identify_motion` on slides."""
        from scipy.optimize import minimize

        begun = self._with_usual(linear, cases)
        counts = begun._estimate(linear, [case.question for case in cases])[2]
        squares = _squares(np.array(begun.spreads), linear, cases, counts)
        weighed = weights(np.sqrt((squares / np.median(squares, axis=0)).sum(axis=1)))
        scale = weighed @ squares

        def misfit(x: np.ndarray) -> float:
            spreads = np.array([*(BEGIN * np.exp(x[:-2])), *x[-2:]])
            squares = weighed @ _squares(spreads, linear, cases, counts)
            return float(
                (squares / scale).sum() + 1e-3 * (x[:-2] ** 2).sum() / LOOSE**2
            )

        best = minimize(
            misfit,
            np.zeros(len(BEGIN) + 2),
            method="L-BFGS-B",
            options={"maxiter": STEPS},
        ).x
        model = dataclasses.replace(
            self, spreads=(*(BEGIN * np.exp(best[:-2])), *best[-2:])
        )
        return model._with_usual(linear, cases)

    def _with_usual(self, linear: Linear, cases: Sequence[Case]) -> TossModel:
        """Measure the usual misfits of poses at the present spreads."""
        even = np.ones((len(cases), FIRST_POSES))
        misfits = estimate(
            np.array(self.spreads), linear, [case.question for case in cases], even
        )[2]
        return dataclasses.replace(
            self, usual=SIGMA * np.median(np.abs(misfits), axis=0)
        )

    def _estimate(
        self, linear: Linear, questions: Sequence[SlideQuestion]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return changes and covariances as `estimate` does, and the weights of the poses: robust, reweighted least
        squares."""
        spreads = np.array(self.spreads)
        counts = np.ones((len(questions), FIRST_POSES))
        for _ in range(0 if self.usual is None else ROUNDS):
            far = np.abs(
                estimate(spreads, linear, questions, counts)[2] / self.usual
            ).max(axis=2)
            counts = (FAR / np.maximum(far, FAR)) ** 4
        return (*estimate(spreads, linear, questions, counts)[:2], counts)

    def fitted_values(self) -> dict[str, float]:
        """Return the fitted numbers by name."""
        a, c, b, a_0, b_0 = self.spreads[4:]
        common = self.common.fitted_values()
        common["mu"], common["mu per m/s"] = (
            common["mu"] * np.exp(a_0),
            common["mu per m/s"] * np.exp(a_0),
        )
        common["lever/radius"] *= np.exp(b_0)
        return common | {
            "spread of mu": a,
            "of the centre [mm]": 1e3 * c,
            "of the lever": b,
        }

    def check(self, cases: Sequence[Case]) -> dict[str, Any]:
        """Return the usual sizes of the regions, and the shares of ends inside those of each of `LEVELS` (`shares`)."""
        questions = [case.question for case in cases]
        reached = np.array([case.answer[-1] for case in cases])
        regions = self.regions(questions)
        far = self.distances(cases)
        axes = 1e3 * np.sqrt(np.linalg.eigvalsh(regions[:, :2, :2]))
        found: dict[str, Any] = {
            "half axis along the path, median [mm]": float(np.median(axes[:, 1])),
            "half axis across it, median [mm]": float(np.median(axes[:, 0])),
            "half width of the interval, median [deg]": float(
                np.degrees(np.median(np.sqrt(regions[:, 2, 2])))
            ),
        }
        predicted = moved_to(questions, self.ends(questions)[0])
        moved = moved_to(questions, reached)
        for i, name in enumerate(("places", "angles")):
            for level in LEVELS:
                inside = far[:, i] <= self.sized.radii(predicted, level)[:, i]
                found[f"{name} inside {level:.0%} regions [%]"] = shares(inside, moved)
        return found

    def ends(self, questions: Sequence[SlideQuestion]) -> tuple[np.ndarray, np.ndarray]:
        """Return the predicted poses at the last sample `[K, 3]` and their covariances `[K, 3, 3]` by the spreads."""
        linear = self.linear(questions)
        answers = self.answer_all(questions)
        spread = self._estimate(linear, questions)[1]
        found = []
        for i, each in enumerate(questions):
            last = len(each.time) - 1
            left = each.time[last] - each.time[FIRST_POSES - 1]
            slope = linear.slopes[i, last]
            pushed = (
                np.array([self.spreads[1], self.spreads[1], self.spreads[3]]) ** 2
                * left**3
                / 3.0
            )
            found.append(slope @ spread[i] @ slope.T + np.diag(pushed))
        return np.array([answer[-1] for answer in answers]), np.array(found)

    def regions(
        self, questions: Sequence[SlideQuestion], level: float = 0.95
    ) -> np.ndarray:
        """Return matrices S `[K, 3, 3]` of the regions that are to hold a share `level` of the ends.

        Places have `d' S^-1 d <= 1`, with S the part of x and y; angles are within the root of their part.

        Raises InvalidValueError for a level that is not between 0 and 1.
        """
        ends, spread = self.ends(questions)
        size = self.sized.radii(moved_to(questions, ends), level)[:, [0, 0, 1]]
        return spread * size[:, :, None] * size[:, None]

    def distances(self, cases: Sequence[Case]) -> np.ndarray:
        """Return the errors of place and angle at the end in standard deviations, `[K, 2]`."""
        ends, spread = self.ends([case.question for case in cases])
        off = ends - np.array([case.answer[-1] for case in cases])
        place = np.einsum(
            "ki,kij,kj->k", off[:, :2], np.linalg.inv(spread[:, :2, :2]), off[:, :2]
        )
        return np.stack(
            [np.sqrt(place), np.abs(off[:, 2]) / np.sqrt(spread[:, 2, 2])], axis=1
        )

    def linear(self, questions: Sequence[SlideQuestion]) -> Linear:
        """Linearise slides about the start that fits the first poses best when no toss has friction of its own."""
        law = self._friction(questions)
        ways = _ways(questions)
        begun = slide_integrator.starts(law, questions, _radius(questions))
        start = np.concatenate([begun, np.zeros((len(begun), 3))], axis=1)
        time = max((each.time for each in questions), key=len)

        def poses_of(starts: np.ndarray) -> np.ndarray:
            states = _state(starts, np.tile(ways, (len(starts) // len(ways), 1)))
            return slide_integrator.integrate(law, states, time, _radius(questions))

        return Linear(
            start, *slide_integrator.linearised(poses_of, start, CHANGES), time
        )

    def _friction(
        self, questions: Sequence[SlideQuestion]
    ) -> slide_integrator.Friction:
        return friction(questions[0].patch, *dataclasses.astuple(self.common))


def _radius(questions: Sequence[SlideQuestion]) -> float:
    return questions[0].inertia / questions[0].mass


def _ways(questions: Sequence[SlideQuestion]) -> np.ndarray:
    """Return the unit vectors `[K, 2]` along the first velocities, in the axes of the bodies."""
    begun = slide_integrator.parabolas(questions)
    cos = np.cos(begun[:, 2])
    sin = np.sin(begun[:, 2])
    way = np.stack(
        [cos * begun[:, 3] + sin * begun[:, 4], cos * begun[:, 4] - sin * begun[:, 3]],
        axis=1,
    )
    return way / np.linalg.norm(way, axis=1)[:, None]


def _state(start: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """Return starts `[K, 6 + 4]` with the centre of pressure across the way."""
    a, c, b = start[:, 6:].T
    return np.column_stack([start[:, :6], a, -c * ways[:, 1], c * ways[:, 0], b])


def estimate(
    spreads: np.ndarray,
    linear: Linear,
    questions: Sequence[SlideQuestion],
    counts: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return changes `[K, 9]` of starts and own numbers by the first poses, their covariances `[K, 9, 9]`, and misfits.

    A misfit `[K, F, 3]` is the residual of a pose from the fit to all others: `(M_ii)^-1 (M r)_i`, where M is the
    inverse of the covariance of the residuals r with starts and own numbers unknown. Camera noise has the covariance
    `SEEN^2/counts`, with the weights `counts` `[K, F]` of the poses.
    """
    time = linear.time[:FIRST_POSES]
    count = len(questions)
    weights = np.zeros((count, FIRST_POSES, 3, FIRST_POSES, 3))
    less = (1.0 / counts - 1.0)[:, :, None] * np.eye(FIRST_POSES)
    for i, (begin, on) in enumerate((spreads[:2], spreads[:2], spreads[2:4])):
        weights[:, :, i, :, i] = np.linalg.inv(
            pushed(time, begin, on, SEEN[i]) + SEEN[i] ** 2 * less
        )
    weights = weights.reshape(count, 3 * FIRST_POSES, -1)
    slopes = linear.slopes[:, :FIRST_POSES].reshape(count, -1, 9)
    off = (
        np.array([each.first for each in questions]) - linear.poses[:, :FIRST_POSES]
    ).reshape(count, -1, 1)
    prior = np.zeros(9)
    mean = np.zeros(9)
    prior[6:] = 1.0 / spreads[4:7] ** 2
    mean[[6, 8]] = spreads[7:]
    turned = np.swapaxes(slopes, 1, 2) @ weights
    spread = np.linalg.inv(turned @ slopes + np.diag(prior))
    changes = spread @ (turned @ off + (prior * mean)[:, None])
    known = weights - np.swapaxes(turned, 1, 2) @ spread @ turned
    own = np.einsum("kiaib->kiab", known.reshape(count, FIRST_POSES, 3, FIRST_POSES, 3))
    left = (weights @ (off - slopes @ changes)).reshape(count, FIRST_POSES, 3, 1)
    return changes[..., 0], spread, np.linalg.solve(own, left)[..., 0]


def pushed(time: np.ndarray, begin: float, on: float, seen: float) -> np.ndarray:
    """Return the covariance `[T, T]` of poses about the motion that goes through the last of them undisturbed.

    `R(s, t) = seen^2 [s = t] + integral of (u - s)+ (u - t)+ (begin^2 exp(-u/tau) + on^2) du` up to the last time.
    """
    middle = (np.arange(64) + 0.5) / 64 * time[-1]
    since = np.maximum(middle - time[:, None], 0.0)
    intensity = begin**2 * np.exp(-middle / LANDED) + on**2
    return seen**2 * np.eye(len(time)) + (since * intensity * time[-1] / 64) @ since.T


def _squares(
    spreads: np.ndarray, linear: Linear, cases: Sequence[Case], counts: np.ndarray
) -> np.ndarray:
    """Return squares `[K, 4]` of the linear slides' errors in place and angle: means along the way, and at the end."""
    changes = estimate(spreads, linear, [case.question for case in cases], counts)[0]
    poses = linear.poses + np.einsum("ktci,ki->ktc", linear.slopes, changes)
    found = []
    for case, each in zip(cases, poses, strict=True):
        off = each[: len(case.answer)] - case.answer
        place = off[:, 0] ** 2 + off[:, 1] ** 2
        angle = off[:, 2] ** 2
        found.append([place.mean(), angle.mean(), place[-1], angle[-1]])
    return np.array(found)
