"""Classics: stick-slip, presliding, break-away force over rate and friction lag, as in the LuGre paper."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from planarfriction.plots.style import PlotFigure
from planarfriction_studies.experiments import experiment, looks, runs
from planarfriction_studies.experiments.classics import reference, scenes
from planarfriction_studies.experiments.experiment import (
    Arrays,
    Comparison,
    Result,
    Work,
    compare,
    entry,
)
from planarfriction_studies.experiments.wording import report

RTOL, ATOL = 1e-8, 1e-7
"""Tolerances of the runs."""

RATES, FREQUENCIES = (1.0, 5.0, 10.0, 50.0), (1.0, 10.0, 25.0)
"""Rates of the force [N/s], and frequencies of the speed [rad/s]."""

PULL, LONG, SHORT = 0.1, 30.0, 10.0
"""Speed of the spring's end [m/s], and duration of stick-slip, whole and quick [s]."""

PUSH = ((0.0, 10.0, 15.0, 35.0, 40.0), (0.0, 1.425, 1.425, -1.425, -1.425))
"""Corners [s], [N] of the force of presliding."""

GAINS, GOAL, HUNTED, SETTLED = (3.0, 4.0, 6.0), 1.0, 100.0, 30.0
"""Gains of the controller [N/m, N/(m s), N s/m], its goal [m], duration, and when numbers are taken [s]."""

_HALVED = (
    "Extrapolated from two time steps; what is left is of second order in the step."
)

_SAME = "The same equations, solved by two methods: what is left is our error, and that of samples around a maximum."


def run(work: Work) -> Result:
    """Carry out the experiment."""
    t_end = SHORT if work.quick else LONG
    every: dict[str, Any] = {
        "stick-slip": dataclasses.replace(
            scenes.stick_slip(t_end=t_end), save_every=1e-3
        ),
        "presliding": scenes.presliding(),
        **{f"break-away, {rate:g} N/s": scenes.break_away(rate=rate) for rate in RATES},
        **{
            f"lag, {frequency:g} rad/s": scenes.friction_lag(frequency=frequency)
            for frequency in FREQUENCIES
        },
    }
    found = {
        name: runs.simulated(scene, rtol=RTOL, atol=ATOL)
        for name, scene in every.items()
    }
    converged = work.pieces(
        {name: lambda name=name: _converged(name, t_end) for name in every}, str
    )
    ours = _numbers(found, -1.0, "fx")
    theirs = _numbers(converged, 1.0, "friction")
    dt = 2e-3 if work.quick else 1e-3
    coarse, fine = (
        scenes.hunting(gains=GAINS, goal=GOAL, t_end=HUNTED, dt=each)
        for each in (2.0 * dt, dt)
    )
    one = _hunting(coarse)
    other = _hunting(fine)
    ours |= {name: 2.0 * other[name] - one[name] for name in one}
    theirs |= _hunting(
        work.pieces(
            {"hunting": lambda: reference.hunting(GAINS, GOAL, HUNTED, dt)}, str
        )["hunting"]
    )
    columns = {
        "ours": entry(0, digits=6),
        "integrated without the library": entry(1, digits=6),
    }
    rows = {name: (value, theirs[name]) for name, value in ours.items()}
    return report(
        "classics",
        {"classics": _figure(found, fine)},
        {"found": ours, "converged": theirs, "end": t_end},
        comparisons=_comparisons(ours, theirs),
        tables=(
            experiment.table(
                "Numbers of the experiments, SI units", rows, columns, "number"
            ),
        ),
    )


def _converged(name: str, t_end: float) -> Arrays:
    """Integrate one of the experiments without the library."""
    kind, _, value = name.partition(", ")
    if kind == "stick-slip":
        return reference.moved((0.0, t_end), pulled=lambda t: PULL * t, k=2.0, dt=1e-3)
    if kind == "presliding":
        return reference.moved(PUSH[0], lambda t: float(np.interp(t, *PUSH)), dt=0.01)
    number = float(value.split()[0])
    if kind == "break-away":
        return reference.moved(
            (0.0, 1.8 / number), lambda t: number * t, dt=5e-4 / number
        )
    return reference.driven(
        4.0 * np.pi / number,
        lambda t: 1.5e-3 + 1e-3 * np.sin(number * t),
        1e-3 / number,
    )


def _numbers(found: dict[str, Arrays], sign: float, friction: str) -> dict[str, float]:
    """Return each number by its name, with its unit; friction is `sign` times the column `friction`."""
    slip = found["stick-slip"]
    loop = found["presliding"]
    numbers = {
        "stick-slip, x at the end [m]": slip["x"][-1],
        "stick-slip, largest speed [m/s]": slip["vx"].max(),
    }
    for time in (15.0, 40.0):
        numbers[f"presliding, x at {time:g} s [m]"] = np.interp(
            time, loop["time"], loop["x"]
        )
    for name, each in found.items():
        if name.startswith(("break-away", "lag")):
            numbers[f"{name}, largest friction [N]"] = (sign * each[friction]).max()
    return {name: float(value) for name, value in numbers.items()}


def _hunting(run: Arrays) -> dict[str, float]:
    """Return the period by all passages of the goal, and the largest error, once the first swings are over."""
    time = run["time"]
    off = run["x"] - GOAL
    rows = np.flatnonzero((off[:-1] < 0.0) != (off[1:] < 0.0))
    passed = time[rows] - off[rows] * (time[rows + 1] - time[rows]) / (
        off[rows + 1] - off[rows]
    )
    period = 2.0 * np.diff(passed[passed > SETTLED]).mean()
    return {
        "hunting, period [s]": float(period),
        f"hunting, largest error after {SETTLED:g} s [m]": float(
            np.abs(off[time >= SETTLED]).max()
        ),
    }


def _comparisons(ours: dict[str, float], theirs: dict[str, float]) -> list[Comparison]:
    """Compare every number with that of the integration without the library."""
    rows = []
    for name, value in theirs.items():
        words, unit = name.removesuffix("]").split(" [")
        share, why = (1e-3, _HALVED) if words.startswith("hunting") else (2e-6, _SAME)
        rows.append(
            compare(
                words, ours[name], value, "converged", share * abs(value), unit, why
            )
        )
    return rows


def _figure(found: dict[str, Arrays], hunted: Arrays) -> PlotFigure:
    """Draw stick-slip, the presliding loop, break-away, lag and hunting."""
    figure, ((slip, loop), (away, lag), (hunting, force)) = looks.panels(9.6, 9.4, 3, 2)
    run = found["stick-slip"]
    colour = looks.DISTRIBUTED
    slip.plot(run["time"], run["x"], color=colour, label="mass")
    slip.plot(
        run["time"], PULL * run["time"], ":", color="0.4", label="end of the spring"
    )
    slip.set(title="stick-slip", xlabel="time [s]", ylabel="$x$ [m]")
    run = found["presliding"]
    loop.plot(1e6 * run["x"], -run["fx"], color=colour)
    loop.set(title="presliding", xlabel="$x$ [µm]", ylabel="friction [N]")
    peaks = [-found[f"break-away, {rate:g} N/s"]["fx"].min() for rate in RATES]
    away.plot(RATES, peaks, "o-", color=colour)
    away.set(
        title="break-away force",
        xlabel="rate of the force [N/s]",
        ylabel="largest friction [N]",
        xscale="log",
    )
    for frequency, shade in zip(FREQUENCIES, looks.OTHERS, strict=False):
        run = found[f"lag, {frequency:g} rad/s"]
        last = run["time"] >= 0.5 * run["time"][-1]
        lag.plot(
            1e3 * run["vx"][last],
            -run["fx"][last],
            color=shade,
            label=f"{frequency:g} rad/s",
        )
    lag.set(title="friction lag", xlabel="speed [mm/s]", ylabel="friction [N]")
    hunting.plot(hunted["time"], hunted["x"], color=colour, label="mass")
    hunting.plot([0.0, HUNTED], [GOAL, GOAL], ":", color="0.4", label="goal")
    hunting.set(title="hunting", xlabel="time [s]", ylabel="$x$ [m]")
    force.plot(hunted["time"], hunted["force"], color=colour)
    force.set(title="force of the controller", xlabel="time [s]", ylabel="force [N]")
    for axes in (slip, lag, hunting):
        axes.legend(frameon=False)
    return figure
