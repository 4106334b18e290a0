"""Costs of a sweep beside the solver's own time: in-hand runs in threads, each with its file."""

from __future__ import annotations

import sys
import tempfile
import time

import numpy as np

from planarfriction import sweeps
from planarfriction.compiler.threads import processors
from planarfriction.models import ReducedModel
from planarfriction.scenes import Scene, Signal, Solution, in_hand, in_hand_load, simulate
from planarfriction_studies.bench.measurement import Measurement, line, once
from planarfriction_studies.bench.workloads import disc, law

_MASSES, _OFFSETS, _GRIPS = np.linspace(0.1, 0.25, 25), np.linspace(0.0, 0.009, 10), (0.8, 1.0, 1.2, 1.4)


def sweep(full: bool) -> Measurement:
    """Measure a thousand runs of 2 s in blocks of 250, each of which is also simulated one run after another right
    before."""
    model = ReducedModel(disc(), law())
    held = in_hand_load(1)
    loads = {float(grip): Signal(held.times, grip * held.values) for grip in _GRIPS}

    def make(mass: float, offset: float, grip: float) -> Scene:
        return in_hand(model, mass=mass, centre_of_mass=(offset, 0.0), normal_force=loads[grip])

    simulate(make(0.2, 0.0, float(_GRIPS[0])), t_end=0.02)  # compiles
    solver = alone = swept = used = 0.0
    memory = []
    with tempfile.TemporaryDirectory() as folder:
        for grip in loads:
            values = {"mass": _MASSES, "offset": _OFFSETS, "grip": [grip]}
            begin = time.process_time()
            for mass in _MASSES:
                for offset in _OFFSETS:
                    solver += simulate(make(mass, offset, grip)).statistics.wall_time
            middle = time.process_time()
            alone += middle - begin
            swept += once(lambda values=values: sweeps.sweep(make, values, out=folder, measure=end))
            used += time.process_time() - middle
            memory.append(_memory())
    count = processors()
    words = (
        f"time in the solver of the same runs, one after another, over {count} processors (processor time: "
        f"{used / alone:.2f} of that of simulate; memory: {memory[-1] - memory[0]:+.1f} MB from run 250 to 1,000)"
    )
    return line(swept, "s", words, solver / count)


def end(solution: Solution) -> dict[str, float]:
    """Return the last pose of the plate."""
    return {name: float(solution.histories[name].values[-1]) for name in ("x", "y", "theta")}


def _memory() -> float:
    """Return the peak memory of this process so far [MB]."""
    try:
        import resource
    except ImportError:  # on Windows
        return float("nan")
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)
