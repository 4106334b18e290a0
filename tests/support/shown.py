"""Figures and printed texts of the library, to be recorded: `python -m tests.support.recording figures commands`."""

from __future__ import annotations

import contextlib
import io
import re
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

import planarfriction as pf
from planarfriction import plots
from planarfriction.cli import console, main
from planarfriction.identify import FitOptions, Identification, Log, identify_lugre
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.planning import Push, Pusher, Slider, push
from planarfriction.sweeps import running
from tests.support import recorded, synthetic
from tests.support.identification_logs import PATCH, clean_log, excitation, noisy

UNSURE = "compil|^left out:|wall time|faster than real time|steps|^delay|^bias|^zero_drift|^load_|^noise_"
LEFT_OUT = re.compile(f"^.*(?:{UNSURE}).*\n", re.MULTILINE)
"""Lines that differ from run to run, or from processor to processor."""
SPACED = re.compile(r"([ ─━])\1+")
"""Widths of tables, which depend on lines that are left out."""

MODEL = """model = "reduced-published"
patch = {shape = "disc", radius = 0.01, cells = 5}
law = {mu_c = 0.7}
"""

SCENE = """t_end = 0.1
name = "two pads"
body = {mass = 0.2, size = [0.1, 0.05], position = [0.01, 0.0]}
[[contact]]
name = "pad"
patch = {shape = "rectangle", width = 0.02, cells = 5}
law = {mu_c = 0.7}
normal_force = 1.5
[[contact]]
name = "rim"
model = "reduced"
patch = {shape = "disc", radius = 0.01, cells = 7}
law = {mu_c = 0.4, mu_s = 0.5}
normal_force = 1.0
position = [0.03, 0.0]
"""

MEASURE = """
def way(run):
    return {"way": float(run.data.y[-1]), "turn": float(run.data.theta[-1])}
none = 3
"""

COMMANDS = (
    "run in-hand --model reduced --patch Square --t-end 0.5 --out out",
    "run in-hand --model both --cells 16 --t-end 0.5",
    "run in-hand --set mass=-1",
    "run driven --t-end 0.2",
    "sweep in-hand --set mass=0.2:0.3:2 --set t_end=0.6 --out runs",
    "sweep in-hand --set mass=0.1:0.3",
    "limit-surface --patch NonConvex1 --surface table --csv samples.csv",
    "limit-surface --patch Square --surface exact",
    "export model.toml --out friction --name pad",
    "identify log.csv --patch disc --width 0.02 --model reduced-published",
    "identify plan --patch disc --start mu_c=0.5 --start sigma_0=2e4 --out next.csv",
    "identify log.csv --patch disc --width 0.02 --model reduced-published --parameters mu_c,contact_radius --starts 1"
    " --nuisance none --noise 5e-3,5e-3,5e-5 --start mu_s=0.65 --start v_s=2e-3 --start gamma=1.4 --start sigma_0=2e4"
    " --start sigma_1=30 --start sigma_2=0.8 --out fit",
    "run scene.toml --model reduced --patch Line --cells 6 --set body.mass=0.3",
    "run scene.toml --cells 5 --t-end 0.05 --out again",
    "run curling --t-end 0.3 --model reduced --cells 4",
    "run pivot --t-end 0.1 --max-steps 5 --out part",
    "run free-slide --t-end 0.02 --model reduced --cells 4 --out drawn --plot",
    "sweep scene.toml --set body.mass=0.1:0.3:2 --set pad.law.mu_c=0.5,0.6 --measure here.py:way --out ways",
    "sweep free-slide --set mass=0.1:0.3:41 --cells 4 --t-end 0.01 --out many",
    "sweep free-slide --set mass=0.2,-1 --t-end 0.05 --cells 4 --out failing",
    "limit-surface --pressure pad.csv --cell-size 0.001 --surface cells --no-header --no-index",
    "limit-surface --pressure many.csv --cell-size 0.001 --surface ellipsoid --no-header --no-index",
    "limit-surface --patch ring", "limit-surface --alone", "limit-surface --patch Line --pressure pad.csv",
    "limit-surface --csv a.txt", "limit-surface --out a.gif", "limit-surface --patch disc --invert",
    "run in-hand --model distributed --cells 8", "run nothing",
    "run in-hand --set mass=1,2", "run in-hand --set mas=1", "run scene.toml --width 0.1",
    "run scene.toml --set pad.mu=1", "run in-hand --t-end -1", "run in-hand --rtol 0", "run in-hand --max-steps 0",
    "sweep in-hand --set a", "sweep in-hand --set mass=1 --model x",
    "sweep in-hand --set mass=1 --measure here.py:none",
    "export scene.toml --out c --contact pud", "export model.toml --out c --contact pad", "export none.toml --out c",
    "export model.toml --out c --precision half", "export model.toml --out c --name 3d", "export scene.toml --out c",
    "identify none.csv", "identify log.csv --start mu_c", "identify log.csv --noise 1,2",
    "identify pad.csv", "identify log.csv --model x",
    "identify log.csv --parameters mu_x", "identify log.csv --nuisance wind",
    "identify plan --out a.txt", "identify plan --wanted mu_x", "identify plan --speed 0", "identify joint none.csv",
    "identify joint log.csv --kp 3", "identify joint log.csv --kp 3 --kp 4 --kp 5 --supply 7", "nothing",
)  # fmt: skip
"""Calls of `planarfriction`, each in the folder that those before have left."""


def figures() -> dict[str, Any]:
    """Draw each kind of figure, most of them of motions with closed forms."""
    patches = {
        name: PUBLISHED_PATCHES[name]()
        for name in ("LineGradX", "NonConvex1", "Square")
    }
    run = synthetic.solution()
    other = synthetic.solution(scale=1.3)
    on_body = synthetic.solution(
        synthetic.scene(3, mounted_on="body", patch=patches["Square"])
    )
    legs = pf.ContactPatch.points([(0.0, 0.1), (-0.1, -0.05), (0.1, -0.05)])
    standing = synthetic.solution(
        synthetic.scene(mounted_on="body", patch=legs, outline=None)
    )
    cells = pf.LimitSurfaceCells(patches["NonConvex1"])
    return {
        **{
            f"patch {name}": plots.plot_patch(patch, normal_force=2.0)
            for name, patch in patches.items()
        },
        "points": plots.plot_patch(legs, normal_force=3.0, size=(3.5, 3.0)),
        "discs": plots.plot_patch(patches["LineGradX"].discs(5), normal_force=2.0),
        "surface": plots.plot_limit_surface(cells),
        "exact surface": plots.plot_limit_surface(
            pf.LimitSurfaceExact(PATCH), beside=cells
        ),
        "histories": plots.plot_histories({"one": run, "other": other}),
        "histories of pads": plots.plot_histories(on_body, size=(3.5, 3.0)),
        "motion": plots.plot_motion(run),
        "motion of pads": plots.plot_motion(on_body),
        "motion of points": plots.plot_motion(standing),
        "solution": run.plot(),
        "identification": identified().plot(),
        "identification of two": identified(2).plot(),
        "identification of a line": identified(line=True).plot(),
        "push": pushed().plot(),
        "wide push": pushed(Pusher(0.3, 0.02)).plot(),
    }


def identified(logs: int = 1, line: bool = False) -> Identification:
    """Fit two parameters of noisy logs, or of a log of one coordinate."""
    given = [noisy(clean_log(*excitation(duration=0.5)), seed) for seed in range(logs)]
    if line:
        time = 5e-3 * np.arange(200)
        log = clean_log(
            time, np.outer(0.05 * time * np.sin(11.0 * time), [1.0, 0.0, 0.0])
        )
        given = [
            Log(
                time,
                log.twist,
                log.wrench * [1.02, 0.0, 0.0]
                + [[0.01, 0.0, 0.0]] * np.sin(300.0 * time)[:, None],
                4.0,
            )
        ]
    options = FitOptions(nuisance=(), starts=1, refine=4, elasto_plastic=0.9)
    return identify_lugre(
        given,
        PATCH,
        model="reduced-published",
        parameters=("mu_c", "mu_s"),
        options=options,
    )


def pushed(pusher: Pusher = Pusher(0.3)) -> Push:  # noqa: B008
    """Push a square off its centre."""
    half = 0.045
    slider = Slider(
        pf.LimitSurfaceEllipsoid(pf.ContactPatch.rectangle(2 * half, cells=5)),
        [(-half, -half), (half, -half), (half, half), (-half, half)],
    )
    ends = np.array([(-0.06, 0.01, 0.0), (0.0, 0.03, 0.1)])[
        :, : 3 if pusher.width else 2
    ]
    return push(slider, pusher, pf.Signal.sampled([0.0, 1.0], ends, "linear"))


def printed() -> dict[str, Any]:
    """Call commands in a folder with a model, a scene, a map and a log: see `called`."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("model.toml").write_text(MODEL, encoding="utf-8")
        Path("scene.toml").write_text(SCENE, encoding="utf-8")
        Path("here.py").write_text(MEASURE, encoding="utf-8")
        Path("many.csv").write_text(40 * (39 * "1," + "2\n"), encoding="utf-8")
        Path("pad.csv").write_text("1,2,1\n0,2,0\n", encoding="utf-8")
        log = noisy(clean_log(*excitation(duration=0.5)), 0)
        rows = np.column_stack(
            [
                log.time,
                log.twist,
                log.wrench,
                np.broadcast_to(log.normal_force, len(log.time)),
            ]
        )
        np.savetxt(
            "log.csv",
            rows,
            "%.9g",
            ",",
            header="time,vx,vy,omega,fx,fy,tau,normal_force",
            comments="",
        )
        return called(COMMANDS)


def called(commands: Sequence[str]) -> dict[str, Any]:
    """Call commands in this folder; returns exit codes and texts, and what the tables hold that they write."""
    found: dict[str, Any] = {}
    with (
        mock.patch.object(console, "EVERY", 1e6),
        mock.patch.object(running, "_BETWEEN", 1e6),
    ):
        for call in commands:
            out = io.StringIO()
            err = io.StringIO()
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
                code = main(call.split())
            found[call] = [
                code,
                *(
                    SPACED.sub(r"\1", LEFT_OUT.sub("", each.getvalue()))
                    for each in (out, err)
                ),
            ]
        for path in sorted(Path().rglob("*.csv")):
            found[path.as_posix()] = recorded.text(path.read_text(encoding="utf-8"))
    return found
