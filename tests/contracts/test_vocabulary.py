"""One vocabulary: the same names and arguments in every front end."""

import inspect

import pytest

import planarfriction as pf

MODELS = ("DistributedModel", "ReducedModel", "ReducedModelPublished")
ARGUMENTS = ["state", "twist", "normal_force", "dt"]


def front_ends():
    """NumPy, PyTorch and JAX."""
    pytest.importorskip(
        "torch", reason="needs PyTorch: pip install 'planarfriction[torch]'"
    )
    pytest.importorskip("jax", reason="needs the extra [jax]")
    import planarfriction.jax
    import planarfriction.torch

    return [pf, planarfriction.torch, planarfriction.jax]


def positional(function):
    """Names of the arguments that may be given by their place."""
    kinds = inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD
    return [
        name
        for name, of in inspect.signature(function).parameters.items()
        if of.kind in kinds
    ]


@pytest.mark.torch
@pytest.mark.jax
def test_every_front_end_has_the_same_models_methods_and_arguments():
    ends = front_ends()
    for name in MODELS:
        for model in (getattr(end, name) for end in ends):
            assert positional(model)[:2] == ["patch", "law"], model
            assert (
                positional(model.rate)
                == positional(model.wrench)
                == ["self", *ARGUMENTS[:-1]]
            ), model
            assert positional(model.step) == ["self", *ARGUMENTS], model
        _, torch, jax = (positional(getattr(end, name)) for end in ends)
        assert torch == jax, name


@pytest.mark.torch
@pytest.mark.jax
def test_rollouts_share_their_arguments_and_first_results():
    ends = front_ends()
    for end in ends:
        assert positional(end.rollout) == ["model", *ARGUMENTS], end
        assert (
            inspect.signature(end.rollout).parameters["parameters"].default is None
        ), end
        results = inspect.signature(end.rollout).return_annotation
        assert results.split("[")[0] == "Rollout", end
    assert positional(ends[1].tracking_loss) == ["model", *ARGUMENTS, "wrenches"]
    for rollout in (pf.derivatives.Rollout, ends[1].Rollout, ends[2].Rollout):
        assert rollout._fields == ("state", "wrenches")
    for function in (
        pf.derivatives.rollout_states,
        pf.derivatives.rollout_vjp,
        pf.derivatives.rollout_jacobian,
    ):
        assert positional(function)[:5] == ["model", *ARGUMENTS], function
    assert pf.derivatives.RolloutVJP._fields == (*ARGUMENTS[:-1], "parameters")
    for end in ends[1:]:
        assert not hasattr(end, "simulate")  # that is for scenes
        assert {"parameters", "method"} <= set(
            inspect.signature(end.rollout).parameters
        )
