"""Engines that the referee judges: each a name, its settings in words, and a function that builds a case."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Iterator
from typing import Protocol

import numpy as np

from planarfriction_studies.referee.case import Case

MODULES = {
    "mujoco": "mujoco", "mjx": "jax", "mujoco_warp": "mujoco_warp", "drake": "pydrake", "pybullet": "pybullet",
    "newton": "newton",
}  # fmt: skip
"""Modules of this package, and the Python package that each needs."""


class World(Protocol):
    """A case that was built: `step` makes one time step under wrenches `[bodies, 6]` at the centres of mass."""

    def step(self, wrenches: np.ndarray) -> None:
        """Make a step under forces and torques `[bodies, 6]` [N, N m] at the centres of mass, in the world's axes."""
        ...

    def poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions `[bodies, 3]` [m] and rotations `[bodies, 3, 3]` of the bodies that move."""
        ...

    def throw(self, body: int, velocity: np.ndarray) -> None:
        """Give a free body the velocity `[6]` of its centre of mass and its angular velocity [m/s, rad/s]."""
        ...


class Engine(Protocol):
    """An engine with settings."""

    name: str
    """Name in tables."""
    settings: str
    """Settings in words."""
    package: str
    """Name of its package, whose version is shown."""

    def cannot(self, case: Case) -> str | None:
        """Return what the engine has no words for in a case, or None."""
        ...

    def build(self, case: Case, dt: float) -> World:
        """Build a case with a time step [s]."""
        ...


def installed(left_out: list[str]) -> Iterator[Engine]:
    """Return all engines that can be run here; those of missing packages are named in `left_out`."""
    for module, package in MODULES.items():
        if importlib.util.find_spec(package) is None:
            left_out.append(f"{module}: {package} is not installed")
        else:
            yield from importlib.import_module(f"{__name__}.{module}").ENGINES


def lacks(
    case: Case, *, anisotropy: bool = False, stribeck: bool = False
) -> str | None:
    """Return what a case needs beyond Coulomb's law, unless the engine has it."""
    if not stribeck and any(contact.mu_s is not None for contact in case.contacts):
        return "no Stribeck curve"
    if not anisotropy and any(
        contact.mu[0] != contact.mu[1] for contact in case.contacts
    ):
        return "no anisotropic friction"
    return None


def uniform(case: Case) -> bool:
    """Return True if all contacts have the same coefficient."""
    return len({contact.mu for contact in case.contacts}) == 1
