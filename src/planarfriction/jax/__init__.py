"""JAX front end: models as pytrees, and pure functions that work with `jit`, `vmap` and `grad`.

Needs the extra `[jax]`. For float64 set `jax.config.update("jax_enable_x64", True)`, as always in JAX.
"""

from planarfriction.errors import needing

with needing("jax", "jax"):
    from planarfriction.derivatives import Rollout
    from planarfriction.jax.models import (
        DistributedModel,
        LawParameters,
        PublishedParameters,
        ReducedModel,
        ReducedModelPublished,
        Surface,
    )
    from planarfriction.jax.rollouts import (
        rate,
        rest,
        rollout,
        simulate_scene,
        step,
        wrench,
    )
    from planarfriction.tensors.operations import SceneMotion

__all__ = [
    "DistributedModel",
    "LawParameters",
    "PublishedParameters",
    "ReducedModel",
    "ReducedModelPublished",
    "Rollout",
    "SceneMotion",
    "Surface",
    "rate",
    "rest",
    "rollout",
    "simulate_scene",
    "step",
    "wrench",
]
