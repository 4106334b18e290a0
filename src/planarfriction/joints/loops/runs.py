"""Friction of one joint, driven by a measured speed.

A joint is one cell under the load 1: coefficients are torques [N m], displacements are angles. Its level grows with the
torque through the gears, `g(v) + |b_m tau_m - b_e tau_e|`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import jit, kernel
from planarfriction.formulas import LawNumbers


class JointNumbers(NamedTuple):
    """Numbers of the friction of a joint as the loops read them."""

    law: LawNumbers
    """Law in N m and rad; `sigma_0` = 0 stands for rigid friction."""
    load_motor: Any
    """Growth of the level with the torque of the motor, b_m [-]."""
    load_external: Any
    """Growth of the level with the torque of all else, b_e [-]."""


@kernel
def level(joint, speed, tau_motor, tau_external):
    """Compute the friction in steady sliding [N m], `g(v) + |b_m tau_m - b_e tau_e|`."""
    load = joint.load_motor * tau_motor - joint.load_external * tau_external
    return formulas.stribeck(xp, xp.maximum(speed, -speed), joint.law) + xp.maximum(load, -load)


@kernel
def advance(joint, z, speed, dt, most):
    """Compute the deflection [rad] after dt at a held speed and level `most`, exactly."""
    decay = xp.maximum(speed, -speed) * joint.law.sigma_0 / most
    left, mean = formulas.relaxation(xp, decay * dt)
    return left * z + mean * dt * speed


@kernel
def friction(joint, z, speed, most):
    """Compute the torque that friction takes [N m], positive along the speed."""
    zdot = speed - xp.maximum(speed, -speed) * joint.law.sigma_0 / most * z
    return -formulas.traction(z, zdot, speed, joint.law)


@kernel
def joint_step(joint, z, speed, tau_motor, tau_external, dt):
    """Return the deflection [rad] after dt, and the torque that friction takes [N m]."""
    most = level(joint, speed, tau_motor, tau_external)
    new = advance(joint, z, speed, dt, most)
    return new, friction(joint, new, speed, most)


@jit
def run_measured(joint, time, speed, tau_motor, tau_external, taken):
    """Write the friction [N m] along a measured motion into `taken` `[T]`; bristles begin straight."""
    z = 0.0
    for i in range(len(time)):
        if i > 0:
            middle = 0.5 * (speed[i] + speed[i - 1])
            most = level(joint, middle, tau_motor[i], tau_external[i])
            z = advance(joint, z, middle, time[i] - time[i - 1], most)
        taken[i] = friction(joint, z, speed[i], level(joint, speed[i], tau_motor[i], tau_external[i]))
