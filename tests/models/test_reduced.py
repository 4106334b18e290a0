"""The reduced model: what it holds exactly, its map, its step and its derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.integrate import solve_ivp

import planarfriction as pf
from planarfriction.errors import InvalidValueError
from planarfriction.models import cube_map
from planarfriction.models.reduced_map import slip_factor
from planarfriction.models.steady_sums import ScaledCells
from planarfriction.patch import PUBLISHED_PATCHES

PLAIN, ELASTIC = pf.LuGre(mu_s=1.2), pf.LuGre(mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.9))
LAWS = {"plain": PLAIN, "elasto-plastic": ELASTIC}
PATCH = PUBLISHED_PATCHES["NonConvex2"]()
FEET = pf.ContactPatch.points([(0.01, 0.0), (-0.01, 0.002), (0.0, 0.012)], [1.0, 2.0, 3.0])
SMALL = {"segments": 8, "speeds": 8}


@pytest.fixture(scope="module", params=LAWS)
def model(request) -> pf.models.MomentModel:
    return pf.models.MomentModel(PATCH, LAWS[request.param], parts=1)


def twists(count: int, seed: int = 1, speeds: tuple[float, float] = (-5.0, -1.0)) -> np.ndarray:
    generator = np.random.default_rng(seed)
    directions = generator.normal(size=(count, 3)) * [1.0, 1.0, 150.0]
    return directions * 10.0 ** generator.uniform(*speeds, (count, 1))


def steady(model: pf.models.MomentModel, twist: np.ndarray) -> np.ndarray:
    """Steady state: that of a step much longer than the memory of the bristles."""
    return model.step(np.zeros_like(twist), twist, 1.0, 1e6)[0]


# ---------------------------------------------------------------------- closed forms


@pytest.mark.parametrize("law", LAWS)
def test_before_sliding_it_is_the_distributed_model(law):
    reduced, distributed = pf.models.MomentModel(PATCH, LAWS[law], **SMALL), pf.DistributedModel(PATCH, LAWS[law])
    for twist in np.eye(3) * [1e-9, 1e-9, 1e-7]:  # bends bristles by 1e-6 of their largest deflection
        ours, theirs = (m.step(m.rest(), twist, 2.0, 1e-3)[1] for m in (reduced, distributed))
        # plain bristles have slipped by that share of their speed
        np.testing.assert_allclose(ours, theirs, rtol=1e-5, atol=1e-5 * np.abs(theirs).max())


def test_translation_is_the_distributed_model():
    twist, loads = np.array([3e-4, -2e-4, 0.0]), 2.0
    for law in LAWS.values():
        models = [pf.models.MomentModel(PATCH, law, parts=1), pf.DistributedModel(PATCH, law)]
        states = [m.rest() for m in models]
        for _ in range(40):
            results = [m.step(z, twist, loads, 2e-4) for m, z in zip(models, states, strict=True)]
            states, wrenches = [r[0] for r in results], [r[1] for r in results]
            # what is left is the map: 1e-5 of the steady force, over a lever arm of 0.01 m for the torque
            assert np.abs((wrenches[0] - wrenches[1]) / [1.0, 1.0, 0.01]).max() < 4e-5 * loads


def test_steady_sliding_is_the_sum_over_the_cells():
    fine = PATCH.refined(9)
    reduced, cells = pf.models.MomentModel(PATCH, PLAIN, parts=1), pf.DistributedModel(fine, PLAIN)
    errors = []
    for twist in twists(60):
        wrench = reduced.step(reduced.rest(), twist, 1.0, 1e6)[1]
        errors.append(np.abs(wrench - cells.step(cells.rest(), twist, 1.0, 1e6)[1]).max())
    assert np.median(errors) < 2e-5
    assert max(errors) < 3e-3


def test_viscous_friction_is_that_of_the_cells():
    law = pf.LuGre(mu_s=1.2, sigma_2=5.0)
    without = pf.LuGre(mu_s=1.2, sigma_2=0.0)
    twist = np.array([0.1, -0.2, 20.0])
    for kind in (pf.models.MomentModel, pf.DistributedModel):
        model, other = kind(PATCH, law), kind(PATCH, without)
        viscous = model.wrench(model.rest(), twist, 1.0) - other.wrench(other.rest(), twist, 1.0)
        if kind is pf.models.MomentModel:
            ours = viscous
    np.testing.assert_allclose(ours, viscous, rtol=1e-12)


# ---------------------------------------------------------------------- the map


def _smooth(v: np.ndarray) -> np.ndarray:
    n = v / np.linalg.norm(v, axis=-1, keepdims=True)
    return np.stack([n[..., 0] * np.exp(n[..., 1]), n[..., 1] * n[..., 2] ** 2, np.sin(2.0 * n[..., 0])], -1)


def _map_of(function, n: int, faces: int) -> np.ndarray:
    """Data of a map of one level, as `kernels.reduced` expects it around its numbers."""
    return cube_map.flat(cube_map.hermite(function(cube_map.face_nodes(n))), 3, faces)


def _read(data: np.ndarray, n: int, faces: int, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values [B, 3] and gradients [B, 3, 3] through the compiled reader."""
    from tests.support.reading_maps import read_batch

    values, gradients = np.empty_like(v), np.empty((len(v), 9))
    read_batch(data, n, faces, v, values, gradients)
    return values, gradients.reshape(-1, 3, 3)


@pytest.mark.parametrize("faces", [3, 6])
def test_maps_converge_with_the_fourth_order(faces):
    odd = lambda v: 0.5 * (_smooth(v) - _smooth(-v))  # noqa: E731
    function = odd if faces == 3 else _smooth
    v = np.random.default_rng(0).normal(size=(2000, 3))
    errors = [np.abs(_read(_map_of(function, n, faces), n, faces, v)[0] - function(v)).max() for n in (6, 12, 24)]
    assert errors[2] < 2e-6
    assert np.log2(errors[0] / errors[1]) > 3.7
    assert np.log2(errors[1] / errors[2]) > 3.7


@pytest.mark.parametrize("faces", [3, 6])
def test_slopes_are_continuous_across_the_edges_of_the_cube(faces):
    n = 4
    rough = np.random.default_rng(4).normal(size=(3, *cube_map.face_nodes(n).shape[1:]))
    six = cube_map.mirrored(rough) if faces == 3 else np.concatenate([rough, 2.0 * rough])
    data = cube_map.flat(cube_map.hermite(six), 3, faces)
    z = np.linspace(-0.999, 0.999, 101)
    for j in range(3):
        for s, q in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            point = np.empty((101, 3))
            point[:, (j + 1) % 3], point[:, (j + 2) % 3], point[:, j] = s, q, z
            sides = []
            for axis in ((j + 1) % 3, (j + 2) % 3):
                side = point.copy()
                side[:, axis] *= 1.0 + 1e-14
                sides.append(_read(data, n, faces, side))
            # both faces store the same values and slopes along the edge; those across it, up to 10, are rounded apart
            for one, other, atol in zip(*sides, (1e-10, 2e-6), strict=True):
                np.testing.assert_allclose(one, other, rtol=0.0, atol=atol)


def test_a_map_is_small_and_finer_maps_are_closer():
    assert (
        pf.models.MomentModel(PATCH, PLAIN, parts=1).shape_at(None).data.nbytes < 1.1e6
    )  # half of a common second-level cache
    twist = twists(300, seed=5)
    fine = steady(pf.models.MomentModel(PATCH, PLAIN, segments=48, speeds=28, parts=1), twist)
    scale = np.linalg.norm(fine, axis=1)
    errors = [
        np.median(
            np.linalg.norm(
                steady(pf.models.MomentModel(PATCH, PLAIN, segments=n, speeds=t, parts=1), twist) - fine, axis=1
            )
            / scale
        )
        for n, t in ((6, 7), (12, 14), (24, 28))
    ]
    assert errors[2] < 2e-6
    assert errors[0] > 6.0 * errors[1] > 36.0 * errors[2]


COMPACT = pf.ContactPatch(0.002 * np.indices((3, 3)).reshape(2, 9).T + [0.02, 0.0], np.full(9, 4e-6), np.full(9, 1 / 9))


@pytest.mark.parametrize("gamma", [1.0, 2.0])
@pytest.mark.parametrize(
    ("patch", "median"),
    [(PATCH, 8e-6), (PUBLISHED_PATCHES["Circle"](), 8e-6), (COMPACT, 2e-6)],
    ids=["T", "disc", "compact"],
)
def test_the_map_is_the_sum_over_the_cells_at_every_speed(patch, median, gamma):
    """Twists move all cells of a compact patch nearly alike: nothing smears its Stribeck effect over the speeds."""
    law = pf.LuGre(mu_s=1.2, gamma=gamma)
    factor, raised = slip_factor(patch), np.geomspace(1e-2, 1e2, 15)
    scaled = twists(200, seed=6) @ factor.T
    scaled /= np.linalg.norm(scaled, axis=1, keepdims=True)
    sums = ScaledCells(patch, None, factor).sums(scaled, raised, gamma)
    true = law.mu_c * sums[:, :1] + (law.mu_s - law.mu_c) * sums[:, 1:]
    speeds = law.v_s * raised ** (1.0 / gamma)
    ours = steady(
        pf.models.MomentModel(patch, law, parts=1),
        np.linalg.solve(factor, (scaled[:, None] * speeds[:, None])[..., None])[..., 0],
    )
    errors = np.linalg.norm(law.sigma_0 * ours - true, axis=-1) / np.linalg.norm(true, axis=-1)
    assert np.median(errors) < median
    assert np.quantile(errors, 0.9) < 40.0 * median  # near the kinks: where the patch turns about one of its edges


# ---------------------------------------------------------------------- properties


@settings(max_examples=40, deadline=None)
@given(arrays(float, (3, 4), elements=st.floats(0.0, 1.0)), st.integers(0, 10**6))
def test_sliding_always_dissipates(pressure, seed):
    pressure = np.where(pressure < 1e-3, 0.0, pressure)  # a single loaded cell has no radius of gyration
    if np.count_nonzero(pressure) < 2:
        pressure[0, 0], pressure[2, 3] = 1.0, 1e-3
    patch = pf.ContactPatch.from_pressure(pressure, 0.005)
    _dissipates(pf.models.MomentModel(patch, PLAIN, segments=4, speeds=6, parts=1), seed)


@settings(max_examples=20, deadline=None)
@given(st.floats(1e-4, 1.0), st.integers(0, 10**6))
def test_two_points_always_dissipate(weight, seed):
    patch = pf.ContactPatch.points([(0.0, 0.01), (0.0, -0.01)], [1.0, weight])
    _dissipates(pf.models.MomentModel(patch, PLAIN, segments=4, speeds=6, parts=1), seed)


def _dissipates(model: pf.models.MomentModel, seed: int) -> None:
    twist = twists(60, seed)
    centre = np.random.default_rng(seed).choice(model.patch.positions, 20)  # turning about a cell
    about = np.stack([centre[:, 1], -centre[:, 0], np.ones(20)], -1) * 10.0 ** np.linspace(-4, 1, 20)[:, None]
    twist = np.concatenate([twist, about])
    z = steady(model, twist)
    assert np.isfinite(z).all()
    factor = model.shape_at(None).factor
    power = np.einsum("bi,bi->b", z, twist @ factor.T)
    speed = np.linalg.norm(twist @ factor.T, axis=1)
    assert (power > 0.0).all()
    assert (power >= 0.999 * model.law.largest_deflection * model.shape_at(None).data[5] * speed).all()


@pytest.mark.parametrize("angle", [0.5 * np.pi, np.pi])
def test_turning_patch_twist_and_state_turns_the_wrench(angle):
    """By right angles, which turn the cells into cells; others change the map's own error, not more."""
    turned = pf.ContactPatch.points(pf.geometry.rotate(FEET.positions, angle), FEET.weights())
    one, other = pf.models.MomentModel(FEET, ELASTIC, **SMALL), pf.models.MomentModel(turned, ELASTIC, **SMALL)
    generator = np.random.default_rng(3)
    twist, z = twists(50, seed=3), 1e-6 * generator.normal(size=(50, 3))
    turn = lambda a: np.concatenate([pf.geometry.rotate(a[:, :2], angle), a[:, 2:]], axis=1)  # noqa: E731
    new, wrench = one.step(z, twist, 2.0, 1e-4)
    new_turned, wrench_turned = other.step(turn(z), turn(twist), 2.0, 1e-4)
    np.testing.assert_allclose(new_turned, turn(new), rtol=1e-9, atol=1e-16)
    np.testing.assert_allclose(wrench_turned, turn(wrench), rtol=1e-9, atol=1e-10)


def test_at_rest_nothing_moves_and_nothing_is_nan(model):
    for z in (np.zeros(3), np.array([1e-6, 2e-6, -1e-6]), np.array([1e-3, 0.0, 0.0])):
        assert not model.rate(z, np.zeros(3), 1.0).any()
        new, wrench = model.step(z, np.zeros(3), 1.0, 1.0)
        np.testing.assert_array_equal(new, z)
        assert np.isfinite(wrench).all()
        for part in (*model.jacobians(z, np.zeros(3), 1.0), *model.step_jacobians(z, np.zeros(3), 1.0, 1e-3)):
            assert np.isfinite(part).all()


def test_a_patch_of_one_point_is_refused():
    with pytest.raises(InvalidValueError, match="patch must carry more than 1e-06 of its load"):
        pf.models.MomentModel(pf.ContactPatch.points([(0.0, 0.0)]), PLAIN, parts=1)


def test_a_contact_without_load_forgets(model):
    new, wrench = model.step([1e-6, 0.0, 1e-6], [0.01, 0.0, 1.0], 0.0, 1e-4)
    assert not new.any()
    assert not wrench.any()


# ---------------------------------------------------------------------- the step


def test_one_contact_and_a_batch_give_the_same_step(model):
    twist, z = twists(20), 1e-6 * np.random.default_rng(0).normal(size=(20, 3))
    states, wrenches = model.step(z, twist, 2.0, 1e-4)
    for i in range(20):
        new, wrench = model.step(z[i], twist[i], 2.0, 1e-4)
        np.testing.assert_array_equal(new, states[i])
        np.testing.assert_array_equal(wrench, wrenches[i])


def test_the_step_is_exact_for_plain_and_second_order_for_other_bristles(model):
    orders = []
    for seed in range(4):
        twist, z = twists(1, seed, (-3.0, -3.0))[0], 7e-7 * np.random.default_rng(seed).normal(size=3)
        reference = solve_ivp(
            lambda t, y, twist=twist: model.rate(y, twist, 1.0), (0.0, 2e-3), z, method="Radau", rtol=1e-10, atol=1e-17
        ).y[:, -1]
        errors = []
        for count in (1, 64, 128):
            y = z
            for _ in range(count):
                y, _ = model.step(y, twist, 1.0, 2e-3 / count)
            errors.append(np.abs(y - reference).max() / model.law.largest_deflection)
        if model.law.elasto_plastic is None:
            assert max(errors) < 1e-9  # the reference's
        else:
            assert errors[1] < 1e-3
            orders.append(np.log2(errors[1] / errors[2]))
    assert not orders or np.mean(orders) > 1.7


def test_steps_of_any_length_stay_bounded(model):
    twist, z = twists(400), 1e-6 * np.random.default_rng(1).normal(size=(400, 3))
    for dt in (1e-6, 1e-3, 1.0, 1e6):
        new, wrench = model.step(z, twist, 1.0, dt)
        assert np.isfinite(wrench).all()
        assert np.linalg.norm(new, axis=1).max() < 6e-6
    np.testing.assert_allclose(model.rate(new, twist, 1.0), 0.0, atol=1e-9 * np.abs(twist).max())


# ---------------------------------------------------------------------- derivatives


def _differences(function, at: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    columns = []
    for k in range(3):
        move = np.zeros_like(at)
        move[:, k] = 1e-6 * sizes[:, k]
        columns.append((function(at + move) - function(at - move)) / (2.0 * move[:, k, None]))
    return np.stack(columns, -1)


def _agree(analytic: np.ndarray, numeric: np.ndarray, scale: np.ndarray) -> None:
    error = np.abs(analytic - numeric).max(axis=(1, 2)) / scale
    # differences of 1e-6 err by 1e-10 of the terms; more where a kink (a cap, a patch's edge) lies between both sides
    assert np.quantile(error, 0.95) < 1e-6


def test_jacobians_are_the_derivatives(model):
    twist, z = twists(200, seed=8), 7e-7 * np.random.default_rng(8).normal(size=(200, 3))
    speed = np.linalg.norm(twist @ model.shape_at(None).factor.T, axis=1)
    by_twist, by_state = speed[:, None] * [1.0, 1.0, 150.0], np.full((200, 3), 1e-6)
    found = model.jacobians(z, twist, 2.0)
    _agree(found.rate_state, _differences(lambda y: model.rate(y, twist, 2.0), z, by_state), 1e6 * speed)
    _agree(found.rate_twist, _differences(lambda v: model.rate(z, v, 2.0), twist, by_twist), np.ones(200))
    size = 2.0 * (1e6 + 8e8 * speed)
    _agree(found.wrench_state, _differences(lambda y: model.wrench(y, twist, 2.0), z, by_state), size)
    _agree(found.wrench_twist, _differences(lambda v: model.wrench(z, v, 2.0), twist, by_twist), size * 1e-6 / speed)
    np.testing.assert_allclose(found.wrench_load, model.wrench(z, twist, 1.0), rtol=1e-12)


@pytest.mark.parametrize("dt", [1e-5, 1e-4, 1e-2])
def test_step_jacobians_are_the_derivatives(model, dt):
    twist, z = twists(200, seed=9), 7e-7 * np.random.default_rng(9).normal(size=(200, 3))
    speed = np.linalg.norm(twist @ model.shape_at(None).factor.T, axis=1)
    by_twist, by_state = speed[:, None] * [1.0, 1.0, 150.0], np.full((200, 3), 1e-6)
    found = model.step_jacobians(z, twist, 2.0, dt)
    ones = np.ones(200)
    _agree(found.state_state, _differences(lambda y: model.step(y, twist, 2.0, dt)[0], z, by_state), ones)
    _agree(found.state_twist, _differences(lambda v: model.step(z, v, 2.0, dt)[0], twist, by_twist), 1e-6 / speed)
    size = 2.0 * (1e6 + 8e8 * speed)
    _agree(found.wrench_state, _differences(lambda y: model.step(y, twist, 2.0, dt)[1], z, by_state), size)
    _agree(
        found.wrench_twist, _differences(lambda v: model.step(z, v, 2.0, dt)[1], twist, by_twist), size * 1e-6 / speed
    )


# ---------------------------------------------------------------------- scenes and files


def test_scene_with_default_tolerances_agrees_with_a_tight_one():
    model = pf.models.MomentModel(PATCH, ELASTIC, parts=1)
    scene = pf.Scene(pf.Body(0.3, 4e-5, (0.0, 0.0), 0.0, (0.1, -0.05, 8.0)), [pf.Contact(model, 2.0)], 0.1)
    loose, tight = pf.simulate(scene).data, pf.simulate(scene, rtol=1e-9, atol=1e-8).data
    for name in ("x", "y"):
        np.testing.assert_allclose(loose[name], tight[name], rtol=0.0, atol=2e-6)
    np.testing.assert_allclose(loose.theta, tight.theta, rtol=0.0, atol=2e-4)


def test_a_scene_file_keeps_the_model():
    from planarfriction.scenes.model_files import model_from_dict, model_to_dict
    from planarfriction.scenes.section import Section

    model = pf.ReducedModel(FEET, ELASTIC, parts=1, **SMALL)
    again = model_from_dict(Section(model_to_dict(model), "contact"))
    assert isinstance(again, pf.ReducedModel)
    assert (again.segments, again.speeds) == (8, 8)
    twist = np.array([0.01, 0.0, 1.0])
    np.testing.assert_array_equal(
        again.step(again.rest(), twist, 1.0, 1e-3)[1], model.step(model.rest(), twist, 1.0, 1e-3)[1]
    )


def test_a_patch_that_depends_on_the_load_has_a_shape_for_each():
    soft = pf.ContactPatch.disc(0.01, 9, pressure=pf.SoftFinger(k=2.0, c=0.006, n=1.0 / 3.0))
    model = pf.models.MomentModel(soft, PLAIN, **SMALL)
    loads, twist = np.array([0.0, 0.5, 2.0]), np.array([0.01, 0.0, 2.0])
    _, wrenches = model.step(np.zeros((3, 3)), twist, loads, 1.0)
    assert not wrenches[0].any()
    for i in (1, 2):
        np.testing.assert_array_equal(wrenches[i], model.step(np.zeros(3), twist, loads[i], 1.0)[1])
    assert abs(wrenches[2, 2] / wrenches[1, 2]) > 4.2  # more than the load: the finger flattens


# ---------------------------------------------------------------------- against the distributed model


@pytest.mark.parametrize("shape", ["Circle", "NonConvex1"])
def test_driven_it_beats_the_published_model_against_the_converged_one(shape):
    patch = PUBLISHED_PATCHES[shape]()
    twist = pf.Signal.sampled([0.0, 0.2, 0.4], [[0, 0, 0], [0.02, 0.01, 3.0], [-0.02, 0.0, 1.0]], hold="linear")
    models = [
        pf.DistributedModel(patch.refined(3), ELASTIC),
        pf.models.MomentModel(patch, ELASTIC, parts=1),
        pf.ReducedModelPublished(patch, ELASTIC),
    ]
    runs = [pf.simulate(pf.scenes.driven(m, twist=twist, t_end=0.4), rtol=1e-6, atol=1e-6).data for m in models]
    errors = [np.median(np.hypot(run.fx - runs[0].fx, run.fy - runs[0].fy)) for run in runs[1:]]
    assert errors[0] < 0.25 * errors[1]


def test_the_stored_fourth_moments_are_those_of_the_cells_speeds():
    patch = pf.ContactPatch.rectangle(0.02, 0.01, (4, 3), pressure=lambda x, y: 1.0 + 20.0 * x + 30.0 * y)
    factor = slip_factor(patch)
    stored = ScaledCells(patch, None, factor).fourth_moments()
    for x, y, s in np.random.default_rng(3).normal(size=(20, 3)):
        seen = patch.levers() @ np.linalg.solve(factor, [x, y, s])
        m = np.array([x * x, y * y, s * s, x * y, x * s, y * s])
        products = np.outer(m[:3], m)[np.triu_indices(3, m=6)]
        assert stored @ products == pytest.approx(patch.weights() @ (seen**2).sum(axis=1) ** 2, rel=1e-12)
