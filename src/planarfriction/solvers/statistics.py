"""Statistics of a run."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from planarfriction._support.described import described


@described
@dataclass(frozen=True)
class Statistics:
    """Number of steps and computing time of a run."""

    steps: int = 0
    """Accepted steps."""
    rejections: int = 0
    """Steps that were repeated with a smaller size."""
    evaluations: int = 0
    """Evaluations of the right-hand side."""
    jacobians: int = 0
    """Evaluations of the Jacobian."""
    wall_time: float = 0.0
    """Time in the solver, without compilation [s]."""
    compile_time: float = 0.0
    """Time to compile the solver or to load it from the cache [s]; almost 0 after the first run in a process."""

    def as_dict(self) -> dict[str, int | float]:
        """Return the statistics as a dictionary."""
        return dataclasses.asdict(self)
