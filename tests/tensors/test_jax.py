"""JAX: closed forms, finite derivatives at kinks, agreement with NumPy, the kernels and central differences."""

import functools
import importlib
import importlib.util
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction.errors import MissingExtraError
from tests.support.refusals import refused
from tests.support.repository import script

jax = pytest.importorskip("jax", reason="needs the extra [jax]")
import jax.numpy as jnp  # noqa: E402
from jax.extend.core import jaxprs_in_params  # noqa: E402

import planarfriction.jax as pj  # noqa: E402
from planarfriction.jax.namespace import pressing, xp  # noqa: E402
from planarfriction.tensors import surfaces  # noqa: E402

pytestmark = pytest.mark.jax

PLAIN = pf.LuGre(mu_s=1.2, gamma=1.0)
ELASTIC = pf.LuGre(mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.9))
WIDE = pf.LuGre(mu_s=1.2, gamma=1.5, elasto_plastic=pf.ElastoPlastic(0.3))
"""A wide elasto-plastic range: smooth for central differences."""
LAWS = {"plain": PLAIN, "elasto-plastic": ELASTIC, "wide": WIDE}
SURFACES = {
    "cells": pf.LimitSurfaceCells,
    "table": pf.LimitSurfaceTable,
    "published": pf.LimitSurfaceTablePublished,
    "ellipsoid": pf.LimitSurfaceEllipsoid,
}
PATCH = pf.ContactPatch.from_pressure([[0.0, 3.0, 1.0], [2.0, 5.0, 0.0]], 0.005)

every_surface = pytest.mark.parametrize("kind", SURFACES)
every_model = pytest.mark.parametrize("kind", [*SURFACES, "distributed"])


@pytest.fixture(autouse=True, scope="module")
def double_precision():
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    pairs.cache_clear()
    yield
    jax.config.update("jax_enable_x64", before)


@functools.cache
def pairs(kind, law):
    """The same model in NumPy and in JAX."""
    if kind == "distributed":
        return pf.DistributedModel(PATCH, LAWS[law]), pj.DistributedModel(
            PATCH, LAWS[law]
        )
    surface = SURFACES[kind](PATCH)
    return pf.ReducedModelPublished(
        PATCH, LAWS[law], surface=surface
    ), pj.ReducedModelPublished(PATCH, LAWS[law], surface)


def states(model, count, seed=0):
    """States around the largest deflection, some at rest."""
    state = np.random.default_rng(seed).normal(size=(count, *model.state_shape)) * 8e-7
    if model.state_shape == (3,):
        state[:, 2] *= model.surface.contact_radius
    state[::7] = 0.0
    return state


def twists(count, seed=0):
    """Twists around the Stribeck speed; some at rest, pure spins, pure slides, and along the axes."""
    twist = np.random.default_rng(seed).normal(size=(count, 3)) * (1e-3, 1e-3, 0.3)
    twist[0] = 0.0
    twist[1:5, :2] = 0.0
    twist[5:9, 2] = 0.0
    twist[9:12, 0] = 0.0
    twist[12:15, 1:] = 0.0
    return twist


def sway(count, dt, omega=0.3):
    """A motion to and fro, with spin, that sticks and slides and is never at rest."""
    t = np.arange(count) * dt
    return np.stack(
        [
            2e-3 * np.sin(300.0 * t) + 1e-4,
            1e-3 * np.cos(200.0 * t),
            omega * np.sin(150.0 * t) + 0.02,
        ],
        axis=-1,
    )


def close(actual, expected, tolerance=1e-12):
    """Each component to `tolerance` of its largest value."""
    expected = np.asarray(expected)
    scale = np.abs(expected).max(axis=tuple(range(expected.ndim - 1)))
    assert np.asarray(actual).shape == expected.shape
    assert (np.abs(np.asarray(actual) - expected) <= tolerance * scale).all()


# ---------------------------------------------------------------------- closed forms


def test_steady_sliding_depends_on_mu_c_and_the_load_alone():
    # Far above v_s: f = -(mu_c + sigma_2 v) f_N, and the shape of the patch has no say in a slide.
    model = pairs("table", "elasto-plastic")[1]
    speed = 0.05
    load = 2.0

    def force(parameters, twist, load):
        slide = jnp.tile(twist, (20, 1))
        return pj.rollout(
            model.replace(parameters=parameters), None, slide, load, 1e-2
        ).wrenches[-1, 0]

    slopes = jax.jit(jax.grad(force, argnums=(0, 1, 2)))(
        model.parameters, jnp.array([speed, 0.0, 0.0]), load
    )
    by_parameter = slopes[0]._asdict()
    # Rounding and what is left of the transient.
    assert by_parameter.pop("mu_c") == pytest.approx(-load, rel=1e-9)
    assert by_parameter.pop("sigma_2") == pytest.approx(-speed * load, rel=1e-9)
    assert slopes[1][0] == pytest.approx(-0.2 * load, rel=1e-9)
    assert slopes[2] == pytest.approx(-(1.0 + 0.2 * speed), rel=1e-9)
    sizes = model.parameters._asdict()
    for (
        name,
        slope,
    ) in by_parameter.items():  # relative sensitivities; of |h| only rounding is left
        assert abs(slope * sizes[name]) < 1e-9, name


def test_a_stuck_contact_is_a_spring():
    # Elasto-plastic and far from breakaway: f = -(sigma_0 x + (sigma_1 + sigma_2) v) f_N, whatever mu is.
    model = pairs("ellipsoid", "elasto-plastic")[1]
    load = 2.0
    dt = 1e-4
    count = 100
    slow = np.tile([1e-5, 0.0, 0.0], (count, 1))

    def force(parameters):
        return pj.rollout(
            model.replace(parameters=parameters), None, slow, load, dt
        ).wrenches[-1, 0]

    slopes = jax.jit(jax.grad(force))(model.parameters)
    assert slopes.sigma_0 == pytest.approx(-1e-5 * count * dt * load, rel=1e-12)
    assert slopes.sigma_1 == pytest.approx(-1e-5 * load, rel=1e-12)
    # what a factor of zero leaves of rounding
    assert max(abs(slopes.mu_c), abs(slopes.mu_s), abs(slopes.v_s / 1e3)) < 1e-15


def test_wrench_is_linear_in_the_weights_of_the_cells():
    numpy_model, model = pairs("distributed", "wide")
    state = states(numpy_model, 1, seed=3)[0] + 1e-7
    twist = twists(20)[-1]

    @jax.jit
    @jax.jacobian
    def slope(weights):
        return model.replace(weights=weights).wrench(state, twist, 2.0)

    slopes = slope(model.weights)
    close(slopes @ model.weights, numpy_model.wrench(state, twist, 2.0))


# ---------------------------------------------------------------------- agreement


@every_model
@pytest.mark.parametrize("law", LAWS)
def test_forward_values_are_those_of_numpy(kind, law):
    numpy_model, model = pairs(kind, law)
    count = 200
    z = states(numpy_model, count)
    twist = twists(count)
    load = np.random.default_rng(1).uniform(0.0, 2.0, count)
    load[5::9] = 0.0
    close(jax.jit(pj.rate)(model, z, twist, load), numpy_model.rate(z, twist, load))
    close(jax.jit(pj.wrench)(model, z, twist, load), numpy_model.wrench(z, twist, load))
    step = jax.jit(pj.step)
    for dt in (1e-6, 1e-4, 1e-2):
        for actual, expected in zip(
            step(model, z, twist, load, dt),
            numpy_model.step(z, twist, load, dt),
            strict=True,
        ):
            close(actual, expected)


EDGES = [
    [x, y, s]
    for x in (-1.0, 0.0, 1.0)
    for y in (-1.0, 0.0, 1.0)
    for s in (-1.0, -0.0, 0.0, 1.0)
]
NEAR_THE_AXIS = [[1e-6, 0.0, 1.0], [2e-6, -1e-6, -1.0], [-1e-7, 1e-9, -1.0]]


@every_surface
def test_derivative_of_sliding_is_that_of_the_kernel(kind):
    numpy_model, model = pairs(kind, "plain")
    surface = model.surface
    sliding = functools.partial(
        surfaces.sliding, xp, surface.kind, surface.size, surface.data
    )
    slope = jax.jit(
        jax.vmap(jax.jacrev(lambda twist: sliding(twist, xp.norm(twist, -1))))
    )
    scaled = np.concatenate([twists(60)[20:] * (1.0, 1.0, 0.005), EDGES, NEAR_THE_AXIS])
    speed = np.linalg.norm(scaled, axis=-1)
    wanted = np.tile(np.eye(3), (len(scaled), 1, 1))  # at rest
    units = scaled[speed > 0.0] / speed[speed > 0.0, None]
    along = np.einsum("mi,mj->mij", numpy_model.surface.direction(units), units)
    wanted[speed > 0.0] = numpy_model.surface.direction_slope(units) + along
    assert np.abs(slope(scaled) - wanted).max() < 1e-11


# ---------------------------------------------------------------------- kinks


def hard(model):
    """Twists and loads that meet every kink: rest, no load, edges and corners of table cells, steady sliding."""
    x = 0.0
    y = 0.0
    r = 0.005
    if isinstance(model, pj.ReducedModelPublished):
        x, y, r = (
            float(getattr(model.parameters, name))
            for name in ("centre_x", "centre_y", "contact_radius")
        )
    edges = np.array([*EDGES, *NEAR_THE_AXIS]) * (1.0, 1.0, 1.0 / r)
    # These twists are scaled ones about the centre of pressure.
    edges[:, :2] += edges[:, 2:] * (
        y,
        -x,
    )
    slide = np.tile([0.05, 0.0, 0.0], (20, 1))
    motion = np.concatenate(
        [1e-3 * edges, np.zeros((3, 3)), 1e-200 * edges, 5e-4 * edges, slide]
    )
    loads = np.ones(len(motion))
    loads[:-20:5] = 0.0
    return motion, loads


@pytest.mark.parametrize(
    ("kind", "law"), [("distributed", "plain"), ("distributed", "elasto-plastic")]
)
def test_gradients_are_finite_at_kinks(kind, law):
    model = pairs(kind, law)[1]

    def loss(model, state, motion, loads):
        run = pj.rollout(model, state, motion, loads, 1e-4)
        return run.wrenches.sum() + run.state.sum()

    # Largest deflection of a slide far above v_s.
    full = jnp.zeros_like(model.rest()).at[0].set(1e-6)
    gradient = jax.jit(jax.grad(loss, argnums=(0, 1, 2, 3)))
    for state in (model.rest(), full):
        for part in jax.tree.leaves(gradient(model, state, *hard(model))):
            assert np.isfinite(part).all()


@pytest.mark.parametrize(
    ("kind", "law"),
    [
        ("ellipsoid", "plain"),
        ("published", "elasto-plastic"),
        ("table", "wide"),
        ("cells", "elasto-plastic"),
    ],
)
def test_eager_and_adjoint_agree_at_kinks_too(kind, law):
    model = pairs(kind, law)[1]
    # centre and radius without rounding: else that, and not the model, says on which side of a kink a twist is
    whole = model.parameters._replace(
        centre_x=0.0, centre_y=0.0, contact_radius=2.0**-8
    )
    model = model.replace(parameters=whole)
    motion, loads = hard(model)
    sides = np.random.default_rng(0).normal(size=motion.shape) * (1.0, 1.0, 100.0)

    def loss(parameters, state, motion, loads, method):
        changed = model.replace(parameters=parameters)
        run = pj.rollout(changed, state, motion, loads, 1e-4, method=method)
        return (run.wrenches * sides).sum() + (
            run.state * jnp.array([1e6, 1e6, 1e8])
        ).sum()

    slopes = jax.jit(jax.value_and_grad(loss, argnums=(0, 1, 2, 3)), static_argnums=4)
    for state, twist, load in (
        (np.array([1e-6, 0.0, 0.0]), motion, loads),
        (
            np.zeros(3),
            np.resize(sway(300, 1e-4), motion.shape),
            np.linspace(0.5, 2.0, len(loads)),
        ),
    ):
        (value, eager), (same, adjoint) = (
            slopes(model.parameters, state, twist, load, method)
            for method in ("eager", "adjoint")
        )
        assert float(value) == pytest.approx(float(same), rel=1e-11)
        sizes = [*(abs(p) for p in model.parameters), 1e-6, 1e-3, 1.0]
        for size, first, second in zip(
            sizes, jax.tree.leaves(eager), jax.tree.leaves(adjoint), strict=True
        ):
            assert np.isfinite(first).all() and np.isfinite(second).all()
            # 1e-9 of the gradient, or where it is zero 1e-12 of the value per share of the parameter
            scale = np.abs(second).max() + 1e-3 * abs(same) / (size + 1e-3)
            assert np.abs(first - second).max() <= 1e-9 * scale


def test_adjoint_says_what_it_cannot_differentiate():
    model = pairs("published", "wide")[1]
    motion = sway(5, 1e-4)
    with refused("surface must be held fixed with method='adjoint'"):
        jax.grad(
            lambda m: pj.rollout(
                m, None, motion, 1.0, 1e-4, method="adjoint"
            ).wrenches.sum()
        )(model)
    with refused("positions must be held fixed with method='adjoint'"):
        jax.grad(
            lambda m: pj.rollout(
                m, None, motion, 1.0, 1e-4, method="adjoint"
            ).wrenches.sum()
        )(pairs("distributed", "wide")[1])


@pytest.mark.parametrize("law", LAWS)
def test_the_adjoint_of_cells_takes_the_steps_and_slopes_of_jax(law):
    reference, model = pairs("distributed", law)
    motion = sway(60, 1e-4)
    sides = np.random.default_rng(0).normal(size=(60, 3)) * (1.0, 1.0, 100.0)
    loads = np.linspace(0.5, 2.0, 60)
    loads[30] = 0.0

    def loss(parameters, state, motion, loads, method):
        changed = model.replace(parameters=parameters)
        run = pj.rollout(changed, state, motion, loads, 1e-4, method=method)
        return (run.wrenches * sides).sum() + 1e6 * run.state.sum(), run.wrenches

    state = states(reference, 2)[1]
    slopes = jax.jit(
        jax.grad(loss, argnums=(0, 1, 2, 3), has_aux=True), static_argnums=4
    )
    (eager, _), (adjoint, wrenches) = (
        slopes(model.parameters, state, motion, loads, m) for m in ("eager", "adjoint")
    )
    close(wrenches, pf.rollout(reference, state, motion, loads, 1e-4).wrenches, 1e-11)
    for one, other in zip(
        jax.tree.leaves(eager), jax.tree.leaves(adjoint), strict=True
    ):
        close(one, other, 1e-8)


@given(
    st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3),
    st.lists(st.floats(-1e-5, 1e-5), min_size=3, max_size=3),
    st.floats(0.0, 1e3),
    st.floats(0.0, 10.0),
)
@settings(max_examples=50, deadline=None)
def test_gradients_are_finite_everywhere(twist, state, load, dt):
    model = pairs("published", "elasto-plastic")[1]
    for part in jax.tree.leaves(
        _slopes()(model, jnp.array(state), jnp.array(twist), load, dt)
    ):
        assert np.isfinite(part).all()


@functools.cache
def _slopes():
    return jax.jit(jax.jacrev(pj.step, argnums=(0, 1, 2, 3, 4)))


def test_at_rest_friction_changes_with_the_twist_as_that_of_the_ellipsoid():
    # The kernels' convention: du/dV_S is the identity at rest, and |V| has slope 0 there.
    for kind in ("published", "ellipsoid"):
        model = pairs(kind, "elasto-plastic")[1]
        slope = jax.jit(
            jax.jacobian(lambda twist, m=model: pj.rate(m, m.rest(), twist, 1.0))
        )(jnp.zeros(3))
        x = model.parameters.centre_x
        y = model.parameters.centre_y
        r = model.parameters.contact_radius
        close(slope, [[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, r * r]])


# ---------------------------------------------------------------------- transformations, types, input


def test_vmap_over_models_states_and_loads():
    model = pairs("published", "wide")[1]
    motion = sway(50, 1e-4)
    frictions = jnp.linspace(0.5, 1.1, 4)
    loads = jnp.linspace(0.5, 2.0, 4)

    def last(mu, load):
        changed = model.replace(parameters=model.parameters._replace(mu_c=mu))
        return pj.rollout(changed, None, motion, load, 1e-4).wrenches[-1]

    together = jax.jit(jax.vmap(last))(frictions, loads)
    one = jax.jit(last)
    close(together, [one(mu, load) for mu, load in zip(frictions, loads, strict=True)])
    slopes = jax.jit(jax.vmap(jax.jacfwd(last)))(frictions, loads)
    close(slopes, jax.jit(jax.vmap(jax.jacrev(last)))(frictions, loads), 1e-9)


def test_leading_axes_broadcast():
    model = pairs("ellipsoid", "wide")[1]
    motion = np.stack([sway(20, 1e-4), 2.0 * sway(20, 1e-4)])
    roll_out = jax.jit(pj.rollout)
    run = roll_out(model, np.full(3, 1e-7), motion, np.array([[1.0], [2.0]]), 1e-4)
    assert run.wrenches.shape == (2, 20, 3) and run.state.shape == (2, 3)
    close(
        run.wrenches[1],
        roll_out(model, np.full(3, 1e-7), motion[1], 2.0, 1e-4).wrenches,
    )


def test_wrong_input_is_named():
    model = pairs("ellipsoid", "plain")[1]
    with refused(r"twist must have shape \[\.\.\., T, 3\]"):
        pj.rollout(model, None, np.zeros(3), 1.0, 1e-3)
    with refused("broadcast"):
        pj.rollout(model, None, np.zeros((4, 3)), np.ones(3), 1e-3)
    with refused("method must be one of adjoint, eager"):
        pj.rollout(model, None, np.zeros((4, 3)), 1.0, 1e-3, method="adjont")
    with refused("patch must be a ContactPatch"):
        pj.DistributedModel("disc", PLAIN)
    with refused(r"model must be one of planarfriction.jax .* got planarfriction\.mod"):
        pj.rollout(pairs("ellipsoid", "plain")[0], None, np.zeros((4, 3)), 1.0, 1e-3)


def test_a_missing_package_names_its_extra(monkeypatch):
    for name in [name for name in sys.modules if name.startswith("planarfriction.jax")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "jax", None)
    with refused(r"pip install 'planarfriction\[jax\]'", MissingExtraError):
        importlib.import_module("planarfriction.jax")


@pytest.mark.slow
def test_the_example_with_diffrax_sticks_slips_and_turns(tmp_path):
    pytest.importorskip("diffrax", reason="needs diffrax")
    example = script("examples/diffrax_contact.py")
    times, states, forces = example.run(duration=1.6)
    # The hook is off the middle: the block gives way, turning, where the wrench of the spring is on the limit surface,
    square = pf.LimitSurfaceExact(pf.ContactPatch.rectangle(example.SIDE, cells=11))
    share = np.abs(square.wrench(square.twist([1.0, 0.0, float(example.HOOK[1])]))[0])
    # and the spring goes on pulling until the block has gathered speed: 2 % more.
    assert np.hypot(forces[:, 0], forces[:, 1]).max() == pytest.approx(
        1.02 * share * example.LAW.mu_s * example.LOAD, rel=0.01
    )
    slipping = np.abs(states.twist[:, 0]) > 1e-3
    assert np.count_nonzero(np.diff(slipping.astype(int)) == 1) == 1
    assert -8.0 < np.degrees(states.pose[-1, 2]) < -4.0
    example.draw(times, states, forces, tmp_path / "picture.png")
    assert (tmp_path / "picture.png").stat().st_size > 10_000


@pytest.mark.parametrize("kind", [">f8", np.longdouble])
def test_floats_that_jax_does_not_know_are_converted(kind):
    model = pj.DistributedModel(PATCH, PLAIN)
    twist = np.array([0.01, 0.0, 1.0])
    given, wanted = (
        model.step(model.rest(), each, 1.0, 1e-3)[1]
        for each in (twist.astype(kind), twist)
    )
    assert np.array_equal(given, wanted)


def conditions(jaxpr):
    """Yield the names of the operations in the conditions of all loops."""
    for equation in jaxpr.eqns:
        if equation.primitive.name == "while":
            inner = equation.params["cond_jaxpr"].jaxpr
            yield [each.primitive.name for each in inner.eqns]
        for each in jaxprs_in_params(equation.params):
            yield from conditions(each)


def test_conditions_of_loops_round_nothing():
    """Side by side, a loop whose condition is rounded differently inside and outside of its body never ends."""
    cells = jnp.ones((5, 23))
    centre = jnp.ones((5, 1))
    found = jax.make_jaxpr(pressing)(
        cells, cells, cells, centre, centre, jnp.zeros((5, 1), bool)
    )
    loops = list(conditions(found.jaxpr))
    assert len(loops) == 2
    exact = {"and", "or", "not", "lt", "gt", "convert_element_type"}
    assert not set().union(*loops) - exact
