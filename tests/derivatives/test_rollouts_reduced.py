"""Derivatives of roll-outs of the reduced model: closed forms, kinks, differences, and backwards against forwards."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import derivatives
from planarfriction.errors import InvalidValueError

LAWS = {
    "plain": pf.LuGre(mu_s=1.2),
    "elasto-plastic": pf.LuGre(mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.9)),
    "early": pf.LuGre(mu_c=0.7, mu_s=1.2, gamma=1.5, elasto_plastic=pf.ElastoPlastic(0.3)),
}
PATCH = pf.ContactPatch.from_pressure([[0.0, 3.0, 1.0], [2.0, 5.0, 0.0]], 0.005)
LOAD, DT, T = 2.0, 1e-4, 12
NAMES = ("sigma_0", "sigma_1", "sigma_2", "mu_c", "mu_s", "v_s", "breakaway_ratio")

every_law = pytest.mark.parametrize("law", LAWS)


@functools.cache
def model_of(law: str = "elasto-plastic") -> pf.ReducedModel:
    return pf.ReducedModel(PATCH, LAWS[law], segments=8, speeds=8, parts=1)


def scale_of(model) -> np.ndarray:
    """Return the factors that turn speeds [m/s] into twists."""
    return np.array([1.0, 1.0, 1.0 / model.reduction.shape_at(LOAD).contact_radius])


def drive(model, seed: int = 0, speed: float = 3e-3, steps: int = T):
    """A state; a random walk in the space of twists that starts, slides, spins, turns back; loads."""
    random = np.random.default_rng(seed)
    twists = np.cumsum(random.normal(size=(steps, 3)), axis=0) * speed * scale_of(model)
    return random.normal(size=3) * min(4e-7, 0.1 * speed), twists, random.uniform(1.0, 3.0, steps)


def bars_of(model, seed: int = 1):
    """Cotangents of wrenches and of the last state that weigh all of them alike."""
    random = np.random.default_rng(seed)
    return random.normal(size=(T, 3)) * scale_of(model), random.normal(size=3) * 1e6


# ---------------------------------------------------------------------- the roll-out


def test_parameters_take_the_place_of_the_models_own():
    assert derivatives.parameter_names(model_of()) == NAMES
    assert derivatives.parameter_names(pf.ReducedModelPublished(PATCH, LAWS["plain"])) == derivatives.PARAMETERS
    assert derivatives.parameters_of(model_of("early")).tolist() == [1e6, 800.0, 0.2, 0.7, 1.2, 1e-3, 0.3]
    other = pf.LuGre(0.4, 0.9, 2e-3, 3e5, 50.0, 0.7, elasto_plastic=pf.ElastoPlastic(0.5))
    changed, (state, twists, loads) = pf.ReducedModel(PATCH, other, segments=8, speeds=8, parts=1), drive(model_of())
    got = derivatives.rollout(model_of(), state, twists, loads, DT, parameters=derivatives.parameters_of(changed))
    assert np.array_equal(got.wrenches, derivatives.rollout(changed, state, twists, loads, DT).wrenches)


# ---------------------------------------------------------------------- closed forms


@every_law
def test_steady_sliding_scales_with_the_friction_and_with_the_speed(law):
    """`W_d` dry, `W_v` viscous: `mu_c W_c + mu_s W_s = W_d` and `W_V V = W_v - v_s W_vs`; bristles leave no trace."""
    model, twist = model_of(law), np.array([2e-3, -1e-3, 0.3])
    _, wrenches, slopes = derivatives.rollout_jacobian(model, model.rest(), twist[None], LOAD, 1e6)
    by, numbers = dict(zip(NAMES, slopes[0].T, strict=True)), model.law
    factor = model.reduction.shape_at(LOAD).factor
    viscous = -LOAD * numbers.sigma_2 * factor.T @ factor @ twist
    units, by_speed = 1.0 / scale_of(model), model.step_jacobians(model.rest(), twist, LOAD, 1e6).wrench_twist @ twist
    dry = (wrenches[0] - viscous) / units
    # Rounding, and what the bristles remember: 1e-9 of the step.
    assert (numbers.mu_c * by["mu_c"] + numbers.mu_s * by["mu_s"]) / units == pytest.approx(dry, rel=1e-7, abs=1e-8)
    assert numbers.v_s * by["v_s"] / units == pytest.approx((viscous - by_speed) / units, rel=1e-6, abs=1e-8)
    assert np.abs(by["v_s"]).max() > 1.0 and np.abs(by["mu_s"]).max() > 0.01
    assert numbers.sigma_2 * by["sigma_2"] == pytest.approx(viscous, rel=1e-12)
    for name in ("sigma_0", "sigma_1", "breakaway_ratio"):
        assert by[name] * max(getattr(numbers, name, 1.0), 1.0) / units == pytest.approx(np.zeros(3), abs=1e-8), name


@every_law
def test_at_rest_the_state_stays_and_pulls_as_a_spring(law):
    """`W = -F' (sigma_0 (z + F V dt) + (sigma_1 + sigma_2) F V) f_N` for vanishing twists."""
    model, state = model_of(law), np.array([3e-7, -2e-7, 1e-7])
    numbers, factor, (wrench_bar, state_bar) = model.law, model.reduction.shape_at(LOAD).factor, bars_of(model)
    bar = wrench_bar[:1]
    got = derivatives.rollout_vjp(model, state, np.zeros((1, 3)), LOAD, DT, bar, state_bar)
    push = numbers.sigma_0 * DT + numbers.sigma_1 + numbers.sigma_2
    assert got.state == pytest.approx(state_bar - numbers.sigma_0 * LOAD * factor @ bar[0], rel=1e-13)
    assert got.twist[0] == pytest.approx(factor.T @ (DT * state_bar - push * LOAD * factor @ bar[0]), rel=1e-12)
    assert got.parameters == pytest.approx([-LOAD * bar[0] @ factor.T @ state, 0, 0, 0, 0, 0, 0], rel=1e-13)
    assert float(got.normal_force) == pytest.approx(got.parameters[0] * numbers.sigma_0 / LOAD, rel=1e-13)
    _, wrenches, slopes = derivatives.rollout_jacobian(model, state, np.zeros((2, 3)), LOAD, DT)
    assert wrenches[1] == pytest.approx(-LOAD * numbers.sigma_0 * factor.T @ state, rel=1e-13)
    assert slopes[1, :, 0] == pytest.approx(wrenches[1] / numbers.sigma_0, rel=1e-13)
    assert not slopes[..., 1:].any()


# ---------------------------------------------------------------------- kinks


@every_law
def test_gradients_are_finite_at_every_kink(law):
    model, z = model_of(law), np.array([4e-7, -3e-7, 2e-7])
    x, y = PATCH.centre_of_pressure()
    spin = np.array([0.5 * y, -0.5 * x, 0.5])  # about the centre of pressure
    twists = [np.zeros(3), spin, -spin, 1e-300 * spin, 1e-140 * spin, [1e-3, 0, 0], [0, 1e-3, 0], [1e-3, 1e-3, 0]]
    factor = model.reduction.shape_at(LOAD).factor
    twists.append(np.linalg.solve(factor, -z / DT))  # takes z to zero
    states = np.array([np.zeros(3), z, 1e-300 * z, 1e-160 * z, -z, 1e4 * z])[:, None, None]
    held = np.repeat(np.array(twists)[:, None, None], 2, axis=2)  # [9, 1, 2, 3]
    loads = np.array([[0.0, 0.0], [LOAD, LOAD]])
    for dt in (0.0, 1e-12, DT, 1e9):
        gradient = derivatives.rollout_vjp(model, states, held, loads, dt, np.ones((2, 3)), np.ones(3))
        slopes = derivatives.rollout_jacobian(model, states, held, loads, dt)
        for value in (*gradient, *slopes):
            assert np.isfinite(value).all(), dt


def test_without_load_nothing_passes_but_the_load():
    model = model_of()
    state, twists, loads = drive(model)
    loads[6] = 0.0
    bar = np.ones((T, 3)) * (np.arange(T) >= 6)[:, None]
    gradient = derivatives.rollout_vjp(model, state, twists, loads, DT, bar, np.ones(3))
    _, wrenches, slopes = derivatives.rollout_jacobian(model, state, twists, loads, DT)
    assert str(wrenches[6]) == "[0. 0. 0.]" == str(derivatives.rollout(model, state, twists, loads, DT).wrenches[6])
    assert not slopes[6].any() and slopes[5].any()
    assert not gradient.state.any() and not gradient.twist[:7].any() and not gradient.normal_force[:6].any()
    assert gradient.twist[7:].all()
    # The slope to the load: the wrench per newton that a small load would have.
    before = derivatives.rollout_states(model, state, twists, loads, DT).states[6]
    assert gradient.normal_force[6] == pytest.approx(model.step(before, twists[6], 1e-3, DT)[1].sum() / 1e-3, rel=1e-10)


# ---------------------------------------------------------------------- against differences


def differences(model, inputs: dict, units: dict, bars, name: str) -> np.ndarray:
    """Central differences of the value that `bars` make, per unit."""

    def value(change: np.ndarray) -> float:
        of = {**inputs, name: inputs[name] + change * units[name]}
        end, wrenches = derivatives.rollout(
            model, of["state"], of["twist"], of["normal_force"], DT, parameters=of["parameters"]
        )
        return float((bars[0] * wrenches).sum() + (bars[1] * end).sum())

    found = np.empty_like(inputs[name])
    for index in np.ndindex(found.shape):
        step = np.zeros_like(found)
        step[index] = 1e-5
        found[index] = (value(step) - value(-step)) / 2e-5
    return found


def compare_with_differences(model, state, twists, loads, speed, parameters) -> None:
    inputs = {"state": state, "twist": twists, "normal_force": loads, "parameters": parameters}
    units = {
        "state": 1e-6,
        "twist": speed * scale_of(model),
        "normal_force": 1.0,
        "parameters": np.maximum(parameters, 1e-3),
    }
    bars = bars_of(model)
    gradient = derivatives.rollout_vjp(model, state, twists, loads, DT, *bars, parameters=parameters)
    for name, of in gradient._asdict().items():
        scaled, expected = of * units[name], differences(model, inputs, units, bars, name)
        # Differences lose 1e-16/1e-5 to rounding of numbers near 100 and (1e-5)^2 to truncation, but 1e-6 or so of the
        # largest slope where the curvature jumps (squares of the map, ends of the elasto-plastic range).
        allowed = 1e-6 * np.abs(scaled).max() + 1e-8
        assert scaled == pytest.approx(expected, rel=1e-6, abs=allowed), name


def test_the_gradient_holds_where_the_floor_carries_the_steady_state():
    """Static friction far below dynamic friction, and slow: less dissipation than the floor allows."""
    model, parameters = model_of(), derivatives.parameters_of(model_of())
    parameters[4] = 0.1 * parameters[3]
    state, twists, loads = drive(model, 3, 2e-4)
    compare_with_differences(model, state, twists, loads, 2e-4, parameters)
    slopes = derivatives.rollout_jacobian(
        model, state, twists[:1], LOAD, 1e6, ["mu_c"], parameters=parameters
    ).d_wrenches
    assert np.abs(slopes).max() > 0.1 * LOAD  # the floor is a share of mu_c


def test_the_slope_to_a_breakaway_at_once_is_that_of_its_right_side():
    model, parameters = model_of("early"), derivatives.parameters_of(model_of("early"))
    parameters[-1] = 0.0
    state, twists, loads = drive(model, 3)
    slopes = derivatives.rollout_jacobian(
        model, state, twists, loads, DT, ["breakaway_ratio"], parameters=parameters
    ).d_wrenches
    values = [
        derivatives.rollout(model, state, twists, loads, DT, parameters=[*parameters[:-1], b]).wrenches
        for b in (0.0, 1e-5, 2e-5)
    ]
    expected = (4.0 * values[1] - 3.0 * values[0] - values[2]) / 2e-5
    assert slopes[..., 0] * [1.0, 1.0, 200.0] == pytest.approx(expected * [1.0, 1.0, 200.0], rel=1e-4, abs=1e-5)
    assert np.abs(slopes).max() > 0.1


# ---------------------------------------------------------------------- errors

FINGER = pf.ContactPatch.rectangle(
    0.02, cells=21, pressure=pf.SoftFinger(c=6 * 0.02 / 21, n=1 / 3, k=2.0, radius_max=0.01)
)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"state": np.zeros(2)}, r"state must have shape \[..., 3\]"),
        ({"twist": np.full((T, 3), np.nan)}, "twist must be finite"),
        ({"normal_force": -1.0}, "normal_force must be >= 0, got -1.0"),
        ({"parameters": np.ones(12)}, r"parameters must have shape \[..., 7\], got shape \[12\]"),
        ({"parameters": np.ones(7)}, r"breakaway_ratio must be in \[0, 1\), got 1.0"),
        ({"parameters": np.zeros(7)}, "sigma_0 must be > 0, got 0.0"),
        ({"model": PATCH}, "model must be one that has compiled roll-outs, got ContactPatch"),
        (
            {"model": pf.ReducedModel(FINGER, LAWS["plain"], load_error=0.0, parts=1)},
            "load_error must be > 0 for derivatives",
        ),
    ],
)
def test_wrong_input_is_one_clear_line(changed, message):
    state, twists, loads = drive(model_of())
    inputs = {"model": model_of(), "state": state, "twist": twists, "normal_force": loads, "dt": DT}
    with pytest.raises(InvalidValueError, match=message) as caught:
        derivatives.rollout_vjp(**{**inputs, "wrenches_bar": np.ones((T, 3)), **changed})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["gamma", "contact_radius", "mu_k"])
def test_what_the_map_holds_is_no_parameter(name):
    with pytest.raises(InvalidValueError, match=f"names must be .*{name}"):
        derivatives.rollout_jacobian(model_of(), *drive(model_of()), DT, names=[name])
