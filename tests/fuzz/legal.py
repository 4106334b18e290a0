"""Every public constructor, factory and method, found by itself, with legal arguments to replace one by one."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import types
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import planarfriction as pf

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
LAW = pf.LuGre(mu_c=1.0, mu_s=1.2, elasto_plastic=0.9)
PATCH = pf.ContactPatch.disc(0.01, 5)
DISCS = pf.ReducedModel(PATCH, LAW, cells=4)
SOFT = pf.ContactPatch.disc(0.01, 5, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0))
TWISTS = np.linspace([0.0, 0.0, 0.1], [0.01, 0.005, 1.0], 20)
TIMES = np.linspace(0.0, 0.19, 20)
SQUARE = [(-0.01, -0.01), (0.01, -0.01), (0.01, 0.01), (-0.01, 0.01)]

TACTILE = (
    "forces",
    "tractions",
    "slip_ratio",
    "slipping_area",
    "markers",
    "displacement",
    "read",
)
"""Functions of `tactile`."""

SKIPPED = {
    "warm_up": "compiles for minutes",
    **{
        f"Pad.{name}": "is called by models alone, which check"
        for name in ("check", "pieces", "compliance", "shares")
    },
    "plots.animate_solution": "draws for seconds; tests/plots/test_animation.py attacks it",
    "plots.interactive_limit_surface": "needs plotly; checks what plot_limit_surface checks",
    "Solution.animate": "draws for seconds; tests/plots/test_animation.py attacks it",
    "solvers.integrate": "is called by `simulate` alone, which checks",
    "FrictionError": "an error",
    "identify.identify_motion": "fits for seconds; its logs are attacked as files",
    "planning.plan_grip": "plans for a second; tests/planning/test_grip.py attacks it",
    "planning.plan_push": "plans for seconds; tests/planning/test_pushing.py attacks it",
    "identify.identify_lugre": "fits for seconds; its logs are attacked as files",
    "identify.identify_pad": "fits for a second; tests/identify/test_pads.py attacks it",
    "identify.current_estimate": "takes what a fit returns",
    "joints.identify_joint": "fits for a second; tests/joints attacks it",
    "joints.apply_to_spec": "takes a model of MuJoCo; see tests/joints/test_joint_hosts.py",
    "joints.set_level": "takes a model of MuJoCo; see tests/joints/test_joint_hosts.py",
    "sweeps.finished_runs": "reads a folder of `sweep`; tests/sweeps attacks it",
}
"""Not attacked, and why."""

UNCHECKED = {
    "scenes.foot": "torque",  # a foot that turns a million times takes as long
}
"""Arguments of which some wrong ones ask for more than a minute: not attacked."""

RECORDS = """
    Rollout RolloutVJP RolloutJacobian RolloutStates RolloutTangent RolloutJVP SceneGradient SceneSensitivities
    Identification Verdict MotionPlan GripPlan GripReport HoldPlan Push PushPlan PushReport Solution Progress
    SurfaceComparison ModelJacobians PackedModel StepJacobians Statistics Integration
    GridError LimitSurface FrictionLaw RateLaw FrictionModel Pressure HostStep Measurement Estimate
    JointFit Markers PadFit
"""
"""Classes that the library makes itself, bases of families, and `HostStep` and `Measurement`, which
are checked where they are used."""


PROTOCOL = """
    direction direction_slope sums lever_coordinates packed relative ever_loaded only repeated shape_at shapes_at
    parts_at pieces check_non_negative packed_parts plan bristle_traction functions
    contact frame_of labelled pressures place
"""
"""Methods that the library calls, with what it has checked."""


class Fresh(NamedTuple):
    """An argument that a call may change, or that takes time to make."""

    make: Callable[[], Any]


MEASURING = "FrictionObserver", "Hold", "Hinge", "SlideBy", "TurnBy"
"""Classes that take measurements."""


class Target(NamedTuple):
    """Something that a user calls."""

    name: str
    call: Callable[..., Any]
    arguments: dict[str, Any]
    """Legal ones, by name."""


def _recorded() -> pf.Solution:
    """Return a solution with the bristles of its only contact."""
    return pf.simulate(pf.scenes.driven(DISCS, t_end=0.02), bristles="all")


def _log_file(path: str) -> str:
    """Write a log, and return its path."""
    rows = np.column_stack([TIMES, TWISTS, -TWISTS, np.full(len(TIMES), 2.0)])
    np.savetxt(
        path,
        rows,
        delimiter=",",
        header="t,vx,vy,omega,fx,fy,tau,normal_force",
        comments="",
    )
    return path


def _joint_file(path: str) -> str:
    """Write a log of a joint, and return its path."""
    np.savetxt(
        path,
        np.column_stack([TIMES, np.sin(20.0 * TIMES), TIMES]),
        delimiter=",",
        header="t,q,torque",
        comments="",
    )
    return path


@functools.cache
def objects() -> dict[str, Any]:
    """Legal values by the name of the parameter, and one instance of each class by the name of the class."""
    model = pf.ReducedModelPublished(PATCH, LAW)
    soft = pf.ReducedModelPublished(SOFT, LAW)
    scene = pf.scenes.driven(model, t_end=0.02)
    solution = pf.simulate(scene)
    time = np.linspace(0.0, 0.2, 21)
    pose = np.stack([0.1 * time - 0.2 * time**2, 0.0 * time, 0.5 * time], 1)
    log = pf.identify.Log(TIMES, TWISTS, -TWISTS, 2.0)
    surface = pf.LimitSurfaceCells(PATCH)
    signal = pf.Signal.sampled([0.0, 0.1], [1.0, 2.0])
    turned = pf.joints.JointLog(
        TIMES, np.sin(20.0 * TIMES), torque=np.cos(20.0 * TIMES)
    )
    watcher = pf.online.FrictionObserver(
        pf.ReducedModel(PATCH, LAW, cells=9), surface=pf.LimitSurfaceEllipsoid(PATCH)
    )
    return {
        # parts
        "patch": PATCH, "law": LAW, "model": model, "scene": scene, "solution": solution, "solutions": solution,
        "surface": surface, "reference": surface, "slide": pf.identify.Slide(time, pose),
        "contacts": [pf.Contact(model, 1.0)], "beside": pf.LimitSurfaceEllipsoid(PATCH), "method": pf.solvers.RODAS3,
        "body": pf.Body(1.0, 0.01), "progress": lambda *_: None, "max_steps": 100_000, "batch": (2, 3),
        "make": lambda: None, "words": "words",
        # numbers
        "mass": 1.0, "inertia": 0.01, "radius": 0.01, "width": 0.02, "height": 0.01, "length": 0.02,
        "shear_modulus": 2e5, "thickness": 1e-3, "poisson_ratio": 0.4, "stiffness": 1e4, "inner_radius": 0.005,
        "outer_radius": 0.01, "cells": 5, "mu": 0.5, "mu_c": 0.5, "mu_s": 0.6, "t_end": 0.02, "angle": 0.1,
        "along": 0.4, "across": 0.6, "c": 0.006, "n": 0.3, "k": 2.0, "normal_force": 2.0, "sigma_0": 1e5,
        "sigma_1": 100.0, "sigma_2": 0.1, "v_s": 1e-3, "dt": 1e-3, "time": TIMES, "cell_size": 0.001, "offset": 2.0,
        "amplitude": 1.0, "frequency": 2.0, "count": 2, "degree": 2, "parts": 2, "refined": 2, "x_min": 0.0,
        "y_min": 0.0, "cell_width": 0.001, "cell_height": 0.001, "columns": 5, "rows": 5, "load": 1, "speed": 0.01,
        "spin": 1.0, "segments": 5, "samples": 20, "save_every": 0.01, "stop_speed": 1e-4, "grip": 30.0,
        "margin": 0.5, "ramp": 0.01, "fall": 2.0, "rtol": 1e-4, "atol": 1e-3, "t": 0.05, "elasto_plastic": 0.9,
        "breakaway_ratio": 0.5, "radius_max": 0.02, "acceleration": 3.0, "share": 0.5, "forefoot": model,
        "size": (0.15, 0.08),
        # arrays
        "positions": [(0.0, 0.0), (0.01, 0.0), (0.0, 0.01)], "areas": [1e-6] * 3, "weights": [1.0, 2.0, 3.0],
        "position": (0.0, 0.01), "vertices": [(0, 0), (0.01, 0), (0, 0.01)],
        "outline": [(0.0, 0.0), (0.1, 0.0), (0.0, 0.1)], "gradient": (5.0, 2.0), "centre_of_mass": (0.002, 0.0),
        "deflections": np.zeros((2, PATCH.cells)), "loads": [1.0, 2.0], "values": [1.0, 2.0], "times": [0.0, 0.1],
        "value": 2.0, "twist": TWISTS[9], "wrench": np.array([0.5, 0.1, 0.001]), "state": Fresh(lambda: np.zeros(3)),
        "options": pf.scenes.SolverOptions(rtol=1e-4, atol=1e-3), "wrenches_bar": np.ones((20, 3)),
        "state_bar": np.zeros(3), "metric": np.eye(2) * 0.25, "asymmetry": (0.1, 0.0), "moments": (1e-3, -2e-3),
        "motion": TWISTS,
        # choices and texts
        "name": "name", "at": "origin", "on_load_change": "keep", "data": Fresh(lambda: PATCH.to_dict()),
        # instances, for their methods
        "ContactPatch": SOFT, "Coulomb": pf.Coulomb(0.5), "CoulombStribeck": pf.CoulombStribeck(), "Dahl": pf.Dahl(),
        "LuGre": LAW, "DistributedModel": pf.DistributedModel(PATCH, LAW), "ReducedModelPublished": soft,
        "ReducedModel": DISCS, "Signal": signal, "Scene": scene, "SlidingBody": pf.SlidingBody(0.2, 1e-4, DISCS),
        "Spring": pf.Spring(10.0), "MapReading": pf.patch.MapReading(), "Solution": solution,
        "Grid": pf.patch.Grid.around_origin(0.02, 0.02, 5, 5), "SoftFinger": SOFT.pressure,
        "Slide": pf.identify.Slide(time, pose), "Log": log, "Uniform": pf.Uniform(),
        "LinearGradient": pf.LinearGradient((5.0, 2.0)), "PressureMaps": pf.PressureMaps([1.0, 2.0], np.ones((2, 3))),
        "PerCell": pf.patch.PerCell([1.0, 2.0, 3.0]), "Pad": pf.Pad.layer(2e5, 1e-3),
        "Layer": pf.Pad.layer(2e5, 1e-3), "HalfSpace": pf.Pad.half_space(2e5), "Measured": pf.Pad.measured(1e4),
        "AtLoad": pf.Pad.at_load(2.0), "Pieces": pf.pads.Pieces(np.full(PATCH.cells, 1e4)),
        "Drive": pf.joints.Drive(100.0, 7.0), "Plant": pf.joints.Plant(inertia=0.05), "JointLog": turned,
        "JointFriction": pf.joints.JointFriction(0.5), "tau_motor": 0.3, "tau_external": -0.1,
        "FrictionObserver": watcher, **{name: getattr(pf.online, name)(watcher) for name in ("Hold", "Hinge")},
        **{name: getattr(pf.online, name)(watcher, 0.02) for name in ("SlideBy", "TurnBy")},
        "Sensors": pf.online.Sensors(), "Slider": pf.planning.Slider(pf.LimitSurfaceEllipsoid(PATCH), SQUARE),
        **{name: getattr(pf, name)(PATCH) for name in pf.__all__ if name.startswith("LimitSurface")},
    }  # fmt: skip


SPECIAL: dict[str, dict[str, Any]] = {
    "Contact": {"pressure": "fixed", "height": 0.0},
    "SlidingBody": {"models": DISCS, "positions": (0.0, 0.0)},
    "SlidingBody.step": {
        "loads": None,
        "state": Fresh(lambda: np.zeros(np.prod(DISCS.state_shape))),
        "twist": (0.01, 0.0, 0.1),
        "normal_force": 1.0,
        "wrench": (0.0, 0.0, 0.0),
        "support_velocity": (0.0, 0.1, 0.2),
    },
    **{
        f"tactile.{name}": {
            "model": DISCS,
            "state": np.zeros(DISCS.state_shape),
            "twist": (0.01, 0.0, 0.1),
            "normal_force": 1.0,
            "above": 0.9,
            "points": [[0.0, 0.001]],
            "markers": Fresh(lambda: pf.tactile.markers(DISCS, [[0.0, 0.001]])),
            "solution": Fresh(_recorded),
        }
        for name in TACTILE
    },
    "plots.plot_slip": {"times": [0.0, 0.01], "size": None},
    "Spring": {"stiffness": 10.0, "at": (0.0, 0.0)},
    "Slider": {"outline": SQUARE},
    "Slider.gaps": {"point": (0.0, 0.0)},
    "planning.motion_cone": {"at": (-0.01, 0.002), "normal": (1.0, 0.0)},
    "planning.push": {
        "slider": Fresh(lambda: objects()["Slider"]),
        "pusher": Fresh(lambda: pf.planning.Pusher(0.3)),
        "path": pf.Signal.sampled(
            [0.0, 1.0], [[-0.015, 0.0], [-0.005, 0.002]], "linear"
        ),
        "start": (0.0, 0.0, 0.0),
        "samples": 5,
    },
    "online.FrictionObserver": {
        "model": pf.ReducedModel(PATCH, LAW, cells=9),
        "batch": (),
        "surface": pf.LimitSurfaceEllipsoid(PATCH),
    },
    **{
        f"online.{name}": {
            "measurement": pf.online.Measurement(
                0.1, (0.0, 1.0, 0.0), 4.0, (0.0, 0.01, 0.0)
            )
        }
        for name in (f"{each}.update" for each in MEASURING)
    },
    **{
        f"online.{name}": {
            "observer": Fresh(lambda: objects()["FrictionObserver"]),
            "goal": 0.02,
            "start": 20.0,
        }
        for name in ("Hold", "Hinge", "SlideBy", "TurnBy")
    },
    "PressureMaps": {"values": np.ones((2, 3))},
    "patch.PerCell": {"values": [1.0, 2.0, 3.0]},
    "ContactPatch.from_pressure": {
        "pressure": np.ones((3, 3)),
        "loads": None,
        "width": None,
    },
    "Log.from_axis": {
        "time": TIMES,
        "force": -TWISTS[:, 0],
        "velocity": TWISTS[:, 0],
        "position": None,
    },
    "Spring.pull": {"time": TIMES, "pose": TWISTS},
    "ContactPatch.discs": {"n": None},
    "ContactPatch": dict.fromkeys(("metric", "asymmetry", "cell_size")),
    "Scene.from_dict": {"data": Fresh(lambda: objects()["scene"].to_dict())},
    "Signal.from_dict": {
        "data": Fresh(lambda: {"times": [0.0, 1.0], "values": [1.0, 2.0]})
    },
    **{
        f"{name}.from_dict": {
            "data": Fresh(lambda: {"law": "soft_finger", "c": 0.006, "k": 2.0})
        }
        for name in (
            "patch.Pressure",
            "patch.PerCell",
            "SoftFinger",
            "Uniform",
            "LinearGradient",
            "PressureMaps",
        )
    },
    **{
        f"{model}.{name}": {
            "state": Fresh(lambda shape=shape: np.zeros(shape)),
            **({"loads": None} if "step" in name else {}),
        }
        for model, shape in (
            ("DistributedModel", (2, PATCH.cells)),
            ("ReducedModel", DISCS.state_shape),
        )
        for name in ("rate", "wrench", "step", "jacobians", "step_jacobians")
    },
    **{
        f"ReducedModelPublished.{name}": {"loads": None}
        for name in ("step", "step_jacobians")
    },
    **{
        f"{law}.{name}": {"state": Fresh(lambda: np.zeros(3)), "velocity": TWISTS[9]}
        for law in ("LuGre", "Dahl", "CoulombStribeck")
        for name in ("rate", "force")
    },
    "DistributedModel.step": {
        "state": Fresh(lambda: np.zeros((2, PATCH.cells))),
        "normal_force": None,
        "moments": None,
        "loads": np.ones(PATCH.cells),
        "cover": np.full(PATCH.cells, 0.5),
    },
    "LimitSurfaceQuartic": {"surface": None},
    "LimitSurfaceQuartic.fit": {
        "wrench": Fresh(lambda: pf.LimitSurfaceCells(PATCH).wrench(TWISTS)),
        "twist": TWISTS,
    },
    "joints.Drive": {"kp": 100.0, "supply": 7.0, "gain": 0.003, "sag": 0.2},
    "joints.Drive.duty": {"error": 0.1 * TIMES},
    "joints.Drive.voltage": {"duty": 0.1 * TIMES},
    "joints.JointFriction": {
        "load_motor": 0.1,
        "load_external": 0.1,
        "sigma_2": 0.1,
        "asymmetry": 0.1,
        "viscous_asymmetry": 0.05,
    },
    "joints.JointFriction.along": {
        "time": TIMES,
        "speed": 0.1 * TIMES,
        "tau_motor": 0.1 * TIMES,
        "tau_external": 0.1 * TIMES,
    },
    "joints.JointLog": {
        **{
            name: np.sin(20.0 * TIMES)
            for name in ("q", "torque", "dq", "goal", "voltage", "external")
        },
        "enabled": np.ones(len(TIMES)),
        "drive": pf.joints.Drive(100.0, 7.0),
    },
    "joints.JointLog.from_csv": {"path": Fresh(lambda: _joint_file("joint.csv"))},
    "joints.Plant": {"inertia": 0.05, "length": 0.1, "arm_mass": 0.02, "offset": 0.1},
    "joints.to_mjcf": {
        "friction": Fresh(lambda: objects()["JointFriction"]),
        "joint": "elbow",
        "armature": 0.1,
        "torque_gain": 0.1,
        "back_emf": 0.01,
    },
    "Body": {"velocity": (0.1, 0.0, 1.0)},
    "ReducedModelPublished": {"surface": None},
    "Signal.sine": {"t_end": 0.5},
    "Solution.load": {"path": Fresh(lambda: objects()["solution"].save("solution.nc"))},
    "Signal.from_csv": {
        "path": EXAMPLES / "load.csv",
        "value": "normal_force",
        "time": "time",
    },
    "Scene.from_file": {"path": EXAMPLES / "drift.toml"},
    "Scene.to_file": {"path": "scene.toml"},
    "Log.from_csv": {"path": Fresh(lambda: _log_file("log.csv"))},
    "Log.from_solution": {
        "solution": Fresh(
            lambda: pf.simulate(
                dataclasses.replace(objects()["scene"], save_every=1e-3)
            )
        )
    },
    "patch.read_pressure_map": {"path": EXAMPLES / "pad_pressure.csv"},
    "Log": {"twist": TWISTS, "wrench": TWISTS},
    "Log.from_motion": {"wrench": TWISTS},
    "identify.MassProperties": {"gravity": 9.81},
    "Slide": {"time": TIMES, "pose": TWISTS, "twist": None},
    "identify.design_experiment": {
        "motions": Fresh(lambda: objects()["Log"]),
        "parameters": ("mu_c",),
        "wanted": ("mu_c",),
        "nuisance": (),
        "noise": (1e-3, 1e-3, 1e-5),
    },
    "identify.FitOptions": {
        "noise": (1e-3, 1e-3, 1e-5),
        "surface": pf.LimitSurfaceCells,
        "samples": 5000,
    },
    "identify.candidate_motions": {"duration": 0.5, "rate": 500.0},
    "identify.fit_start": {
        "body": Fresh(lambda: pf.identify.MassProperties(0.2, 1e-4)),
        "noise": (1e-3, 1e-3, 0.02),
    },
    "identify.predict_slide": {
        "body": Fresh(lambda: pf.identify.MassProperties(0.2, 1e-4))
    },
    "scenes.in_hand": {"normal_force": None},
    "scenes.free_slide": {
        "normal_force": None,
        "twist": (1.0, 0.0, 10.0),
        "inertia": None,
    },
    "scenes.drift": {"load": "normal"},
    "randomise": {"ranges": {"mu_c": (0.2, 0.4)}, "seed": 1},
    "sweep": {
        "make_scene": Fresh(
            lambda: (
                lambda mass: pf.scenes.driven(
                    objects()["model"], t_end=0.01, normal_force=mass
                )
            )
        ),
        "values": {"mass": [1.0, 2.0]},
    },
    "scenes.pivot": {"normal_force": None, "mass": 0.02, "start": "equilibrium"},
    "scenes.curling": {"twist": (1.0, 0.0, 10.0), "start": "sliding"},
    "export_c": {"folder": "library"},
    "ReducedModel": {"cells": 12},
    **{
        name: {"twist": TWISTS, "loads": None}
        for name in (
            "derivatives.rollout",
            "derivatives.rollout_jvp",
            "derivatives.rollout_states",
            "derivatives.rollout_vjp",
        )
    },
    "derivatives.rollout_jacobian": {
        "twist": TWISTS,
        "names": ("mu_c",),
        "loads": None,
    },
    "derivatives.scene_sensitivities": {
        "parameters": ("mu",),
        "signals": {},
        "initial": ("x",),
    },
    "derivatives.scene_gradient": {
        "parameters": ("mu",),
        "signals": {},
        "initial": ("x",),
        "cotangent": lambda time, motion: 0.0 * motion,
        "wrench_cotangent": lambda time, wrenches: 0.0 * wrenches,
    },
}
"""Legal values for functions where a parameter of the same name means something else."""


def _public(prefix: str, value: Any) -> Iterator[tuple[str, Callable[..., Any]]]:
    """A function, or a class with its constructors and methods."""
    if prefix in SKIPPED or not callable(value):
        return
    if not inspect.isclass(value):
        yield prefix, value
        return
    if value.__name__ not in RECORDS.split():
        yield prefix, value
    for name in dir(value):
        method = inspect.getattr_static(value, name)
        own = getattr(method, "__func__", method)
        if (
            name in PROTOCOL.split()
            or (name.startswith("_") and name != "__call__")
            or not callable(own)
        ):
            continue
        if isinstance(method, (classmethod, staticmethod)):
            if value.__name__ not in RECORDS.split() or name in vars(value):
                yield f"{prefix}.{name}", getattr(value, name)
        elif value.__name__ not in RECORDS.split() and getattr(
            own, "__module__", ""
        ).startswith("planarfriction"):
            yield f"{prefix}.{name}", own


def _names() -> Iterator[tuple[str, Callable[..., Any]]]:
    seen = set()
    for name in pf.__all__:
        value = getattr(pf, name)
        inner = (
            getattr(value, "__all__", TACTILE if value is pf.tactile else [])
            if isinstance(value, types.ModuleType)
            else [None]
        )
        for part in inner:
            found = value if part is None else getattr(value, part)
            if not any(found is each for each in seen if each is not None) and callable(
                found
            ):
                seen.add(found)
                yield from _public(name if part is None else f"{name}.{part}", found)


def targets() -> list[Target]:
    """All of them, with legal arguments; a new parameter without a legal value here is an error that says so."""
    result = []
    for name, call in _names():
        if name in SKIPPED or name.rpartition(".")[2] in SKIPPED:
            continue
        arguments = {}
        special = SPECIAL.get(name, {})
        owner = name.split(".")[-2:-1]
        for parameter in inspect.signature(call).parameters.values():
            if parameter.kind in (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL):
                continue
            if parameter.name == "self":
                if owner[0] not in objects():
                    raise LookupError(
                        f"tests/fuzz/legal.py has no instance of {owner[0]}"
                    )
                arguments["self"] = objects()[owner[0]]
            elif parameter.name in special:
                arguments[parameter.name] = special[parameter.name]
            elif parameter.name in objects():
                arguments[parameter.name] = objects()[parameter.name]
            elif parameter.default is not parameter.empty:
                arguments[parameter.name] = parameter.default
            else:
                raise LookupError(
                    f"tests/fuzz/legal.py has no legal {parameter.name!r} for {name}"
                )
        if set(arguments) - {"self"}:
            result.append(Target(name, call, arguments))
    return result


def made(argument: Any) -> Any:
    """The argument, made again where it is a recipe."""
    return argument.make() if isinstance(argument, Fresh) else argument
