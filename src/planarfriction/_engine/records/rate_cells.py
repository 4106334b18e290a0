"""Machine form of `DistributedModel` with a law that is a function of its own (`RateLaw`)."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from planarfriction._engine.cells import cells
from planarfriction._engine.cells.cell_steps import CellSteps
from planarfriction._engine.cells.general_cells import MATRICES
from planarfriction._engine.protocol import ModelFunctions
from planarfriction._engine.records.base import CompiledModel
from planarfriction._engine.records.distributed import CompiledDistributed
from planarfriction.errors import InvalidValueError


def _finite(method: Callable) -> Callable:
    """Return a door of steps or rates that raises where the law's functions leave the range of numbers."""

    @functools.wraps(method)
    def checked(self: CompiledDistributed, *inputs: Any) -> Any:
        results = method(self, *inputs)
        if results is not None and not all(np.isfinite(each).all() for each in results):
            rule = "give finite rates and tractions at these inputs"
            raise InvalidValueError("law", rule, type(self.law).__name__)
        return results

    return checked


class CompiledRateCells(CompiledDistributed):
    """Machine form of a `DistributedModel` with a `RateLaw` on a patch."""

    step_one = _finite(CompiledDistributed.step_one)
    step_borne = _finite(CompiledDistributed.step_borne)
    step_batch = _finite(CompiledDistributed.step_batch)
    jacobians_one = _finite(CompiledDistributed.jacobians_one)
    evaluate = _finite(CompiledDistributed.evaluate)
    step = _finite(CompiledDistributed.step)
    step_jacobians = _finite(CompiledDistributed.step_jacobians)

    held = CompiledModel.held

    def _functions(self) -> tuple[ModelFunctions, CellSteps]:
        self._lever = cells.LEVERS if self.patch.anisotropic else cells.POSITIONS
        return self.law.functions(self._lever)[1:]

    def record(self, numbers: np.ndarray, weights: np.ndarray) -> tuple[Any, int]:
        return self.law.contact(self._lever, numbers, weights), 4 * MATRICES
