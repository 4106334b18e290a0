"""Sweeps: many runs of a scene with varying quantities, resumable, in threads, processes or on several machines."""

from planarfriction.sweeps.running import Progress, finished_runs, sweep

__all__ = ["Progress", "finished_runs", "sweep"]


def __dir__() -> list[str]:
    return sorted(__all__)
