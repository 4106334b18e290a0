"""Result of a search for the best values of a problem (see `search`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.identify.parameters import Coordinates

NEAR = 4.0
"""Mean square of the residuals over that of the noise up to which a rough fit is near the data: steps are coarse."""


@dataclass(frozen=True)
class Fit:
    """Problem with its best values."""

    problem: Any
    """`Problem` that was solved."""
    coordinates: Coordinates
    x: np.ndarray
    """Coordinates `[F + K]`."""
    values: np.ndarray
    """Values `[F + K]`."""
    at_bound: np.ndarray
    """Mask of the coordinates that lie on a bound, `[F + K]`."""
    noise: np.ndarray
    """Noise of each channel, `[3]`, or of the channels of each slide, `[S, 3]`."""
    sigma: list[np.ndarray]
    """Standard deviation of each residual, `[T, 3]` of each log or slide."""
    starts: tuple[int, int]
    """Number of starting points that led to this minimum, and number of all."""
    cost: float
    """Half the sum of the squared residuals."""

    @property
    def near(self) -> bool:
        """True if hardly more than noise is left."""
        return 2.0 * self.cost <= NEAR * self.problem.numbers
