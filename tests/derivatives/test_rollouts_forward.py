"""Changes of roll-outs along changes of their inputs: forwards against backwards, differences, kinks, batches."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import derivatives
from planarfriction.errors import InvalidValueError

PATCH = pf.ContactPatch.from_pressure([[0.0, 3.0, 1.0], [2.0, 5.0, 0.0]], 0.005)
LAW = pf.LuGre(mu_c=0.7, mu_s=1.2, gamma=1.5, elasto_plastic=pf.ElastoPlastic(0.6))
DT, T = 1e-4, 14

every_model = pytest.mark.parametrize("kind", ["reduced", "parts", "published"])


@functools.cache
def model_of(kind: str):
    if kind != "published":
        return pf.ReducedModel(PATCH, LAW, parts=2 if kind == "parts" else 1, segments=8, speeds=8)
    return pf.ReducedModelPublished(PATCH, LAW, pf.LimitSurfaceTable(PATCH))


def drive(seed: int = 0, shape: tuple[int, ...] = (3,)):
    """A state, twists that start, slide, spin and turn back, one step without load, and changes of all of them."""
    random = np.random.default_rng(seed)
    sizes = np.array([1.0, 1.0, 150.0])
    twists = np.cumsum(random.normal(size=(T, 3)), axis=0) * 3e-3 * sizes
    state, loads = random.normal(size=shape) * [3e-7, 3e-7, 2e-9], random.uniform(1.0, 3.0, T)
    twists[5], loads[9] = 0.0, 0.0
    changes = [random.normal(size=shape) * [1e-7, 1e-7, 1e-9], random.normal(size=(T, 3)) * 1e-3 * sizes]
    return (state, twists, loads), [*changes, random.normal(size=T)]


@every_model
def test_forwards_is_the_transpose_of_backwards(kind):
    """`<bar, J x> = <J' bar, x>` for changes x of all inputs."""
    model, random = model_of(kind), np.random.default_rng(3)
    inputs, changes = drive(1, model.state_shape)
    parameters = derivatives.parameters_of(model)
    changes.append(parameters * random.normal(size=len(parameters)))
    bar = random.normal(size=(T, 3)) * [1.0, 1.0, 150.0]
    end_bar = random.normal(size=model.state_shape) * [1e6, 1e6, 1e8]
    found = derivatives.rollout_jvp(model, *inputs, DT, derivatives.RolloutTangent(*changes))
    plain = derivatives.rollout(model, *inputs, DT)
    assert found.wrenches == pytest.approx(plain.wrenches, rel=1e-11, abs=1e-13)  # sums in another order
    assert found.state == pytest.approx(plain.state, rel=1e-11, abs=1e-20)
    gradient = derivatives.rollout_vjp(model, *inputs, DT, bar, end_bar)
    forwards = [*(bar * found.wrenches_dot).ravel(), *(end_bar * found.state_dot).ravel()]
    backwards = [*np.concatenate([(g * x).ravel() for g, x in zip(gradient, changes, strict=True)])]
    assert sum(forwards) == pytest.approx(sum(backwards), abs=1e-11 * np.abs(forwards + backwards).sum())


@every_model
def test_changes_of_parameters_are_the_sensitivities(kind):
    model = model_of(kind)
    inputs, _ = drive(2, model.state_shape)
    by = derivatives.rollout_jacobian(model, *inputs, DT, ["mu_c", "sigma_1"]).d_wrenches
    places = [derivatives.parameter_names(model).index(name) for name in ("mu_c", "sigma_1")]
    directions = np.eye(len(derivatives.parameter_names(model)))[places]  # a batch of two
    found = derivatives.rollout_jvp(model, *inputs, DT, derivatives.RolloutTangent(parameters=directions))
    assert found.wrenches_dot.shape == (2, T, 3) and found.state_dot.shape == (2, *model.state_shape)
    assert found.wrenches_dot == pytest.approx(np.moveaxis(by, -1, 0), rel=1e-11, abs=1e-13)


def test_changes_broadcast_with_contacts():
    model, (inputs, changes) = model_of("reduced"), drive(4)
    twists = inputs[1] * np.array([0.5, 1.0, 2.0])[:, None, None]
    found = derivatives.rollout_jvp(model, inputs[0], twists, 2.0, DT, derivatives.RolloutTangent(changes[0], 0.0, 1.0))
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
        ({"twist": np.zeros((T, 2))}, r"tangent.twist must have shape \[..., 14, 3\], got shape \[14, 2\]"),
        ({"parameters": np.zeros(12)}, r"tangent.parameters must have shape \[..., 7\]"),
        ({"state": [np.nan, 0.0, 0.0]}, "tangent.state must be finite"),
        ({"normal_force": np.zeros((4, T)), "state": np.zeros((5, 3))}, "batch axes must broadcast"),
    ],
)
def test_wrong_changes_are_one_clear_line(changes, message):
    with pytest.raises(InvalidValueError, match=message) as caught:
        derivatives.rollout_jvp(model_of("reduced"), *drive()[0], DT, derivatives.RolloutTangent(**changes))
    assert "\n" not in str(caught.value)


def test_ragged_twists_are_one_clear_line():
    with pytest.raises(InvalidValueError, match=r"^twist must") as caught:
        derivatives.rollout_jvp(model_of("reduced"), None, [[], [1.0, None], []], 1.0, 1e-3)
    assert "\n" not in str(caught.value)
