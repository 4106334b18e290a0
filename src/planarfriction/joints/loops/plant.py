"""Simulated run of a joint and its servo, with the slopes of its motion by whatever its numbers depend on.

A joint that turns round within a step stops at a fraction of it, so that the motion is smooth in all numbers and its
slopes, carried along by the chain rule, are the slopes of what is computed.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import jit, kernel


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


VARIED = (
    *("inertia", "moment", "offset", "torque_gain", "back_emf"),
    *("mu_c", "mu_s", "v_s", "sigma_0", "sigma_1", "sigma_2", "load_motor", "load_external"),
)
"""Numbers of plant and friction by which a run has slopes, in the order of the rows of `seeds`."""

INERTIA, MOMENT, OFFSET, GAIN, EMF, MU_C, MU_S, V_S, SIGMA_0, SIGMA_1, SIGMA_2, MOTOR, EXTERNAL = range(len(VARIED))


@kernel
def servo_voltage(plant, error):
    """Return the voltage [V] of a servo at an error of the angle [rad], and its slope by the angle [V/rad]."""
    duty = plant.kp * error
    full = abs(duty) >= 1.0
    duty = min(max(duty, -1.0), 1.0)
    slope = 0.0 if full else -plant.kp * (plant.supply - 2.0 * plant.sag * abs(duty))
    return duty * (plant.supply - plant.sag * abs(duty)), slope


@kernel
def step_slopes(plant, k, decay, bend, dt, on, seeds, dk, dkeep, dlost):
    """Write the slopes of k, of what is kept of the speed, and of the back-EMF."""
    for p in range(len(dk)):
        dlost[p] = on * seeds[EMF, p]
        less = seeds[SIGMA_2, p] + dlost[p]
        dk[p] = k / plant.inertia * (seeds[INERTIA, p] * (1.0 + bend * decay) - bend * dt * less)
        dkeep[p] = dk[p] - less


@kernel
def bent_step(law, q, v, z, dt, k, keep, push, most, seeds, dq, dv, dz, dk, dkeep, half, d_most, d_push):
    """Return q, v and the bend z after a step of `k v' = keep v + push - friction` with bristles; move the slopes.

    Implicit: `z' = (z + dt v')/(1 + c |v'|)` with `c = dt sigma_0/most`; v' is the one root of a quadratic on the side
    to which all torque at rest points.
    """
    b = keep * v + push + law.sigma_1 / dt * z
    a, c = law.sigma_0 + law.sigma_1 / dt, dt * law.sigma_0 / most
    side = 1.0 if b > a * z else -1.0
    net = side * b
    middle = 0.5 * (k - net * c + a * dt)
    rest = net - a * side * z
    root = math.sqrt(middle * middle + k * c * rest)
    new = side * (rest / (middle + root) if middle > 0.0 else (root - middle) / (k * c))
    below = 1.0 / (1.0 + c * abs(new))
    bent = (z + dt * new) * below
    bent_v = (dt - bent * c * side) * below
    for p in range(len(dq)):
        damped = seeds[SIGMA_1, p] / dt
        d_a, d_c = seeds[SIGMA_0, p] + damped, seeds[SIGMA_0, p] - law.sigma_0 / most * d_most[p]
        d_b = dkeep[p] * v + keep * dv[p] + d_push[p] + damped * z + law.sigma_1 / dt * dz[p]
        d_bent = (dz[p] - bent * abs(new) * dt / most * d_c) * below
        dv[p] = (d_b - dk[p] * new - d_a * bent - a * d_bent) / (k + a * bent_v)
        dz[p] = d_bent + bent_v * dv[p]
        dq[p] = half[p] + 0.5 * dt * dv[p]
    return q + 0.5 * dt * (v + new), new, bent


@kernel
def rigid_step(q, v, dt, k, keep, push, most, dq, dv, dk, dkeep, half, d_most, d_push):
    """Return q and v after a step of `k v' = keep v + push - friction` with rigid friction, and move their slopes."""
    side = 1.0 if v > 0.0 or (v == 0.0 and push > 0.0) else -1.0
    free = (keep * v + push - side * most) / k
    if v != 0.0 and free * side >= 0.0:
        for p in range(len(dq)):
            d_free = dkeep[p] * v + keep * dv[p] + d_push[p] - side * d_most[p] - free * dk[p]
            dv[p] = d_free / k
            dq[p] = half[p] + 0.5 * dt * dv[p]
        return q + 0.5 * dt * (v + free), free
    # it turns round, or begins: a share of the step in the first direction
    share = v / (v - free) if v != 0.0 else 0.0
    left = min(max(push, -most), most)
    onward, slides = (push - left) / k, 1.0 if left != push else 0.0
    new = (1.0 - share) * onward
    for p in range(len(dq)):
        d_free = (dkeep[p] * v + keep * dv[p] + d_push[p] - side * d_most[p] - free * dk[p]) / k
        d_share = (share * d_free - (1.0 - share) * -dv[p]) / (v - free) if v != 0.0 else 0.0
        d_onward = slides * (d_push[p] - (1.0 if push > 0.0 else -1.0) * d_most[p] - onward * dk[p]) / k
        d_new = (1.0 - share) * d_onward - d_share * onward
        dq[p] += 0.5 * dt * (d_share * (v - new) + share * dv[p] + (1.0 - share) * d_new)
        dv[p] = d_new
    return q + 0.5 * dt * (share * v + (1.0 - share) * new), new


@jit
def run_plant(joint, plant, time, given, enabled, external, measured, again, step, seeds, lanes, motion, slopes):
    """Simulate a joint; write q and dq at each sample into `motion` `[T, 2]`, the slopes of q into `slopes` `[T, P]`.

    It begins at the first row of `measured` `[T, 2]`, q and dq, and once more every `again` samples. `given` is the
    goal [rad] of a servo, held until the next, or the voltage [V], linear between samples; steps are `step` [s] at
    most. `seeds` `[13, P]` are the slopes of `VARIED` by P parameters, `lanes` `[9, P]` is memory.

    A step solves `I dv/dt = driven + outside - viscous v - friction` at the level of its start, torques half-way.
    Viscous terms decay exactly (`formulas.relaxation`), dry friction is implicit.
    """
    law, moment = joint.law, plant.moment
    bristles, count_of_lanes = law.sigma_0 > 0.0, seeds.shape[1]
    dq, dv, dz, dk, dkeep, dlost, half, d_most, d_push = lanes
    q, v = measured[0, 0], measured[0, 1]
    z = 0.0
    dq[:], dv[:], dz[:] = 0.0, 0.0, 0.0
    motion[0, 0], motion[0, 1] = q, v
    slopes[0] = 0.0
    for i in range(1, len(time)):
        if i % again == 0:
            q, v = measured[i - 1, 0], measured[i - 1, 1]
            dq[:], dv[:] = 0.0, 0.0
        count = max(1, math.ceil((time[i] - time[i - 1]) / step - 1e-9))
        dt = (time[i] - time[i - 1]) / count
        on = enabled[i - 1]
        lost = on * plant.back_emf
        # k v' = keep v + push - friction
        viscous = law.sigma_2 + lost
        decay = viscous * dt / plant.inertia
        remaining, mean = formulas.relaxation(xp, decay)
        k = plant.inertia / (dt * mean)
        keep = k - viscous
        bend = formulas.relaxation_slope(xp, decay, remaining, mean) / mean
        step_slopes(plant, k, decay, bend, dt, on, seeds, dk, dkeep, dlost)
        for j in range(count):
            middle = q + 0.5 * dt * v
            share = (j + 0.5) / count
            sin, cos = math.sin(middle - plant.offset), math.cos(middle - plant.offset)
            outside = external[i - 1] + share * (external[i] - external[i - 1]) - moment * sin
            volts, volts_q = given[i - 1] + share * (given[i] - given[i - 1]), 0.0
            if plant.kp > 0.0:
                volts, volts_q = servo_voltage(plant, given[i - 1] - middle)
            driven = on * plant.torque_gain * volts
            through = driven - lost * v
            load = joint.load_motor * through - joint.load_external * outside
            loaded = 1.0 if load > 0.0 else -1.0
            speed, turns = abs(v), 1.0 if v >= 0.0 else -1.0
            effect = math.exp(-((speed / law.v_s) ** 2)) if law.mu_s > law.mu_c else 0.0
            most = law.mu_c + (law.mu_s - law.mu_c) * effect + loaded * load
            fall = 2.0 * (law.mu_s - law.mu_c) * effect * speed / law.v_s**2
            push = driven + outside
            for p in range(count_of_lanes):
                half[p] = dq[p] + 0.5 * dt * dv[p]
                d_outside = -seeds[MOMENT, p] * sin - moment * cos * (half[p] - seeds[OFFSET, p])
                d_driven = on * (seeds[GAIN, p] * volts + plant.torque_gain * volts_q * half[p])
                d_load = seeds[MOTOR, p] * through - seeds[EXTERNAL, p] * outside
                d_load += joint.load_motor * (d_driven - dlost[p] * v - lost * dv[p]) - joint.load_external * d_outside
                d_most[p] = seeds[MU_C, p] * (1.0 - effect) + seeds[MU_S, p] * effect + loaded * d_load
                d_most[p] += fall * (speed / law.v_s * seeds[V_S, p] - turns * dv[p])
                d_push[p] = d_driven + d_outside
            if bristles:
                q, v, z = bent_step(
                    law, q, v, z, dt, k, keep, push, most, seeds, dq, dv, dz, dk, dkeep, half, d_most, d_push
                )
            else:
                q, v = rigid_step(q, v, dt, k, keep, push, most, dq, dv, dk, dkeep, half, d_most, d_push)
        motion[i, 0], motion[i, 1] = q, v
        slopes[i] = dq
