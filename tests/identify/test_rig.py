"""Effects of a rig on a log are estimated and widen intervals; a model that does not fit gives no estimate."""

import dataclasses
import importlib
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.derivatives import PARAMETERS, parameters_of
from planarfriction.identify import Log, search
from planarfriction.identify.parameters import scaled_patch
from planarfriction.identify.search import condensed
from planarfriction.identify.sensor_errors import jitter, smoothed
from planarfriction.identify.simulators import (
    SIMULATORS,
    DistributedSimulator,
    Prediction,
    ReducedSimulator,
)
from tests.support.identification_logs import (
    LAW,
    LOAD,
    PATCH,
    clean_log,
    excitation,
    fitted,
    noisy,
    truth,
)

KNOWN = {
    name: getattr(LAW, name)
    for name in ("mu_s", "v_s", "gamma", "sigma_0", "sigma_1", "sigma_2")
}
FEW = {
    "parameters": ("mu_c", "contact_radius"),
    "start": KNOWN,
    "starts": 1,
    "model": "reduced-published",
}


@pytest.fixture(scope="module")
def log():
    return clean_log(*excitation(duration=1.0))


def changed(log, **changes):
    values = {
        "time": log.time,
        "twist": log.twist,
        "wrench": log.wrench,
        "normal_force": log.normal_force,
    }
    return Log(**{**values, **changes})


def rig(found):
    return {each.name: each for each in found.rig}


# ------------------------------------------------------------------------------------------------ closed forms


def test_the_triangle_has_the_sums_of_all_rows():
    random = np.random.default_rng(0)
    jacobian = random.standard_normal((50, 4))
    off = random.standard_normal(50)
    few, triangle = condensed(off, jacobian)
    assert triangle.shape == (5, 4)
    assert triangle.T @ triangle == pytest.approx(jacobian.T @ jacobian, rel=1e-12)
    assert triangle.T @ few == pytest.approx(jacobian.T @ off, rel=1e-12)
    assert few @ few == pytest.approx(off @ off, rel=1e-12)


def test_jitter_sees_noise_through_motion_and_steps():
    """4000 samples tell a spread to 2 %; a tenth of the samples jump."""
    time = np.arange(4000) * 1e-3
    noise = np.random.default_rng(0).standard_normal((4000, 1))
    steps = 50.0 * np.sign(np.sin(2 * np.pi * 12.0 * time))[:, None]
    assert jitter(noise + 100.0 * np.sin(9.0 * time)[:, None] + steps) == pytest.approx(
        [1.0], rel=0.08
    )


def test_smoothing_leaves_what_it_says_and_no_more_than_half():
    """Stein's estimate of the error is right to a quarter; a clean twist stays to the bit."""
    time, twist = excitation(duration=4.0, rate=200.0)
    spread = 0.01 * np.sqrt(np.mean(twist**2, axis=0))
    seen = twist + spread * np.random.default_rng(1).standard_normal(twist.shape)
    smooth = smoothed(Log(time, seen, np.ones_like(twist), LOAD))
    error = np.sqrt(np.mean((smooth.values - twist) ** 2, axis=0))
    assert smooth.noise == pytest.approx(spread, rel=0.1)
    assert smooth.left == pytest.approx(error, rel=0.25)
    assert (error < 0.5 * spread).all()
    assert np.sqrt(
        np.mean(smooth.error(np.random.default_rng(2)) ** 2, axis=0)
    ) == pytest.approx(smooth.left)
    assert np.array_equal(
        smoothed(Log(time, twist, np.ones_like(twist), LOAD)).values, twist
    )


@pytest.mark.parametrize("kind", [DistributedSimulator, ReducedSimulator])
def test_a_scaled_and_moved_patch_through_its_twists(kind):
    """The same as the model of the patch that was really scaled and moved, to rounding."""
    patch = pf.ContactPatch.rectangle(0.02, 0.01, (6, 4))
    simulator = kind(patch, LAW)
    moved = scaled_patch(patch, 1.3, np.array([0.002, -0.003]))
    model = (pf.DistributedModel if kind is DistributedSimulator else pf.ReducedModel)(
        moved, LAW
    )
    vector = parameters_of(pf.ReducedModelPublished(patch, LAW))
    vector[
        [PARAMETERS.index(name) for name in ("contact_radius", "centre_x", "centre_y")]
    ] = (
        moved.contact_radius(),
        0.002,
        -0.003,
    )
    twists = (
        0.01 * np.random.default_rng(0).standard_normal((40, 3)) * [1.0, 1.0, 100.0]
    )
    expected = pf.rollout(model, None, twists, LOAD, 1e-3).wrenches
    found = simulator.wrenches(twists, np.full(40, LOAD), 1e-3, vector)
    assert np.abs(found - expected).max(axis=0) == pytest.approx(
        0.0, abs=1e-9 * np.abs(expected).max()
    )


def test_without_load_the_bristles_are_forgotten():
    model = pf.DistributedModel(PATCH, LAW)
    vector = parameters_of(pf.ReducedModelPublished(PATCH, LAW))
    vector[PARAMETERS.index("contact_radius")] = PATCH.contact_radius()
    twists = np.tile([1e-3, 0.0, 0.0], (30, 1))
    loads = np.full(30, LOAD)
    loads[10:15] = 0.0
    found = DistributedSimulator(PATCH, LAW).wrenches(twists, loads, 1e-3, vector)
    assert found == pytest.approx(
        pf.rollout(model, None, twists, loads, 1e-3).wrenches, rel=1e-9, abs=1e-12
    )


@pytest.mark.parametrize("kind", ["reduced-published", "distributed", "reduced"])
def test_derivatives_of_all_models_agree_with_differences(kind, log):
    """Central differences over 1e-4: the same in the mean to 1 %, not in the few samples whose bristles meet a kink."""
    prediction = Prediction(SIMULATORS[kind](PATCH, LAW), log, log.twist)
    vector = parameters_of(pf.ReducedModelPublished(PATCH, LAW))
    names = ["mu_c", "gamma", "sigma_1", "contact_radius"]
    _, slopes, later = prediction.sensitivities(vector, names, 1.3e-3)
    for i, name in enumerate(names):
        change = 1e-4 * vector * (np.array(PARAMETERS) == name)
        high, low = (
            prediction.wrenches(vector + sign * change, 1.3e-3) for sign in (1.0, -1.0)
        )
        expected = (high - low) / (2.0 * change.sum())
        off = np.abs(slopes[:, :, i] - expected).mean(axis=0)
        assert (off < 1e-2 * np.abs(expected).mean(axis=0)).all(), name
    high, low = (
        prediction.wrenches(vector, 1.3e-3 + sign * 1e-6) for sign in (1.0, -1.0)
    )
    assert later == pytest.approx((high - low) / 2e-6, abs=1e-5 * np.abs(later).max())


# ------------------------------------------------------------------------------------------------ what a rig adds


def test_a_delay_is_found_and_makes_the_damping_uncertain(log):
    """The wrench comes 4 ms late. With the delay free sigma_1 is told several times worse: that is the truth."""
    late = np.vstack([np.repeat(log.wrench[:1], 4, axis=0), log.wrench[:-4]])
    seen = noisy(changed(log, wrench=late), 1)
    options = {"starts": 1, "model": "reduced-published"}
    found = fitted(seen, PATCH, **options)
    without = fitted(seen, PATCH, nuisance=("bias",), **options)
    delay = rig(found)["delay"]
    assert delay.value == pytest.approx(4e-3, abs=3.0 * delay.error)
    assert delay.error < 4e-4
    for name, value in truth().items():
        assert found.estimates[name] == pytest.approx(
            value, abs=4.0 * found.errors[name]
        ), name
    assert abs(without.estimates["sigma_1"] - 30.0) > 4.0 * found.errors[
        "sigma_1"
    ] or not without.identifiable("sigma_1")
    free = fitted(noisy(log, 1), PATCH, **options)
    held = fitted(noisy(log, 1), PATCH, nuisance=(), **options)
    assert free.errors["sigma_1"] > 2.0 * held.errors["sigma_1"]


def test_zeros_that_are_off_are_found(log):
    offset = np.array([0.05, -0.03, 2e-4])
    found = fitted(noisy(changed(log, wrench=log.wrench + offset), 2), PATCH, **FEW)
    for name, value in zip(("bias_fx", "bias_fy", "bias_tau"), offset, strict=True):
        assert rig(found)[name].value == pytest.approx(
            value, abs=4.0 * rig(found)[name].error
        )
    assert found.identifiable("mu_c")
    assert found.estimates["mu_c"] == pytest.approx(
        LAW.mu_c, abs=4.0 * found.errors["mu_c"]
    )


def test_a_load_cell_that_drifts_is_found_and_makes_friction_uncertain(log):
    """It shows 5 % more in the end than in the beginning: friction is told to what it was off, and not better."""
    drift = 1.0 + 0.05 * log.time / log.time[-1]
    seen = noisy(changed(log, normal_force=LOAD * drift), 3)
    options = {"starts": 1, "model": "reduced-published"}
    found, fixed = (fitted(each, PATCH, **options) for each in (seen, noisy(log, 3)))
    drift = rig(found)["load_drift"]
    # Half of the change.
    assert drift.value == pytest.approx(-0.025, abs=4.0 * drift.error)
    low, high = found.intervals()["mu_c"]
    assert low < LAW.mu_c < high
    assert found.errors["mu_c"] > 2.0 * fixed.errors["mu_c"]


def test_noise_of_the_twist_is_reported_and_widens(log):
    spread = 0.01 * np.sqrt(np.mean(log.twist**2, axis=0))
    seen = changed(
        log,
        twist=log.twist
        + spread * np.random.default_rng(5).standard_normal(log.twist.shape),
    )
    found = fitted(noisy(seen, 4), PATCH, **FEW)
    quiet = fitted(noisy(log, 4), PATCH, **FEW)
    noise = rig(found)["noise_vx"]
    assert noise.value == pytest.approx(spread[0], rel=0.15)
    # N samples tell the spread of a normal distribution to 1/sqrt(2 N) of it at best.
    best = noise.value / np.sqrt(2.0 * len(log.time))
    assert best < noise.error < 3.0 * best
    # without the errors of the twists in the intervals, 1.7 and 1.9 times those of a quiet twist
    assert found.errors["mu_c"] > 2.5 * quiet.errors["mu_c"]
    assert found.errors["contact_radius"] > 2.5 * quiet.errors["contact_radius"]
    assert found.estimates["contact_radius"] == pytest.approx(
        quiet.estimates["contact_radius"], abs=4.0 * found.errors["contact_radius"]
    )


# ------------------------------------------------------------------------------------------------ choice of the model


@pytest.fixture(scope="module")
def distributed():
    """A log of the distributed model at 200 Hz, made with steps twenty times finer."""
    time, fine = excitation(duration=1.5, rate=4000.0)
    wrench = pf.rollout(
        pf.DistributedModel(PATCH, LAW),
        None,
        0.5 * (fine[1:] + fine[:-1]),
        LOAD,
        time[1],
    ).wrenches
    wrench = np.vstack([np.zeros(3), wrench])[::20]
    return noisy(Log(time[::20], fine[::20], wrench, LOAD), 6)


@pytest.fixture(scope="module")
def chosen(distributed):
    return fitted(distributed, PATCH, starts=1)


def test_the_model_that_made_the_data_is_chosen(chosen):
    assert chosen.chosen == "distributed" and isinstance(
        chosen.model, pf.DistributedModel
    )
    # The best of each.
    scores = {
        each.model: each
        for each in sorted(chosen.scores, key=lambda each: -each.held_out)
    }
    assert set(scores) == {"reduced-published", "distributed", "reduced"}
    assert (
        scores["distributed"].held_out
        < 1.2
        < 2.0
        < scores["reduced-published"].held_out
    )
    assert not scores["distributed"].rejected and scores["reduced-published"].rejected
    values = {**truth(), "contact_radius": float(PATCH.contact_radius())}
    for name, value in values.items():
        assert chosen.estimates[name] == pytest.approx(
            value, abs=4.0 * chosen.errors[name]
        ), name
    assert chosen.identifiable("mu_c")


def test_nothing_is_told_by_a_model_that_is_rejected(distributed):
    found = fitted(distributed, PATCH, starts=1, model="reduced-published")
    assert found.scores[0].rejected
    assert not any(found.identifiable(name) for name in found.names)
    data = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert all(
        not each["identifiable"] and len(each["interval_95"]) == 2
        for each in data["parameters"].values()
    )
    assert "rejected" in found.summary() and "0 fits best" not in found.table()
    assert found.residual_correlations()[1].max() > 0.5


def test_a_load_cell_that_only_the_fit_needs_rejects_it():
    """Twists that are held, read as if they were not: delay and load cell would make up for it, with 5 % off mu_c."""
    model = pf.ReducedModelPublished(
        PATCH, pf.LuGre(mu_c=0.8, sigma_0=1e5, sigma_1=200.0, elasto_plastic=0.9)
    )
    log = Log.from_solution(
        pf.simulate(pf.scenes.driven(model), rtol=1e-7, save_every=1e-3)
    )
    log = dataclasses.replace(log, held=False)
    given = {
        "parameters": ("mu_c", "mu_s", "contact_radius"),
        "start": model.law,
        "model": "reduced-published",
    }
    found = fitted(log, PATCH, starts=1, **given)
    assert abs(rig(found)["load_scale"].value) > 0.02
    assert found.scores[0].rejected and not any(map(found.identifiable, found.names))
    assert "it needs load_scale" in " ".join(found.summary().split())
    assert fitted(log, PATCH, starts=1, nuisance=(), **given).estimates[
        "mu_c"
    ] == pytest.approx(0.8, rel=2e-3)


def test_a_table_fits_eighty_columns_and_a_repl(chosen):
    lines = chosen.table().splitlines()
    assert max(map(len, lines)) <= 80
    assert (
        lines[0].startswith("parameter")
        and lines[1].startswith("mu_c")
        and " to " in lines[1]
    )
    assert lines[9].startswith("reduced chi-square")
    strongest = np.abs(chosen.correlations - np.eye(len(chosen.names))).max()
    assert lines[11] == "correlations of 0.5 and more" and lines[12].endswith(
        f"{strongest:.3f}"
    )
    assert repr(chosen) == str(chosen) == chosen.table()
    assert chosen._repr_html_().startswith("<pre>parameter")


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["exact", "delay", "drift", "bias", "twist", "distributed", "rim"]
)
def test_intervals_hold_the_truth(name, monkeypatch):
    """Six seeds must hold 85 % of up to 48 intervals: three standard deviations below 95 %."""
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "docs")
    script = importlib.import_module("make_coverage")
    row = script.ROWS[name]
    count = script.Count()
    data = script.truth(row)
    for seed in range(6):
        script.counted(row, data, seed, count)
    told = sum(count.told.values())
    assert sum(count.inside_told.values()) >= 0.85 * told
    if name == "rim":
        assert count.rejected == 6 and told == 0
    else:
        assert count.told["mu_c"] == 6 and all(
            count.told[each] >= 5 for each in script.NAMES if each != "sigma_1"
        )


def test_a_model_begins_where_the_lead_ended_and_at_the_best_guess(monkeypatch):
    tried = []
    monkeypatch.setattr(
        search, "multistart", lambda problem, starts, noise: tried.extend(starts)
    )
    monkeypatch.setattr(search, "misfit", lambda problem, values, noise: values[0])
    search.warm_start(
        None,
        SimpleNamespace(values=np.array([5.0])),
        [np.array([3.0]), np.array([2.0])],
        noise=None,
    )
    assert tried == [5.0, 2.0]


def test_a_search_ends_where_kept_derivatives_promise_what_is_not_there():
    """Steps from derivatives that are a little off miss the minimum by less than shows in the cost."""
    random = np.random.default_rng(0)
    slopes = random.normal(size=(300, 3))
    noise = random.normal(size=300)
    kept = slopes + 0.03 * random.normal(size=slopes.shape)
    seen = []

    def residuals(x):
        seen.append(x)
        return noise + slopes @ x, kept

    descent = search.Descent(residuals, np.ones(3), 1e-6)
    descent.run((np.full(3, -np.inf), np.full(3, np.inf)))
    left = np.linalg.lstsq(slopes, -noise, rcond=None)[1][0]
    assert descent.cost == pytest.approx(0.5 * left, rel=1e-4)
    assert len(seen) < 8
