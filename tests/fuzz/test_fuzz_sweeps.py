"""Sweeps that are killed, or whose stores are damaged, and go on: the same bits, or one line that says why."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time

import numpy as np
from attack import attack, folder
from judge import Broken, judge
from mutation import mutated_bytes

import planarfriction as pf

VALUES = {"mass": [0.5, 1.0, 2.0], "fall": [0.3, 0.6]}

SCRIPT = """
import sys
import planarfriction as pf
model = pf.ReducedModelPublished(pf.ContactPatch.disc(0.01, 5), pf.LuGre())
def scene(mass, fall):
    return pf.scenes.driven(model, t_end=0.02, normal_force=mass * fall)
pf.sweep(scene, {values!r}, out=sys.argv[1])
"""


def swept(out: str) -> object:
    """Return the sweep, finished in this process."""
    model = pf.ReducedModelPublished(pf.ContactPatch.disc(0.01, 5), pf.LuGre())
    return pf.sweep(
        lambda mass, fall: pf.scenes.driven(
            model, t_end=0.02, normal_force=mass * fall
        ),
        VALUES,
        out=out,
    )


def same(found, expected) -> None:
    for name in ("fx", "x", "omega"):
        if not np.array_equal(found[name].values, expected[name].values):
            raise Broken(f"{name} of a sweep that went on differs")


@attack("sweeps", 2)
def test_killed_sweeps(draw: random.Random) -> None:
    with folder():
        out = "runs"
        expected = swept("whole")
        script = SCRIPT.format(values=VALUES)
        for _ in range(2):
            process = subprocess.Popen(
                [sys.executable, "-c", script, out], stderr=subprocess.DEVNULL
            )
            deadline = time.monotonic() + draw.uniform(1.0, 6.0)
            while process.poll() is None and time.monotonic() < deadline:
                time.sleep(0.002)
            process.send_signal(signal.SIGKILL)
            process.wait()
        found = judge(
            "sweeps that were killed and go on", lambda: swept(out), compiles=True
        )
        if found is None:
            raise Broken("cannot go on after a kill")
        same(found, expected)


@attack("sweeps", 6)
def test_damaged_stores(draw: random.Random) -> None:
    with folder() as here:
        out = "runs"
        expected = swept("whole")
        swept(out)
        files = sorted(path for path in (here / out).rglob("*") if path.is_file())
        path = draw.choice(files)
        change = draw.randrange(3)
        if change == 0:
            path.unlink()
        elif change == 1:
            path.unlink()
            path.mkdir()
        else:
            path.write_bytes(mutated_bytes(path.read_bytes(), draw))
        found = judge("damaged stores of sweeps", lambda: swept(out), compiles=True)
        if found is None or (found.status.values == "failed").any():
            return
        same(found, expected)
