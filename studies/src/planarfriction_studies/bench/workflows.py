"""Costs of plans, of the identification of a log of ten seconds at 1 kHz, and of a sweep."""

from __future__ import annotations

import math
import sys
import tempfile
import time

import numpy as np

from planarfriction import planning, sweeps
from planarfriction.derivatives import rollout
from planarfriction.extend import processors
from planarfriction.identify import FitOptions, Log, identify_lugre
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import LimitSurface, LimitSurfaceExact
from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.patch import ContactPatch
from planarfriction.planning import Pusher, Slider
from planarfriction.scenes import (
    Scene,
    Signal,
    Solution,
    in_hand,
    in_hand_load,
    simulate,
)
from planarfriction_studies.bench.measurement import (
    Measurement,
    disc,
    law,
    line,
    median,
    once,
)

BEGIN, END = np.array([-0.045, 0.02]), np.array([0.005, 0.02])
"""Path of a pusher that sticks to the left edge of a square [m]."""

POWER_STEPS = 100
"""Steps of least power."""


def plan_grip(full: bool) -> Measurement:
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


def plan_push(full: bool) -> Measurement:
    """Measure a push of 50 mm that turns a square, on its exact limit surface."""
    square = 0.045 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    surface = LimitSurfaceExact(ContactPatch.rectangle(0.09))
    slider = Slider(surface, square)
    path = Signal.sampled([0.0, 1.0], [BEGIN, END], "linear")
    ours = median(lambda: planning.push(slider, Pusher(20.0), path, samples=2), 5)
    theirs = median(lambda: least_power(surface), 3)
    words = f"{POWER_STEPS} Euler steps, the spin of least power in each (SciPy, minimize_scalar)"
    return line(ours * 1e3, "ms", words, theirs * 1e3)


def least_power(surface: LimitSurface) -> np.ndarray:
    """Compute the end of the same push in small steps, each with the spin about the pusher of least power."""
    from scipy.optimize import minimize_scalar

    pose = np.zeros(3)
    (x, y) = BEGIN
    for _ in range(POWER_STEPS):
        c = np.cos(pose[2])
        s = np.sin(pose[2])
        way = (END - BEGIN) / POWER_STEPS
        vx = c * way[0] + s * way[1]
        vy = c * way[1] - s * way[0]
        twist = lambda spin, vx=vx, vy=vy: np.array(
            [vx + spin * y, vy - spin * x, spin]
        )
        unit = float(np.hypot(vx, vy)) / surface.contact_radius
        power = lambda spin, twist=twist: float(surface.dissipation(twist(spin)))
        found: float = minimize_scalar(power, bracket=(-unit, unit), tol=1e-10).x  # pyright: ignore
        vx, vy, omega = twist(found)
        pose = pose + np.array([c * vx - s * vy, s * vx + c * vy, omega])
    return pose


LOAD, RATE, DURATION = 2.0, 1000, 10.0

SHARE = 0.01
"""Noise of each wrench channel over its root mean square."""


def identification(full: bool, model: str = "reduced-published") -> Measurement:
    """Measure a fit with the distributed model, or with the published reduced one."""
    value, plain = identification_times(model)
    return line(value, "s", "the same fit without nuisance parameters", plain)


def identification_times(model: str) -> tuple[float, float]:
    """Return seconds of a fit of eight parameters, with all nuisance parameters and without, after one to compile."""
    patch = ContactPatch.disc(0.01, cells=21)
    law = LuGre(0.5, 0.65, 2e-3, 2e4, 30.0, 0.8, 1.4, ElastoPlastic(0.9))
    contact = (DistributedModel if model == "distributed" else ReducedModelPublished)(
        patch.discs(24), law
    )
    log = _log(contact, DURATION)
    identify_lugre(_log(contact, 0.1), patch, model=model, options=FitOptions(starts=1))
    times = []
    for nuisance in (("delay", "bias", "load", "twist"), ()):
        begin = time.perf_counter()
        identify_lugre(log, patch, model=model, options=FitOptions(nuisance=nuisance))
        times.append(time.perf_counter() - begin)
    return times[0], times[1]


def _log(contact: DistributedModel | ReducedModelPublished, duration: float) -> Log:
    t = np.arange(round(duration * RATE)) / RATE
    grown = np.minimum(1.0, 1.2 * np.exp(3.5 * (t / t[-1] - 1.0)))[:, None]
    twist = (
        grown * [0.03, 0.02, 2.0] * np.sin(2.0 * np.pi * t[:, None] * [2.3, 1.7, 3.1])
    )
    wrench = np.vstack(
        [
            np.zeros(3),
            rollout(
                contact, None, 0.5 * (twist[1:] + twist[:-1]), LOAD, 1.0 / RATE
            ).wrenches,
        ]
    )
    noise = (
        SHARE
        * np.sqrt(np.mean(wrench**2, axis=0))
        * np.random.default_rng(0).standard_normal(wrench.shape)
    )
    return Log(t, twist, wrench + noise, np.array(LOAD))


_MASSES, _OFFSETS, _GRIPS = (
    np.linspace(0.1, 0.25, 25),
    np.linspace(0.0, 0.009, 10),
    (0.8, 1.0, 1.2, 1.4),
)


def sweep(full: bool) -> Measurement:
    """Measure a thousand runs of 2 s in blocks of 250, each also simulated one run after another right before."""
    model = ReducedModel(disc(), law())
    held = in_hand_load(1)
    loads = {float(grip): Signal(held.times, grip * held.values) for grip in _GRIPS}

    def make(mass: float, offset: float, grip: float) -> Scene:
        return in_hand(
            model, mass=mass, centre_of_mass=(offset, 0.0), normal_force=loads[grip]
        )

    simulate(make(0.2, 0.0, float(_GRIPS[0])), t_end=0.02)  # compiles
    solver = alone = swept = used = 0.0
    memory = []
    with tempfile.TemporaryDirectory() as folder:
        for grip in loads:
            values = {"mass": _MASSES, "offset": _OFFSETS, "grip": [grip]}
            begin = time.process_time()
            for mass in _MASSES:
                for offset in _OFFSETS:
                    solver += simulate(make(mass, offset, grip)).statistics.wall_time
            middle = time.process_time()
            alone += middle - begin
            swept += once(
                lambda values=values: sweeps.sweep(
                    make, values, out=folder, measure=end
                )
            )
            used += time.process_time() - middle
            memory.append(_memory())
    count = processors()
    words = (
        f"time in the solver of the same runs, one after another, over {count} processors (processor time: "
        f"{used / alone:.2f} of that of simulate; memory: {memory[-1] - memory[0]:+.1f} MB from run 250 to 1,000)"
    )
    return line(swept, "s", words, solver / count)


def end(solution: Solution) -> dict[str, float]:
    """Return the last pose of the plate."""
    return {
        name: float(solution.histories[name].values[-1]) for name in ("x", "y", "theta")
    }


def _memory() -> float:
    """Return the peak memory of this process so far [MB]."""
    try:
        import resource
    except ImportError:  # on Windows
        return float("nan")
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (
        1e6 if sys.platform == "darwin" else 1e3
    )
