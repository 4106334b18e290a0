"""Figures and printed texts of the library, to be recorded: `python -m tests.support.subjects figures commands`."""

from __future__ import annotations

import contextlib
import io
import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import planarfriction as pf
from planarfriction import plots
from planarfriction.cli import main
from planarfriction.identify import FitOptions, Identification, identify_lugre
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.planning import Push, Pusher, Slider, push
from tests.support import recorded, synthetic
from tests.support.identification_logs import PATCH, clean_log, excitation, noisy

FOLDER = Path(__file__).parents[1] / "recorded"

UNSURE = "wall time|faster than real time|steps|^delay|^bias|^zero_drift|^load_|^noise_"
LEFT_OUT = re.compile(f"^.*(?:{UNSURE}).*\n", re.MULTILINE)
"""Lines that differ from run to run, or from processor to processor."""

MODEL = """model = "reduced-published"
patch = {shape = "disc", radius = 0.01, cells = 5}
law = {mu_c = 0.7}
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
)
"""Calls of `planarfriction`, each in the folder that those before have left."""


def figures() -> dict[str, Any]:
    """Draw each kind of figure, most of them of motions with closed forms."""
    patches = {name: PUBLISHED_PATCHES[name]() for name in ("LineGradX", "NonConvex1", "Square")}
    run, other = synthetic.solution(), synthetic.solution(scale=1.3)
    on_body = synthetic.solution(synthetic.scene(3, mounted_on="body", patch=patches["Square"]))
    legs = pf.ContactPatch.points([(0.0, 0.1), (-0.1, -0.05), (0.1, -0.05)])
    standing = synthetic.solution(synthetic.scene(mounted_on="body", patch=legs, outline=None))
    cells = pf.LimitSurfaceCells(patches["NonConvex1"])
    return {
        **{f"patch {name}": plots.plot_patch(patch, normal_force=2.0) for name, patch in patches.items()},
        "points": plots.plot_patch(legs, normal_force=3.0, size=(3.5, 3.0)),
        "surface": plots.plot_limit_surface(cells),
        "exact surface": plots.plot_limit_surface(pf.LimitSurfaceExact(PATCH), beside=cells),
        "histories": plots.plot_histories({"one": run, "other": other}),
        "histories of pads": plots.plot_histories(on_body, size=(3.5, 3.0)),
        "motion": plots.plot_motion(run),
        "motion of pads": plots.plot_motion(on_body),
        "motion of points": plots.plot_motion(standing),
        "solution": run.plot(),
        "identification": identified().plot(),
        "push": pushed().plot(),
    }


def identified() -> Identification:
    """Fit two parameters of a noisy log."""
    log = noisy(clean_log(*excitation(duration=0.5)), 0)
    options = FitOptions(nuisance=(), starts=1, refine=4, elasto_plastic=0.9)
    return identify_lugre(log, PATCH, model="reduced-published", parameters=("mu_c", "mu_s"), options=options)


def pushed() -> Push:
    """Push a square off its centre."""
    half = 0.045
    slider = Slider(
        pf.LimitSurfaceEllipsoid(pf.ContactPatch.rectangle(2 * half, cells=5)),
        [(-half, -half), (half, -half), (half, half), (-half, half)],
    )
    return push(slider, Pusher(0.3), pf.Signal.sampled([0.0, 1.0], [(-0.06, 0.01), (0.0, 0.03)], "linear"))


def printed() -> dict[str, Any]:
    """Call commands in an empty folder; returns exit codes and texts, and what the files hold that they write."""
    found: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("model.toml").write_text(MODEL, encoding="utf-8")
        log = noisy(clean_log(*excitation(duration=0.5)), 0)
        rows = np.column_stack([log.time, log.twist, log.wrench, np.broadcast_to(log.normal_force, len(log.time))])
        np.savetxt("log.csv", rows, "%.9g", ",", header="time,vx,vy,omega,fx,fy,tau,normal_force", comments="")
        for call in COMMANDS:
            out, err = io.StringIO(), io.StringIO()
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
                code = main(call.split())
            found[call] = [code, *(LEFT_OUT.sub("", each.getvalue()) for each in (out, err))]
        for path in sorted(Path().rglob("*.csv")):
            found[path.as_posix()] = recorded.text(path.read_text(encoding="utf-8"))
    return found
