"""What the velocity-driven experiment says of its numbers."""

from __future__ import annotations

from typing import Any

from planarfriction.experiments import runs
from planarfriction.experiments.experiment import Table


def findings(numbers: dict[str, Any]) -> list[str]:
    """Paragraphs from the numbers of this run."""
    return [_setting(numbers), _table_against_ellipsoid(numbers), _maxima(numbers), _published(numbers)]


def error_table(numbers: dict[str, Any]) -> Table:
    """Errors of both reduced models against the distributed one."""
    rows = []
    for shape, quantities in numbers["errors"].items():
        for model, words in (("corrected", "table"), ("ellipsoid", "ellipsoid")):
            force, torque = quantities["ft"][model], quantities["tau"][model]
            row: list[str | float] = [f"{runs.IN_WORDS[shape]}, {words}"]
            row += [float(f"{1e3 * force[column]:.4g}") for column in _SHOWN]
            row += [float(f"{1e3 * torque[column]:.4g}") for column in _SHOWN]
            rows.append(row)
    headings = ["shape, model"] + [f"force, {column} [mN]" for column in _SHOWN]
    headings += [f"torque, {column} [N mm]" for column in _SHOWN]
    return Table("Errors against the distributed model, at 1 N", headings, rows)


_SHOWN = ("median", "third quartile", "whisker high", "maximum")


def _setting(numbers: dict[str, Any]) -> str:
    shapes = "; ".join(runs.IN_WORDS[shape] for shape in numbers["errors"])
    return (
        f"Each patch ({shapes}), 20 mm wide and pressed with 1 N, is moved through the same velocity profile three "
        "times: with bristles on all cells of the grid, with the three bristles of the reduced model and the published "
        "table of its limit surface, and with the ellipsoid in the table's place. Wrenches are about the centre of "
        "pressure."
    )


def _table_against_ellipsoid(numbers: dict[str, Any]) -> str:
    factors, parts = [], []
    for shape, quantities in numbers["errors"].items():
        table, ellipsoid = (quantities["ft"][model]["third quartile"] for model in ("corrected", "ellipsoid"))
        factors.append(ellipsoid / table)
        parts.append(f"{runs.IN_WORDS[shape]} {1e3 * table:.2g} and {1e3 * ellipsoid:.3g} mN")
    return (
        f"By the third quartile of the error of the force, the table is {min(factors):.0f} to {max(factors):.0f} times "
        f"closer to the distributed model than the ellipsoid is; with table and ellipsoid: {'; '.join(parts)}. The "
        "ellipsoid is right in pure sliding and, for a symmetric patch, in pure spin; it fails in between."
    )


def _maxima(numbers: dict[str, Any]) -> str:
    shape, box = max(
        ((shape, quantities["ft"]["corrected"]) for shape, quantities in numbers["errors"].items()),
        key=lambda item: item[1]["maximum"] / item[1]["whisker high"],
    )
    most = max(
        box["samples above the whisker"]
        for quantities in numbers["errors"].values()
        for models in quantities.values()
        for box in models.values()
    )
    centre = box["centre of rotation at maximum"]
    where = ""
    if centre is not None:
        from_pressure, from_cell = centre["from the centre of pressure"], centre["from the nearest cell"]
        where = (
            f", where the centre of rotation is {1e3 * from_pressure:.2g} mm from the centre of pressure and "
            f"{1e3 * from_cell:.2g} mm from the middle of a loaded cell"
        )
    return (
        "The published box plots hide what lies above the whiskers, and there the largest errors are. Of the force of "
        f"the {runs.IN_WORDS[shape]} the whisker ends at {1e3 * box['whisker high']:.2g} mN and the table's largest "
        f"error is {1e3 * box['maximum']:.3g} mN, at {box['time of maximum']:.2f} s{where}. Up to {most} of the "
        f"{numbers['samples']} samples of a run lie above their whisker."
    )


def _published(numbers: dict[str, Any]) -> str:
    guard, misses = numbers["guard"], numbers["misses_of_other_conventions"]
    convention, *others = misses
    return (
        "The published quartiles are those of the 500 samples after t = 0 with linear interpolation: the table model's "
        f"force quartiles then differ from those of converged solutions by {misses[convention]:.1g} N at most, with "
        f"other conventions by {min(misses[name] for name in others):.1g} N or more. The published "
        "ellipsoid has the contact radius of the smoothed table, and a surplus of friction that its equations do not "
        f"have: {guard['surplus']:.4g} N at 1 N in a steady slide, which {guard['length']:.0e} m added to |z| in the "
        "angle between bristle and velocity explains. Apart from that, published and our curves differ by the error of "
        f"the figures' solver, which is largest in the spin-up ({1e3 * numbers['spin_up_error_of_the_figures']:.2g} "
        "N mm for the disc)."
    )
