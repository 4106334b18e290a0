"""Identification from logs of twist and wrench: what went in comes out, errors are honest, gaps are named."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.derivatives import PARAMETERS, parameters_of, rollout
from planarfriction.identify import FitOptions, Log, differentiated, search
from planarfriction.identify.logs import columns_of
from planarfriction.identify.parameters import (
    Coordinates,
    scaled_patch,
    soft_finger_moments,
)
from planarfriction.identify.simulators import SIMULATORS
from planarfriction.identify.uncertainty import NEAR, covariance
from planarfriction.identify.verdicts import speed_gap
from planarfriction.identify.wrenches import BEATEN, _like
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


@pytest.fixture(scope="module")
def log():
    """Every parameter moves this log far above 1 % of noise."""
    return clean_log(*excitation(duration=1.0))


def identify(log, patch=PATCH, **options):
    """Identify the model that made the logs, without effects of a rig."""
    return fitted(
        log, patch, **{"model": "reduced-published", "nuisance": (), **options}
    )


def z_scores(log, seeds):
    """Errors over standard errors, `[seeds, F]`."""
    expected = truth()
    rows = []
    for seed in seeds:
        found = identify(noisy(log, seed), PATCH, starts=1)
        assert all(found.identifiable(name) for name in found.names)
        rows.append(
            [
                (value - expected[name]) / found.errors[name]
                for name, value in found.estimates.items()
            ]
        )
    return np.array(rows)


# ------------------------------------------------------------------------------------------------ closed forms


def test_covariance_of_a_line():
    """y = a + b x with unit noise: variances 1/n and 1/sum(x^2) for x about its mean."""
    x = np.linspace(-1.0, 1.0, 11)
    spread = covariance(np.column_stack([np.ones(11), x]), np.array([True, True]))
    assert spread == pytest.approx(np.diag([1 / 11, 1 / (x**2).sum()]), abs=1e-15)


def test_covariance_of_what_is_not_seen():
    """A column of zeros has no finite variance; two equal columns are told only together."""
    x = np.linspace(-1.0, 1.0, 11)
    spread = covariance(np.column_stack([x, np.zeros(11)]), np.array([True, True]))
    assert spread[0, 0] == pytest.approx(1 / (x**2).sum())
    assert np.isinf(spread[1, 1])
    assert (
        np.diag(covariance(np.column_stack([x, x]), np.array([True, True]))).min()
        > 1e15
    )


@pytest.mark.parametrize(
    ("k", "radius", "second"), [(1.0, 1 / 2, 3 / 10), (2.0, 3 * np.pi / 16, 2 / 5)]
)
def test_soft_finger_moments_in_closed_form(k, radius, second):
    """A cone: <s> = 1/2, <s^2> = 3/10; Hertz: 3 pi/16 and 2/5, times R and R^2 with R = c f^n."""
    finger = pf.SoftFinger(c=0.006, n=0.3, k=k)
    (r, r_slopes), (m, m_slopes) = soft_finger_moments(finger, 3.0, {})
    size = 0.006 * 3.0**0.3
    assert (r, m) == pytest.approx((radius * size, second * size**2), rel=1e-12)
    for name in ("c", "n", "k"):
        value = getattr(finger, name)
        change = 1e-6 * getattr(finger, name)
        high, low = (
            soft_finger_moments(finger, 3.0, {name: value + s * change})
            for s in (1.0, -1.0)
        )
        # Differences.
        assert r_slopes[name] == pytest.approx(
            (high[0][0] - low[0][0]) / (2 * change), rel=1e-7
        )
        assert m_slopes[name] == pytest.approx(
            (high[1][0] - low[1][0]) / (2 * change), rel=1e-7
        )


def test_coordinates_and_back():
    names = ("mu_s", "sigma_1", "mu_c", "v_s", "centre_x")
    values = np.array([0.7, 3.0, 0.5, 2e-3, 0.0])
    coordinates = Coordinates(names, values, 1.0)
    x = coordinates.of(values)
    assert coordinates.values(x) == pytest.approx(values, rel=1e-14)
    for i in range(len(names)):
        change = 1e-6 * np.eye(len(names))[i]
        slope = (coordinates.values(x + change) - coordinates.values(x - change)) / 2e-6
        assert coordinates.slopes(x)[:, i] == pytest.approx(slope, rel=1e-8, abs=1e-9)
    low, _ = coordinates.bounds()
    lowest = coordinates.values(np.maximum(low, -3.0))
    assert lowest[0] == lowest[2]  # mu_s is never below mu_c


def test_differentiated_is_exact_for_parabolas():
    """Turned into the body's axes: circling at constant speed along its own x axis."""
    t = np.linspace(0.0, 1.0, 101)
    pose = np.stack([0.2 * t, 0.5 * t**2, 0.3 * t], -1)
    twist = differentiated(t, pose)
    cos = np.cos(0.3 * t)
    sin = np.sin(0.3 * t)
    assert twist == pytest.approx(
        np.stack([0.2 * cos + t * sin, t * cos - 0.2 * sin, 0.3 + 0 * t], -1), abs=1e-12
    )


def test_speed_gaps():
    speeds = np.concatenate([np.geomspace(1e-5, 1e-4, 50), np.geomspace(5e-3, 0.1, 50)])
    assert speed_gap(speeds, 1e-3) == "no sample between 0.1 and 5 mm/s"
    assert speed_gap(speeds, 0.02) == ""
    assert speed_gap(speeds, 1.0) == "no sample above 1e+02 mm/s"
    assert "no sample below 22 and above 98" in speed_gap(
        np.linspace(0.02, 0.1, 50), 1e-3
    )


# ------------------------------------------------------------------------------------------------ what comes out


def test_what_went_in_comes_out(log):
    """Without noise: what is left is the two steps a sample in place of thirty-two, 1e-4 of the wrench."""
    found = identify(log, PATCH, noise=1e-3 * np.abs(log.wrench).max(axis=0))
    for name, value in truth().items():
        assert found.estimates[name] == pytest.approx(value, rel=1e-2), name
    assert all(each.identifiable for each in found.verdicts)
    assert found.starts[0] == found.starts[1] == 4
    assert found.model.surface.contact_radius == pytest.approx(
        found.estimates["contact_radius"], rel=1e-12
    )
    assert found.law.mu_c == found.estimates["mu_c"]
    assert found.law.elasto_plastic == pf.ElastoPlastic(0.9)


def test_errors_are_honest(log):
    """Ten seeds: 80 z-scores have unit spread within 3/sqrt(2 96), none beyond 4."""
    z = z_scores(log, range(10))
    assert abs(np.sqrt(np.mean(z**2)) - 1.0) < 3.0 / np.sqrt(2.0 * z.size)
    assert np.abs(z).max() < 4.0


@pytest.mark.slow
def test_errors_are_honest_for_a_hundred_seeds():
    """Every parameter within 3 standard errors for 95 seeds; spread of each within three of its own errors, 0.21."""
    z = z_scores(clean_log(*excitation()), range(100))
    assert (np.abs(z) < 3.0).all(axis=1).sum() >= 95
    assert (
        np.abs(np.sqrt(np.mean((z - z.mean(axis=0)) ** 2, axis=0)) - 1.0).max() < 0.21
    )


def test_noise_is_estimated_from_the_residuals(log):
    found = identify(noisy(log, 3), PATCH, starts=1)
    spread = 0.01 * np.sqrt(np.mean(log.wrench**2, axis=0))
    # Four of its standard errors.
    assert found.noise == pytest.approx(spread, rel=4.0 / np.sqrt(2.0 * len(log.time)))
    assert np.std(np.concatenate(found.residuals)[1:]) == pytest.approx(1.0, rel=0.02)


def test_uneven_samples(log):
    kept = np.sort(np.random.default_rng(0).choice(len(log.time), 700, replace=False))
    thinned = noisy(log, 5)
    thinned = Log(thinned.time[kept], thinned.twist[kept], thinned.wrench[kept], LOAD)
    found = identify(thinned, PATCH, starts=1)
    assert all(
        abs(found.estimates[n] - v) < 4.0 * found.errors[n] + 2e-3 * v
        for n, v in truth().items()
    )


def test_stiff_bristles_get_finer_steps():
    """A bristle that loads within half a sample: two steps a sample put sigma_0 off by 10 %."""
    stiff = dataclasses.replace(LAW, sigma_0=1e6, sigma_1=800.0)
    log = noisy(clean_log(*excitation(duration=1.0), law=stiff), 1)
    options = {
        "parameters": ("mu_c", "sigma_0", "sigma_1"),
        "start": stiff,
        "starts": 1,
    }
    assert identify(log, PATCH, **options).estimates["sigma_0"] == pytest.approx(
        1e6, rel=0.02
    )
    coarse = identify(log, PATCH, refine=1, **options)
    assert abs(coarse.estimates["sigma_0"] / 1e6 - 1.0) > 0.04
    assert any(each.parameter == "fit" for each in coarse.verdicts)


def test_soft_finger_constants_from_three_loads():
    """c and n from logs at three loads; the grid of the patch has the moments of the disc to 2 %."""
    time, twist = excitation(duration=0.6)
    patch = pf.ContactPatch.disc(
        0.012, cells=31, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0)
    )
    start = dataclasses.replace(LAW)
    logs = []
    for load in (1.0, 2.0, 4.0):
        fixed = pf.ContactPatch(
            patch.positions, patch.areas, patch.weights(load) / patch.areas
        )
        logs.append(
            noisy(
                clean_log(time, twist, patch=fixed, load=load, name=f"{load:g} N"),
                int(load),
            )
        )
    guess = pf.ContactPatch.disc(
        0.012, cells=31, pressure=pf.SoftFinger(c=0.0045, n=0.2, k=2.0)
    )
    found = identify(logs, guess, parameters=("mu_c", "c", "n"), start=start, starts=1)
    assert found.estimates["c"] == pytest.approx(0.006, rel=0.02)
    assert found.estimates["n"] == pytest.approx(1 / 3, abs=0.02)
    assert found.model.patch.pressure.c == found.estimates["c"]
    one = identify(logs[0], guess, parameters=("c", "n"), start=start, starts=1)
    assert not one.identifiable("n")
    assert "one load only" in one.table()


# ------------------------------------------------------------------------------------- what cannot be determined


def verdict(found, name):
    return next((str(each) for each in found.verdicts if each.parameter == name), "")


def test_fast_sliding_tells_no_stribeck_curve():
    time = np.arange(1000) * 1e-3
    twist = np.stack(
        [0.05 + 0.02 * np.sin(9 * time), 0.02 * np.cos(7 * time), np.sin(5 * time)], -1
    )
    found = identify(noisy(clean_log(time, twist), 1), PATCH, begins="steady", starts=1)
    assert not found.identifiable("v_s") and not found.identifiable("gamma")
    assert "not identifiable, no sample below 3" in verdict(found, "v_s")
    assert found.estimates["mu_c"] == pytest.approx(
        LAW.mu_c, abs=4.0 * found.errors["mu_c"]
    )
    assert found.estimates["sigma_2"] == pytest.approx(
        LAW.sigma_2, abs=4.0 * found.errors["sigma_2"]
    )


def test_without_spin_the_radius_is_unknown():
    time, twist = excitation(duration=0.6)
    twist[:, 2] = 0.0
    log = clean_log(time, twist)
    found = identify(noisy(log, 1), PATCH, noise=[0.01, 0.01, 1e-4], starts=1)
    assert (
        verdict(found, "contact_radius") == "contact_radius: not identifiable, no spin"
    )
    assert found.identifiable("mu_c")
    assert "contact_radius: no spin" in found.table()


def test_a_contact_that_never_slips_tells_no_friction_coefficient():
    time, twist = excitation(duration=0.6)
    found = identify(noisy(clean_log(time, 5e-4 * twist), 1), PATCH, starts=1)
    for name in ("mu_c", "mu_s", "v_s", "gamma"):
        assert "never slips" in verdict(found, name)
    assert found.estimates["sigma_0"] == pytest.approx(
        LAW.sigma_0, abs=4.0 * found.errors["sigma_0"]
    )


def test_absent_terms_are_bounded_from_above():
    law = dataclasses.replace(LAW, sigma_2=0.0)
    found = identify(
        noisy(clean_log(*excitation(duration=0.6), law=law), 2),
        PATCH,
        start=LAW,
        starts=1,
    )
    low, high = found.intervals()["sigma_2"]
    assert low == 0.0 < high < 0.2
    assert "at most" in verdict(found, "sigma_2")


# ------------------------------------------------------------------------------------------------ files and input


def test_json_and_plot(log, tmp_path):
    import json

    found = identify(
        noisy(log, 0), PATCH, parameters=("mu_c", "sigma_0"), start=LAW, starts=1
    )
    data = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert data["parameters"]["mu_c"]["estimate"] == found.estimates["mu_c"]
    assert data["starts"] == {"agreeing": 1, "total": 1}
    figure = found.plot()
    figure.savefig(tmp_path / "residuals.png")
    assert (tmp_path / "residuals.png").read_bytes().startswith(b"\x89PNG")
    assert len(figure.axes) == 11  # three channels three times, speeds, correlations
    (history,) = found.histories
    lines = [axes.get_lines() for axes in figure.axes]
    measured = history["measured"][:, 1]
    fitted = history["predicted"][:, 1]
    assert lines[2][0].get_ydata() == pytest.approx(measured, rel=1e-12)  # fy in N
    assert lines[2][1].get_ydata() == pytest.approx(fitted, rel=1e-12)
    assert lines[3][0].get_ydata() == pytest.approx(
        (measured - fitted) / found.noise[1], abs=1e-9
    )
    speed, steady = lines[6][1].get_xydata().T
    law = found.law
    level = law.mu_c + (law.mu_s - law.mu_c) * np.exp(
        -((1e-3 * speed / law.v_s) ** law.gamma)
    )
    assert steady == pytest.approx(level + 1e-3 * law.sigma_2 * speed, rel=1e-9)
    assert speed[-1] == pytest.approx(1e3 * history["speed"].max())
    assert lines[6][0].get_xdata().max() == pytest.approx(1e3 * history["speed"].max())
    assert lines[7][0].get_xdata()[1] == pytest.approx(
        1e3 * (log.time[1] - log.time[0])
    )
    assert lines[7][0].get_ydata()[:2] == pytest.approx(
        found.residual_correlations()[:2, 0]
    )
    seen = np.isfinite(history["held_out"][:, 1])
    expected = np.stack([measured, history["held_out"][:, 1]], -1)[seen]
    assert lines[9][0].get_xydata() == pytest.approx(expected, rel=1e-12)


def write(path, log, **changes):
    columns = {**columns_of(log), **changes}
    rows = zip(*columns.values(), strict=True)
    path.write_text(
        "\n".join([",".join(columns), *(",".join(map(str, row)) for row in rows)])
        + "\n"
    )
    return path


def test_log_from_csv_and_back(log, tmp_path):
    read = Log.from_csv(write(tmp_path / "log.csv", log, note=["x"] * len(log.time)))
    assert read.name == "log"
    for name in ("time", "twist", "wrench", "normal_force"):
        assert np.array_equal(getattr(read, name), getattr(log, name)), name


def test_log_of_poses(log, tmp_path):
    """The twist of a pose file is that of the file it was integrated from: 1e-3 of the largest, half a window apart."""
    angle = np.concatenate(
        [
            [0.0],
            np.cumsum(0.5 * (log.twist[1:, 2] + log.twist[:-1, 2]) * np.diff(log.time)),
        ]
    )
    cos = np.cos(angle)
    sin = np.sin(angle)
    world = np.stack(
        [
            cos * log.twist[:, 0] - sin * log.twist[:, 1],
            sin * log.twist[:, 0] + cos * log.twist[:, 1],
        ],
        -1,
    )
    place = np.vstack(
        [
            np.zeros(2),
            np.cumsum(
                0.5 * (world[1:] + world[:-1]) * np.diff(log.time)[:, None], axis=0
            ),
        ]
    )
    columns = columns_of(log)
    kept = {name: columns[name] for name in ("t", "fx", "fy", "tau", "normal_force")}
    path = tmp_path / "poses.csv"
    kept |= {"x": place[:, 0], "y": place[:, 1], "theta": angle}
    path.write_text("\n".join([",".join(kept), *(",".join(map(repr, row)) for row in zip(*(v.tolist() for v in kept.values()), strict=True))]))  # fmt: skip  # noqa: E501
    read = Log.from_csv(path)
    assert np.abs(read.twist - log.twist)[5:-5].max() < 5e-3 * np.abs(log.twist).max()


def test_options_are_a_record():
    assert FitOptions(noise=[1, 2, 3]) == FitOptions(noise=np.array([1.0, 2.0, 3.0]))


def test_discs_grow_and_move_with_their_patch():
    """The simulation through twists is that of the scaled patch, whose radii are scaled too."""
    patch = pf.ContactPatch.rectangle(0.03, 0.02, 11).discs(30)
    law = pf.LuGre(mu_s=1.2)
    scaled = scaled_patch(patch, 1.3, np.array([0.002, -0.001]))
    vector = parameters_of(pf.ReducedModelPublished(patch, law)).copy()
    for name, value in {
        "contact_radius": 1.3 * patch.contact_radius(),
        "centre_x": 0.002,
        "centre_y": -0.001,
    }.items():
        vector[PARAMETERS.index(name)] = value
    twists = np.sin(np.linspace(0, 7, 300)[:, None] * [1, 1.7, 2.3]) * [0.01, 0.01, 1]
    loads = np.ones(300)
    wrenches = SIMULATORS["distributed"](patch, law).wrenches(
        twists, loads, 2e-3, vector
    )
    expected = rollout(
        pf.DistributedModel(scaled, law), None, twists, loads, 2e-3
    ).wrenches
    np.testing.assert_allclose(wrenches, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("cost", [1.0, 0.999 * BEATEN, 1.001 * BEATEN])
@pytest.mark.parametrize("near", [True, False])
def test_bristles_that_lost_in_discs_are_not_fitted_in_cells(cost, near):
    """Only if the best fit, of any model, explains the data; untried bristles have nothing to begin from."""

    def fit(law, cost, own_radius=False):
        kind = SimpleNamespace(own_radius=own_radius)
        problem = SimpleNamespace(law=law, pad=None, kind=kind)
        return SimpleNamespace(
            fit=SimpleNamespace(problem=problem, cost=cost, near=near)
        )

    plain, discs, published = fit("a", cost), fit("b", 1.0), fit("b", 1.0, True)
    for best in (discs, published):
        loses = near and cost > BEATEN
        assert _like(plain.fit.problem, [plain, best]) == (plain.fit, loses)
    candidates = [published, plain, discs]
    assert _like(discs.fit.problem, candidates) == (discs.fit, False)
    assert _like(fit("c", 1.0).fit.problem, candidates) == (None, False)


def test_cells_begin_where_discs_ended_far_from_the_data_too(log):
    """A strip of 30 x 3 mm is no disc: no model explains the log, and only discs are searched from two starts."""
    texts = []
    strip = pf.ContactPatch.rectangle(0.03, 0.003, cells=9)
    options = {"elasto_plastic": 0.9, "starts": 1, "progress": texts.append}
    found = identify(noisy(log, 0), strip, model="auto", **options)
    assert min(each.reduced_chi2 for each in found.scores) > NEAR
    for model, starts in (("reduced", "of 2"), ("distributed", "of 1")):
        searches = [each for each in texts if each.startswith(f"{model}: start")]
        assert starts in searches[0]


def test_what_no_model_explains_ends_as_if_all_searches_went_to_their_ends(
    log, monkeypatch
):
    """Searches that are far from the data end early, and the chosen one goes on: its estimates are the same."""
    strip = pf.ContactPatch.rectangle(0.03, 0.003, cells=9)
    options = {"model": "reduced", "elasto_plastic": 0.9}
    runs = []
    for share in (10.0 * search.FAR, 0.0):
        monkeypatch.setattr(search, "FAR", share)
        texts = []
        found = identify(noisy(log, 0), strip, progress=texts.append, **options)
        runs.append((found, sum("evaluation" in each for each in texts)))
    (early, few), (late, many) = runs
    assert early.scores[0].reduced_chi2 > NEAR
    assert few < 0.8 * many
    off = np.abs(early.values - late.values) / late.standard_errors
    assert off.max() < 0.1
    assert early.verdicts[0].reason.startswith("reduced with")
    assert [each.parameter for each in early.verdicts] == [
        each.parameter for each in late.verdicts
    ]
