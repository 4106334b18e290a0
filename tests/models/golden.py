"""Numbers of every model, law and front end: `python -m tests.models.golden` writes them again.

States are told by five sums with fixed weights, so that the file stays short and no component is left out.
"""

from __future__ import annotations

import contextlib
import importlib
import json
from pathlib import Path
from typing import Any

import numpy as np

import planarfriction as pf
from planarfriction import derivatives
from tests.support.anisotropic import GRAIN, GRAINS, LEAN, LEANS, PLAIN
from tests.support.rate_laws import BoucWen

FILE = Path(__file__).with_name("golden.json")
STEPS, DT, SUMS = 10, 1e-4, 5

LAWS = {
    "plain": pf.LuGre(mu_c=0.8, mu_s=1.2),
    "elasto-plastic": pf.LuGre(
        mu_c=0.7, mu_s=1.2, gamma=1.5, elasto_plastic=pf.ElastoPlastic(0.6)
    ),
    "dahl": pf.Dahl(0.6),
    "fixed": pf.LuGre(mu_c=0.8, mu_s=1.0, reference_load=1.7),
}
X, Y = np.meshgrid(np.arange(-3, 4) * 1e-3, np.arange(3, -4, -1) * 1e-3)
TIP = pf.ContactPatch.from_pressure(
    {
        0.5: np.maximum(1.0 - ((X - 1e-3) ** 2 + Y**2) / 0.003**2, 0.0),
        4.0: np.sqrt(np.maximum(1.0 - (X**2 + (Y - 1e-3) ** 2) / 0.0045**2, 0.0)),
    },
    cell_size=1e-3,
)
ROUND = pf.ContactPatch.disc(0.01, cells=9)
PATCHES = {
    "points": PLAIN,
    "many points": ROUND,
    "metric": PLAIN.with_friction_metric(GRAIN),
    "metrics": PLAIN.with_friction_metric(GRAINS),
    "leaning": PLAIN.with_friction_metric(GRAINS, LEANS),
    "discs": PLAIN.discs(),
    "discs, metric": PLAIN.with_friction_metric(GRAIN).discs(7),
    "discs, leaning": PLAIN.with_friction_metric(None, LEAN).discs(7),
    "by load": TIP,
    "discs by load": TIP.discs(6),
}
SURFACES = {
    "cells": pf.LimitSurfaceCells,
    "table": pf.LimitSurfaceTable,
    "their table": pf.LimitSurfaceTablePublished,
    "ellipsoid": pf.LimitSurfaceEllipsoid,
}


def models() -> dict[str, Any]:
    """Make every kind of model with every law that it takes."""
    made: dict[str, Any] = {}
    for law_name, law in LAWS.items():
        made |= {
            f"{name}, {law_name}": pf.DistributedModel(patch, law)
            for name, patch in PATCHES.items()
            if law_name != "fixed" or not ("leaning" in name or "load" in name)
        }
        made[f"reduced, {law_name}"] = pf.ReducedModel(ROUND, law, cells=9)
        made |= {
            f"published {name}, {law_name}": pf.ReducedModelPublished(
                PLAIN, law, surface=surface(PLAIN)
            )
            for name, surface in SURFACES.items()
            if law_name != "fixed"
        }
    return made | {"points, Bouc-Wen": pf.DistributedModel(PLAIN, BoucWen())}


def sums(values: Any) -> list[float]:
    """Add all values with five sets of fixed weights."""
    flat = np.asarray(values, float).ravel()
    places = np.arange(1, flat.size + 1)
    return [float(flat @ np.cos(k * places)) for k in range(1, SUMS + 1)]


def motion(model: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Make a state, twists that start, slide, spin, rest and turn back, and loads."""
    size = int(np.prod(model.state_shape))
    state = 1e-7 * np.sin(np.arange(size) + 0.3).reshape(model.state_shape)
    t = np.arange(STEPS)
    waves = np.stack(
        [np.sin(0.7 * t), 0.6 * np.cos(1.1 * t), np.sin(0.5 * t + 1.0)], axis=-1
    )
    twists = 0.01 * waves * [1.0, 1.0, 100.0] * (t != 7)[:, None]
    return state, twists, 2.0 + np.cos(2.0 * t)


def numbers_of(model: Any) -> dict[str, list[float]]:
    """Compute rates, steps, slopes, a rollout and its gradient, as far as a model has them."""
    state, twists, loads = motion(model)
    run = derivatives.rollout(model, state, twists, loads, DT)
    bars = cotangents(state.shape)
    end, wrench = model.step(state, twists[2], loads[2], DT)
    numbers = {
        "rate": sums(model.rate(state, twists[1], loads[1])),
        "wrench": model.wrench(state, twists[1], loads[1]).tolist(),
        "step": sums(end),
        "step wrench": wrench.tolist(),
        "run": sums(run.state),
        "run wrenches": sums(run.wrenches),
    }
    several = {
        "slopes": lambda: model.jacobians(state, twists[2], loads[2])._asdict(),
        "step slopes": lambda: model.step_jacobians(
            state, twists[2], loads[2], DT
        )._asdict(),
        "gradient": lambda: derivatives.rollout_vjp(
            model, state, twists, loads, DT, *bars
        )._asdict(),
    }
    for name, of in several.items():
        with contextlib.suppress(pf.FrictionError):
            numbers |= {
                f"{name}, {part}": sums(values) for part, values in of().items()
            }
    return numbers


def cotangents(shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Make cotangents of the wrenches and of the last state of a rollout."""
    return np.cos(np.arange(3.0 * STEPS)).reshape(STEPS, 3), 1e5 * np.sin(
        1.0 + np.arange(np.prod(shape))
    ).reshape(shape)


def numbers_of_scene(model: Any) -> dict[str, list[float]]:
    """Compute where a pushed plate ends on such a patch, and how that depends on its start."""
    times = [0.0, 0.05, 0.1, 0.15]
    push = pf.Signal(
        times,
        [[0.5, 0.1, 0.0], [2.5, 0.4, 0.01], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        "linear",
    )
    contact = pf.Contact(
        model, pf.Signal([0.0, 0.15], [2.0, 1.2], "linear"), name="pad"
    )
    scene = pf.Scene(
        pf.Body(0.2, 1e-5, gravity=(0.0, 0.0)),
        [contact],
        0.15,
        force=push,
        save_every=0.15,
    )
    end = pf.simulate(scene)
    numbers = {"end": [float(end.histories[name].values[-1]) for name in MOTION]}
    # Slopes of tables jump, so steps do.
    if not isinstance(model, pf.ReducedModelPublished):
        with contextlib.suppress(pf.FrictionError):
            by_start = derivatives.scene_sensitivities(
                scene, (), initial=("vx", "omega")
            )
            numbers["end by start"] = sums(by_start.d_motion[-1])
    return numbers


def numbers_of_torch(model: Any) -> dict[str, list[float]]:
    """Compute a step and its gradient with PyTorch, in double precision."""
    torch = importlib.import_module("torch")
    ends = importlib.import_module("planarfriction.torch")
    ours = ends.__dict__[type(model).__name__](*_described(model), dtype=torch.float64)
    state, twists, loads = motion(model)
    given = [
        torch.tensor(np.asarray(each), requires_grad=True)
        for each in (state, twists[2], loads[2])
    ]
    end, wrench = ours.step(*given, DT)
    of_wrenches, of_state = cotangents(state.shape)
    (
        (wrench * torch.tensor(of_wrenches[0])).sum()
        + (end * torch.tensor(of_state)).sum()
    ).backward()
    return {
        "step": sums(end.tolist()),
        "gradient": [number for each in given for number in sums(each.grad.tolist())],
    }


def numbers_of_jax(model: Any) -> dict[str, list[float]]:
    """Compute a step and its gradient with JAX, in double precision."""
    jax = importlib.import_module("jax")
    ends = importlib.import_module("planarfriction.jax")
    state, twists, loads = motion(model)
    of_wrenches, of_state = cotangents(state.shape)
    with jax.enable_x64():
        ours = ends.__dict__[type(model).__name__](*_described(model))

        def value(*given):
            end, wrench = ours.step(*given, DT)
            return (wrench * of_wrenches[0]).sum() + (end * of_state).sum()

        given = [jax.numpy.asarray(each) for each in (state, twists[2], loads[2])]
        end = ours.step(*given, DT)[0]
        gradient = jax.jit(jax.grad(value, (0, 1, 2)))(*given)
    return {
        "step": sums(end.tolist()),
        "gradient": [number for each in gradient for number in sums(each.tolist())],
    }


def _described(model: Any) -> tuple[Any, ...]:
    surface = (model.surface,) if isinstance(model, pf.ReducedModelPublished) else ()
    return model.patch, model.law, *surface


MOTION = ("vx", "vy", "omega", "x", "y", "theta")
SCENES = (
    "points",
    "discs",
    "reduced",
    "by load",
    "leaning",
    "published table",
    "published ellipsoid",
)
"""Kinds of models that a plate slides on too."""
TENSORS = (
    "points",
    "metrics",
    "leaning",
    "discs",
    "published table",
    "published ellipsoid",
)
"""Kinds of models that both tensor libraries take."""


def of_kinds(*kinds: str) -> dict[str, Any]:
    """Select models by the beginning of their names, without those of a rate law."""
    return {
        name: model
        for name, model in MODELS.items()
        if name.split(",")[0] in kinds and "Bouc" not in name
    }


MODELS = models()
IN_TENSORS = {
    name: model for name, model in of_kinds(*TENSORS).items() if "fixed" not in name
}
SOURCES = {
    "steps": (numbers_of, MODELS),
    "scenes": (numbers_of_scene, of_kinds(*SCENES)),
    "tensors": (numbers_of_torch, IN_TENSORS),
}
"""Kind of numbers -> function that computes them, and the models by name; JAX gives the numbers of PyTorch."""


def main() -> None:
    """Write the numbers of all models."""
    written = {
        kind: {name: of(model) for name, model in given.items()}
        for kind, (of, given) in SOURCES.items()
    }
    FILE.write_text(json.dumps(written, indent=0) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
