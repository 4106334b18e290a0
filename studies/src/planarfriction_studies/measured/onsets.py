"""Single pushes with the force in time: the end of the object, and how far its force overshoots when it breaks away.

The pushes are those of the task `pushes`. The pusher touches at a known place and moves on in a known straight line.
The object's motion in time was not recorded, only its rest before and after. Robot and finger are a nuisance that is
stated: a spring whose stiffness is the rise of the force at touch over the speed of the robot, push by push.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction.geometry import rotate
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import LimitSurface
from planarfriction.planning import Pusher, Slider, push
from planarfriction.scenes import Signal
from planarfriction.scenes.ready import GRAVITY
from planarfriction_studies.measured import pushes
from planarfriction_studies.measured.questions import Case, OnsetQuestion
from planarfriction_studies.measured.replayed_pushes import TRIANGLE
from planarfriction_studies.measured.scores import Measure, median
from planarfriction_studies.measured.tables import read_table, refuse

MASS, LEG = 1.518, 0.15
"""Mass of the triangle [kg], and its legs [m]."""

INERTIA = MASS * LEG**2 / 9.0
"""Moment of inertia of a right triangle with equal legs about the vertical through its centroid [kg m^2]."""

TRAVEL = 17.5e-3
"""Commanded way of the robot [m]; its log ends 1.2 mm before."""

EDGES = {0: 2, 1: 0, 2: 1}
"""Edges of the table (x leg, y leg, hypotenuse) as edges of the outline."""

PEAK, LEVEL = (0.0, 0.25), (0.3, 1.0)
"""Times after touch in which the peak and the level of the force are taken [s]."""

MEASURES = (
    Measure("end_mm", "end [mm]", median),
    Measure("end_deg", "end [deg]", median, column=1),
    Measure("peak_flat", "breakaway peak, flat face", median, "flat", 2),
    Measure("peak_feet", "breakaway peak, feet", median, "feet", 2),
)
"""Medians over pushes of the distance and angle of the predicted end, and of the error of the peak over the level."""


def read(folder: Path | None = None) -> list[Case]:
    """Read all pushes; answers are the final pose x, y, theta [m, m, rad] and the peak of the force over its level."""
    start = ["obj_x0_m", "obj_y0_m", "obj_yaw0_rad"]
    end = ["obj_x1_m", "obj_y1_m", "obj_yaw1_rad"]
    numbers = [
        "push",
        "edge",
        "pcx_m",
        "pcy_m",
        "ux",
        "uy",
        "speed_mps",
        "t_start_s",
        "t_contact_s",
        *start,
        *end,
    ]
    table = read_table(
        "onsets", [*numbers, "rise_N_per_s", "f_sustained_N"], ["config"], folder=folder
    )
    rows = ["t_s", "fx_N", "fy_N"]
    forces = read_table(
        "forces", ["push", *rows], ["config", "row"], folder=folder, optional=rows
    )
    series = dict(list(forces[forces["row"] == "F"].groupby(["config", "push"])))
    patches = {
        case.question.layout: (case.question.patch, case.board)
        for case in pushes.read(folder)
    }
    cases = []
    for i, row in enumerate(table.itertuples()):
        name = f"{row.config} {row.push:g}"
        if row.config not in patches or (row.config, row.push) not in series:
            raise refuse(
                "onsets",
                folder,
                f"push {name} has no layout in the table of pushes or no force in time",
            )
        patch, board = patches[row.config]
        stiffness = row.rise_N_per_s / row.speed_mps
        gone = (
            row.speed_mps * (row.t_contact_s - row.t_start_s)
            + row.f_sustained_N / stiffness
        )
        question = OnsetQuestion(
            patch,
            TRIANGLE,
            EDGES[int(row.edge)],
            np.array([getattr(row, each) for each in start]),
            np.array([row.pcx_m, row.pcy_m]),
            np.array([row.ux, row.uy]) * row.speed_mps,
            TRAVEL - gone,
            stiffness,
            MASS,
            INERTIA,
        )
        force = series[row.config, row.push]
        over = peak(
            force["t_s"].to_numpy() - row.t_contact_s,
            np.hypot(force["fx_N"], force["fy_N"]).to_numpy(),
        )
        if not np.isfinite(over):
            raise refuse(
                "forces",
                folder,
                f"push {name} needs forces from 0 to {LEVEL[0]:g} s after touch and later",
            )
        answer = np.array([*(getattr(row, each) for each in end), over])
        kind = "flat" if board == "flat" else "feet"
        # Half of them to fit to.
        cases.append(
            Case(question, answer, name, f"{4 * i + i % 2}", np.arange(1), kind)
        )
    return cases


def peak(time: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return the largest force `[T, ...]` in `PEAK` over its median in `LEVEL`, NaN where either has no samples."""
    first, later = ((time > begin) & (time < end) for begin, end in (PEAK, LEVEL))
    if not (first.any() and later.any()):
        return np.full(force.shape[1:], np.nan)
    return force[first].max(axis=0) / np.median(force[later], axis=0)


def errors(case: Case, answer: np.ndarray) -> np.ndarray:
    """Return one row: distance [mm] and angle [deg] of the end, and the difference of the peak, `[1, 3]`."""
    off = np.abs(answer - case.answer)
    return np.array([[1e3 * np.hypot(off[0], off[1]), np.degrees(off[2]), off[3]]])


MU_FINGER = 0.44
"""Friction of the finger [-]: ratio of the force along the edge to that across it where the finger slides."""

MU, V_S = 0.3, 1e-3
"""Friction of the boards [-], which ratios of forces hardly see, and a Stribeck velocity below that of pushes [m/s]."""

DAMPING = 0.6
"""Damping of the object on the spring of robot and finger over the critical one: less, and it would stick and slip."""

STEP, STEPS = 5e-4, 1000
"""Time step [s] and number of steps of an onset."""

STIFFNESS, VISCOSITY = 1e5, 100.0
"""Bristles [1/m, s/m]: 50 times stiffer than robot and finger, and damped well at this step."""


def pushed_end(surface: LimitSurface, question: OnsetQuestion) -> np.ndarray:
    """Return the final pose `[3]` of the object: the pusher goes its way from the touch, without inertia."""
    begin = question.start[:2] + rotate(question.place, question.start[2])
    way = question.travel * question.velocity / np.hypot(*question.velocity)
    path = Signal.sampled([0.0, 1.0], [begin, begin + way], "linear")
    slider = Slider(surface, question.outline)
    return push(
        slider, Pusher(MU_FINGER), path, start=question.start, samples=2, rtol=1e-5
    ).end


def breaking(ratio: float) -> LuGre:
    """Return a law whose static friction is `ratio` times the kinetic one."""
    damped = ElastoPlastic(0.9)
    return LuGre(
        MU,
        MU * ratio,
        V_S,
        sigma_0=STIFFNESS,
        sigma_1=VISCOSITY,
        sigma_2=0.0,
        elasto_plastic=damped,
    )


def peaks(model: Any, questions: Sequence[OnsetQuestion]) -> np.ndarray:
    """Return the peak of the force over its level `[K]` when a spring pushes objects on `model` from rest.

    The spring, isotropic, with a damper beside it, joins a point that moves at constant velocity to a finger that
    slides along the edge where the force leaves its friction cone. Place and directions of the touch stay, as the
    object moves by 1 mm meanwhile.
    """
    first = questions[0]
    mass = first.mass
    radii = np.array([first.mass, first.mass, first.inertia])
    stiffness = np.array([each.stiffness for each in questions])[:, None]
    damping = 2.0 * DAMPING * np.sqrt(stiffness * mass)
    drive = np.array([rotate(each.velocity, -each.start[2]) for each in questions])
    x, y = np.array([each.place for each in questions]).T
    normal = np.array([each.normal for each in questions])
    along = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    state = np.zeros((len(questions), *model.rest().shape))
    twist = np.zeros((len(questions), 3))
    stretch = np.zeros((len(questions), 2))
    found = np.empty((STEPS, len(questions)))
    for i in range(STEPS):
        rate = drive - np.stack(
            [twist[:, 0] - twist[:, 2] * y, twist[:, 1] + twist[:, 2] * x], axis=1
        )
        stretch = stretch + STEP * rate
        force = stiffness * stretch + damping * rate
        across = np.maximum(np.sum(force * normal, axis=1), 0.0)[:, None]
        slip = np.clip(
            np.sum(force * along, axis=1)[:, None],
            -MU_FINGER * across,
            MU_FINGER * across,
        )
        held = across * normal + slip * along
        stretch = stretch + (held - force) / stiffness
        state, wrench = model.step(state, twist, mass * GRAVITY, STEP)
        torque = x * held[:, 1] - y * held[:, 0]
        twist = twist + STEP * (np.column_stack([held, torque]) + wrench) / radii
        found[i] = np.hypot(*held.T)
    return peak(STEP * np.arange(1, STEPS + 1), found)
