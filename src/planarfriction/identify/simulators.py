"""Models that can be fitted to logs: predicted wrenches at the samples, and their derivatives by the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.compiler import threads
from planarfriction.derivatives import PARAMETERS, rollout, rollout_jacobian
from planarfriction.identify.logs import EVEN, Linear, Log
from planarfriction.identify.parameters import RADIUS, SHAPE
from planarfriction.laws import LuGre
from planarfriction.limit_surface import LimitSurface, LimitSurfaceTablePublished
from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.pads import Pad
from planarfriction.patch import ContactPatch

CHANGE = 1e-6
"""Step of difference quotients as a share of the parameter: rounding and curvature both stay below 1e-5."""

LEAST_CHANGE = 1e-3
"""Least size [m] of which `CHANGE` is a share: a centre may lie at zero."""

CELLS = 400
"""Number of cells above which discs stand for a patch."""

DISCS = 200
"""Number of discs that stand for many cells: on smooth motions about points inside they
are off by up to 0.4 % of the friction (0.1 % rms), and take as long as 400 points."""

STEADY_STEPS = 400
"""Number of steps with the first twist before a log that begins in steady sliding."""

MOST_STEPS = 2_000_000
"""Largest number of steps of one log: only very uneven sample times ask for more."""

LAW_NAMES = PARAMETERS[:8]
"""Names of the parameters of the law in the vector of a model, which begins with them."""

CENTRE = [PARAMETERS.index("centre_x"), PARAMETERS.index("centre_y")]
"""Places of the centre of pressure in the vector of a model."""


class PublishedSimulator:
    """Wrenches of `ReducedModelPublished`, whose vector of parameters (`derivatives.PARAMETERS`) varies, from rest.

    Twists `[N, 3]` and loads `[N]` are constant for `dt` each; wrenches `[N, 3]` and their derivatives `[N, 3, P]` with
    respect to the parameters `names` are those at the ends of the steps.
    """

    own_radius = True
    """True if the contact radius is a number of its own, not that of the cells; the patch may then change with load."""

    def __init__(
        self,
        patch: ContactPatch,
        law: LuGre,
        surface: type[LimitSurface] = LimitSurfaceTablePublished,
        pad: Pad | None = None,
    ):
        self._model = self.model(patch, law, surface, pad)

    @classmethod
    def model(
        cls,
        patch: ContactPatch,
        law: LuGre,
        surface: type[LimitSurface],
        pad: Pad | None = None,
    ) -> Any:
        """Make the friction model of a patch and a law; cells may be those of a pad."""
        return ReducedModelPublished(patch, law, surface=surface(patch))

    def wrenches(
        self, twists: np.ndarray, loads: np.ndarray, dt: float, vector: np.ndarray
    ) -> np.ndarray:
        """Compute the wrenches `[N, 3]`."""
        return rollout(self._model, None, twists, loads, dt, parameters=vector).wrenches

    def sensitivities(self, twists, loads, dt, vector, names: Sequence[str]) -> Linear:
        """Compute the wrenches `[N, 3]` and their derivatives `[N, 3, P]`."""
        found = rollout_jacobian(
            self._model, None, twists, loads, dt, names, parameters=vector
        )
        return found.wrenches, found.d_wrenches

    def work(self, parameters: int) -> float:
        """Estimate the time that the derivatives of one step take [us]."""
        return 0.3 * parameters


class DistributedSimulator(PublishedSimulator):
    """Simulator of `DistributedModel` on a fixed patch, which is scaled and moved through its twists and wrenches.

    That is exact: a point at `p = c + s (p0 - c0)` has the velocity that its image `p0` has at the twist
    `(v + omega x d, s omega)`, `d = c - s c0`, and the torque is `s tau0 + d x f`; discs grow by s, too.
    """

    model_class: type = DistributedModel
    own_radius = False

    def __init__(self, patch, law, surface=LimitSurfaceTablePublished, pad=None):
        self._radius = patch.contact_radius()
        self._centre = patch.centre_of_pressure()
        if self.model_class is DistributedModel and patch.cells > CELLS:
            patch = patch.discs(DISCS)
        self._model = self.model(patch, law, surface, pad)

    @classmethod
    def model(cls, patch, law, surface, pad=None):
        return cls.model_class(patch, law, pad=pad)

    def wrenches(self, twists, loads, dt, vector):
        own = vector[: len(LAW_NAMES)]
        roll = lambda inner: (
            rollout(self._model, None, inner, loads, dt, parameters=own).wrenches
        )
        return self._placed(vector, twists, roll)

    def _placed(self, vector, twists, work):
        s = vector[RADIUS] / self._radius
        dx, dy = vector[CENTRE] - s * self._centre
        vx, vy, omega = twists.T
        inner = np.stack([vx - omega * dy, vy + omega * dx, s * omega], -1)
        fx, fy, tau = np.moveaxis(work(inner), 1, 0)
        return np.stack([fx, fy, s * tau + dx * fy - dy * fx], 1)

    def sensitivities(self, twists, loads, dt, vector, names):
        of_law, shape = (
            [name for name in names if name in group] for group in (LAW_NAMES, SHAPE)
        )
        own = vector[: len(LAW_NAMES)]
        slopes = np.zeros((len(twists), 3, len(names)))

        def work(inner):
            found = rollout_jacobian(
                self._model, None, inner, loads, dt, of_law, parameters=own
            )
            return np.concatenate([found.wrenches[..., None], found.d_wrenches], -1)

        found = self._placed(vector, twists, work)
        base = found[..., 0]
        slopes[..., [names.index(name) for name in of_law]] = found[..., 1:]

        def differences(first: int, last: int) -> None:
            for name in shape[first:last]:
                at = PARAMETERS.index(name)
                change = CHANGE * max(abs(vector[at]), LEAST_CHANGE)
                moved = vector + change * (np.arange(len(vector)) == at)
                slopes[..., names.index(name)] = (
                    self.wrenches(twists, loads, dt, moved) - base
                ) / change

        threads.share(len(shape), len(shape), differences)
        return base, slopes

    def work(self, parameters):
        patch = self._model.reduction.patch
        return (0.2 if patch.has_discs else 0.1) * patch.cells


class ReducedSimulator(DistributedSimulator):
    """Simulator of `ReducedModel`."""

    model_class = ReducedModel


SIMULATORS: dict[str, type[PublishedSimulator]] = {
    "reduced-published": PublishedSimulator,
    "reduced": ReducedSimulator,
    "distributed": DistributedSimulator,
}
"""Simulators by the names of their models, the quickest first: a new model needs one class and one line."""


class _Steps(NamedTuple):
    """Half steps through consecutive samples of a log, and the samples among them.

    Between two samples the twist follows cubics that do not overshoot (Akima 1970) and the load is linear; both are
    held over half steps: node j holds from half a step before it to half a step after it. The displacement of a bristle
    is then that of the trapezoidal rule, and the wrench belongs to the twist of its sample; the error is of second
    order in `interval/refine`. In a log whose twists are `held` each holds since the sample before.
    """

    log: Log
    twists: np.ndarray
    """Twists of the half steps [m/s, m/s, rad/s], `[N, 3]`."""
    loads: np.ndarray
    """Loads of the half steps [N], `[N]`."""
    half: float
    """Half of a step [s]."""
    steps: int
    """Number of steps."""
    first: int
    """Number of half steps before the first node."""

    @classmethod
    def of(cls, log: Log, twist: np.ndarray, begins: str, refine: int) -> _Steps:
        """Make the steps through a log whose twist is `twist`."""
        from scipy.interpolate import Akima1DInterpolator

        length = log.time[-1] - log.time[0]
        steps = len(log.time) - 1
        if not log.even:
            steps = int(np.ceil(length / np.diff(log.time).min()))
        steps = min(steps * refine, MOST_STEPS)
        grid = np.linspace(log.time[0], log.time[-1], steps + 1)
        if log.held:
            twists = twist[np.searchsorted(log.time, grid - EVEN * log.interval)]
        else:
            twists = Akima1DInterpolator(log.time, twist)(grid)
        loads = np.interp(grid, log.time, log.normal_force)
        # 0, 0, 1, 1, 2, 2, ..., steps, steps.
        order = np.repeat(np.arange(steps + 1), 2)
        order = order[2:] if log.held else order[1:-1]
        first = STEADY_STEPS - 1 if begins == "steady" else 0
        order = np.pad(order, (first + 1, 0))
        return cls(log, twists[order], loads[order], 0.5 * length / steps, steps, first)

    def read(self, values: np.ndarray, delay: float) -> Linear:
        """Interpolate values at the ends of the half steps at the samples, later by `delay` [s].

        Returns them and their derivatives over time.
        """
        step = 2.0 * self.half
        nodes = values[self.first :: 2]
        wanted = (self.log.time - self.log.time[0] - delay) / step
        place = np.clip(wanted, 0.0, self.steps)
        node = np.minimum(place.astype(int), self.steps - 1)
        share = place - node
        share = np.where(np.abs(share - np.round(share)) < 1e-9, np.round(share), share)
        t = share.reshape(-1, *(1,) * (nodes.ndim - 1))
        a, b, c, d = (nodes[np.clip(node + k, 0, self.steps)] for k in (-1, 0, 1, 2))
        one = 0.5 * (c - a)
        two = a - 2.5 * b + 2.0 * c - 0.5 * d
        three = 0.5 * (d - a) + 1.5 * (b - c)
        inside = (wanted == place).reshape(t.shape)  # before the log the contact rests
        slopes = np.where(inside, (one + t * (2.0 * two + 3.0 * t * three)) / step, 0.0)
        return b + t * (one + t * (two + t * three)), slopes


class Prediction:
    """Simulated wrenches of one log, by a model whose vector of parameters varies.

    A decimated log has several parts, with the motion between them in longer steps. Wrenches that come later than the
    motion by a `delay` [s] are read between the nodes, by cubic polynomials with continuous slopes.
    """

    def __init__(
        self,
        simulator: Any,
        log: Log,
        twist: np.ndarray,
        *,
        begins: str = "rest",
        refine: int = 1,
    ):
        self.simulator = simulator
        ends = np.cumsum([len(part.time) for part in log.parts])
        twists = np.split(twist, ends[:-1])
        gaps = (None, *getattr(log, "gaps", ()))
        self._parts: list[tuple[_Steps, slice]] = []
        pieces = []
        at = 0
        for part, own, gap in zip(log.parts, twists, gaps, strict=True):
            steps = _Steps.of(part, own, begins, refine)
            begins = "rest"
            if gap is not None:
                pieces.append(gap.until(steps.half, steps.twists[0]))
                at += len(gap.dt)
            size = len(steps.loads)
            dt = np.full(size, steps.half)
            pieces.append((steps.twists, steps.loads, dt, np.zeros(size)))
            self._parts.append((steps, slice(at, at + size)))
            at += size
        self.steps = sum(steps.steps for steps, _ in self._parts)
        *inputs, self._between = map(np.concatenate, zip(*pieces, strict=True))
        self._inputs: Any = inputs

    def wrenches(
        self, vector: np.ndarray, delay: float = 0.0, change: Any = 0.0
    ) -> np.ndarray:
        """Compute the wrenches `[T, 3]` at the samples, with `change` added to the twists of all steps."""
        twists, loads, half = self._inputs
        wrenches = self.simulator.wrenches(twists + change, loads, half, vector)
        return self._read(wrenches, delay)[0]

    def moved(
        self, vector: np.ndarray, change: np.ndarray, noise: np.ndarray
    ) -> np.ndarray:
        """Compute the wrenches `[T, 3]` at the samples with `change` `[3]` added to all twists.

        Between the windows of a decimated log it is what means leave of the `noise` `[3]` of single samples.
        """
        between = np.multiply.outer(self._between, noise)
        return self.wrenches(vector, change=np.where(between > 0.0, between, change))

    def sensitivities(
        self, vector: np.ndarray, names: Sequence[str], delay: float = 0.0
    ) -> tuple[np.ndarray, ...]:
        """Compute wrenches `[T, 3]` at the samples, derivatives by `names` `[T, 3, P]` and by the delay `[T, 3]`."""
        values, slopes = self.simulator.sensitivities(*self._inputs, vector, names)
        wrenches, per_second = self._read(values, delay)
        return wrenches, self._read(slopes, delay)[0], -per_second

    def _read(self, values: np.ndarray, delay: float) -> Linear:
        """Interpolate values at the ends of all steps at the samples, as `_Steps.read` does."""
        found = [steps.read(values[span], delay) for steps, span in self._parts]
        read, slopes = map(np.concatenate, zip(*found, strict=True))
        return read, slopes
