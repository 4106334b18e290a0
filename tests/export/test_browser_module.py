"""The WebAssembly module of the pages against the library and against exported C: steps, surfaces, loads and bodies."""

import ctypes
import shutil

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.planning.holding import forces_needed
from tests.support import browser_module
from tests.support.browser_module import DOCS, MODULE, called
from tests.support.c_libraries import library
from tests.support.repository import script

pytestmark = pytest.mark.skipif(
    not MODULE.exists(), reason="no docs beside these tests"
)

ELASTO_PLASTIC = pf.LuGre(mu_c=0.8, mu_s=1.2, elasto_plastic=0.9)
PLAIN = pf.LuGre(mu_c=0.5, mu_s=0.6, v_s=3e-3, sigma_0=1e5, sigma_1=50.0, sigma_2=0.5)
MAP = np.clip(np.add.outer(np.arange(-3.0, 5.0), np.arange(-4.0, 6.0)), 0.0, None)
PATCHES = {
    "disc": pf.ContactPatch.disc(0.01).discs(24),
    "rectangle": pf.ContactPatch.rectangle(0.02, 0.012, cells=(6, 4)).discs(),
    "map": pf.ContactPatch.from_pressure(MAP, cell_size=2e-3).discs(),
    "points": pf.ContactPatch.points(
        [(0.01, 0.0), (-0.01, 0.0), (0.0, 0.02)], [1, 2, 3]
    ),
}
CASES = [
    ("disc", ELASTO_PLASTIC),
    ("disc", PLAIN),
    ("rectangle", ELASTO_PLASTIC),
    ("map", ELASTO_PLASTIC),
    ("points", ELASTO_PLASTIC),
]
ARM = np.array([1.0, 1.0, 0.01])


@pytest.fixture(scope="module", params=["committed", "rebuilt"])
def module(request, tmp_path_factory):
    """The module as it is committed, and as it is compiled from the library as it is now."""
    if request.param == "committed":
        return MODULE
    made = script("docs/make_wasm.py")
    rebuilt = made.compiled(made.source())
    if rebuilt is None:
        pytest.skip("needs clang, wasm-ld and the C library of WASI")
    file = tmp_path_factory.mktemp("rebuilt") / "planarfriction.wasm"
    file.write_bytes(rebuilt)
    return file


def motions(count, seed=0):
    """Draw twists from stick to fast slip that last for some steps, loads, of which some are 0, and time steps."""
    rng = np.random.default_rng(seed)
    held = np.repeat(np.arange(count // 5), 5)
    twists = rng.normal(size=(count // 5, 3)) / ARM
    twists *= 10.0 ** rng.uniform(-6.0, -0.5, (count // 5, 1))
    loads = 10.0 ** rng.uniform(-1.0, 1.5, count)
    loads[::50] = 0.0
    return twists[held], loads, 10.0 ** rng.uniform(-5.0, -2.0, count)


@pytest.mark.parametrize(("name", "law"), CASES)
def test_a_thousand_steps_are_those_of_the_library(name, law, module):
    model = pf.DistributedModel(PATCHES[name], law)
    given = list(zip(*motions(1000), strict=True))
    calls = [["step", list(twist), load, dt] for twist, load, dt in given]
    calls += [["steady", list(twist), load] for twist, load, _ in given]
    found = np.array(called(PATCHES[name], law, calls, module)[1:])
    state = model.rest()
    for (twist, load, dt), stepped, steady in zip(
        given, found[:1000], found[1000:], strict=True
    ):
        state, wrench = model.step(state, twist, load, dt)
        _, settled = model.step(model.rest(), twist, load, 1e9)
        most = 1e-10 * max(load, 1e-9)
        assert (np.abs(stepped - wrench) / ARM).max() <= most
        assert (np.abs(steady - settled) / ARM).max() <= most * (
            1.0 + np.abs(twist[:2]).sum()
        )


@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
@pytest.mark.parametrize("name", ["few", "plain", "discs"])
def test_a_thousand_steps_are_those_of_exported_c(name, module):
    made = library(name)
    reduced = made.model
    patch = (
        reduced.reduction.patch
        if isinstance(reduced, pf.ReducedModel)
        else reduced.patch
    )
    given = list(zip(*motions(1000, seed=1), strict=True))
    calls = [["step", list(twist), load, dt] for twist, load, dt in given]
    found = np.array(called(patch, reduced.law, calls, module)[1:])
    state = np.zeros(reduced.state_shape)
    wrench = np.zeros(3)
    address = lambda array: ctypes.c_void_p(array.ctypes.data)
    for (twist, load, dt), stepped in zip(given, found, strict=True):
        twist = np.array(twist)
        code = made.functions.friction_step_default(
            address(state),
            address(twist),
            ctypes.c_double(load),
            ctypes.c_double(dt),
            address(wrench),
        )
        assert code == 0
        assert (np.abs(stepped - wrench) / ARM).max() <= 1e-10 * max(load, 1e-9)


@pytest.mark.parametrize("name", PATCHES)
def test_limit_surfaces_are_those_of_the_library(name, module):
    rng = np.random.default_rng(2)
    twists = rng.normal(size=(200, 3)) / ARM
    patch = PATCHES[name]
    calls = [["surface", twists.tolist()], ["surface", twists.tolist(), True]]
    calls += [["pieces", twists[0].tolist()]]
    place, exact, ellipsoid, pieces = called(patch, PLAIN, calls, module)
    assert np.shape(pieces) == patch.positions.shape
    np.testing.assert_allclose(np.sum(pieces, axis=0), exact[0][:2], atol=1e-14)
    np.testing.assert_allclose(
        place, [*patch.centre_of_pressure(), patch.contact_radius()], atol=1e-12
    )
    kinds = (exact, pf.LimitSurfaceCells), (ellipsoid, pf.LimitSurfaceEllipsoid)
    for found, kind in kinds:
        off = np.abs(np.array(found) - kind(patch).wrench(twists)) / ARM
        assert off.max() < 1e-12


@pytest.mark.parametrize("name", ["disc", "rectangle", "map"])
def test_loads_that_hold_are_those_of_the_library(name, module):
    rng = np.random.default_rng(3)
    loads = (rng.normal(size=(100, 3)) * ARM).tolist()
    loads += [[1.0, 0.0, 0.0], [0.0, 0.0, 0.01], [0.0, 0.0, 0.0]]
    patch = PATCHES[name]
    surface = pf.LimitSurfaceCells(patch)
    found = called(patch, PLAIN, [["holding", load, 0.6] for load in loads], module)[1:]
    for load, each in zip(loads, found, strict=True):
        (wanted,) = forces_needed(np.array([load]), surface, 0.6)
        assert each["force"] == pytest.approx(wanted, rel=1e-10)
        if wanted:
            scaled = pf.LimitSurfaceEllipsoid(patch).twist(-np.array(load))
            assert each["ellipsoid"] == pytest.approx(
                np.dot(load, scaled) / 0.6, rel=1e-9
            )
            power = np.dot(load, each["twist"])
            assert power == pytest.approx(0.6 * each["force"], rel=1e-10)


@pytest.mark.parametrize("name", ["disc", "rectangle", "map"])
def test_bodies_move_as_those_of_the_library(name, module):
    """Twists within 1e-9 m/s, nine in ten wrenches within 1e-12 of the load, as in exported C."""
    rng = np.random.default_rng(4)
    count = 300
    patch = PATCHES[name]
    twists, loads, steps = motions(count, seed=5)
    steps = np.minimum(steps, 3e-3)
    mass = 10.0 ** rng.uniform(-1.0, 0.5, count)
    inertia = mass * 10.0 ** rng.uniform(-4.5, -3.5, count)
    push = rng.normal(size=(count, 3)) * np.minimum(loads, 5.0)[:, None] * ARM
    arm = 0.01 * rng.normal(size=(count, 2))
    angle = rng.uniform(-3.0, 3.0, count)
    calls = [
        [
            "bodyStep",
            {
                "twist": twists[i].tolist(), "applied": push[i].tolist(), "load": loads[i], "dt": steps[i],
                "mass": mass[i], "inertia": inertia[i], "place": [*pf.geometry.rotate(arm[i], angle[i]), angle[i]],
            },
        ]
        for i in range(count)
    ]  # fmt: skip
    found = called(patch, ELASTO_PLASTIC, calls, module)[1:]
    model = pf.DistributedModel(patch, ELASTO_PLASTIC)
    state = model.rest()
    off = []
    for i, each in enumerate(found):
        body = pf.SlidingBody(mass[i], inertia[i], model, arm[i])
        wanted = body.step(
            state.ravel(), twists[i], loads[i], steps[i], push[i], angle[i]
        )
        state = wanted.state
        assert (np.abs(each["twist"] - wanted.twist) * ARM).max() < 1e-9
        off.append(
            (np.abs(each["friction"] - wanted.wrench) / ARM).max() / max(loads[i], 1e-9)
        )
    assert max(off) < 1e-6
    assert np.quantile(off, 0.9) < 1e-11


def test_what_is_out_of_range_is_refused(module):
    step = ["step", [0.01, 0.0, 0.0], 1.0, 1e-3]
    calls = [
        ["step", [1e60, 0.0, 0.0], 1.0, 1e-3],
        ["step", [0.0, 0.0, 0.0], -1.0, 1e-3],
        ["setLaw", {"mu_c": -1.0}],
        ["setLaw", {"mu_c": 1.0, "mu_s": 0.5}],
        ["setPatch", [[0.0, 0.0, 0.0, 0.0]]],
        ["setPatch", [[0.0, 0.0, 0.01, 1.0]] * 1025],
        ["holding", [1.0, 0.0, 0.0], 0.0],
    ]
    found = called(PATCHES["disc"], PLAIN, [*calls, step], module)[1:]
    assert all("error" in each for each in found[:-1])
    assert np.isfinite(found[-1]).all()


def test_the_module_asks_for_nothing_and_is_small():
    assert MODULE.stat().st_size < 150_000
    assert b"wasi" not in MODULE.read_bytes()
    assert (DOCS / "browser" / "contact.js").exists()
    assert browser_module.node()
