"""Cases, scenes, distances between runs and comparisons, which the in-hand experiments share."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from planarfriction import scenes
from planarfriction.laws import LuGre
from planarfriction.limit_surface import LimitSurfaceCells
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.scenes import Scene
from planarfriction.scenes.ready import GRAVITY
from planarfriction_studies.experiments import experiment
from planarfriction_studies.experiments.experiment import (
    POSE,
    WRENCH,
    Arrays,
    Comparison,
)
from planarfriction_studies.experiments.runs import IN_WORDS, LAW, Kind, published_model

TIGHT: dict[str, Any] = {"rtol": 1e-8, "atol": 3e-8}
"""Tolerances of all runs that are drawn or compared, unless said otherwise."""

ALLOWANCE = {"m": 5e-9, "rad": 5e-8, "N": 2e-6, "N m": 2e-7}
"""Own error at TIGHT by unit: what ten times wider tolerances change, doubled; forces are the widest, for near a slip
they follow the velocity through the falling part of the friction curve."""

DEFAULT_ALLOWANCE = {"m": 2e-6, "rad": 2e-5}
"""Own error of a motion at the default tolerances."""

FRICTION_CHANGE = 1e-3
"""Share by which friction is changed to see what that does."""

MORE, LESS = (
    f"{FRICTION_CHANGE:.1%} more friction",
    f"{FRICTION_CHANGE:.1%} less friction",
)

OF_THE_FIGURE = (
    "The figure was made with LSODA at a relative tolerance of $10^{-6}$; the difference is the error of that run, as "
    "its distance from the converged solution shows. The sample labelled $t$ is the state at $t$ + 0.01 s."
)
OF_BOTH = "What two solvers leave at tight tolerances, and the single precision in which the converged one is kept."
OF_DEFAULTS = "Our own error at the default tolerances."

STORED = (*POSE, *WRENCH, "normal_force")
"""Columns that are kept."""

CENTRES_OF_MASS = {1: (0.002, 0.0), 2: (0.025, 0.0)}
"""Placement -> where the centre of mass starts, the pads being at the origin [m]; 2 is called far."""


@dataclass(frozen=True)
class Case:
    """One in-hand experiment, for any model: published patch, placement of the centre of mass, load."""

    shape: str
    load: Literal[1, 2]
    placement: Literal[1, 2] = 1

    @property
    def group(self) -> str:
        """Shape and placement in words."""
        return IN_WORDS[self.shape] + (", far placement" if self.placement == 2 else "")

    @property
    def words(self) -> str:
        """The case in words."""
        return f"{self.group}, load {self.load}"

    @property
    def has_references(self) -> bool:
        """True if published curves and converged solutions are known."""
        return self.placement == 1 and self.shape in ("Circle", "Square")

    def key(self, kind: Kind) -> str:
        """Return the name of the run of a model in the facts."""
        return f"in_hand/{self.shape}/{kind}{self.load}"

    def scene(self, kind: Kind, law: LuGre = LAW, *, cells: int = 21) -> Scene:
        """Return the scene with the distributed ("d") or the reduced ("r") model."""
        model = published_model(kind, PUBLISHED_PATCHES[self.shape](cells=cells), law)
        load = scenes.in_hand_load(self.load, placement=self.placement)
        return scenes.in_hand(
            model, normal_force=load, centre_of_mass=CENTRES_OF_MASS[self.placement]
        )

    def holding_load(self, x: float) -> float:
        """Return the least normal force of one finger [N] that holds the plate with its centre of mass at `x` [m], in
        theory.

        At this load the weight lies on the limit surface of the cells with mu_s.
        """
        scene = self.scene("d")
        weight = scene.body.mass * GRAVITY / scene.contacts[0].count
        wrench = np.array([0.0, -weight, -weight * x])
        twist = LimitSurfaceCells(PUBLISHED_PATCHES[self.shape]()).twist(wrench)
        return abs(float(wrench @ twist)) / LAW.mu_s


def with_friction(share: float) -> LuGre:
    """Return the published law with both friction coefficients times `1 + share`."""
    return dataclasses.replace(
        LAW, mu_c=LAW.mu_c * (1.0 + share), mu_s=LAW.mu_s * (1.0 + share)
    )


CHANGED = {MORE: with_friction(FRICTION_CHANGE), LESS: with_friction(-FRICTION_CHANGE)}
"""Change of friction in words -> its law."""


def distance(run: Arrays, other: Arrays) -> np.ndarray:
    """Return the distance of the centre of mass between two runs over time [m]."""
    return np.hypot(run["x"] - other["x"], run["y"] - other["y"])


def end_distance(run: Arrays, other: Arrays) -> float:
    """Return the distance between the ends of two runs [m]."""
    return float(distance(run, other)[-1])


def end(run: Arrays) -> dict[str, float]:
    """Return the end position [m, m, rad]."""
    return {name: float(run[name][-1]) for name in POSE}


def errors(run: Arrays, key: str) -> dict[str, float]:
    """Return the largest distance from the converged solution `key` by column."""
    rows = experiment.compare_columns("converged", "", run, key, ALLOWANCE, OF_BOTH)
    return {row.quantity: row.difference for row in rows}


def compare_with_converged(
    run: Arrays, key: str, words: str, *, default: bool = False
) -> list[Comparison]:
    """Compare a run with the converged solution `key`; of a run at default tolerances its motion only."""
    words = f"{words}, default tolerances, " if default else f"{words}, "
    rest = (DEFAULT_ALLOWANCE, OF_DEFAULTS) if default else (ALLOWANCE, OF_BOTH)
    return experiment.compare_columns("converged", words, run, key, *rest)


def compare_with_published(run: Arrays, key: str, words: str) -> list[Comparison]:
    """Compare a run with the published curves `key`."""
    return experiment.compare_columns(
        "published", f"{words}, ", run, key, ALLOWANCE, OF_THE_FIGURE
    )
