"""What the limit surfaces show, in words, and their tables."""

from __future__ import annotations

from typing import Any

from planarfriction.experiments import facts
from planarfriction.experiments.experiment import Table
from planarfriction.experiments.runs import IN_WORDS

Numbers = dict[str, Any]

OVERVIEW = (
    "Limit surfaces of the six patches, summed over their cells, in the coordinates (fx, fy, tau/r) about the "
    "centre of pressure for mu f_N = 1; lines: the ellipsoid, in these coordinates the unit sphere."
)
CORRESPONDENCE = (
    "Sections of both surfaces through the torque axis. The curves are close; the points that belong to the same "
    "twist, marked at equal angles of the twist and joined, are not. Sections of the T are projections: its points "
    "leave the plane a little."
)
GRADIENT = (
    "The line with linear pressure. Left: its load. Middle: force of unit spins over the centre of rotation. Right: "
    "the end of the section where the torque is largest; the same spin on both surfaces is joined. The torque "
    "without force (star) lies on the flat facet whose twist is the spin about the middle of the load."
)


def findings(numbers: Numbers) -> list[str]:
    """What was done and what it shows, from the numbers of this run."""
    return [
        _where_wrong(numbers["ellipsoid"]),
        _gradient(numbers["gradient"]),
        _disc(numbers["disc"], numbers["patches"]["Circle"]),
        _stored(numbers["tables"]),
    ]


def _where_wrong(errors: dict[str, Numbers]) -> str:
    ratio = {name: each["points, mean"] / each["surfaces, mean"] for name, each in errors.items()}
    least, most = min(ratio, key=lambda key: ratio[key]), max(ratio, key=lambda key: ratio[key])
    worst = max(errors, key=lambda key: errors[key]["points, max"])
    each = errors[worst]
    surfaces = [row["surfaces, mean"] for row in errors.values()]
    points = [row["points, mean"] for row in errors.values()]
    return (
        f"As surfaces, the six limit surfaces and their ellipsoids are close: {min(surfaces):.3f} to "
        f"{max(surfaces):.3f} apart in the mean over all directions of the twist, where 1 is the largest force. But "
        f"the point that belongs to a given twist is elsewhere on the ellipsoid: {min(points):.3f} to "
        f"{max(points):.3f} away in the mean, {ratio[least]:.1f} ({IN_WORDS[least]}) to {ratio[most]:.1f} times "
        f"({IN_WORDS[most]}) the distance of the surfaces. The ellipsoid's error is mainly one of which velocity "
        f"maps to which point. The worst, {IN_WORDS[worst]}: {each['points, max']:.3f} between corresponding points, "
        f"{each['angle, max [deg]']:.0f} deg seen from the middle, where the surfaces are at most "
        f"{each['surfaces, max']:.3f} apart."
    )


def _gradient(numbers: Numbers) -> str:
    cells, beside, ideal = numbers["cells"], numbers["ellipsoid"], numbers["continuous"]
    offset = {
        key: 1e3 * (each["equal halves"] - each["centre of pressure"])
        for key, each in (("cells", cells), ("ideal", ideal))
    }
    return (
        f"On the gradient line a counter-clockwise spin about the centre of pressure is not free of force: more of "
        f"the load lies on its heavy side, and {cells['force']:.4f} N of 1 N push along x (continuous gradient: "
        f"{ideal['force']:.4f} N). The force vanishes for the spin whose centre splits the load into equal halves, "
        f"{offset['ideal']:.3f} mm nearer to the heavy end for a continuous gradient (at L/sqrt(2) from the light "
        f"end; centre of pressure at 2L/3), {offset['cells']:.3f} mm for the 21 weights, where it is the cell that "
        f"holds the middle of the load. The sum gives {cells['force at equal halves']:.4f} N there, with that cell "
        f"at rest: its own share of friction can balance the rest, the wrench lies in a flat facet of the surface. "
        f"The ellipsoid says {beside['force at equal halves']:.4f} N for that spin, and no force for the spin about "
        f"the centre of pressure. The torque without force is {1e3 * cells['torque']:.4f} N mm, less than the "
        f"{1e3 * cells['radius']:.4f} N mm that the ellipsoid takes from the spin about the centre of pressure."
    )


def _disc(disc: Numbers, mask: Numbers) -> str:
    radius, true = mask["contact radius, plain sum [m]"], 2.0 * disc["radius"] / 3.0
    second, cut = mask["second moment [m^2]"], disc["contact radius on the grid"]
    return (
        f"The published disc is a mask of {mask['loaded cells']} cells, those within "
        f"{disc['half width in cells'] - 0.5:.0f} cells of the middle one: the area of a disc of "
        f"{disc['equal-area radius in cells']:.2f} cells, not of the {disc['half width in cells']:.1f} that its "
        f"width suggests. A true disc has r = 2/3 R and <rho^2> = R^2/2. With the radius of equal area, "
        f"{1e3 * disc['equal-area radius']:.3f} mm, that is {2e3 * disc['equal-area radius'] / 3.0:.4f} mm, and the "
        f"mask has {1e3 * radius:.4f} mm; beside a disc of {1e3 * disc['radius']:.0f} mm its r is "
        f"{1.0 - radius / true:.1%} and its <rho^2> {1.0 - second / (0.5 * disc['radius'] ** 2):.1%} too small. "
        f"Cells cut by the rim, on the same grid, give {1e3 * cut:.4f} mm, {abs(1.0 - cut / true):.2%} off. The "
        f"published table of patches has the numbers of the mask."
    )


def _stored(tables: dict[str, Numbers]) -> str:
    def ratios(kind: str, quantity: str) -> str:
        values = [each[kind][quantity] / each["smooth"][quantity] for each in tables.values()]
        return f"{min(values):.0f} to {max(values):.0f}"

    names = ("published", "smooth", "sum over cells")
    worst = {kind: max(each[kind]["force, max [N]"] for each in tables.values()) for kind in names}
    return (
        "Both tables have 20 segments a quadrant. Beside the exact surface of the patch (cells are rectangles, on "
        "lines segments, of uniform pressure), the published one (bilinear between smoothed sums) errs "
        f"{ratios('published', 'force, mean [N]')} times as much as the smooth one (a potential through nodes on the "
        f"exact surface) in the mean force, {ratios('published', 'torque, mean [N m]')} times in the mean torque; the "
        f"sum over the cells {ratios('sum over cells', 'force, mean [N]')} and "
        f"{ratios('sum over cells', 'torque, mean [N m]')} times. The largest errors of the force are "
        f"{worst['published']:.3f} N (published), {worst['smooth']:.3f} N (smooth) and {worst['sum over cells']:.3f} N "
        "(sum, where a spin turns the patch about one of its cells)."
    )


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
            (name, *(round(factor * row[column], 9) + 0.0 for column, (_, factor) in shown.items()), 1e3 * miss)
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
        "In (fx, fy, tau/r) for mu f_N = 1. Surfaces: nearest points. Points: those of the same twist.",
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
