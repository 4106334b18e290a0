"""Slow pushes of a triangle on known feet: its motion is predicted from the measured wrench."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from planarfriction.patch import ContactPatch
from planarfriction_studies.measured.questions import Case, PushQuestion
from planarfriction_studies.measured.scores import Measure, angles, mean
from planarfriction_studies.measured.tables import read_table, refuse

LENGTH = 0.05
"""rho of the metric: angles are between (vx, vy, rho omega) [m]."""

FLAT_CELLS = 31
"""Cells across the flat triangle: 61 move its mean errors by less than 0.02 deg."""

THEIRS = {
    "poly4_convex": "authors' quartic",
    "gp": "authors' Gaussian process",
    "quadratic_ellipsoid": "authors' ellipsoid",
}
"""Methods of the authors, and what they are called here."""

OFF = "angle to the\nmeasured twist"
"""Quantity of the measures."""

MEASURES = (
    Measure(
        "hardboard_deg", "feet on hardboard [deg]", mean, "hardboard", quantity=OFF
    ),
    Measure("plywood_deg", "feet on plywood [deg]", mean, "plywood", quantity=OFF),
    Measure("flat_deg", "flat face [deg]", mean, "flat", quantity=OFF),
)
"""Mean angle between the measured and the predicted twist."""


def read(folder: Path | None = None) -> list[Case]:
    """Read all pushes, two cases for each layout: the pushes with an even number, to fit to, and the others."""
    motion = ["fx_N", "fy_N", "tau_Nm", "dx_m", "dy_m", "dtheta_rad"]
    pushes = read_table(
        "pushes", ["push", *motion], ["config", "surface"], folder=folder
    )
    feet = read_table(
        "supports",
        ["x_m", "y_m", "load_fraction"],
        ["config", "kind"],
        folder=folder,
        optional=("load_fraction",),
    )
    cases = []
    for name, rows in pushes.groupby("config", sort=False):
        here = feet[feet.config == name]
        if len(here) != 3:
            raise refuse(
                "supports", folder, f"needs three rows for {name}, has {len(here)}"
            )
        corners = here[["x_m", "y_m"]].to_numpy()
        flat = here["kind"].iloc[0] != "point"
        if flat:
            patch = ContactPatch.polygon(corners, cells=FLAT_CELLS, name=str(name))
        elif not np.isfinite(here["load_fraction"]).all():
            raise refuse(
                "supports", folder, f"column load_fraction of {name}: not a number"
            )
        else:
            patch = ContactPatch.points(
                corners, here["load_fraction"].to_numpy(), name=str(name)
            )
        board = "flat" if flat else str(rows["surface"].iloc[0])
        for rest in (0, 1):
            part = rows[rows.push % 2 == rest]
            wrenches = part[motion[:3]].to_numpy()
            twists = part[motion[3:]].to_numpy()
            if not len(part) or not (
                np.abs(wrenches).max(1).all() and np.abs(twists).max(1).all()
            ):
                raise refuse(
                    "pushes",
                    folder,
                    f"{name} needs even and odd pushes, none without force or motion",
                )
            question = PushQuestion(wrenches, patch, str(name))
            cases.append(
                Case(
                    question,
                    twists,
                    f"{name}, {'odd' if rest else 'even'}",
                    str(rest),
                    np.arange(len(part)),
                    board,
                )
            )
    return cases


def errors(case: Case, answer: np.ndarray) -> np.ndarray:
    """Return the angle of each push [deg], `[M, 1]`."""
    return angles(answer, case.answer, LENGTH)[:, None]


def published(folder: Path | None = None) -> dict[str, dict[str, float]]:
    """Return the errors that the authors recorded: method -> board -> mean angle [deg] on held-out pushes after a fit
    to 30 others.

    Means over 15 random splits of each layout on feet, so not over the pushes that are the test here.
    """
    numbers = ["n_train", "mean_deg", "n_splits"]
    table = read_table(
        "published", numbers, ["config", "tested_on", "method"], folder=folder
    )
    wanted = (
        (table["tested_on"] == "measured_holdout")
        & (table["n_train"] == 30)
        & (table["n_splits"] == 15)
    )
    found: dict[str, dict[str, float]] = {}
    for method, words in THEIRS.items():
        rows = table[
            wanted
            & (table["method"] == method)
            & ~table["config"].str.endswith("patch")
        ]
        means = rows.groupby(rows["config"].str.split("_").str[0])["mean_deg"].mean()
        boards = {"hardboard_deg": "hard", "plywood_deg": "wood"}
        found[words] = {
            key: float(means[board]) for key, board in boards.items() if board in means
        }
    return found
