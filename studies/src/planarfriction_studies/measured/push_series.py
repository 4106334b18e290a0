"""Pushes of a wooden triangle in time: the twist that its wrench goes with, and the wrench of its twist, on the way."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from planarfriction.patch import ContactPatch
from planarfriction_studies.measured.questions import Case, SeriesQuestion
from planarfriction_studies.measured.scores import Measure, angles, mean
from planarfriction_studies.measured.tables import read_table

LENGTH = 0.035
"""rho of the metric: angles are between (vx, vy, rho omega), and (fx, fy, tau/rho) [m]."""

CENTRE = np.array([29.3e-3, 29.3e-3])  # of mass, from the corner along the legs [m]
FEET = np.array([[10e-3, 10e-3], [84e-3, 10e-3], [10e-3, 84e-3]]) - CENTRE
SHARES = np.array([0.478, 0.261, 0.261])
WEIGHT = 0.128 * 9.81  # [N]

OTHER_FEET = ("robot_push_many", "robot_push_many_2")
"""Runs that stood on something else: their wrenches fit no three outer feet. They are left out."""

DOCUMENTED = (
    "robot_push_many_9_sd_3outerpts",
    "robot_multi_push_3out_1",
    "robot_multi_push_3out_2",
    "robot_multi_push_3out_3",
)
"""Runs whose names say three outer feet; in the others these feet are an assumption."""

WINDOW, EVERY = 0.25, 6
"""Half width of the Hann window over the force [s]; every sixth sliding row is scored: neighbours are correlated."""

MEASURES = (
    Measure(
        "twist_named_deg",
        "twist, named feet [deg]",
        mean,
        "twists named",
        quantity="angle",
    ),
    Measure(
        "wrench_named_deg",
        "wrench, named feet [deg]",
        mean,
        "wrenches named",
        quantity="angle",
    ),
    Measure(
        "twist_other_deg",
        "twist, other runs [deg]",
        mean,
        "twists other",
        quantity="angle",
    ),
    Measure(
        "wrench_other_deg",
        "wrench, other runs [deg]",
        mean,
        "wrenches other",
        quantity="angle",
    ),
)
"""Mean angle over the scored rows of all pushes."""


def feet() -> ContactPatch:
    """Return the patch of the three outer feet with their shares of the load, about the centre of mass."""
    return ContactPatch.points(FEET, SHARES, name="three outer feet")


def read(folder: Path | None = None) -> list[Case]:
    """Read two cases for each push: its twists and its wrenches."""
    motion = ["vx_mps", "vy_mps", "wz_radps"]
    force = ["fx_N", "fy_N", "tau_Nm"]
    columns = ["push_id", "t_s", "yaw_rad", *motion, *force, "sliding"]
    table = read_table("series", columns, ["run"], folder=folder)
    patch = feet()
    cases = []
    for (run, number), rows in table[~table["run"].isin(OTHER_FEET)].groupby(
        ["run", "push_id"], sort=False
    ):
        time = rows["t_s"].to_numpy() - rows["t_s"].iloc[0]
        scored = np.flatnonzero(rows["sliding"].to_numpy() > 0)[::EVERY]
        if not len(scored):
            continue
        yaw = rows["yaw_rad"].to_numpy()
        twists = to_object(rows[motion].to_numpy(), yaw)
        wrenches = to_object(smooth(time, rows[force].to_numpy()), yaw)
        kind = "named" if run in DOCUMENTED else "other"
        pairs: Any = (("twists", wrenches, twists), ("wrenches", twists, wrenches))
        for wanted, given, answer in pairs:
            question = SeriesQuestion(time, given, wanted, patch, WEIGHT)
            name = f"push {number:g} of {run}, {wanted}"
            cases.append(
                Case(question, answer, name, f"{number:g}", scored, f"{wanted} {kind}")
            )
    return cases


def to_object(vectors: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """Return the world vectors `(x, y, about z)` `[T, 3]` in the axes of the object."""
    cos = np.cos(yaw)
    sin = np.sin(yaw)
    x, y, about = vectors.T
    return np.stack([cos * x + sin * y, cos * y - sin * x, about], axis=1)


def smooth(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return means of `values` `[T, 3]` under a Hann window."""
    apart = np.clip((time[:, None] - time) / WINDOW, -1.0, 1.0)
    weights = 0.5 + 0.5 * np.cos(np.pi * apart)
    return weights @ values / weights.sum(axis=1, keepdims=True)


def errors(case: Case, answer: np.ndarray) -> np.ndarray:
    """Return the angle of each scored row [deg], `[S, 1]`."""
    length = LENGTH if case.question.wanted == "twists" else 1.0 / LENGTH
    return angles(answer[case.scored], case.answer[case.scored], length)[:, None]
