"""Free slides of a cube that was tossed on a table: its path and end are predicted from its first poses."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from planarfriction.identify import MassProperties, Slide
from planarfriction.identify.slides import contradictions
from planarfriction.patch import ContactPatch
from planarfriction_studies.measured.questions import FIRST_POSES, Case, SlideQuestion
from planarfriction_studies.measured.scores import Measure, rms
from planarfriction_studies.measured.tables import read_table, refuse

MASS, INERTIA, SIDE = 0.37, 8.10e-4, 0.1048  # of the cube [kg, kg m^2, m]

CELLS = 11
"""Cells across the face: finer ones move no final yaw by more than 0.12 deg, and their RMS error by 0.02 deg."""

MEASURES = (
    Measure("path_mm", "along the path [mm]", rms),
    Measure("path_deg", "along the path [deg]", rms, column=1),
    Measure("end_mm", "at the end [mm]", rms, column=2),
    Measure("end_deg", "at the end [deg]", rms, column=3),
)
"""RMS over tosses of the error in position and yaw: RMS over the samples of a toss, and at its last sample."""


@lru_cache(maxsize=1)
def face() -> ContactPatch:
    """Return the face of the cube, uniform pressure."""
    return ContactPatch.rectangle(SIDE, cells=CELLS, name="face of the cube")


def read(folder: Path | None = None) -> list[Case]:
    """Read all slides; cases with one `group` are turned copies of one toss, whose unique_id it is."""
    pose = ["x_m", "y_m", "yaw_rad"]
    table = read_table("slides", ["toss", "unique_id", "t_s", *pose], folder=folder)
    cases = []
    for number, rows in table.groupby("toss"):
        time = rows["t_s"].to_numpy() - rows["t_s"].iloc[0]
        poses = rows[pose].to_numpy()
        if len(time) <= FIRST_POSES or (np.diff(time) <= 0.0).any():
            raise refuse(
                "slides",
                folder,
                f"toss {number:g} needs more than {FIRST_POSES} samples, at increasing times",
            )
        question = SlideQuestion(
            time, poses[:FIRST_POSES], face(), MASS, INERTIA, 0.5 * SIDE
        )
        group = int(rows["unique_id"].iloc[0])
        cases.append(
            Case(
                question,
                poses,
                f"toss {number:g}",
                f"{group}",
                np.arange(len(time)),
                "table",
            )
        )
    return cases


def refused(cases: Sequence[Case]) -> dict[int, str]:
    """Find the tosses that `identify_motion` leaves out by itself: those that friction alone cannot have made.

    Returns reasons by index.
    """
    measured = [
        Slide(case.question.time, case.answer, name=case.name) for case in cases
    ]
    return contradictions(measured, MassProperties(MASS, INERTIA))


def errors(case: Case, answer: np.ndarray) -> np.ndarray:
    """Return one row: RMS position [mm] and yaw [deg] over the samples, then both at the last one, `[1, 4]`."""
    off = answer - case.answer
    position = 1e3 * np.hypot(off[:, 0], off[:, 1])
    yaw = np.degrees(np.abs(off[:, 2]))
    return np.array([[rms(position), rms(yaw), position[-1], yaw[-1]]])


def by_spin(cases: Sequence[Case], count: int) -> list[Case]:
    """Return `count` slides from the median turn to the largest, to draw."""
    turned = sorted(cases, key=lambda case: abs(case.answer[-1, 2] - case.answer[0, 2]))
    return [
        turned[i]
        for i in np.linspace(len(turned) // 2, len(turned) - 1, count).astype(int)
    ]
