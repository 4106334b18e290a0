"""`planarfriction bench`: what things cost, each beside a baseline measured in the same run, without compile time.

Machines are shared and noisy: every value is a median, and `ratio` (baseline over value) says more than either.
"""

from __future__ import annotations

import importlib
import statistics
import subprocess
import sys
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np

from planarfriction import validation
from planarfriction.bench import drake_disc, grip_plan, mjx_costs, mujoco_costs, push_cost, sweep_costs
from planarfriction.bench.baselines import lsoda_time, numpy_table, scipy_twist
from planarfriction.bench.four_feet import four_feet
from planarfriction.bench.identified_log import identification
from planarfriction.bench.measurement import Measurement, line, median, once
from planarfriction.errors import MissingExtraError
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import LimitSurface, LimitSurfaceExact, LimitSurfaceTable, LimitSurfaceTablePublished
from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch, SoftFinger
from planarfriction.scenes import Scene, Signal, Solution, in_hand, in_hand_load, simulate
from planarfriction.scenes.ready import IN_HAND_LOADS

WINDOW = 0.1
"""Part of the in-hand run [s] that the general solver is given where the whole run would take it minutes."""

_AGAINST_PUBLISHED = "the same of ReducedModelPublished"


def run(
    names: Sequence[str] | None = None, *, full: bool = False, progress: Callable[[str], None] | None = None
) -> list[Measurement]:
    """Measure the benchmarks `names` (all by default); `full` also runs the baselines that take minutes.

    Raises `InvalidValueError` for an unknown name.
    """
    chosen = list(BENCHMARKS) if names is None else [validation.choice("name", name, BENCHMARKS) for name in names]
    results = []
    for name in chosen:
        if progress is not None:
            progress(name)
        try:
            results.append(BENCHMARKS[name](name, full))
        except MissingExtraError as missing:
            results.append(Measurement(name, None, "", f"left out: {missing}", None, None))
    return results


def _solver_time(scene: Scene, repeats: int, **options: Any) -> tuple[float, Solution]:
    """Median time in the solver [s], and the last solution."""
    simulate(scene, **{**options, "t_end": 0.02})
    solutions = [simulate(scene, **options) for _ in range(repeats)]
    return statistics.median(s.statistics.wall_time for s in solutions), solutions[-1]


# ---------------------------------------------------------------------- workloads


def _law() -> LuGre:
    return LuGre(mu_s=1.2, elasto_plastic=ElastoPlastic(0.9))


def _disc(cells: int = 21) -> ContactPatch:
    return PUBLISHED_PATCHES["Circle"](cells=cells)


def _mixed_twists(count: int) -> np.ndarray:
    """Twists that slide and spin at all speeds around the Stribeck speed, in random directions."""
    generator = np.random.default_rng(7)
    directions = generator.normal(size=(count, 3)) * [1.0, 1.0, 150.0]
    return directions * 10.0 ** generator.uniform(-4.0, -1.5, size=(count, 1))


def _in_hand_distributed(name: str, full: bool) -> Measurement:
    scene = in_hand(DistributedModel(_disc(), _law()))
    value, _ = _solver_time(scene, 5)
    if full:
        return line(name, value, "s", "SciPy LSODA over the whole run", lsoda_time(scene, scene.t_end))
    ours, _ = _solver_time(scene, 5, t_end=WINDOW)
    theirs = lsoda_time(scene, WINDOW)
    words = f"SciPy LSODA over the first {WINDOW} s (the ratio is to the {ours * 1e3:.2g} ms of that window here)"
    return Measurement(name, value, "s", words, theirs, theirs / ours)


def _in_hand_distributed_101(name: str, full: bool) -> Measurement:
    costs = {}
    for cells in (101, 21):
        patch = _disc(cells)
        value, solution = _solver_time(in_hand(DistributedModel(patch, _law())), 3, t_end=WINDOW)
        trials = solution.statistics.steps + solution.statistics.rejections
        costs[cells] = value / trials / patch.cells * 1e9
    return line(name, costs[101], "ns per loaded cell and step", "the same on 21 x 21 cells", costs[21])


def _in_hand_published(name: str, full: bool, load: Literal[1, 2] = 1) -> Measurement:
    scene = in_hand(ReducedModelPublished(_disc(), _law()), normal_force=in_hand_load(load))
    value, _ = _solver_time(scene, 9)
    return line(name, value, "s", "SciPy LSODA over the whole run", lsoda_time(scene, scene.t_end))


def _in_hand_reduced(name: str, full: bool) -> Measurement:
    kinds = (ReducedModel, ReducedModelPublished)
    value, theirs = (_solver_time(in_hand(kind(_disc(), _law())), 9)[0] for kind in kinds)
    return line(name, value, "s", "the published reduced model", theirs)


def _soft() -> ContactPatch:
    """The published soft finger whose profile follows the load."""
    width = 0.02
    finger = SoftFinger(c=6.0 * width / 21, n=1.0 / 3.0, k_per_newton=2.0, radius_max=0.5 * width)
    return ContactPatch.rectangle(width, cells=21, pressure=finger)


def _in_hand_load_family(name: str, full: bool) -> Measurement:
    """Runs in turn, so that a noisy machine disturbs both alike; what is built is built before."""
    soft = _soft()
    fixed = ContactPatch(soft.positions, soft.areas, soft.weights(IN_HAND_LOADS[1, 1][0]), soft.grid)
    family, rebuilt = ReducedModel(soft, _law()), ReducedModel(soft, _law(), load_error=0.0)
    scenes = [in_hand(family), in_hand(ReducedModel(fixed, _law()))]
    simulate(scenes[1], t_end=0.02)
    built = once(lambda: simulate(scenes[0]))
    every = once(lambda: simulate(in_hand(rebuilt)))
    times = np.array([[once(lambda scene=scene: simulate(scene)) for scene in scenes] for _ in range(25)])
    value, theirs = np.median(times, axis=0).tolist()
    words = (
        f"the same with a fixed shape (both: all of simulate); the family's {len(family.load_rungs)} maps took "
        f"{built:.2g} s before, a map for every load in place of them takes {every:.2g} s"
    )
    return line(name, value, "s", words, theirs)


def _in_hand_load_dependent(name: str, full: bool) -> Measurement:
    soft = _soft()
    rebuilt = median(lambda: simulate(in_hand(ReducedModelPublished(soft, _law()))), 3)
    fixed = median(lambda: simulate(in_hand(ReducedModelPublished(_disc(), _law()))), 3)
    return line(name, rebuilt, "s", "the same with a fixed shape (both: all of simulate)", fixed)


def _table_build(name: str, full: bool) -> Measurement:
    patch = _disc()
    value = median(lambda: LimitSurfaceTablePublished(patch).numbers, 31)
    return line(name, value, "s", "the same nodes by NumPy, node by node", median(lambda: numpy_table(patch), 3))


def _twist(name: str, full: bool, kind: type[LimitSurface], count: int | None = None) -> Measurement:
    """The twist of a wrench, of an L that is a polygon: one a call, or `count` in a call."""
    corners = [(0.0, 0.0), (0.03, 0.0), (0.03, 0.005), (0.005, 0.005), (0.005, 0.02), (0.0, 0.02)]
    surface = kind(ContactPatch.polygon(corners, 21))
    wrenches = np.random.default_rng(7).normal(size=(count or 1, 3)) * [1.0, 1.0, 0.01]
    asked = wrenches[0] if count is None else wrenches
    value = median(lambda: surface.twist(asked), 15, 1 if count else 500) / len(wrenches)
    theirs = median(lambda: scipy_twist(surface, wrenches[0]), 5)
    words = "SciPy (trust-exact) on the dissipation over the plane of unit power, one wrench"
    return line(name, value * 1e6, "us per wrench", words, theirs * 1e6)


def _compiled_loop(model: ReducedModel | ReducedModelPublished, twists: np.ndarray) -> float:
    """Time of a model's steps through `twists`, compiled [s]."""
    from planarfriction.autodiff.inputs import checked

    inputs = checked(model, None, twists, 1.0, 1e-4, None)
    compiled, family = inputs.compiled(), inputs.parts[0].family
    wrench, states = np.empty((1, *twists.shape)), np.empty((len(inputs.parts), 1, 0, 3))
    return median(lambda: family.rollout(compiled, (0, 1), inputs.state.copy(), wrench, states), 9)


def _published_loop(twists: np.ndarray) -> float:
    return _compiled_loop(ReducedModelPublished(_disc(), _law()), twists)


def _step_published_loop(name: str, full: bool) -> Measurement:
    twists = _mixed_twists(20_000)
    loop, call = _published_loop(twists), _python_step(ReducedModelPublished(_disc(), _law()), 1000)
    return line(name, loop / len(twists) * 1e6, "us", "one Python call of the same step", call * 1e6)


def _step_distributed_loop(name: str, full: bool) -> Measurement:
    from planarfriction.kernels import distributed_step as kernels

    model, twists = DistributedModel(_disc(), _law()), _mixed_twists(1000)
    x, y = (np.ascontiguousarray(column) for column in model.patch.positions.T)
    cells = kernels.Cells(x, y, model.patch.weights()[None])
    z = model.rest().reshape(-1)
    scratch, wrench = np.empty_like(z), np.empty_like(twists)
    arguments = cells, 1.0, 1e-4, scratch, wrench
    loop = median(lambda: kernels.step_sequence(model.law.numbers, z, twists, *arguments), 9)
    call = _python_step(model, 100)
    return line(name, loop / len(twists) * 1e6, "us", "one Python call of the same step", call * 1e6)


def _python_step(model: Any, inner: int) -> float:
    state, twist = model.rest(), (0.01, 0.0, 1.0)
    return median(lambda: model.step(state, twist, 1.0, 1e-3), 9, inner)


def _step_published_call(name: str, full: bool) -> Measurement:
    model = ReducedModelPublished(_disc(), _law())
    state, twist = model.rest(), np.array([0.01, 0.0, 1.0])
    rate = median(lambda: model.rate(state, twist, 1.0), 9, 100)
    return line(name, _python_step(model, 2000) * 1e6, "us", "one Python call of rate", rate * 1e6)


def _step_reduced_loop(name: str, full: bool, parts: int = 1) -> Measurement:
    twists = _mixed_twists(20_000)
    ours, theirs = _compiled_loop(ReducedModel(_disc(), _law(), parts=parts), twists), _published_loop(twists)
    return line(name, ours / len(twists) * 1e6, "us", _AGAINST_PUBLISHED, theirs / len(twists) * 1e6)


def _step_reduced_call(name: str, full: bool) -> Measurement:
    ours, theirs = (_python_step(model(_disc(), _law()), 2000) for model in (ReducedModel, ReducedModelPublished))
    return line(name, ours * 1e6, "us", _AGAINST_PUBLISHED, theirs * 1e6)


def _gradient_reduced(name: str, full: bool) -> Measurement:
    """A roll-out with its gradient, as `gradient.published`."""
    ours, theirs = (_value_and_gradient(model(_disc(), _law())) for model in (ReducedModel, ReducedModelPublished))
    return line(name, ours, "s", _AGAINST_PUBLISHED, theirs)


def _value_and_gradient(model: ReducedModel | ReducedModelPublished) -> float:
    """Time of half the squared wrenches of a roll-out with their gradient to all its inputs [s]."""
    from planarfriction import autodiff

    twists, dt = _mixed_twists(2000), 1e-4
    loads = np.full(len(twists), 2.0)

    def value_and_gradient() -> None:
        _, wrenches, states = autodiff.rollout_states(model, model.rest(), twists, loads, dt)
        autodiff.rollout_gradient(model, model.rest(), twists, loads, dt, wrenches, states=states)

    return median(value_and_gradient, 15)


def _gradient_published(name: str, full: bool) -> Measurement:
    """Half the squared wrenches of a roll-out, with its gradient to all parameters, twists, loads and the state."""
    from planarfriction import autodiff

    model, twists, dt = ReducedModelPublished(_disc(), _law()), _mixed_twists(2000), 1e-4
    loads = np.full(len(twists), 2.0)
    value = _value_and_gradient(model)
    try:
        return line(name, value, "s", "PyTorch, eager, the same roll-out", _eager_gradient(model, twists, dt, full))
    except ImportError:
        inputs = len(autodiff.PARAMETERS) + 3 + 4 * len(twists)
        once = median(lambda: autodiff.rollout(model, model.rest(), twists, loads, dt), 15)
        words = f"central differences, 2 x {inputs} roll-outs of {once * 1e3:.2g} ms (PyTorch is not installed)"
        return line(name, value, "s", words, 2 * inputs * once)


def _eager_gradient(model: ReducedModelPublished, twists: np.ndarray, dt: float, full: bool) -> float:
    """Time of the same value and gradient, step by step through `planarfriction.torch` and autograd [s]."""
    import torch

    front = importlib.import_module("planarfriction.torch")
    module = front.ReducedModelPublished(model.patch, model.law, dtype=torch.float64)
    profile = torch.tensor(twists, requires_grad=True)
    loads = torch.full((len(twists),), 2.0, dtype=torch.float64, requires_grad=True)

    def value_and_gradient() -> None:
        start = torch.zeros(3, dtype=torch.float64, requires_grad=True)
        wrenches = front.rollout(module, start, profile, loads, dt, method="eager").wrenches
        (0.5 * wrenches * wrenches).sum().backward()

    return median(value_and_gradient, 3 if full else 1)


def _gradient_published_batch(name: str, full: bool) -> Measurement:
    both, once = _batch(ReducedModelPublished(_disc(), _law()))
    words = "the roll-out alone (the ratio is the share of its speed)"
    return Measurement(name, both, "million contact-steps/s", words, once, both / once)


def _gradient_reduced_batch(name: str, full: bool) -> Measurement:
    (both, once), (theirs, alone) = (_batch(model(_disc(), _law())) for model in (ReducedModel, ReducedModelPublished))
    words = f"{_AGAINST_PUBLISHED} (the roll-outs alone: {once:.3g} and {alone:.3g})"
    return Measurement(name, both, "million contact-steps/s", words, theirs, both / theirs)


def _batch(model: ReducedModel | ReducedModelPublished) -> tuple[float, float]:
    """Million contact-steps/s of a thousand roll-outs with their gradient, and of the roll-outs alone."""
    from planarfriction import autodiff

    contacts, steps, dt = 1000, 1000, 1e-4
    twists = _mixed_twists(contacts * steps).reshape(contacts, steps, 3)
    loads = np.full((contacts, steps), 2.0)

    def value_and_gradient() -> None:
        _, wrenches, states = autodiff.rollout_states(model, model.rest(), twists, loads, dt)
        autodiff.rollout_gradient(model, model.rest(), twists, loads, dt, wrenches, states=states)

    both = median(value_and_gradient, 5)
    once = median(lambda: autodiff.rollout(model, model.rest(), twists, loads, dt), 5)
    return 1e-6 * contacts * steps / both, 1e-6 * contacts * steps / once


def _step_reduced_several(name: str, full: bool) -> Measurement:
    """The derivatives of one step, or the steps of four contacts, in one Python call."""
    model = ReducedModel(_disc(), _law())
    one, four = (np.zeros(3), (0.01, 0.0, 1.0), 1.0), (np.zeros((4, 3)), np.tile((0.01, 0.0, 1.0), (4, 1)), np.ones(4))
    action = (lambda: model.step(*four, 1e-3)) if name.endswith("four") else lambda: model.step_jacobians(*one, 1e-3)
    value = median(action, 9, 2000)
    return line(name, value * 1e6, "us", "one Python call of step", _python_step(model, 2000) * 1e6)


def _coupled(name: str, full: bool, environments: int = 1) -> Measurement:
    """A box on four feet slides and turns: an implicit step, in one Python call for all environments."""
    model = ReducedModel(_disc(), _law())
    step = four_feet(model, environments)
    value, rounds = median(step, 9, 1 + 500 // environments) / environments, float(step().iterations.mean())
    words = f"one Python call of a model's step (four patches, {rounds:.1f} rounds)"
    return line(name, value * 1e6, "us per step", words, _python_step(model, 2000) * 1e6)


def _sensitivities(name: str, full: bool) -> Measurement:
    """Derivatives to friction, to twenty knots of the grip, and of one cost to those knots."""
    from planarfriction.autodiff import scene_gradient, scene_sensitivities

    knots, tight = np.linspace(0.0, 0.5, 20), 1e-9
    grip = Signal(knots, 1.73 - 0.91 * np.sin(4.0 * np.pi * knots), "linear")
    load = None if name == "sensitivities.reduced" else grip
    scene = in_hand(ReducedModel(_disc(), _law()), normal_force=load, t_end=0.5)
    signals = {"fingers.normal_force": knots}
    work = {
        "sensitivities.reduced": lambda: scene_sensitivities(scene, ("mu",), rtol=tight, atol=tight),
        "sensitivities.knots": lambda: scene_sensitivities(scene, (), signals=signals, rtol=tight, atol=tight),
        "sensitivities.gradient": lambda: scene_gradient(
            scene, lambda time, motion: np.ones_like(motion), signals=signals, rtol=tight, atol=tight
        ),
    }
    ours = median(work[name], 3)
    alone = median(lambda: simulate(scene, rtol=tight, atol=tight), 3)
    return line(name, ours, "s", "the same simulation alone", alone)


def _import(name: str, full: bool) -> Measurement:
    def seconds(module: str) -> float:
        code = f"import time; t = time.perf_counter(); import {module}; print(time.perf_counter() - t)"
        command = [sys.executable, "-c", code]
        return float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

    ours, theirs = (statistics.median(seconds(module) for _ in range(7)) for module in ("planarfriction", "numpy"))
    return line(name, ours, "s", "import numpy", theirs)


BENCHMARKS: dict[str, Callable[[str, bool], Measurement]] = {
    "in_hand.distributed": _in_hand_distributed,
    "in_hand.distributed.101": _in_hand_distributed_101,
    "in_hand.published": _in_hand_published,
    "in_hand.published.load_2": lambda name, full: _in_hand_published(name, full, load=2),
    "in_hand.published.load_dependent": _in_hand_load_dependent,
    "in_hand.reduced": _in_hand_reduced,
    "in_hand.reduced.load_family": _in_hand_load_family,
    "table.build": _table_build,
    "twist.table.call": lambda name, full: _twist(name, full, LimitSurfaceTable),
    "twist.table.batch": lambda name, full: _twist(name, full, LimitSurfaceTable, 1000),
    "twist.exact.call": lambda name, full: _twist(name, full, LimitSurfaceExact),
    "twist.exact.batch": lambda name, full: _twist(name, full, LimitSurfaceExact, 1000),
    "step.published.loop": _step_published_loop,
    "step.distributed.loop": _step_distributed_loop,
    "step.published.call": _step_published_call,
    "step.reduced.loop": _step_reduced_loop,
    "step.reduced.parts4.loop": lambda name, full: _step_reduced_loop(name, full, parts=4),
    "step.reduced.call": _step_reduced_call,
    "step.reduced.slopes": _step_reduced_several,
    "step.reduced.four": _step_reduced_several,
    "coupled.four_feet.call": _coupled,
    "coupled.four_feet.batch": lambda name, full: _coupled(name, full, 1000),
    "mujoco.tray.1": mujoco_costs.measure,
    "mujoco.tray.2": mujoco_costs.measure,
    "mujoco.tray.8": mujoco_costs.measure,
    "mujoco.grip": mujoco_costs.measure,
    "mujoco.rollout": mujoco_costs.measure,
    "mjx.discs": mjx_costs.measure,
    "drake.disc.point": drake_disc.measure,
    "drake.disc.hydroelastic": drake_disc.measure,
    "gradient.published": _gradient_published,
    "gradient.published.batch": _gradient_published_batch,
    "gradient.reduced": _gradient_reduced,
    "gradient.reduced.batch": _gradient_reduced_batch,
    "sensitivities.reduced": _sensitivities,
    "sensitivities.knots": _sensitivities,
    "sensitivities.gradient": _sensitivities,
    "planning.grip": grip_plan.measure,
    "planning.push": push_cost.measure,
    "identify.log": identification,
    "identify.log.distributed": identification,
    "sweep": sweep_costs.measure,
    "import": _import,
}
"""Benchmarks by name."""
