"""Friction of one joint, driven by a measured speed or inside a simulated run of one degree of freedom.

A joint is one cell under the load 1: coefficients are torques [N m], displacements are angles. Its level grows with the
torque through the gears, `g(v) + |b_m tau_m - b_e tau_e|`.
"""

from __future__ import annotations

import math
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


class PlantNumbers(NamedTuple):
    """Numbers of a plant and its motor as the loops read them."""

    inertia: Any
    """Moment of inertia about the joint [kg m^2]."""
    moment: Any
    """Largest torque of gravity [N m]."""
    offset: Any
    """Angle at which the plant hangs straight down [rad]."""
    torque_gain: Any
    """Torque of the motor per volt, kt/R [N m/V]."""
    back_emf: Any
    """Torque lost per speed while the drive is on, kt^2/R [N m s/rad]."""
    kp: Any
    """Duty per angle of a servo [1/rad]; 0 for a run that is driven by the voltage."""
    supply: Any
    """Voltage at no duty [V]."""
    sag: Any
    """Voltage that is lost at full duty [V]."""


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


@kernel
def speed_after(joint, z, speed, push, most, inertia, lost, dt):
    """Compute the speed after a step of `I dv/dt = push - lost v - friction` at a known level `most`.

    Viscous terms decay exactly, as in `formulas.relaxation`; dry friction is implicit.

    Rigid: `k v = b - clip(b, -most, most)`. Bristles, `z' = (z + dt v)/(1 + c |v|)` with `c = dt sigma_0/most`: the one
    root of a quadratic on the side to which all torque at rest points.
    """
    law = joint.law
    viscous = law.sigma_2 + lost
    _, mean = formulas.relaxation(xp, viscous * dt / inertia)
    k = inertia / (dt * mean)
    b = (k - viscous) * speed + push
    if law.sigma_0 == 0.0:
        return (b - xp.minimum(xp.maximum(b, -most), most)) / k
    b += law.sigma_1 / dt * z
    a = law.sigma_0 + law.sigma_1 / dt
    side = 1.0 if b > a * z else -1.0
    bent, net, c = side * z, side * b, dt * law.sigma_0 / most
    half = 0.5 * (k - net * c + a * dt)
    rest = net - a * bent
    root = math.sqrt(half * half + k * c * rest)
    return side * (rest / (half + root) if half > 0.0 else (root - half) / (k * c))


@jit
def run_plant(joint, plant, time, given, enabled, external, measured, again, step, motion):
    """Simulate a joint and write q and dq at each sample into `motion` `[T, 2]`.

    It begins at the first row of `measured` `[T, 2]`, q and dq, and once more every `again` samples. `given` is the
    goal [rad] of a servo, held until the next, or the voltage [V], linear between samples; steps are `step` [s] at
    most.
    """
    q, v = measured[0, 0], measured[0, 1]
    z = 0.0
    motion[0, 0], motion[0, 1] = q, v
    for i in range(1, len(time)):
        if i % again == 0:
            q, v = measured[i - 1, 0], measured[i - 1, 1]
        count = max(1, math.ceil((time[i] - time[i - 1]) / step - 1e-9))
        dt = (time[i] - time[i - 1]) / count
        on = enabled[i - 1]
        for j in range(count):
            q += 0.5 * dt * v  # torques half-way: of second order where nothing sticks
            share = (j + 0.5) / count
            outside = external[i - 1] + share * (external[i] - external[i - 1])
            outside -= plant.moment * math.sin(q - plant.offset)
            volts = given[i - 1] + share * (given[i] - given[i - 1])
            if plant.kp > 0.0:
                duty = min(max(plant.kp * (given[i - 1] - q), -1.0), 1.0)
                volts = duty * (plant.supply - plant.sag * abs(duty))
            driven = on * plant.torque_gain * volts
            lost = on * plant.back_emf
            most = level(joint, v, driven - lost * v, outside)
            v = speed_after(joint, z, v, driven + outside, most, plant.inertia, lost, dt)
            if joint.law.sigma_0 > 0.0:
                z = (z + dt * v) / (1.0 + dt * abs(v) * joint.law.sigma_0 / most)
            q += 0.5 * dt * v
        motion[i, 0], motion[i, 1] = q, v
