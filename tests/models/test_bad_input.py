"""Wrong input to a model is refused in one clear line."""

import math

import numpy as np
import pytest

import planarfriction as pf
from tests.support.contacts import FEET, PLAIN
from tests.support.refusals import refused

MODELS = {
    "distributed": pf.DistributedModel(FEET, PLAIN),
    "reduced": pf.ReducedModelPublished(FEET, PLAIN),
}

every_model = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            (np.zeros(4), (0, 0, 0), 1.0),
            r"state must have shape \[..., .*3\], got shape \[4\]",
        ),
        ((0.0, (0, 0, 0), 1.0), "state must have shape"),
        (("soft", (0, 0, 0), 1.0), "state must be an array of numbers, got 'soft'"),
        ((None, (0, 0), 1.0), r"twist must have shape \[..., 3\], got shape \[2\]"),
        ((None, 0.1, 1.0), r"twist must have shape \[..., 3\], got shape \[\]"),
        ((None, ("x", 0, 0), 1.0), "twist must be an array of numbers"),
        ((None, (math.nan, 0, 0), 1.0), "twist must be finite"),
        ((None, (0, 0, 0), -1.0), "normal_force must be >= 0, got -1.0"),
        ((None, (0, 0, 0), math.inf), "normal_force must be finite, got inf"),
        (
            (None, (0, 0, 0), "heavy"),
            "normal_force must be an array of numbers, got 'heavy'",
        ),
        ((None, np.zeros((4, 3)), np.ones(5)), "batch axes must broadcast, got shapes"),
    ],
)
@every_model
def test_wrong_input_gets_one_line(model, arguments, message):
    arguments = (model.rest(), *arguments[1:]) if arguments[0] is None else arguments
    for call in (
        model.rate,
        model.wrench,
        model.jacobians,
        lambda *a: model.step(*a, 1e-3),
    ):
        with refused(message):
            call(*arguments)


@every_model
def test_wrong_states_and_steps(model):
    broken = model.rest()
    broken.flat[1] = math.nan
    with refused("state must be finite"):
        model.step(broken, (1, 0, 0), 1.0, 1e-3)
    for dt, message in (
        (-1e-3, "dt must be >= 0, got -0.001"),
        (math.nan, "dt must be finite"),
        ("now", "dt must be an"),
    ):
        with refused(message):
            model.step(model.rest(), (1, 0, 0), 1.0, dt)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: pf.DistributedModel([1, 2], PLAIN), "patch must be a ContactPatch"),
        (
            lambda: pf.ReducedModelPublished(FEET, 0.5),
            "law must be a friction law of bristles, such as LuGre, got 0.5",
        ),
        (
            lambda: pf.ReducedModelPublished(FEET, PLAIN, surface="table"),
            "surface must be a limit surface, got table",
        ),
        (
            lambda: pf.ReducedModelPublished(FEET, PLAIN, on_load_change="kep"),
            r"did you mean 'keep'",
        ),
        (
            lambda: pf.ReducedModelPublished(pf.ContactPatch.points([(0, 0)]), PLAIN),
            r"patch must have a contact radius > 0 \(more than one point\)",
        ),
    ],
)
def test_wrong_models(call, message):
    with refused(message):
        call()


@every_model
def test_huge_numbers_and_batches_are_refused_before_allocation(model):
    with refused(r"batch axes must hold .* of state, twist, normal_force, dt$"):
        model.step(model.rest(), (1, 0, 0), np.broadcast_to(1.0, (10**5, 10**5)), 1e-3)
    with refused("normal_force must be an array of numbers along at most 16 axes"):
        model.step(model.rest(), (1, 0, 0), np.ones((1,) * 40), 1e-3)
    with refused("twist must be finite"):
        model.step_jacobians(model.rest(), (10**400, 0, 0), 1.0, 1e-3)


@every_model
@pytest.mark.parametrize("truth", [True, False])
def test_a_truth_value_is_no_number_for_one_contact_or_many(model, truth):
    for twist in ((0.01, 0.0, 0.1), np.full((4, 3), 0.01)):
        for wrong in (
            {"normal_force": truth},
            {"dt": truth},
            {"twist": (0.01, truth, 0.1)},
        ):
            given = {
                "state": model.rest(),
                "twist": twist,
                "normal_force": 1.0,
                "dt": 1e-3,
                **wrong,
            }
            with refused("no truth value"):
                model.step(**given)


@every_model
def test_an_empty_batch_has_empty_derivatives(model):
    assert {
        len(slope) for slope in model.jacobians(model.rest(), np.empty((0, 3)), 1.0)
    } == {0}


@pytest.mark.parametrize(
    "wrong",
    [{"wrenches_bar": np.full((5, 3), math.nan)}, {"states": np.full((5, 3), 1e200)}],
)
def test_a_gradient_takes_no_cotangent_that_is_not_finite(wrong):
    inputs = {"wrenches_bar": np.ones((5, 3)), **wrong}
    with refused(next(iter(wrong))):
        pf.derivatives.rollout_vjp(
            MODELS["reduced"], None, np.zeros((5, 3)), 1.0, 1e-3, **inputs
        )
