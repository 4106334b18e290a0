"""The passes of a step of cells: the adjoint against changes forwards, which one long function computes."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.derivatives import (
    RolloutTangent,
    parameters_of,
    rollout_jvp,
    rollout_vjp,
)

LAWS = {
    "early breakaway": pf.LuGre(
        mu_c=0.8, mu_s=1.1, v_s=2e-3, elasto_plastic=pf.ElastoPlastic(0.3)
    ),
    "late breakaway, other exponent": pf.LuGre(
        mu_c=0.8, mu_s=1.1, gamma=1.3, elasto_plastic=pf.ElastoPlastic(0.9)
    ),
    "plain": pf.LuGre(mu_c=0.8, mu_s=1.1, elasto_plastic=None),
}
STEPS = 12


@pytest.mark.parametrize(
    "dt", [2e-5, 3e-4, 1e-2], ids=["short steps", "steps of a deflection", "long steps"]
)
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_the_adjoint_is_the_transpose_of_changes_forwards(law, dt):
    """Cells stick, slip in part and slide: `bar . (J x) = (J' bar) . x` for the change of each input alone."""
    draw = np.random.default_rng(3)
    model = pf.DistributedModel(pf.ContactPatch.disc(0.01, cells=9), law)
    count = len(model.patch.positions)
    state = draw.normal(scale=6e-7, size=(2, count))
    twists = draw.normal(scale=(2e-3, 2e-3, 0.3), size=(STEPS, 3))
    loads = draw.uniform(1.0, 3.0, STEPS)
    numbers = parameters_of(model)
    loads[5] = 0.0
    bar = draw.normal(size=(STEPS, 3)) * [1.0, 1.0, 100.0]
    end_bar = draw.normal(size=state.shape) * 1e5
    back = rollout_vjp(model, state, twists, loads, dt, bar, end_bar)
    changes = RolloutTangent(
        draw.normal(size=state.shape) * 1e-7, draw.normal(size=twists.shape) * 1e-3,
        draw.normal(size=STEPS) * (loads > 0.0), draw.normal(size=len(numbers)) * numbers,
    )  # fmt: skip
    for name, change, gradient in zip(
        RolloutTangent._fields, changes, back, strict=True
    ):
        forth = rollout_jvp(
            model, state, twists, loads, dt, RolloutTangent(**{name: change})
        )
        products = bar * forth.wrenches_dot, end_bar * forth.state_dot
        size = sum(np.abs(each).sum() for each in products)
        assert (
            abs(sum(each.sum() for each in products) - np.vdot(gradient, change))
            < 1e-10 * size
        ), name
