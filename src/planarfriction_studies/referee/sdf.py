"""SDF of a case, for engines that read it: bodies, slides, and Coulomb's coefficients."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from planarfriction_studies.referee.case import Body, Case, Shape

GRIPS = 1e3
"""Coefficient of fixed bodies: of two coefficients, readers of SDF take the smaller one [-]."""


def sdf(case: Case, dt: float) -> str | None:
    """Return SDF of a case with a time step [s]; None if a body has several coefficients, or friction has Stribeck's.

    Forces, velocities, gravity on inclines, and the pairs of shapes that touch are not in it.
    """
    mus = {name: {each.mu for each in case.contacts if name in each.pair} for name in case.shapes}
    moving = [name for name, (body, _) in case.shapes.items() if body.joint != "fixed"]
    if any(len(mus[name]) > 1 for name in moving) or any(each.mu_s is not None for each in case.contacts):
        return None
    grips = {name: (GRIPS, GRIPS) if name not in moving else next(iter(mus[name]), (0.0, 0.0)) for name in case.shapes}
    models = "\n".join(_model(body, grips) for body in case.bodies)
    return f"""<?xml version="1.0"?>
<sdf version="1.9"><world name="{case.name}">
<gravity>{_numbers(case.gravity)}</gravity>
<physics name="steps" type="ode"><max_step_size>{dt}</max_step_size></physics>
{models}
</world></sdf>
"""


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:.12g}" for value in values)


def _model(body: Body, grips: Mapping[str, Sequence[float]]) -> str:
    shapes = "\n".join(_collision(shape, *grips[shape.name]) for shape in body.shapes)
    fixed, slides = body.joint == "fixed", body.joint == "slide"
    inertial = "" if fixed else _inertial(body)
    joint = """  <joint name="slide" type="prismatic"><parent>world</parent><child>link</child>
  <axis><xyz>0 0 1</xyz></axis></joint>\n"""
    return f"""<model name="{body.name}"><static>{str(fixed).lower()}</static>
  <pose>{_numbers(body.position)} 0 0 0</pose>
  <link name="link">
{inertial}{shapes}
  </link>
{joint if slides else ""}</model>"""


def _inertial(body: Body) -> str:
    moments = "".join(f"<i{a}{a}>{moment:.12g}</i{a}{a}>" for a, moment in zip("xyz", body.moments, strict=True))
    return f"""  <inertial><pose>{_numbers(body.centre_of_mass)} 0 0 0</pose><mass>{body.mass:.12g}</mass>
  <inertia>{moments}<ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>
"""


def _collision(shape: Shape, along: float, across: float) -> str:
    """Return a shape; the axis of a round one is turned from z to x about y."""
    inner = {
        "plane": "<normal>0 0 1</normal><size>18 18</size>",
        "box": f"<size>{_numbers(shape.size)}</size>",
        "sphere": f"<radius>{_numbers(shape.size)}</radius>",
    }.get(shape.kind) or f"<radius>{shape.size[0]:.12g}</radius><length>{shape.size[1]:.12g}</length>"
    turn = "0 1.5707963267948966 0" if shape.axis[0] else "0 0 0"
    return f"""  <collision name="{shape.name}"><pose>{_numbers(shape.position)} {turn}</pose>
  <geometry><{shape.kind}>{inner}</{shape.kind}></geometry><surface><friction><ode><mu>{along:.12g}</mu>
  <mu2>{across:.12g}</mu2><fdir1>1 0 0</fdir1></ode></friction></surface></collision>"""
