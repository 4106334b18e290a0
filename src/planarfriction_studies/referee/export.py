"""Cases for engines that know nothing of this library: TOML, MJCF, SDF, and CSV of forces and truths."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction.writing import write_text
from planarfriction_studies.referee.case import FOLDER, QUANTITIES, Case
from planarfriction_studies.referee.mjcf import mjcf
from planarfriction_studies.referee.sdf import sdf

SAMPLES = 1e-3
"""Time between rows of the forces [s]."""


def export_case(case: Case, folder: Path) -> None:
    """Write the files of a case of the package to a folder.

    `NAME.toml` is the case, `NAME.xml` MJCF of bodies, pairs and friction, `NAME.sdf` the same in SDF if that has words
    for its friction, `NAME-forces.csv` the forces on its bodies
    as if they never turned, with the part of gravity of inclines, and `NAME-truth.csv` the truths.
    """
    write_text(folder / f"{case.name}.toml", (FOLDER / f"{case.name}.toml").read_text(encoding="utf-8"))
    write_text(folder / f"{case.name}.xml", mjcf(case, case.steps[0]))
    if (text := sdf(case, case.steps[0])) is not None:
        write_text(folder / f"{case.name}.sdf", text)
    positions = np.array([body.position for body in case.moving])
    rotations = np.tile(np.eye(3), (len(positions), 1, 1))
    rows = [
        [f"{t:.9g}", body.name, *(f"{number:.9g}" for number in wrench)]
        for t in np.arange(round(case.time / SAMPLES) + 1) * SAMPLES
        for body, wrench in zip(case.moving, case.wrenches(float(t), positions, rotations), strict=True)
        if wrench.any()
    ]
    headings = ["time [s]", "body", "fx [N]", "fy [N]", "fz [N]", "tx [N m]", "ty [N m]", "tz [N m]"]
    write_text(folder / f"{case.name}-forces.csv", _csv(headings, rows))
    truths = [
        [
            each.body,
            each.quantity,
            repr(each.value),
            each.error,
            each.allowed,
            QUANTITIES[each.quantity],
            each.threshold,
        ]
        for each in case.truths
    ]
    headings = ["body", "quantity", "value", "error of the value", "allowed", "unit", "threshold"]
    write_text(folder / f"{case.name}-truth.csv", _csv(headings, truths))


def _csv(headings: list[str], rows: Iterable[Iterable[Any]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows([headings, *rows])
    return text.getvalue()
