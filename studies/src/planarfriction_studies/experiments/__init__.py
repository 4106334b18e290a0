"""The experiments of the source paper, each with its data, its figures and its numbers beside the published ones.

Two more go beyond it, with converged references of their own: `classics`, the experiments of the LuGre paper, and
`beyond`.

`EXPERIMENTS` lists them by name; each lives in a folder of its own, whose module `run` has a function
`run(work) -> Result`, and whose `findings.md.j2` holds what is said about it.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from planarfriction._support import validation

if TYPE_CHECKING:
    from planarfriction_studies.experiments.experiment import Result, Work


@dataclass(frozen=True)
class Experiment:
    """An entry of the list: its name, its title, and the folder that holds it."""

    name: str
    title: str

    @property
    def run(self) -> Callable[[Work], Result]:
        """The function that carries it out."""
        return importlib.import_module(
            f"{__name__}.{self.name.replace('-', '_')}.run"
        ).run


EXPERIMENTS = {
    name: Experiment(name, title)
    for name, title in (
        ("limit-surfaces", "Limit surfaces, and where the ellipsoid goes wrong"),
        (
            "staircase",
            "The staircase of a grid's steady state, and what smoothing does to it",
        ),
        (
            "velocity-driven",
            "Moved with a given velocity: distributed, reduced and ellipsoid",
        ),
        ("drift", "Drift under a load that friction holds"),
        ("in-hand", "A plate that slips and sticks between two fingers"),
        ("load-dependent", "A contact pressure that follows the load"),
        ("convergence", "Convergence in the number of cells and of table segments"),
        ("timing", "Time, and work against precision"),
        ("classics", "Classics: stick-slip, presliding, break-away and friction lag"),
        ("beyond", "Beyond the paper: exact surfaces, few discs, loads and grooves"),
    )
}
"""Experiment by name, in the order of the paper, and what goes beyond it."""


def find_experiment(name: str) -> Experiment:
    """Return the experiment called `name`; raises `InvalidValueError` for an unknown one."""
    return EXPERIMENTS[validation.choice("experiment", name, EXPERIMENTS)]
