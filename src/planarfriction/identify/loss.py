"""The robust loss of a fit: spoiled samples count little, and in the end nothing."""

from __future__ import annotations

import numpy as np

SOFT, SPOILED, FEW = 3.0, 6.0, 0.1
"""Residuals over the noise at which "soft_l1" passes from their squares to their sizes, and above which they are no
noise, and share of such ones up to which a robust fit ends without them."""


def softened(residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return residuals whose squares are the loss "soft_l1" at a scale of `SOFT`, `[M]`, and their derivatives."""
    root = np.sqrt(1.0 + (residual / SOFT) ** 2)
    factor = np.sqrt(2.0 / (1.0 + root))  # no difference of like numbers at small residuals
    return residual * factor, 1.0 / (root * factor)
