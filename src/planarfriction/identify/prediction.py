"""Predicted wrenches of a log: its samples become steps of a roll-out, the ends of some steps its samples again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from planarfriction.autodiff import rollout, rollout_sensitivities
from planarfriction.identify.logs import Log

STEADY_STEPS = 400
"""Steps with the first twist before a log that begins in steady sliding."""

MOST_STEPS = 2_000_000
"""Steps of one log that are still reasonable: more mean sample times of very different distances."""


class Prediction:
    """Roll-outs of one log, by a model whose vector of parameters varies.

    Between two samples twist and load are linear and held over half steps: node j holds from half a step before it to
    half a step after it. The bristle then travels the way of the trapezoidal rule and the wrench belongs to the twist
    of its sample; the error is of second order in `interval/refine`.
    """

    def __init__(self, model: Any, log: Log, *, begins: str = "rest", refine: int = 1):
        self.model, self.log = model, log
        length = log.time[-1] - log.time[0]
        steps = len(log.time) - 1 if log.even else int(np.ceil(length / np.diff(log.time).min()))
        steps = min(steps * refine, MOST_STEPS)
        self._half = 0.5 * length / steps
        grid = np.linspace(log.time[0], log.time[-1], steps + 1)
        twists = np.stack([np.interp(grid, log.time, column) for column in log.twist.T], -1)
        loads = np.interp(grid, log.time, log.normal_force)
        order = np.repeat(np.arange(steps + 1), 2)[1:-1]  # 0, 1, 1, 2, 2, ..., steps
        before = np.zeros(STEADY_STEPS if begins == "steady" else 1, dtype=int)
        order = np.concatenate([before, order])
        self._arguments = model, model.rest(), twists[order], loads[order], self._half
        # the node before sample i, in steps, and how far behind it the sample lies
        place = np.clip((log.time - grid[0]) / (2.0 * self._half), 0.0, steps)
        node = np.minimum(place.astype(int), steps - 1)
        share = place - node
        self._share = np.where(np.abs(share - np.round(share)) < 1e-9, np.round(share), share)
        self._rows = len(before) - 1 + 2 * node

    def wrenches(self, vector: np.ndarray) -> np.ndarray:
        """Wrenches `[T, 3]` at the samples."""
        return self._at_samples(rollout(*self._arguments, parameters=vector).wrenches)

    def sensitivities(self, vector: np.ndarray, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """Wrenches `[T, 3]` at the samples and their derivatives `[T, 3, len(names)]`."""
        _, values, slopes = rollout_sensitivities(*self._arguments, names, parameters=vector)
        return self._at_samples(values), self._at_samples(slopes)

    def _at_samples(self, values: np.ndarray) -> np.ndarray:
        share = self._share.reshape(-1, *(1,) * (values.ndim - 1))
        return (1.0 - share) * values[self._rows] + share * values[self._rows + 2]
