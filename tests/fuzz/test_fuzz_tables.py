"""Tables, pressure maps and pictures with something wrong in them: what they hold, or one line that names the file."""

from __future__ import annotations

import io
import random
from pathlib import Path

import numpy as np
from attack import attack, folder
from judge import Broken, finite, judge
from mutation import mutated_bytes
from PIL import Image

import planarfriction as pf

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
TIME = np.arange(30) * 0.01
MOTION = np.stack(
    [0.01 * np.sin(9.0 * TIME), 0.01 * TIME, 0.2 * np.sin(5.0 * TIME)], axis=1
)


def log(names: str, columns: np.ndarray) -> bytes:
    """A log as a rig writes it."""
    text = io.StringIO()
    np.savetxt(text, columns, delimiter=",", header=names, comments="", fmt="%.9g")
    return text.getvalue().encode()


LOGS = [
    log(
        "t,vx,vy,omega,fx,fy,tau,normal_force",
        np.column_stack([TIME, MOTION, -MOTION, 2.0 + TIME]),
    ),
    log(
        "t,x,y,theta,fx,fy,tau,normal_force",
        np.column_stack([TIME, MOTION, -MOTION, 2.0 + TIME]),
    ),
]
MAP = np.outer(np.arange(1, 6), np.arange(1, 8))


def picture(kind: str, mode: str) -> bytes:
    file = io.BytesIO()
    Image.fromarray((255 * MAP / MAP.max()).astype(np.uint8)).convert(mode).save(
        file, format=kind
    )
    return file.getvalue()


def array(values: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.save(file, values)
    return file.getvalue()


MAPS = {
    "map.csv": [(EXAMPLES / "pad_pressure.csv").read_bytes(), b"0,1,1\n0,1,1\n"],
    "map.npy": [array(1.0 * MAP), array(MAP.astype("f4")), array(MAP.astype(">i2"))],
    "map.png": [picture("PNG", "L"), picture("PNG", "RGB"), picture("PNG", "1")],
    "map.tif": [picture("TIFF", "L"), picture("TIFF", "F")],
    "map.bmp": [picture("BMP", "L")],
    "map.pgm": [picture("PPM", "L")],
    "map.jpg": [picture("JPEG", "L")],
}


@attack("tables", 150)
def test_signals(draw: random.Random) -> None:
    with folder() as here:
        path = here / "load.csv"
        path.write_bytes(mutated_bytes((EXAMPLES / "load.csv").read_bytes(), draw))
        read = judge(
            "tables: signals",
            lambda: pf.Signal.from_csv(path, value="normal_force"),
            names=("load.csv",),
        )
        if read is not None:
            finite((read.times, read.values), "the signal")


@attack("tables", 250)
def test_logs(draw: random.Random) -> None:
    with folder() as here:
        path = here / "log.csv"
        path.write_bytes(mutated_bytes(draw.choice(LOGS), draw))
        read = judge(
            "tables: logs", lambda: pf.identify.Log.from_csv(path), names=("log.csv",)
        )
        if read is not None:
            finite((read.time, read.twist, read.wrench, read.normal_force), "the log")


@attack("tables", 300)
def test_pressure_maps(draw: random.Random) -> None:
    name = draw.choice(list(MAPS))
    with folder() as here:
        path = here / name
        path.write_bytes(mutated_bytes(draw.choice(MAPS[name]), draw))
        made = judge(
            "tables: pressure maps",
            lambda: pf.ContactPatch.from_pressure(path, 0.001),
            names=("map",),
        )
        if made is not None:
            finite((made.weights(), made.contact_radius()), "the patch")
            # Rounding of a sum over at most 1e5 cells.
            if abs(made.weights().sum() - 1.0) > 1e-9:
                raise Broken("the weights of the map do not add up to one")
