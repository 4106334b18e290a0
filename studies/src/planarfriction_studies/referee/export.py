"""Cases for engines that know nothing of this library: TOML, MJCF, SDF, and CSV of forces and truths."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction._support.writing import write_text
from planarfriction_studies.referee.case import (
    FOLDER,
    QUANTITIES,
    Body,
    Case,
    Contact,
    Shape,
)


def mjcf(
    case: Case,
    dt: float,
    options: str = "",
    contact: str = "",
    integrator: str = "Euler",
) -> str:
    """Return MJCF with free bodies, pads on slides, and a pair for each contact.

    `options` and `contact` are attributes of its `option` and of all pairs. Sites `patch 0`, ... are where patches are.
    Forces, and gravity on inclines, are not in it.
    """
    bodies = "\n".join(_body(case, body) for body in case.bodies)
    pairs = "\n".join(f"  <pair {_pair(each)} {contact}/>" for each in case.contacts)
    return f"""<mujoco model="{escape(case.name)}">
<option timestep="{dt}" gravity="{_numbers(case.gravity)}" integrator="{integrator}" {options}/>
<default><geom contype="0" conaffinity="0"/></default>
<worldbody>
{bodies}
</worldbody>
<contact>
{pairs}
</contact>
</mujoco>
"""


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:.12g}" for value in values)


def _body(case: Case, body: Body) -> str:
    parts = [_geom(shape) for shape in body.shapes]
    own = {shape.name for shape in body.shapes}
    parts += [
        f'<site name="patch {i}" pos="{_numbers(contact.at)}"/>'
        for i, contact in enumerate(case.contacts)
        if contact.pair[1] in own
    ]
    if body.joint != "fixed":
        joint = (
            "<freejoint/>"
            if body.joint == "free"
            else '<joint type="slide" axis="0 0 1"/>'
        )
        place = f'pos="{_numbers(body.centre_of_mass)}" mass="{body.mass:.12g}"'
        parts = [
            joint,
            f'<inertial {place} diaginertia="{_numbers(body.moments)}"/>',
            *parts,
        ]
    inner = "\n".join(f"    {part}" for part in parts)
    return f'  <body name="{escape(body.name)}" pos="{_numbers(body.position)}">\n{inner}\n  </body>'


def _geom(shape: Shape) -> str:
    """Return a geom; MuJoCo takes half of sides and lengths."""
    sizes = {
        "plane": lambda: (9.0, 9.0, 0.1),
        "box": lambda: shape.half,
        "sphere": lambda: shape.size,
        "cylinder": lambda: (shape.size[0], 0.5 * shape.size[1]),
        "capsule": lambda: (shape.size[0], 0.5 * shape.size[1]),
    }
    place = f'pos="{_numbers(shape.position)}" zaxis="{_numbers(shape.axis)}"'
    return f'<geom name="{escape(shape.name)}" type="{shape.kind}" size="{_numbers(sizes[shape.kind]())}" {place}/>'


def _pair(contact: Contact) -> str:
    """Return names and friction of a pair: MuJoCo's first tangent is y and its second one x where normals are z."""
    along, across = contact.mu
    first, second = contact.pair
    return f'geom1="{escape(first)}" geom2="{escape(second)}" friction="{across:.12g} {along:.12g} 0.005 0.0001 0.0001"'


GRIPS = 1e3
"""Coefficient of fixed bodies: of two coefficients, readers of SDF take the smaller one [-]."""


def sdf(case: Case, dt: float) -> str | None:
    """Return SDF of a case with a time step [s]; None if a body has several coefficients, or friction has Stribeck's.

    Forces, velocities, gravity on inclines, and the pairs of shapes that touch are not in it.
    """
    mus = {
        name: {each.mu for each in case.contacts if name in each.pair}
        for name in case.shapes
    }
    moving = [name for name, (body, _) in case.shapes.items() if body.joint != "fixed"]
    if any(len(mus[name]) > 1 for name in moving) or any(
        each.mu_s is not None for each in case.contacts
    ):
        return None
    grips = {
        name: (GRIPS, GRIPS)
        if name not in moving
        else next(iter(mus[name]), (0.0, 0.0))
        for name in case.shapes
    }
    models = "\n".join(_model(body, grips) for body in case.bodies)
    return f"""<?xml version="1.0"?>
<sdf version="1.9"><world name="{escape(case.name)}">
<gravity>{_numbers(case.gravity)}</gravity>
<physics name="steps" type="ode"><max_step_size>{dt}</max_step_size></physics>
{models}
</world></sdf>
"""


def _model(body: Body, grips: Mapping[str, Sequence[float]]) -> str:
    shapes = "\n".join(_collision(shape, *grips[shape.name]) for shape in body.shapes)
    fixed = body.joint == "fixed"
    slides = body.joint == "slide"
    inertial = "" if fixed else _inertial(body)
    joint = """  <joint name="slide" type="prismatic"><parent>world</parent><child>link</child>
  <axis><xyz>0 0 1</xyz></axis></joint>\n"""
    return f"""<model name="{escape(body.name)}"><static>{str(fixed).lower()}</static>
  <pose>{_numbers(body.position)} 0 0 0</pose>
  <link name="link">
{inertial}{shapes}
  </link>
{joint if slides else ""}</model>"""


def _inertial(body: Body) -> str:
    moments = "".join(
        f"<i{a}{a}>{moment:.12g}</i{a}{a}>"
        for a, moment in zip("xyz", body.moments, strict=True)
    )
    return f"""  <inertial><pose>{_numbers(body.centre_of_mass)} 0 0 0</pose><mass>{body.mass:.12g}</mass>
  <inertia>{moments}<ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>
"""


def _collision(shape: Shape, along: float, across: float) -> str:
    """Return a shape; the axis of a round one is turned from z to x about y."""
    inner = {
        "plane": "<normal>0 0 1</normal><size>18 18</size>",
        "box": f"<size>{_numbers(shape.size)}</size>",
        "sphere": f"<radius>{_numbers(shape.size)}</radius>",
    }.get(
        shape.kind
    ) or f"<radius>{shape.size[0]:.12g}</radius><length>{shape.size[1]:.12g}</length>"
    turn = "0 1.5707963267948966 0" if shape.axis[0] else "0 0 0"
    return f"""  <collision name="{escape(shape.name)}"><pose>{_numbers(shape.position)} {turn}</pose>
  <geometry><{shape.kind}>{inner}</{shape.kind}></geometry><surface><friction><ode><mu>{along:.12g}</mu>
  <mu2>{across:.12g}</mu2><fdir1>1 0 0</fdir1></ode></friction></surface></collision>"""


SAMPLES = 1e-3
"""Time between rows of the forces [s]."""


def export_case(case: Case, folder: Path) -> None:
    """Write the files of a case of the package to a folder.

    `NAME.toml` is the case, `NAME.xml` MJCF of bodies, pairs and friction, `NAME.sdf` the same in SDF if that has words
    for its friction, `NAME-forces.csv` the forces on its bodies
    as if they never turned, with the part of gravity of inclines, and `NAME-truth.csv` the truths.
    """
    write_text(
        folder / f"{case.name}.toml",
        (FOLDER / f"{case.name}.toml").read_text(encoding="utf-8"),
    )
    write_text(folder / f"{case.name}.xml", mjcf(case, case.steps[0]))
    if (text := sdf(case, case.steps[0])) is not None:
        write_text(folder / f"{case.name}.sdf", text)
    positions = np.array([body.position for body in case.moving])
    rotations = np.tile(np.eye(3), (len(positions), 1, 1))
    rows = [
        [f"{t:.9g}", body.name, *(f"{number:.9g}" for number in wrench)]
        for t in np.arange(round(case.time / SAMPLES) + 1) * SAMPLES
        for body, wrench in zip(
            case.moving, case.wrenches(float(t), positions, rotations), strict=True
        )
        if wrench.any()
    ]
    headings = [
        "time [s]",
        "body",
        "fx [N]",
        "fy [N]",
        "fz [N]",
        "tx [N m]",
        "ty [N m]",
        "tz [N m]",
    ]
    write_text(folder / f"{case.name}-forces.csv", _csv(headings, rows))
    truths = [
        [
            each.body,
            each.quantity,
            repr(each.value),
            each.error,
            each.allowed,
            QUANTITIES[each.quantity],
            each.threshold,
        ]
        for each in case.truths
    ]
    headings = [
        "body",
        "quantity",
        "value",
        "error of the value",
        "allowed",
        "unit",
        "threshold",
    ]
    write_text(folder / f"{case.name}-truth.csv", _csv(headings, truths))


def _csv(headings: list[str], rows: Iterable[Iterable[Any]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows([headings, *rows])
    return text.getvalue()
