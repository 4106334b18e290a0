"""What logs, fits and plans of experiments refuse."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.errors import FrictionError
from planarfriction.identify import (
    FitOptions,
    Log,
    MassProperties,
    Slide,
    candidate_motions,
    design_experiment,
    differentiated,
    identify_lugre,
    identify_motion,
)
from planarfriction.joints import JointLog

PATCH = pf.ContactPatch.disc(0.01, cells=7)
LAW = pf.LuGre(mu_c=0.5, mu_s=0.6, elasto_plastic=0.9)
MODEL = pf.ReducedModel(PATCH, LAW)
SOFT = pf.ContactPatch.disc(
    0.012, cells=7, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0)
)
POINT = pf.ContactPatch.points([(0.0, 0.0)])
TIME = np.arange(300) / 100.0
ANGLE = 3.0 * TIME
LOG = Log(TIME, TIME[:, None] * [0.01, 0.0, 1.0], np.full((300, 3), -0.1), 2.0)
FREE = Slide(
    TIME[:50],
    np.stack([TIME[:50] - TIME[:50] ** 2, 0.0 * TIME[:50], 0.0 * TIME[:50]], -1),
)
BODY = MassProperties(0.4, 8e-4)
COLUMNS = "t,vx,vy,omega,fx,fy,tau,normal_force\n"


def wrapped(angle):
    return np.mod(angle + np.pi, 2.0 * np.pi) - np.pi


def changed(**fields):
    return dataclasses.replace(LOG, **fields)


def turned(angle):
    return differentiated(TIME, np.stack([TIME, TIME, angle], -1))


def read(text, kind=Log, **options):
    Path("log.csv").write_text(text, encoding="utf-8")
    return kind.from_csv("log.csv", **options)


def fit(**given):
    names = {field.name for field in dataclasses.fields(FitOptions)} & given.keys()
    return identify_lugre(
        LOG,
        PATCH,
        options=FitOptions(**{name: given.pop(name) for name in names}),
        **given,
    )


REFUSED = [
    (
        lambda: changed(time=TIME[::-1]),
        "time of log must increase, got 2.98 after 2.99 s in sample 2",
    ),
    (
        lambda: Log.from_motion(TIME[:4], np.zeros((4, 3)), np.zeros((4, 3)), 1.0),
        "motion must hold at least window=7 samples, got 4",
    ),
    (
        lambda: JointLog(TIME, TIME),
        "joint must hold a torque, a voltage, or a goal with a drive, got none of them",
    ),
    (
        lambda: changed(wrench=LOG.wrench[:, :2]),
        "wrench must have shape [300, 3], got shape [300, 2]",
    ),
    (
        lambda: changed(normal_force=-1.0),
        "normal_force must be >= 0; negate it if the sensor counts pressure as negative, got -1",
    ),
    *(
        (lambda name=name, value=value: changed(**{name: value}), words)
        for name, value, words in (
            ("held", "yes", "held must be True or False, got 'yes'"),
            ("held", 2, "held must be True or False, got 2"),
            ("held", np.nan, "held must be True or False, got nan"),
            ("held", np.ones(3), "held must be True or False, got array([1., 1., 1.])"),
            ("turns", -1, "turns must be an integer >= 0, got -1"),
            ("turns", 0.5, "turns must be an integer >= 0, got 0.5"),
            ("name", 3, "name must be a text, got 3"),
        )
    ),
    (
        lambda: Log.from_motion(
            TIME, np.zeros((300, 3)), np.zeros((300, 3)), 1.0, name=10**5000
        ),
        "name must be a text, got int that is too long to show",
    ),
    (
        lambda: Log.from_axis(TIME, TIME, 1.0),
        "velocity must be given, or position, and not both, got both or neither",
    ),
    (
        lambda: differentiated(np.zeros(20), np.zeros((20, 3))),
        "time must increase, got 0.0 after 0.0 s in sample 2",
    ),
    (
        lambda: turned(np.where(TIME < 2.0, ANGLE, ANGLE + 2.0)),
        "theta [rad] must only jump by full rotations, got a step of 2.03 at t = 2 s",
    ),
    (
        lambda: turned(np.where(TIME < 2.0, ANGLE, ANGLE + np.pi)),
        "theta [rad] must only jump by full rotations, got a step of 3.17 at t = 2 s",
    ),
    (
        lambda: turned(np.degrees(wrapped(ANGLE))),
        "theta [rad] must only jump by full rotations, got a step of -358 at t = 1.05 s",
    ),
    (
        lambda: turned(np.where(TIME < 2.0, ANGLE, ANGLE + 4.0 * np.pi)),
        "theta [rad] must only jump by full rotations, got a step of 12.6 at t = 2 s",
    ),
    (
        lambda: turned(wrapped(60.0 * ANGLE)),
        "theta [rad] must rotate by less than 90 degrees between samples, or be unwrapped, got",
    ),
    (
        lambda: turned(wrapped(130.0 * ANGLE)),
        "theta [rad] must rotate by less than 90 degrees between samples, or be unwrapped, got",
    ),
    (
        lambda: Slide(TIME[::-1], FREE.pose),
        "time of slide must increase, got 2.98 after 2.99 s in sample 2",
    ),
    (
        lambda: Slide(TIME[:50], FREE.pose[:, :2]),
        "pose must have shape [50, 3], got shape [50, 2]",
    ),
    (
        lambda: Slide(TIME, np.stack([TIME, TIME, np.degrees(wrapped(ANGLE))], -1)),
        "theta of slide [rad] must only jump by full rotations, got a step of -358 at t = 1.05 s",
    ),
    (lambda: MassProperties(0.0, 1.0), "mass must be > 0, got 0.0"),
    (
        lambda: read(""),
        "log.csv: is empty (expected a header line and rows of numbers)",
    ),
    (
        lambda: read("t,vx,vy,omega,fx,fy\n0,0,0,0,0,0\n"),
        "log.csv: has no column tau, normal_force; found t, vx, vy, omega, fx, fy; needed t, vx,",
    ),
    (
        lambda: read(f"{COLUMNS}0,0,0,0,left,0,0,1\n"),
        "log.csv: line 2, column 'fx': 'left' is not a number",
    ),
    (
        lambda: read(f"# made\n{COLUMNS}0,0,0,0,0,0,0\n"),
        "log.csv: line 3 has 7 columns, the header has 8",
    ),
    (
        lambda: read(f"{COLUMNS}0,0,0,nan,0,0,0,1\n"),
        "log.csv: line 2, column 'omega': 'nan' is not finite",
    ),
    (
        lambda: read(f"t,{COLUMNS}0,0,0,0,0,0,0,0,1\n"),
        "log.csv: line 1 has two columns 't'",
    ),
    (
        lambda: read(f"{COLUMNS}0,0,0,0,0,0,0,1\n"),
        "log.csv: time of log must hold at least 10 samples, got 1",
    ),
    (
        lambda: read(
            "t,vx,vy,fx\n" + "".join(f"{k},1,1,-1\n" for k in range(20)),
            normal_force=1.0,
        ),
        "log.csv: has no column omega, fy, tau; found t, vx, vy, fx; needed t, vx, vy, omega (or",
    ),
    (
        lambda: read("t,q\n" + "".join(f"{k},{k}\n" for k in range(20)), JointLog),
        "log.csv: log must hold a torque, a voltage, or a goal with a drive, got none of them",
    ),
    (
        lambda: read("t,x,torque\n0,0,0\n", JointLog),
        "log.csv: no column q; found t, x, torque; needed t, q, and torque, voltage or goal",
    ),
    (
        lambda: read("t [s],q [deg],torque [N m]\n0,0,0\n", JointLog),
        "log.csv: q must be in rad, got the column 'q [deg]'",
    ),
    *(
        (lambda given=given: fit(**given), words)
        for given, words in (
            (
                {"parameters": ("mu",)},
                "parameters must be one of mu_c, mu_s, v_s, gamma, sigma_0, sigma_1, sigma_2,",
            ),
            ({"parameters": ()}, "parameters must contain at least one name, got none"),
            (
                {"parameters": ("mu_c", "mu_c")},
                "parameters must contain each name once, got 'mu_c' 2 times",
            ),
            (
                {"parameters": ("c",)},
                "patch must have a SoftFinger pressure to estimate c, got disc",
            ),
            (
                {"parameters": ("c", "contact_radius")},
                "parameters must contain contact_radius or soft-finger constants, not both, got c,",
            ),
            ({"noise": [1.0, 0.0, 1.0]}, "noise must be > 0, got [1.0, 0.0, 1.0]"),
            ({"begins": "moving"}, "begins must be one of rest, steady, got 'moving'"),
            ({"starts": 0}, "starts must be an integer >= 1, got 0"),
            (
                {"start": {"mu": 0.5}},
                "start must be one of mu_c, mu_s, v_s, gamma, sigma_0, sigma_1, sigma_2,",
            ),
            (
                {"start": 3},
                "start must be a LuGre law or a table of its parameters, got 3",
            ),
            (
                {"surface": "table"},
                "surface must be a class of limit surfaces, got table",
            ),
            (
                {"surface": pf.ReducedModel},
                "surface must be a class of limit surfaces, got <class",
            ),
            ({"samples": 10}, "samples must be an integer >= 1000, got 10"),
            (
                {"model": "best"},
                "model must be one of auto, reduced-published, reduced, distributed, got 'best'",
            ),
            (
                {"nuisance": ("delays",)},
                "nuisance must be one of delay, bias, load, twist, got 'delays' (did you mean 'delay'?)",
            ),
            (
                {"nuisance": "bias"},
                "nuisance must be a list of delay, bias, load, twist, got 'bias'",
            ),
        )
    ),
    (
        lambda: identify_lugre(LOG, PATCH, options={"starts": 1}),
        "options must be a FitOptions record, got {'starts': 1}",
    ),
    (
        lambda: identify_lugre(LOG, MODEL),
        "patch must be a ContactPatch, got ReducedModel('disc' of 45 cells, LuGre(mu_c=0.5,",
    ),
    (lambda: identify_lugre([], PATCH), "log must be a Log or a list of them, got []"),
    (
        lambda: identify_lugre(changed(normal_force=0.0), PATCH),
        "normal_force of log must be > 0 somewhere, got 0 everywhere",
    ),
    (
        lambda: identify_motion(FREE, PATCH, BODY, start=3),
        "start must be a LuGre law, got 3",
    ),
    (
        lambda: identify_lugre(LOG, SOFT, model="distributed"),
        "model must be 'reduced-published' if the patch changes with the load, got distributed",
    ),
    (
        lambda: identify_lugre(LOG, POINT),
        "patch must be wider than a point for an identification (a disc of 0.1 mm has the friction",
    ),
    (
        lambda: identify_lugre(changed(wrench=0.0 * LOG.wrench, name="dead"), PATCH),
        "wrench of dead must not be 0 throughout, got 0 in every sample",
    ),
    (
        lambda: identify_lugre(changed(normal_force=1.0 + TIME), SOFT),
        "normal_force of log must stay within 10 % of its mean if the patch changes with the",
    ),
    (
        lambda: identify_motion([], PATCH, BODY),
        "slides must be a Slide or a list of them, got []",
    ),
    (
        lambda: identify_motion(FREE, PATCH, 0.37),
        "body must be MassProperties, got 0.37",
    ),
    (
        lambda: identify_motion(FREE, PATCH, BODY, parameters=("sigma_0",)),
        "parameters must be one of mu_c, mu_s, v_s, gamma, sigma_2, contact_radius, got",
    ),
    (
        lambda: identify_motion(FREE, PATCH, BODY, samples=2),
        "samples must be an integer >= 5, got 2",
    ),
    *(
        (lambda given=given: design_experiment(PATCH, LAW, **given), words)
        for given, words in (
            (
                {"parameters": ["mu"]},
                "parameters must be one of mu_c, mu_s, v_s, gamma, sigma_0, sigma_1, sigma_2,",
            ),
            (
                {"parameters": ["mu_c"], "wanted": ["v_s"]},
                "parameters must be one of mu_c, got 'v_s'",
            ),
            (
                {"motions": changed(twist=0 * LOG.twist)},
                "twist of log must move the contact, got 0 throughout",
            ),
            ({"noise": (1.0, 0.0, 1.0)}, "noise must be > 0, got [1.0, 0.0, 1.0]"),
            (
                {"nuisance": ["lag"]},
                "nuisance must be one of delay, bias, load, twist, got 'lag'",
            ),
            ({"motions": []}, "motions must be a Log or a list of them, got []"),
            ({"motions": 3}, "motions must be a Log or a list of them, got 3"),
            (
                {"parameters": 3},
                "parameters must be a list of mu_c, mu_s, v_s, gamma, sigma_0, sigma_1, sigma_2,",
            ),
        )
    ),
    *(
        (
            lambda given=given: design_experiment(PATCH, pf.LuGre(mu_c=0.5), **given),
            words,
        )
        for given, words in (
            (
                {"parameters": ["mu_c", "breakaway_ratio"]},
                "parameters must contain breakaway_ratio only for elasto-plastic bristles, got ('mu_c',",
            ),
            (
                {"parameters": ["c"]},
                "patch must have a SoftFinger pressure to estimate c, got disc",
            ),
        )
    ),
    *(
        (lambda given=given: candidate_motions(PATCH, LAW, **given), words)
        for given, words in (
            ({"speed": 0.0}, "speed must be > 0, got 0.0"),
            ({"spin": -1.0}, "spin must be > 0, got -1.0"),
            (
                {"duration": 0.01},
                "duration * rate must be between 100 and 100000 samples, got 10",
            ),
            (
                {"rate": 1e9},
                "duration * rate must be between 100 and 100000 samples, got 2e+09",
            ),
            ({"normal_force": 0}, "normal_force must be > 0, got 0.0"),
            (
                {"normal_force": []},
                "normal_force must be one load or a list of up to 20, got shape (0,)",
            ),
        )
    ),
]
"""Calls, and words of the line that each raises."""


@pytest.mark.parametrize(("call", "words"), REFUSED)
def test_a_mistake_is_refused_in_words(call, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FrictionError) as caught:
        call()
    assert words in str(caught.value)
