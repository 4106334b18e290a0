"""Twists and holding loads of C libraries, their tests and their CMake files."""

import ctypes
import re
import shutil
import subprocess

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.limit_surface import LimitSurfaceTable
from planarfriction.planning import holding_load
from tests.support.c_libraries import STRICT, library

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")

MU = 0.7


def call(function, kind, *given, count):
    """Return the code of a function and the numbers that it writes."""
    found = np.full(count, 7.0, kind)
    arguments = [np.array(each, kind) if np.ndim(each) else each for each in given]
    scalar = ctypes.c_double if kind is np.float64 else ctypes.c_float
    pointers = [
        each.ctypes if np.ndim(each) else scalar(each) for each in (*arguments, found)
    ]
    pointers = [
        each.data_as(ctypes.c_void_p) if hasattr(each, "data_as") else each
        for each in pointers
    ]
    return function(*pointers), found


@pytest.mark.parametrize("precision", ["double", "float"])
@pytest.mark.parametrize("name", ["few", "potential"])
def test_twists(name, precision):
    """Twists have the wrenches of the stored surface, and holding loads are those of the exact one."""
    made = library(name, precision)
    surface = LimitSurfaceTable(made.model.patch)
    exact = precision == "double"
    wrenches = np.random.default_rng(0).normal(size=(60, 3)) * [
        1.0,
        1.0,
        surface.contact_radius,
    ]
    wrenches = (
        np.vstack([wrenches, np.diag([1.0, -2.0, 1e-3])])
        .astype(made.kind)
        .astype(float)
    )
    for wrench in wrenches:
        code, twist = call(made.functions.friction_twist, made.kind, wrench, count=3)
        assert code == 0
        turned = surface.wrench(twist) / [1.0, 1.0, surface.contact_radius]
        wanted = wrench / [1.0, 1.0, surface.contact_radius]
        apart = (
            np.cross(turned, wanted) / np.linalg.norm(turned) / np.linalg.norm(wanted)
        )
        assert (
            np.linalg.norm(apart) < (1e-9 if exact else 1e-3) and turned @ wanted > 0.0
        )
        assert abs(surface.dissipation(twist) - 1.0) < (1e-12 if exact else 1e-5)
        code, force = call(
            made.functions.friction_holding_load, made.kind, -wrench, MU, count=1
        )
        assert code == 0
        np.testing.assert_allclose(
            force, -wrench @ surface.twist(wrench) / MU, rtol=1e-12 if exact else 1e-5
        )
        np.testing.assert_allclose(
            force, holding_load(-wrench, made.model.patch, MU), rtol=1e-4
        )


def test_bad_wrenches():
    made = library("few")
    twist = made.functions.friction_twist
    hold = made.functions.friction_holding_load
    for wrench in ([0.0] * 3, [np.nan, 0.0, 0.0], [0.0, np.inf, 0.0]):
        code, found = call(twist, made.kind, wrench, count=3)
        assert code == 2 and np.all(found == 7.0)
    for load, mu in (
        ([1.0, 0.0, 0.0], 0.0),
        ([1.0, 0.0, 0.0], np.nan),
        ([0.0, np.nan, 0.0], 0.5),
    ):
        code, found = call(hold, made.kind, load, mu, count=1)
        assert code == 2 and found == 7.0
    assert call(hold, made.kind, [0.0] * 3, 0.5, count=1) == (0, 0.0)
    # Beyond the largest number.
    code, found = call(hold, made.kind, [1.0, 0.0, 0.0], 5e-324, count=1)
    assert code == 2 and found == 7.0


@pytest.mark.parametrize("precision", ["double", "float"])
def test_subnormal_wrenches(precision):
    """One over the least number is none: they have the twists of their directions all the same, as in Python."""
    made = library("few", precision)
    least = np.finfo(made.kind).smallest_subnormal
    surface = LimitSurfaceTable(made.model.patch)
    for wrench in (np.array([1.0, 0.0, 0.0]), np.array([3.0, -4.0, 0.0])):
        code, twist = call(
            made.functions.friction_twist,
            made.kind,
            (wrench * least).astype(made.kind),
            count=3,
        )
        assert code == 0
        wanted = surface.twist(wrench)
        np.testing.assert_allclose(
            twist,
            wanted,
            atol=(1e-9 if precision == "double" else 1e-3) * np.abs(wanted).max(),
        )
        np.testing.assert_allclose(
            surface.twist(wrench * 5e-324), wanted, atol=1e-9 * np.abs(wanted).max()
        )


def test_a_point_has_no_limit_surface(tmp_path):
    point = pf.ContactPatch(np.zeros((1, 2)), np.ones(1))
    texts = [
        each.read_text()
        for each in pf.export_c(pf.DistributedModel(point, pf.LuGre()), tmp_path)
    ]
    assert "friction_steady" in texts[0] and not any(
        "friction_twist" in each for each in texts
    )


def programs(folder, library, *options):
    command = [
        "gcc",
        *STRICT,
        *options,
        "friction.c",
        "friction_test.c",
        "-o",
        "tested",
        "-lm",
    ]
    subprocess.run(command, cwd=folder, check=True)
    return subprocess.run(["./tested"], cwd=folder, capture_output=True, text=True)


@pytest.mark.parametrize("precision", ["double", "float"])
def test_the_test_that_is_written(precision, tmp_path):
    """It passes, and fails for another library."""
    made = library("few", precision)
    shutil.copytree(made.folder, tmp_path, dirs_exist_ok=True)
    assert programs(tmp_path, made).returncode == 0
    source = (tmp_path / "friction.c").read_text()
    default = re.compile(r"(friction_default = \{ )([^,]+)")
    (tmp_path / "friction.c").write_text(default.sub(r"\g<1>1.01 * \g<2>", source))
    done = programs(tmp_path, made)
    assert done.returncode == 1 and "wrench" in done.stdout


def test_cmake(tmp_path):
    if shutil.which("cmake") is None:
        pytest.skip("needs cmake")
    made = library("few")
    lines = (
        "cmake_minimum_required(VERSION 3.16)",
        "project(some C)",
        f"include({made.folder}/friction.cmake)",
    )
    (tmp_path / "CMakeLists.txt").write_text("\n".join(lines))
    for command in (
        ["cmake", "-B", "build"],
        ["cmake", "--build", "build", "--target", "friction_test"],
    ):
        subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    subprocess.run(["./friction_test"], cwd=tmp_path / "build", check=True)
