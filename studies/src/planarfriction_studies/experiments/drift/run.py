"""Drift: a disc under a load that friction holds, with plain and with elasto-plastic bristles."""

from __future__ import annotations

import dataclasses
from functools import partial
from typing import Any, Literal

import numpy as np

from planarfriction.pads import Pad
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.plots.style import LINE_STYLES, PlotFigure
from planarfriction.scenes import Signal
from planarfriction.scenes.ready import GRAVITY, drift, drift_force
from planarfriction_studies.experiments import experiment, facts, looks, runs
from planarfriction_studies.experiments.experiment import (
    POSE,
    WRENCH,
    Arrays,
    Comparison,
    Result,
    Work,
    compare,
    entry,
)
from planarfriction_studies.experiments.runs import NAMES
from planarfriction_studies.experiments.wording import report

WIDTH = 0.05
"""Width of the patch [m]; the article says radius."""

FORCE, TORQUE, GREATEST_TORQUE = 1.0, 0.03, 0.04
"""Mean of the applied force [N] and torque [N m], and the largest torque [N m], which 3.75 s is a sample of."""

Load = Literal["tangential", "normal"]

MODELS: dict[Load, tuple[str, ...]] = {
    "tangential": ("d", "d_ep", "r", "r_ep"),
    "normal": ("d", "d_ep", "r", "r_ep", "e_ep"),
}
"""Load -> models that are run, each with the ending of its law."""

LAWS = {
    "": (runs.PLAIN, "plain", LINE_STYLES[1]),
    "_ep": (runs.LAW, "elasto-plastic", "-"),
}
"""Ending of the names of curves -> friction law, words, and style of lines."""

WORDS = {
    kind + law: f"{NAMES[kind]}, {LAWS[law][1]}" for kind in "dre" for law in LAWS
} | {"straight": "reduced, straight ramp"}
"""Model in the names of curves -> words."""

PERIOD = 1.0 / 3.0
"""Period of the oscillating load [s]."""

WINDOWS: dict[str, tuple[Load, float, float]] = {
    "force": ("tangential", 1.67, 2.67),
    "force and torque": ("tangential", 4.0, 5.0),
    "normal force": ("normal", 4.0, 5.0),
}
"""Oscillating load -> kind of load, start and end [s] of three whole periods over which drift is measured."""

QUICK, TIGHT = (1e-6, 3e-6, 2e-4), (1e-8, 3e-8, 5e-6)
"""Tolerances `rtol`, `atol`, and the error that they leave in 5 s as a share of a curve's span: drift adds up."""

AT = 100
"""The last sample before the normal force begins to oscillate."""

Runs = dict[tuple[str, str], Arrays]
"""Load, model ("d", "r", "e", with the ending of its law) -> columns of the run [SI]."""


def run(work: Work) -> Result:
    """Carry out the experiment."""
    rtol, atol, share = QUICK if work.quick else TIGHT
    moves = {
        (load, model): partial(_move, load, model, rtol, atol)
        for load, each in MODELS.items()
        for model in each
    }
    found = work.pieces(moves, lambda key: f"drift, {', '.join(key)}")
    straight = work.piece("drift, straight ramp", lambda: _straight_ramp(rtol, atol))
    fixed = work.piece("drift, fixed stiffness", lambda: _fixed_stiffness(rtol, atol))
    numbers = _numbers(found, straight)
    numbers["swing"] = _swings({"grows": found["normal", "d_ep"], "fixed": fixed})
    creep = numbers["creep"]
    grown = creep["normal force"]
    moved = {
        f"{what}; {WORDS[model]}": each
        for what, models in creep.items()
        for model, each in models.items()
    }
    columns = {
        "x [nm]": entry("x", scale=1e9, digits=4),
        "theta [µrad]": entry("theta", scale=1e6, digits=4),
    }
    return report(
        "drift",
        {
            "drift_tangential": _motion("tangential", found),
            "drift_normal": _motion("normal", found),
            "drift_plateaus": _plateaus(
                found, straight, numbers["plateaus"]["closed form"]
            ),
        },
        numbers | {"rtol": rtol, "atol": atol},
        {
            "still": {
                name: max(abs(each["d_ep"][name]) for each in creep.values())
                for name in ("x", "theta")
            },
            "share": max(
                abs(grown["r_ep"][name] / grown["r"][name]) for name in ("x", "theta")
            ),
        },
        comparisons=[
            *experiment.compare_profile(
                drift_force("tangential"),
                "drift/applied",
                WRENCH,
                _READING,
                before="applied ",
            ),
            *_motion_comparisons(found, share),
            *_plateau_comparisons(numbers["plateaus"]),
            *_creep_comparisons(found, creep, share),
            compare(
                _WIDTH,
                WIDTH,
                numbers["implied width"],
                "published",
                1e-5 * WIDTH,
                "m",
                _RADIUS,
            ),
        ],
        tables=(
            experiment.table(
                "Drift per period of 1/3 s", moved, columns, "what oscillates; model"
            ),
        ),
        data={load: _dataset(load, found) for load in MODELS},
    )


def _move(load: Load, model: str, rtol: float, atol: float) -> Arrays:
    """Simulate one run of the disc, given by its load and by its model with the ending of its law."""
    kind: Any = model[0]
    scene = drift(
        runs.published_model(kind, "Circle", LAWS[model[1:]][0], width=WIDTH), load=load
    )
    return runs.simulated(scene, rtol=rtol, atol=atol)


def _fixed_stiffness(rtol: float, atol: float) -> Arrays:
    """Simulate the distributed model under the normal load, with the stiffness that it has under the weight."""
    model = runs.published_model("d", "Circle", runs.LAW, width=WIDTH)
    pad = Pad.at_load(GRAVITY)
    return runs.simulated(
        drift(dataclasses.replace(model, pad=pad), load="normal"),
        rtol=rtol,
        atol=atol,
    )


def _swings(moved: dict[str, Arrays]) -> dict[str, dict[str, float]]:
    """Return the ranges of x [m] and theta [rad] over three periods of the normal force."""
    _, start, end = WINDOWS["normal force"]
    ranges = {}
    for name, each in moved.items():
        inside = (each["time"] >= start) & (each["time"] <= end)
        ranges[name] = {
            axis: float(np.ptp(each[axis][inside])) for axis in ("x", "theta")
        }
    return ranges


def _straight_ramp(rtol: float, atol: float) -> Arrays:
    """Simulate the reduced model under force and torque that rise in proportion, slowly beside its vibrations."""
    scene = drift(
        runs.published_model("r", "Circle", width=WIDTH), load="normal", t_end=1.0
    )
    ramp = Signal.sampled([0.0, 0.8], [[0.0, 0.0, 0.0], [FORCE, 0.0, TORQUE]], "linear")
    return runs.simulated(dataclasses.replace(scene, force=ramp), rtol=rtol, atol=atol)


def _numbers(found: Runs, straight: Arrays) -> dict[str, Any]:
    """Compute every number of the experiment except its comparisons."""
    ramps = {model: found["normal", model] for model in ("d_ep", "r_ep", "e_ep")} | {
        "straight": straight
    }
    plateaus = {
        "measured": {
            model: {name: float(run[name][AT]) for name in ("x", "theta")}
            for model, run in ramps.items()
        },
        "closed form": _closed_forms(),
        "in the tangential run": {
            model: float(found["tangential", model]["x"][AT])
            for model in ("d_ep", "r_ep")
        },
    }
    return {
        "plateaus": plateaus,
        "creep": {
            what: {
                model: _creep(found[load, model], start, end) for model in MODELS[load]
            }
            for what, (load, start, end) in WINDOWS.items()
        },
        "patch": _patch_numbers(),
        "implied width": _implied_width(),
        "sideways": max(float(np.abs(run["y"]).max()) for run in found.values()),
    }


def _patch_numbers() -> dict[str, float]:
    patch = PUBLISHED_PATCHES["Circle"](width=WIDTH)
    return {
        "second moment": float(patch.second_moment()),
        "contact radius of the table": runs.published_model(
            "r", patch
        ).surface.contact_radius,
        "contact radius of the ellipsoid": runs.published_model(
            "e", patch
        ).surface.contact_radius,
    }


def _closed_forms() -> dict[str, dict[str, float]]:
    """Return deflections `x` [m], `theta` [rad] under both loads, bristles elastic, where the path does not matter.

    The table's: along a straight path of the load the velocity keeps the direction whose h is parallel to the load.
    """
    numbers = _patch_numbers()
    stiffness = runs.LAW.sigma_0 * GRAVITY
    x = FORCE / stiffness
    surface = runs.published_model("r", "Circle", width=WIDTH).surface
    # Of unit dissipation, against a balancing friction.
    twist = surface.twist(np.array([-FORCE, 0.0, -TORQUE]))
    scaled = twist * [1.0, 1.0, surface.contact_radius]
    duration = x / (-surface.wrench(twist)[0] * np.linalg.norm(scaled))  # z = h |V_S| t
    return {
        "d_ep": {"x": x, "theta": TORQUE / (stiffness * numbers["second moment"])},
        "e_ep": {
            "x": x,
            "theta": TORQUE
            / (stiffness * numbers["contact radius of the ellipsoid"] ** 2),
        },
        "straight": {
            "x": float(twist[0] * duration),
            "theta": float(twist[2] * duration),
        },
    }


def _creep(run: Arrays, start: float, end: float) -> dict[str, float]:
    """Return the motion per period of the load from `start` to `end` [s]: x [m], theta [rad]."""
    first, last = (int(np.abs(run["time"] - time).argmin()) for time in (start, end))
    return {
        name: float(run[name][last] - run[name][first]) / round((end - start) / PERIOD)
        for name in ("x", "theta")
    }


def _implied_width() -> float:
    """Return the width of the patch that the published angle at the largest torque implies [m], bristles elastic."""
    curve = facts.published_curve("drift/d_ep/theta")
    moment = GREATEST_TORQUE / (runs.LAW.sigma_0 * GRAVITY * curve.values.max())
    return WIDTH * float(np.sqrt(moment / _patch_numbers()["second moment"]))


def _dataset(load: Load, found: Runs) -> Any:
    time, normal_force = (found[load, "d"][name] for name in ("time", "normal_force"))
    labelled = {
        (NAMES[kind], LAWS[law][1]): found[load, kind + law]
        for kind in "dr"
        for law in LAWS
    }
    applied = {f"applied_{name}": unit for name, unit in WRENCH.items()}
    alone = experiment.with_units(drift_force(load).left(time), applied) | {
        "normal_force": (normal_force, "N")
    }
    return experiment.dataset(
        labelled, POSE, ("model", "bristles"), ("time", time, "s"), alone
    )


_READING = "The same load, labelled with its own time: what is left is the error of reading the figure."
_TWICE = "The same equations, solved twice: what is left is the error of our solver, which drift adds up."
_WIDTH = "width of the patch that the published angle implies"
_RADIUS = (
    r"$\theta = \tau/(\sigma_0 f_N \langle\rho^2\rangle)$ at the largest torque: the patch of the figures is "
    "0.05 m wide, where the article gives 0.05 m as its radius."
)
_SPRING, _LEFT = r"$x = F/(\sigma_0 f_N)$", "what is left is our solver's error."


def _motion_comparisons(found: Runs, share: float) -> list[Comparison]:
    """Compare the motion with published and converged curves, and the path of a disc that turns on a fixed patch."""
    from scipy.integrate import cumulative_trapezoid

    solver = "The figure's solver, and ours, each by its tolerance: it is as far from the converged solution."
    sideways = (
        "Our patch is fixed to the table and the disc's centre moves over it, so that its bristles hold "
        r"$y = \int x\,\mathrm{d}\theta$; in the reference the patch goes with the centre and y is zero."
    )
    sampled = r"The integral is taken over samples 0.01 s apart, between which $x$ and $\theta$ oscillate."
    rows = []
    paths = []
    for (load, model), run in found.items():
        path = cumulative_trapezoid(run["x"], run["theta"], initial=0.0)
        words = f"{load} load, {WORDS[model]}, y beside int x dtheta"
        tolerance = 0.1 * float(np.abs(path).max())
        paths.append(
            compare(words, run["y"], path, "closed form", tolerance, "m", sampled)
        )
        for name in POSE if load == "tangential" else ():
            words = f"tangential load, {WORDS[model]}, {name}"
            reference = f"drift/{model}/{name}"
            far = float(np.abs(run["x"]).max() * np.abs(run["theta"]).max())
            allowance = far if name == "y" else share * float(np.ptp(run[name]))
            for compared, cause in (
                (experiment.compare_curve, solver),
                (experiment.compare_converged, _TWICE),
            ):
                cause = sideways if name == "y" else cause
                rows.append(
                    compared(words, run["time"], run[name], reference, allowance, cause)
                )
    return rows + paths


def _plateau_comparisons(plateaus: dict[str, Any]) -> list[Comparison]:
    rows = []
    closed_forms = {
        "d_ep": (
            1e-6,
            rf"{_SPRING}, $\theta = \tau/(\sigma_0 f_N \langle\rho^2\rangle)$: {_LEFT}",
        ),
        "e_ep": (1e-5, rf"{_SPRING}, $\theta = \tau/(\sigma_0 f_N r^2)$: {_LEFT}"),
        "straight": (
            5e-4,
            "The deflection along the twist with $h$ parallel to the load: what is left is the disc's mass.",
        ),
    }
    for model, (share, cause) in closed_forms.items():
        for name, value in plateaus["closed form"][model].items():
            words = f"deflection at 1 s under force and torque, {WORDS[model]}, {name}"
            ours = plateaus["measured"][model][name]
            rows.append(
                compare(
                    words, ours, value, "closed form", share * value, POSE[name], cause
                )
            )
    spring = plateaus["closed form"]["d_ep"]["x"]
    for model, x in plateaus["in the tangential run"].items():
        words = f"deflection at 1 s under force alone, {WORDS[model]}, x"
        rows.append(
            compare(
                words,
                x,
                spring,
                "closed form",
                1e-6 * x,
                "m",
                f"{_SPRING} with every model: {_LEFT}",
            )
        )
    return rows


def _creep_comparisons(
    found: Runs, creep: dict[str, Any], share: float
) -> list[Comparison]:
    """Compare the drift per period: that of plain bristles with converged solutions, none with elasto-plastic ones."""
    no_drift = "Below the breakaway deflection elasto-plastic bristles are springs: what is left is our solver's error."
    rows = []
    for what, (load, *window) in WINDOWS.items():
        for model, moved in creep[what].items():
            # Creeps a little: the table's own doing, see the findings.
            if (what, model) == (
                "normal force",
                "r_ep",
            ):
                continue
            for name, ours in moved.items():
                # Nothing turns the disc before 2.8 s.
                if (what, name) == (
                    "force",
                    "theta",
                ):
                    continue
                words = f"drift per period, {what}, {WORDS[model]}, {name}"
                tolerance = share * float(np.ptp(found[load, model][name]))
                if model.endswith("_ep"):
                    rows.append(
                        compare(
                            words,
                            ours,
                            0.0,
                            "closed form",
                            tolerance,
                            POSE[name],
                            no_drift,
                        )
                    )
                elif load == "tangential":
                    theirs = _creep(facts.converged(f"drift/{model}"), *window)[name]
                    rows.append(
                        compare(
                            words,
                            ours,
                            theirs,
                            "converged",
                            tolerance,
                            POSE[name],
                            _TWICE,
                        )
                    )
    return rows


_ROWS = (("x", "$x$ [nm]", 1e9), ("theta", "$\\theta$ [µrad]", 1e6))
_DOTS: dict[str, Any] = {"ms": 2.4, "mew": 0.6}
_FORCE, _OTHER = "0.15", "0.55"
"""Colours of the applied force, and of the torque or the normal force."""


def _motion(load: Load, found: Runs) -> PlotFigure:
    """Draw the applied load, x [nm] and theta [µrad] over time: left the distributed model, right the reduced one."""
    figure, panels = looks.panels(9.6, 7.0, 3, 2, sharex=True, sharey="row")
    key: list[Any] = []
    for column, kind in enumerate("dr"):
        _draw_load(panels[0, column], load, found[load, kind], last=column == 1)
        panels[0, column].set_title(NAMES[kind], fontsize="medium")
        colour = looks.OF_MODEL[kind]
        for axes, (name, label, factor) in zip(panels[1:, column], _ROWS, strict=True):
            for law, (_, words, line) in LAWS.items():
                run = found[load, kind + law]
                axes.plot(
                    run["time"],
                    factor * run[name],
                    color=colour,
                    ls=line,
                    lw=1.3,
                    label=words,
                )
                if load == "tangential":
                    looks.vertices(
                        axes, f"drift/{kind}{law}/{name}", factor, colour, **_DOTS
                    )
            if column == 0:
                axes.set_ylabel(label)
        panels[-1, column].set(xlabel="time [s]", xlim=(0.0, 5.0))
        key += [
            looks.line_key(WORDS[kind + law], color=colour, ls=each[2], lw=1.4)
            for law, each in LAWS.items()
        ]
    figure.align_ylabels(panels[:, 0])
    key.append(looks.line_key("applied $f_x$", color=_FORCE, lw=1.4))
    key.append(
        looks.line_key(
            "applied $\\tau$" if load == "tangential" else "normal force",
            color=_OTHER,
            lw=1.4,
        )
    )
    if load == "tangential":
        key.append(
            looks.line_key("published", ls="", marker="o", ms=3, mfc="white", mec="0.3")
        )
    looks.legend(figure, key, 4, fontsize=9)
    return figure


def _draw_load(axes: Any, load: Load, run: Arrays, *, last: bool) -> None:
    """Draw the applied force [N] and torque [N mm], or under the normal load force and normal force."""
    time = np.arange(0.0, 5.0, 0.001)
    applied = drift_force(load)(time)
    axes.plot(time, applied[:, 0], color=_FORCE, lw=1.0)
    other = axes.twinx()
    if load == "tangential":
        other.plot(time, 1e3 * applied[:, 2], color=_OTHER, lw=1.0)
        for each, name, factor, colour in (
            (axes, "fx", 1.0, _FORCE),
            (other, "tau", 1e3, _OTHER),
        ):
            looks.vertices(
                each,
                f"drift/applied/{name}",
                factor,
                colour,
                slice(None, None, 4),
                **_DOTS,
            )
    else:
        other.plot(run["time"], run["normal_force"], color=_OTHER, lw=1.0)
    label, limit = (
        ("$\\tau$ [N mm]", 120.0) if load == "tangential" else ("$f_N$ [N]", 13.0)
    )
    other.set_ylim(0.0, limit)
    axes.set_ylim(0.0, 1.6)
    if last:
        other.set_ylabel(label)
    else:
        axes.set_ylabel("$f_x$ [N]")
        other.tick_params(labelright=False)
    other.spines["top"].set_visible(False)


def _plateaus(found: Runs, straight: Arrays, closed: dict[str, Any]) -> PlotFigure:
    """Draw deflections x [nm] and theta [µrad] in the first second of the normal-load run, elasto-plastic bristles."""
    figure, panels = looks.panels(9.6, 3.9, 1, 2)
    lines = {
        "d_ep": (looks.DISTRIBUTED, "-", 3.4, 0.5),
        "r_ep": (looks.PUBLISHED, "-", 3.4, 0.5),
        "e_ep": (looks.ELLIPSOID, LINE_STYLES[1], 1.4, 1.0),
        "straight": (looks.PUBLISHED, LINE_STYLES[3], 1.1, 1.0),
    }
    for axes, (name, label, factor) in zip(panels, _ROWS, strict=True):
        for model, (colour, line, width, opacity) in lines.items():
            run = straight if model == "straight" else found["normal", model]
            part = run["time"] <= 1.0
            look = {"color": colour, "ls": line, "lw": width, "alpha": opacity}
            axes.plot(
                run["time"][part], factor * run[name][part], label=WORDS[model], **look
            )
            if model in closed:
                axes.axhline(
                    factor * closed[model][name],
                    color=colour,
                    ls=LINE_STYLES[2],
                    lw=1.0,
                    zorder=1,
                )
        axes.set(xlabel="time [s]", ylabel=label, xlim=(0.0, 1.0), ylim=(0.0, None))
    looks.legend(figure, figure.axes[0], 4, fontsize=9)
    return figure
