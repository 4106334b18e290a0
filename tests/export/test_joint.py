"""Friction of a joint in C, against the step of the library."""

import ctypes
import dataclasses
import re
import shutil
import subprocess

import numpy as np
import pytest

from planarfriction.export.joint import export_joint_c
from planarfriction.joints import JointFriction
from planarfriction.joints.friction import RIGID
from tests.support.c_libraries import STRICT
from tests.support.refusals import refused

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")

FRICTION = JointFriction(0.8, 0.3, 0.2, 0.1, 1.2, 0.05, 400.0, 2.0)


def compiled(friction, folder):
    """Export and compile; return the function."""
    files = export_joint_c(friction, folder)
    assert [each.name for each in files] == ["friction.h", "friction.c"]
    command = (
        "gcc",
        *STRICT,
        "-O1",
        "-shared",
        "-fPIC",
        "friction.c",
        "-o",
        "friction.so",
        "-lm",
    )
    subprocess.run(command, cwd=folder, check=True)
    function = ctypes.CDLL(folder / "friction.so").friction_joint_torque
    function.restype = ctypes.c_double
    function.argtypes = [ctypes.POINTER(ctypes.c_double)] + 4 * [ctypes.c_double]
    return function


UNEVEN = JointFriction(
    0.5, 0.1, 0.2, 0.2, 0.7, 0.05, 300.0, 0.5, asymmetry=0.1, viscous_asymmetry=-0.05
)


@pytest.mark.parametrize(
    "friction", [FRICTION, JointFriction(0.03, 0.005, 0.2, 0.2), UNEVEN]
)
def test_steps_agree_with_the_library(friction, tmp_path):
    """Random speeds from sticking to sliding; the step of NumPy is written here once more."""
    function = compiled(friction, tmp_path)
    state = ctypes.c_double(0.0)
    z = 0.0
    rng = np.random.default_rng(0)
    law = friction.law
    for _ in range(500):
        speed = rng.normal() * 10.0 ** rng.uniform(-4.0, 1.0)
        motor = rng.normal()
        outside = rng.normal()
        dt = 10.0 ** rng.uniform(-5.0, -2.0)
        found = function(ctypes.byref(state), speed, motor, outside, dt)
        load = abs(friction.load_motor * motor - friction.load_external * outside)

        def within(torque, load=load):
            most = law.mu_s + load + np.copysign(friction.asymmetry, torque)
            return np.clip(torque, -most, most)

        level = law.mu_c + (law.mu_s - law.mu_c) * np.exp(-((speed / law.v_s) ** 2))
        level += load + np.copysign(friction.asymmetry, speed)
        rate = abs(speed) * law.sigma_0 / level
        start = within(law.sigma_0 * z) / law.sigma_0
        z = start * np.exp(-rate * dt) + speed * -np.expm1(-rate * dt) / rate
        wanted = within(law.sigma_0 * z + law.sigma_1 * (speed - rate * z))
        wanted += law.sigma_2 * speed + friction.viscous_asymmetry * abs(speed)
        assert state.value == pytest.approx(z, rel=1e-9, abs=1e-15)
        assert found == pytest.approx(wanted, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    "friction", [FRICTION, UNEVEN, JointFriction(0.5, 0.1, 0.3, 0.3)]
)
def test_no_torque_exceeds_the_static_level_and_the_viscous_part(friction, tmp_path):
    """A hundred thousand random calls: speeds that reverse, loads that come and go, steps of any length."""
    function = compiled(friction, tmp_path)
    state = ctypes.c_double(0.0)
    rng = np.random.default_rng(1)
    speeds = (
        rng.normal(size=100_000)
        * 10.0 ** rng.uniform(-6.0, 3.0, 100_000)
        * (rng.random(100_000) < 0.8)
    )
    loads = rng.normal(size=(100_000, 2)) * 10.0 ** rng.uniform(-2.0, 2.0, (100_000, 1))
    steps = 10.0 ** rng.uniform(-6.0, 1.0, 100_000)
    found = [
        function(ctypes.byref(state), v, *load, dt)
        for v, load, dt in zip(speeds, loads, steps, strict=True)
    ]
    load = np.abs(
        friction.load_motor * loads[:, 0] - friction.load_external * loads[:, 1]
    )
    most = friction.mu_s + abs(friction.asymmetry) + load
    most += (friction.sigma_2 + abs(friction.viscous_asymmetry)) * np.abs(speeds)
    assert (np.abs(found) <= most * (1.0 + 1e-12)).all()


def test_a_level_that_falls_brings_the_bristles_back(tmp_path):
    """After sliding under 100 N m, the level is 1.2 N m again: friction that holds the joint must not push it."""
    friction = dataclasses.replace(FRICTION, load_external=0.2)
    function = compiled(friction, tmp_path)
    state = ctypes.c_double(0.0)
    for _ in range(1000):
        pushed = function(ctypes.byref(state), 1.0, 100.0, 0.0, 1e-3)
    assert pushed == pytest.approx(0.8 + 0.2 * 100.0 + 0.3)
    held = [function(ctypes.byref(state), 0.0, 0.0, 0.0, 1e-3) for _ in range(3)]
    assert held == pytest.approx([1.2, 1.2, 1.2])
    time = np.arange(6) * 0.5
    along = friction.along(
        time, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0], [100.0, 100.0, 100.0, 0.0, 0.0, 0.0]
    )
    # between the two speeds it slides on at their mean, against the level without load
    assert along[2] == pytest.approx(0.8 + 20.0 + 0.3) and along[-1] == pytest.approx(
        0.8
    )


def test_a_rigid_joint_bends_by_one_milliradian(tmp_path):
    function = compiled(JointFriction(0.5), tmp_path)
    state = ctypes.c_double(0.0)
    for _ in range(1000):
        torque = function(ctypes.byref(state), 1.0, 0.0, 0.0, 1e-3)
    assert torque == pytest.approx(0.5) and state.value == pytest.approx(RIGID)


def test_what_is_no_number_changes_nothing(tmp_path):
    function = compiled(FRICTION, tmp_path)
    state = ctypes.c_double(1e-4)
    for values in (
        (np.nan, 0, 0, 1e-3), (1.0, np.inf, 0, 1e-3), (1.0, 0, np.nan, 1e-3), (1.0, 0, 0, 0.0), (1.0, 0, 0, np.inf),
        (1.0, 0, 0, np.nan),
    ):  # fmt: skip
        assert function(ctypes.byref(state), *values) == 0.0 and state.value == 1e-4
    state.value = np.nan
    assert function(ctypes.byref(state), 1.0, 0.0, 0.0, 1e-3) == 0.0


def test_nothing_is_allocated(tmp_path):
    compiled(FRICTION, tmp_path)
    subprocess.run(
        ["gcc", "-std=c99", "-O2", "-c", "friction.c"], cwd=tmp_path, check=True
    )
    nm = subprocess.run(
        ["nm", "friction.o"], cwd=tmp_path, check=True, capture_output=True, text=True
    ).stdout
    kinds = {
        line.split()[-1]: line.split()[-2]
        for line in nm.splitlines()
        if ".LC" not in line
    }
    assert set(kinds) <= {
        "friction_joint_torque",
        "exp",
        "pow",
        "log",
    } and "d" not in map(str.lower, kinds.values())
    assert not re.search(
        r"\b(while|for|goto)\b", (tmp_path / "friction.c").read_text().split("*/", 1)[1]
    )


def test_names_of_c_are_checked(tmp_path):
    for name in ("2nd", "math", "a-b"):
        with refused("name must"):
            export_joint_c(FRICTION, tmp_path, name=name)
