"""Logs of one coordinate, as a slide or a joint gives them: kinds of bristles, spoiled samples, what was held."""

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.identify import Log, verdicts
from planarfriction.identify.problem import SOFT, softened
from planarfriction.identify.sensor_errors import Rig
from tests.support.identification_logs import LOAD, PATCH, clean_log, fitted

LAW = pf.LuGre(mu_c=0.25, mu_s=0.4, v_s=0.01, sigma_0=3000.0, sigma_1=3.0, sigma_2=0.75)
FEW = pf.ContactPatch.disc(0.01, cells=3)
"""A patch of few cells, all of which do the same along a line."""
QUICK = {"model": "reduced-published", "starts": 1}


def line(axis="x", *, law=LAW, rate=400.0, load=LOAD, duration=5.0):
    """A grown sine along one axis, with 0.5 % of noise on its wrench."""
    place = {"x": 0, "theta": 2}[axis]
    time = np.arange(round(duration * rate)) / rate
    twist = np.zeros((len(time), 3))
    twist[:, place] = (
        (8.0 if place else 0.05)
        * np.exp(3.0 * (time / time[-1] - 1.0))
        * np.sin(2 * np.pi * 0.9 * time)
    )
    log = clean_log(time, twist, law=law, load=load)
    wrench = np.where(np.arange(3) == place, log.wrench, 0.0)
    wrench[:, place] += (
        0.005
        * wrench.std(axis=0)[place]
        * np.random.default_rng(0).standard_normal(len(time))
    )
    return Log(time, twist, wrench, load, f"{axis} {load:g} N")


@pytest.fixture(scope="module")
def slide():
    return line()


@pytest.fixture(scope="module")
def found(slide):
    return fitted(slide, PATCH, **QUICK)


def right(found, names, law=LAW):
    for name in names:
        assert found.identifiable(name), name
        assert found.estimates[name] == pytest.approx(
            getattr(law, name), abs=4.0 * found.errors[name]
        ), name


# ---------------------------------------------------------------------- what a log holds


def test_channels_of_zeros_are_not_measured(slide):
    assert slide.channels.tolist() == [True, False, False]
    assert line("theta", duration=0.5).channels.tolist() == [False, False, True]
    assert {each.name for each in Rig([slide], ("bias",)).columns} == {
        "bias_fx",
        "zero_drift_fx",
    }


@pytest.mark.parametrize(
    ("heading", "axis"),
    [("t,vx,fx", "x"), ("time [s],velocity [m/s],force [N]", "x"), ("t,y,fy", "y"), ("t,omega,tau", "theta"),
     ("time,angle [rad],torque [N m]", "theta")],
)  # fmt: skip
def test_files_of_one_coordinate(tmp_path, heading, axis):
    time = np.arange(100) / 100.0
    way = 0.01 * np.sin(3.0 * time)
    force = -np.cos(3.0 * time)
    speed = "v" in heading or "omega" in heading
    path = tmp_path / "log.csv"
    rows = np.stack([time, 0.03 * np.cos(3.0 * time) if speed else way, force], -1)
    path.write_text(
        heading
        + "\n"
        + "\n".join(",".join(map(repr, row)) for row in rows.tolist())
        + "\n"
    )
    read = Log.from_csv(path, normal_force=20.0)
    place = ("x", "y", "theta").index(axis)
    assert read.twist[:, place] == pytest.approx(0.03 * np.cos(3.0 * time), abs=1e-4)
    assert np.array_equal(read.wrench[:, place], force)
    assert not read.twist[:, np.arange(3) != place].any()
    given = {"velocity": 0.03 * np.cos(3.0 * time)} if speed else {"position": way}
    same = Log.from_axis(time, force, 20.0, axis=axis, **given)
    assert np.array_equal(read.wrench, same.wrench) and np.allclose(
        read.twist, same.twist, rtol=0.0, atol=1e-15
    )


# ---------------------------------------------------------------------- what comes out


def test_a_slide_tells_the_law_and_its_bristles(found):
    assert "contact_radius" not in found.names
    assert (
        found.law.elasto_plastic is None
        and found.scores[0].bristles == "plain bristles"
    )
    assert found.scores[0].held_out < 1.2 < 2.0 < found.scores[1].held_out
    right(found, ("mu_c", "mu_s", "v_s", "gamma", "sigma_0", "sigma_2"))
    assert "fy and tau are 0 throughout" in found.table().lower().replace("\n", " ")


def test_elasto_plastic_bristles_are_told_from_plain_ones():
    law = dataclasses.replace(LAW, elasto_plastic=0.9)
    found = fitted(line(law=law), PATCH, **QUICK)
    assert found.law.elasto_plastic == pf.ElastoPlastic(0.9)
    right(found, ("mu_c", "mu_s", "sigma_0"), law)


def test_a_joint_tells_the_law_from_torque_alone():
    right(fitted(line("theta"), PATCH, **QUICK), ("mu_c", "mu_s", "v_s", "sigma_0"))


def test_the_figure_of_one_coordinate_shows_loops(found):
    figure = found.plot()
    labels = [axes.get_xlabel() for axes in figure.axes]
    assert labels[-2:] == ["velocity [m/s]", "displacement since reversal [mm]"]
    assert len(figure.axes) == 7
    over_speed, over_way = (axes.get_lines()[0] for axes in figure.axes[-2:])
    (history,) = found.histories
    longest = 5e3 * found.law.mu_s / found.law.sigma_0  # [mm]
    assert over_speed.get_xdata() == pytest.approx(history["twist"][:, 0])
    assert over_speed.get_ydata() == pytest.approx(history["measured"][:, 0])
    way = over_way.get_xdata()
    assert 0.5 * longest < np.nanmax(np.abs(way)) <= longest * (1.0 + 1e-9)
    steps = np.diff(way)
    speed = history["twist"][:, 0]
    time = history["time"]
    whole = (
        np.isfinite(steps)
        & (speed[1:] * speed[:-1] > 0.0)
        & (np.arange(len(steps)) > 2)
    )
    assert np.median(
        steps[whole] / (500.0 * (speed[1:] + speed[:-1]) * np.diff(time))[whole]
    ) == pytest.approx(1.0)


def test_the_loss_is_that_of_scipy():
    residual = np.array([-40.0, -1.0, 0.0, 0.3, 3.0, 1e3])
    soft, slopes = softened(residual)
    assert soft**2 == pytest.approx(
        SOFT**2 * 2.0 * (np.sqrt(1.0 + (residual / SOFT) ** 2) - 1.0), rel=1e-12
    )
    assert slopes == pytest.approx(
        (softened(residual + 1e-6)[0] - softened(residual - 1e-6)[0]) / 2e-6, rel=1e-6
    )


def test_spoiled_samples_are_left_out(slide):
    wrench = slide.wrench.copy()
    wrench[np.random.default_rng(1).choice(len(wrench), 42, replace=False), 0] += 0.5
    spoiled = dataclasses.replace(slide, wrench=wrench)
    plain, robust = (
        fitted(spoiled, PATCH, loss=loss, **QUICK) for loss in ("linear", "soft_l1")
    )
    assert plain.scores[0].rejected
    right(robust, ("mu_c", "mu_s", "v_s", "sigma_0"))
    assert (
        "42 values are off by more than 6 times the noise: they were left out"
        in robust.summary().replace("\n", " ")
    )


# ---------------------------------------------------------------------- what was held, and what cannot be so


def test_a_fit_says_what_it_holds_and_where_it_would_go(slide):
    start = {name: getattr(LAW, name) for name in ("gamma", "sigma_1", "sigma_2")}
    names = ("mu_c", "mu_s", "v_s", "sigma_0")
    fine = (
        fitted(slide, PATCH, parameters=names, start=start, **QUICK)
        .table()
        .replace("\n", " ")
    )
    assert (
        "Sigma_2 is fixed at 0.75 s/m; the residuals agree" in fine
        and "contradict" not in fine
    )
    start["sigma_2"] = 0.5
    off = fitted(slide, PATCH, parameters=names, start=start, **QUICK)
    text = off.table().replace("\n", " ")
    assert "Sigma_2 is fixed at 0.5 s/m; the residuals contradict it: 0.7" in text
    assert not off.identifiable("mu_c")


def test_a_zero_that_drifts_more_than_any_rig_rejects_a_fit(slide):
    far = np.zeros((len(slide.time), 3))
    far[:, 0] = 0.25 * np.abs(slide.wrench).max() * np.linspace(-1.0, 1.0, len(far))
    found = fitted(
        dataclasses.replace(slide, wrench=slide.wrench + far), PATCH, **QUICK
    )
    assert "it needs zero_drift_fx" in found.summary().replace("\n", " ")
    assert not any(map(found.identifiable, found.names))


def test_bounds_are_called_by_their_names():
    evidence = verdicts.Evidence(
        names=("mu_c", "mu_s"), values=np.array([0.1, 0.6]), errors=np.zeros(2), correlations=np.eye(2),
        at_bound=np.array([False, True]), jacobian=np.ones((2, 2)), speeds=np.geomspace(1e-4, 1.0, 500),
        spins=np.zeros(500), loads=np.ones(1),
    )  # fmt: skip
    assert (
        str(verdicts.judge_parameter(evidence, 1))
        == "mu_s: not identifiable, the fit ran into the bound 0.6 -"
    )
    low = dataclasses.replace(evidence, values=np.array([0.1, 0.1]))
    assert "no friction above mu_c was seen: equal to mu_c" in str(
        verdicts.judge_parameter(low, 1)
    )
    alone = {
        "names": ("mu_s",),
        "errors": np.zeros(1),
        "correlations": np.eye(1),
        "at_bound": np.array([True]),
    }
    for held, words in (
        (0.1, "the fit ran into the bound 0.6"),
        (0.6, "no friction above mu_c was seen"),
    ):
        held = dataclasses.replace(
            evidence,
            values=np.array([0.6]),
            jacobian=np.ones((2, 1)),
            held_mu_c=held,
            **alone,
        )
        assert words in str(verdicts.judge_parameter(held, 0))


# ---------------------------------------------------------------------- stiffness and load


@pytest.mark.parametrize("fixed", [True, False])
def test_two_loads_tell_if_the_stiffness_grows_with_them(fixed):
    """A stiffness that does not grow is one of 3000 f_ref/f_N per load at each load."""
    laws = {
        load: dataclasses.replace(LAW, sigma_0=3000.0 * (2.0 / load if fixed else 1.0))
        for load in (2.0, 5.0)
    }
    logs = [line(law=law, load=load) for load, law in laws.items()]
    found = fitted(logs, FEW, model="distributed", starts=1)
    assert (found.model.pad is not None) == fixed
    wanted = 3000.0 * (2.0 / found.model.pad.normal_force if fixed else 1.0)
    assert found.estimates["sigma_0"] == pytest.approx(
        wanted, abs=4.0 * found.errors["sigma_0"]
    )
    assert isinstance(found.model, pf.DistributedModel) and found.model.law == found.law


@pytest.mark.parametrize("fixed", [True, False])
def test_a_load_that_varies_within_a_log_tells_it_too(fixed):
    """One log, whose load swings from 2 to 6 N while bristles load and slide."""
    log = line()
    pad = pf.Pad.at_load(4.0) if fixed else None
    loads = 4.0 + 2.0 * np.sin(2.0 * np.pi * 0.37 * log.time)
    model = pf.DistributedModel(FEW, LAW, pad=pad)
    wrench = pf.rollout(
        model, None, log.twist[1:], loads[1:], float(log.time[1])
    ).wrenches * [1.0, 0.0, 0.0]
    noise = (
        0.005
        * wrench.std()
        * np.random.default_rng(0).standard_normal(wrench.shape)
        * [1.0, 0.0, 0.0]
    )
    log = Log(
        log.time,
        log.twist,
        np.concatenate([np.zeros((1, 3)), wrench + noise]),
        loads,
        held=True,
    )
    found = fitted([log], FEW, model="distributed", starts=1)
    assert (found.model.pad is not None) == fixed
    wanted = LAW.sigma_0 * (4.0 / found.model.pad.normal_force if fixed else 1.0)
    assert found.estimates["sigma_0"] == pytest.approx(
        wanted, abs=4.0 * found.errors["sigma_0"]
    )
    assert "load only" not in found.summary()


def test_at_one_load_a_fixed_stiffness_is_one_per_load():
    """On which the fit of two loads rests; steps of the two are the same to rounding."""
    twists = 0.05 * np.sin(np.linspace(0.0, 9.0, 60))[:, None] * [1.0, 0.5, 60.0]
    law = dataclasses.replace(LAW, sigma_1=0.0)
    own = dataclasses.replace(law, sigma_0=3000.0 * 3.0 / 5.0)
    models = (
        pf.DistributedModel(PATCH, law, pad=pf.Pad.at_load(3.0)),
        pf.DistributedModel(PATCH, own),
    )
    a, b = (pf.rollout(each, None, twists, 5.0, 2e-3).wrenches for each in models)
    assert np.abs(a - b).max() < 1e-12 * np.abs(b).max()


def test_one_load_tells_only_their_product(found):
    assert (
        "One load only: sigma_0 f_N = 5.99e+03 N/m is known"
        in found.summary().replace("\n", " ")
    )
