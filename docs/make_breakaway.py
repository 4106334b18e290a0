"""Measure where models let go, how they creep, and what more discs buy: `python docs/make_breakaway.py`.

Numbers are kept in docs/breakaway.json; what is missing there is measured, and the tables of the pages (below lines
`<!-- breakaway: NAME -->`) and the picture are written from it. Delete the file to measure all again.
"""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import planarfriction as pf
from planarfriction.cli.doctor import processor
from planarfriction.derivatives import rollout, rollout_states, rollout_vjp
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.plots import style
from planarfriction_studies.bench.measurement import mixed_twists
from planarfriction_studies.experiments.beyond import cells as few

DOCS = Path(__file__).parent
KEPT, PICTURE = DOCS / "breakaway.json", DOCS / "images" / "breakaway.png"
MARK = re.compile(r"<!-- breakaway: (?P<name>.+?) -->\n\n(?:(?:\|.*\n)+\n)?")

LAW = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
LOAD = 10.0
"""Normal force [N] of the ramps and of the shaken contacts."""

DEFAULT = pf.ReducedModel.cells
COUNTS = (8, 16, DEFAULT, 32, 64, 128)
"""Numbers of discs that are compared."""


def discs(n: int) -> Callable[[pf.ContactPatch], pf.ReducedModel]:
    """Return a maker of the reduced model with n discs."""
    return lambda patch: pf.ReducedModel(patch, LAW, cells=n)


MODELS: dict[str, tuple[Callable[[pf.ContactPatch], Any], str]] = {
    "all cells": (lambda patch: pf.DistributedModel(patch, LAW), style.DISTRIBUTED),
    "64 discs": (discs(64), style.SHADES[3]),
    "default": (discs(DEFAULT), style.OF_MODEL["reduced"]),
    "8 discs": (discs(8), style.SHADES[0]),
    "published": (lambda patch: pf.ReducedModelPublished(patch, LAW), style.PUBLISHED),
}
"""Models by the words of the tables: how they are made, and their colour."""

TITLES = {"published": "3 states"}
"""Names of models on the page and in the picture, if they differ."""

PRICED: dict[str, Callable[[pf.ContactPatch], Any]] = {
    name: make for name, (make, _) in MODELS.items()
}
PRICED |= {f"{n} discs": discs(n) for n in COUNTS} | {
    "a disc a cell": lambda patch: discs(patch.cells)(patch)
}
"""Models whose steps are timed."""

INSTRUCTIONS: dict[str, dict[str, str]] = {
    "AVX2": {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": "+avx2,+fma,+avx"},
    "AVX-512": {},
}
"""Settings of Numba for each instruction set of which times are told; none: those of a processor that has it."""

TICKS = 0.2
"""Least processor time [s] of a measurement: some systems count it in steps of 10 ms."""

SEEDS = 10
"""Driven motions of each shape."""

FINER = "refined(2)"
"""Distributed model on finer cells, beside the shaken contacts."""


def _masked(rows: str, cell: float, name: str) -> pf.ContactPatch:
    """Return an even patch of the `#` in an image of rows, separated by spaces."""
    mask = np.array([[float(mark == "#") for mark in row] for row in rows.split()])
    return pf.ContactPatch.from_pressure(mask, cell_size=cell, name=name)


def _beside(x: float, y: float) -> float:
    return math.exp(-((x - 0.006) ** 2 + y**2) / (2.0 * 0.003**2))


SHAPES: dict[str, Callable[[], pf.ContactPatch]] = {
    "disc": lambda: pf.ContactPatch.disc(0.01),
    "soft fingertip": lambda: pf.ContactPatch.disc(
        0.01, pressure=pf.SoftFinger(k=2.0, c=0.009, n=0.0)
    ),
    "edge load": lambda: pf.ContactPatch.disc(0.01, pressure=_beside),
    "T": lambda: _masked(
        " ".join(["#" * 20] * 4 + ["." * 8 + "#" * 4 + "." * 8] * 16), 1e-3, "T"
    ),
    "L": lambda: _masked(
        " ".join(["#" * 4 + "." * 16] * 16 + ["#" * 20] * 4), 1e-3, "L"
    ),
    "line": lambda: pf.ContactPatch.line(0.02, 41),
    "narrow pads": lambda: _masked(
        " ".join(["##" + "." * 26 + "##"] * 10), 1e-3, "narrow pads"
    ),
    "unequal pads": lambda: _masked(
        " ".join(["#" * 6 + "." * 16 + "##"] * 2 + ["#" * 6 + "." * 18] * 4),
        1e-3,
        "pads",
    ),
}

RAMPS, TOP, SLIPPED = (0.01, 0.1, 1.0), 1.35, 1e-5
"""Times in which a load grows from zero to TOP times what the limit surface of mu_s holds [s], and displacement beyond
that of the bent bristles at which the patch counts as slipping [m]."""

LEVELS, CYCLE, LAST, T_END = (0.5, 0.65, 0.8, 0.85), 0.5, 20.0, 30.0
"""Largest load of a shaken contact as shares of that limit surface, its cycle [s], and when it is measured [s]."""

SHAKEN = ("disc", "T", "L", "line", "narrow pads")
"""Shapes that are shaken."""


def wrench_at_limit(patch: pf.ContactPatch, rng: np.random.Generator) -> np.ndarray:
    """Draw a load `[3]` about the centre of pressure on the limit surface of mu_s."""
    height = rng.uniform(-0.9, 0.9)
    angle = rng.uniform(0.0, 2.0 * np.pi)
    flat = math.sqrt(1.0 - height**2)
    centre = patch.centre_of_pressure()
    vx = flat * math.cos(angle)
    vy = flat * math.sin(angle)
    omega = height / patch.contact_radius()
    fx, fy, tau = -pf.LimitSurfaceCells(patch).wrench(
        (vx + omega * centre[1], vy - omega * centre[0], omega)
    )
    return LAW.mu_s * LOAD * np.array([fx, fy, tau - centre[0] * fy + centre[1] * fx])


def moved(
    model: Any, body: pf.Body, times: np.ndarray, wrenches: np.ndarray, **options: Any
) -> Any:
    """Simulate a body whose centre of mass is the centre of pressure under wrenches `[T, 3]`; its motion."""
    centre = model.patch.centre_of_pressure()
    contact = pf.Contact(model, LOAD, position=tuple(-centre))
    force = pf.Signal.sampled(times, wrenches, "linear")
    return pf.simulate(
        pf.Scene(body, [contact], times[-1], force=force), **options
    ).data


def load_of_slip(
    model: Any, patch: pf.ContactPatch, wrench: np.ndarray, ramp: float
) -> float:
    """Return the share of `wrench` at which the patch slips while it grows within `ramp` [s]."""
    gyration = patch.second_moment()
    body = pf.Body(0.1, 0.4 * gyration, gravity=(0.0, 0.0))
    data = moved(model, body, np.array([0.0, ramp]), np.outer([0.0, TOP], wrench),
                 rtol=1e-6, atol=1e-9, save_every=ramp / 4000)  # fmt: skip
    share = TOP * data.time.values / ramp
    bent = np.outer(share, wrench / [1.0, 1.0, gyration]) / (LAW.sigma_0 * LOAD)
    x, y, theta = (
        data[name].values - data[name].values[0] for name in ("x", "y", "theta")
    )
    off = np.hypot(x - bent[:, 0], y - bent[:, 1]) + math.sqrt(gyration) * np.abs(
        theta - bent[:, 2]
    )
    first = int(np.argmax(off > SLIPPED))
    if off[first] <= SLIPPED:
        raise ValueError(f"no slip of {patch.name} in {ramp} s")
    return float(
        np.interp(SLIPPED, off[first - 1 : first + 1], share[first - 1 : first + 1])
    )


def breakaway(shape: str) -> dict[str, list[float]]:
    """Return by model the load of slip over that of finer cells, less one, for two loads and all ramps."""
    patch = SHAPES[shape]()
    rng = np.random.default_rng([25, *shape.encode()])
    fine = patch.refined(3) if (patch.cell_extents() > 0.0).any() else patch
    models = {name: make(patch) for name, (make, _) in MODELS.items()}
    found: dict[str, list[float]] = {name: [] for name in models}
    for wrench in (wrench_at_limit(patch, rng) for _ in range(2)):
        for ramp in RAMPS:
            truth = load_of_slip(pf.DistributedModel(fine, LAW), patch, wrench, ramp)
            for name, model in models.items():
                found[name].append(
                    load_of_slip(model, patch, wrench, ramp) / truth - 1.0
                )
    return found


def two_pads(name: str) -> dict[str, float]:
    """Return the least grips of two pads over their `holding_load`, and the slip [m] at 1.02 of it."""
    patch = PUBLISHED_PATCHES["NonConvex1"]()
    centre = patch.centre_of_pressure()
    model = MODELS[name][0](patch)
    mass = 0.1
    beside = 0.025
    load = (0.0, -9.81 * mass, -9.81 * mass * (beside + centre[0]))
    slow = pf.planning.holding_load(load, patch, LAW.mu_s)
    inertia = mass * ((0.15**2 + 0.08**2) / 12.0 + (beside + centre[0]) ** 2)
    least = {
        f"{1e3 * ramp:g} ms": pf.planning.dynamic_holding_load(
            load, model, ramp=ramp, mass=mass, inertia=inertia
        )
        / slow
        for ramp in (0.0, 0.01, 0.1)
    }
    grip = pf.Signal.sampled(
        [0.0, 0.31, 0.50], np.array([1.38, 1.0, 1.38]) * 1.02 * slow
    )
    data = pf.simulate(
        pf.scenes.in_hand(
            model, centre_of_mass=(beside + centre[0], centre[1]), normal_force=grip
        )
    ).data
    return least | {
        "slip": float(np.hypot(data.x[-1] - data.x[0], data.y[-1] - data.y[0]))
    }


def driven(shape: str) -> dict[str, list[list[float]]]:
    """Return by number of discs the largest errors of force and torque and the rms of the force of each driven motion.

    In units of `mu_c f_N`, the torque times the radius of gyration.
    """
    patch = few.SHAPES[shape]()
    models = {str(n): discs(n)(patch) for n in COUNTS if n < patch.cells}
    models |= {"a disc a cell": discs(patch.cells)(patch), "all cells": pf.DistributedModel(patch, LAW),
               "published": pf.ReducedModelPublished(patch, LAW)}  # fmt: skip
    found = few.driven(patch, models, few.stopping, SEEDS)
    return {
        name: [[float(number) for number in each[:3]] for each in errors]
        for name, errors in found.items()
    }


def prices(steps: int = 20_000, rounds: int = 5) -> dict[str, dict[str, float]]:
    """Return by model its states, and the times of a rollout and of its gradient over the published model's."""
    twists = mixed_twists(steps)
    loads = np.full(steps, 2.0)
    models = {
        name: make(PUBLISHED_PATCHES["Circle"]()) for name, make in PRICED.items()
    }

    def gradient(model: Any) -> None:
        _, wrenches, states = rollout_states(model, model.rest(), twists, loads, 1e-4)
        rollout_vjp(model, model.rest(), twists, loads, 1e-4, wrenches, states=states)

    works = {
        "step": lambda model: rollout(model, model.rest(), twists, loads, 1e-4),
        "gradient": gradient,
    }
    least: dict[str, dict[str, float]] = {
        name: dict.fromkeys(works, math.inf) for name in models
    }
    # Works one after the other: memory that gradients leave behind slows steps down.
    for work, done in works.items():
        for turn in range(-1, rounds):  # the first compiles
            for name, model in models.items():
                found = _processor_time(lambda model=model: done(model))  # noqa: B023
                if turn >= 0:
                    least[name][work] = min(least[name][work], found)
    return {
        name: {"states": float(np.prod(models[name].state_shape))}
        | {work: own[work] / least["published"][work] for work in works}
        | {"ns": own["step"] / steps * 1e9}
        for name, own in least.items()
    }


def _processor_time(work: Callable[[], Any]) -> float:
    """Return the processor time of a work [s], done so often that the ticks of its clock do not count."""
    begin = time.process_time()
    count = 0
    while (taken := time.process_time() - begin) < TICKS:
        work()
        count += 1
    return taken / count


def prices_with(instructions: str) -> dict[str, dict[str, float]]:
    """Return `prices` with loops compiled for an instruction set, in a process of their own."""
    if instructions == "AVX-512" and "avx512f" not in dict(processor())["features"]:
        raise SystemExit("times of AVX-512 need a processor that has it")
    work = "import json, make_breakaway; print(json.dumps(make_breakaway.prices()))"
    done = subprocess.run(
        [sys.executable, "-c", work],
        env=os.environ
        | {"PYTHONPATH": os.pathsep.join([str(DOCS), *sys.path])}
        | INSTRUCTIONS[instructions],
        stdout=subprocess.PIPE,
        check=True,
    )
    return json.loads(done.stdout)


def shaken(shape: str, level: float) -> dict[str, float]:
    """Return by model the creep per cycle [m] over the last ten seconds of a contact that is shaken and holds."""
    patch = SHAPES[shape]()
    t = np.arange(0.0, T_END + 0.0025, 0.005)
    grown = np.minimum(t / 0.3, 1.0)
    phase = 2.0 * np.pi * t / CYCLE
    r = patch.contact_radius()
    fx = 0.43 + 0.32 * np.sin(phase)
    fy = 0.27 * np.cos(phase)
    spin = 0.27 + 0.32 * np.cos(phase + 0.6)
    wrenches = LOAD * grown[:, None] * np.stack([fx, fy, r * spin], axis=1)
    wrenches *= level / highest_level(patch, wrenches[100:300])
    makes = {name: make for name, (make, _) in MODELS.items()}
    makes[FINER] = lambda patch: pf.DistributedModel(patch.refined(2), LAW)
    found = {}
    for name, make in makes.items():
        body = pf.Body(1.0, 12.5 * patch.second_moment() * 2.0, gravity=(0.0, 0.0))
        data = moved(
            make(patch), body, t, wrenches, rtol=1e-6, atol=1e-7, save_every=CYCLE
        )
        times = data.time.values
        own = np.stack([data.x.values, data.y.values, r * data.theta.values])
        for first, last in ((LAST - 10.0, LAST), (LAST, T_END)):
            span = (times > first) & (times <= last)
            speeds = [np.polyfit(times[span], each[span], 1)[0] for each in own]
            found[f"{name}, {last:g} s"] = CYCLE * float(np.linalg.norm(speeds))
    return found


def highest_level(patch: pf.ContactPatch, wrenches: np.ndarray) -> float:
    """Return the largest share of wrenches about the centre of pressure in the limit surface of mu_s."""
    surface = pf.LimitSurfaceTable(patch)
    (x, y) = patch.centre_of_pressure()
    about = wrenches + np.outer(
        wrenches[:, 1] * x - wrenches[:, 0] * y, [0.0, 0.0, 1.0]
    )
    twists = [surface.twist(-wrench) for wrench in about]
    return max(
        float(wrench @ twist / (surface.dissipation(twist) * LAW.mu_s * LOAD))
        for wrench, twist in zip(about, twists, strict=True)
    )


# ---------------------------------------------------------------------- tables and picture

Rows = list[list[str]]


def table_of_models(kept: dict[str, Any]) -> Rows:
    """Rows: states, prices, errors of the load of slip over shapes and ramps, and the slip of two pads, by model."""
    rows = [
        [
            "model",
            "states",
            "step",
            "gradient",
            "slip-onset load: median error",
            "maximum error",
            "slip between two pads",
        ]
    ]
    for name in MODELS:
        price = kept["prices AVX2"][name]
        slip = 1e3 * kept[f"two pads {name}"]["slip"]
        errors = 100 * np.abs(
            np.concatenate([kept[f"breakaway {shape}"][name] for shape in SHAPES])
        )
        cost = (
            f"{price['states']:.0f}",
            f"{price['step']:.1f}",
            f"{price['gradient']:.1f}",
        )
        rows.append(
            [
                TITLES.get(name, name),
                *cost,
                f"{np.median(errors):.3f} %",
                f"{errors.max():.2f} %",
                f"{slip:.1f} mm",
            ]
        )
    return rows


def table_of_creep(kept: dict[str, Any]) -> Rows:
    """Rows: maximum creep per cycle [nm] of all shapes, by level and model, without finer cells."""
    rows = [["maximum wrench / limit", *(TITLES.get(name, name) for name in MODELS)]]
    for level in LEVELS:
        found = [kept[f"shaken {shape} {level}"] for shape in SHAKEN]
        cells = []
        for name in MODELS:
            value = max(1e9 * numbers[f"{name}, {T_END:g} s"] for numbers in found)
            cells.append(f"{value:.2g}" if value < 99.5 else f"{value:.0f}")
        rows.append([f"{level:g}", *cells])
    return rows


def table_of_cells(kept: dict[str, Any]) -> Rows:
    """Rows: states, price and errors of driven motions, by number of discs."""
    rows = [
        [
            "discs",
            "states",
            *(f"step, {name}" for name in INSTRUCTIONS),
            "maximum force error: median run",
            "worst run",
            "maximum torque error: median run",
            "worst run",
            "RMS force error, median run",
        ]
    ]
    for name in (*map(str, COUNTS), "a disc a cell", "all cells", "published"):
        by_name = [kept[f"prices {each}"] for each in INSTRUCTIONS]
        price = [each.get(name) or each[f"{name} discs"] for each in by_name]
        runs = [
            np.array(kept[f"driven {shape}"][name])
            for shape in few.SHAPES
            if name in kept[f"driven {shape}"]
        ]
        largest, torque, rms = 100 * np.concatenate(runs).T
        words = {
            str(DEFAULT): f"**{DEFAULT}**",
            "a disc a cell": "one disc per cell",
            "all cells": "none: one point per cell",
            "published": "none: 3 states",
        }
        rows.append([words.get(name, name), f"{price[0]['states']:.0f}",
                     *(f"{each['step']:.2g}" for each in price),
                     f"{np.median(largest):.2g} %", f"{largest.max():.2g} %", f"{np.median(torque):.2g} %",
                     f"{torque.max():.2g} %", f"{np.median(rms):.2g} %"])  # fmt: skip
    return rows


TABLES = {"models": table_of_models, "creep": table_of_creep, "cells": table_of_cells}


def draw(kept: dict[str, Any]) -> style.PlotFigure:
    """Draw each error of the load of slip by shape, and the largest over the price of a step."""
    figure = style.new_figure(style.PAGE, 3.3)
    left, right = figure.subplots(1, 2, width_ratios=(2.2, 1.0), sharey=True)
    handles = []
    for k, (name, (_, colour)) in enumerate(MODELS.items()):
        errors = [100 * np.abs(kept[f"breakaway {shape}"][name]) for shape in SHAPES]
        places = np.repeat(np.arange(len(SHAPES)) + 0.15 * (k - 2.0), len(errors[0]))
        role = next((r for r in style.MARKERS if r == colour), style.REDUCED)
        look = {"color": colour, "marker": style.MARKERS[role], "mec": "white"}
        drawn = np.maximum(np.concatenate(errors), 1e-3)
        left.plot(places, drawn, ls="", ms=4.0, mew=0.3, alpha=0.8, **look)
        price = kept["prices AVX2"][name]["step"]
        worst = max(each.max() for each in errors)
        handles += right.plot(price, worst, ls="", ms=7, **look, label=TITLES.get(name, name))  # fmt: skip
    for edge in np.arange(0.5, len(SHAPES) - 1):
        left.axvline(edge, color="0.9", lw=0.6)
    names = [shape.replace(" ", "\n") for shape in SHAPES]
    left.set_xticks(range(len(SHAPES)), names)
    left.set(yscale="log", ylabel="error of the slip-onset load [%]")
    left.yaxis.set_major_formatter("{x:g}")
    right.set(xscale="log", xlabel="time of a step / 3-state model")
    right.xaxis.set_major_formatter("{x:g}")
    right.set_title("largest of all", loc="left")
    right.margins(x=0.15)
    for axes in (left, right):
        style.tidy(axes)
    left.grid(False, axis="x")
    figure.legend(
        handles=handles, loc="outside upper center", ncols=len(MODELS), frameon=False
    )
    return figure


def measures() -> Iterator[tuple[str, Callable[[], Any]]]:
    """Yield each measurement by the key under which it is kept."""
    yield from (
        (f"breakaway {shape}", lambda shape=shape: breakaway(shape)) for shape in SHAPES
    )
    yield from (
        (f"two pads {name}", lambda name=name: two_pads(name)) for name in MODELS
    )
    yield from (
        (f"prices {each}", lambda each=each: prices_with(each)) for each in INSTRUCTIONS
    )
    yield from (
        (f"driven {shape}", lambda shape=shape: driven(shape)) for shape in few.SHAPES
    )
    for level in LEVELS:
        for shape in SHAKEN:
            yield (
                f"shaken {shape} {level}",
                lambda shape=shape, level=level: shaken(shape, level),
            )


def with_tables(page: str, kept: dict[str, Any]) -> str:
    """Return the text of a page with the tables that it names."""

    def written(found: re.Match[str]) -> str:
        rows = TABLES[found["name"]](kept)
        lines = [rows[0], ["---"] * len(rows[0]), *rows[1:]]
        return (
            f"<!-- breakaway: {found['name']} -->\n\n"
            + "".join(f"| {' | '.join(row)} |\n" for row in lines)
            + "\n"
        )

    return MARK.sub(written, page)


def main() -> None:
    """Measure what is not kept yet, and write tables and picture."""
    kept = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    for key, measure in measures():
        if key not in kept:
            kept[key] = measure()
            KEPT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
            print(key, flush=True)
    for path in sorted(DOCS.glob("*.md")):
        before = path.read_text(encoding="utf-8")
        if (after := with_tables(before, kept)) != before:
            path.write_text(after, encoding="utf-8")
            print(f"{path.name}: new numbers")
    with style.paper():
        draw(kept).savefig(PICTURE, dpi=160)


if __name__ == "__main__":
    main()
