"""Results of the front ends, the adapters and exported C, to be recorded: see `tests.support.recording`."""

from __future__ import annotations

import dataclasses
import os
import re
import tempfile
import zlib
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

import planarfriction as pf
from planarfriction.coupling import CoupledPatches, HostStep
from planarfriction.online import FrictionObserver, Hold
from planarfriction.patch import friction_metric
from tests.support import c_libraries
from tests.support.coupling_problems import random_bodies, random_run
from tests.support.recorded import NUMBER, array
from tests.support.walks import walk

# Most of the time goes into compilation.
os.environ.setdefault("JAX_DISABLE_MOST_OPTIMIZATIONS", "1")

LAW = pf.LuGre(
    mu_c=0.8, mu_s=1.1, v_s=2e-3, sigma_1=300.0, sigma_2=0.3, elasto_plastic=0.7
)
PLAIN = dataclasses.replace(LAW, elasto_plastic=None, gamma=1.3)
FIXED = dataclasses.replace(LAW, reference_load=2.0)
PATCH = pf.ContactPatch.from_pressure([[0.0, 3.0, 1.0], [2.0, 5.0, 1.0]], 0.005)
SOFT = pf.ContactPatch.disc(
    0.012, cells=5, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0, radius_max=0.012)
)
METRIC = PATCH.with_friction_metric(friction_metric(0.4, 1.0, 1.6))
LEAN = PATCH.with_friction_metric(friction_metric(0.4, 1.0, 1.6), (0.2, -0.1))
CELLS = {
    "distributed": (PATCH, LAW), "discs": (METRIC.discs(4), PLAIN), "asymmetric": (LEAN, LAW),
    "asymmetric discs": (LEAN.discs(4), FIXED), "soft": (SOFT, PLAIN, 3.0),
}  # fmt: skip
SURFACES = {
    "published table": (PATCH, LAW), "sum of cells": (PATCH, PLAIN, pf.LimitSurfaceCells(PATCH)),
    "table": (METRIC, LAW, pf.LimitSurfaceTable(METRIC)), "ellipsoid": (PATCH, PLAIN, pf.LimitSurfaceEllipsoid(PATCH)),
}  # fmt: skip
TRAINED = "mu_c", "v_s", "sigma_0", "contact_radius", "second_moment", "centre_x"
STEPS, DT = 6, 5e-4

# ---------------------------------------------------------------------- PyTorch and JAX


def motions() -> tuple[np.ndarray, ...]:
    """Return twists `[2, T, 3]`, loads `[2, T]` and moments `[2, T, 2]`: slip to and fro, one lifted for a step."""
    t = np.arange(STEPS)
    twist = np.stack(
        [
            4e-3 * np.sin(0.9 * t + 0.2),
            3e-3 * np.cos(0.7 * t),
            0.8 * np.sin(1.1 * t + 0.3),
        ],
        -1,
    )
    load = np.stack([2.0 + np.cos(t), 0.5 + 0.3 * np.sin(t)])
    load[0, 3] = 0.0
    return (
        np.stack([twist, -0.2 * twist[::-1]]),
        load,
        2e-3 * load[..., None] * np.stack([np.cos(t), np.sin(t)], -1),
    )


def torch() -> dict[str, Any]:
    """Compute steps, rollouts and gradients of each kind of model in PyTorch."""
    import torch

    import planarfriction.torch as pt

    double = {"dtype": torch.float64}
    weighed = ("mu_c", "mu_s", "sigma_1", "breakaway_ratio", "weights")
    made = {name: pt.DistributedModel(*each, **double) for name, each in CELLS.items()}
    made |= {
        name: pt.ReducedModelPublished(*each, trainable=TRAINED, **double)
        for name, each in SURFACES.items()
    }
    made |= {
        "weights": pt.DistributedModel(PATCH, LAW, trainable=weighed, **double),
        "planar": pt.ReducedPlanarLuGre(**double),
    }
    return {name: of_torch(model) for name, model in made.items()} | {
        "scene": _scene_of_torch()
    }


def of_torch(model: Any) -> dict[str, Any]:
    """Compute steps, rollouts and gradients of a model in PyTorch."""
    import torch

    import planarfriction.torch as pt

    twist, load, moments = (
        torch.tensor(x, dtype=model.lever.dtype, requires_grad=True) for x in motions()
    )
    moves = (
        not isinstance(model, pt.ReducedPlanarLuGre) and model.reference_load is None
    )
    leaves = [*model.parameters()]
    state = model.rest(2)
    wrenches = []
    for i in range(STEPS):
        state, wrench = model.step(
            state,
            twist[:, i],
            load[:, i],
            DT,
            **({"moments": moments[:, i]} if moves else {}),
        )
        wrenches.append(wrench)
    given = [*leaves, twist, load, *[moments] * moves]
    found = {
        "kind": str(model.lever.dtype),
        "state": state,
        "wrenches": torch.stack(wrenches),
        "rate": model(state, twist[:, 1], load[:, 1]),
        "gradient": torch.autograd.grad(
            wrench.square().sum() + 1e6 * state.square().sum(), given
        ),
        "values": model.physical(),
        "law": [*model._law_values().values()],
    }
    for method in ("eager", "adjoint"):
        run = pt.rollout(model, None, twist, load, DT, method=method)
        loss = pt.tracking_loss(
            model, None, twist, load, DT, torch.zeros(STEPS, 3), method=method
        )
        found[method] = [*run, loss, *torch.autograd.grad(loss, [*leaves, twist, load])]
    return _told(found, lambda each: each.detach().numpy())


def _scene() -> tuple[pf.Scene, np.ndarray, np.ndarray]:
    """Return a plate that slides and turns, knots [s] and loads there [N]."""
    body = pf.Body(0.4, 6e-4, velocity=(0.08, 0.03, 1.5), gravity=(0.0, 0.0))
    load = np.array([1.0, 1.2, 0.9])
    knots = np.array([0.0, 0.03, 0.06])
    model = pf.ReducedModelPublished(PATCH, PLAIN, pf.LimitSurfaceEllipsoid(PATCH))
    contact = pf.Contact(model, pf.Signal(knots, load, "linear"), name="pad")
    return pf.Scene(body, [contact], 0.06, save_every=0.02), knots, load


def _scene_of_torch() -> Any:
    import torch

    from planarfriction.torch import simulate_scene

    scene, knots, load = _scene()
    given = [
        torch.tensor(each, dtype=torch.float64, requires_grad=True)
        for each in (1.2, load, 0.09)
    ]
    found = simulate_scene(
        scene,
        {"mu": given[0]},
        signals={"pad.normal_force": (knots, given[1])},
        initial={"vx": given[2]},
    )
    slopes = torch.autograd.grad(
        found.motion.square().sum() + found.wrenches.square().sum(), given
    )
    return _told([*found, *slopes], lambda each: each.detach().numpy())


def jax() -> dict[str, Any]:
    """Compute steps, and rollouts with gradients by the adjoint, of some kinds of models in JAX.

    Compilation takes time; other tests compare all kinds with those of NumPy.
    """
    import jax
    import jax.numpy as jnp

    import planarfriction.jax as pj

    with jax.enable_x64(True):
        twist, load, _ = map(jnp.asarray, motions())

        @jax.jit
        def stepped(model: Any) -> Any:
            state, wrench = pj.step(
                model, pj.rest(model, 2), twist[:, 1], load[:, 1], DT
            )
            return state, wrench, pj.rate(model, state, twist[:, 2], load[:, 2])

        def loss(model: Any, parameters: Any, *given: Any) -> Any:
            run = pj.rollout(
                model, None, *given, DT, parameters=parameters, method="adjoint"
            )
            return (run.wrenches**2).sum() + 1e6 * (run.state**2).sum(), run

        table = pj.ReducedModelPublished(*SURFACES["table"])
        found: dict[str, Any] = {"table": stepped(table)}
        for name, model in {
            "distributed": pj.DistributedModel(PATCH, LAW),
            "table": table,
        }.items():
            slopes, run = jax.grad(loss, (1, 2, 3), has_aux=True)(
                model, model.parameters, twist, load
            )
            found[f"{name}, adjoint"] = [*run, *jax.tree.leaves(slopes)]
        return _told(found, np.asarray)


def _told(value: Any, numbers: Callable[[Any], np.ndarray]) -> Any:
    """Return nested results with their tensors as arrays of NumPy."""
    if isinstance(value, dict):
        return {name: _told(each, numbers) for name, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_told(each, numbers) for each in value]
    return value if isinstance(value, (float, str)) else numbers(value)


# ---------------------------------------------------------------------- Warp


def warp() -> dict[str, Any]:
    """Step contacts and coupled patches by Warp's kernels on the processor, in both precisions."""
    import warp as wp

    import planarfriction.warp as pw

    shapes = [pf.ContactPatch.disc(0.01), pf.ContactPatch.rectangle(0.02, 0.01)]
    made = {
        "few": pf.ReducedModel(shapes[0], c_libraries.LAW),
        "fixed": pf.ReducedModel(
            shapes[0], dataclasses.replace(c_libraries.LAW, reference_load=2.0)
        ),
        "published": pf.ReducedModelPublished(shapes[0], c_libraries.LAW),
    }
    found: dict[str, Any] = {"coupled": _coupled(pw, wp)}
    for name, model in made.items():
        runs = zip(
            *((v, n) for _, v, n, *_ in walk(model, 40, 3, np.float32)), strict=True
        )
        twist, load = map(np.array, runs)
        moments = (
            None if name == "fixed" else 2e-3 * load[..., None] * np.array([1.0, -0.6])
        )
        state, wrench = _rolled(pw, wp, wp.float64, model, twist, load, moments)
        single = _rolled(pw, wp, wp.float32, model, twist, load, moments)[1]
        found[name] = [
            state,
            wrench,
            bool(abs(single - wrench).max() < 1e-3 * abs(wrench).max()),
        ]
    return found


def _rolled(
    pw: Any, wp: Any, dtype: Any, model: Any, twist: Any, load: Any, moments: Any
) -> list[Any]:
    kernel = pw.Model(
        model,
        contacts=40,
        parameters={"scale": np.linspace(0.8, 1.3, 40)},
        device="cpu",
        dtype=dtype,
    )
    given = [
        None if each is None else wp.array(each, dtype=dtype, device="cpu")
        for each in (twist, load, moments)
    ]
    new = kernel.rest()
    wrench = wp.zeros((3, 40, 3), dtype=dtype, device="cpu")
    kernel.rollout(kernel.rest(), *given[:2], 1e-3, new, wrench, moments=given[2])
    kernel.check()
    return [new.numpy(), wrench.numpy()]


def _coupled(pw: Any, wp: Any) -> Any:
    law = pf.LuGre(mu_s=1.2, sigma_0=1e5, sigma_1=250.0, elasto_plastic=0.9)
    shapes = [pf.ContactPatch.disc(0.01), pf.ContactPatch.rectangle(0.02, 0.01)]
    models = [pf.ReducedModel(shapes[0], law), pf.ReducedModel(shapes[1], law)]
    generator = np.random.default_rng(5)
    patches = CoupledPatches(models)
    kernel = None
    told = []
    for state, host, dt, _ in random_run(
        generator, patches, random_bodies(generator, 8, 2, 0.05), 4
    ):
        if kernel is None:
            kernel = pw.CoupledPatches(models, worlds=8, dtype=wp.float64, device="cpu")
            results = kernel.results()
        given = [
            None
            if x is None
            else wp.array(np.ascontiguousarray(x), dtype=wp.float64, device="cpu")
            for x in host
        ]
        kernel.step(
            wp.array(state, dtype=wp.float64, device="cpu"),
            HostStep(*given),
            dt[0],
            results,
        )
        told.append(
            [
                results.state.numpy().copy(),
                results.wrench.numpy().copy(),
                results.converged.numpy().tolist(),
            ]
        )
    return told


# ---------------------------------------------------------------------- adapters


def mujoco() -> dict[str, Any]:
    """Take steps of scenes in MuJoCo, with parameters that differ and shapes that follow their contacts."""
    from planarfriction_studies.bench.mujoco_scenes import capsule, grip, plate, tray

    scenes = {
        "Euler": grip(),
        "implicitfast": capsule(),
        "implicit": tray(),
        "plate": plate(),
    }
    return {
        name: _of_mujoco(scene, name.replace("plate", "Euler"))
        for name, scene in scenes.items()
    }


def _of_mujoco(scene: Any, integrator: str) -> list[Any]:
    m, d, friction = scene.ours(integrator=integrator)
    own = friction.parameters(m)
    told = []
    own["mu_c"][:] *= 0.9
    own["scale"][0] = 1.1
    own["centre_x"][0] = 5e-4
    for i in range(60):
        d.ctrl[:] = scene.control(2e-3 * i + 0.3 * (i > 40))
        friction.step(d)
        if i % 15 == 14:
            report = friction.report(d)
            rows = (friction.wrenches(d), friction.twists(d), friction.loads(d))
            numbers = [d.qpos, d.qvel, friction.state(d), *rows, *friction.frame(d, 0)]
            told += [
                _told(numbers, np.copy),
                report.passes,
                report.converged,
                friction.misplaced(d),
            ]
    return told


def drake() -> dict[str, Any]:
    """Take steps of two plants in Drake."""
    from tests.support.drake_scenes import gripped, sliding

    law = pf.LuGre(mu_s=1.0, sigma_2=0.0, elasto_plastic=0.9)
    box, pad = (
        pf.ReducedModel(each, law)
        for each in (
            pf.ContactPatch.rectangle(0.1, cells=9),
            pf.ContactPatch.disc(0.01, cells=9),
        )
    )
    runs = {
        "box": sliding("box", "hydroelastic", 2e-3, box, tilt=0.6),
        "block": gripped("point", 2e-3, pad),
    }
    found = {}
    for name, run in runs.items():
        told = []
        for i in range(1, 5):
            run.to(0.02 * i)
            ports = (
                run.friction.get_wrenches_output_port(),
                run.friction.get_loads_output_port(),
            )
            motion = run.plant.GetPositionsAndVelocities(run.context)
            report = run.friction.GetReport(run.own)
            # Twists at rest are rounding.
            numbers = np.concatenate([motion, *(each.Eval(run.own) for each in ports)])
            told.append([numbers, run.friction.GetBristles(run.own), report.converged])
        found[name] = told
    return found


# ---------------------------------------------------------------------- exported C

BLOCK = 40
"""Lines that one checksum stands for."""


def exported() -> dict[str, Any]:
    """Tell the text of exported C by checksums of its words and by its numbers, and take some steps of it."""
    table = pf.ReducedModelPublished(METRIC, LAW, SURFACES["table"][2])
    ellipsoid = pf.ReducedModelPublished(PATCH, PLAIN, SURFACES["ellipsoid"][2])
    hold = Hold(FrictionObserver(ellipsoid, surface=ellipsoid.surface, drift=0.02))
    with tempfile.TemporaryDirectory() as folder:
        files = [
            *pf.export_c(table, folder, name="table", precision="float"),
            *pf.export_c(
                ellipsoid, folder, name="ellipsoid", casadi=True, controller=hold
            ),
        ]
        made = c_libraries.library("few", "double", "-O0", patches=2)
        steps = c_libraries.run(made, c_libraries.samples(made.model, float, 40))
        return {
            **_texts([*files, *made.folder.glob("friction*.[hc]")]),
            "steps": [*steps],
        }


def _texts(files: list[Path]) -> dict[str, Any]:
    return {file.name: _text(file.read_text(encoding="utf-8")) for file in files}


def _text(words: str) -> dict[str, Any]:
    """Tell a source by checksums of the words of its blocks of lines, and by its numbers."""
    words = re.sub(r"Digest of the model: \w+", "", words.replace(pf.__version__, ""))
    lines = NUMBER.sub("#", words).splitlines()
    blocks = [
        zlib.crc32("\n".join(lines[i : i + BLOCK]).encode())
        for i in range(0, len(lines), BLOCK)
    ]
    numbers = np.array([float(each) for each in NUMBER.findall(words)])
    numbers = array(np.arcsinh(1e4 * np.clip(numbers, -1e300, 1e300)))
    return {"blocks": " ".join(f"x{each:x}" for each in blocks), "numbers": numbers}


NEEDED = {torch: "torch", jax: "jax", warp: "warp-lang", drake: "drake"}
ENGINES = {"drake": "1.51."}
"""Versions of engines whose steps are recorded: others find other contact forces."""


def _found(package: str) -> bool:
    try:
        return metadata.version(package).startswith(ENGINES.get(package, ""))
    except metadata.PackageNotFoundError:
        return False


SUBJECTS = {each.__name__: each for each, package in NEEDED.items() if _found(package)}
"""Name of a file -> function that computes what it holds, for packages that are here."""
