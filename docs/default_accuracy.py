"""Numbers of docs/solver.md: how far runs at the default tolerances end from converged ones, and what tolerances do.

python docs/default_accuracy.py
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.scenes.scene import RTOL
from planarfriction_studies.experiments.in_hand.runs import CENTRES_OF_MASS
from planarfriction_studies.experiments.runs import IN_WORDS, LAW

MODELS: dict[str, Callable[[pf.ContactPatch], Any]] = {
    "distributed": lambda patch: pf.DistributedModel(patch, LAW),
    "reduced": lambda patch: pf.ReducedModel(patch, LAW),
    "reduced, 1 disc": lambda patch: pf.ReducedModel(patch, LAW, cells=1),
    "reduced, 8 discs": lambda patch: pf.ReducedModel(patch, LAW, cells=8),
    "published": lambda patch: pf.ReducedModelPublished(patch, LAW),
}
"""Models by name, each as a function of its patch."""

SHAPES = (
    "Circle",
    "Square",
    "Line",
    "LineGrad",
    "LineGradX",
    "NonConvex1",
    "NonConvex2",
)
FACTORS = (0.5, 1.0, 1.5)
"""Tolerances, as shares of the default ones: a result that hangs on luck does not stand this."""

CONVERGED = 1e-9
"""Relative tolerance of what runs are compared with; the absolute one follows."""


def scenes(shape: str, model: Any) -> Iterator[pf.Scene]:
    """The in-hand scenes of a published shape: both placements of the centre of mass, both loads."""
    for placement, centre in CENTRES_OF_MASS.items():
        for load in (1, 2):
            signal = pf.scenes.in_hand_load(load, placement=placement)
            yield pf.scenes.in_hand(model, normal_force=signal, centre_of_mass=centre)


def end_errors(scene: pf.Scene, factors: tuple[float, ...] = FACTORS) -> np.ndarray:
    """Distance [m] and angle [rad] of the ends at tolerances times each factor from the converged end, `[F, 2]`."""

    def end(rtol: float) -> np.ndarray:
        data = pf.simulate(scene, rtol=rtol).histories
        return np.array([data[name].values[-1] for name in ("x", "y", "theta")])

    exact = end(CONVERGED)
    found = np.array([end(factor * RTOL) for factor in factors]) - exact
    return np.stack([np.hypot(found[:, 0], found[:, 1]), np.abs(found[:, 2])], axis=1)


def largest_errors(shape: str, kind: str) -> np.ndarray:
    """Largest distance [m] and angle [rad] of the four runs of a shape at all factors."""
    model = MODELS[kind](PUBLISHED_PATCHES[shape]())
    return np.max(
        [end_errors(scene).max(axis=0) for scene in scenes(shape, model)], axis=0
    )


def motion_errors(scene: pf.Scene, rtol: float) -> tuple[float, float, int]:
    """Largest distance [m] and angle [rad] from the converged motion, and the number of steps."""
    runs = [pf.simulate(scene, rtol=each) for each in (rtol, CONVERGED)]
    x, y, theta = (
        runs[0].histories[n].values - runs[1].histories[n].values
        for n in ("x", "y", "theta")
    )
    return (
        float(np.hypot(x, y).max()),
        float(np.abs(theta).max()),
        runs[0].statistics.steps,
    )


def _row(cells: list[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _length(metres: float) -> str:
    return f"{1e6 * metres:.2g} µm" if metres >= 1e-7 else f"{1e9 * metres:.2g} nm"


def main() -> None:
    """Print both tables."""
    print(_row(["", *MODELS]) + "\n" + _row(["---"] * (len(MODELS) + 1)))
    for shape in SHAPES:
        errors = [largest_errors(shape, kind) for kind in MODELS]
        print(
            _row(
                [
                    IN_WORDS[shape],
                    *(f"{1e6 * m:.1f} µm, {1e6 * rad:.0f} µrad" for m, rad in errors),
                ]
            )
        )
    kinds = ("distributed", "reduced", "published")
    print(
        "\n"
        + _row(["rtol", *(f"{kind}: position, angle | steps" for kind in kinds)])
        + "\n"
        + _row(["---"] * 7)
    )
    disc = {
        kind: next(scenes("Circle", MODELS[kind](PUBLISHED_PATCHES["Circle"]())))
        for kind in kinds
    }
    for rtol in (1e-3, 1e-4, 1e-5, 1e-6, 1e-7):
        found = [motion_errors(disc[kind], rtol) for kind in kinds]
        print(
            _row(
                [
                    f"{rtol:.0e}",
                    *(
                        f"{_length(m)}, {rad:.1e} rad | {steps}"
                        for m, rad, steps in found
                    ),
                ]
            )
        )


if __name__ == "__main__":
    main()
