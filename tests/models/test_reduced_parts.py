"""The reduced model in parts: what it holds exactly, that as many parts as cells are the cells, its derivatives."""

from __future__ import annotations

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import derivatives
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch, SoftFinger
from planarfriction.patch.parts import part_of
from planarfriction.scenes import simulate

PLAIN, ELASTIC = pf.LuGre(mu_s=1.2), pf.LuGre(mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.9))
LAWS = {"plain": PLAIN, "elasto-plastic": ELASTIC}
T = PUBLISHED_PATCHES["NonConvex2"](11)
FEET = ContactPatch.points([(0.01, 0.0), (-0.01, 0.002), (0.0, 0.012)], [1.0, 2.0, 3.0])
ROUGH = T.with_friction_metric(pf.friction_metric(0.4, along=1.0, across=0.7))
BRUSHED = T.with_friction_metric(pf.friction_metric(0.4, along=1.0, across=0.7), (0.2, 0.1))
EVEN = ContactPatch.polygon([(0.0, 0.0), (0.02, 0.0), (0.004, 0.013)], 15)
SOFT = ContactPatch.disc(0.01, 11, pressure=SoftFinger(c=0.006, n=1 / 3, k=2.0))
SMALL = {"segments": 8, "speeds": 8}


# ---------------------------------------------------------------------- as many parts as cells: the distributed model


def twists(count: int, seed: int = 1) -> np.ndarray:
    generator = np.random.default_rng(seed)
    return generator.normal(size=(count, 3)) * [1.0, 1.0, 100.0] * 10.0 ** generator.uniform(-4, -1, (count, 1))


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("patch", [FEET, T], ids=["feet", "T"])
def test_as_many_parts_as_cells_are_the_distributed_model(law, patch):
    cells, errors = pf.DistributedModel(patch, LAWS[law]), []
    for sizes in ({"segments": 12, "speeds": 7}, {}):
        model = pf.models.MomentModel(patch, LAWS[law], parts=patch.cells, **sizes)
        ours, theirs, off = model.rest(), cells.rest(), []
        for twist in twists(60):
            rates = model.rate(ours, twist, 2.0)[:, :2].T, cells.rate(theirs, twist, 2.0)
            forces = model.wrench(ours, twist, 2.0), cells.wrench(theirs, twist, 2.0)
            speed = np.abs(twist * [1.0, 1.0, 0.01]).max()
            off.append(np.abs(rates[0] - rates[1]).max() / speed)
            off.append(np.abs((forces[0] - forces[1]) / [2.0, 2.0, 0.02]).max() / (1.0 + speed * 800.0))
            ours, wrench = model.step(ours, twist, 2.0, 1e-3)
            theirs, wanted = cells.step(theirs, twist, 2.0, 1e-3)
            off.append(np.abs((wrench - wanted) / [2.0, 2.0, 0.02]).max())
            off.append(np.abs(ours[:, :2].T - theirs).max() / LAWS[law].largest_deflection)
            assert (ours[:, 2] == 0.0).all()
        errors.append(np.median(off))
    # what is left is the map of a point: interpolation of a unit vector, and of the Stribeck curve over the speed
    assert errors[1] < 2e-6
    assert errors[1] < errors[0] / 16.0


def test_a_scene_with_a_part_per_cell_is_that_of_the_distributed_model():
    ends = []
    for model in (pf.models.MomentModel(T, ELASTIC, parts=T.cells), pf.DistributedModel(T, ELASTIC)):
        data = simulate(pf.scenes.free_slide(model), rtol=1e-7, atol=1e-7).histories
        ends.append([data[name].values[-1] for name in ("x", "y", "theta")])
    np.testing.assert_allclose(ends[0], ends[1], rtol=2e-5)


# ---------------------------------------------------------------------- roll-outs


@pytest.mark.parametrize("patch", [T, ROUGH, SOFT], ids=["T", "grain", "soft"])
def test_steps_one_by_one_in_batches_and_rolled_out_are_the_same(patch):
    model = pf.models.MomentModel(patch, ELASTIC, parts=3, **SMALL)
    held, loads, dt = twists(12), np.linspace(0.5, 2.0, 12), np.linspace(1e-4, 1e-2, 12)
    loads[5] = 0.0  # a contact without load forgets all its parts
    states, wrenches = [model.rest()], []
    for twist, load, step in zip(held, loads, dt, strict=True):
        state, wrench = model.step(states[-1], twist, load, step)
        states.append(state)
        wrenches.append(wrench)
    assert states[-1].shape == (3, 3)
    together = model.step(np.array(states[:-1]), held, loads, dt)
    np.testing.assert_allclose(together[0], states[1:], rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(together[1], wrenches, rtol=1e-12, atol=1e-12)
    rolled = derivatives.rollout(model, None, np.stack([held, held]), loads, dt)
    np.testing.assert_allclose(rolled.wrenches[1], wrenches, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(rolled.state, [states[-1]] * 2, rtol=1e-12, atol=1e-18)


def test_a_roll_out_is_that_of_its_parts():
    model = pf.models.MomentModel(T, ELASTIC, parts=3)
    held, total = twists(30), 0.0
    kept = derivatives.rollout_states(model, model.rest(), held, 2.0, 1e-3)
    for k in range(3):
        part = part_of(T, model.labels == k)
        rolled = derivatives.rollout_states(
            pf.models.MomentModel(part, ELASTIC, parts=1), None, held, 2.0 * model.parts_at(None)[k].share, 1e-3
        )
        total = total + rolled.wrenches
        np.testing.assert_allclose(kept.states[:, k], rolled.states, rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(kept.wrenches, total, rtol=1e-12, atol=1e-12)


def test_gradients_and_sensitivities_are_differences_of_roll_outs():
    model = pf.models.MomentModel(T, ELASTIC, parts=3)
    generator = np.random.default_rng(5)
    held, loads, dt = twists(20, 4), np.linspace(1.0, 2.0, 20), 1e-3
    own, start = derivatives.parameters_of(model), 1e-7 * generator.normal(size=(3, 3))
    w_bar, z_bar = generator.normal(size=(20, 3)) * [1.0, 1.0, 100.0], 1e5 * generator.normal(size=(3, 3))
    inputs = {"state": start, "twist": held, "normal_force": loads, "parameters": own}

    def value(**given) -> float:
        given = {**inputs, **given}
        end, wrenches = derivatives.rollout(model, *list(given.values())[:3], dt, parameters=given["parameters"])
        return float((w_bar * wrenches).sum() + (z_bar * end).sum())

    gradient = derivatives.rollout_vjp(model, start, held, loads, dt, w_bar, z_bar, parameters=own)
    for name, at in inputs.items():
        along = generator.normal(size=at.shape) * (np.abs(at) if name != "state" else 1e-7)
        ahead, behind = (value(**{name: at + sign * 1e-6 * along}) for sign in (1, -1))
        slope = float((getattr(gradient, name) * along).sum())
        # differences of a sum of kinked steps: they hold to 1e-6 away from kinks
        assert slope == pytest.approx((ahead - behind) / 2e-6, rel=2e-5, abs=1e-7)
    found = derivatives.rollout_jacobian(model, start, held, loads, dt, ("mu_c", "sigma_1"))
    columns = [derivatives.parameter_names(model).index(name) for name in ("mu_c", "sigma_1")]
    only = derivatives.rollout_vjp(model, start, held, loads, dt, w_bar).parameters[columns]
    np.testing.assert_allclose(np.einsum("ti,tip->p", w_bar, found.d_wrenches), only, rtol=1e-9)


# ---------------------------------------------------------------------- what parts hold exactly


@pytest.mark.parametrize("patch", [T, ROUGH, EVEN], ids=["T", "grain", "even"])
def test_before_sliding_parts_are_the_distributed_model(patch):
    cells, model = pf.DistributedModel(patch, ELASTIC), pf.models.MomentModel(patch, ELASTIC, parts=4, **SMALL)
    for twist in np.eye(3) * [1e-9, 1e-9, 1e-7]:  # bends bristles by 1e-6 of their largest deflection
        ours, theirs = (each.step(each.rest(), twist, 2.0, 1e-3)[1] for each in (model, cells))
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9 * np.abs(theirs).max())


@pytest.mark.parametrize("patch", [T, BRUSHED], ids=["T", "brushed"])
def test_viscous_friction_of_parts_is_that_of_the_cells(patch):
    twist, pulls = np.array([0.1, -0.2, 20.0]), []
    for make in (pf.DistributedModel, lambda *given: pf.models.MomentModel(*given, parts=5, **SMALL)):
        some, none = (make(patch, pf.LuGre(mu_s=1.2, sigma_2=sigma_2)) for sigma_2 in (5.0, 0.0))
        pulls.append(some.wrench(some.rest(), twist, 1.0) - none.wrench(none.rest(), twist, 1.0))
    np.testing.assert_allclose(pulls[0], pulls[1], rtol=1e-12)


@pytest.mark.parametrize("patch", [T, EVEN], ids=["T", "even"])
def test_translation_of_parts_is_that_of_the_distributed_model(patch):
    models = pf.models.MomentModel(patch, ELASTIC, parts=4), pf.DistributedModel(patch, ELASTIC)
    states = [model.rest() for model in models]
    for _ in range(40):
        found = [m.step(z, (3e-4, -2e-4, 0.0), 2.0, 2e-4) for m, z in zip(models, states, strict=True)]
        states, wrenches = zip(*found, strict=True)
        # what is left is the map: 1e-5 of the steady force, over a lever arm of 0.01 m for the torque
        assert np.abs((wrenches[0] - wrenches[1]) / [1.0, 1.0, 0.01]).max() < 4e-5 * 2.0


SIDE = 0.02
SPUN = {
    "square": (ContactPatch.rectangle(SIDE, cells=11), SIDE * (np.sqrt(2.0) + np.arcsinh(1.0)) / 6.0),
    "line": (ContactPatch.line(SIDE, 11), SIDE / 4.0),
}


@pytest.mark.parametrize("parts", [1, 2])
@pytest.mark.parametrize("name", SPUN)
def test_a_steady_spin_sees_areas_though_points_weigh_otherwise(name, parts):
    """On 11 cells areas with the weights of points have a contact radius that is 0.5 % too large."""
    patch, radius = SPUN[name]
    assert pf.LimitSurfaceExact(patch).contact_radius == pytest.approx(radius, rel=1e-12)
    model = pf.models.MomentModel(patch, pf.LuGre(mu_c=1.0, mu_s=1.0, sigma_2=0.0), parts=parts, **SMALL)
    spun = model.step(model.rest(), (0.0, 0.0, 1.0), 1.0, 1e6)[1]
    assert -spun[2] == pytest.approx(radius, rel=1e-3)  # the coarse map


def test_steady_sliding_at_a_twist_that_all_share_is_that_of_one_part():
    # a common twist slides each cell at its own speed, whichever part it is in; far from v_s, where maps are closest
    held = twists(200) * 30.0
    one, many = (pf.models.MomentModel(PUBLISHED_PATCHES["Square"](), PLAIN, parts=parts) for parts in (1, 4))
    wrenches = [each.step(each.rest(), held, 1.0, 1e6)[1] / [1.0, 1.0, 0.01] for each in (one, many)]
    off = np.linalg.norm(wrenches[0] - wrenches[1], axis=1)
    assert np.median(off) < 2e-5
    assert off.max() < 5e-3  # where the centre of rotation lies between cells, maps miss most


@pytest.mark.parametrize("patch", [T, BRUSHED, SOFT], ids=["T", "brushed", "soft"])
def test_sliding_parts_dissipate(patch):
    model, held = pf.models.MomentModel(patch, ELASTIC, parts=4, **SMALL), twists(300, 8)
    state, _ = model.step(np.zeros((4, 3)), held, 1.5, 1e6)
    wrench = model.wrench(state, held, 1.5)
    assert (np.einsum("bi,bi->b", wrench, held) < 0.0).all()


def test_maps_of_parts_blend_over_the_load_as_that_of_the_patch():
    held, blended = twists(40, 6), pf.models.MomentModel(SOFT, PLAIN, parts=4, **SMALL)
    exact = pf.models.MomentModel(SOFT, PLAIN, parts=4, load_error=0.0, **SMALL)
    errors = []
    for load in np.linspace(1.02, 1.98, 9):
        pulls = [each.step(np.zeros((4, 3)), held, load, 1e6)[1] / [1.0, 1.0, 0.006] for each in (exact, blended)]
        errors.append(np.linalg.norm(pulls[1] - pulls[0], axis=1) / np.linalg.norm(pulls[0], axis=1))
    # each part may be off by as much; that all are at one load, and in one direction, is not seen
    assert 1e-6 < np.max(errors) < blended.load_error
    assert len(blended.load_rungs) < 40


# ---------------------------------------------------------------------- derivatives of single steps


@pytest.mark.parametrize("patch", [T, ROUGH, SOFT], ids=["T", "grain", "soft"])
def test_jacobians_are_differences(patch):
    model = pf.models.MomentModel(patch, ELASTIC, parts=3, **SMALL)
    held, load, dt = np.array([2e-3, -1e-3, 0.4]), 1.3, 5e-5
    state = model.step(model.rest(), held, load, 3e-4)[0]
    functions = {
        "rate": lambda z, v: model.rate(z, v, load),
        "wrench": lambda z, v: model.wrench(z, v, load),
        "new": lambda z, v: model.step(z, v, load, dt)[0],
        "pull": lambda z, v: model.step(z, v, load, dt)[1],
    }
    sizes = {"state": np.full((3, 3), 1e-12), "twist": np.array([1e-9, 1e-9, 1e-7])}
    differences = {name: {} for name in functions}
    for name, function in functions.items():
        for k, (by, size) in enumerate(sizes.items()):
            columns = []
            for index in np.ndindex(size.shape):
                move = [np.zeros((3, 3)), np.zeros(3)]
                move[k][index] = size[index]
                ahead, behind = (function(state + sign * move[0], held + sign * move[1]) for sign in (1, -1))
                columns.append((ahead - behind) / (2.0 * size[index]))
            differences[name][by] = np.stack(columns, -1).reshape(*columns[0].shape, *size.shape)
    now, step = model.jacobians(state, held, load), model.step_jacobians(state, held, load, dt)
    pairs = [
        (now.rate_twist, differences["rate"]["twist"]),
        (now.wrench_state, differences["wrench"]["state"]),
        (now.wrench_twist, differences["wrench"]["twist"]),
        (step.state_twist, differences["new"]["twist"]),
        (step.wrench_state, differences["pull"]["state"]),
        (step.wrench_twist, differences["pull"]["twist"]),
    ]
    for blocks, full in (
        (now.rate_state, differences["rate"]["state"]),
        (step.state_state, differences["new"]["state"]),
    ):
        for k in range(3):  # block by block: parts know nothing of each other
            assert (np.delete(full[k], k, axis=1) == 0.0).all()
        pairs.append((blocks, np.stack([full[k, :, k] for k in range(3)])))
    for ours, wanted in pairs:
        assert ours.shape == wanted.shape
        # truncation and rounding of differences over 1e-6 of what bends or moves
        np.testing.assert_allclose(ours, wanted, rtol=1e-4, atol=1e-5 * np.abs(wanted).max())
    wrench = model.wrench(state, held, load)
    np.testing.assert_allclose(now.wrench_load, wrench / load, rtol=1e-12)
    np.testing.assert_allclose(step.wrench_load, model.step(state, held, load, dt)[1] / load, rtol=1e-12)
    batch = model.step_jacobians(np.stack([state, state]), held, load, dt)
    for ours, alone in zip(batch, step, strict=True):
        np.testing.assert_allclose(ours, np.stack([alone, alone]), rtol=1e-12, atol=1e-15 * np.abs(alone).max())
