"""Runs of the convergence experiment: patches of many grids and tables moved alike, each beside a finer one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from planarfriction.geometry import wrench_at
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import LimitSurfaceTablePublished
from planarfriction.models import DistributedModel, ReducedModelPublished
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch
from planarfriction.scenes import (
    Body,
    Contact,
    Scene,
    Signal,
    published_velocity,
    simulate,
)
from planarfriction.scenes.ready import FINE
from planarfriction_studies.experiments.experiment import WRENCH, Work

Family = str
"""Name of a figure's curves: one of `FAMILIES`."""

FAMILIES: tuple[Family, ...] = ("cells_distributed", "cells_reduced", "segments")
"""Figures: distributed and reduced model over the number of cells, reduced model over the segments of its table."""

SHAPES = ("Circle", "Square", "LineGrad")
"""Patches of the experiment, in the order of the figures' colours."""

LAWS = {
    "p0": LuGre(mu_s=1.0, sigma_2=0.0, elasto_plastic=ElastoPlastic(0.9)),
    "p1": LuGre(mu_s=1.2, sigma_2=0.2, elasto_plastic=ElastoPlastic(0.9)),
}
"""Laws of the experiment: without Stribeck and viscous friction, and with both."""

COUNTS = tuple(range(5, 36, 2))
"""Numbers of cells along the width, or of segments of a quadrant."""

BASE_CELLS, BASE_SEGMENTS, SEGMENT_CELLS = 101, 100, 21
"""Cells of the base of the first two families, segments of the base of the third, and the third's grid."""

PUBLISHED_INTERVAL, COARSE_INTERVAL = 1e-4, 5e-4
"""Time [s] between samples that published errors are means over; and ours where so many cost more than the run."""

REDUCED_TOLERANCES: dict[str, Any] = {"rtol": 1e-8, "atol": 3e-8}
"""Tolerances of the reduced model: the error of a fine table is 3e-4 of the force, and a percent of that is wanted."""

T_END, EULER_STEP, _EULER_PARTS = 5.0, 1e-5, 10
"""End of the runs, step of the published explicit Euler method [s], and parts in which it is run."""

_NOTHING = 1e-150
"""A bristle deflection [m] that is none: what decays further has a denormal square, which takes 100 times longer."""

Case = tuple[str, str]
"""Shape and friction parameters."""

CASES: tuple[Case, ...] = tuple(
    (shape, parameters) for shape in SHAPES for parameters in LAWS
)

Errors = Mapping[Family, np.ndarray]
"""Family -> relative errors of force and torque at every count, [N, 2]."""


def profile() -> Signal:
    """Return the published velocity of the centre of pressure, not held but continuous; its kinks lie on samples."""
    held = published_velocity()
    kinks = [0, 60, 80, 140, 160, 220, 240, 270, 340, 400, 430, 460, 500]
    return Signal.sampled(held.times[kinks], held.values[kinks], hold="linear")


def patch(shape: str, cells: int) -> ContactPatch:
    """Return the published patch on a grid of `cells` x `cells`."""
    return PUBLISHED_PATCHES[shape](cells=cells)


def interval(case: Case, family: Family, work: Work) -> float:
    """Return the time between samples [s]."""
    cheap = family == "segments" or case[0] == "LineGrad" or work.full
    return PUBLISHED_INTERVAL if cheap else COARSE_INTERVAL


def base_of(family: Family) -> tuple[Family, int]:
    """Return the family and count of the run that the others are measured against."""
    return (
        ("segments", BASE_SEGMENTS)
        if family == "segments"
        else ("cells_distributed", BASE_CELLS)
    )


def relative_errors(wrench: np.ndarray, base: np.ndarray) -> np.ndarray:
    """Return the root mean square errors of force and torque over the base's largest force and torque [-]."""
    square = np.mean((wrench - base) ** 2, axis=0)
    force = np.hypot(base[:, 0], base[:, 1]).max()
    torque = np.abs(base[:, 2]).max()
    return np.sqrt([square[0] + square[1], square[2]]) / [force, torque]


def contact(family: Family, count: int, case: Case) -> Contact:
    """Return the patch of one run, placed so that the body's origin is the point that has the velocity.

    That point is the centre of pressure of the finest grid of the family, though a coarser patch may have its own a
    little beside it.
    """
    shape = case[0]
    law = LAWS[case[1]]
    cells, finest = (
        (SEGMENT_CELLS, SEGMENT_CELLS) if family == "segments" else (count, BASE_CELLS)
    )
    here = patch(shape, cells)
    if family == "cells_distributed":
        model = DistributedModel(here, law)
    else:
        segments = count if family == "segments" else 20
        model = ReducedModelPublished(
            here, law, surface=LimitSurfaceTablePublished(here, segments=segments)
        )
    x, y = np.asarray(patch(shape, finest).centre_of_pressure()).tolist()
    return Contact(
        model,
        Signal.constant(1.0),
        mounted_on="body",
        position=(-x, -y),
        name=f"{family} {count}",
    )


def scene(contacts: Sequence[Contact]) -> Scene:
    """Return the scene of contacts that are moved together as published."""
    return Scene(
        Body(1.0, 1.0, gravity=(0.0, 0.0)),
        list(contacts),
        T_END,
        velocity=profile(),
        **FINE,
    )


def wrenches(
    family: Family, count: int, case: Case, every: float
) -> dict[str, np.ndarray]:
    """Return `wrench` `[T, 3]` about the patch's own centre of pressure at multiples of `every` [s]."""
    here = contact(family, count, case)
    tolerances = FINE if family == "cells_distributed" else REDUCED_TOLERANCES
    histories = simulate(scene([here]), save_every=every, **tolerances).histories
    about_origin = np.stack([histories[name].values[:, 0] for name in WRENCH], axis=-1)
    return {"wrench": wrench_at(about_origin, here.model.patch.centre_of_pressure())}


def solve(
    cases: Sequence[Case], counts: Sequence[int], work: Work
) -> dict[Case, Errors]:
    """Return errors of every case, with the structured solver: the bases first, then everything else, two at a time."""
    keys = {
        (case, family): (case, *base_of(family), interval(case, family, work))
        for case in cases
        for family in FAMILIES
    }
    wanted = {
        key: partial(wrenches, key[1], key[2], key[0], key[3]) for key in keys.values()
    }
    bases = work.pieces(wanted, lambda key: _label(*key[:3]))

    def errors(case: Case, family: Family, count: int) -> dict[str, np.ndarray]:
        key = keys[case, family]
        wrench = wrenches(family, count, case, key[3])["wrench"]
        return {"errors": relative_errors(wrench, bases[key]["wrench"])}

    runs = [
        (case, family, count)
        for family in FAMILIES
        for count in reversed(counts)
        for case in cases
    ]
    found = work.pieces(
        {run: partial(errors, *run) for run in runs}, lambda run: _label(*run)
    )
    return {
        case: {
            family: np.array([found[case, family, count]["errors"] for count in counts])
            for family in FAMILIES
        }
        for case in cases
    }


def _label(case: Case, family: Family, count: int) -> str:
    return f"convergence, {' '.join(case)}, {family} {count}"


def solve_by_euler(
    cases: Sequence[Case], counts: Sequence[int], work: Work
) -> Mapping[Case, Errors]:
    """Compute the errors of every case with the published explicit Euler steps, all its grids and tables in one go."""
    labels = {
        case: f"convergence, {case[0]} {case[1]}, explicit Euler" for case in cases
    }
    return work.pieces(
        {case: partial(_euler, case, counts, labels[case], work) for case in cases},
        labels.__getitem__,
    )


def _euler(
    case: Case, counts: Sequence[int], label: str, work: Work
) -> dict[str, np.ndarray]:
    """Compute the errors of one case by family."""
    runs = [(family, count) for family in FAMILIES for count in counts]
    runs += sorted({base_of(family) for family in FAMILIES})
    contacts = [contact(family, count, case) for family, count in runs]
    parts = []
    state = None
    for part in range(_EULER_PARTS):
        kept = work.piece(
            f"{label}, part {part + 1} of {_EULER_PARTS}",
            partial(_euler_part, contacts, part, state),
        )
        parts.append(kept["wrench"])
        state = kept["state"]
    all_wrenches = np.concatenate(parts)
    wrench = {
        run: wrench_at(all_wrenches[:, c], contacts[c].model.patch.centre_of_pressure())
        for c, run in enumerate(runs)
    }
    return {
        family: np.array(
            [
                relative_errors(wrench[family, count], wrench[base_of(family)])
                for count in counts
            ]
        )
        for family in FAMILIES
    }


def _euler_part(
    contacts: Sequence[Contact], part: int, state: np.ndarray | None
) -> dict[str, np.ndarray]:
    """Return one of `_EULER_PARTS` equal parts: wrenches `[T, contacts, 3]` before each sample, and the state."""
    from planarfriction.extend import right_hand_side
    from planarfriction.scenes.packing import MOST_PIECES, SegmentBatches

    packed = SegmentBatches(scene(contacts), T_END, most=MOST_PIECES)
    system = next(iter(packed))
    y = packed.state.copy() if state is None else state.copy()
    rate = np.empty_like(y)
    bristles = len(y) - 6
    steps = round(T_END / EULER_STEP) // _EULER_PARTS
    twists = profile()((part * steps + np.arange(steps)) * EULER_STEP)
    stride = round(PUBLISHED_INTERVAL / EULER_STEP)
    samples = []
    for k in range(steps):
        y[bristles : bristles + 3] = twists[k]
        right_hand_side(system.address, 0, 0.0, y, rate)
        if k % stride == 0:
            samples.append(system.wrench.copy())
            y[:bristles][np.abs(y[:bristles]) < _NOTHING] = 0.0
        y[:bristles] += EULER_STEP * rate[:bristles]
    return {"wrench": np.array(samples), "state": y}
