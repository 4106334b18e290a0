"""Predicted wrenches of a log: its samples become short steps, and what these end with is read at its samples again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planarfriction.identify.logs import Log
from planarfriction.identify.simulators import Simulator

STEADY_STEPS = 400
"""Steps with the first twist before a log that begins in steady sliding."""

MOST_STEPS = 2_000_000
"""Steps of one log that are still reasonable: more mean sample times of very different distances."""


class Prediction:
    """Simulated wrenches of one log, by a model whose vector of parameters varies.

    Between two samples the twist follows cubics that do not overshoot (Akima 1970) and the load is linear; both are
    held over half steps: node j holds from half a step before it to half a step after it. The bristle then travels the
    way of the trapezoidal rule and the wrench belongs to the twist of its sample; the error is of second order in
    `interval/refine`. Wrenches that come later than the motion by a `delay` [s] are read between the nodes, by cubic
    polynomials with continuous slopes.
    """

    def __init__(self, simulator: Simulator, log: Log, twist: np.ndarray, *, begins: str = "rest", refine: int = 1):
        from scipy.interpolate import Akima1DInterpolator

        self.simulator, self.log = simulator, log
        length = log.time[-1] - log.time[0]
        steps = len(log.time) - 1 if log.even else int(np.ceil(length / np.diff(log.time).min()))
        self.steps = min(steps * refine, MOST_STEPS)
        self._half = 0.5 * length / self.steps
        grid = np.linspace(log.time[0], log.time[-1], self.steps + 1)
        twists = Akima1DInterpolator(log.time, twist)(np.clip(grid, log.time[0], log.time[-1]))
        loads = np.interp(grid, log.time, log.normal_force)
        order = np.repeat(np.arange(self.steps + 1), 2)[1:-1]  # 0, 1, 1, 2, 2, ..., steps
        before = np.zeros(STEADY_STEPS if begins == "steady" else 1, dtype=int)
        order = np.concatenate([before, order])
        self._inputs = twists[order], loads[order], self._half
        self._first = len(before) - 1

    def wrenches(self, vector: np.ndarray, delay: float = 0.0) -> np.ndarray:
        """Wrenches `[T, 3]` at the samples."""
        return self._read(self._nodes(self.simulator.wrenches(*self._inputs, vector)), delay)[0]

    def moved(self, vector: np.ndarray, change: Sequence[float]) -> np.ndarray:
        """Wrenches `[T, 3]` at the samples if all twists were off by `change`."""
        twists, loads, half = self._inputs
        return self._read(self._nodes(self.simulator.wrenches(twists + change, loads, half, vector)), 0.0)[0]

    def sensitivities(
        self, vector: np.ndarray, names: Sequence[str], delay: float = 0.0
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Wrenches `[T, 3]` at the samples, their derivatives `[T, 3, len(names)]`, and those by the delay `[T, 3]`."""
        values, slopes = self.simulator.sensitivities(*self._inputs, vector, names)
        wrenches, per_second = self._read(self._nodes(values), delay)
        return wrenches, self._read(self._nodes(slopes), delay)[0], -per_second

    def _nodes(self, values: np.ndarray) -> np.ndarray:
        """What the steps end with, at the nodes."""
        return values[self._first :: 2]

    def _read(self, nodes: np.ndarray, delay: float) -> tuple[np.ndarray, np.ndarray]:
        """Values at the samples, later by `delay` [s], and their slopes over time."""
        step = 2.0 * self._half
        wanted = (self.log.time - self.log.time[0] - delay) / step
        place = np.clip(wanted, 0.0, self.steps)
        node = np.minimum(place.astype(int), self.steps - 1)
        share = place - node
        share = np.where(np.abs(share - np.round(share)) < 1e-9, np.round(share), share)
        t = share.reshape(-1, *(1,) * (nodes.ndim - 1))
        a, b, c, d = (nodes[np.clip(node + k, 0, self.steps)] for k in (-1, 0, 1, 2))
        one, two, three = 0.5 * (c - a), a - 2.5 * b + 2.0 * c - 0.5 * d, 0.5 * (d - a) + 1.5 * (b - c)
        inside = (wanted == place).reshape(t.shape)  # before the log the contact rests
        slopes = np.where(inside, (one + t * (2.0 * two + 3.0 * t * three)) / step, 0.0)
        return b + t * (one + t * (two + t * three)), slopes
