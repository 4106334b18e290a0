"""Lines with which bad calls of fits, plans, controllers and sweeps are refused, to be recorded: see `recording`."""

from __future__ import annotations

import contextlib
import dataclasses
import re
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import planarfriction as pf
from planarfriction import export, plots, sweeps
from planarfriction.errors import FrictionError
from planarfriction.identify import (
    FitOptions,
    Log,
    MassProperties,
    Slide,
    candidate_motions,
    design_experiment,
    differentiated,
    identify_lugre,
    identify_motion,
)
from planarfriction.joints import JointLog
from planarfriction.online import (
    FrictionObserver,
    Hinge,
    Hold,
    Measurement,
    Sensors,
    SlideBy,
    TurnBy,
)
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
from planarfriction.sweeps.settings import Settable
from tests.support.rate_laws import BoucWen

PATCH, LAW = (
    pf.ContactPatch.disc(0.01, cells=7),
    pf.LuGre(mu_c=0.5, mu_s=0.6, elasto_plastic=0.9),
)
SOFT = pf.ContactPatch.disc(
    0.012, cells=7, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0)
)
MODEL = pf.ReducedModel(PATCH, LAW)
TIME, HALF = np.arange(300) / 100.0, np.radians(30.0)
ANGLE = 3.0 * TIME
LOG = Log(TIME, TIME[:, None] * [0.01, 0.0, 1.0], np.full((300, 3), -0.1), 2.0)
FREE = Slide(
    TIME[:50],
    np.stack([TIME[:50] - TIME[:50] ** 2, 0.0 * TIME[:50], 0.0 * TIME[:50]], -1),
)
FIXED, BOUC = pf.LuGre(mu_c=0.5, reference_load=2.0), BoucWen()
TILTED = pf.ContactPatch.disc(0.01, cells=7)
LEANING = pf.ReducedModel(PATCH.with_friction_metric(None, (0.1, 0.0)), LAW)
BODY = MassProperties(0.4, 8e-4)
DOWN, POINT = (0.0, 1.0, 0.0), pf.ContactPatch.points([(0.0, 0.0)])
SQUARE = [(-0.05, -0.05), (0.05, -0.05), (0.05, 0.05), (-0.05, 0.05)]
SURFACE = pf.LimitSurfaceEllipsoid(PATCH)
COLUMNS = "t,vx,vy,omega,fx,fy,tau,normal_force\n"


def wrapped(angle: np.ndarray) -> np.ndarray:
    """Return an angle within half a turn of zero."""
    return np.mod(angle + np.pi, 2.0 * np.pi) - np.pi


def changed(**fields: Any) -> Log:
    """Return the log with other fields."""
    return dataclasses.replace(LOG, **fields)


def turned(angle: np.ndarray) -> np.ndarray:
    """Take slopes of a motion with an angle."""
    return differentiated(TIME, np.stack([TIME, TIME, angle], -1))


def read(text: str, kind: Any = Log, **options: Any) -> Any:
    """Read a log from a file of that text."""
    Path("log.csv").write_text(text, encoding="utf-8")
    return kind.from_csv("log.csv", **options)


def fit(**given: Any) -> Any:
    """Fit the log with arguments and options."""
    names = {field.name for field in dataclasses.fields(FitOptions)} & given.keys()
    return identify_lugre(
        LOG,
        PATCH,
        options=FitOptions(**{name: given.pop(name) for name in names}),
        **given,
    )


def plate(**changes: Any) -> pf.Scene:
    """Return a scene of a held plate with changes."""
    scene = pf.scenes.in_hand(
        MODEL, centre_of_mass=(0.025, 0.0), normal_force=4.0, t_end=1.0
    )
    return dataclasses.replace(scene, **changes)


def gripped(goal: Any = {"angle": -HALF}, scene: Any = None, **options: Any) -> Any:  # noqa: B006
    """Plan a grip of the plate, or of another scene."""
    return plan_grip(plate() if scene is None else scene, goal, **options)


def pushed(
    slider: Any = None, pusher: Any = None, path: Any = None, **options: Any
) -> Any:
    """Push a square."""
    path = path or pf.Signal.sampled([0.0, 1.0], [[-0.06, 0.0], [0.0, 0.0]], "linear")
    return push(slider or Slider(SURFACE, SQUARE), pusher or Pusher(), path, **options)


def swept(make: Any = None, values: Any = {"grip": [1.0, 2.0]}, **options: Any) -> Any:  # noqa: B006
    """Sweep the plate over grips."""
    return sweeps.sweep(make or (lambda grip: plate(t_end=0.01)), values, **options)


def observer(**options: Any) -> FrictionObserver:
    """Make an observer."""
    return FrictionObserver(MODEL, **options)


def estimate() -> Any:
    """Return an estimate after one sample."""
    return observer().update(Measurement(0.0, np.zeros(3), 1.0))


CALLS: dict[str, list[Callable[[], Any]]] = {
    "logs": [
        lambda: changed(time=TIME[::-1]), lambda: Log.from_motion(TIME[:4], np.zeros((4, 3)), np.zeros((4, 3)), 1.0),
        lambda: JointLog(TIME, TIME), lambda: changed(wrench=LOG.wrench[:, :2]), lambda: changed(normal_force=-1.0),
        *(lambda name=name, value=value: changed(**{name: value}) for name, value in (
            ("held", "yes"), ("held", 2), ("held", np.nan), ("held", np.ones(3)), ("turns", -1), ("turns", 0.5),
            ("name", 3),
        )),
        lambda: Log.from_motion(TIME, np.zeros((300, 3)), np.zeros((300, 3)), 1.0, name=10**5000),
        lambda: Log.from_axis(TIME, TIME, 1.0), lambda: differentiated(np.zeros(20), np.zeros((20, 3))),
        lambda: turned(np.where(TIME < 2.0, ANGLE, ANGLE + 2.0)),
        lambda: turned(np.where(TIME < 2.0, ANGLE, ANGLE + np.pi)),  # of a rectangle that looks the same
        lambda: turned(np.degrees(wrapped(ANGLE))),
        lambda: turned(np.where(TIME < 2.0, ANGLE, ANGLE + 4.0 * np.pi)),  # one jump of an angle that goes on
        lambda: turned(wrapped(60.0 * ANGLE)),
        lambda: turned(wrapped(130.0 * ANGLE)),  # it would seem to turn the other way
        lambda: Slide(TIME[::-1], FREE.pose), lambda: Slide(TIME[:50], FREE.pose[:, :2]),
        lambda: Slide(TIME, np.stack([TIME, TIME, np.degrees(wrapped(ANGLE))], -1)), lambda: MassProperties(0.0, 1.0),
    ],
    "files": [
        lambda: read(""), lambda: read("t,vx,vy,omega,fx,fy\n0,0,0,0,0,0\n"),
        lambda: read(f"{COLUMNS}0,0,0,0,left,0,0,1\n"), lambda: read(f"# made\n{COLUMNS}0,0,0,0,0,0,0\n"),
        lambda: read(f"{COLUMNS}0,0,0,nan,0,0,0,1\n"), lambda: read(f"t,{COLUMNS}0,0,0,0,0,0,0,0,1\n"),
        lambda: read(f"{COLUMNS}0,0,0,0,0,0,0,1\n"),
        lambda: read("t,vx,vy,fx\n" + "".join(f"{k},1,1,-1\n" for k in range(20)), normal_force=1.0),
        lambda: read("t,q\n" + "".join(f"{k},{k}\n" for k in range(20)), JointLog),
        lambda: read("t,x,torque\n0,0,0\n", JointLog), lambda: read("t [s],q [deg],torque [N m]\n0,0,0\n", JointLog),
    ],
    "fits": [
        *(lambda given=given: fit(**given) for given in (
            {"parameters": ("mu",)}, {"parameters": ()}, {"parameters": ("mu_c", "mu_c")}, {"parameters": ("c",)},
            {"parameters": ("c", "contact_radius")}, {"noise": [1.0, 0.0, 1.0]}, {"begins": "moving"}, {"starts": 0},
            {"start": {"mu": 0.5}}, {"start": 3}, {"surface": "table"}, {"surface": pf.ReducedModel}, {"samples": 10},
            {"model": "best"}, {"nuisance": ("delays",)}, {"nuisance": "bias"},
        )),
        lambda: identify_lugre(LOG, PATCH, options={"starts": 1}),
        lambda: identify_lugre(LOG, MODEL), lambda: identify_lugre([], PATCH),
        lambda: identify_lugre(changed(normal_force=0.0), PATCH),
        lambda: identify_motion(FREE, PATCH, BODY, start=3),
        lambda: identify_lugre(LOG, SOFT, model="distributed"), lambda: identify_lugre(LOG, POINT),
        lambda: identify_lugre(changed(wrench=0.0 * LOG.wrench, name="dead"), PATCH),
        lambda: identify_lugre(changed(normal_force=1.0 + TIME), SOFT),
        lambda: identify_motion([], PATCH, BODY), lambda: identify_motion(FREE, PATCH, 0.37),
        lambda: identify_motion(FREE, PATCH, BODY, parameters=("sigma_0",)),
        lambda: identify_motion(FREE, PATCH, BODY, samples=2),
    ],
    "plans of experiments": [
        *(lambda given=given: design_experiment(PATCH, LAW, **given) for given in (
            {"parameters": ["mu"]}, {"parameters": ["mu_c"], "wanted": ["v_s"]},
            {"motions": changed(twist=0 * LOG.twist)}, {"noise": (1.0, 0.0, 1.0)}, {"nuisance": ["lag"]},
            {"motions": []}, {"motions": 3}, {"parameters": 3},
        )),
        *(lambda given=given: design_experiment(PATCH, pf.LuGre(mu_c=0.5), **given) for given in (
            {"parameters": ["mu_c", "breakaway_ratio"]}, {"parameters": ["c"]},
        )),
        *(lambda given=given: candidate_motions(PATCH, LAW, **given) for given in (
            {"speed": 0.0}, {"spin": -1.0}, {"duration": 0.01}, {"rate": 1e9}, {"normal_force": 0},
            {"normal_force": []},
        )),
    ],
    "grips": [
        lambda: gripped({"angle": HALF}, knots=4), lambda: gripped({"angle": 1.0, "slide": (0, 1)}),
        lambda: gripped({"turn": 1.0}), lambda: gripped({"angle": 0.0}),
        lambda: gripped({"angle": -1.0}, plate(start="equilibrium", contacts=[
            dataclasses.replace(plate().contacts[0], normal_force=2.0)])),
        lambda: gripped(scene=dataclasses.replace(pf.scenes.free_slide(MODEL), stop_speed=None, start="sliding")),
        *(lambda given=given: gripped(**given) for given in (
            {"bounds": (0.1, 4.0)}, {"bounds": (4.0, 2.0)}, {"knots": [0.0, 0.2, 0.1, 0.4]}, {"aim": "best"},
            {"friction": -0.1}, {"friction": 1.0}, {"contact": "thumb"}, {"scene": pf.scenes.driven(MODEL)},
            {"scene": 3},
        )),
        lambda: gripped(scene=plate(body=dataclasses.replace(plate().body, gravity=(0.0, 0.0)))),
        lambda: holding_load(DOWN, PATCH, 0.0), lambda: holding_load(DOWN, PATCH, 1.0, margin=-0.1),
        lambda: holding_load((0.0, 1.0), PATCH, 1.0), lambda: holding_load((0.0, 1.0, 0.1), POINT, 1.0),
        lambda: holding_load(DOWN, None, 1.0),
        lambda: dynamic_holding_load(DOWN, PATCH), lambda: dynamic_holding_load((0.0, 1.0), MODEL),
        lambda: dynamic_holding_load(DOWN, pf.DistributedModel(PATCH, pf.CoulombStribeck(mu_c=1.0))),
        lambda: dynamic_holding_load((0.0, 1.0, 0.1), pf.DistributedModel(POINT, LAW)),
        *(lambda given=given: dynamic_holding_load(DOWN, MODEL, **given) for given in (
            {"fall": 1.000000000001}, {"ramp": -1.0}, {"mass": 0.0}, {"inertia": -1.0}, {"margin": -1.0},
        )),
    ],
    "pushes": [
        lambda: Slider(SURFACE, [[0, 0], [1, 0], [0.2, 0.2], [0, 1]]), lambda: Slider(PATCH, SQUARE),
        lambda: Slider(SURFACE, SQUARE[:2]),
        lambda: Pusher(-0.1), lambda: pushed(path=pf.Signal.sampled([0.0, 1.0], [[0.0, 0.0], [0.1, 0.0]], "linear")),
        lambda: pushed(path=pf.Signal.constant([0.0, 0.0])), lambda: pushed(pusher=Pusher(0.1, 0.02)),
        lambda: pushed(rtol=0.0), lambda: motion_cone(SURFACE, (0.0, 0.0), (0.0, 0.0), 0.1),
        *(lambda given=given: plan_push(Slider(SURFACE, SQUARE), *given[0], **given[1]) for given in (
            ((Pusher(), (0.1, 0.0, 0.0)), {}), ((Pusher(0.3), (0.0, 0.0, 0.0)), {}),
            ((Pusher(0.3), (0.1, 0.0, 0.0)), {"margin": 1.0}), ((Pusher(0.3), (0.1, 0.0, 0.0)), {"edges": [4]}),
        )),
    ],
    "online": [
        lambda: FrictionObserver(PATCH), lambda: FrictionObserver(LEANING), lambda: observer(tolerance=0.0),
        lambda: observer(sensors=Sensors),
        lambda: observer(batch=2).update(Measurement(0.0, np.zeros((3, 3)), 1.0)), lambda: Sensors(quantum=0.0),
        lambda: estimate().interval(1.0), lambda: Hold(None), lambda: Hold(observer(), probability=0.7),
        lambda: SlideBy(observer(), 0.0), lambda: TurnBy(observer(), []),
        lambda: TurnBy(observer(), 1.0, duration=-1.0), lambda: Hinge(observer()).update(5.0),
        lambda: Hinge(observer(), reserve=0.0),
        *(lambda kind=kind, goal=goal: kind(observer(sensors=Sensors(slip_rate=0.0)), *goal) for kind, goal in (
            (SlideBy, [0.1]), (TurnBy, [0.1]), (Hinge, []),
        )),
    ],
    "sweeps": [
        *(lambda values=values: swept(values=values) for values in (
            {}, {"": [1.0]}, {"grip": 1.0}, {"grip": []}, {"grip": [1.0, 1.0]}, {"grip": [1.0, "a"]}, {"grip": [PATCH]},
            {"grop": [1.0]},
        )),
        lambda: swept(lambda status: plate(t_end=0.01), {"status": [1.0]}),
        lambda: swept(lambda time: plate(t_end=0.01), {"time": [1.0]}), lambda: swept(lambda grip: 1.0),
        lambda: swept(3), lambda: swept(measure=3), lambda: swept(measure=lambda run: {"status": 1.0}),
        lambda: swept(measure=lambda run: {3: 1.0}),
        lambda: swept(values={"grip": range(1, 10**4), "time": range(10**5)}),
        lambda: swept(measure=lambda run: object()),
        lambda: swept(progress=float), lambda: swept(executor=3), lambda: swept(lambda grip: 1 / 0),
        lambda: swept(out="runs.zarr"), lambda: swept(out="a\nb"),
        *(lambda path=path, value=value: Settable(plate())(**{path: value}) for path, value in (
            ("body.mas", 1.0), ("finger.law.mu_c", 1.0), ("fingers.lwa.mu_c", 1.0), ("fingers.law.mu", 1.0),
            ("fingers.patch.radios", 1.0), ("body.position.2", 1.0), ("body.position.x", 1.0), ("body.mass.x", 1.0),
            ("body", 1.0), ("fingers", 1.0), ("force.values", 1.0), ("body.mass", -1.0), ("body.mass", "heavy"),
            ("", 1.0),
        )),
        lambda: swept(plate(), {"body.mas": [1.0]}), lambda: swept(plate(), {"body.mass": [-1.0]}),
    ],
    "patches and models": [
        lambda: dataclasses.replace(PATCH, cell_size=(-1e-3, 1e-3)), lambda: pf.DistributedModel(SOFT, FIXED),
        lambda: pf.ContactPatch.rectangle(0.02, cells=3, pressure=np.ones(4)),
        lambda: BOUC.rate(np.ones((2, 3)), 0.1, 1.0, axis=-1),
        lambda: plots.plot_limit_surface(SURFACE, ax=Figure().add_subplot()),
        lambda: TILTED.weights(2.0, moments=np.zeros((10**7, 2))),
        lambda: export.export_c(LEANING, "pad"),
    ],
}  # fmt: skip
"""Bad calls by their subject."""


def refused() -> dict[str, list[str]]:
    """Tell the line with which each call is refused."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        return {name: [line(call) for call in calls] for name, calls in CALLS.items()}


def line(call: Callable[[], Any]) -> str:
    """Return class and text of the error that a call raises."""
    try:
        return f"accepted: {type(call()).__name__}"
    except FrictionError as error:
        return re.sub(r"0x\w+|/\S*/tmp\w+", "#", f"{type(error).__name__}: {error}")
