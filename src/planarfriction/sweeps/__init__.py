"""Sweeps: thousands of runs of a scene whose quantities vary, resumable, in threads, processes or on many machines."""

from planarfriction.sweeps.running import Progress, sweep

__all__ = ["Progress", "sweep"]
