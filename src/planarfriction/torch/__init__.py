"""The friction models for PyTorch: modules with trainable physical parameters, and differentiable rollouts.

Needs PyTorch: `pip install 'planarfriction[torch]'`; before it, for the processor alone,
`pip install torch --index-url https://download.pytorch.org/whl/cpu`.
"""

from planarfriction.errors import needing

with needing("torch", "torch"):
    from planarfriction.derivatives import Rollout
    from planarfriction.tensors.operations import SceneMotion
    from planarfriction.torch.models import (
        DistributedModel,
        ReducedModel,
        ReducedModelPublished,
    )
    from planarfriction.torch.reduced_planar import ReducedPlanarLuGre
    from planarfriction.torch.rollout import rollout, simulate_scene, tracking_loss

__all__ = [
    "DistributedModel",
    "ReducedModel",
    "ReducedModelPublished",
    "ReducedPlanarLuGre",
    "Rollout",
    "SceneMotion",
    "rollout",
    "simulate_scene",
    "tracking_loss",
]
