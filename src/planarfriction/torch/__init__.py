"""The friction models for PyTorch: modules with trainable physical parameters, and differentiable rollouts.

Needs PyTorch: `pip install 'planarfriction[torch]'`.
"""

try:
    import torch as _torch  # noqa: F401
except ImportError:
    from planarfriction.errors import MissingExtraError

    raise MissingExtraError("torch", "torch") from None

from planarfriction.derivatives import Rollout
from planarfriction.tensors.scenes import SceneMotion
from planarfriction.torch.distributed import DistributedModel
from planarfriction.torch.moments import MomentModel
from planarfriction.torch.published import ReducedModelPublished
from planarfriction.torch.reduced import ReducedModel
from planarfriction.torch.reduced_planar import ReducedPlanarLuGre
from planarfriction.torch.rollout import rollout, simulate_scene, tracking_loss

__all__ = [
    "DistributedModel",
    "MomentModel",
    "ReducedModel",
    "ReducedModelPublished",
    "ReducedPlanarLuGre",
    "Rollout",
    "SceneMotion",
    "rollout",
    "simulate_scene",
    "tracking_loss",
]
