"""What the convergence experiment found, in words, and what the size of the disc's mask does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from planarfriction.experiments.convergence import runs
from planarfriction.experiments.convergence.runs import Case, Errors
from planarfriction.experiments.experiment import Comparison
from planarfriction.patch import ContactPatch

RADIUS = 0.01
"""Radius of the disc [m]."""

Slopes = Mapping[str, Mapping[str, Mapping[str, float]]]
"""Family -> case -> slope of log error over log count, of force and torque."""


def key(case: Case) -> str:
    """A case in the names of the published curves."""
    return "/".join(case)


def radius_errors(counts: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Relative errors of the contact radius: of the mask from the base's mask, of the cut disc from 2 R/3."""
    base = float(runs.patch("Circle", runs.BASE_CELLS).contact_radius())
    mask = [float(runs.patch("Circle", count).contact_radius()) / base - 1.0 for count in counts]
    cut = [float(ContactPatch.disc(RADIUS, count).contact_radius()) * 1.5 / RADIUS - 1.0 for count in counts]
    return np.array(mask), np.array(cut)


def base_radius_error() -> float:
    """Relative error of the contact radius of the base's mask, from the disc that it stands for."""
    return float(runs.patch("Circle", runs.BASE_CELLS).contact_radius()) * 1.5 / RADIUS - 1.0


def findings(
    counts: Sequence[int],
    errors: Mapping[Case, Errors],
    slopes: Slopes,
    comparisons: Sequence[Comparison],
) -> list[str]:
    """Paragraphs of the report."""
    measured = [c for c in comparisons if c.unit == "of the published error" and not c.quantity.startswith("explicit")]
    euler = [c for c in comparisons if c.quantity.startswith("explicit")]
    worst = max(c.difference for c in measured)
    found = [
        f"Each patch on {counts[0]} to {counts[-1]} cells along its width, and each table of {counts[0]} to "
        f"{counts[-1]} segments, is moved with the published profile; its wrench is compared with that of the finest "
        f"grid ({runs.BASE_CELLS} x {runs.BASE_CELLS}, distributed) or of the finest table ({runs.BASE_SEGMENTS} "
        f"segments). The velocity is that of the centre of pressure of the finest grid, the wrench is about the "
        f"patch's own. All {sum(c.samples for c in measured)} published errors are met to {100 * worst:.2g} % or "
        "better.",
        "What is left is the figures' explicit Euler method with steps of 1e-5 s"
        + (
            f" and, where the base has thousands of cells, that means are taken here over samples every "
            f"{runs.COARSE_INTERVAL * 1e3:g} ms, not {runs.PUBLISHED_INTERVAL * 1e3:g} ms."
            if any("means over" in c.cause for c in measured)
            else "."
        )
        + (
            f" Run with those Euler steps, our equations meet the figures to {max(c.difference for c in euler):.1e} of "
            "each value."
            if euler
            else ""
        ),
    ]
    found.append(_line_finding(counts, errors, slopes))
    if ("Square", "p0") in errors:
        found.append(_shape_finding(counts, errors, slopes))
        found.append(_reduced_finding(counts, errors, slopes))
    return found


def _line_finding(counts: Sequence[int], errors: Mapping[Case, Errors], slopes: Slopes) -> str:
    force, slope = errors["LineGrad", "p0"]["cells_distributed"][:, 0], slopes["cells_distributed"]["LineGrad/p0"]
    through = np.array([_centre_on_cell(count) for count in counts])
    words = (
        f"The line with linear pressure converges as N^{slope['ft']:.2f} in force and N^{slope['tau']:.2f} in torque."
    )
    if through.sum() < 2 or (~through).sum() < 2:
        return words
    smooth = np.polyfit(np.log(counts)[~through], np.log(force)[~through], 1)
    excess = force[through] / np.exp(np.polyval(smooth, np.log(counts)[through]))
    listed = ", ".join(str(count) for count in np.array(counts)[through])
    return (
        f"{words} At N = {listed} the force error of the distributed model is {np.median(excess):.2g} times (median) "
        "the trend of the others: there the centre of pressure, about which the patch spins, lies in the middle of a "
        "cell, which counts wholly to one side of it though half of it lies on the other."
    )


def _centre_on_cell(count: int) -> bool:
    """Whether the centre of pressure of the line with linear pressure is the middle of one of its cells."""
    line = runs.patch("LineGrad", count)
    distance = np.abs(line.positions[:, 1] - line.centre_of_pressure()[1])
    return bool(distance.min() < 1e-6 * RADIUS)


def _shape_finding(counts: Sequence[int], errors: Mapping[Case, Errors], slopes: Slopes) -> str:
    mask, cut = radius_errors(counts)
    of = slopes["cells_distributed"]
    torque = errors["Circle", "p0"]["cells_distributed"][:, 1]
    correlation = float(np.corrcoef(np.log(np.abs(mask)), np.log(torque))[0, 1])
    return (
        f"Error of the distributed model's torque over the number of cells N, p = 0: as N^{of['Square/p0']['tau']:.2f} "
        f"for the square, N^{of['LineGrad/p0']['tau']:.2f} for the line, N^{of['Circle/p0']['tau']:.2f} for the disc. "
        "The disc is slow, and its curve wavy, because its mask of whole cells changes size with N: its torque error "
        f"is {np.median(torque / np.abs(mask)):.2f} times (median) the error of the mask's contact radius, and their "
        f"logarithms correlate to {correlation:.3f}. The base is such a mask too, {-100 * base_radius_error():.2g} % "
        "smaller in contact radius than the disc, so that the curve does not converge to the disc. With cells cut by "
        f"the rim the contact radius is off by {100 * np.abs(cut).max():.2g} % at the coarsest grid and by "
        f"{100 * np.abs(cut[-1]):.1g} % at the finest, where the mask has {100 * np.abs(mask[-1]):.2g} %."
    )


def _reduced_finding(counts: Sequence[int], errors: Mapping[Case, Errors], slopes: Slopes) -> str:
    reduced, segments = errors["Square", "p0"]["cells_reduced"][:, 0], slopes["segments"]
    distributed = errors["Square", "p0"]["cells_distributed"][:, 0]
    steepest, flattest = (
        choose(segments[key(case)]["ft"] for case in errors if case[1] == "p0") for choose in (min, max)
    )
    return (
        f"The reduced model stops improving where its own error begins: the square's force error is "
        f"{reduced[-1]:.1e} at N = {counts[-1]}, and {np.min(reduced):.1e} at best, while the distributed model falls "
        f"to {distributed[-1]:.1e}. More segments of the table reduce the force error as n^{flattest:.2f} to "
        f"n^{steepest:.2f}, not smoothly: it matters where the directions of this motion lie between the nodes."
    )
