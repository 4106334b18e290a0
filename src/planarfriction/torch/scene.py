"""The motion of a scene as one differentiable operation of PyTorch."""

from planarfriction.tensors.operations import SceneOperation
from planarfriction.tensors.scenes import simulator
from planarfriction.torch.adjoint import call
from planarfriction.torch.namespace import xp

simulate_scene = simulator(xp, lambda function, numbers: call(SceneOperation(function, {}), (), numbers))
