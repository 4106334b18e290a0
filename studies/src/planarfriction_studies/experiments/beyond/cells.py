"""Errors of few discs: driven, in steady sliding, at the load of slip, in creep; and the work that they return."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from planarfriction.derivatives import rollout
from planarfriction.geometry import wrench_at
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import LimitSurfaceCells, LimitSurfaceTable
from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch
from planarfriction.plots.style import PlotFigure
from planarfriction.scenes import Body, Contact, Scene, Signal, simulate
from planarfriction_studies.experiments import looks
from planarfriction_studies.experiments.beyond.shapes import SHAPES as NEW_SHAPES
from planarfriction_studies.experiments.experiment import Table, table
from planarfriction_studies.experiments.wording import short

LAW = LuGre(mu_s=1.2, elasto_plastic=ElastoPlastic(0.9))

LAWS = {
    "published": LAW,
    "higher static friction": LuGre(mu_s=1.5, elasto_plastic=ElastoPlastic(0.98)),
    "soft bristles": LuGre(
        mu_s=1.2, sigma_0=1e5, sigma_1=250.0, elasto_plastic=ElastoPlastic(0.9)
    ),
}
"""Laws of the loads of slip."""

SHAPES: dict[str, Callable[[], ContactPatch]] = {
    "disc": PUBLISHED_PATCHES["Circle"],
    "square": PUBLISHED_PATCHES["Square"],
    # cells that are cut: the published ones are fewer than the discs that are asked for
    "T": lambda: PUBLISHED_PATCHES["NonConvex2"]().refined(2),
    "two pads": lambda: PUBLISHED_PATCHES["NonConvex1"]().refined(4),
    "line, linear pressure": lambda: PUBLISHED_PATCHES["LineGrad"]().refined(8),
    **{
        name: NEW_SHAPES[name]
        for name in ("L", "annulus sector", "Gaussian off centre")
    },
}

RUNGS = (8, 16, 32, 64, 128)
"""Numbers of discs, beside the default and one for every cell."""

FINE = 2000
"""Points of the reference: their own staircase must be well below the errors that are measured."""

SPEED, T_END, SAMPLES, STEPS = 0.02, 1.2, 600, 50
"""Speed of a driven motion [m/s], its end [s], its samples, linear in between, and steps from one to the next."""

COLUMNS = ("largest force", "largest torque", "rms force", "rms torque")
"""Errors of a driven motion, in units of `mu_c f_N` and of that times the radius of gyration."""

RAMPS, TOP, SLIPPED = (0.01, 0.1, 1.0), 1.6, 3.0
"""Times in which a load grows from zero to TOP times what the limit surface of mu_s holds [s], and displacement beyond
that of the bent bristles at which the patch counts as slipping, in deflections at mu_s."""

LEVELS, CYCLE, CYCLES = (0.5, 0.65, 0.8), 0.5, 12
"""Largest load of a shaken contact as shares of that limit surface, its cycle [s], and cycles: the last half counts."""

PUCKS = ((0.1, 10.0), (0.05, 40.0), (0.2, 3.0))
"""Speeds [m/s] and spins [rad/s] of a disc of 0.1 kg that slides to rest."""


def models_of(patch: ContactPatch) -> dict[str, Any]:
    """Return the published model and `ReducedModel` with more and more discs, up to one for every cell, by name."""
    counts = sorted({*RUNGS, ReducedModel.cells})
    discs = {
        f"{n} discs": ReducedModel(patch, LAW, cells=n)
        for n in counts
        if n < patch.cells
    }
    return {
        "published": ReducedModelPublished(patch, LAW),
        **discs,
        "all": ReducedModel(patch, LAW, cells=patch.cells),
    }


def fine(patch: ContactPatch, law: LuGre = LAW) -> DistributedModel:
    """Return the reference: points, about FINE of them, on cells cut in at least two along each side."""
    sides = int((patch.cell_extents() > 0.0).any(axis=0).sum())
    cuts = (
        np.clip(round((FINE / patch.cells) ** (1.0 / max(sides, 1))), 2, 33)
        if sides
        else 1
    )
    return DistributedModel(patch.refined(int(cuts)), law)


def gyration(patch: ContactPatch) -> float:
    """Return the radius of gyration of the load about the centre of pressure [m]."""
    return math.sqrt(float(patch.second_moment()))


def about_centre(patch: ContactPatch, twist: np.ndarray) -> np.ndarray:
    """Return twists of the patch's frame from those of its centre of pressure."""
    (x, y) = patch.centre_of_pressure()
    omega = twist[..., 2]
    return twist + np.stack([omega * y, -omega * x, 0.0 * omega], axis=-1)


def stopping(rng: np.random.Generator, r: float) -> np.ndarray:
    """Return a smooth random twist `[SAMPLES, 3]` with stops and reversals."""
    t = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    twist = 0.0
    for wave in range(1, 5):
        size = rng.normal(size=3)
        pace = rng.uniform(0.6, 1.4, 3)
        phase = rng.uniform(0.0, 2.0 * np.pi, 3)
        twist = twist + size / wave * np.sin(2.0 * np.pi * wave * pace * t + phase)
    arm = r * rng.choice([0.3, 1.0, 3.0])
    twist = (
        SPEED
        * np.clip(np.sin(3.0 * np.pi * t) + 0.6, 0.0, 1.0)
        * twist
        / [1.0, 1.0, arm]
    )
    twist[0] = 0.0
    return twist


def wandering(rng: np.random.Generator, r: float) -> np.ndarray:
    """Return a twist `[SAMPLES, 3]` that never stops and whose centre of rotation wanders through the patch."""
    t = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    waves = rng.uniform(0.5, 3.0, (2, 2))
    phases = rng.uniform(0.0, 2.0 * np.pi, (2, 2))
    centre = (
        0.7
        * r
        * np.sum(
            [np.sin(2.0 * np.pi * waves[i] * t + phases[i]) for i in range(2)], axis=0
        )
    )
    spin = rng.choice([-1.0, 1.0]) * SPEED / r * np.minimum(40.0 * t, 1.0)
    return spin * np.hstack([centre[:, 1:], -centre[:, :1], np.ones_like(t)])


def driven(
    patch: ContactPatch, models: dict[str, Any], motion: Callable, seeds: int
) -> dict[str, np.ndarray]:
    """Return the errors `[seeds, COLUMNS]` of models by name, moved by random twists, from the reference."""
    r = gyration(patch)
    coarse = np.stack(
        [motion(np.random.default_rng([5, seed]), r) for seed in range(seeds)]
    )
    share = np.arange(1, STEPS + 1)[:, None] / STEPS
    twists = coarse[:, :-1, None] * (1.0 - share) + coarse[:, 1:, None] * share
    twists = about_centre(patch, twists.reshape(seeds, -1, 3))
    dt = T_END / (SAMPLES - 1) / STEPS

    def wrenches(model: Any) -> np.ndarray:
        ends = rollout(model, None, twists, 1.0, dt).wrenches[:, STEPS - 1 :: STEPS]
        return wrench_at(ends, patch.centre_of_pressure()) / [1.0, 1.0, r]

    wanted = wrenches(fine(patch))
    found = {}
    for name, model in models.items():
        miss = wrenches(model) - wanted
        force = np.hypot(miss[..., 0], miss[..., 1])
        torque = np.abs(miss[..., 2])
        rms = (np.sqrt((each**2).mean(axis=1)) for each in (force, torque))
        found[name] = (
            np.stack([force.max(axis=1), torque.max(axis=1), *rms], axis=-1) / LAW.mu_c
        )
    return found


def steady(
    patch: ContactPatch, models: dict[str, Any], points: int
) -> dict[str, np.ndarray]:
    """Return errors `[points, 2]` of force and torque in steady turning about random points inside the patch."""
    rng = np.random.default_rng(11)
    r = gyration(patch)
    cells = rng.choice(patch.cells, points, p=patch.weights())
    places = (
        patch.positions[cells]
        + rng.uniform(-0.5, 0.5, (points, 2)) * patch.cell_extents()[cells]
    )
    twists = SPEED / r * np.column_stack([places[:, 1], -places[:, 0], np.ones(points)])

    def wrenches(model: Any) -> np.ndarray:
        state = np.zeros((points, *model.state_shape))
        for _ in range(3):
            state, wrench = model.step(state, twists, 1.0, 1.0)
        return wrench_at(wrench, patch.centre_of_pressure()) / [1.0, 1.0, r]

    wanted = wrenches(fine(patch))
    misses = {
        name: (wrenches(model) - wanted) / LAW.mu_c for name, model in models.items()
    }
    return {
        name: np.stack([np.hypot(*miss.T[:2]), np.abs(miss[:, 2])], axis=-1)
        for name, miss in misses.items()
    }


def wrench_at_limit(
    patch: ContactPatch, law: LuGre, rng: np.random.Generator
) -> np.ndarray:
    """Draw a load `[3]` about the centre of pressure on the limit surface of mu_s, per unit normal force."""
    r = gyration(patch)
    twist = about_centre(patch, rng.normal(size=3) / [1.0, 1.0, r])
    return -law.mu_s * wrench_at(
        LimitSurfaceCells(patch).wrench(twist), patch.centre_of_pressure()
    )


def moved(
    model: Any, body: Body, times: np.ndarray, wrenches: np.ndarray, **options: Any
) -> np.ndarray:
    """Simulate a body about the centre of pressure under wrenches `[T, 3]`, per unit load; `[S, 4]`: t, x, y, theta."""
    contact = Contact(model, 1.0, position=tuple(-model.patch.centre_of_pressure()))
    scene = Scene(
        body, [contact], times[-1], force=Signal.sampled(times, wrenches, "linear")
    )
    histories = simulate(scene, **options).histories
    return np.stack(
        [histories[name].values for name in ("time", "x", "y", "theta")], axis=-1
    )


def load_of_slip(model: Any, wrench: np.ndarray, ramp: float) -> float:
    """Return the share of `wrench` at which the patch slips while it grows within `ramp` [s]."""
    r = gyration(model.patch)
    body = Body(0.01, 0.04 * r**2, gravity=(0.0, 0.0))
    options = {"rtol": 1e-6, "atol": 1e-9, "save_every": ramp / 4000}
    run = moved(
        model, body, np.array([0.0, ramp]), np.outer([0.0, TOP], wrench), **options
    )
    share = TOP * run[:, 0] / ramp
    bent = np.outer(share, wrench / [1.0, 1.0, r**2]) / model.law.sigma_0
    off = np.abs(run[:, 1:] - run[0, 1:] - bent) * [1.0, 1.0, r]
    off = np.hypot(off[:, 0], off[:, 1]) + off[:, 2]
    most = SLIPPED * model.law.mu_s / model.law.sigma_0
    first = int(np.argmax(off > most))
    if off[first] <= most:
        raise ValueError(f"no slip of {model.patch.name} in {ramp} s")
    return float(
        np.interp(most, off[first - 1 : first + 1], share[first - 1 : first + 1])
    )


def slips(
    patch: ContactPatch,
    models: dict[str, Any],
    law: LuGre,
    ramps: tuple[float, ...] = RAMPS,
) -> dict[str, np.ndarray]:
    """Return by model the loads of slip over the reference's, less one, `[2, ramps]`: of two directions."""
    rng = np.random.default_rng([25, patch.cells])
    pulls = [wrench_at_limit(patch, law, rng) for _ in range(2)]
    every = {name: model.with_law(law) for name, model in models.items()} | {
        "": fine(patch, law)
    }
    loads = {name: np.array([[load_of_slip(model, pull, ramp) for ramp in ramps] for pull in pulls])
             for name, model in every.items()}  # fmt: skip
    return {name: loads[name] / loads[""] - 1.0 for name in models}


def highest_level(patch: ContactPatch, pulls: np.ndarray) -> float:
    """Return the largest of loads `[T, 3]` about the centre of pressure, as shares of what mu_s holds."""
    surface = LimitSurfaceTable(patch)
    moved_back = -patch.centre_of_pressure()
    wrenches = wrench_at(pulls, moved_back)
    twists = [surface.twist(-wrench) for wrench in wrenches]
    return max(
        float(wrench @ twist / (surface.dissipation(twist) * LAW.mu_s))
        for wrench, twist in zip(wrenches, twists, strict=True)
    )


def creep(
    patch: ContactPatch, models: dict[str, Any], level: float
) -> dict[str, np.ndarray]:
    """Return by model the way from cycle to cycle [m], `[CYCLES - 1]`, of a contact that is shaken and holds."""
    r = gyration(patch)
    t = np.linspace(0.0, CYCLE * CYCLES, 100 * CYCLES + 1)
    grown = np.minimum(t / 0.3, 1.0)
    phase = 2.0 * np.pi * t / CYCLE
    spin = 0.27 + 0.32 * np.cos(phase + 0.6)
    pulls = grown[:, None] * np.stack(
        [0.43 + 0.32 * np.sin(phase), 0.27 * np.cos(phase), r * spin], axis=1
    )
    pulls *= level / highest_level(patch, pulls[100:200:2])
    body = Body(0.1, 0.4 * r**2, gravity=(0.0, 0.0))
    found = {}
    for name, model in (
        models | {"refined(2)": DistributedModel(patch.refined(2), LAW)}
    ).items():
        run = moved(model, body, t, pulls, rtol=1e-6, atol=1e-8, save_every=CYCLE)
        found[name] = np.linalg.norm(
            np.diff(run[1:, 1:] * [1.0, 1.0, r], axis=0), axis=1
        )
    return found


def travels(models: dict[str, Any], patch: ContactPatch) -> dict[str, np.ndarray]:
    """Return by model how far a puck slides and turns until it rests, over the reference's, less one: `[PUCKS, 2]`."""
    found = {}
    for name, model in (models | {"": fine(patch)}).items():
        ends = []
        for speed, spin in PUCKS:
            contact = Contact(
                model,
                0.981,
                mounted_on="body",
                position=tuple(-patch.centre_of_pressure()),
            )
            body = Body(0.1, 2e-5, velocity=(speed, 0.0, spin), gravity=(0.0, 0.0))
            last = simulate(Scene(body, [contact], 0.3), rtol=1e-7, atol=1e-8).histories
            ends.append([last[axis].values[-1] for axis in ("x", "theta")])
        found[name] = np.array(ends)
    return {name: found[name] / found[""] - 1.0 for name in models}


def returned(model: Any, cycles: int, steps: int = 40, loads: bool = False) -> float:
    """Return the most work that random motions from rest gave back beyond what was put in, as a share of all of it.

    Work of a step is that of its last wrench, `-W . V dt`; negative where nothing was gained at any time. The law of
    the model should be one without damping; `loads`: with loads that move, too.
    """
    rng = np.random.default_rng(3)
    r = gyration(model.patch)
    worst = -math.inf
    for begin in range(0, cycles, 10_000):
        count = min(10_000, cycles - begin)
        sizes = [1.0, 1.0, 1.0 / r] * 10.0 ** rng.uniform(-4.0, -1.0, (count, 1, 1))
        twists = sizes * rng.normal(size=(count, steps, 3))
        back = rng.random(count) < 0.5  # half of them go back the way that they came
        twists[back, steps // 2 :] = -twists[back, : steps // 2][:, ::-1]
        twists = about_centre(model.patch, twists)
        dt = 10.0 ** rng.uniform(-5.0, -2.0)
        force = rng.uniform(0.2, 2.0, (count, steps)) if loads else 1.0
        work = -(rollout(model, None, twists, force, dt).wrenches * twists).sum(axis=-1)
        worst = max(worst, gain(work))
    return worst


def gain(work: np.ndarray) -> float:
    """Return the most that was ever given back beyond what was put in, of the works `[motions, steps]` of steps."""
    return float(
        (-np.cumsum(work, axis=1).min(axis=1) / np.abs(work).sum(axis=1)).max()
    )


def measured(shape: str, quick: bool) -> dict[str, dict[str, np.ndarray]]:
    """Return by what is measured and model the errors `[runs, columns]` on a shape, as shares."""
    patch = SHAPES[shape]()
    models = models_of(patch)
    laws = [LAW] if quick else LAWS.values()
    parts = [slips(patch, models, law, RAMPS[1:2] if quick else RAMPS) for law in laws]
    motions = {"stops": stopping, "wandering": wandering}
    seeds = 2 if quick else 20
    return {
        name: driven(patch, models, motion, seeds) for name, motion in motions.items()
    } | {
        "steady": steady(patch, models, 100 if quick else 1000),
        "slip": {
            name: np.concatenate([np.abs(part[name]).ravel() for part in parts])[
                :, None
            ]
            for name in models
        },
    }


def held(shape: str) -> dict[str, dict[str, np.ndarray]]:
    """Return by level and model the way from cycle to cycle [m] of a shaken contact, of which the last is the end."""
    patch = SHAPES[shape]()
    return {f"{level:g}": creep(patch, models_of(patch), level) for level in LEVELS}


def gained(cycles: int) -> dict[str, float]:
    """Return by numbers of discs the most work that random motions gave back, as a share of all (see `returned`)."""
    law = LuGre(mu_s=1.2, sigma_1=0.0, sigma_2=0.0, elasto_plastic=ElastoPlastic(0.9))
    patch = SHAPES["disc"]()
    return {
        f"{n} discs": returned(ReducedModel(patch, law, cells=n), cycles)
        for n in (1, ReducedModel.cells)
    }


SHOWN = {
    "force, median run": ("stops", lambda found: np.median(found[:, 0])),
    "worst run": ("stops", lambda found: found[:, 0].max()),
    "rms": ("stops", lambda found: np.sqrt((found[:, 2] ** 2).mean())),
    "without stops, force": ("wandering", lambda found: found[:, 0].max()),
    "torque": ("wandering", lambda found: found[:, 1].max()),
    "steady, force": ("steady", lambda found: found[:, 0].max()),
    "load of slip, median": ("slip", np.median),
    "largest": ("slip", np.max),
}
"""Columns of the table: what is measured, and the number of all its runs that is shown."""

LINES = {
    name: SHOWN[name]
    for name in ("force, median run", "rms", "steady, force", "load of slip, median")
}
"""Lines of the figure."""


def pooled(found: dict[str, Any]) -> dict[str, dict[str, float]]:
    """Return by model the columns of the table over the runs on all shapes [%]."""
    names = list(next(iter(found.values()))["stops"])
    runs = lambda what, name: np.concatenate(
        [each[what][name] for each in found.values()]
    )
    return {
        name: {
            words: 100.0 * float(of(runs(what, name)))
            for words, (what, of) in SHOWN.items()
        }
        for name in names
    }


def tables(
    errors: dict[str, dict[str, float]], creeps: dict[str, Any]
) -> tuple[Table, Table]:
    """Return the errors of more and more discs, and how they creep while they hold."""
    columns = {
        words: lambda each, words=words: short(each[words], 2) for words in SHOWN
    }
    note = "Driven motions with stops and reversals, without, steady turning about points inside, and ramps of a load."
    few = table(
        f"Errors of few discs on {len(SHAPES)} shapes [% of mu f_N]",
        errors,
        columns,
        "model",
        note,
    )
    names = next(iter(next(iter(creeps.values())).values()))
    rows = {
        f"{shape}, {level}": {name: 1e9 * each[name] for name in names}
        for shape, levels in creeps.items()
        for level, each in levels.items()
    }
    note = f"Way of the last of {CYCLES} cycles, from the largest load as a share of the friction limit."
    ways = {name: lambda each, name=name: short(each[name], 2) for name in names}
    return few, table(
        "Creep of a shaken contact that holds [nm per cycle]",
        rows,
        ways,
        "patch, load",
        note,
    )


def figure(errors: dict[str, dict[str, float]]) -> PlotFigure:
    """Draw errors [%] over the number of discs; dotted: those of the published model."""
    made, axes = looks.panels(6.4, 4.2)
    rungs = {
        int(name.split()[0]): each
        for name, each in errors.items()
        if name.endswith("discs")
    }
    colours = looks.OTHERS
    for words, colour in zip(LINES, colours, strict=True):
        axes.plot(
            list(rungs),
            [each[words] for each in rungs.values()],
            "o-",
            color=colour,
            ms=5,
            label=words,
        )
        axes.axhline(errors["published"][words], color=colour, lw=1.0, ls=":")
    axes.set(
        xscale="log", yscale="log", xlabel="discs", ylabel=r"error [% of $\mu f_N$]"
    )
    axes.set_xticks(list(rungs), [str(n) for n in rungs])
    axes.minorticks_off()
    looks.legend(made, axes, 2)
    return made
