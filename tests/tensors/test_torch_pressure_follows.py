"""Steps of PyTorch whose pressure follows the moments of the load: those of NumPy, with derivatives by the moments."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.errors import InvalidValueError

torch = pytest.importorskip("torch", reason="needs the extra [torch]")
from planarfriction import torch as front  # noqa: E402

pytestmark = pytest.mark.torch

LAW = pf.LuGre(mu_c=1.0, mu_s=1.2, elasto_plastic=0.9)
PATCH = pf.ContactPatch.rectangle(0.1, 0.06, 9)
GROOVED = PATCH.with_friction_metric([[2.0, 0.3], [0.3, 1.0]])
KINDS = {
    "distributed": (PATCH, "DistributedModel", {}),
    "few cells with a metric": (GROOVED, "ReducedModel", {}),
    "few cells": (PATCH, "ReducedModel", {"cells": 30}),
    "published": (PATCH, "ReducedModelPublished", {}),
}
LOAD = np.array([1.0, 2.0, 1.5])
# Kern, beyond it, beyond the edge.
MOMENTS = LOAD[:, None] * np.array([(0.003, -0.005), (0.02, 0.03), (-0.1, 0.0)])


def drawn(model):
    rng = np.random.default_rng(0)
    return 1e-7 * rng.normal(size=(3, *model.state_shape)), rng.normal(size=(3, 3)) * (
        0.01,
        0.01,
        0.1,
    )


def models(kind):
    patch, name, options = KINDS[kind]
    return getattr(pf, name)(patch, LAW, **options), getattr(front, name)(
        patch, LAW, dtype=torch.float64, **options
    )


def tensors(*arrays):
    return [torch.tensor(each, dtype=torch.float64) for each in arrays]


@pytest.mark.parametrize("kind", KINDS)
def test_steps_rates_and_wrenches_are_those_of_numpy(kind):
    model, ours = models(kind)
    inputs = (*drawn(model), LOAD)
    at = tensors(*inputs)
    held = torch.tensor(MOMENTS)
    ends = (
        *zip(
            ours.step(*at, 1e-3, moments=held),
            model.step(*inputs, 1e-3, moments=MOMENTS),
            strict=True,
        ),
        (ours.rate(*at, moments=held), model.rate(*inputs, moments=MOMENTS)),
        (ours.wrench(*at, moments=held), model.wrench(*inputs, moments=MOMENTS)),
        (ours(*at, moments=held)[1], model.wrench(*inputs, moments=MOMENTS)),
    )
    for found, expected in ends:
        scale = np.abs(expected).max()
        np.testing.assert_allclose(
            found.detach()[0], expected[0], rtol=1e-10, atol=1e-10 * scale
        )
        # An edge: see SOFTNESS.
        np.testing.assert_allclose(
            found.detach(), expected, rtol=1e-7, atol=1e-7 * scale
        )


@pytest.mark.parametrize("kind", KINDS)
def test_gradients_are_differences(kind):
    """In the kern and beyond it; by twist, load and moments, in both directions and through `vmap`."""
    model, ours = models(kind)
    state, twist = (torch.tensor(each[:2]) for each in drawn(model))
    numbers = [
        each.requires_grad_()
        for each in (twist, torch.tensor(LOAD[:2]), torch.tensor(MOMENTS[:2]))
    ]

    def pulled(twist, load, moments):
        return ours.step(state, twist, load, 1e-3, moments=moments)[1]

    assert torch.autograd.gradcheck(
        pulled, numbers, eps=1e-7, atol=1e-3, rtol=1e-3, check_forward_ad=True
    )
    one = torch.func.vmap(
        torch.func.jacrev(
            lambda z, v, f, m: ours.step(z, v, f, 1e-3, moments=m)[1], argnums=3
        )
    )
    found = one(state, *numbers)
    both = torch.func.jacrev(pulled, argnums=2)(*numbers)
    for i in range(2):
        torch.testing.assert_close(found[i], both[i, :, i], rtol=1e-9, atol=1e-12)


def test_trainable_weights_see_the_moments():
    ours = front.DistributedModel(
        PATCH, LAW, trainable=("mu_c", "weights"), dtype=torch.float64
    )
    state, twist = (torch.tensor(each[0]) for each in drawn(ours))
    wrench = ours.step(state, twist, 1.0, 1e-3, moments=(0.003, -0.005))[1]
    (by,) = torch.autograd.grad(wrench[2], [ours.raw_weights])
    h = 1e-5
    place = 7
    ends = []
    for side in (1.0, -1.0):
        with torch.no_grad():
            ours.raw_weights[place] += side * h
            ends.append(
                ours.step(state, twist, 1.0, 1e-3, moments=(0.003, -0.005))[1][2]
            )
            ours.raw_weights[place] -= side * h
    assert float(by[place]) == pytest.approx(
        float(ends[0] - ends[1]) / (2.0 * h), rel=1e-5
    )


def test_moments_that_do_not_fit_are_refused():
    ours = models("distributed")[1]
    for bad in (0.0, (0.0, np.inf), np.zeros((7, 2))):
        with pytest.raises(InvalidValueError):
            ours.step(ours.rest(3), torch.zeros(3, 3), 1.0, 1e-3, moments=bad)
