"""A solution with known numbers, made without a solver: for tests of what is drawn, written and printed."""

from __future__ import annotations

import dataclasses

import numpy as np
import xarray as xr

import planarfriction as pf
from planarfriction.scenes import Statistics

PLATE = np.array([[-0.075, -0.04], [0.075, -0.04], [0.075, 0.04], [-0.075, 0.04]])
UNITS = {"x": "m", "y": "m", "theta": "rad", "vx": "m/s", "vy": "m/s", "omega": "rad/s"}
CONTACT_UNITS = {"fx": "N", "fy": "N", "tau": "N m", "normal_force": "N"}


def scene(
    contacts: int = 1,
    mounted_on: str = "world",
    patch=None,
    outline=PLATE,
    name: str = "in-hand",
) -> pf.Scene:
    """A plate with `contacts` pads in a row, 0.03 m apart."""
    model = pf.DistributedModel(
        patch or pf.ContactPatch.disc_published(0.01), pf.LuGre(mu_s=1.2)
    )
    names = (
        ["pad"]
        if contacts == 1
        else [f"pad {number + 1}" for number in range(contacts)]
    )
    pads = [
        pf.Contact(
            model, 2.0, mounted_on=mounted_on, position=(0.03 * number, 0.0), name=each
        )
        for number, each in enumerate(names)
    ]
    return pf.Scene(
        pf.Body(0.2, 5e-4, (0.002, 0.0), outline=outline), pads, 2.0, name=name
    )


def solution(
    of: pf.Scene | None = None, *, scale: float = 1.0, t_end: float = 2.0
) -> pf.Solution:
    """The plate falls by `0.005 scale t^2` and turns by `-0.3 scale t^2`; forces are sines, contact i carries i + 1."""
    of = scene() if of is None else of
    time = np.linspace(0.0, t_end, round(100 * t_end) + 1)
    number = np.arange(1, len(of.contacts) + 1)
    body = {
        "x": 0.002 + 0.0 * time,
        "y": -0.005 * scale * time**2,
        "theta": -0.3 * scale * time**2,
        "vx": 0.0 * time,
        "vy": -0.01 * scale * time,
        "omega": -0.6 * scale * time,
    }
    load = {
        "fx": 0.1 * np.sin(6 * time),
        "fy": 1.0 + 0.1 * np.cos(6 * time),
        "tau": 1e-3 * np.sin(3 * time),
        "normal_force": 2.0 + 0.0 * time,
    }
    data = xr.Dataset(
        {
            name: ("time", values, {"units": UNITS[name]})
            for name, values in body.items()
        }
        | {
            name: (
                ("time", "contact"),
                values[:, None] * number,
                {"units": CONTACT_UNITS[name]},
            )
            for name, values in load.items()
        },
        coords={
            "time": ("time", time, {"units": "s"}),
            "contact": [contact.name for contact in of.contacts],
        },
    )
    return pf.Solution(
        data,
        Statistics(steps=1234, rejections=56, wall_time=0.25),
        "success",
        "reached the end",
        of,
    )


def run(scale: float = 1.0, **options) -> pf.Solution:
    """Return the solution of a scene with options."""
    return solution(scene(**options), scale=scale)


def changed(run: pf.Solution, **values) -> pf.Solution:
    """Return the solution with other values of some of its variables."""
    data = run.data.assign(
        {name: (run.data[name].dims, each) for name, each in values.items()}
    )
    return dataclasses.replace(run, histories=data)
