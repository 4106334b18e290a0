"""Answers of friction to a state: the wrench of steady sliding, and the wrenches of limit surface and ellipsoid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planarfriction import geometry
from planarfriction_explorer.state import State


@dataclass(frozen=True)
class Answer:
    """The friction of a state; wrenches `(fx, fy, tau)` [N, N, N m] on the body, about the contact frame's origin."""

    friction: np.ndarray
    """Wrench of steady sliding with the law, `[3]`."""
    surface: np.ndarray
    """Wrench of the exact limit surface at `mu_c f_N`, `[3]`: no Stribeck, no viscous friction."""
    ellipsoid: np.ndarray
    """Wrench of the ellipsoid at `mu_c f_N`, `[3]`."""
    points: np.ndarray
    """The three as points `(fx, fy, tau/r)/(mu_c f_N)` about the centre of pressure, `[3, 3]` [-]."""
    force_error: float
    """Distance of the ellipsoid's point from the surface's [-]."""
    angle_error: float
    """Angle [deg] between the twist and the one that the ellipsoid gives for the wrench of the surface."""
    power: float
    """Dissipated power [W]."""


def answer(state: State) -> Answer:
    """Return the friction of a state. Raises `InvalidValueError` where nothing presses, or a single point alone."""
    surface, ellipsoid = state.drawing.surface, state.drawing.ellipsoid
    twist, mu_c = np.array(state.twist), state.law.numbers.mu_c
    scale = np.array([1.0, 1.0, surface.contact_radius])
    units = np.stack([steady_wrench(state) / mu_c, surface.wrench(twist), ellipsoid.wrench(twist)])
    points = geometry.wrench_at(units, surface.centre_of_pressure) / scale
    friction, of_surface, of_ellipsoid = mu_c * state.normal_force * units  # last: 0 under a load near 5e-324 N
    angle = 0.0
    if units[1].any():
        both = np.stack([twist, ellipsoid.twist(units[1])])
        here, there = geometry.twist_at(both, surface.centre_of_pressure) * scale
        angle = float(np.degrees(np.arctan2(np.linalg.norm(np.cross(here, there)), here @ there)))
    error = float(np.linalg.norm(points[2] - points[1]))
    return Answer(friction, of_surface, of_ellipsoid, points, error, angle, float(-friction @ twist))


def steady_wrench(state: State) -> np.ndarray:
    """Return the wrench `[3]` of steady sliding per unit load, `-sum(w_i F(|v_i|) B_i' v_i/|v_i|)` of the law's F."""
    patch = state.drawing.patch
    x, y = patch.positions.T
    vx, vy, _ = geometry.twist_at(np.array(state.twist), patch.positions).T
    speed = np.hypot(vx, vy)
    friction, speed = -patch.weights() * state.law.steady_friction(speed), np.where(speed > 0.0, speed, 1.0)
    fx, fy = friction * (vx / speed), friction * (vy / speed)
    return np.array([fx.sum(), fy.sum(), (x * fy - y * fx).sum()])
