"""MJCF of a case: what MuJoCo runs, and what `export` writes for other engines."""

from __future__ import annotations

from collections.abc import Iterable

from planarfriction_studies.referee.case import Body, Case, Contact, Shape


def mjcf(case: Case, dt: float, options: str = "", contact: str = "", integrator: str = "Euler") -> str:
    """Return MJCF with free bodies, pads on slides, and a pair for each contact.

    `options` and `contact` are attributes of its `option` and of all pairs. Sites `patch 0`, ... are where patches are.
    Forces, and gravity on inclines, are not in it.
    """
    bodies = "\n".join(_body(case, body) for body in case.bodies)
    pairs = "\n".join(f"  <pair {_pair(each)} {contact}/>" for each in case.contacts)
    return f"""<mujoco model="{case.name}">
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
        joint = "<freejoint/>" if body.joint == "free" else '<joint type="slide" axis="0 0 1"/>'
        place = f'pos="{_numbers(body.centre_of_mass)}" mass="{body.mass:.12g}"'
        parts = [joint, f'<inertial {place} diaginertia="{_numbers(body.moments)}"/>', *parts]
    inner = "\n".join(f"    {part}" for part in parts)
    return f'  <body name="{body.name}" pos="{_numbers(body.position)}">\n{inner}\n  </body>'


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
    return f'<geom name="{shape.name}" type="{shape.kind}" size="{_numbers(sizes[shape.kind]())}" {place}/>'


def _pair(contact: Contact) -> str:
    """Return names and friction of a pair: MuJoCo's first tangent is y and its second one x where normals are z."""
    along, across = contact.mu
    first, second = contact.pair
    return f'geom1="{first}" geom2="{second}" friction="{across:.12g} {along:.12g} 0.005 0.0001 0.0001"'
