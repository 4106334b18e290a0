"""Scene files with something wrong in them: a scene that runs, or one line."""

from __future__ import annotations

import json
import random
import shutil
from pathlib import Path

import numpy as np
import pytest
from attack import attack, folder
from judge import Broken, judge
from mutation import mutated, mutated_bytes
from working import use

import planarfriction as pf
from planarfriction.scenes.files import to_toml

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
FILES = sorted(EXAMPLES.glob("*.toml"))
DISC = {"shape": "disc", "radius": 0.01, "cells": 5}
LUGRE = {"kind": "lugre", "mu_c": 0.5, "mu_s": 0.6, "elasto_plastic": 0.9}


def table(**changes) -> dict:
    """A small scene with many kinds of entries."""
    contact = {
        "name": "pad",
        "mounted_on": "world",
        "position": [0.001, 0.0],
        "angle": 0.1,
        "count": 2,
    }
    contact |= {
        "normal_force": 2.0,
        "model": "reduced-published",
        "patch": dict(DISC),
        "law": dict(LUGRE),
    }
    scene = {"name": "s", "t_end": 0.02, "save_every": 0.01, "rtol": 1e-4, "atol": 1e-3}
    scene["body"] = {
        "mass": 0.2,
        "inertia": 1e-4,
        "position": [0.0, 0.0],
        "angle": 0.0,
        "velocity": [0.1, 0.0, 1.0],
    }
    scene["body"] |= {
        "gravity": [0.0, -9.81],
        "outline": [[0.0, 0.0], [0.1, 0.0], [0.0, 0.1]],
    }
    body = changes.pop("body", {})
    scene["contact"] = [contact | changes.pop("contact", {})]
    return scene | {"body": scene["body"] | body} | changes


SINE = {
    "sine": {
        "offset": 2.0,
        "amplitude": 1.0,
        "frequency": 2.0,
        "t_end": 0.02,
        "dt": 0.01,
        "phase": 0.1,
    }
}
RAMP = {
    "times": [0.0, 0.01, 0.02],
    "values": [1.0, 2.0, 1.5],
    "hold": "linear",
    "dt": 0.005,
}
SAMPLED = {
    "csv": "load.csv",
    "time": "time",
    "value": "normal_force",
    "hold": "previous",
}
WRENCH = {
    "times": [0.0, 0.01],
    "values": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.01]],
    "hold": "linear",
}
FINGER = {"law": "soft_finger", "c": 0.006, "n": 0.3, "k_per_newton": 2.0}
SCENES = [
    table(stop_speed=1e-4, force=WRENCH),
    table(
        contact={
            "normal_force": SINE,
            "model": {"kind": "distributed"},
            "law": {"kind": "dahl", "sigma_0": 1e5},
        }
    ),
    table(contact={"normal_force": RAMP, "patch": DISC | {"pressure": FINGER}}),
    table(
        contact={
            "normal_force": SAMPLED,
            "model": "distributed",
            "law": {"kind": "coulomb-stribeck", "mu_c": 0.4},
        }
    ),
    table(
        velocity=[0.01, 0.0, 1.0],
        contact={"model": {"kind": "reduced-published", "surface": {"kind": "table"}}},
    ),
    table(
        contact={
            "patch": {
                "shape": "pressure-map",
                "file": "pad_pressure.csv",
                "cell_size": [0.001, 0.001],
            }
        }
    ),
    table(
        contact={
            "patch": {
                "shape": "polygon",
                "vertices": [[0, 0], [0.01, 0], [0, 0.01]],
                "cells": [4, 5],
            }
        }
    ),
    table(
        contact={
            "patch": {
                "shape": "points",
                "positions": [[0, 0], [0.01, 0]],
                "weights": [1, 2],
            }
        }
    ),
    table(
        contact={
            "patch": {"shape": "published", "name": "LineGrad", "cells": 7},
            "model": "reduced",
        }
    ),
    table(
        contact={
            "support_velocity": {
                "times": [0.0, 0.01],
                "values": [[0.1, 0.0, 1.0], [0.0, 0.1, 0.0]],
                "hold": "linear",
            }
        }
    ),
    table(
        contact={
            "patch": DISC | {"metric": {"along": 0.4, "across": 0.6, "angle": 0.1}},
            "model": "distributed",
        }
    ),
]
ERRORS = ("scene",)


def attempt(kind: str, path: Path) -> None:
    """Read the file, and run what it gives for a moment."""
    scene = judge(kind, lambda: pf.Scene.from_file(path), names=("scene",))
    if scene is None:
        return
    again = judge(kind, lambda: pf.Scene.from_dict(json.loads(scene.to_json())))
    if again.digest() != scene.digest():
        raise Broken("the scene changes when it is written and read")

    def run():
        end = min(scene.t_end, 0.01)
        try:
            use(pf.simulate(scene, t_end=end, save_every=end))
        except pf.errors.SolverError as gave_up:
            use(gave_up.solution)
            raise

    judge(kind, run, compiles=True)


def written(data: dict, path: Path) -> bytes:
    if path.suffix == ".json":
        return json.dumps(data).encode()
    return to_toml(data).encode("utf-8", "surrogatepass")


@attack("scene files", 400)
def test_a_table_with_something_changed(draw: random.Random) -> None:
    with folder() as here:
        for name in ("load.csv", "pad_pressure.csv"):
            shutil.copy(EXAMPLES / name, here)
        path = here / draw.choice(["scene.toml", "scene.json"])
        data = mutated(draw.choice(SCENES), draw)
        try:
            path.write_bytes(written(data, path))
        except (ValueError, TypeError):  # what neither format can hold
            return
        attempt("scene files: tables", path)


@attack("scene files", 300)
def test_a_file_with_other_bytes(draw: random.Random) -> None:
    with folder() as here:
        for name in ("load.csv", "pad_pressure.csv"):
            shutil.copy(EXAMPLES / name, here)
        path = here / draw.choice(["scene.toml", "scene.json"])
        path.write_bytes(mutated_bytes(written(draw.choice(SCENES), path), draw))
        attempt("scene files: bytes", path)


@pytest.mark.parametrize("data", SCENES)
def test_the_scenes_are_right_before_they_are_changed(data, tmp_path):
    for name in ("load.csv", "pad_pressure.csv"):
        shutil.copy(EXAMPLES / name, tmp_path)
    scene = pf.Scene.from_dict(data, tmp_path)
    assert np.isfinite(pf.simulate(scene).data.x.values).all()
