"""Results of patches, plans, the observer and scenes, to be recorded: see `tests.support.recording`."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import io
import math
import re
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from PIL import Image, ImageSequence

import planarfriction as pf
from planarfriction import environments
from planarfriction.online import (
    FrictionObserver,
    Hinge,
    Hold,
    Measurement,
    SlideBy,
    TurnBy,
)
from planarfriction.patch import PUBLISHED_PATCHES, friction_metric
from planarfriction.planning import (
    Pusher,
    Slider,
    dynamic_holding_load,
    holding_load,
    motion_cone,
    plan_grip,
    plan_push,
    push,
)
from planarfriction.planning.contact_modes import TouchPoint
from planarfriction.planning.pushing import _neighbour
from planarfriction.plots import interactive_limit_surface, notebook
from planarfriction.plots import track as tracks
from planarfriction.plots.animation import Film, frame_times
from planarfriction.plots.film_files import write_frames
from planarfriction.scenes.signal import (
    SAME_TIME,
    breaks_between,
    displacement,
    sample_count,
    sample_times,
)
from planarfriction_studies.rig import Gripper
from planarfriction_studies.rig.trials import known_model, random_parts
from tests.scenes.test_start import held_by_two
from tests.support import recorded, synthetic

LOADS = np.array([0.0, 0.5, 2.0, 9.0])
LAW = pf.LuGre(mu_c=0.8, mu_s=1.1, elasto_plastic=0.9)
SOFT = pf.SoftFinger(c=0.006, n=1 / 3, k=2.0, radius_max=0.012)
X, Y = np.meshgrid(np.arange(-3, 4) * 1e-3, np.arange(3, -4, -1) * 1e-3)
MAPS = {
    0.5: np.maximum(1.0 - ((X - 1e-3) ** 2 + Y**2) / 0.003**2, 0.0),
    4.0: np.sqrt(np.maximum(1.0 - (X**2 + (Y - 1e-3) ** 2) / 0.0045**2, 0.0)),
}


def made_patches() -> dict[str, pf.ContactPatch]:
    """Make patches of each shape, pressure and kind of friction."""
    patch = pf.ContactPatch
    legs = [(0.0, 0.1), (-0.1, -0.05), (0.1, -0.05)]
    bar = patch.rectangle(0.04, 0.01, (6, 3), pressure=pf.LinearGradient((8.0, -20.0)))
    corner = [
        (0.0, 0.0),
        (0.03, 0.0),
        (0.03, 0.01),
        (0.01, 0.01),
        (0.01, 0.02),
        (0.0, 0.02),
    ]
    made = {name: make() for name, make in PUBLISHED_PATCHES.items()} | {
        "disc": patch.disc(0.01, 8),
        "published disc": patch.disc_published(
            0.012, 9, pressure=lambda x, y: 1.0 + 40.0 * x + 900.0 * y * y
        ),
        "bar": bar,
        "row": patch.rectangle(0.04, 0.01, (5, 1)),
        "ring": patch.ring(0.004, 0.01, 10),
        "line": patch.line(0.02, 6, direction="x", profile=lambda x: 1.0 + 30.0 * x),
        "column": patch.line(0.02, 5, profile=[1, 2, 3, 2, 0]),
        "corner": patch.polygon(corner, 7),
        "legs": patch.points(legs, [1.0, 2.0, 3.0], area=1e-4),
        "soft": patch.disc(0.012, 9, pressure=SOFT),
        "harder": patch.rectangle(
            0.02, 0.01, 8, pressure=pf.SoftFinger(c=0.008, k_per_newton=0.7)
        ),
        "map": patch.from_pressure(MAPS[4.0], width=0.014, name="map"),
        "maps": patch.from_pressure(MAPS, cell_size=(1e-3, 1.5e-3)),
        "metric": bar.with_friction_metric(friction_metric(0.4, 1.0, 1.6), (0.2, -0.1)),
        "metrics": patch.points(legs).with_friction_metric(
            [friction_metric(a, 1.0, 1.5) for a in (0.0, 0.5, 1.0)]
        ),
    }
    few = {
        f"{name} as {n} discs": made[name].discs(n)
        for name, n in (("NonConvex1", 6), ("ring", 8), ("corner", 5))
    }
    return (
        made
        | few
        | {
            "discs": bar.discs(),
            "maps as discs": made["maps"].discs(4),
            "lean": made["metric"].discs(5),
        }
    )


def told_patch(patch: pf.ContactPatch) -> dict[str, Any]:
    """Tell cells, shares, moments, and what finer cells are."""
    loads = LOADS[1:]
    finer = patch.refined(2)
    moved = [(0.0, 0.0), (2e-3, -1e-3), (0.4, 0.0)]
    return {
        "repr": repr(patch), "data": as_arrays(patch.to_dict()), "weights": patch.weights(LOADS),
        "area": patch.area(loads),
        "tiles": patch.tile_weights(loads), "pressure": patch.pressure_values(LOADS), "bristles": patch.bristles,
        "centre": patch.centre_of_pressure(LOADS), "radius": patch.contact_radius(LOADS),
        "second moment": patch.second_moment(LOADS), "moments": patch.moments(3, loads),
        "about": patch.moments(2, loads, about=(1e-3, -2e-3)),
        "tilted": patch.weights(LOADS[:, None], moments=moved),
        "levers": patch.levers(), "lever radii": patch.lever_radii, "asymmetries": patch.asymmetries(),
        "extents": patch.cell_extents(), "finer": as_arrays(finer.to_dict()), "finer weights": finer.weights(2.0),
    }  # fmt: skip


def as_arrays(table: Any) -> Any:
    """Return tables with arrays in the place of lists of numbers."""
    if isinstance(table, dict):
        return {name: as_arrays(each) for name, each in table.items()}
    if isinstance(table, list) and table and not isinstance(table[0], (dict, str)):
        return np.asarray(table)
    return [as_arrays(each) for each in table] if isinstance(table, list) else table


def patches() -> dict[str, Any]:
    """Tell patches, errors of their cells, and draws of their parameters."""
    made = made_patches()
    errors = {
        name: vars(made[name].grid_error(2.0))
        for name in ("Circle", "bar", "column", "soft", "maps", "legs")
    }
    finer = {
        name: str(made[name].grid_error(2.0, refined=2))
        for name in ("disc", "line", "corner")
    }
    drawn = environments.randomise(
        LAW,
        {
            "mu_c": (0.2, 0.9),
            "sigma_0": (1e4, 2e4),
            "scale": (0.9, 1.1),
            "centre_x": (-1e-3, 2e-3),
        },
        6,
        seed=3,
    )
    one = pf.ContactPatch.points([(0.0, 0.0)]).with_friction_metric(
        [friction_metric(0.4, 1.0, 1.6)]
    )
    static = environments.randomise(LAW, {"mu_s": (0.2, 1.5)}, 6, seed=1)
    return {
        **{name: told_patch(patch) for name, patch in made.items()},
        "errors": errors, "finer errors": finer, "drawn": drawn, "static": static,
        "defaults": environments.defaults(LAW), "root of one": one.root,
    }  # fmt: skip


def pushes() -> dict[str, Any]:
    """Tell pushes with a point and with a face, in several modes, and a plan."""
    half = 0.045
    box = [(-half, -half), (half, -half), (half, half), (-half, half)]
    patch = pf.ContactPatch.rectangle(2 * half, cells=5)
    slider = Slider(pf.LimitSurfaceEllipsoid(patch), box[::-1])
    exact = Slider(
        pf.LimitSurfaceExact(patch), [(-half, -half), (half, -half), (0.0, half)]
    )
    along = lambda *corners: pf.Signal.sampled(
        np.arange(len(corners)), corners, "linear"
    )
    made = {
        "point": push(slider, Pusher(0.3), along((-0.06, 0.01), (0.0, 0.03))),
        "away": push(
            slider,
            Pusher(0.3),
            along((-0.06, -0.02), (0.0, -0.02), (-0.03, -0.03), (0.02, 0.01)),
            samples=41,
        ),
        "smooth": push(
            exact,
            Pusher(0.0),
            along((-0.02, -0.06), (0.0, 0.0)),
            start=(0.01, 0.0, 0.2),
            samples=21,
        ),
        "face": push(
            slider,
            Pusher(0.4, 0.06),
            along((-0.06, 0.01, 0.1), (-0.02, 0.0, 0.1), (0.02, 0.02, 0.4)),
        ),
        "corner": push(
            slider,
            Pusher(0.2, 0.3),
            along((-0.09, 0.0, 0.3), (0.0, 0.01, 0.3)),
            samples=31,
        ),
    }
    plan = plan_push(slider, Pusher(0.4), (0.08, 0.02, 0.3), edges=[3, 0])
    report = {
        name: value for name, value in vars(plan.report).items() if name != "wall_time"
    }
    told = {
        name: [
            repr(each),
            each.time,
            each.pose,
            each.pusher_pose,
            each.mode.tolist(),
            each.place,
        ]
        for name, each in made.items()
    }
    told["cones"] = [
        motion_cone(each.surface, (-half, 0.01), (2.0, 0.5), 0.3)
        for each in (slider, exact)
    ]
    touch = TouchPoint(np.array([-half, 0.01]), np.array([1.0, 0.0]))
    told["neighbours"] = [
        _neighbour(slider, touch, 0.3, np.array([1.0, y, 0.0]), held)
        for y in (-0.8, 0.0, 0.2, 0.9)
        for held in ("stick", "slide left", "slide right")
    ]
    edges = {
        name: [each.outline, each.along, each.inward, each.size]
        for name, each in (("a", slider), ("b", exact))
    }
    return {
        **told,
        "edges": edges,
        "plan": [report, repr(plan), plan.path.to_dict(), plan.push.end],
    }


def grips() -> dict[str, Any]:
    """Tell loads that hold, and plans of a grip that lets a plate turn or slide."""
    made = made_patches()
    load = (0.3, -1.0, 4e-3)
    holding = {
        name: holding_load(load, made[name], 0.7, 0.1)
        for name in made
        if name not in ("metrics", "legs")
    }
    model = pf.ReducedModel(made["disc"], LAW, cells=9)
    fast = [dynamic_holding_load(load, model, ramp=ramp) for ramp in (0.0, 0.05)]
    plate = pf.scenes.in_hand(
        model, centre_of_mass=(0.025, 0.0), normal_force=4.0, t_end=0.6
    )
    turn = plan_grip(plate, {"angle": -0.4}, knots=6)
    wrong: list[Any] = []
    for knots in (
        [0.0, 0.1, 0.2],
        [0.1, 0.2, 0.3, 0.4],
        [0.0, 0.2, 0.2, 0.4],
        [0.0, 0.1, 0.2, 0.6],
        3,
    ):
        with contextlib.suppress(pf.FrictionError):
            wrong.append([knots, plan_grip(plate, {"angle": -0.4}, knots=knots)])
    slide = plan_grip(plate, {"slide": (0.0, -0.01)}, knots=6)
    told = {
        "turn": told_plan(turn),
        "figure": turn.plot(),
        "slide": told_plan(slide),
        "its figure": slide.plot(),
    }
    return {"holding": holding, "fast": fast, "wrong": wrong} | told


def told_plan(plan: Any) -> dict[str, Any]:
    """Tell a plan without the time it took."""
    report = vars(plan.report) | {"wall_time": 0.0, "spread": plan.report.spread}
    lines = repr(plan).splitlines()[:-1]  # the last one has times
    return {
        "text": lines,
        "report": report,
        "knots": plan.signal.to_dict(),
        "contact": plan.contact,
    }


def online() -> dict[str, Any]:
    """Tell estimates of an observer along slips, and grips of the controllers on parts of a rig."""
    patch = pf.ContactPatch.disc(6e-3, 15)
    law = pf.LuGre(mu_c=0.5, mu_s=0.55, v_s=2e-3, sigma_2=0.1)
    surface = pf.LimitSurfaceTable(patch)
    told = {}
    for name, options in (
        ("plain", {"bias": (0.01, 0.01, 1e-4)}),
        ("drift", {"drift": 0.1, "mu_spread": 0.5}),
    ):
        own = FrictionObserver(
            pf.ReducedModel(patch, law), surface=surface, batch=2, **options
        )
        estimates = [own.update(each) for each in _slips(surface)]
        parts = {
            field: np.array([getattr(each, field) for each in estimates])
            for field in estimates[0]._fields
        }
        told[name] = {
            **parts,
            "state": own.state[:, 1:],
            "bias": own.bias,
            "information": own.information(),
        }
        told[name]["interval"] = estimates[-1].interval(0.9)
    soft = FrictionObserver(
        pf.DistributedModel(pf.ContactPatch.disc(0.012, 9, pressure=SOFT), law),
        normal_force=3.0,
    )
    told["soft"] = list(soft._filter)
    for kind, options in (
        (Hold, {}),
        (Hinge, {}),
        (SlideBy, {"goal": -0.02}),
        (TurnBy, {"goal": -0.5}),
    ):
        gripper = Gripper(
            dataclasses.replace(random_parts(3, 3, 1), delay=0.01), 20.0, seed=1
        )
        own = kind(FrictionObserver(known_model(), batch=3), **options)
        grips_ = []
        sample = gripper.measurement
        for _ in range(500):
            grips_.append(own.update(sample))
            sample = gripper.step(grips_[-1])
        told[kind.__name__] = [
            np.array(grips_),
            gripper.slip,
            own.blind,
            own.estimate.mu_c,
            list(own._settings),
        ]
    return told


def _slips(surface: Any) -> list[Measurement]:
    """Make samples of two parts that are gripped, stick and slip in changing directions, with odd ones among them."""
    samples = []
    for k in range(500):
        phase = 3e-3 * k
        rests = k < 60 or 300 <= k < 350
        twist = np.array([0.03 * math.cos(phase), 0.02, 4.0 * math.sin(phase)])
        wrench = np.outer(
            [0.7, 0.45], surface.wrench(twist * (1.0, 1.0, 1.1)) * (1.0, 1.0, 1.1)
        )
        load = 0.0 if k < 20 else 4.0 + 0.5 * math.sin(0.02 * k)
        velocity = (
            np.outer([0.0, 0.0] if rests else [1.0, 1.1], twist) if k % 8 == 0 else None
        )
        wrench = (0.5 if rests else 1.0) * load * wrench + [0.01, -0.02, 1e-4]
        if k == 400:
            wrench[0] = np.nan
        samples.append(
            Measurement(
                1e-3 * (k - (k == 420)),
                wrench,
                np.full(2, 2e3 if k == 410 else load),
                velocity,
            )
        )
    return samples


def ready() -> dict[str, pf.Scene]:
    """Make each ready scene, short, and scenes with springs, edges, movers and other starts."""
    scenes = pf.scenes
    disc = pf.ContactPatch.disc(0.01, 7)
    small = pf.ReducedModel(disc, LAW, cells=6)
    cells = pf.DistributedModel(disc, LAW)
    soft = pf.DistributedModel(pf.ContactPatch.disc(0.012, 7, pressure=SOFT), LAW)
    plate = pf.Body(
        0.3, 4e-4, (0.01, 0.0), 0.2, (0.05, 0.0, 1.0), outline=synthetic.PLATE
    )
    spring = pf.Spring(40.0, 0.5, [0.03, 0.01], (0.02, 0.0), 0.05, 1e-3)
    moved = pf.Signal.sampled(
        [0.0, 0.1, 0.3], [[0.0, 0.0, 0.0], [0.05, 0.02, 0.5], [0.0, 0.0, 0.0]], "linear"
    )
    wave = pf.Signal.sine(2.0, 0.8, 3.0, t_end=0.3)
    fading = pf.Signal([0.0, 0.2, 0.3], [3.0, 0.5, 0.0], "linear")
    turn = (0.01, 0.0, 1.0)
    two = [
        pf.Contact(
            cells,
            wave,
            position=(0.0, 0.0),
            angle=0.3,
            count=2,
            name="pads",
            support_velocity=moved,
        ),
        pf.Contact(small, 1.5, mounted_on="body", position=(0.01, -0.01), name="foot"),
    ]
    tilted = [
        pf.Contact(
            cells,
            9.81 * 0.3,
            mounted_on="body",
            name="table",
            pressure="follows",
            height=0.02,
        )
    ]
    edge = [pf.Contact(cells, 3.0, position=(-0.07, 0.0), name="rim", edge=True)]
    return {
        "in hand": scenes.in_hand(small, t_end=0.4, normal_force=scenes.in_hand_load(1, placement=2, t_end=0.4)),
        "dropped": scenes.in_hand(cells, normal_force=scenes.in_hand_load(2), centre_of_mass=(0.025, 0.0), t_end=0.55),
        "drift": scenes.drift(small, t_end=0.4),
        "drift, normal": scenes.drift(small, load="normal", t_end=1.2),
        "free slide": scenes.free_slide(small, twist=(0.3, 0.1, 20.0), angle=0.1),
        "soft slide": scenes.free_slide(soft, twist=(0.05, 0.0, 2.0), mass=0.15, t_end=0.1),
        "driven": scenes.driven(pf.ReducedModel(PUBLISHED_PATCHES["LineGrad"](), LAW, cells=6), t_end=1.0),
        "driven at the origin": scenes.driven(soft, twist=turn, at="origin", normal_force=fading, t_end=0.3),
        "pushed": scenes.pushed(small, pad=cells, t_end=0.4),
        "pivot": scenes.pivot(small, t_end=0.5),
        "foot": scenes.foot(small, t_end=0.5, share=0.4),
        "curling": scenes.curling(pf.ReducedModel(pf.ContactPatch.ring(0.06, 0.065, 13), LAW, cells=8), t_end=1.0),
        "two": pf.Scene(plate, two, 0.3, force=[0.1, 0.0, 1e-3], springs=[spring], save_every=0.02, name="two"),
        "held": pf.Scene(plate_at_rest(), two[1:], 0.2, force=[0.3, 0.1, 1e-3], start="equilibrium", name="held"),
        "bent": held_by_two(),
        "sliding": pf.Scene(plate, tilted, 0.2, start="sliding", name="sliding"),
        "edge": pf.Scene(plate, edge, 0.3, name="edge"),
    }  # fmt: skip


def plate_at_rest() -> pf.Body:
    """Make a plate that nothing moves but what is applied to it."""
    return pf.Body(
        0.3, 4e-4, (0.01, 0.0), 0.2, gravity=(0.0, 0.0), outline=synthetic.PLATE
    )


@functools.cache
def solved() -> dict[str, pf.Solution]:
    """Simulate all these scenes, with their bristles."""
    return {
        name: pf.simulate(scene, bristles="all", rtol=1e-6)
        for name, scene in ready().items()
    }


def scenes() -> dict[str, Any]:
    """Tell scenes as they are written, their motions and slips, and signals."""
    told: dict[str, Any] = {}
    for name, run in solved().items():
        contacts = [each.name for each in run.scene.contacts]
        bristles = [
            str(each) for each in run.data.data_vars if str(each).startswith("bristles")
        ]
        text = re.sub(r", \d+ steps in .* ms\)", "", repr(run))
        told[name] = {
            "repr": [repr(run.scene), text, *map(repr, run.scene.contacts)], "data": as_arrays(run.scene.to_dict()),
            "html": without_picture(notebook.scene_html(run.scene)), "breaks": run.scene.breaks(),
            "motion": run.data.drop_vars(bristles), "bristles": len(bristles),
            "twists": [run.contact_twist(each) for each in contacts], "slips": [*run.slip_events()],
            "status": [run.status, run.message],
        }  # fmt: skip
    steps = pf.Signal.sampled(
        [0.0, 0.5, 1.0, 1.5, 2.0],
        [[1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0], [0.0, 3.0]],
    )
    lines = dataclasses.replace(steps, times=[0.2, 0.5, 1.0, 1.2, 2.0], hold="linear")
    sine = pf.Signal.sine(1.0, 0.5, 2.0, t_end=0.6, phase=0.3)
    at = np.array([0.0, 0.2, 0.35, 1.0, 1.1, 2.0, 3.0])
    for name, each in {"steps": steps, "lines": lines, "sine": sine}.items():
        ends = np.union1d([0.0, 4.0], each.breaks)
        parts = [
            repr(each),
            each.to_dict(),
            each(at),
            each.left(at),
            each.breaks,
            *each.pieces(ends),
        ]
        told[f"signal, {name}"] = [
            *parts,
            each.held(0.3).to_dict(),
            displacement(each, at),
        ]
    about = np.array(
        [
            0.0,
            0.5 * SAME_TIME,
            0.1,
            0.1 + 0.5 * SAME_TIME,
            0.2,
            0.3 - 0.5 * SAME_TIME,
            0.3,
            0.4,
        ]
    )
    counts = [sample_count(1.0, step, "dt") for step in (0.1, 0.3, 1.0)]
    return told | {
        "breaks": breaks_between(about, 0.3),
        "counts": counts,
        "times": sample_times(0.35, 0.1),
    }


def without_picture(page: str) -> str:
    """Return HTML without the bytes of its pictures."""
    return re.sub(r'src="data:[^"]*"', "src", page)


def films() -> dict[str, Any]:
    """Tell the words and data of frames, tables in notebooks, and surfaces to be turned."""
    told: dict[str, Any] = {}
    for name in ("two", "free slide", "driven at the origin"):
        run = solved()[name]
        end = float(run.histories["time"].values[-1])
        track = tracks.track_of(run, np.linspace(0.0, end, 5))
        film = Film(
            run, track, follow=name == "free slide", pace="   (2 x slower)", dpi=40.0
        )
        frames = []
        for frame in (1, 4):
            film.picture(frame)
            frames.append(recorded.figure(film.figure))
        told[name] = [
            frames,
            [vars(each) | {"contact": None} for each in track.contacts],
            film.views,
        ]
        told[f"{name}, page"] = re.sub(
            r"\d+ steps, .* ms", "", without_picture(notebook.solution_html(run))
        )
    sampled = np.linspace(0.0, 1.0, 5)
    paces = [
        (span, slow, fps)
        for span in (0.0, 1e-3, 0.7, 4.0, 90.0)
        for slow in (None, 0.5, 1.0, 4.0)
        for fps in (12.0, 50.0)
    ]
    for span, slow, fps in paces:
        with contextlib.suppress(pf.FrictionError):
            times, words = frame_times(0.2 + span * sampled, slow, fps)
            told[f"{span} s, {slow}, {fps} Hz"] = [
                len(times),
                float(times[0]),
                float(times[-1]),
                words,
            ]
    with mock.patch.object(tracks, "MOST_STEPS", 7):
        track = tracks.track_of(solved()["pivot"], np.linspace(0.0, 0.5, 4))
        told["few steps"] = [
            [*each.slip, each.loads, each.wrenches]
            for each in track.contacts
            if each.slip
        ]
    told["gif"] = moving_picture()
    made = made_patches()
    told["patches"] = {
        name: without_picture(notebook.patch_html(patch))
        for name, patch in made.items()
    }
    surfaces = [
        kind(made["corner"])
        for kind in (
            pf.LimitSurfaceExact,
            pf.LimitSurfaceTable,
            pf.LimitSurfaceEllipsoid,
        )
    ]
    told["surfaces"] = [
        without_picture(notebook.surface_html(each)) for each in surfaces
    ]
    turned = interactive_limit_surface(
        pf.LimitSurfaceTable(made["corner"]), beside=surfaces[0]
    )
    told["turned"] = [
        [each.name, each.type, each.x, each.y, each.z, each.hovertemplate]
        for each in turned.data
    ]
    scene = turned.layout.scene
    told["axes"] = [
        [axis.title.text, list(axis.range)]
        for axis in (scene.xaxis, scene.yaxis, scene.zaxis)
    ]
    told["laws"] = [
        without_picture(notebook.law_html(each)) for each in (LAW, pf.Dahl(0.6))
    ]
    told["models"] = [
        without_picture(notebook.model_html(each)) for each in _models(made)
    ]
    return told


def moving_picture() -> list[Any]:
    """Write pictures of a few colours as a GIF, which keeps them all; returns its pictures and their times [ms]."""
    i, j = np.mgrid[:4, :10]
    levels = lambda number: np.stack([20 * i, 15 * j, 30 * number + 0 * i], -1).astype(
        np.uint8
    )
    file = io.BytesIO()
    write_frames(Path("film.gif"), file, levels, 5, 12.0)
    with Image.open(file) as film:
        frames = [
            (each.info["duration"], np.asarray(each.convert("RGB")))
            for each in ImageSequence.Iterator(film)
        ]
    assert all(
        (picture == levels(number)).all() for number, (_, picture) in enumerate(frames)
    )
    return [len(frames), [time for time, _ in frames]]


def _models(made: dict[str, pf.ContactPatch]) -> list[Any]:
    return [pf.ReducedModel(made["disc"], LAW), pf.DistributedModel(made["soft"], LAW)]
