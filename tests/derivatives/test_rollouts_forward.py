"""Changes of rollouts along changes of their inputs: forwards against backwards, differences, kinks, batches."""

import functools

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import derivatives
from tests.support.refusals import refused

PATCH = pf.ContactPatch.from_pressure([[0.0, 3.0, 1.0], [2.0, 5.0, 0.0]], 0.005)
LAW = pf.LuGre(mu_c=0.7, mu_s=1.2, gamma=1.5, elasto_plastic=pf.ElastoPlastic(0.6))
DT, T = 1e-4, 14


@functools.cache
def model_of():
    return pf.ReducedModelPublished(PATCH, LAW, pf.LimitSurfaceTable(PATCH))


def drive(seed=0, shape=(3,)):
    """A state, twists that start, slide, spin and turn back, one step without load, and changes of all of them."""
    random = np.random.default_rng(seed)
    sizes = np.array([1.0, 1.0, 150.0])
    twists = np.cumsum(random.normal(size=(T, 3)), axis=0) * 3e-3 * sizes
    state = random.normal(size=shape) * [3e-7, 3e-7, 2e-9]
    loads = random.uniform(1.0, 3.0, T)
    twists[5] = 0.0
    loads[9] = 0.0
    changes = [
        random.normal(size=shape) * [1e-7, 1e-7, 1e-9],
        random.normal(size=(T, 3)) * 1e-3 * sizes,
    ]
    return (state, twists, loads), [*changes, random.normal(size=T)]


def test_changes_broadcast_with_contacts():
    model = model_of()
    (inputs, changes) = drive(4)
    twists = inputs[1] * np.array([0.5, 1.0, 2.0])[:, None, None]
    found = derivatives.rollout_jvp(
        model,
        inputs[0],
        twists,
        2.0,
        DT,
        derivatives.RolloutTangent(changes[0], 0.0, 1.0),
    )
    assert found.wrenches_dot.shape == (3, T, 3)
    for each, twist in zip(found.wrenches_dot, twists, strict=True):
        tangent = derivatives.RolloutTangent(changes[0], normal_force=np.ones(T))
        alone = derivatives.rollout_jvp(model, inputs[0], twist, 2.0, DT, tangent)
        assert np.array_equal(each, alone.wrenches_dot)
    held = derivatives.rollout_jvp(model, *inputs, DT)
    assert not held.wrenches_dot.any() and not held.state_dot.any()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"twist": np.zeros((T, 2))},
            r"tangent.twist must have shape \[..., 14, 3\], got shape \[14, 2\]",
        ),
        (
            {"parameters": np.zeros(7)},
            r"tangent.parameters must have shape \[..., 12\]",
        ),
        ({"state": [np.nan, 0.0, 0.0]}, "tangent.state must be finite"),
        (
            {"normal_force": np.zeros((4, T)), "state": np.zeros((5, 3))},
            "batch axes must broadcast",
        ),
    ],
)
def test_wrong_changes_are_one_clear_line(changes, message):
    with refused(message):
        derivatives.rollout_jvp(
            model_of(), *drive()[0], DT, derivatives.RolloutTangent(**changes)
        )


def test_ragged_twists_are_one_clear_line():
    with refused(r"^twist must"):
        derivatives.rollout_jvp(model_of(), None, [[], [1.0, None], []], 1.0, 1e-3)
