"""Replies to good and bad input, files, sweeps and the explorer, to be recorded: see `tests.support.recording`."""

from __future__ import annotations

import contextlib
import functools
import re
import tempfile
import tomllib
import warnings
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from PIL import Image
from scipy.io import savemat

import planarfriction as pf
from planarfriction import environments, sweeps
from planarfriction._support import reading, shown, validation, writing
from planarfriction._support.reading import Section
from planarfriction.cli import doctor, identify, options
from planarfriction.errors import FrictionError
from planarfriction.patch import Grid, read_pressure_map
from planarfriction.scenes import files, ready
from planarfriction.scenes.model_files import patch_from_dict
from planarfriction.sweeps import settings
from planarfriction_explorer import code, drawing, ladder, looks, pictures, state
from tests.support import recorded, synthetic
from tests.support.computed import LAW, MAPS, as_arrays

VALUES = (
    0.02, 3, -1, 0.0, 1e-300, 1e200, float("nan"), float("-inf"), True, 2j, "0.5", "Disc", " disc", "", None, b"disc",
    [], [1.0, 2.0], [1.0, -2.0], [0.0, 3], [[1.0, 2.0], [3.0, 4.0]], [[1.0], [2.0, 3.0]], ["disc", "ring"], [True], {},
    {"disc": 1.0}, {"disc": 1, "ring": 2}, {"rnig": 1}, np.array(2.0), np.arange(3), np.ones((2, 2, 1)),
    np.ma.masked_array([1.0], True), np.array([1 + 1j]), np.array(["a"]), 10**400,
    SimpleNamespace(units=len), SimpleNamespace(unit="mm"), SimpleNamespace(units="kg m^2"),
    SimpleNamespace(attrs={"units": "N"}),
    lambda: 0.0, (1.0, np.inf), (2.0, 0.5), range(3), [[[[[[[[[[0.0]]]]]]]]]],
)  # fmt: skip
WORDS = ("disc", "ring", "line")
CHECKS: dict[str, Callable[[Any], Any]] = {
    **{check.__name__: functools.partial(check, "x") for check in (
        validation.numbers, validation.number, validation.positive, validation.length, validation.positive_load,
        validation.non_negative, validation.count, validation.finite_numbers, validation.non_negative_numbers,
        validation.text, validation.path,
    )},
    "number in": lambda x: validation.number_in("x", str(x)),
    "count to 3": lambda x: validation.count("x", x, 0, 3),
    "batched": lambda x: validation.batched(x, (2,)),
    "vector": lambda x: validation.vector("x", x, 2),
    "array": lambda x: validation.array("x", x, (None, 2)),
    "small": lambda x: validation.array("x", x, (None,), largest=1.5),
    "filled": lambda x: validation.filled("x", x, (2, 2)),
    "positive array": lambda x: validation.positive_array("x", x, (2,)),
    "non-negative array": lambda x: validation.non_negative_array("x", x, (2,)),
    "instance": lambda x: validation.instance("x", x, (int, str), "an int or a text"),
    "choice": lambda x: validation.choice("x", x, WORDS),
    "choices": lambda x: validation.choices("x", x, WORDS),
    "keys": lambda x: validation.keys("x", x, ["disc"], ["ring"]),
    "within range": lambda x: validation.within_range("x", -1.0, x) if isinstance(x, float) else None,
    "signal": lambda x: pf.Signal.from_dict(x).to_dict(),
    "inertia": lambda x: files.rectangle_inertia(0.2, x),
    "outline": lambda x: files.rectangle_outline(x),
    "metric": lambda x: pf.ContactPatch.disc(0.01, 3).with_friction_metric(x).metric,
    "asymmetry": lambda x: pf.ContactPatch.disc(0.01, 3).with_friction_metric(None, x).asymmetry,
    "moments": lambda x: pf.ContactPatch.disc(0.01, 3).weights(2.0, moments=x),
    "points": lambda x: as_arrays(pf.ContactPatch.points(x).to_dict()),
    "polygon": lambda x: as_arrays(pf.ContactPatch.polygon(x, 3).to_dict()),
    "cells": lambda x: pf.ContactPatch.rectangle(0.02, 0.01, x).cells,
    "discs": lambda x: pf.ContactPatch.disc(0.01, 5).discs(x).cells,
    "map": lambda x: as_arrays(pf.ContactPatch.from_pressure(x, 1e-3).to_dict()),
    "cell size": lambda x: pf.ContactPatch.from_pressure(MAPS[4.0], x).cells,
    "pressure": lambda x: pf.ContactPatch.disc(0.01, 3, pressure=x).weights(1.0),
    "environments": lambda x: environments.check({"mu_c": x, "mu_s": 1.0}),
    "range": lambda x: environments.randomise(LAW, {"v_s": x}, 3),
    "quantity": lambda x: settings.grid_of({"a": x}),
    "outline of a body": lambda x: pf.Body(1.0, 1.0, outline=x).outline,
    "load": lambda x: pf.Contact(pf.ReducedModel(pf.ContactPatch.disc(0.01, 5), LAW), x).normal_force.to_dict(),
    "place of a body": lambda x: pf.Body(1.0, 1.0, x).position,
    "spring": lambda x: pf.Spring(1.0, anchor=x).pull(0.5, [0.1, 0.2, 0.3]),
    "pull": lambda x: pf.Spring(1.0, torsion=2.0, at=(0.1, 0.0)).pull(0.5, x),
    "grid": lambda x: Grid.square(0.02, x),
    "index of a cell": lambda x: Grid.around_origin(0.02, 0.01, 4, 2).locate(x),
    "law of the explorer": lambda x: state.State().with_law("lugre", mu_s=x).law,
}  # fmt: skip
TEXTS: dict[str, Callable[[str], Any]] = {
    "setting": settings.parse,
    "patch": lambda text: repr(options.find_patch(text, {})),
    "start": lambda text: identify.parse_start([text]),
    "names": identify.parse_names,
    "nuisance": identify.parse_nuisance,
    "noise": identify.parse_noise,
    "function": lambda text: options.load_function("--measure", text)[0],
    "link": lambda text: state.from_link(text),
}
WRITTEN = (
    "a=1", "a = 0.5, 1", "a=1:2:3", "a=1:1:2", "a=1:2:x", "a=0:1:1", "a=x:1:3", "a=", "=1", "a=1,,2", "a=1,1",
    "a=[1,2],[3]",
    'a="x,y",z', "a=true,false", "a=[1", "a=inf", "mu_c=0.4", "mu_c=", "mu_c,v_s", "mu_c,mu_x", "none", "delay,bias",
    "1,2,3", "1,2,x", "square", "disc", "sqare", "pad.csv", "nothing.py:f", "f", "here.py:measure", "here.py:other",
    "broken.py:f", "#{}", "#%7B%22patch%22:%22Line%22%7D", '{"load":1}', "#[", '{"mass":-1}', "{1}",
)  # fmt: skip
TABLES = {
    "plain.csv": "t,a,b\n0,1,2\n1,3,4\n",
    "units.csv": "t,a,b\n[s],m/s,\n0,1,2\n",
    "semicolons.csv": "# of a rig\nt;a;b\n0,5;1,5;2\n1;x;4\n",
    "quotes.csv": 't,"a, of b",b\n0,"1",2\n',
    "short.csv": "t,a,b\n0,1\n",
    "words.csv": "t,a,b\n0,1,2\n\n0,nan,2\n",
    "empty.csv": "\n\n",
    "header.csv": "t,a,b\n",
    "twice.csv": "t,a,a\n0,1,2\n",
    "tabs.csv": "t\ta\tb\n0\t1\t2\n",
    "map.csv": "0,1,2\n5,6,1\n\n7,8,9\n5,0,5\n",
    "named.csv": "x,1,2\na,3,4\nb,0,6\n",
    "ragged.csv": "3,1\n4\n",
    "negative.csv": "3,-1\n4,2\n",
}
TEKSCAN = "DATA_TYPE MOVIE\nROWS 2\nASCII_DATA @@\nFrame 1\n1,2,B\n3,4,0\n\nFrame 2\n5,6,7\n8,9,0\n"
SCENE = """
t_end = 0.05
body = {mass = 0.2, size = [0.1, 0.05]}
[[contact]]
patch = {shape = "disc", radius = 0.01, cells = 5, metric = {along = 1.0, across = 1.5}}
law = {mu_c = 0.7, gamma = 1.5}
normal_force = {sine = {offset = 2.0, amplitude = 0.5, frequency = 2.0, t_end = 0.05}}
"""
CHANGES = (
    ("", ""), ("0.05", "-1"), ("mass", "mas"), ("size = [0.1, 0.05]", "inertia = 1e-3"), ('"disc"', '"dics"'),
    ("radius", "diameter"), ("mu_c = 0.7", "mu_c = 0.7, mu_s = 0.5"), ("across = 1.5", "across = -1.5"),
    ("sine", "sin"),
    ("amplitude = 0.5,", ""), ("[[contact]]", "[contact]"), ("[[contact]]", "[[contact]]\nmodel = 'reduced'"),
    ("normal_force", "model = {kind = 'reduced', cells = 0}\nnormal_force"), ("t_end = 0.05\nbody", "body"),
    ("normal_force", "position = [1, 2, 3]\nnormal_force"),
    ("[[contact]]", "[spring]\nstiffness = 1\ndamp = 2\n[[contact]]"),
    ("t_end", "start = 'sliding'\nstop_speed = 1e-4\nt_end"),
    ("normal_force", "model = {kind = 'reduced-published', surface = {kind = 'table'}}\nnormal_force"),
)  # fmt: skip

PATCHES = (
    "shape = 'ring', inner_radius = 0.004, outer_radius = 0.01, cells = 5", "shape = 'cells', areas = [1]",
    "shape = 'none'", "shape = 'line', length = 0.02, cells = 4, direction = 'x', profile = [1, 2, 3, 4]",
    "shape = 'polygon', vertices = [[0, 0], [0.02, 0], [0, 0.01]], cells = 4", "shape = 'disc-published', cells = 4",
    "shape = 'points', positions = [[0, 0], [0.01, 0]], weights = [1, 2], asymmetry = [0.1, 0.2]",
    "shape = 'rectangle', width = 0.02, cells = 3, pressure = {law = 'linear_gradient', gradient = [10, -5]}",
    "shape = 'disc', radius = 0.01, cells = 5, pressure = {law = 'soft_finger', c = 0.006, n = 0.33, k = 2}",
    "shape = 'disc', radius = 0.01, cells = 5, pressure = 'uniform'",
    "shape = 'disc', radius = 0.01, pressure = {c = 1}", "shape = 'disc', radius = 0.01, pressure = 'hard'",
    "shape = 'disc', radius = 0.01, pressure = {law = 'soft_finger'}",
    "shape = 'pressure-map', file = 'map.csv', cell_size = 0.001, frame = 0, header = false, index = false",
    "shape = 'pressure-map', files = ['pad.npy', 'pad.npz'], loads = [1, 2], width = 0.01",
    "shape = 'pressure-map', files = ['pad.npy', 'pad.npz'], width = 0.01",
    "shape = 'pressure-map', files = 'pad.npy'", "shape = 'pressure-map', files = [3], loads = [1]",
    "shape = 'pressure-map', file = ''", "shape = 'pressure-map'",
    "shape = 'pressure-map', values = [[1, 2], [0, 1]], cell_size = 1e-3, name = 'pad'", "shape = 3", "radius = 1",
    "shape = 'published', name = 'Line', cells = 11", "shape = 'published', name = 'Lin'",
    "shape = 'disc', radius = 0.01, cells = 5, metric = [[1, 0], [0, 2]]",
    "shape = 'disc', radius = 0.01, metric = {along = 1}",
)  # fmt: skip


def replies() -> dict[str, Any]:
    """Tell what checks and readers return, or the line that they raise, for each of many inputs."""
    told: dict[str, Any] = {
        name: [reply(check, each) for each in VALUES] for name, check in CHECKS.items()
    }
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("here.py").write_text(
            "def measure(run):\n    return 1.0\nother = 3\n", encoding="utf-8"
        )
        Path("broken.py").write_text("1 / 0\n", encoding="utf-8")
        for name, text in TABLES.items():
            Path(name).write_text(text, encoding="utf-8")
        told |= {
            name: [reply(read, each) for each in WRITTEN]
            for name, read in TEXTS.items()
        }
        for name in TABLES:
            told[name] = [
                reply(lambda path: reading.Table(path).names, name),
                reply(lambda path: reading.Table(path).numbers(["t", "b"]), name),
                reply(
                    lambda path: reading.Table(path).numbers(["t", "a"], ["a"]), name
                ),
                reply(lambda path: reading.Table(path).numbers(["b"]), name),
                reply(lambda path: [*reading.read_rows(path, "a table")], name),
                reply(read_pressure_map, name),
                reply(
                    lambda path: read_pressure_map(
                        path, header=False, index=False, frame=1
                    ),
                    name,
                ),
                reply(
                    lambda path: read_pressure_map(
                        path, header=True, index=True, threshold=0.5
                    ),
                    name,
                ),
                reply(lambda path: pf.Signal.from_csv(path, time="t", value="b"), name),
            ]
        told |= (
            map_files()
            | stored_solutions()
            | {"patches": [reply(read_patch, each) for each in PATCHES]}
        )
        for number, (old, new) in enumerate(CHANGES):
            Path("scene.toml").write_text(SCENE.replace(old, new, 1), encoding="utf-8")
            told[f"scene {number}"] = reply(written, "scene.toml")
        told["written"] = [
            reply(lambda path: writing.check_writable(path), each)
            for each in ("a.csv", "no/a.csv", ".", "a.csv/b.csv", "")
        ]
    units = [(kind, 10.0**power) for kind in shown._UNITS for power in range(-10, 10)]
    told["units"] = [shown.unit_for(kind, [0.0, -2.1 * value]) for kind, value in units]
    told["nothing"] = [shown.unit_for(kind) for kind in shown._UNITS]
    return told


def map_files() -> dict[str, Any]:
    """Tell what is read of maps in other files than tables, and of files with several."""
    pressures = np.round(100.0 * MAPS[4.0])
    np.save("pad.npy", pressures)
    np.save("frames.npy", np.stack([pressures, 2.0 * pressures.T]))
    np.save("texts.npy", np.array(["a"]))
    np.savez("pad.npz", pad=pressures)
    np.savez("two.npz", pad=pressures, other=pressures)
    savemat("pad.mat", {"pad": np.stack([pressures, pressures.T], axis=-1)})
    Path("pad.asf").write_text(TEKSCAN)
    Image.fromarray(pressures.astype(np.uint8)).save("pad.png")
    Image.fromarray((255.0 - pressures).astype(np.uint8)).save("print.png")
    Image.fromarray(
        np.stack(
            [pressures.astype(np.uint8)] * 2 + [0 * pressures.astype(np.uint8)], -1
        )
    ).save("colour.png")
    Path("noise.png").write_bytes(b"noise")
    names = ("pad.npy", "frames.npy", "texts.npy", "pad.npz", "two.npz", "pad.mat", "pad.asf", "pad.png", "print.png",
             "colour.png", "noise.png", "pad.xyz", "none.csv")  # fmt: skip
    given: tuple[dict[str, Any], ...] = (
        {}, {"frame": 1}, {"frame": 2}, {"invert": True}, {"threshold": 0.3}, {"threshold": 1.0}, {"frames": 1},
        {"frame_shape": (2, 3)}, {"frame_shape": 3},
    )  # fmt: skip
    return {
        name: [
            reply(lambda each, name=name: read_pressure_map(name, **each), each)
            for each in given
        ]
        for name in names
    }


def stored_solutions() -> dict[str, Any]:
    """Tell how solutions compare, and what loading says of files that are damaged or other ones."""
    run = synthetic.solution()
    other = synthetic.solution(scale=1.1)
    content = run.save("run.nc").read_bytes()
    Path("damaged.nc").write_bytes(content.replace(b"success", b"failure"))
    Path("short.nc").write_bytes(content[:300])
    Path("text.nc").write_text("text", encoding="utf-8")
    pf.scenes.solution.write_dataset(run.data, "plain.nc")
    again = pf.Solution.load("run.nc")
    files_ = ("damaged.nc", "short.nc", "text.nc", "plain.nc", "none.nc")
    return {
        "same": [
            again == run,
            run == other,
            run == 3,
            run != again,
            hash(run) == hash(again),
        ],
        "tables": [
            reply(read_json, each)
            for each in ('{"t_end": 1, "t_end": 2}', "[1]", '{"name": "a"}')
        ],
        "kinds": [
            reply(run.scene.to_file, f"run{kind}")
            for kind in (".toml", ".json", ".txt", "")
        ],
        "back": [
            pf.Scene.from_file(f"run{kind}") == run.scene for kind in (".toml", ".json")
        ],
        "loads": [reply(pf.Solution.load, each) for each in files_],
        "contacts": [reply(run.contact_index, each) for each in (None, "pad", "pud")],
        "checks": [
            [each.words, each.expected, each.tolerance] for each in doctor.checks()
        ],
        "outcomes": [
            doctor.Check("x", lambda each=each: each, 1.0, 0.1).outcome()
            for each in (1.0, 1.1, 1.2, "a", np.nan)
        ],
    }


def read_json(text: str) -> Any:
    """Read a scene file of this text."""
    Path("scene.json").write_text(text, encoding="utf-8")
    return repr(pf.Scene.from_file("scene.json"))


def read_patch(text: str) -> Any:
    """Read a patch as in a scene file; tell it and its weights."""
    table = tomllib.loads(f"patch = {{{text}}}")["patch"]
    patch = patch_from_dict(Section(table, "patch", "scene.toml", Path()))
    return [as_arrays(patch.to_dict()), patch.weights(1.5)]


def written(path: str) -> Any:
    """Read a scene and tell what is written of it."""
    return recorded.text(files.to_toml(pf.Scene.from_file(path).to_dict()))


def reply(call: Callable[[Any], Any], value: Any) -> Any:
    """Return what a call returns, with its warnings if there are any, or the error that it raises in words."""
    try:
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            found = call(value)
        return [found, *(str(each.message) for each in warned)] if warned else found
    except FrictionError as error:
        return re.sub(r"0x\w+|/\S*/tmp\w+", "#", f"{type(error).__name__}: {error}")


def swept() -> dict[str, Any]:
    """Tell sweeps of motions and of measured numbers, with failures and runs from before."""
    patch = pf.ContactPatch.disc(0.01, 5)
    told: dict[str, Any] = {}
    said: list[str] = []

    def make(mu: float, kind: str) -> pf.Scene:
        model = {"few": pf.ReducedModel, "all": pf.DistributedModel}[kind](
            patch, pf.LuGre(mu_c=mu, mu_s=1.1)
        )
        return pf.scenes.free_slide(
            model, twist=(0.1, 0.0, 5.0), t_end=0.02 if mu == 0.4 else 1.0
        )

    def measured(run: pf.Solution) -> dict[str, Any]:
        x = run.histories["x"].values
        return {
            "way": float(x[-1]),
            "end": run.status,
            "path": np.interp([0.0, 0.01], run.histories["time"].values, x),
        }

    values = {"mu": [0.4, 0.8, 2.0], "kind": ["few", "all"]}
    with tempfile.TemporaryDirectory() as folder:
        told["motion"] = without_runs(
            sweeps.sweep(make, {"mu": values["mu"][:2], "kind": ["few"]}, out=folder)
        )
        again = sweeps.sweep(
            make,
            values,
            out=folder,
            progress=lambda each: said.append(str(each._replace(left=None))),
        )
        told["more"] = without_runs(again)
        told["said"] = said[-1]
        told["found"] = without_runs(
            sweeps.finished_runs(make, values | {"mu": [0.4, 0.5]}, out=folder)
        )
    told["measured"] = without_runs(sweeps.sweep(make, values, measure=measured))
    plate = ready.in_hand(pf.ReducedModel(patch, LAW, cells=4), t_end=0.05)
    ways = {"body.mass": [-1.0, 0.1, 0.3]}
    told["of a scene"] = without_runs(
        sweeps.sweep(
            plate, ways, measure=lambda run: float(run.histories["y"].values[-1])
        )
    )
    told["times"] = [
        str(sweeps.Progress(9, 4, 1, 1, 2, left))
        for left in (3.2, 89.6, 100.0, 9000.0, None)
    ]
    scene = settings.Settable(ready.in_hand(pf.ReducedModel(patch, LAW), t_end=0.1))
    changes = (
        {"body.mass": 0.3}, {"fingers.law.mu_c": 0.5, "t_end": 0.2}, {"body.position.0": 0.1},
        {"fingers.model": "distributed"}, {"fingers.patch.name": "pad"}, {"body.mas": 1.0}, {"finger.law.mu_c": 1.0},
        {"body.position.5": 1.0}, {"body": 2.0},
        {"fingers.law.mu_x": 0.5}, {"fingers.count.a": 1}, {"": 1.0},
    )  # fmt: skip
    told["settings"] = [
        reply(lambda each: as_arrays(scene(**each).to_dict()), each) for each in changes
    ]
    return told


def without_runs(data: Any) -> Any:
    """Return a dataset without the names of its runs, which depend on the sources."""
    return data.drop_vars("run")


def explored() -> dict[str, Any]:
    """Tell answers, pictures, texts and code of states of the explorer."""
    told: dict[str, Any] = {}
    painted = drawing.Drawing.published("Square").painted(
        0.004, 0.002, radius=0.003, pressure=0.4
    )
    first = state.State()
    states = state.PRESETS | {
        "painted": first.changed(drawing=painted.scaled(2e-3), normal_force=2.0),
        "still": first.changed(twist=(0.0, 0.0, 0.0)),
        "sliding": first.sliding(0.01, 0.02).with_law("dahl", sigma_0=1e4),
        "about": first.turning_about(0.003, -0.002),
    }
    for name, each in states.items():
        found = state.answer(each)
        map_ = each.drawing
        figure = pictures.moved(
            pictures.surface_figure(each, quick=name == "painted"), found
        )
        told[name] = {
            "link": state.to_link(state.from_link(state.to_link(each))), "answer": found, "needed": each.needed_load,
            "centre": each.centre_of_rotation, "python": code.python(each), "toml": code.toml(each),
            "mujoco": code.mujoco(each), "image": pictures.pressure_image(map_), "slip": pictures.slip_arrows(each),
            "arrows": pictures.wrench_arrows(each, found), "point": pictures.points_of_interest(each),
            "section": pictures.section_lines(each, found), "figure": figure, "errors": map_.largest_errors,
            "numbers": pictures.numbers_table(each, found, 0.012), "hold": pictures.holding_line(each),
            "grid": pictures.grid_line(each), "size": [map_.width, map_.height, map_.name, map_.origin],
            "law": state.law_parameters(each.law), "motion": ladder.motion(each).to_dict(),
        }  # fmt: skip
    told["ladder"] = [
        each._replace(seconds=0.0) for each in ladder.climb(states["painted"])
    ]
    told["looks"] = [looks.wrong('a "b"'), looks.grows(300), looks.grows(200, most=400)]
    told["cleared"] = [painted.cleared().pressures, painted.scaled(1e-3).name]
    return told
