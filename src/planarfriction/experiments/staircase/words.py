"""What the staircase shows, in words, and its table of errors."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.experiments.experiment import Table


def findings(numbers: dict[str, Any]) -> list[str]:
    """What was done and what it shows, from the numbers of this run."""
    sample_time, thinned = numbers["sample_time"], numbers["published_vertices_around_a_step"]
    radius, steps, edge = numbers["radius"], numbers["steps"], numbers["edge"]
    shifts = numbers["miss_if_labels_mean_the_state"]
    by_cells = numbers["error_against_the_rod"]
    few, *_, many = by_cells
    order = {name: _orders(by_cells, name) for name in ("plain", "bilinear")}
    by_cells = by_cells["21"]
    plain, smooth = by_cells["plain"], by_cells["bilinear"]
    kink = numbers["kink_of_tau"]
    lost = {name: 1.0 - radius[name] / radius["rod"] for name in ("plain", "bilinear")}
    return [
        f"A line of 21 cells slides in steady state (mu_c = mu_s = 1, sigma_2 = 0) along the published velocity "
        f"profile, here sampled every {sample_time:.0e} s as in the figure. If a label means the state at that time, "
        f"the plain forces miss the published vertices by at most {shifts['at']:.0e} N; if it means the state one "
        f"sample later, by {shifts['after']:.0e} N, one sample before, by {shifts['before']:.0e} N. The first is so "
        f"(in the velocity-driven runs it is the second). The figure was thinned: around each step it keeps the last "
        f"sample before and one {thinned:.4f} s later, so the drawn steps look inclined. Its vertices are samples "
        f"nevertheless, and only they are compared. The velocity was taken as that of the geometric centre; the "
        f"figure cannot tell it from the centre of pressure, which is the same point of this line.",
        f"Each time the centre of rotation meets a cell, that cell's velocity turns round, and fx steps by up to "
        f"{steps['largest']:.4f} N of 1 N; {steps['on the way up']} steps while vx grows, as many on the way back. "
        f"The torque steps at the same times. Only motion across the line shows them: once the centre of rotation is "
        f"off the line, no cell is ever at it.",
        f"The bilinear smoothing joins the steps into straight pieces, at a price. The torque of a pure spin falls "
        f"to {radius['bilinear'] * 1e3:.4f} N mm, {lost['bilinear']:.2%} below the rod's {radius['rod'] * 1e3:.4f} "
        f"(plain sum: {radius['plain'] * 1e3:.4f}, {lost['plain']:.2%} below), for spins about the four corners of "
        f"the middle cell stand in for the spin about its centre. At the borders of the cells the slope of the "
        f"torque breaks, by up to {kink['bilinear'] * 1e3:.2f} N mm/s (the rod's changes by {kink['rod'] * 1e3:.4f} "
        f"between the same samples). And the smoothing is not continuous everywhere: it ends with the grid, and fx "
        f"jumps by {edge['high']['jump']:.4f} N at {edge['high']['time']:.4f} s, where the centre of rotation "
        f"crosses the high edge, fy by {edge['low']['jump']:.4f} N at {edge['low']['time']:.4f} s, one cell beyond "
        f"the low edge: the index of the cell is truncated toward zero.",
        f"A rod has a closed form and no steps. Against it the plain sum is off by up to {plain[0]:.4f} N and "
        f"{plain[2] * 1e3:.4f} N mm (mean {plain[1]:.4f} N, {plain[3] * 1e3:.4f} N mm), the smoothed one by up to "
        f"{smooth[0]:.4f} N and {smooth[2] * 1e3:.4f} N mm (mean {smooth[1]:.4f} N, {smooth[3] * 1e3:.4f} N mm). "
        f"From {few} to {many} cells the largest error in force falls as the number of cells to the power "
        f"{order['plain'][0]:.2f} (plain) and {order['bilinear'][0]:.2f} (smoothed), the mean one to the power "
        f"{order['plain'][1]:.2f} and {order['bilinear'][1]:.2f}: the smoothing pays on average, but what jumps at "
        f"the edge of its grid shrinks no faster than the steps did.",
    ]


def _orders(by_cells: dict[str, dict[str, list[float]]], name: str) -> list[float]:
    """Powers of the number of cells with which the largest and the mean error in force fall [-]."""
    few, *_, many = by_cells
    ratio = np.log(np.array(by_cells[few][name]) / by_cells[many][name]) / np.log(int(few) / int(many))
    return ratio[:2].tolist()


def error_table(errors: dict[int, dict[str, list[float]]]) -> Table:
    """Largest and mean errors of both sums against the rod, by the number of cells."""
    headings = ("cells, sum", "force, max [N]", "force, mean [N]", "torque, max [N mm]", "torque, mean [N mm]")
    rows = [
        (f"{count}, {name}", *values[:2], *(1e3 * value for value in values[2:]))
        for count, error in errors.items()
        for name, values in error.items()
    ]
    return Table("Distance from the exact rod along the profile", headings, rows)
