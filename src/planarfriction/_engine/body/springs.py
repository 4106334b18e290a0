"""Springs on a planar body: linear in stretch and speed, between points of the body and anchors.

With `r = R(theta) at`, the point `p = x + r` moves at `v = u + omega J r`, `J = (0, -1; 1, 0)`. A spring exerts

    F = k (a - p) + c (a' - v),     tau = r x F + k_theta (angle - theta) + c_theta (angle' - omega)

on the body at its centre of mass, where `a` and `angle` are the pose of the anchor, linear in time on a piece.
"""

from __future__ import annotations

import math
from typing import Any

from planarfriction._engine.codegen.vectors import Vector, plus
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles, at

STIFFNESS = 0
"""Column of `Motion.spring`: stiffness."""

DAMPING = 1
"""Column of `Motion.spring`: damping."""

TORSION = 2
"""Column of `Motion.spring`: torsional stiffness."""

TORSION_DAMPING = 3
"""Column of `Motion.spring`: torsional damping."""

AT_X = 4
"""Column of `Motion.spring`: x of the place on the body."""

AT_Y = 5
"""Column of `Motion.spring`: y of the place on the body."""


@kernel
def _spring(system: Any, piece: int, i: int) -> tuple[Doubles, Doubles]:
    """Return the constants of spring i, and its anchor on a piece."""
    return at(system.motion.spring, 6 * i), at(
        system.motion.anchor, 6 * (piece * system.springs + i)
    )


@kernel
def _arm(spring: Doubles, theta: float) -> Vector:
    """Return the lever arm of the point of a spring, world axes."""
    cos = math.cos(theta)
    sin = math.sin(theta)
    return cos * spring[AT_X] - sin * spring[AT_Y], sin * spring[AT_X] + cos * spring[
        AT_Y
    ]


@kernel
def _force(
    spring: Doubles, anchor: Doubles, since: float, body: Doubles, rx: float, ry: float
) -> Vector:
    """Return the force of a spring on the body at `body` (velocity and pose)."""
    x = anchor[0] + since * anchor[3]
    y = anchor[1] + since * anchor[4]
    fx = spring[STIFFNESS] * (x - body[3] - rx) + spring[DAMPING] * (
        anchor[3] - body[0] + body[2] * ry
    )
    fy = spring[STIFFNESS] * (y - body[4] - ry) + spring[DAMPING] * (
        anchor[4] - body[1] - body[2] * rx
    )
    return fx, fy


@kernel
def spring_wrench(system: Any, piece: int, since: float, body: Doubles) -> Vector:
    """Return the wrench of all springs on the body at its centre of mass."""
    total = (0.0, 0.0, 0.0)
    for i in range(system.springs):
        spring, anchor = _spring(system, piece, i)
        rx, ry = _arm(spring, body[5])
        fx, fy = _force(spring, anchor, since, body, rx, ry)
        twist = spring[TORSION] * (anchor[2] + since * anchor[5] - body[5])
        twist += spring[TORSION_DAMPING] * (anchor[5] - body[2])
        total = plus(total, 1.0, (fx, fy, rx * fy - ry * fx + twist))
    return total


@kernel
def spring_drift(system: Any, piece: int, theta: float) -> Vector:
    """Return the change of `spring_wrench` with the time alone."""
    total = (0.0, 0.0, 0.0)
    for i in range(system.springs):
        spring, anchor = _spring(system, piece, i)
        rx, ry = _arm(spring, theta)
        fx = spring[STIFFNESS] * anchor[3]
        fy = spring[STIFFNESS] * anchor[4]
        total = plus(
            total, 1.0, (fx, fy, rx * fy - ry * fx + spring[TORSION] * anchor[5])
        )
    return total


@kernel
def add_spring_slopes(
    system: Any,
    piece: int,
    since: float,
    body: Doubles,
    per_shift: float,
    to_pose: Doubles,
    matrix: Doubles,
) -> None:
    """Add the accelerations by pose [3, 3], times `per_shift`, to `to_pose`, and with those by velocity to `matrix`."""
    for i in range(system.springs):
        spring, anchor = _spring(system, piece, i)
        k = spring[STIFFNESS]
        c = spring[DAMPING]
        (rx, ry) = _arm(spring, body[5])
        spin = body[2]
        fx, fy = _force(spring, anchor, since, body, rx, ry)
        # columns: changes of the force and of the torque by a unit of x, y, theta; the arm turns with theta
        gx = k * ry + c * spin * rx
        gy = c * spin * ry - k * rx
        by_pose = (
            (-k, 0.0, k * ry),
            (0.0, -k, -k * rx),
            (gx, gy, rx * gy - ry * gx - rx * fx - ry * fy - spring[TORSION]),
        )
        by_velocity = (
            (-c, 0.0, c * ry),
            (0.0, -c, -c * rx),
            (c * ry, -c * rx, -c * (rx * rx + ry * ry) - spring[TORSION_DAMPING]),
        )
        for j in range(3):
            for m in range(3):
                weight = system.motion.inverse_mass[m]
                to_pose[3 * m + j] += weight * per_shift * by_pose[j][m]
                matrix[3 * m + j] += weight * (
                    by_velocity[j][m] + per_shift * by_pose[j][m]
                )
