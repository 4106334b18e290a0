"""Rollouts of every model: they take the model's steps, and derivatives agree with differences and with each other."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import derivatives
from tests.support import contacts
from tests.support.contacts import FOUR as PATCH
from tests.support.contacts import SURFACES, TIP

LAWS = contacts.LAWS | {
    "wide": pf.LuGre(mu_c=0.7, mu_s=1.2, gamma=1.5, elasto_plastic=0.3)
}
SPEEDS = {"stick": 1e-6, "around": 3e-3, "slip": 1e-1}
"""Largest change of the speed from step to step [m/s]; full deflection takes 1e-6 m, a step 1e-4 s."""

METRIC = pf.friction_metric(0.6, along=0.5, across=1.0)
EACH = [pf.friction_metric(0.3 * i, 0.6, 1.1) for i in range(PATCH.cells)]
DIRECTED = {
    "metric": PATCH.with_friction_metric(METRIC),
    "metrics": PATCH.with_friction_metric(EACH),
    "leaning": PATCH.with_friction_metric(EACH, (0.3, -0.2)),
    "leaning discs": dataclasses.replace(
        PATCH, asymmetry=(0.3, -0.2), radii=np.full(PATCH.cells, 0.002)
    ),
}

LOAD, DT, T = 2.0, 1e-4, 12


class Case(NamedTuple):
    """A model with the motion that it is moved by."""

    make: Callable[[], Any]
    speed: float = SPEEDS["around"]
    rounding: float = 1e-11
    """Relative difference of equal sums in another order; tables of three bristles amplify it less than maps."""

    @property
    def model(self):
        return made(self.make)


@functools.cache
def made(make):
    return make()


def published(surface, law):
    return Case(
        lambda: pf.ReducedModelPublished(
            PATCH, LAWS[law], surface=SURFACES[surface](PATCH)
        ),
        rounding=1e-12,
    )


def distributed(patch, law, speed="around"):
    return Case(lambda: pf.DistributedModel(patch, LAWS[law]), SPEEDS[speed])


MANY = pf.ContactPatch.disc(0.01, cells=9)
"""More cells than one block of compiled rollouts holds."""

FIXED = {
    **{
        f"published {surface}, {law}": published(surface, law)
        for surface in SURFACES
        for law in LAWS
    },
    **{
        f"cells, {law}, {speed}": distributed(PATCH, law, speed)
        for law in LAWS
        for speed in SPEEDS
    },
    **{f"cells, {name}": distributed(DIRECTED[name], "wide") for name in DIRECTED},
    "cells, many": distributed(MANY, "elasto-plastic"),
    "cells, few": Case(lambda: pf.ReducedModel(MANY, LAWS["wide"], cells=20)),
    "published table, metric": Case(
        lambda: pf.ReducedModelPublished(
            DIRECTED["metric"], LAWS["wide"], pf.LimitSurfaceTable(DIRECTED["metric"])
        )
    ),
}
SOFT = {
    "soft cells": distributed(TIP, "elasto-plastic"),
    "soft cells, plain": distributed(TIP, "plain"),
    "soft cells, metric": distributed(TIP.with_friction_metric(METRIC), "wide"),
    "soft cells, few": Case(lambda: pf.ReducedModel(TIP, LAWS["wide"], cells=9)),
}
PAD = pf.Pad.at_load(LOAD)
STIFF = {
    **{
        f"pad, {law}": Case(
            lambda law=law: pf.DistributedModel(PATCH, LAWS[law], pad=PAD)
        )
        for law in LAWS
    },
    "pad, metric": Case(
        lambda: pf.DistributedModel(DIRECTED["metric"], LAWS["wide"], pad=PAD)
    ),
    "pad, many": Case(
        lambda: pf.DistributedModel(MANY, LAWS["elasto-plastic"], pad=PAD)
    ),
    "pad, few": Case(lambda: pf.ReducedModel(MANY, LAWS["wide"], cells=20, pad=PAD)),
}
"""Loads fall below those that hold what bristles carry."""
COMMON = pf.LuGre(mu_c=0.8, mu_s=1.0, sigma_1=0.0, v_s=0.5, elasto_plastic=0.9)
FACES = {
    "face": Case(
        lambda: pf.ReducedModel(
            pf.ContactPatch.rectangle(0.02, cells=7), COMMON, cells=9,
            pad=pf.Pad.measured(4e4, 0.4),
        ), 0.3,
    ),
}  # fmt: skip
"""Pads with a common compliance, whose law is not a vector of numbers."""
CASES = FIXED | SOFT | STIFF | FACES

every_case = pytest.mark.parametrize("name", CASES)


def twist_sizes(model):
    """Return the factors that turn speeds [m/s] into twists."""
    return np.array([1.0, 1.0, 1.0 / model.patch.contact_radius(LOAD)])


def state_sizes(model):
    """Return the factors that turn deflections [m] into states."""
    return (
        1.0 / twist_sizes(model)
        if isinstance(model, pf.ReducedModelPublished)
        else np.ones(1)
    )


def drive(case, seed=0, steps=T):
    """Return a state, a random walk of twists that starts, slides, spins and turns back, and loads."""
    random = np.random.default_rng(seed)
    model = case.model
    state = (
        random.normal(size=model.state_shape)
        * min(4e-7, 0.1 * case.speed)
        * state_sizes(model)
    )
    twists = (
        np.cumsum(random.normal(size=(steps, 3)), axis=0)
        * case.speed
        * twist_sizes(model)
    )
    return state, twists, random.uniform(1.0, 3.0, steps)


def parameters_of(model):
    """Return the parameters of a model, those of a law for a pad with a common compliance."""
    if model.law is not COMMON:
        return derivatives.parameters_of(model)
    names = derivatives.parameter_names(model)
    return np.array([getattr(COMMON.numbers, name) for name in names])


def rolled(model, state, twists, loads, parameters):
    """Return the rollout of a model with other numbers of its law."""
    if model.law is not COMMON:
        return derivatives.rollout(
            model, state, twists, loads, DT, parameters=parameters
        )
    numbers = dict(zip(derivatives.parameter_names(model), parameters, strict=True))
    ratio = numbers.pop("breakaway_ratio")
    law = dataclasses.replace(COMMON, elasto_plastic=ratio, **numbers)
    return derivatives.rollout(model.with_law(law), state, twists, loads, DT)


def interrupted(case, seed=0):
    """Return such a motion with a rest, a step without load, and loads at and beside those of measured maps."""
    state, twists, loads = drive(case, seed)
    twists[8] = 0.0
    loads[2] = 0.0
    loads[5] = 1.0
    loads[6] = 2.0 - 1e-9
    return state, twists, loads


def cotangents(model, seed=1):
    """Return cotangents of wrenches and of the last state that weigh all of them alike."""
    random = np.random.default_rng(seed)
    wrenches = random.normal(size=(T, 3)) * twist_sizes(model)
    return wrenches, random.normal(size=model.state_shape) * 1e6 / state_sizes(model)


@every_case
def test_a_rollout_takes_the_steps_of_the_model(name):
    case = CASES[name]
    model = case.model
    (state, twists, loads) = interrupted(case)
    found = derivatives.rollout_states(model, state, twists, loads, DT)
    end, wrenches = derivatives.rollout(model, state, twists, loads, DT)
    assert np.array_equal(found.wrenches, wrenches) and np.array_equal(found.state, end)
    for t in range(T):
        assert found.states[t] == pytest.approx(state, rel=case.rounding, abs=1e-20)
        state, wrench = model.step(state, twists[t], loads[t], DT)
        assert wrenches[t] == pytest.approx(
            wrench, rel=case.rounding, abs=0.01 * case.rounding
        )
    assert end == pytest.approx(state, rel=case.rounding, abs=1e-20)


@every_case
def test_the_gradient_of_a_rollout_is_that_of_differences(name):
    case = CASES[name]
    model = case.model
    (state, twists, loads) = drive(case, 3)
    parameters = parameters_of(model)
    bars = cotangents(model)
    lengths = np.where(
        np.arange(len(parameters)) >= 10, model.patch.contact_radius(LOAD), 1e-3
    )
    inputs = {
        "state": state,
        "twist": twists,
        "normal_force": loads,
        "parameters": parameters,
    }
    units = {
        "state": 1e-6 * state_sizes(model),
        "twist": case.speed * twist_sizes(model),
        "normal_force": 1.0,
        "parameters": np.maximum(np.abs(parameters), lengths),
    }
    if model.law is COMMON:  # which takes no other sigma_1 than 0
        units["parameters"] *= parameters > 0.0
    gradient = derivatives.rollout_vjp(model, state, twists, loads, DT, *bars)

    def value(of, change):
        changed = {**inputs, of: inputs[of] + change * units[of]}
        run = rolled(model, *changed.values())
        return float((bars[0] * run.wrenches).sum() + (bars[1] * run.state).sum())

    for of, found in gradient._asdict().items():
        scaled = found * units[of]
        expected = np.empty_like(found)
        for index in np.ndindex(found.shape):
            step = np.zeros_like(found)
            step[index] = 1e-6
            expected[index] = (value(of, step) - value(of, -step)) / 2e-6
        # Differences lose 1e-16/1e-6 to rounding of numbers near 100, and 1e-6 of the largest slope where the curvature
        # jumps: at squares of the map, and at ends of the elasto-plastic range, which tables jump to at once.
        jump = 1e-5 if name.startswith("published") else 1e-6
        assert scaled == pytest.approx(
            expected, rel=jump, abs=1e-6 * np.abs(scaled).max() + 1e-7
        ), of


@every_case
def test_forwards_is_the_transpose_of_backwards(name):
    """`<bar, J x> = <J' bar, x>` for changes x of all inputs, also at rest and without load."""
    case = CASES[name]
    random = np.random.default_rng(3)
    model = case.model
    inputs = interrupted(case, 4)
    (bar, end_bar) = cotangents(case.model)
    parameters = parameters_of(model)
    changes = [*drive(case, 5), parameters * random.normal(size=len(parameters))]
    found = derivatives.rollout_jvp(
        model, *inputs, DT, derivatives.RolloutTangent(*changes)
    )
    plain = derivatives.rollout(model, *inputs, DT)
    assert found.wrenches == pytest.approx(
        plain.wrenches, rel=case.rounding, abs=0.01 * case.rounding
    )
    assert found.state == pytest.approx(plain.state, rel=case.rounding, abs=1e-20)
    gradient = derivatives.rollout_vjp(model, *inputs, DT, bar, end_bar)
    forwards = [
        *(bar * found.wrenches_dot).ravel(),
        *(end_bar * found.state_dot).ravel(),
    ]
    backwards = [
        *np.concatenate(
            [(g * x).ravel() for g, x in zip(gradient, changes, strict=True)]
        )
    ]
    assert sum(forwards) == pytest.approx(
        sum(backwards), abs=case.rounding * np.abs(forwards + backwards).sum()
    )


@every_case
def test_changes_of_parameters_are_the_jacobian(name):
    case = CASES[name]
    model = case.model
    inputs = interrupted(case, 6)
    (bar, _) = cotangents(case.model, 2)
    by = derivatives.rollout_jacobian(model, *inputs, DT)
    assert by.wrenches == pytest.approx(
        derivatives.rollout(model, *inputs, DT).wrenches, rel=1e-11, abs=1e-13
    )
    directions = np.eye(len(derivatives.parameter_names(model)))
    found = derivatives.rollout_jvp(
        model, *inputs, DT, derivatives.RolloutTangent(parameters=directions)
    )
    for forwards, wanted in zip(
        found.wrenches_dot, np.moveaxis(by.d_wrenches, -1, 0), strict=True
    ):
        assert forwards == pytest.approx(
            wanted, rel=1e-10, abs=1e-12 * max(1.0, np.abs(wanted).max())
        )
    assert found.state_dot.shape == (len(directions), *model.state_shape)
    gradient = derivatives.rollout_vjp(model, *inputs, DT, bar).parameters
    own = parameters_of(model)
    terms = own * bar[..., None] * by.d_wrenches
    sizes = np.abs(terms).sum((0, 1))
    assert (
        np.abs(own * gradient - terms.sum((0, 1)))
        <= case.rounding * sizes + 1e-13 * sizes.max()
    ).all()
    if "plain" in name:
        assert (
            gradient[derivatives.parameter_names(model).index("breakaway_ratio")] == 0.0
        )
    *_, chosen = derivatives.rollout_jacobian(model, *inputs, DT, ("v_s", "mu_c"))
    names = derivatives.parameter_names(model)
    places = [names.index("v_s"), names.index("mu_c")]
    assert np.array_equal(chosen, by.d_wrenches[..., places])


@pytest.mark.parametrize(
    "name", ["published published, elasto-plastic", "soft cells", "cells, many"]
)
def test_a_batch_is_a_loop(name):
    case = CASES[name]
    random = np.random.default_rng(8)
    model = case.model
    states = np.stack([drive(case, seed)[0] for seed in range(3)])[:, None]  # [3, 1]
    twists = np.stack([drive(case, seed)[1] for seed in range(2)])  # [2]
    loads = drive(case)[2]
    dt = random.uniform(0.5e-4, 1e-4, T)
    own = parameters_of(model)
    parameters = own * random.uniform(0.9, 1.0, (3, 1, len(own)))
    bar = random.normal(size=(3, 2, T, 3)) * twist_sizes(model)
    end_bar = random.normal(size=(3, 2, *model.state_shape)) * 1e6 / state_sizes(model)
    ends, wrenches = derivatives.rollout(
        model, states, twists, loads, dt, parameters=parameters
    )
    gradient = derivatives.rollout_vjp(
        model, states, twists, loads, dt, bar, end_bar, parameters=parameters
    )
    slopes = derivatives.rollout_jacobian(
        model, states, twists, loads, dt, parameters=parameters
    ).d_wrenches
    assert wrenches.shape == (3, 2, T, 3) and ends.shape == (3, 2, *model.state_shape)
    assert slopes.shape == (3, 2, T, 3, len(own))
    assert [g.shape for g in gradient] == [
        a.shape for a in (states, twists, loads, parameters)
    ]
    total = [np.zeros_like(g) for g in gradient]
    for i, j in np.ndindex(3, 2):
        one = (states[i, 0], twists[j], loads, dt)
        numbers = parameters[i, 0]
        single = derivatives.rollout(model, *one, parameters=numbers)
        # abreast with others a contact is rounded in another order on some processors
        for abreast, lone in (
            (wrenches[i, j], single.wrenches),
            (ends[i, j], single.state),
        ):
            np.testing.assert_allclose(
                abreast, lone, rtol=0.0, atol=1e-12 * np.abs(lone).max()
            )
        alone = derivatives.rollout_vjp(
            model, *one, bar[i, j], end_bar[i, j], parameters=numbers
        )
        for sum_of, where, g in zip(
            total, ((i, 0), j, ..., (i, 0)), alone, strict=True
        ):
            sum_of[where] += g
        by = derivatives.rollout_jacobian(model, *one, parameters=numbers).d_wrenches
        assert np.array_equal(slopes[i, j], by)
    for got, wanted in zip(gradient, total, strict=True):  # sums in another order
        assert got == pytest.approx(wanted, rel=1e-11, abs=1e-12 * np.abs(wanted).max())


@pytest.mark.parametrize(
    "name", ["published ellipsoid, elasto-plastic", "cells, wide, around"]
)
def test_kept_states_and_several_threads_change_nothing(name):
    case = CASES[name]
    model = case.model
    (state, twists, loads) = drive(case, steps=500)
    # 45,000 steps: enough for more than one thread.
    scales = np.linspace(0.5, 1.0, 90)[:, None, None]
    bar = np.ones((500, 3))
    states = derivatives.rollout_states(model, state, scales * twists, loads, DT).states
    kept = derivatives.rollout_vjp(
        model, state, scales * twists, loads, DT, bar, states=states
    )
    again = derivatives.rollout_vjp(model, state, scales * twists, loads, DT, bar)
    for first, second in zip(kept, again, strict=True):
        assert np.array_equal(first, second)
    last = derivatives.rollout_vjp(model, state, scales[-1] * twists, loads, DT, bar)
    # abreast with others it is summed in another order
    np.testing.assert_allclose(
        kept.twist[-1], last.twist, rtol=1e-9, atol=1e-12 * np.abs(last.twist).max()
    )


@pytest.mark.parametrize(
    "name", ["published table, plain", "cells, plain, around", "soft cells, plain"]
)
def test_no_steps_and_one_load_for_all_steps(name):
    case = CASES[name]
    model = case.model
    (state, twists, _) = drive(case)
    end, wrenches = derivatives.rollout(model, state, np.empty((0, 3)), LOAD, DT)
    assert wrenches.shape == (0, 3) and np.array_equal(end, state)
    ones = np.ones(model.state_shape)
    none = np.empty((0, 3))
    nothing = derivatives.rollout_vjp(model, state, none, LOAD, DT, none, ones)
    assert (
        np.array_equal(nothing.state, ones)
        and not nothing.parameters.any()
        and nothing.normal_force == 0.0
    )
    whole, each = (
        derivatives.rollout_vjp(model, state, twists, f, DT, np.ones((T, 3)))
        for f in (1.3, np.full(T, 1.3))
    )
    assert whole.normal_force.shape == ()
    assert float(whole.normal_force) == pytest.approx(
        each.normal_force.sum(), rel=1e-12
    )
