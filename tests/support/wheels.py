"""Wheels, and boxes that slide, in MuJoCo: bodies whose motion has a closed form wherever their site lies."""

from __future__ import annotations

import math

import numpy as np

import planarfriction as pf

RADIUS, HALF, MASS, DT = 0.05, 0.02, 0.5, 2e-3
"""Radius of a wheel and half of its width [m], mass [kg], step [s]."""

LAW = pf.LuGre(mu_c=0.4, mu_s=0.4, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9)
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

SITES = {"centre": (0.0, 0.0), "hair": (1e-6, 0.0), "tread": (-0.5, math.sqrt(0.75)), "contact": (0.0, -1.0)}
"""Sites in radii from the axle: on it, beside it, on the tread at 120 degrees from the floor, where it touches."""


def wheel(shape: str, site: str, *, options: str = "") -> str:
    """Return a model of a wheel on a floor with its axle along y and its site's x axis along the axle."""
    geom, _, share = SHAPES[shape]
    x, y = SITES[site]
    i = share * MASS * RADIUS**2
    return f"""<mujoco><option timestep="{DT}" {options}/><asset><mesh name="wheel" vertex="{MESH}"/></asset><worldbody>
    <geom name="floor" type="plane" size="9 9 .1"/><body pos="0 0 {RADIUS - 1e-5}" euler="90 0 0"><freejoint/>
    <inertial pos="0 0 0" mass="{MASS}" diaginertia="{i} {i} {i}"/><geom name="wheel" {geom}/>
    <site name="wheel" pos="{x * RADIUS} {y * RADIUS} 0" xyaxes="0 0 1 1 0 0"/></body></worldbody></mujoco>"""


def box(site: float, mu: float, *, options: str = "") -> tuple[str, pf.ReducedModel]:
    """Return a model of a box of 40 x 40 x 200 mm with a site `site` [m] above its middle, and a patch for it."""
    text = f"""<mujoco><option timestep="{DT}" {options}/><worldbody>
    <geom name="floor" type="plane" size="9 9 .1"/><body pos="0 0 0.0999"><freejoint/>
    <geom name="box" type="box" size="0.02 0.02 0.1" mass="1"/><site name="box" pos="0 0 {site}"/></body>
    </worldbody></mujoco>"""
    law = pf.LuGre(mu_c=mu, mu_s=mu, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9)
    return text, pf.ReducedModel(pf.ContactPatch.rectangle(0.04, cells=9), law)
