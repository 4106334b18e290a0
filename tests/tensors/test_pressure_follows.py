"""Steps of JAX whose pressure follows the moments of the load: those of NumPy, with derivatives by the moments."""

import numpy as np
import pytest

import planarfriction as pf

jax = pytest.importorskip("jax", reason="needs the extra [jax]")
import jax.numpy as jnp  # noqa: E402

from planarfriction import jax as front  # noqa: E402
from planarfriction._engine.cells.moment_pressure import FARTHEST, tilt_many  # noqa: E402
from planarfriction.jax.namespace import pressing  # noqa: E402

pytestmark = pytest.mark.jax

LAW = pf.LuGre(mu_c=1.0, mu_s=1.2, elasto_plastic=0.9)
PATCH = pf.ContactPatch.rectangle(0.1, 0.06, 9)
GROOVED = PATCH.with_friction_metric([[2.0, 0.3], [0.3, 1.0]])
KINDS = {
    "distributed": (PATCH, "DistributedModel", {}),
    "few cells with a metric": (GROOVED, "ReducedModel", {}),
    "few cells": (PATCH, "ReducedModel", {"cells": 30}),
    "published": (PATCH, "ReducedModelPublished", {}),
}

QUICK = ("few cells with a metric",)
EACH = [
    pytest.param(kind, marks=() if kind in QUICK else pytest.mark.slow)
    for kind in KINDS
]


@pytest.fixture(autouse=True, scope="module")
def double_precision():
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", before)


@pytest.mark.parametrize("kind", EACH)
def test_steps_and_derivatives_are_those_of_numpy(kind):
    """Derivatives by the moments are those of central differences, as far as the rule is exact: 1e-7 of the patch."""
    patch, name, options = KINDS[kind]
    model, ours = (getattr(end, name)(patch, LAW, **options) for end in (pf, front))
    rng = np.random.default_rng(0)
    load = np.array([1.0, 2.0, 1.5])
    state = 1e-7 * rng.normal(size=(3, *model.state_shape))
    twist = rng.normal(size=(3, 3)) * (0.01, 0.01, 0.1)
    # Kern, beyond it, beyond the edge.
    moments = load[:, None] * np.array([(0.003, -0.005), (0.02, 0.03), (-0.1, 0.0)])
    new, wrench = model.step(state, twist, load, 1e-3, moments=moments)
    step = jax.jit(lambda z, v, f, m: ours.step(z, v, f, 1e-3, moments=m))
    found, pulled = step(state, twist, load, moments)
    np.testing.assert_allclose(found, new, rtol=1e-7, atol=1e-15)
    np.testing.assert_allclose(pulled, wrench, rtol=1e-6, atol=1e-8)

    slopes = jax.jit(jax.jacobian(lambda m: step(state[1], twist[1], load[1], m)[1]))
    h = 1e-6
    held = (state[1], twist[1], load[1], 1e-3)
    ends = [
        [model.step(*held, moments=moments[1] + s * b)[1] for s in (1.0, -1.0)]
        for b in h * np.eye(2)
    ]
    differences = np.stack([(one - other) / (2.0 * h) for one, other in ends], -1)
    np.testing.assert_allclose(
        slopes(jnp.asarray(moments[1])),
        differences,
        rtol=1e-3,
        atol=1e-3 * abs(differences).max(),
    )


def test_cells_press_as_in_the_kernel_however_uneven_their_shares_and_far_the_centre():
    """Some of these need shortened steps: without, 13 of 300 have other cells."""
    rng = np.random.default_rng(1)
    share = rng.exponential(size=(300, 9)) ** 3
    share /= share.sum(1, keepdims=True)
    away = rng.normal(size=(2, 300, 9))
    away -= (away * share).sum(2, keepdims=True)
    away /= np.sqrt((away**2 * share).sum((0, 2)))[:, None]
    centre = rng.normal(size=(300, 2))
    centre *= (FARTHEST * rng.uniform(size=300) / np.hypot(*centre.T))[:, None]
    out = np.empty_like(share)
    tilt_many(*away, share, centre, out)
    narrow = np.zeros((300, 1), bool)
    found = pressing(
        *map(jnp.asarray, (*away, share, centre[:, :1], centre[:, 1:], narrow))
    )
    np.testing.assert_array_equal(found, out > 0.0)
