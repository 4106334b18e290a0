"""Sweeps: many runs of a scene with varying quantities, resumable, in threads, processes or on several machines."""

from planarfriction.sweeps.running import Progress, sweep

__all__ = ["Progress", "sweep"]


def __dir__() -> list[str]:
    return sorted(__all__)
