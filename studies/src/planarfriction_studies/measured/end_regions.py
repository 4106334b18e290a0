"""Regions of final poses at any level, sized by errors of slides that a fit has not seen (conformal prediction).

Errors have heavier tails than the normal distribution, and grow more with turn and length of a slide than covariances
say. So a region is a covariance times a width `sqrt(1 + (g_0 turn)^2 + (g_1 length)^2)`, fitted to the unseen errors,
times the quantile of those errors in such units.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from planarfriction.errors import InvalidValueError
from planarfriction_studies.measured.questions import SlideQuestion

LEVELS = (0.5, 0.8, 0.95)
"""Levels of regions that are checked."""

GROWTHS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Growths per median turn and length that are tried: from none to one beside which the constant part hardly counts."""


@dataclass(frozen=True, eq=False)
class EndRegions:
    """Sizes of regions of place and angle; the columns of the arrays are these two."""

    growth: np.ndarray = field(default_factory=lambda: np.zeros((2, 2)))
    """Growth with the turn [1/rad] (first row) and the length [1/m]."""
    sizes: np.ndarray = field(default_factory=lambda: np.ones((1, 2)))
    """Unseen errors in widths, in order, `[N, 2]`."""

    @classmethod
    def fitted(cls, moved: np.ndarray, far: np.ndarray) -> EndRegions:
        """Fit regions to turns and lengths `[N, 2]` and unseen errors `[N, 2]` in standard deviations.

        The widths s maximise the likelihood of Laplace's distribution, whose scale drops out:
        `log mean(far/s) + mean(log s)`.
        """
        tried = np.array(list(itertools.product(GROWTHS, repeat=2))) / np.median(
            moved, axis=0
        )
        widths = np.stack([_widths(moved, growth) for growth in tried])[..., None]
        misfits = np.log(np.mean(far / widths, axis=1)) + np.mean(
            np.log(widths), axis=1
        )
        growth = tried[np.argmin(misfits, axis=0)].T
        unsized = cls(growth)
        return cls(growth, np.sort(far / unsized.widths(moved), axis=0))

    def widths(self, moved: np.ndarray) -> np.ndarray:
        """Return the widths `[K, 2]` of regions for turns and lengths `[K, 2]`."""
        return np.stack([_widths(moved, growth) for growth in self.growth.T], axis=1)

    def radii(self, moved: np.ndarray, level: float) -> np.ndarray:
        """Return the radii `[K, 2]` of regions that hold a share `level` of ends, in standard deviations.

        Of N unseen errors the radius is the one of rank `ceil(level (N + 1))`, or the largest.

        Raises InvalidValueError for a level that is not between 0 and 1.
        """
        if not 0.0 < level < 1.0:
            raise InvalidValueError("level", "be between 0 and 1", level)
        rank = min(int(np.ceil(level * (len(self.sizes) + 1))), len(self.sizes)) - 1
        return self.sizes[rank] * self.widths(moved)


def _widths(moved: np.ndarray, growth: np.ndarray) -> np.ndarray:
    return np.sqrt(1.0 + ((moved * growth) ** 2).sum(axis=1))


def moved_to(questions: Sequence[SlideQuestion], ends: np.ndarray) -> np.ndarray:
    """Return turns [rad] and lengths [m] `[K, 2]` from the last of the first poses to ends `[K, 3]`."""
    off = ends - np.array([each.first[-1] for each in questions])
    return np.stack([np.abs(off[:, 2]), np.hypot(off[:, 0], off[:, 1])], axis=1)


def shares(inside: np.ndarray, moved: np.ndarray) -> list[float]:
    """Return the share [%] of `inside` `[K]` among all, and among the thirds of least to most turn, then length."""
    third = np.argsort(np.argsort(moved, axis=0), axis=0) * 3 // len(moved)
    groups = [third[:, 0] >= 0, *(third[:, i] == k for i in (0, 1) for k in range(3))]
    return [
        100.0 * float(inside[group].mean()) if group.any() else float("nan")
        for group in groups
    ]
