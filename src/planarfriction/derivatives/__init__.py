"""Rollouts with exact derivatives, on which the tensor front ends and identification are built.

`rollout` steps a model through given twists and loads. `rollout_vjp` is its discrete adjoint, `rollout_jvp` its
directional derivative, and `rollout_jacobian` gives the derivatives of each wrench with respect to the parameters. All
are derivatives of the steps themselves, not of the continuous model, so they agree with finite differences of `rollout`
to rounding. Kinks are described in `planarfriction._engine.bristles.bristle_step`.
"""

from planarfriction.derivatives.parameters import (
    PARAMETERS,
    parameter_names,
    parameters_of,
)
from planarfriction.derivatives.rollouts import (
    Rollout,
    RolloutJacobian,
    RolloutJVP,
    RolloutStates,
    RolloutTangent,
    RolloutVJP,
    rollout,
    rollout_jacobian,
    rollout_jvp,
    rollout_states,
    rollout_vjp,
)
from planarfriction.derivatives.scene_inputs import SCENE_PARAMETERS
from planarfriction.derivatives.scenes import (
    SceneGradient,
    SceneSensitivities,
    scene_gradient,
    scene_sensitivities,
)

__all__ = [
    "PARAMETERS",
    "SCENE_PARAMETERS",
    "Rollout",
    "RolloutJVP",
    "RolloutJacobian",
    "RolloutStates",
    "RolloutTangent",
    "RolloutVJP",
    "SceneGradient",
    "SceneSensitivities",
    "parameter_names",
    "parameters_of",
    "rollout",
    "rollout_jacobian",
    "rollout_jvp",
    "rollout_states",
    "rollout_vjp",
    "scene_gradient",
    "scene_sensitivities",
]
__dir__ = __all__.copy
