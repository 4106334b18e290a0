"""Friction of one joint, driven by a measured speed, and its simulated run with a servo.

A joint is one cell under the load 1: coefficients are torques [N m], displacements are angles. Its level grows with the
torque through the gears, `g(v) + |b_m tau_m - b_e tau_e|`. A joint that turns round within a step stops at a fraction
of it, so that the motion is smooth in all numbers.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from planarfriction import formulas
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import jit, kernel
from planarfriction.formulas import LawNumbers


class JointNumbers(NamedTuple):
    """Numbers of the friction of a joint as the loops read them."""

    law: LawNumbers
    """Law in N m and rad; `sigma_0` = 0 stands for rigid friction."""
    load_motor: Any
    """Growth of the level with the torque of the motor, b_m [-]."""
    load_external: Any
    """Growth of the level with the torque of all else, b_e [-]."""
    asymmetry: Any = 0.0
    """Half the excess of the level at positive speeds [N m]."""
    viscous_asymmetry: Any = 0.0
    """Half the excess of viscous friction at positive speeds [N m s/rad]."""


@kernel
def load_level(joint, tau_motor, tau_external):
    """Compute the growth of the level with the torque through the gears [N m], `|b_m tau_m - b_e tau_e|`."""
    load = joint.load_motor * tau_motor - joint.load_external * tau_external
    return xp.maximum(load, -load)


@kernel
def level(joint, speed, tau_motor, tau_external):
    """Compute the friction in steady sliding [N m], `g(v) + |b_m tau_m - b_e tau_e|`."""
    uneven = xp.where(speed < 0.0, -joint.asymmetry, joint.asymmetry)
    sliding = formulas.stribeck(xp, xp.maximum(speed, -speed), joint.law) + uneven
    return sliding + load_level(joint, tau_motor, tau_external)


@kernel
def viscous(joint, speed):
    """Compute the viscous torque [N m]."""
    return joint.law.sigma_2 * speed + joint.viscous_asymmetry * xp.maximum(
        speed, -speed
    )


@kernel
def within(torque, side, joint, load):
    """Return the torque of the bristles brought back onto the static level of its side [N m]."""
    most = (
        joint.law.mu_s + load + xp.where(side < 0.0, -joint.asymmetry, joint.asymmetry)
    )
    return xp.minimum(xp.maximum(torque, -most), most)


@kernel
def advance(joint, z, speed, dt, most):
    """Compute the deflection [rad] after dt at a held speed and level `most`, exactly."""
    decay = xp.maximum(speed, -speed) * joint.law.sigma_0 / most
    left, mean = formulas.relaxation(xp, decay * dt)
    return left * z + mean * dt * speed


@kernel
def friction(joint, z, speed, tau_motor, tau_external):
    """Compute the torque that friction takes [N m], positive along the speed; within the static level and viscous part.

    The damping of bristles that bend back fast would exceed the level.
    """
    law = joint.law
    most = level(joint, speed, tau_motor, tau_external)
    zdot = speed - xp.maximum(speed, -speed) * law.sigma_0 / most * z
    bristles = law.sigma_0 * z + law.sigma_1 * zdot
    return within(
        bristles, bristles, joint, load_level(joint, tau_motor, tau_external)
    ) + viscous(joint, speed)


@kernel
def joint_step(joint, z, speed, tau_motor, tau_external, dt):
    """Return the deflection [rad] after dt, and the torque that friction takes [N m].

    Bristles that a falling level has left beyond their limit come back onto it first, as those of a patch do.
    """
    stiffness = joint.law.sigma_0
    start = (
        within(stiffness * z, z, joint, load_level(joint, tau_motor, tau_external))
        / stiffness
    )
    new = advance(joint, start, speed, dt, level(joint, speed, tau_motor, tau_external))
    return new, friction(joint, new, speed, tau_motor, tau_external)


@jit
def run_measured(joint, time, speed, tau_motor, tau_external, taken):
    """Write the friction [N m] along a measured motion into `taken` `[T]`; bristles begin straight."""
    z = 0.0
    for i in range(len(time)):
        if i > 0:
            middle = 0.5 * (speed[i] + speed[i - 1])
            z = joint_step(
                joint, z, middle, tau_motor[i], tau_external[i], time[i] - time[i - 1]
            )[0]
        taken[i] = friction(joint, z, speed[i], tau_motor[i], tau_external[i])


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
def bent_step(law, v, z, dt, k, pushed, most):
    """Return the speed and the bend after a step of `k v' = pushed - friction` with bristles, and the mean speed.

    Implicit: `z' = (z + dt v')/(1 + c |v'|)` with `c = dt sigma_0/most`; v' is the one root of a quadratic on the side
    to which all torque at rest points.
    """
    b = pushed + law.sigma_1 / dt * z
    a = law.sigma_0 + law.sigma_1 / dt
    c = dt * law.sigma_0 / most
    side = 1.0 if b > a * z else -1.0
    net = side * b
    middle = 0.5 * (k - net * c + a * dt)
    rest = net - a * side * z
    root = math.sqrt(middle * middle + k * c * rest)
    new = side * (rest / (middle + root) if middle > 0.0 else (root - middle) / (k * c))
    return new, (z + dt * new) / (1.0 + c * abs(new)), 0.5 * (v + new)


@kernel
def rigid_step(v, k, pushed, push, most):
    """Return the speed after a step of `k v' = pushed - friction` with rigid friction, and the mean speed."""
    side = 1.0 if v > 0.0 or (v == 0.0 and push > 0.0) else -1.0
    free = (pushed - side * most) / k
    if v != 0.0 and free * side >= 0.0:
        return free, 0.5 * (v + free)
    # it turns round, or begins: a share of the step in the first direction
    share = v / (v - free) if v != 0.0 else 0.0
    new = (1.0 - share) * (push - min(max(push, -most), most)) / k
    return new, 0.5 * (share * v + (1.0 - share) * new)


@jit
def run_plant(
    joint, plant, time, given, enabled, external, measured, again, step, motion
):
    """Simulate a joint; write q and dq at each sample into `motion` `[T, 2]`.

    It begins at the first row of `measured` `[T, 2]`, q and dq, and once more every `again` samples. `given` is the
    goal [rad] of a servo, held until the next, or the voltage [V], linear between samples; steps are `step` [s] at
    most.

    A step solves `I dv/dt = driven + outside - damping v - friction` at the level of its start, torques half-way.
    Viscous terms decay exactly (`formulas.relaxation`), dry friction is implicit.
    """
    law = joint.law
    q = measured[0, 0]
    v = measured[0, 1]
    z = 0.0
    motion[0, 0] = q
    motion[0, 1] = v
    for i in range(1, len(time)):
        if i % again == 0:
            q = measured[i - 1, 0]
            v = measured[i - 1, 1]
        count = max(1, math.ceil((time[i] - time[i - 1]) / step - 1e-9))
        dt = (time[i] - time[i - 1]) / count
        on = enabled[i - 1]
        # k v' = (k - damping) v + push - friction
        damping = law.sigma_2 + on * plant.back_emf
        k = plant.inertia / (
            dt * formulas.relaxation(xp, damping * dt / plant.inertia)[1]
        )
        for j in range(count):
            middle = q + 0.5 * dt * v
            share = (j + 0.5) / count
            outside = external[i - 1] + share * (external[i] - external[i - 1])
            outside -= plant.moment * math.sin(middle - plant.offset)
            volts = given[i - 1] + share * (given[i] - given[i - 1])
            if plant.kp > 0.0:
                duty = min(max(plant.kp * (given[i - 1] - middle), -1.0), 1.0)
                volts = duty * (plant.supply - plant.sag * abs(duty))
            driven = on * plant.torque_gain * volts
            push = driven + outside - joint.viscous_asymmetry * abs(v)
            pushed = (k - damping) * v + push
            most = level(joint, v, driven - on * plant.back_emf * v, outside)
            if law.sigma_0 > 0.0:
                v, z, mean = bent_step(law, v, z, dt, k, pushed, most)
            else:
                v, mean = rigid_step(v, k, pushed, push, most)
            q += dt * mean
        motion[i, 0] = q
        motion[i, 1] = v
