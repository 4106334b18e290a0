"""Joints with known friction whose torque is measured, moved by a loop of their own: a judge of fits to torques.

A PD controller follows a reference. Bristles relax exactly at a held speed, the body moves by half-explicit Euler steps
of 20 us, and with backlash the motor and the link are two bodies with a stiff spring behind the gap. None of it calls
the library.
"""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import numba
import numpy as np

STEP = 2e-5
"""Step of the simulation [s]."""

SECONDS = 8.0
"""Length of a log [s]."""

SETS = tuple(itertools.product((False, True), repeat=5))
"""All sets of the terms of `NAMES`."""

NAMES = ("stribeck", "load", "bristles", "gravity", "asymmetry")
"""Terms of a joint."""


class Joint(NamedTuple):
    """A joint with its logs."""

    terms: frozenset[str]
    """Terms that it has beside Coulomb and viscous friction."""
    truth: dict[str, float]
    """True numbers by the names of the fit, as a torque with its wrong constant shows them."""
    about: dict[str, Any]
    """Sensors, delay, backlash."""
    logs: list[tuple[np.ndarray, np.ndarray, np.ndarray]]
    """Times [s], angles [rad] and torques [N m]."""


class Numbers(NamedTuple):
    """Numbers of a joint, in rad, N m and s."""

    inertia: float = 0.05
    gravity: float = 0.0
    hangs: float = 0.0
    mu_c: float = 0.6
    rise: float = 0.0
    v_s: float = 1.0
    sigma_2: float = 0.5
    sigma_0: float = 2e4
    sigma_1: float = 10.0
    load: float = 0.0
    uneven: float = 0.0
    uneven_viscous: float = 0.0


class Sensors(NamedTuple):
    """Rate [1/s], bits of a turn, noise [N m], low pass [s], delay [s] and scale of the torque."""

    rate: int = 500
    bits: int = 16
    noise: float = 0.01
    filtered: float = 0.0
    late: float = 0.0
    gain: float = 1.0


MOTOR = 0.02
"""Inertia of the motor in front of a gap [kg m^2]."""


@numba.njit(cache=True)
def move(reference, speed, every, numbers, gap, out):
    """Write angle and motor torque of every so many steps into `out` `[N, 2]`."""
    (
        inertia,
        gravity,
        hangs,
        mu_c,
        rise,
        v_s,
        sigma_2,
        sigma_0,
        sigma_1,
        load,
        uneven,
        uneven_viscous,
    ) = numbers
    q = reference[0]
    v = 0.0
    motor_q = q
    motor_v = 0.0
    z = 0.0
    moved = MOTOR if gap > 0.0 else inertia
    row = 0
    for i in range(len(reference)):
        torque = 400.0 * (reference[i] - motor_q) + 8.0 * (speed[i] - motor_v)
        weight = -gravity * math.sin(q - hangs)
        outside = weight
        if gap > 0.0:
            apart = motor_q - q
            over = (
                apart - gap if apart > gap else (apart + gap if apart < -gap else 0.0)
            )
            outside = -(4e3 * over + 2.0 * (motor_v - v)) if over != 0.0 else 0.0
        side = 1.0 if motor_v >= 0.0 else -1.0
        level = (
            mu_c
            + uneven * side
            + rise * math.exp(-((motor_v / v_s) ** 2))
            + load * abs(torque - outside)
        )
        if i % every == 0:
            out[row, 0] = q
            out[row, 1] = torque
            row += 1
        rate = sigma_0 * abs(motor_v) / level
        settled = side * level / sigma_0
        keep = math.exp(-rate * STEP)
        z = settled + (z - settled) * keep if rate > 0.0 else z
        bent = sigma_0 * z + sigma_1 * (motor_v - rate * z)
        friction = bent + sigma_2 * motor_v + uneven_viscous * abs(motor_v)
        motor_v += STEP * (torque + outside - friction) / moved
        motor_q += STEP * motor_v
        if gap > 0.0:
            v += STEP * (weight - outside) / (inertia - MOTOR)
            q += STEP * v
        else:
            q = motor_q
            v = motor_v


def reference(kind: str, rng: np.random.Generator) -> np.ndarray:
    """Return the angle to follow: sums of sines, levels of speed in both directions, or slow waves with ripples."""
    t = np.arange(0.0, SECONDS, STEP)
    if kind == "sines":
        frequencies = rng.uniform(0.1, 2.0, 5)
        phases = rng.uniform(0.0, 6.28, 5)
        sizes = 0.5 / np.arange(1, 6)
        return np.clip(t, 0.0, 1.0) * (
            sizes @ np.sin(2.0 * np.pi * np.outer(frequencies, t) + phases[:, None])
        )
    if kind in ("levels", "one way"):
        levels = np.geomspace(0.01, 1.2, 6)
        speed = np.zeros_like(t)
        length = SECONDS / 12.0
        for i in range(12):
            x = (t - i * length) / length
            side = 1.0 if i % 2 == 0 or kind == "one way" else -1.0
            speed += (
                side * levels[i // 2] * np.clip(np.minimum(x, 1.0 - x) / 0.1, 0.0, 1.0)
            )
        return np.cumsum(speed) * STEP
    p = rng.uniform(0.0, 6.28, 2)
    return 0.3 * np.sin(1.57 * t + p[0]) + 0.006 * np.sin(14.5 * t + p[1])


def recorded(
    numbers: Numbers,
    kind: str,
    sensors: Sensors,
    rng: np.random.Generator,
    gap: float = 0.0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Move a joint along a reference; return times [s], angles [rad] and torques [N m] as its sensors see them."""
    goal = reference(kind, rng)
    every = round(1.0 / (sensors.rate * STEP))
    out = np.empty((-(-len(goal) // every), 2))
    move(goal, np.gradient(goal, STEP), every, tuple(numbers), gap, out)
    t = np.arange(len(out)) / sensors.rate
    torque = out[:, 1]
    if sensors.filtered:
        keep = np.exp(-1.0 / (sensors.rate * sensors.filtered))
        torque = np.array(
            list(itertools.accumulate(torque, lambda y, x: keep * y + (1.0 - keep) * x))
        )
    torque = sensors.gain * np.interp(t - sensors.late, t, torque) + rng.normal(
        0.0, sensors.noise, len(t)
    )
    resolution = 2.0 * np.pi / 2**sensors.bits
    return t, np.round(out[:, 0] / resolution) * resolution, torque


def draw(seed: int) -> Joint:
    """Draw a joint: its terms by its number, all else at random."""
    rng = np.random.default_rng([28_112, seed])
    stribeck, load, bristles, gravity, asymmetry = SETS[seed % len(SETS)]
    mu_c = rng.uniform(0.2, 0.8)
    sigma_2 = rng.uniform(0.05, 0.3)
    inertia = rng.uniform(0.03, 0.06) + 0.08 * gravity
    rise, v_s = (
        (rng.uniform(0.3, 0.8) * mu_c, 10.0 ** rng.uniform(-1.5, -0.5))
        if stribeck
        else (0.0, 1.0)
    )
    share = rng.uniform(0.08, 0.25) if load else 0.0
    moment, hangs = (
        (rng.uniform(1.5, 2.5), rng.uniform(-0.5, 0.5)) if gravity else (0.0, 0.0)
    )
    differs = rng.choice([-1.0, 1.0]) * rng.uniform(0.1, 0.3, 2)
    uneven, uneven_viscous = differs * [mu_c, sigma_2] if asymmetry else (0.0, 0.0)
    bend = 10.0 ** rng.uniform(-2.5, -1.6) if bristles else 3e-5
    sigma_0 = mu_c / bend
    sigma_1 = (0.005 if bristles else 0.0005) * sigma_0
    gap = 0.004 if rng.random() < 0.1 else 0.0
    bits = int(rng.integers(10, 21))
    rate = int(rng.choice([200, 500, 1000, 2000]))
    filtered = rng.choice([0.0, 0.004], p=[0.7, 0.3])
    late = rng.choice([0.0, rng.uniform(0.002, 0.02)], p=[0.7, 0.3])
    gain = rng.choice([1.0, 1.1], p=[0.8, 0.2])
    noise = 0.01 * rng.uniform(0.5, 2.0)
    numbers = Numbers(
        inertia,
        moment,
        hangs,
        mu_c,
        rise,
        v_s,
        sigma_2,
        sigma_0,
        sigma_1,
        share,
        uneven,
        uneven_viscous,
    )
    sensors = Sensors(rate, bits, noise, filtered, late, gain)
    logs = [
        recorded(numbers, kind, sensors, rng, gap)
        for kind in ("sines", "levels", "sines", "ripples")
    ]
    terms = frozenset(
        name for name, there in zip(NAMES, SETS[seed % len(SETS)], strict=True) if there
    )
    truth = {"inertia": gain * inertia, "mu_c": gain * mu_c, "sigma_2": gain * sigma_2}
    truth |= {"rise": gain * rise, "v_s": v_s} if stribeck else {}
    truth |= {"load": share} if load else {}
    truth |= {"sigma_0": gain * sigma_0}
    truth |= {"gravity": gain * moment, "offset": hangs} if gravity else {}
    truth |= (
        {"asymmetry": gain * uneven, "viscous_asymmetry": gain * uneven_viscous}
        if asymmetry
        else {}
    )
    about = {
        "bits": bits,
        "rate": rate,
        "filtered": filtered,
        "late": late,
        "gain": gain,
        "gap": gap,
        "bend": bend,
    }
    return Joint(
        terms, {name: float(value) for name, value in truth.items()}, about, logs
    )
