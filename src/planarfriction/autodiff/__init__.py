"""Roll-outs with exact derivatives, on which the tensor front ends and identification are built.

`rollout` steps a model through given twists and loads. For reduced models, `rollout_gradient` is its discrete adjoint,
`rollout_tangent` its directional derivative, and `rollout_sensitivities` gives the derivatives of each wrench with
respect to the parameters. All are derivatives of the steps themselves, not of the continuous model, so they agree with
finite differences of `rollout` to rounding. Kinks are described in `planarfriction.kernels.bristle_step`.
"""

from planarfriction.autodiff.drives import SCENE_PARAMETERS
from planarfriction.autodiff.parameters import PARAMETERS, parameter_names, parameters_of
from planarfriction.autodiff.rollouts import (
    Rollout,
    RolloutGradient,
    RolloutSensitivities,
    RolloutStates,
    RolloutTangent,
    rollout,
    rollout_gradient,
    rollout_sensitivities,
    rollout_states,
    rollout_tangent,
)
from planarfriction.autodiff.scene import SceneSensitivities, scene_sensitivities
from planarfriction.autodiff.scene_gradient import SceneGradient, scene_gradient

__all__ = [
    "PARAMETERS",
    "SCENE_PARAMETERS",
    "Rollout",
    "RolloutGradient",
    "RolloutSensitivities",
    "RolloutStates",
    "RolloutTangent",
    "SceneGradient",
    "SceneSensitivities",
    "parameter_names",
    "parameters_of",
    "rollout",
    "rollout_gradient",
    "rollout_sensitivities",
    "rollout_states",
    "rollout_tangent",
    "scene_gradient",
    "scene_sensitivities",
]


def __dir__() -> list[str]:
    return sorted(__all__)
