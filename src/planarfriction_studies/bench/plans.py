"""Costs of plans: a grip beside one simulation of its scene, a push beside small steps of least power."""

from __future__ import annotations

import math

import numpy as np

from planarfriction import planning
from planarfriction.limit_surface import LimitSurface, LimitSurfaceExact
from planarfriction.models import ReducedModel
from planarfriction.patch import ContactPatch
from planarfriction.planning import Pusher, Slider
from planarfriction.scenes import Signal, in_hand, simulate
from planarfriction_studies.bench.measurement import Measurement, line, median
from planarfriction_studies.bench.workloads import disc, law

BEGIN, END = np.array([-0.045, 0.02]), np.array([0.005, 0.02])
"""Path of a pusher that sticks to the left edge of a square [m]."""

STEPS = 100
"""Steps of least power."""


def grip(full: bool) -> Measurement:
    """Measure a plan of a turn by 30 degrees with 20 knots, beside one simulation of it."""
    model = ReducedModel(disc(), law())
    scene = in_hand(model, centre_of_mass=(0.025, 0.0), normal_force=4.0, t_end=1.0)
    goal = {"angle": math.radians(-30.0)}
    plan = planning.plan_grip(scene, goal)
    value = median(lambda: planning.plan_grip(scene, goal), 3)
    alone = median(lambda: simulate(plan.scene), 9)
    report = plan.report
    miss = abs(math.degrees(report.angle - goal["angle"]))
    words = (
        f"one simulation of the plan (misses {miss:.2g} degrees, {report.simulations} simulations, "
        f"{report.jacobians} Jacobians)"
    )
    return line(value, "s", words, alone)


def push(full: bool) -> Measurement:
    """Measure a push of 50 mm that turns a square, on its exact limit surface."""
    square = 0.045 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    surface = LimitSurfaceExact(ContactPatch.rectangle(0.09))
    slider, path = Slider(surface, square), Signal.sampled([0.0, 1.0], [BEGIN, END], "linear")
    ours = median(lambda: planning.push(slider, Pusher(20.0), path, samples=2), 5)
    theirs = median(lambda: least_power(surface), 3)
    words = f"{STEPS} Euler steps, the spin of least power in each (SciPy, minimize_scalar)"
    return line(ours * 1e3, "ms", words, theirs * 1e3)


def least_power(surface: LimitSurface) -> np.ndarray:
    """Compute the end of the same push in small steps: of all spins about the pusher, each takes the one of least
    power."""
    from scipy.optimize import minimize_scalar

    pose, (x, y) = np.zeros(3), BEGIN
    for _ in range(STEPS):
        c, s = np.cos(pose[2]), np.sin(pose[2])
        way = (END - BEGIN) / STEPS
        vx, vy = c * way[0] + s * way[1], c * way[1] - s * way[0]
        twist = lambda spin, vx=vx, vy=vy: np.array([vx + spin * y, vy - spin * x, spin])  # noqa: E731
        unit = float(np.hypot(vx, vy)) / surface.contact_radius
        power = lambda spin, twist=twist: float(surface.dissipation(twist(spin)))  # noqa: E731
        found: float = minimize_scalar(power, bracket=(-unit, unit), tol=1e-10).x  # pyright: ignore
        vx, vy, omega = twist(found)
        pose = pose + np.array([c * vx - s * vy, s * vx + c * vy, omega])
    return pose
