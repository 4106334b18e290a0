"""Friction of a servo joint with a pendulum, from eight logs of its goal and position (see `data/NOTICE`)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from planarfriction.joints import Drive, JointFit, JointLog, Plant, identify_joint
from planarfriction_studies.measured.tables import read_table

PENDULUM = Plant(mass=0.49, length=0.10)
"""The mass on its arm; nobody weighed the arm."""

GAIN = 4096.0 / (2.0 * np.pi) / (256.0 * 885.0)
"""Duty per angle at a gain of 1 [1/rad]: 4096 steps a turn, registers of 256 and 885."""

SUPPLY, SAG = 7.34, 0.25
"""Mean voltage at rest, and what it loses at full duty [V]; single readings scatter by 0.5 V."""


def read_logs(folder: Path | None = None) -> list[JointLog]:
    """Read the eight logs, each with the servo that it was recorded with."""
    rows = read_table(
        "joints", ["log", "t", "q", "dq", "goal", "enabled"], folder=folder
    )
    about = read_table("joint logs", ["log", "kp"], ["trajectory"], folder=folder)
    logs = []
    for log, kp, trajectory in zip(
        about["log"], about["kp"], about["trajectory"], strict=True
    ):
        columns = rows[rows["log"] == log]
        given = {
            name: columns[name].to_numpy() for name in ("q", "dq", "enabled", "goal")
        }
        drive = Drive(kp, SUPPLY, GAIN, SAG)
        logs.append(
            JointLog(
                columns["t"].to_numpy(),
                **given,
                drive=drive,
                name=f"{trajectory}, kp {kp:.0f}",
            )
        )
    return logs


def fit_joints(
    folder: Path | None = None, *, progress: Callable[[str], None] | None = None
) -> JointFit:
    """Fit the friction of the joint to the logs, with the terms that left-out logs ask for."""
    return identify_joint(read_logs(folder), PENDULUM, progress=progress)
