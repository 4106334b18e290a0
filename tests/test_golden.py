"""Few numbers that are recorded, in `tests/golden.json`: of one motion of every kind of model, to 1e-9 (pads: 1e-6).

Closed forms, differences and other backends judge these models elsewhere; this file notices that a change of the
code's form changes their numbers. After a change that is meant, `python -m tests.test_golden` writes it again.
"""

import functools
import json
from pathlib import Path

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import derivatives
from tests.support.anisotropic import GRAIN, GRAINS, LEAN, LEANS, PLAIN
from tests.support.rate_laws import BoucWen

FILE = Path(__file__).with_name("golden.json")
STEPS, DT = 10, 1e-4
MEANING = {
    "wrench": "fx [N], fy [N], tau [N m] of one step of 0.1 ms in the middle of the motion",
    "run": "fx, fy, tau at the end of ten such steps, of which the eighth rests",
    "by load": "slopes of the last fx, fy [-] and tau [m] of that run by a change of all its loads",
    "pushed plate": "vx, vy [m/s], omega [rad/s], x, y [m], theta [rad] of a plate of 0.2 kg after a push of 0.15 s",
}
SOURCE = "this library in double precision; tests/models and tests/derivatives judge the same models by other means"

LAWS = {
    "plain": pf.LuGre(mu_c=0.8, mu_s=1.2),
    "elasto-plastic": pf.LuGre(
        mu_c=0.7, mu_s=1.2, gamma=1.5, elasto_plastic=pf.ElastoPlastic(0.6)
    ),
    "dahl": pf.Dahl(0.6),
    "fixed": pf.LuGre(mu_c=0.8, mu_s=1.0),
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
PUSHED = (
    "points",
    "discs",
    "reduced",
    "by load",
    "leaning",
    "published table",
    "published ellipsoid",
)
"""Kinds of models on which a plate is pushed too."""


@functools.cache
def models():
    """Make every kind of model with every law that it takes."""
    made = {}
    for law_name, law in LAWS.items():
        fixed = law_name == "fixed"
        pad = pf.Pad.at_load(1.7) if fixed else None
        for name, patch in PATCHES.items():
            if not fixed or not ("leaning" in name or "load" in name):
                made[f"{name}, {law_name}"] = pf.DistributedModel(patch, law, pad=pad)
        made[f"reduced, {law_name}"] = pf.ReducedModel(ROUND, law, cells=9, pad=pad)
        for name, surface in {} if fixed else SURFACES.items():
            made[f"published {name}, {law_name}"] = pf.ReducedModelPublished(
                PLAIN, law, surface=surface(PLAIN)
            )
    return made | {"points, Bouc-Wen": pf.DistributedModel(PLAIN, BoucWen())}


def numbers_of(name):
    """Move a model that starts, slides, spins, rests and turns back under a load that changes."""
    model = models()[name]
    state = 1e-7 * np.sin(np.arange(np.prod(model.state_shape)) + 0.3).reshape(
        model.state_shape
    )
    t = np.arange(STEPS)
    waves = np.stack(
        [np.sin(0.7 * t), 0.6 * np.cos(1.1 * t), np.sin(0.5 * t + 1.0)], axis=-1
    )
    twists = 0.01 * waves * [1.0, 1.0, 100.0] * (t != 7)[:, None]
    loads = 2.0 + np.cos(2.0 * t)
    run = derivatives.rollout(model, state, twists, loads, DT)
    found = {
        "wrench": model.step(state, twists[2], loads[2], DT)[1].tolist(),
        "run": run.wrenches[-1].tolist(),
    }
    if "Bouc" not in name:
        bars = np.zeros((3, STEPS, 3))
        bars[:, -1] = np.eye(3)
        slopes = derivatives.rollout_vjp(
            model, np.stack([state] * 3), twists, np.tile(loads, (3, 1)), DT, bars
        )
        found["by load"] = slopes.normal_force.sum(-1).tolist()
    if name.rpartition(",")[0] in PUSHED and "Bouc" not in name:
        found["pushed plate"] = pushed(model)
    return found


def pushed(model):
    """Push a plate on such a patch."""
    times = [0.0, 0.05, 0.1, 0.15]
    push = pf.Signal(
        times,
        [[0.5, 0.1, 0.0], [2.5, 0.4, 0.01], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        "linear",
    )
    contact = pf.Contact(
        model, pf.Signal([0.0, 0.15], [2.0, 1.2], "linear"), name="pad"
    )
    body = pf.Body(0.2, 1e-5, gravity=(0.0, 0.0))
    end = pf.simulate(pf.Scene(body, [contact], 0.15, force=push, save_every=0.15))
    return [
        float(end.histories[each].values[-1])
        for each in ("vx", "vy", "omega", "x", "y", "theta")
    ]


@functools.cache
def golden():
    return json.loads(FILE.read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", models())
def test_numbers_stay(name):
    found = numbers_of(name)
    expected = golden()["models"][name]
    assert found.keys() == expected.keys()
    for part, numbers in expected.items():
        # The search of a body's step ends within 1e-9 m/s: pads that stick make more of it.
        within = 1e-6 if (part, "fixed" in name) == ("pushed plate", True) else 1e-9
        assert found[part] == pytest.approx(
            numbers, rel=0.0, abs=within * np.abs(numbers).max()
        ), MEANING[part]


def main():
    lines = [f"{json.dumps(name)}: {json.dumps(numbers_of(name))}" for name in models()]
    head = json.dumps({"meaning": MEANING, "source": SOURCE}, indent=1)
    FILE.write_text(
        f'{head[:-2]},\n "models": {{\n  ' + ",\n  ".join(lines) + "\n }\n}\n",
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
