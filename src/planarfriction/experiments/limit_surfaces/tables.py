"""The tables of the limit surfaces, and what their template names."""

from __future__ import annotations

from typing import Any

from planarfriction.experiments import facts
from planarfriction.experiments.experiment import Table
from planarfriction.experiments.runs import IN_WORDS
from planarfriction.experiments.wording import span

Numbers = dict[str, Any]


def told(numbers: Numbers) -> dict[str, Any]:
    """What the template names."""
    errors, stored, gradient, disc = (numbers[name] for name in ("ellipsoid", "tables", "gradient", "disc"))
    ratio = {name: each["points, mean"] / each["surfaces, mean"] for name, each in errors.items()}
    least, most = (choose(ratio, key=ratio.__getitem__) for choose in (min, max))
    worst = max(errors, key=lambda name: errors[name]["points, max"])
    mask, radius = numbers["patches"]["Circle"], disc["radius"]

    def over(kind: str, quantity: str) -> str:
        """Errors of a kind over those of the smooth table, from the best shape to the worst."""
        return span([each[kind][quantity] / each["smooth"][quantity] for each in stored.values()], ".0f")

    return {
        "surfaces": [each["surfaces, mean"] for each in errors.values()],
        "points": [each["points, mean"] for each in errors.values()],
        "least": {"shape": IN_WORDS[least], "ratio": ratio[least]},
        "most": {"shape": IN_WORDS[most], "ratio": ratio[most]},
        "worst": {"shape": IN_WORDS[worst], **errors[worst]},
        "cells": gradient["cells"],
        "ideal": gradient["continuous"],
        "ellipsoid": gradient["ellipsoid"],
        "mask": mask,
        "disc": disc,
        "radius": mask["contact radius, plain sum [m]"],
        "lost": {
            "radius": 1.0 - 1.5 * mask["contact radius, plain sum [m]"] / radius,
            "second": 1.0 - 2.0 * mask["second moment [m^2]"] / radius**2,
            "cut": 1.0 - 1.5 * disc["contact radius on the grid"] / radius,
        },
        "over": over,
        "largest": {kind: max(each[kind]["force, max [N]"] for each in stored.values()) for kind in _KINDS},
    }


_KINDS = ("published", "smooth", "sum over cells")


def tables(numbers: Numbers) -> tuple[Table, ...]:
    """The table of patches, the ellipsoid's errors, the errors of stored tables."""
    return _patches(numbers["patches"]), _ellipsoid(numbers["ellipsoid"]), _stored_table(numbers["tables"])


def _patches(ours: dict[str, Numbers]) -> Table:
    """Ours, and the largest difference from the published row in its last column."""
    published = facts.published_table("patches")
    shown = {
        "loaded cells": ("loaded cells", 1),
        "centre of pressure x [m]": ("CoP x [mm]", 1e3),
        "centre of pressure y [m]": ("CoP y [mm]", 1e3),
        "contact radius, plain sum [m]": ("r, plain sum [mm]", 1e3),
        "contact radius, as published [m]": ("r, as published [mm]", 1e3),
        "second moment [m^2]": ("second moment [mm^2]", 1e6),
    }
    lengths = [column for column in shown if column.endswith("[m]")]
    rows = []
    for name, row in ours.items():
        miss = max(abs(row[column] - published[name][column]) for column in lengths)
        rows.append(
            (
                IN_WORDS[name],
                *(round(factor * row[column], 9) + 0.0 for column, (_, factor) in shown.items()),
                1e3 * miss,
            )
        )
    headings = ("patch", *(heading for heading, _ in shown.values()), "farthest from the paper [mm]")
    note = "As published: r averages spins about the four corners of the cell that holds the centre of pressure."
    return Table("Patches: 21 x 21 cells, 20 mm wide", headings, rows, note)


def _ellipsoid(errors: dict[str, Numbers]) -> Table:
    columns = ("surfaces, mean", "surfaces, max", "points, mean", "points, max", "angle, max [deg]", "force, max [N]")
    rows = [
        (IN_WORDS[name], *(each[column] for column in columns), 1e3 * each["torque, max [N m]"])
        for name, each in errors.items()
    ]
    return Table(
        "Distance of the ellipsoid from the sum over the cells",
        ("patch", *columns, "torque, max [N mm]"),
        rows,
        "In $(f_x, f_y, \\tau/r)$ for $\\mu f_N = 1$. Surfaces: nearest points. Points: those of the same twist.",
    )


def _stored_table(errors: dict[str, Numbers]) -> Table:
    rows = []
    for name, each in errors.items():
        for kind, error in each.items():
            values = (error["force, max [N]"], error["force, mean [N]"])
            rows.append(
                (
                    f"{IN_WORDS[name]}, {kind}",
                    *values,
                    1e3 * error["torque, max [N m]"],
                    1e3 * error["torque, mean [N m]"],
                )
            )
    headings = ("patch, surface", "force, max [N]", "force, mean [N]", "torque, max [N mm]", "torque, mean [N mm]")
    return Table("Error of tables of 20 segments, and of the sum, from the exact surface, mu f_N = 1 N", headings, rows)
