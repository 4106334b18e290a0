"""Wheels, and boxes that slide, in MuJoCo: bodies whose motion has a closed form wherever their site lies."""

from __future__ import annotations

import math

import numpy as np

import planarfriction as pf

RADIUS, HALF, MASS, DT = 0.05, 0.02, 0.5, 2e-3
"""Radius of a wheel and half of its width [m], mass [kg], step [s]."""

LAW = pf.LuGre(
    mu_c=0.4, mu_s=0.4, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9
)
TREAD = pf.ReducedModel(pf.ContactPatch.rectangle(2.0 * HALF, 0.0005, cells=9), LAW)
"""Patch under a wheel, x along the axle."""
POINT = pf.ReducedModel(pf.ContactPatch.disc(radius=0.002, cells=5), LAW)

_ANGLES = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
_RIM = RADIUS * np.array([np.cos(_ANGLES), np.sin(_ANGLES)]).T
MESH = " ".join(f"{x:.6f} {y:.6f} {z}" for z in (-HALF, HALF) for x, y in _RIM)
"""Vertices of a wheel of 720 sides: rolling from side to side it loses 1 % of its speed in 0.1 s."""

SHAPES = {
    "sphere": (f'type="sphere" size="{RADIUS}"', POINT, 0.4),
    "cylinder": (f'type="cylinder" size="{RADIUS} {HALF}"', TREAD, 0.5),
    "capsule": (f'type="capsule" size="{RADIUS} {HALF}"', TREAD, 0.5),
    "ellipsoid": (f'type="ellipsoid" size="{RADIUS} {RADIUS} {HALF}"', POINT, 0.5),
    "mesh": ('type="mesh" mesh="wheel"', TREAD, 0.5),
}
"""Geom with its axle along z, patch, and moment of inertia about the axle in m r^2."""

ALONE = 'contype="0" conaffinity="0"'
"""Geoms that touch nothing but what they have a pair with."""

SITES = {
    "centre": (0.0, 0.0),
    "hair": (1e-6, 0.0),
    "tread": (-0.5, math.sqrt(0.75)),
    "contact": (0.0, -1.0),
}
"""Sites in radii from the axle: on it, beside it, on the tread at 120 degrees from the floor, where it touches."""


def wheel(shape: str, site: str, *, name: str = "wheel", y: float = 0.0) -> str:
    """Return the body of a wheel with its axle along y and the x axis of its site along the axle."""
    share = SHAPES[shape][2]
    at_x, at_y = SITES[site]
    i = share * MASS * RADIUS**2
    return f"""<body name="{name}" pos="0 {y} {RADIUS - 1e-5}" euler="90 0 0"><freejoint/>
    <inertial pos="0 0 0" mass="{MASS}" diaginertia="{i} {i} {i}"/><geom name="{name}" {SHAPES[shape][0]} {ALONE}/>
    <site name="{name}" pos="{at_x * RADIUS} {at_y * RADIUS} 0" xyaxes="0 0 1 1 0 0"/></body>"""


def box(site: str = "", *, name: str = "box", y: float = 0.0) -> str:
    """Return a box of 40 x 40 x 200 mm."""
    return f"""<body name="{name}" pos="0 {y} 0.0999"><freejoint/>
    <geom name="{name}" type="box" size="0.02 0.02 0.1" mass="1" {ALONE}/><site name="{name}" {site}/></body>"""


def face(mu: float) -> pf.ReducedModel:
    """Return a patch for the end of this box."""
    law = pf.LuGre(
        mu_c=mu, mu_s=mu, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9
    )
    return pf.ReducedModel(pf.ContactPatch.rectangle(2.0 * HALF, cells=9), law)


def on_the_floor(*bodies: str, options: str = "") -> str:
    """Return a model of bodies on a floor."""
    mesh = (
        f'<asset><mesh name="wheel" vertex="{MESH}"/></asset>'
        if "mesh=" in "".join(bodies)
        else ""
    )
    return f"""<mujoco><option timestep="{DT}" {options}/>{mesh}
    <worldbody><geom name="floor" type="plane" size="9 9 .1"/>{"".join(bodies)}</worldbody></mujoco>"""
