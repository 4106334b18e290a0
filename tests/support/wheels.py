"""Bodies in MuJoCo whose motion has a closed form wherever their site lies: wheels, rollers, casters, cars, boxes."""

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


STRIP = pf.ReducedModel(pf.ContactPatch.rectangle(0.0005, cells=3), LAW)
"""Patch under the thin wheel of a caster."""

NARROW = pf.ReducedModel(pf.ContactPatch.rectangle(0.004, 0.0005, cells=5), LAW)
"""Patch under a wheel of a car."""


def roller(angle: float, *, y: float = 0.0) -> str:
    """Return a roller with its axis at an angle [degrees] to y, on a carrier of its own mass that does not turn."""
    i = 0.5 * MASS * RADIUS**2
    return f"""<body pos="0 {y} {RADIUS - 1e-5}" euler="0 0 {angle}"><joint type="slide" axis="1 0 0"/>
    <joint type="slide" axis="0 1 0"/><joint type="slide" axis="0 0 1"/>
    <inertial pos="0 0 0" mass="{MASS}" diaginertia="1 1 1"/><body euler="90 0 0"><joint axis="0 0 1"/>
    <inertial pos="0 0 0" mass="{MASS}" diaginertia="{i} {i} {i}"/>
    <geom name="roller" type="cylinder" size="{RADIUS} {HALF}" {ALONE}/>
    <site name="roller" xyaxes="0 0 1 1 0 0"/></body></body>"""


TRAIL = 0.04
"""Distance of a caster's wheel from its pivot [m]."""


def caster(start: float, *, y: float = 0.0) -> str:
    """Return a caster that stands at an angle [degrees] from where it is drawn to, along x, by a heavy sphere."""
    return f"""<body pos="0 {y} 0"><joint type="slide" axis="1 0 0"/>
    <geom type="sphere" size="0.01" mass="1000" {ALONE}/>
    <body euler="0 0 {start}"><joint type="slide" axis="0 0 1"/><joint name="swivel" axis="0 0 1"/>
    <geom type="sphere" size="0.01" pos="0 0 0.06" mass="0.5" {ALONE}/>
    <body pos="{-TRAIL} 0 {0.5 * RADIUS}" euler="90 0 0"><joint axis="0 0 1"/>
    <geom name="caster" type="cylinder" size="{0.5 * RADIUS} 0.002" mass="0.01" {ALONE}/>
    <site name="caster" xyaxes="0 0 1 1 0 0"/></body></body></body>"""


def drawn(start: float, speed: float) -> tuple[float, float, float, float]:
    """Return velocities of a caster that is drawn without slip: its wheel rolls, and the arm turns about the pivot."""
    angle = math.radians(start)
    return (
        speed,
        0.0,
        -speed / TRAIL * math.sin(angle),
        -speed * math.cos(angle) / (0.5 * RADIUS),
    )


CAR = {"right": NARROW, "left": NARROW, "behind": POINT}
"""Patches of a car."""

MOTORS = '<actuator><velocity joint="right" kv="1"/><velocity joint="left" kv="1"/></actuator>'
"""Motors of a car, which take the speeds of its wheels [rad/s]."""


def car(*, y: float = 0.0) -> str:
    """Return a car on two driven wheels and a sphere in a socket behind them."""
    wheels = "".join(
        f"""<body pos="0 {side} {RADIUS}" euler="90 0 0"><joint name="{name}" axis="0 0 -1"/>
        <geom name="{name}" type="cylinder" size="{RADIUS} 0.01" mass="0.2" {ALONE}/>
        <site name="{name}" xyaxes="0 0 1 1 0 0"/></body>"""
        for name, side in (("right", -0.1), ("left", 0.1))
    )
    return f"""<body name="car" pos="0 {y} 0"><freejoint/>
    <geom type="box" size="0.1 0.08 0.02" pos="-0.04 0 0.05" mass="1" {ALONE}/>{wheels}
    <body pos="-0.15 0 0.02"><joint type="ball"/><geom name="behind" type="sphere" size="0.02" mass="0.05" {ALONE}/>
    <site name="behind"/></body></body>"""


def on_the_floor(*bodies: str, options: str = "", more: str = "") -> str:
    """Return a model of bodies on a floor, and more beside them."""
    mesh = (
        f'<asset><mesh name="wheel" vertex="{MESH}"/></asset>'
        if "mesh=" in "".join(bodies)
        else ""
    )
    return f"""<mujoco><option timestep="{DT}" {options}/>{mesh}
    <worldbody><geom name="floor" type="plane" size="9 9 .1"/>{"".join(bodies)}</worldbody>{more}</mujoco>"""
