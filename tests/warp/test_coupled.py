"""The step in contact space as a Warp kernel against the compiled one, on Warp's CPU device."""

import dataclasses
import functools

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.coupling import CoupledPatches, HostStep
from tests.support.coupling_problems import (
    SHAPES,
    abrupt_run,
    random_bodies,
    random_run,
)
from tests.support.refusals import refused

wp = pytest.importorskip("warp", reason="needs the extra [warp]")
front = pytest.importorskip("planarfriction.warp")

pytestmark = pytest.mark.warp

LAW = pf.LuGre(mu_s=1.2, sigma_0=1e5, sigma_1=250.0, elasto_plastic=0.9)
KINDS = {wp.float64: np.float64, wp.float32: np.float32}
WORLDS = 60


@functools.cache
def pair():
    """Return an ellipsoid and a reduced model as compiled patches."""
    ellipsoid = pf.LimitSurfaceEllipsoid(SHAPES[0])
    return CoupledPatches(
        [
            pf.ReducedModelPublished(SHAPES[0], LAW, surface=ellipsoid),
            pf.ReducedModel(SHAPES[1], LAW),
        ]
    )


def given(dtype, host):
    """Return a host's step in arrays of Warp."""
    return HostStep(*(None if each is None else array(dtype, each) for each in host))


def array(dtype, each):
    return wp.array(np.ascontiguousarray(each), dtype=dtype, device="cpu")


def compared(patches, dtype, runs, tolerance=1e-9):
    """Yield for each step the compiled one, that of Warp, and the host."""
    kernel = None
    name = KINDS[dtype]
    for state, host, dt, _ in runs:
        if kernel is None:
            kernel = front.CoupledPatches(
                patches.models, worlds=len(dt), dtype=dtype, device="cpu"
            )
            results = kernel.results()
        state = state.astype(name)
        host = HostStep(*(None if each is None else each.astype(name) for each in host))
        kernel.step(
            array(dtype, state), given(dtype, host), dt[0], results, tolerance=tolerance
        )
        expected = patches.step(state, host, dt[0], tolerance=tolerance)
        yield (
            expected,
            type(results)(*(each.numpy().copy() for each in results)),
            host,
            state,
            dt[0],
        )
    kernel.check()


def both_runs(patches, worlds, steps, height=0.05, seed=3):
    generator = np.random.default_rng(seed)
    bodies = random_bodies(generator, worlds, len(patches.models), height)
    yield from random_run(generator, patches, bodies, steps)
    yield from abrupt_run(generator, patches, worlds, height, steps)


def levers(patches):
    return np.array(
        [
            [1.0, 1.0, np.sqrt((each.patch.positions**2).sum(1).mean())]
            for each in patches.models
        ]
    )


def statistics(patches, dtype, runs, tolerance=1e-9):
    """Return for each world of each step the error of the wrenches and the residual, with the speed that goes in."""
    lever = levers(patches)
    rows = []
    for expected, found, host, *_ in compared(patches, dtype, runs, tolerance):
        force = np.abs(expected.wrench / lever).max((1, 2))
        error = np.abs((found.wrench - expected.wrench) / lever).max(
            (1, 2)
        ) / np.maximum(force, 1e-9)
        caused = np.einsum(
            "eij,ej->ei", host.twist_response, host.wrench.reshape(len(force), -1)
        )
        speed = (
            (np.abs(host.twist) + np.abs(caused.reshape(host.twist.shape))) * lever
        ).max((1, 2))
        both = expected.converged & (found.converged > 0)
        rows.append(
            np.array(
                [
                    error,
                    found.residual,
                    speed,
                    both,
                    found.converged,
                    expected.converged,
                ]
            ).T
        )
    return np.concatenate(rows).T


def test_double():
    """The same roots, by the same rounds; where a bristle gives way, rounding may choose between two."""
    worst = []
    rounds = []
    for expected, found, *_ in compared(
        pair(), wp.float64, both_runs(pair(), WORLDS, 8), 1e-13
    ):
        # at 1e-13 rounding stops a few
        assert (found.converged > 0).mean() > 0.95 and expected.converged.mean() > 0.95
        force = np.abs(expected.wrench / levers(pair())).max((1, 2))
        worst.append(
            np.abs((found.wrench - expected.wrench) / levers(pair())).max((1, 2))
            / np.maximum(force, 1e-9)
        )
        worst.append(
            np.abs(found.state - expected.state).max(1) / LAW.largest_deflection
        )
        worst.append(
            np.abs(found.normal_force - expected.normal_force).max(1)
            / (1.0 + expected.normal_force.max(1))
        )
        rounds.append(found.iterations != expected.iterations)
    assert np.quantile(worst, 0.99) < 1e-9 and np.mean(rounds) < 0.05


def test_single():
    """Twists keep their digits in single precision; wrenches are those of stiff bristles at such twists."""
    error, residual, speed, both, own, _ = statistics(
        pair(), wp.float32, both_runs(pair(), WORLDS, 8)
    )
    assert (own > 0).mean() > 0.998
    assert (residual <= 1e-5 * speed + 1e-9).mean() > 0.998
    assert np.quantile(error[both > 0], 0.9) < 1e-4


PADS = CoupledPatches(
    [
        pf.ReducedModel(SHAPES[0], LAW, pad=pf.Pad.at_load(3.0)),
        pf.DistributedModel(SHAPES[2], LAW, pad=pf.Pad.layer(12e6, 2e-3)),
    ]
)


def test_pads():
    """Loads follow the wrenches of a body that is high, and stiffnesses of pads do not follow the loads."""
    worst = []
    longer = []
    moved = 0.0
    for expected, found, host, *_ in compared(
        PADS, wp.float64, both_runs(PADS, WORLDS, 8), 1e-13
    ):
        assert (found.converged > 0).mean() > 0.98 and expected.converged.mean() > 0.98
        same = expected.converged & (found.converged > 0)
        force = np.abs(expected.wrench / levers(PADS)).max((1, 2))
        off = np.abs((found.wrench - expected.wrench) / levers(PADS)).max(
            (1, 2)
        ) / np.maximum(force, 1e-9)
        worst.append(off[same])
        longer.append(found.iterations > expected.iterations + 1)
        moved = max(moved, np.abs(found.normal_force - host.normal_force).max())
    # Searches begin elsewhere in compiled code, and end within the same tolerance.
    assert np.quantile(np.concatenate(worst), 0.99) < 1e-9 and moved > 0.1
    assert np.mean(longer) < 0.05


def test_lost():
    """A wedge that jams with no room for friction; what does not converge does no work that bristles do not give."""
    law = pf.LuGre(mu_s=1.2, sigma_0=1e8, elasto_plastic=0.9)
    model = pf.ReducedModel(pf.ContactPatch.disc(radius=0.01, cells=9), law, cells=9)
    patches = CoupledPatches([model] * 2)
    weights = model.reduction.patch.weights()
    lost = 0
    for _, found, host, state, dt in compared(
        patches, wp.float32, both_runs(patches, 100, 10, height=0.6)
    ):
        flat = found.wrench.reshape(len(state), -1)
        change = flat - host.wrench.reshape(flat.shape)
        twist = host.twist.reshape(flat.shape) + np.einsum(
            "eij,ej->ei", host.twist_response, change
        )
        bristles = (
            z.reshape(len(state), 2, -1, len(weights)).astype(float)
            for z in (state, found.state)
        )
        squares = ((z**2).sum(axis=2) @ weights for z in bristles)
        before, after = (
            0.5 * law.sigma_0 * (found.normal_force * each).sum(axis=1)
            for each in squares
        )
        work = dt * (twist * flat).sum(axis=1)
        excess = (work - (before - after)) / (np.abs(work) + before + after + 1e-300)
        wrong = found.converged == 0
        lost += wrong.sum()
        assert (excess[wrong] <= 1e-4).all()
    assert lost >= 5


# ---------------------------------------------------------------------- parameters and arrays


@pytest.fixture(scope="module")
def kernel():
    return front.CoupledPatches(pair().models, worlds=3, dtype=wp.float64, device="cpu")


def problem(worlds=3):
    host = HostStep(
        twist=np.tile([[0.02, 0.01, 1.0], [0.01, 0.0, -2.0]], (worlds, 1, 1)),
        normal_force=np.tile([1.0, 2.0], (worlds, 1)),
        wrench=np.zeros((worlds, 2, 3)),
        twist_response=np.tile(1e-3 * np.diag([1.0, 1.0, 1e4] * 2), (worlds, 1, 1)),
        load_response=np.tile(
            [[0.05, 0.0, 3.0, 0.0, 0.02, -2.0], [-0.05, 0.0, 2.0, 0.0, 0.02, 5.0]],
            (worlds, 1, 1),
        ),
    )
    return np.zeros((worlds, *pair().state_shape)), host


def test_parameters():
    """Each world, and each patch of it, may have numbers of its own."""
    mu = np.array([[0.3, 0.5], [0.6, 0.5], [0.9, 0.2]])
    scale = np.array([1.0, 2.0, 0.5])
    given_ = {"mu_c": mu, "mu_s": 1.2 * mu, "scale": scale}
    kernel = front.CoupledPatches(
        pair().models, worlds=3, parameters=given_, dtype=wp.float64, device="cpu"
    )
    state, host = problem()
    results = kernel.results()
    kernel.step(array(wp.float64, state), given(wp.float64, host), 1e-3, results)
    for w in range(3):
        laws = [
            dataclasses.replace(LAW, mu_c=mu[w, p], mu_s=1.2 * mu[w, p])
            for p in range(2)
        ]
        shapes = (
            pf.ContactPatch.disc(0.01 * scale[w], cells=15),
            pf.ContactPatch.rectangle(*(scale[w] * np.array([0.05, 0.01])), cells=15),
        )
        own = CoupledPatches(
            [
                pf.ReducedModelPublished(
                    shapes[0], laws[0], surface=pf.LimitSurfaceEllipsoid(shapes[0])
                ),
                pf.ReducedModel(shapes[1], laws[1]),
            ]
        )
        expected = own.step(
            state[w],
            HostStep(*(None if each is None else each[w] for each in host)),
            1e-3,
        )
        assert results.wrench.numpy()[w] == pytest.approx(expected.wrench, rel=1e-6)


def test_moments():
    """Pressures follow moments, in patches of another size too; not that of a patch that holds its own."""
    shape = SHAPES[0]
    larger = pf.ContactPatch.disc(0.015, cells=15)
    host = problem()[1]
    moments = np.array([[[0.003, -0.002]], [[0.0, 0.01]], [[0.0, 0.0]]]) * [
        [1.0],
        [-0.5],
    ]
    given_ = {
        "worlds": 3,
        "parameters": {"scale": 1.5},
        "dtype": wp.float64,
        "device": "cpu",
    }
    for follows in (None, [False, True]):
        kernel = front.CoupledPatches([pf.ReducedModel(shape, LAW), pf.ReducedModel(shape, LAW)],
                                      follows=follows, **given_)  # fmt: skip
        results = kernel.results()
        start = np.zeros((3, *kernel.state_shape))
        kernel.step(
            array(wp.float64, start),
            given(wp.float64, host._replace(moments=moments)),
            1e-3,
            results,
        )
        kernel.check()
        same = CoupledPatches(
            [pf.ReducedModel(larger, LAW), pf.ReducedModel(larger, LAW)]
        )
        held = moments * [[follows is None], [True]]
        expected = same.step(start, host._replace(moments=held), 1e-3)
        assert results.wrench.numpy() == pytest.approx(expected.wrench, rel=1e-6)
        assert len({round(each, 6) for each in expected.wrench[:, 1, 0]}) == 3


def test_faint():
    """Squares of squares of faint states leave single precision: their steps are those of double precision."""
    patches = CoupledPatches([pf.ReducedModel(SHAPES[0], LAW)])
    state = np.outer(
        10.0 ** -np.arange(7.0, 40.0), np.geomspace(1.0, 1e-9, *patches.state_shape)
    )
    twist, load, wrench, response = (
        np.repeat(each[:1], len(state), axis=0) for each in problem()[1][:4]
    )
    host = HostStep(
        1e-3 * twist[:, :1], load[:, :1], wrench[:, :1], 300.0 * response[:, :3, :3]
    )
    runs = [(state, host, np.full(len(state), 1e-3), None)]
    ((expected, found, *_),) = compared(patches, wp.float32, runs)
    assert found.twist == pytest.approx(expected.twist, rel=1e-4)


def test_no_load(kernel):
    """A patch without load has no wrench and forgets; its neighbour does not."""
    state, host = problem()
    host.normal_force[:, 0] = 0.0
    results = kernel.results()
    kernel.step(array(wp.float64, state + 1e-7), given(wp.float64, host), 1e-3, results)
    assert not results.wrench.numpy()[:, 0].any() and results.wrench.numpy()[:, 1].any()
    assert not results.state.numpy()[:, :3].any() and results.state.numpy()[:, 3:].any()


@pytest.mark.parametrize(
    "name, value", [("state", np.nan), ("twist", np.inf), ("normal_force", -1.0)]
)
def test_bad_numbers(kernel, name, value):
    """A world with bad numbers keeps its state and has no wrench; its neighbours do not see it."""
    state, host = problem()
    (state if name == "state" else getattr(host, name)).reshape(3, -1)[1, 0] = value
    results = kernel.results()
    kernel.step(array(wp.float64, state), given(wp.float64, host), 1e-3, results)
    assert results.wrench.numpy()[[0, 2]].all() and not results.wrench.numpy()[1].any()
    assert (
        results.iterations.numpy().tolist()[1] == -1
        and not results.converged.numpy()[1]
    )
    assert np.array_equal(results.state.numpy()[1], state[1], equal_nan=True)
    with refused(
        r"state and host must be finite and in range, got .* worlds \[1\]",
        pf.FrictionError,
    ):
        kernel.check()
    kernel.check()


def test_bad_arrays(kernel):
    state, host = problem()
    state = array(wp.float64, state)
    host = given(wp.float64, host)
    results = kernel.results()
    single = array(wp.float32, np.ones((3, 2)))
    for words, change in {
        "normal_force must have shape": {"normal_force": single},
        "load_response must have shape": {"load_response": host.twist_response},
        "moments must have shape": {"moments": array(wp.float64, np.zeros((3, 2)))},
    }.items():
        with refused(words, pf.FrictionError):
            kernel.step(state, host._replace(**change), 1e-3, results)
    with refused(r"results\.state must be another array", pf.FrictionError):
        kernel.step(results.state, host, 1e-3, results)
    with refused("dt must", pf.FrictionError):
        kernel.step(state, host, -1.0, results)


@pytest.mark.parametrize(
    "options, words",
    [
        ({"models": []}, "models must hold at least one"),
        ({"worlds": 0}, "worlds must"),
        ({"follows": [True]}, "follows must hold one for each of 2 models, got 1"),
        ({"parameters": {"mu": 1.0}}, "mu"),
        (
            {"parameters": {"mu_c": np.ones(2)}},
            r"mu_c must be a number or have shape \(3,\)",
        ),
    ],
)
def test_bad_options(options, words):
    with refused(words, pf.FrictionError):
        front.CoupledPatches(
            **{"models": pair().models, "worlds": 3, "device": "cpu"} | options
        )


def test_no_allocation(kernel, monkeypatch):
    """A step neither makes an array nor waits, so that a CUDA graph can hold it."""
    state, host = problem()
    state = array(wp.float64, state)
    host = given(wp.float64, host)
    results = kernel.results()

    def forbidden(*_, **__):
        raise AssertionError("an allocation or synchronisation")

    monkeypatch.setattr(wp.array, "__init__", forbidden)
    for name in ("synchronize", "synchronize_device", "synchronize_stream", "copy"):
        monkeypatch.setattr(wp, name, forbidden)
    kernel.step(state, host, 1e-3, results)
    with pytest.raises(AssertionError, match="allocation"):
        kernel.results()


def test_gpus(kernel, tmp_path):
    """The kernel compiles for GPUs on machines that have none."""
    wp.compile_aot_module(kernel.kernel.module, arch=[80], module_dir=tmp_path)
    (made,) = tmp_path.rglob("*.sm80.*")
    assert made.stat().st_size > 1000
