"""Numbers at both ends: too slow to be squared, up to the largest that is taken, and beyond."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import derivatives
from planarfriction.formulas import LARGEST
from tests.support.contacts import ELASTIC, FOUR, PLAIN
from tests.support.refusals import refused

LAWS = {"plain": PLAIN, "elasto-plastic": ELASTIC}
KINDS = {
    "distributed": pf.DistributedModel,
    "reduced": lambda patch, law: pf.ReducedModel(patch, law),
    "published": pf.ReducedModelPublished,
}
DIRECTIONS = np.array(
    [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.3, -0.7, 0.5], [-8e-4, -2e-3, -1.0]]
)
SPEEDS = [
    5e-324,
    1e-310,
    1e-300,
    1e-200,
    2e-162,
    1e-161,
    1e-160,
    1e-158,
    1e-155,
    1e-150,
    1e-101,
    1e-100,
    1e-50,
]

every_model = pytest.mark.parametrize(
    "model",
    [(kind, law) for kind in KINDS for law in LAWS],
    ids="-".join,
    indirect=True,
)


@pytest.fixture(scope="module")
def model(request):
    """A model of a law."""
    kind, law = request.param
    return KINDS[kind](FOUR, LAWS[law])


def results(model, state, twist, load, dt):
    """All that a model says of a batch."""
    yield from model.step(state, twist, load, dt)
    yield from model.step_jacobians(state, twist, load, dt)
    yield from (model.rate(state, twist, load), model.wrench(state, twist, load))
    yield from model.jacobians(state, twist, load)


def states(model):
    """At rest, and bent in all directions by more or less."""
    one = np.sin(1.0 + np.arange(model.rest().size)).reshape(model.state_shape)
    return [model.rest(), *(size * one for size in (1e-320, 1e-160, 1e-8, 1e-6, 1.0))]


@every_model
@pytest.mark.parametrize("speed", SPEEDS)
def test_slow_twists_give_numbers(model, speed):
    """Squares of speeds below 1e-154 m/s leave the range of numbers: 135 of these Jacobians held NaN."""
    for state in states(model):
        batch = np.broadcast_to(state, (len(DIRECTIONS), *state.shape)).copy()
        for load, dt in ((1.0, 1e-3), (0.0, 10.0), (1e-300, 1e-300), (1.0, 1e40)):
            assert all(
                np.isfinite(part).all()
                for part in results(model, batch, DIRECTIONS * speed, load, dt)
            )


@every_model
@pytest.mark.parametrize("large", [1e10, 1e20, 1e30, 1e40, LARGEST])
def test_large_numbers_give_numbers(model, large):
    """All together, which slip by 1e100 m in a step."""
    for state in (*states(model), large * states(model)[-1]):
        batch = np.broadcast_to(state, (len(DIRECTIONS), *state.shape)).copy()
        for speed in (1e-3, large):
            for load, dt in ((1.0, 1e-3), (large, 1e-3), (1.0, large), (large, large)):
                assert all(
                    np.isfinite(part).all()
                    for part in results(model, batch, DIRECTIONS * speed, load, dt)
                )


@every_model
@pytest.mark.parametrize("name", ["state", "twist", "normal_force", "dt"])
@pytest.mark.parametrize("value", [1.01 * LARGEST, 1e200, 1.7e308])
def test_larger_ones_are_refused(model, name, value):
    given = {
        "state": model.rest(),
        "twist": np.ones(3),
        "normal_force": 1.0,
        "dt": 1e-3,
    }
    given[name] = given[name] + value
    sequence = {**given, "twist": np.tile(given["twist"], (4, 1))}
    calls = [
        lambda: model.step(**given),
        lambda: model.step_jacobians(**given),
        lambda: derivatives.rollout(model, **sequence),
    ]
    for call in calls:
        with refused(rf"{name} must be between -1e\+50 and 1e\+50"):
            call()
