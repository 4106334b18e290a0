"""Sweeps: many runs of a scene with varying quantities, resumable, in threads, processes or on several machines."""

from planarfriction.sweeps.running import Progress, finished_runs, sweep

__all__ = ["Progress", "finished_runs", "sweep"]
__dir__ = __all__.copy
