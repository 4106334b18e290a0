"""Decorators, records and loops for models of your own, and for studies of the method.

`PackedModel` of `planarfriction.models` takes a model's `ModelFunctions`; docs/write-your-own.md leads through them.
"""

from planarfriction._engine.body.body import System, right_hand_side
from planarfriction._engine.body.integration import Method, Output
from planarfriction._engine.compiler import jit, kernel
from planarfriction._engine.compiler.memory import Doubles, Place, reader, rows_of
from planarfriction._engine.compiler.threads import processors
from planarfriction._engine.protocol import ModelFunctions
from planarfriction._engine.published.spin_sums import smoothed_spin_sum
from planarfriction._engine.published.surfaces import sliding_batch

__all__ = [
    "Doubles",
    "Method",
    "ModelFunctions",
    "Output",
    "Place",
    "System",
    "jit",
    "kernel",
    "processors",
    "reader",
    "right_hand_side",
    "rows_of",
    "sliding_batch",
    "smoothed_spin_sum",
]
__dir__ = __all__.copy
