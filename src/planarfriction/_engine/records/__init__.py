"""Machine forms of friction models: the numbers and addresses that compiled code reads, made once for each model.

`model.compiled` is one cached object. Its `step_one` and `step_batch` are the fast doors of a step from Python;
`packed` is read by the solver, `with_all_states` by `coupling`, `at_loads` by rollouts. Addresses hold in one process:
copies of a model make their own machine form.
"""

from planarfriction._engine.records.base import CompiledModel, StepJacobians
from planarfriction._engine.records.packed import PackedModel

__all__ = ["CompiledModel", "PackedModel", "StepJacobians"]
__dir__ = __all__.copy
