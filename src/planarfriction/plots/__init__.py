"""Plots: contact patch, limit surface, time histories and motion, each as a matplotlib `Figure`; animations.

Figures are plain objects: save them with `figure.savefig(path)`, open them with `figure.show()`, or let a notebook show
them. Only `show` touches pyplot's global state. The axes are in mm, N, degrees and the like, with the unit in the
label. Animations are written to files.
"""

from planarfriction.plots.animation import animate_solution
from planarfriction.plots.histories import plot_histories
from planarfriction.plots.limit_surface import (
    interactive_limit_surface,
    plot_limit_surface,
)
from planarfriction.plots.motion import plot_motion, plot_solution
from planarfriction.plots.patch import plot_patch
from planarfriction.plots.sections import plot_sections
from planarfriction.plots.slip import plot_slip

__all__ = [
    "animate_solution",
    "interactive_limit_surface",
    "plot_histories",
    "plot_limit_surface",
    "plot_motion",
    "plot_patch",
    "plot_sections",
    "plot_slip",
    "plot_solution",
]
__dir__ = __all__.copy
