"""Plans of experiments: information in closed form, errors as fits have them, motions that tell what is missing."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from click.shell_completion import ShellComplete

import planarfriction as pf
from planarfriction.cli import main
from planarfriction.cli.app import app
from planarfriction.cli.output import write_csv
from planarfriction.identify import (
    Log,
    candidate_motions,
    current_estimate,
    design_experiment,
)
from planarfriction.identify.experiments import MotionPlan, _Information
from planarfriction.identify.logs import columns_of
from planarfriction.identify.parameters import Coordinates
from tests.support.identification_logs import (
    LAW,
    LOAD,
    PATCH,
    clean_log,
    excitation,
    fitted,
    noisy,
)

NOISE = (0.01, 0.01, 6e-5)


@pytest.fixture(scope="module")
def motions():
    """The family by its names."""
    return {
        each.name: each
        for each in candidate_motions(PATCH, LAW, normal_force=LOAD, duration=1.0)
    }


@pytest.fixture(scope="module")
def slide(motions):
    """A noisy log of a slide in one direction, which never spins."""
    time = motions["slide from slow to fast"].time
    twist = motions["slide from slow to fast"].twist
    log = clean_log(time, twist, load=LOAD, name="slide")
    noise = NOISE * np.random.default_rng(3).standard_normal(log.wrench.shape)
    return dataclasses.replace(log, wrench=log.wrench + noise)


def plan(motions, **options):
    return design_experiment(
        PATCH, LAW, **{"motions": list(motions), "noise": NOISE, **options}
    )


def test_friction_of_a_slide_in_closed_form():
    """Without Stribeck effect the force is mu f_N, and the error of mu is noise/(f_N sqrt(n))."""
    law = pf.LuGre(mu_c=0.5, mu_s=0.5, sigma_0=1e6, sigma_1=0.0, sigma_2=0.0)
    time = np.arange(1000) / 1000
    motion = Log(
        time, np.outer(np.full(1000, 0.02), [1.0, 0.0, 0.0]), np.zeros((1000, 3)), 2.0
    )
    found = design_experiment(
        PATCH, law, motions=motion, parameters=["mu_c"], noise=NOISE, nuisance=()
    )
    # mu_s is held, 1 of 1000 samples lies before the bristles are loaded
    assert found.errors[0, 0] == pytest.approx(0.01 / (2.0 * np.sqrt(999)), rel=2e-3)
    assert found.gains[0] == pytest.approx(
        np.log2(found.errors_so_far[0] / found.errors[0, 0]), rel=1e-9
    )


def test_errors_are_those_that_a_fit_has():
    """With 10 % more in a fit's, which allows for what linear errors leave out."""
    log = noisy(clean_log(*excitation(duration=1.0)), 1)
    fit = fitted(log, PATCH, model="reduced-published", starts=1)
    found = design_experiment(PATCH, LAW, motions=log, noise=fit.noise)
    ratio = fit.standard_errors / found.errors[0]
    # The fit's own noise and place move them by a few percent.
    assert (ratio > 0.9).all() and (ratio < 1.4).all(), ratio


def test_information_adds_up_in_any_order(motions):
    first, second = (plan(motions.values()).motions[i] for i in (0, 3))
    one = plan([second], logs=first).errors[0]
    other = plan([first], logs=second).errors[0]
    # Both rest on sums of 1e4 products that cancel in part.
    assert one == pytest.approx(other, rel=1e-3)
    assert (one <= plan([first]).errors[0] * (1.0 + 1e-9)).all()


def test_what_is_missing_comes_next(motions, slide):
    """After a slide that never spins it is spin; for the radius a second slide tells nothing."""
    found = plan(motions.values(), logs=slide)
    assert "spin" in found.best.name or found.best.name == "grown sines"
    assert (np.diff(found.gains) <= 0.0).all() and (found.gains > 0.0).all()
    gains = {
        each.name: gain
        for wanted in [plan(motions.values(), logs=slide, wanted=["contact_radius"])]
        for each, gain in zip(wanted.motions, wanted.gains, strict=True)
    }
    assert (
        gains["slide from slow to fast"] < 0.01 < 5.0 < gains["rotation during a slide"]
    )
    damping = plan(motions.values(), logs=slide, wanted=["sigma_1"])
    assert damping.best.name == "quick reversals"


def test_a_second_load_tells_how_a_soft_finger_grows():
    patch = pf.ContactPatch.disc(
        0.01, cells=11, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0)
    )
    motions = candidate_motions(patch, LAW, normal_force=[2.0, 6.0], duration=0.5)
    spins = [each for each in motions if each.name.startswith("rotation during")]
    options = {"parameters": ("mu_c", "c", "n"), "noise": NOISE, "nuisance": ()}
    log = design_experiment(patch, LAW, motions=spins[0], **options).best
    found = design_experiment(patch, LAW, logs=log, motions=spins, **options)
    assert found.best.name.endswith("6 N")
    errors = dict(
        zip([each.name[-3:] for each in found.motions], found.errors[:, 2], strict=True)
    )
    assert errors["6 N"] < 0.05 < 0.3 < errors["2 N"]


def test_what_the_logs_tell_replaces_the_guess(slide):
    guess = dataclasses.replace(LAW, mu_c=0.3, mu_s=0.9, sigma_1=5e3)
    fit = fitted(slide, PATCH, model="reduced-published", starts=1)
    patch, law = current_estimate(fit, PATCH, guess)
    assert patch is PATCH  # a slide tells no radius
    assert law.mu_c == fit.estimates["mu_c"] and law.mu_s == fit.estimates["mu_s"]
    assert law.sigma_1 == pytest.approx(0.5 * sum(fit.intervals()["sigma_1"]))


def test_motions_keep_to_what_the_rig_can_do():
    for each in candidate_motions(PATCH, LAW, speed=0.02, spin=1.5, duration=1.0):
        assert not each.twist[0].any()
        assert (
            np.abs(each.twist).max(axis=0)
            <= np.array([0.02, 0.02, 1.5]) * (1.0 + 1e-12)
        ).all()


# ------------------------------------------------------------------------------------------------ of fits


def test_held_out_parts_are_predicted_by_fits_that_did_not_see_them():
    log = noisy(clean_log(*excitation(duration=0.5)), 1)
    fit = fitted(log, PATCH, model="reduced-published", starts=1, nuisance=())
    history = fit.histories[0]
    assert (
        np.isnan(history["held_out"][0]).all()
        and np.isfinite(history["held_out"][1:]).all()
    )
    seen, unseen = (
        (history["measured"] - history[key])[1:] / fit.noise
        for key in ("predicted", "held_out")
    )
    assert np.nansum(unseen**2) > np.nansum(seen**2)
    # folds differ in size
    assert np.sqrt(np.nansum(seen * unseen) / seen.size) == pytest.approx(
        fit.scores[0].held_out, rel=0.01
    )
    labels = [axes.get_ylabel() for axes in fit.plot().axes]
    assert sum("held-out" in label for label in labels) == 3


def test_a_force_that_stays_at_zero_is_no_obstacle(slide):
    """As of a simulated slide along x."""
    still = dataclasses.replace(slide, wrench=slide.wrench * [1.0, 0.0, 0.0])
    fit = fitted(
        still,
        PATCH,
        parameters=["mu_c"],
        start=LAW,
        model="reduced-published",
        starts=1,
    )
    assert fit.estimates["mu_c"] == pytest.approx(LAW.mu_c, rel=0.1)


# ------------------------------------------------------------------------------------------------ command


def test_the_command_writes_a_motion_that_identify_reads(tmp_path, slide, capsys):
    write_csv(tmp_path / "slide.csv", columns_of(slide))
    out = tmp_path / "next.csv"
    options = [
        "--patch",
        "disc",
        "--duration",
        "0.5",
        "--speed",
        "0.03",
        "--spin",
        "2",
        "--out",
        str(out),
    ]
    assert (
        main(
            [
                "identify",
                "plan",
                str(tmp_path / "slide.csv"),
                *options,
                "--parameters",
                "mu_c,contact_radius",
            ]
        )
        == 0
    )
    assert capsys.readouterr().out.startswith("Next motion to measure: ")
    motion = Log.from_csv(out)
    assert (
        len(motion.time) == 500
        and motion.twist.any()
        and np.abs(motion.twist[:, 2]).max() <= 2.0
    )
    assert np.allclose(motion.normal_force, LOAD)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["none.csv"], "no such file"),
        (["--speed", "0"], "speed"),
        (["--wanted", "mu"], "parameters"),
        (["--start", "mu_c"], "NAME=VALUE"),
        (["--out", "motion.txt"], ".csv"),
    ],
)
def test_what_is_wrong_with_a_command_is_one_line(capsys, options, words):
    assert main(["identify", "plan", *options]) == 2
    message = capsys.readouterr().err
    assert (
        message.startswith("error: ") and message.count("\n") == 1 and words in message
    ), message


def test_plan_is_a_word_of_identify_and_not_a_log(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for command, words in (
        (
            ["identify", "-h"],
            ["[OPTIONS] LOG...", "--nuisance", "Commands:", "identify plan --help"],
        ),
        (
            ["identify", "plan", "--help"],
            ["Usage: planarfriction identify plan [OPTIONS] [LOG]...", "--wanted"],
        ),
    ):
        assert main(command) == 0
        text = capsys.readouterr().out
        assert all(word in text for word in words), text
    assert main(["plan"]) == 2 and "No such command 'plan'" in capsys.readouterr().err
    assert (
        main(["identify", "./plan"]) == 2
        and "error: plan: no such file" in capsys.readouterr().err
    )


@pytest.mark.parametrize(
    ("before", "incomplete", "found"),
    [
        (["identify"], "pl", {"plan", "pl"}),
        (["identify", "slow.csv"], "pl", {"pl"}),
        (["identify", "plan"], "--wan", {"--wanted"}),
        (["identify"], "--nuis", {"--nuisance"}),
    ],
)
def test_completion_knows_the_plan(before, incomplete, found):
    shell = ShellComplete(app, {}, "planarfriction", "_PLANARFRICTION_COMPLETE")
    assert {item.value for item in shell.get_completions(before, incomplete)} == found


def test_a_plan_knows_beforehand_what_a_fit_does():
    """A factor of 20 either way, of the Stribeck exponent and of mu_s/mu_c - 1 less: one width of their own."""
    names = ("mu_c", "mu_s", "gamma", "sigma_0")
    information = _Information(PATCH, LAW, names, (), np.array(NOISE))
    coordinates = Coordinates(names, information.values, LAW.mu_c)
    assert np.diag(information.prior()) == pytest.approx(
        [1.0 / 9.0, 1.0, 1.0, 1.0 / 9.0]
    )
    np.testing.assert_allclose(
        information.prior(),
        coordinates.prior(coordinates.of(information.values))[1] ** 2,
    )


def test_a_plan_says_errors_as_shares_and_names_the_least_certain():
    motions = tuple(SimpleNamespace(name=f"slide {number}") for number in (1, 2))
    before = np.array([0.3, 2e-3, 40.0])
    after = np.array([[0.05, 1e-3, 20.0], [0.01, 5e-4, 60.0]])
    names = ("mu_c", "centre_x", "sigma_1")
    values = np.array([0.5, 0.0, -400.0])
    said = " ".join(
        MotionPlan(names, values, motions, np.array([3.26, 1.0]), before, after)
        .table()
        .split()
    )
    assert "Next motion to measure: slide 1." in said
    assert "slide 1 3.3 mu_c, 10 % slide 2 1.0 sigma_1, 15 %" in said
    # Beyond a half; no share of zero.
    assert "mu_c 0.5 unknown 10 % -" in said and "centre_x 0 0.002 0.001 m" in said
