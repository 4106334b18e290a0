"""Options of the simulation of a scene: its end, its accuracy, and how often it is recorded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planarfriction import validation
from planarfriction.equality import Checked, checked
from planarfriction.errors import InvalidValueError
from planarfriction.scenes.signal import MOST_SAMPLES, SAME_TIME, sample_count

if TYPE_CHECKING:
    from planarfriction.scenes.scene import Scene

MAX_STEPS = 5 * MOST_SAMPLES
"""Steps that a run tries at most by default: five for each sample of the longest signal, a minute with few states."""


class Plan(NamedTuple):
    """Checked options of one simulation."""

    end: float
    """End [s]."""
    times: np.ndarray
    """Instants to record `[M]` [s]."""
    rtol: float
    """Relative tolerance [-]."""
    atol: float
    """Absolute tolerance, as a share of the natural scales [-]."""
    max_steps: int
    """Largest number of steps."""


@dataclass(frozen=True)
class SolverOptions(Checked):
    """Options of the simulation of a scene; None takes those of the scene, or of the function that gets them.

    Raises InvalidValueError for numbers that are not > 0, and a number of steps that is no integer.
    """

    t_end: float | None = checked(validation.positive, default=None)
    """End [s], at most the scene's own."""
    rtol: float | None = checked(validation.positive, default=None)
    """Relative tolerance [-], > 0."""
    atol: float | None = checked(validation.positive, default=None)
    """Tolerance as a share of the natural scales [-], > 0 (see `simulate`); it follows `rtol` by default."""
    save_every: float | None = checked(validation.positive, default=None)
    """Recording interval [s]; the end is always recorded."""
    max_steps: int = checked(validation.count, default=MAX_STEPS)
    """Largest number of steps: whatever the scene asks for, a run ends."""

    def plan(self, scene: Scene, rtol: float | None = None) -> Plan:
        """Return what the options say for a scene; with `rtol` given, both tolerances are that by default.

        Raises InvalidValueError for an end after the scene's own.
        """
        end = scene.t_end if self.t_end is None else self.t_end
        if end > scene.t_end:
            raise InvalidValueError("t_end", f"be at most the scene's {scene.t_end:g} s", end)
        least, default = (scene.atol, scene.rtol) if rtol is None else (rtol, rtol)
        relative = default if self.rtol is None else self.rtol
        absolute = least * (relative / default) if self.atol is None else self.atol
        every = scene.save_every if self.save_every is None else self.save_every
        return Plan(end, recording_times(end, every), relative, absolute, self.max_steps)


def recording_times(end: float, every: float) -> np.ndarray:
    """Return every multiple of `every` up to the end, and the end [s]."""
    times = np.arange(sample_count(end, every, "save_every") + 1) * every
    return np.append(times, end) if end - times[-1] > SAME_TIME else times
