"""Steps whose pressure follows the moments of the load."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.coupling import CoupledPatches, HostStep
from planarfriction.errors import InvalidValueError
from tests.support.contacts import SOFT, lengths
from tests.support.differences import assert_step_jacobians
from tests.support.refusals import refused

LAW = pf.LuGre(mu_c=1.0, mu_s=1.2, elasto_plastic=0.9)
PATCH = pf.ContactPatch.rectangle(0.1, 0.06, 9)
LEANING = PATCH.with_friction_metric(np.diag([2.0, 1.0]), asymmetry=(0.1, 0.0))
MODELS = {
    "distributed": pf.DistributedModel(PATCH, LAW),
    "reduced": pf.ReducedModel(PATCH, LAW),
    "published": pf.ReducedModelPublished(PATCH, LAW),
    "leaning": pf.DistributedModel(LEANING, LAW),
    "soft distributed": pf.DistributedModel(SOFT, LAW),
    "soft reduced": pf.ReducedModel(SOFT, LAW),
    "soft published": pf.ReducedModelPublished(
        SOFT, LAW, pf.LimitSurfaceTablePublished(SOFT, normal_force=2.0)
    ),
}


@pytest.fixture(params=MODELS)
def model(request):
    return MODELS[request.param]


def moments_at(centre, load):
    x, y = np.moveaxis(np.asarray(centre), -1, 0)
    return np.asarray(load)[..., None] * np.stack([y, -x], -1)


@pytest.mark.parametrize("load", [1e-20, 1e-61, 1e-300, 5e-324])
def test_moments_of_hardly_any_load_give_numbers(model, load):
    """Its centre lies further away than any patch: one that moves as a whole went to 1e99 m, then to infinity."""
    state = model.rest()
    for _ in range(2):
        state, wrench = model.step(
            state, (0.005, 0.002, 0.5), load, 1e-3, moments=(1e-3, -2e-3)
        )
        assert (np.abs(state) < 1e50).all() and (np.abs(wrench) < 1e50).all()


def test_translation_pulls_at_the_centre_of_pressure(model):
    """Friction of a translation acts at the centre of pressure: within the kern and beyond it."""
    size = model.patch.positions.max()
    for share in ((0.1, 0.0), (0.3, -0.2), (0.5, 0.4)):
        x, y = size * np.array(share)
        fx, fy, tau = model.step(
            model.rest(), (0.1, 0.05, 0.0), 2.0, 1.0, moments=(2.0 * y, -2.0 * x)
        )[1]
        assert tau == pytest.approx(x * fy - y * fx, rel=1e-6)


def test_moments_of_the_patchs_own_pressure_change_nothing(model):
    rng = np.random.default_rng(1)
    load = np.array([1.0, 2.0, 3.0])
    twist = rng.normal(size=(3, 3)) * (0.1, 0.1, 1.0)
    own = moments_at(model.patch.centre_of_pressure(load), load)
    state, wrench = model.step(model.rest(), twist, load, 1e-2)
    new, pulled = model.step(model.rest(), twist, load, 1e-2, moments=own)
    np.testing.assert_allclose(new, state, rtol=1e-12)
    np.testing.assert_allclose(pulled, wrench, rtol=1e-12, atol=1e-14)


def test_bristles_of_cells_are_kept_when_the_pressure_moves():
    model = MODELS["distributed"]
    rng = np.random.default_rng(2)
    state = 1e-7 * rng.normal(size=model.state_shape)
    twist = (1e-3, -2e-3, 0.1)
    new, _ = model.step(state, twist, 2.0, 1e-3)
    moved, _ = model.step(state, twist, 2.0, 1e-3, moments=(0.05, -0.03))
    np.testing.assert_array_equal(moved, new)


def test_jacobians_are_those_of_differences_at_the_moments(model):
    rng = np.random.default_rng(4)
    load = np.array([1.0, 2.0])
    dt = 1e-3
    state = 1e-7 * rng.normal(size=(2, *model.state_shape))
    twist = rng.normal(size=(2, 3)) * (1e-3, 1e-3, 1e-2)
    moments = 0.2 * model.patch.positions.max() * rng.normal(size=(2, 2))
    by_twist = np.array([1e-9, 1e-9, 1e-8])
    for i in range(2):
        assert_step_jacobians(
            model, state[i], twist[i], load[i], dt, 1e-11 * lengths(model), by_twist,
            1e-5, moments=moments[i],
        )  # fmt: skip


def test_rates_go_where_short_steps_go(model):
    state = 1e-7 * np.ones(model.state_shape)
    twist = (1e-3, -2e-3, 0.02)
    moments = (0.3e-2, -0.2e-2)
    dt = 1e-9
    new, wrench = model.step(state, twist, 2.0, dt, moments=moments)
    np.testing.assert_allclose(
        model.rate(state, twist, 2.0, moments=moments),
        (new - state) / dt,
        rtol=1e-3,
        atol=1e-6,
    )
    np.testing.assert_allclose(
        model.wrench(state, twist, 2.0, moments=moments), wrench, rtol=1e-3, atol=1e-6
    )


def test_friction_takes_energy_while_the_pressure_moves(model):
    """Sliding back and forth with a pressure that wanders over the patch and its edges, friction never drives.

    What it has taken may fall only by what bristles store, `mu_s^2 f_N / (2 sigma_0)`, at the reversals.
    """
    time = np.arange(4000) * 1e-3
    load = 2.0
    dt = 1e-3
    twist = np.stack(
        [
            0.02 * np.sin(3.0 * time),
            0.03 * np.cos(2.0 * time),
            2.0 * np.sin(5.0 * time),
        ],
        -1,
    )
    centre = (
        1.2
        * model.patch.positions.max()
        * np.stack([np.sin(7.0 * time), np.cos(11.0 * time)], -1)
    )
    state = model.rest()
    taken = [0.0]
    for v, moments in zip(
        twist, moments_at(centre, np.full(len(time), load)), strict=True
    ):
        state, wrench = model.step(state, v, load, dt, moments=moments)
        taken.append(taken[-1] - wrench @ v * dt)
    stored = 1.2**2 * load / (2.0 * LAW.sigma_0)
    assert (np.maximum.accumulate(taken) - taken).max() < stored
    assert taken[-1] > 0.05  # J: 4 s at some 4 cm/s


def test_coupled_patches_follow_by_the_same_rule():
    """The wrenches of a coupled step are those of the models' own steps at the twists, loads and moments."""
    models = [
        MODELS[name] for name in ("distributed", "reduced", "leaning", "published")
    ]
    patches = CoupledPatches(models)
    rng = np.random.default_rng(5)
    twist = rng.normal(size=(4, 3)) * (0.01, 0.01, 0.1)
    load = rng.uniform(1.0, 3.0, 4)
    moments = 0.03 * rng.normal(size=(4, 2))
    host = HostStep(
        twist,
        load,
        np.zeros((4, 3)),
        np.diag(np.tile([1e-3, 1e-3, 1.0], 4)),
        moments=moments,
    )
    step = patches.step(patches.rest(), host, 1e-3)
    assert step.converged
    for p, model in enumerate(models):
        new, wrench = model.step(
            model.rest(), step.twist[p], step.normal_force[p], 1e-3, moments=moments[p]
        )
        np.testing.assert_allclose(step.wrench[p], wrench, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(
            patches.states(step.state)[p], new, rtol=1e-9, atol=1e-18
        )


def test_a_coupled_patch_without_cells_refuses_moments_of_loads():
    patches = CoupledPatches([MODELS["soft published"]])
    host = HostStep(
        np.zeros((1, 3)),
        np.ones(1),
        np.zeros((1, 3)),
        np.eye(3),
        moments=np.zeros((1, 2)),
    )
    with refused("moments"):
        patches.step(patches.rest(), host, 1e-3)


def test_moments_of_another_shape_or_not_finite_are_refused(model):
    for bad in ((0.0,), (0.0, np.inf), np.zeros((7, 2))):
        with pytest.raises(InvalidValueError):
            model.step(
                np.broadcast_to(model.rest(), (3, *model.state_shape)),
                np.zeros((3, 3)),
                1.0,
                1e-3,
                moments=bad,
            )
