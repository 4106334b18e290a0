"""The models that can be fitted: wrenches over a row of short steps, and their derivatives by the parameters."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from planarfriction.compiler import threads
from planarfriction.derivatives import PARAMETERS, rollout, rollout_jacobian
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import distributed_step
from planarfriction.laws import LuGre
from planarfriction.limit_surface import LimitSurface
from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.patch import ContactPatch

MODELS = ("reduced-published", "distributed", "reduced")
"""Names of the models that can be fitted, the quickest first."""

CHANGE = 1e-6
"""Share of a parameter that difference quotients are taken over: rounding and curvature both stay below 1e-5."""

LEAST_CHANGE = {"centre_x": 1e-3, "centre_y": 1e-3}
"""Sizes [m] that stand for a centre at zero, as shares of nothing are nothing."""

MAP = {"segments": 12, "speeds": 12}
"""Size of the maps of `ReducedModel` while it is fitted: errors of 2e-4, in a third of the time."""

CELLS, DEGREE = 120, 9
"""Cells of a patch above which it is compressed, and the degree of the moments that this keeps."""

LAW_NAMES = PARAMETERS[:8]

RADIUS, CENTRE = PARAMETERS.index("contact_radius"), [PARAMETERS.index("centre_x"), PARAMETERS.index("centre_y")]

GAMMA = PARAMETERS.index("gamma")


class Simulator:
    """Wrenches of a model whose vector of parameters (`derivatives.PARAMETERS`) varies, from bristles at rest.

    Twists `[N, 3]` and loads `[N]` are held for `dt` each; wrenches `[N, 3]` and their derivatives `[N, 3, P]` by the
    parameters `names` are at the ends of the steps.
    """

    name: str

    def wrenches(self, twists: np.ndarray, loads: np.ndarray, dt: float, vector: np.ndarray) -> np.ndarray:
        raise NotImplementedError

    def sensitivities(
        self, twists: np.ndarray, loads: np.ndarray, dt: float, vector: np.ndarray, names: Sequence[str]
    ) -> tuple[np.ndarray, np.ndarray]:
        raise NotImplementedError

    def work(self, parameters: int) -> float:
        """Cost of the derivatives of one step [us], roughly."""
        raise NotImplementedError


class PublishedSimulator(Simulator):
    """`ReducedModelPublished`, in which contact radius and second moment are numbers of their own."""

    name = "reduced-published"

    def __init__(self, model: ReducedModelPublished):
        self.model = model

    def wrenches(self, twists, loads, dt, vector):
        return rollout(self.model, None, twists, loads, dt, parameters=vector).wrenches

    def sensitivities(self, twists, loads, dt, vector, names):
        found = rollout_jacobian(self.model, None, twists, loads, dt, names, parameters=vector)
        return found.wrenches, found.d_wrenches

    def work(self, parameters):
        return 0.3 * parameters


class ScaledSimulator(Simulator):
    """A model of a fixed patch that is scaled and moved: through its twists and wrenches, which is exact.

    A point at `p = c + s (p0 - c0)` has the velocity that its image `p0` has at the twist `(v + omega x d, s omega)`,
    `d = c - s c0`, and the torque is `s tau0 + d x f`.
    """

    changes: Mapping[str, float] = {}
    """Other shares than `CHANGE`."""

    def __init__(self, patch: ContactPatch, elasto_plastic: bool):
        self.patch, self.elasto_plastic = _few(patch), elasto_plastic
        self._radius, self._centre = float(patch.contact_radius()), patch.centre_of_pressure()

    def wrenches(self, twists, loads, dt, vector):
        return self._placed(vector, twists, lambda inner: self._inner(inner, loads, dt, vector))

    def _placed(self, vector, twists, work):
        s = vector[RADIUS] / self._radius
        dx, dy = vector[CENTRE] - s * self._centre
        vx, vy, omega = twists.T
        inner = np.ascontiguousarray(np.stack([vx - omega * dy, vy + omega * dx, s * omega], -1))
        fx, fy, tau = np.moveaxis(work(inner), 1, 0)
        return np.stack([fx, fy, s * tau + dx * fy - dy * fx], 1)

    def _inner(self, twists, loads, dt, vector) -> np.ndarray:
        raise NotImplementedError

    def _differences(self, twists, loads, dt, vector, names, base):
        """Difference quotients, on all processors."""
        slopes = np.empty((*base.shape, len(names)))

        def work(first: int, last: int) -> None:
            for i in range(first, last):
                at = PARAMETERS.index(names[i])
                change = self.changes.get(names[i], CHANGE) * max(abs(vector[at]), LEAST_CHANGE.get(names[i], 1e-3))
                moved = vector.copy()
                moved[at] += change
                slopes[..., i] = (self.wrenches(twists, loads, dt, moved) - base) / change

        threads.share(len(names), len(names), work)
        return slopes


class DistributedSimulator(ScaledSimulator):
    """`DistributedModel`."""

    name = "distributed"

    def __init__(self, patch: ContactPatch, elasto_plastic: bool):
        super().__init__(patch, elasto_plastic)
        x, y = (np.ascontiguousarray(column) for column in self.patch.positions.T)
        self._cells = distributed_step.Cells(x, y, np.ascontiguousarray(np.atleast_2d(self.patch.weights())))

    def sensitivities(self, twists, loads, dt, vector, names):
        base = self.wrenches(twists, loads, dt, vector)
        return base, self._differences(twists, loads, dt, vector, names, base)

    def work(self, parameters):
        return 0.03 * len(self.patch.positions) * (parameters + 1)

    def _inner(self, twists, loads, dt, vector):
        law = LawNumbers._make([*vector[:7].tolist(), float(self.elasto_plastic), float(vector[7]), 0.0])
        wrenches = np.zeros((len(twists), 3))
        edges = np.flatnonzero(np.diff(np.concatenate([[0], loads > 0.0, [0]]).astype(int)))
        for first, last in edges.reshape(-1, 2):  # without load the bristles are forgotten
            z = np.zeros(2 * len(self.patch.positions))
            part = wrenches[first:last]
            distributed_step.step_sequence(law, z, twists[first:last], self._cells, 1.0, dt, np.empty_like(z), part)
        return wrenches * loads[:, None]


class ReducedSimulator(ScaledSimulator):
    """`ReducedModel`, whose map is rebuilt for each Stribeck exponent."""

    name = "reduced"
    changes: Mapping[str, float] = {"gamma": 1e-3}

    def __init__(self, patch: ContactPatch, elasto_plastic: bool, law: LuGre):
        super().__init__(patch, elasto_plastic)
        self._law, self._models = law, {}

    def _model(self, gamma: float) -> ReducedModel:
        if gamma not in self._models:
            if len(self._models) > 3:
                self._models.pop(next(iter(self._models)))
            law = dataclasses.replace(self._law, gamma=gamma)
            self._models[gamma] = ReducedModel(self.patch, law, **MAP)
        return self._models[gamma]

    def _inner(self, twists, loads, dt, vector):
        model = self._model(float(vector[GAMMA]))
        return rollout(model, None, twists, loads, dt, parameters=np.delete(vector[:8], GAMMA)).wrenches

    def sensitivities(self, twists, loads, dt, vector, names):
        base = self.wrenches(twists, loads, dt, vector)
        known = [name for name in names if name in LAW_NAMES and name != "gamma"]
        rest = [name for name in names if name not in known]
        slopes = np.empty((*base.shape, len(names)))
        if known:
            model, numbers = self._model(float(vector[GAMMA])), np.delete(vector[:8], GAMMA)

            def of_law(inner):
                return rollout_jacobian(model, None, inner, loads, dt, known, parameters=numbers).d_wrenches

            slopes[..., [names.index(name) for name in known]] = self._placed(vector, twists, of_law)
        if rest:
            differences = self._differences(twists, loads, dt, vector, rest, base)
            slopes[..., [names.index(name) for name in rest]] = differences
        return base, slopes

    def work(self, parameters):
        return 0.6 * parameters


def simulator(name: str, patch: ContactPatch, law: LuGre, surface: type[LimitSurface]) -> Simulator:
    """The simulator of a model of a patch of fixed shape."""
    if name == "reduced-published":
        return PublishedSimulator(ReducedModelPublished(patch, law, surface=surface(patch)))
    if name == "distributed":
        return DistributedSimulator(patch, law.elasto_plastic is not None)
    return ReducedSimulator(patch, law.elasto_plastic is not None, law)


def _few(patch: ContactPatch) -> ContactPatch:
    """The patch with few cells that dissipate as all do; what has few already stays as it is."""
    return patch.compressed(degree=DEGREE) if len(patch.positions) > CELLS else patch


def model_of(name: str, patch: ContactPatch, law: LuGre, surface: type[LimitSurface]) -> Any:
    """The friction model by its name."""
    if name == "reduced-published":
        return ReducedModelPublished(patch, law, surface=surface(patch))
    return DistributedModel(patch, law) if name == "distributed" else ReducedModel(patch, law)
