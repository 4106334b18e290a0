"""The motion of a scene as one differentiable operation of JAX."""

from planarfriction.jax.adjoint import call
from planarfriction.jax.callbacks import HostScene
from planarfriction.jax.namespace import xp
from planarfriction.tensors.scenes import simulator

simulate_scene = simulator(xp, lambda function, numbers: call(HostScene(function), (), numbers))
