"""Reverse derivatives of a simulated scene: the gradient of one cost of its motion, whatever the number of knots."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.derivatives.path import KeptMotion, SceneDerivatives
from planarfriction.derivatives.scene_inputs import SceneInputs
from planarfriction.errors import InvalidValueError
from planarfriction.scenes.scene import Scene, SolverOptions

Cotangent = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Function of times `[M]` and recorded values `[M, ...]` that returns the derivatives of a cost by these values."""


@dataclass(frozen=True, eq=False)
class SceneGradient(SceneDerivatives):
    """A motion and the gradient of a cost with respect to P numbers (see `SceneDerivatives`)."""

    gradient: np.ndarray
    """Gradient of the cost `[P]`."""


def scene_gradient(
    scene: Scene,
    cotangent: Cotangent | None,
    parameters: Sequence[str] = (),
    *,
    wrench_cotangent: Cotangent | None = None,
    signals: Mapping[str, Any] | None = None,
    initial: Sequence[str] = (),
    options: SolverOptions | None = None,
) -> SceneGradient:
    """Compute the gradient of a cost of a motion by parameters, signals and initial state.

    `parameters`, `signals`, `initial` and `options` are as in `scene_sensitivities`. `cotangent(time, motion)` takes
    the times `[M]` and the motion `[M, 6]` and returns `dcost/dmotion` `[M, 6]`; `wrench_cotangent(time, wrenches)`
    adds `dcost/dwrenches` `[M, C, 3]` for the wrench of one of the identical contacts. The adjoint `-l' = J' l` runs
    backwards over the accepted steps, jumps by these cotangents at each instant, and accumulates `int l' df/dp dt`. It
    takes as long as one derivative, whatever the number of knots.

    Raises `InvalidValueError` as `scene_sensitivities` does, and `SolverError` if the solver fails.
    """
    functions = {"cotangent": cotangent, "wrench_cotangent": wrench_cotangent}
    for name, function in functions.items():
        wrong = isinstance(function, type) or not callable(function)
        if wrong and (function is not None or cotangent is wrench_cotangent):
            raise InvalidValueError(name, "be a function of time and motion, or wrenches", function)
    motion = KeptMotion(scene, SceneInputs(scene, parameters, signals, initial), options)
    bars = [
        np.zeros_like(values)
        if function is None
        else validation.array(f"{name} of the cost", function(motion.time, values), values.shape)
        for (name, function), values in zip(functions.items(), motion.recorded, strict=True)
    ]
    return SceneGradient(*motion.head, gradient=motion.gradient(*bars))
