"""Warp kernels against the compiled steps that they are traced from, on Warp's CPU device."""

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from tests.support import single_precision
from tests.support.refusals import refused
from tests.support.walks import walk

wp = pytest.importorskip("warp", reason="needs the extra [warp]")
Model = pytest.importorskip("planarfriction.warp").Model

pytestmark = pytest.mark.warp

DISC = pf.ContactPatch.disc(0.01)
METRIC = pf.ContactPatch.rectangle(0.02, 0.01).with_friction_metric(
    [[1.0, 0.2], [0.2, 1.5]]
)
LAW = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
MODELS = {
    "few": lambda size=0.01: pf.ReducedModel(pf.ContactPatch.disc(size), LAW),
    "discs": lambda size=0.01: pf.DistributedModel(
        pf.ContactPatch.disc(size, cells=5).discs(), LAW
    ),
    "turned discs": lambda: pf.DistributedModel(METRIC.discs(12), LAW),
    "distributed": lambda: pf.DistributedModel(METRIC, LAW),
    "at a load": lambda: pf.ReducedModel(DISC, LAW, pad=pf.Pad.at_load(2.0)),
    "layer": lambda size=0.01: pf.DistributedModel(
        pf.ContactPatch.disc(size, cells=5),
        LAW,
        pad=pf.Pad.layer(12e6 * (0.01 / size) ** 2, 2e-3),
    ),
    "published": lambda size=0.01: pf.ReducedModelPublished(
        pf.ContactPatch.disc(size), LAW
    ),
}
KINDS = {wp.float64: np.float64, wp.float32: np.float32}


def arrays(dtype, *given):
    return [wp.array(each, dtype=dtype, device="cpu") for each in given]


def outputs(friction, *steps):
    shape = (*steps, friction.contacts, 3)
    return friction.rest(), wp.zeros(
        shape, dtype=friction.dtype, device=friction.device
    )


def errors(model, dtype, contacts, rounds):
    """Return for each step the error of its wrench per unit load, beside the largest wrench per unit load."""
    friction = Model(model, contacts=contacts, dtype=dtype, device="cpu")
    new, wrench = outputs(friction)
    lever = [1.0, 1.0, model.patch.contact_radius()]
    found = []
    largest = 0.0
    for state, twist, load, states, wrenches in walk(
        model, contacts, rounds, KINDS[dtype]
    ):
        friction.step(*arrays(dtype, state, twist, load), 1e-3, new, wrench)
        per_load = lever * np.maximum(load, 1e-9)[:, None]
        found.append(np.abs((wrench.numpy() - wrenches) / per_load).max(axis=1))
        largest = max(largest, np.abs(wrenches / per_load).max())
        bent = max(LAW.largest_deflection, np.abs(states).max())
        assert (
            np.abs(new.numpy() - states).max()
            < (1e-12 if dtype is wp.float64 else 1e-4) * bent
        )
        assert (
            not new.numpy()[load == 0.0].any() and not wrench.numpy()[load == 0.0].any()
        )
    friction.check()
    return np.concatenate(found) / largest


@pytest.mark.parametrize("dtype", KINDS, ids=["double", "float"])
@pytest.mark.parametrize("name", MODELS)
def test_steps(name, dtype):
    error = errors(MODELS[name](), dtype, 100, 20)
    assert error.max() < (1e-12 if dtype is wp.float64 else 1e-3)
    assert np.quantile(error, 0.999) < (1e-12 if dtype is wp.float64 else 1e-5)


# ---------------------------------------------------------------------- parameters


def test_parameters():
    """Contacts with numbers of their own are models with those numbers, and patches of another size."""
    mu_c = np.array([0.3, 0.6, 0.9])
    scale = np.array([1.0, 2.0, 0.5])
    friction = Model(
        MODELS["published"](),
        contacts=3,
        parameters={"mu_c": mu_c, "mu_s": 1.5 * mu_c, "scale": scale},
        device="cpu",
        dtype=wp.float64,
    )
    twist = np.array([[1e-3, 2e-3, 0.3]] * 3)
    load = np.array([1.0, 2.0, 3.0])
    new, wrench = outputs(friction)
    for _ in range(3):
        friction.step(new, *arrays(wp.float64, twist, load), 1e-3, new, wrench)
    friction.check()
    for i in range(3):
        law = dataclasses.replace(LAW, mu_c=mu_c[i], mu_s=1.5 * mu_c[i])
        own = pf.ReducedModelPublished(pf.ContactPatch.disc(0.01 * scale[i]), law)
        state = own.rest()
        for _ in range(3):
            state, expected = own.step(state, twist[i], load[i], 1e-3)
        assert wrench.numpy()[i] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", ["few", "discs", "layer", "published"])
def test_moments(name):
    """The pressure of a patch follows moments, in a patch of another size too."""
    scale = np.array([1.0, 2.0, 0.5, 1.0])
    rng = np.random.default_rng(0)
    friction = Model(
        MODELS[name](),
        contacts=4,
        parameters={"scale": scale},
        device="cpu",
        dtype=wp.float64,
    )
    twist = rng.normal(size=(4, 3)) * [1e-3, 1e-3, 0.3]
    load = np.array([1.0, 2.0, 3.0, 0.0])
    moments = load[:, None] * rng.normal(size=(4, 2)) * 5e-3
    (new, wrench) = outputs(friction)
    given = arrays(wp.float64, twist, load)
    for _ in range(3):
        friction.step(
            new,
            *given,
            1e-3,
            new,
            wrench,
            moments=wp.array(moments, dtype=wp.float64, device="cpu"),
        )
    friction.check()
    for i, size in enumerate(scale):
        own = MODELS[name](0.01 * size)
        state = own.rest()
        for _ in range(3):
            state, expected = own.step(
                state, twist[i], load[i], 1e-3, moments=moments[i]
            )
        # the softness of `cells.tilt` magnifies rounding where no three cells have the centre between them
        assert wrench.numpy()[i] == pytest.approx(expected, rel=1e-9, abs=1e-8)


@pytest.mark.parametrize(
    "name", ["feet on a line", pytest.param("many points", marks=pytest.mark.slow)]
)
def test_moments_in_single_precision(name):
    model = pf.DistributedModel(single_precision.PATCHES[name], LAW)
    inputs = single_precision.drawn(model, 600, 5)
    state, twist, load, dt, moments = inputs
    friction = Model(model, contacts=600, device="cpu")
    new, wrench = outputs(friction)
    state, twist, load, moments = arrays(wp.float32, state, twist, load, moments)
    friction.step(state, twist, load, float(dt[0]), new, wrench, moments=moments)
    friction.check()
    assert single_precision.error(model, inputs, wrench.numpy()) < 1e-4


def test_shapes():
    """Contacts have patches and laws of their own; which one can be written between steps."""
    rough = dataclasses.replace(LAW, mu_c=1.1, mu_s=1.3)
    models = [
        pf.ReducedModel(DISC, LAW),
        pf.ReducedModel(pf.ContactPatch.rectangle(0.02, 0.01), rough, cells=20),
    ]
    friction = Model(
        models, contacts=3, which=[1, 0, 1], device="cpu", dtype=wp.float64
    )
    twist = np.array([[1e-3, 2e-3, 0.3]] * 3)
    load = np.array([1.0, 2.0, 3.0])
    given = arrays(wp.float64, twist, load)
    moments = np.array([[1e-3, 2e-3]] * 3)

    def expected(i, kind, law):
        own = pf.ReducedModel(kind.patch, law, cells=kind.cells)
        return own.step(own.rest(), twist[i], load[i], 1e-2, moments=moments[i])[1]

    def found():
        new, wrench = outputs(friction)
        friction.step(
            friction.rest(),
            *given,
            1e-2,
            new,
            wrench,
            moments=wp.array(moments, dtype=wp.float64, device="cpu"),
        )
        friction.check()
        return wrench.numpy().copy()

    first = [
        expected(0, models[1], rough),
        expected(1, models[0], LAW),
        expected(2, models[1], rough),
    ]
    assert found() == pytest.approx(np.array(first), rel=1e-9)
    # The laws stay with the contacts.
    friction.which.assign(np.array([0, 1, 1], dtype=np.int32))
    then = [
        expected(0, models[0], rough),
        expected(1, models[1], LAW),
        expected(2, models[1], rough),
    ]
    assert found() == pytest.approx(np.array(then), rel=1e-9)
    friction.which.assign(np.array([0, 2, 1], dtype=np.int32))
    with refused(
        r"parameters must be finite and in range, got .* contacts \[1\]",
        pf.FrictionError,
    ):
        found()


def test_written_parameters():
    """Parameters written between steps count from the next one."""
    friction = Model(MODELS["few"](), contacts=1, device="cpu", dtype=wp.float64)
    given = arrays(wp.float64, [[0.1, 0.0, 0.0]], [1.0])
    new, wrench = outputs(friction)
    friction.step(friction.rest(), *given, 1e-2, new, wrench)
    before = wrench.numpy().copy()  # on the CPU, `numpy` gives the same memory
    row = friction.parameters.numpy()
    row[0, [friction.names.index(name) for name in ("mu_c", "mu_s")]] *= 0.5
    friction.parameters.assign(row)
    friction.step(friction.rest(), *given, 1e-2, new, wrench)
    viscous = LAW.sigma_2 * 0.1
    assert wrench.numpy()[0, 0] + viscous == pytest.approx(
        0.5 * (before[0, 0] + viscous), rel=1e-6
    )


# ---------------------------------------------------------------------- rollouts


def test_rollout():
    """A rollout is its steps, from one launch that allocates nothing."""
    model = MODELS["few"]()
    friction = Model(model, contacts=5, device="cpu", dtype=wp.float64)
    walked = [(twist, load) for _, twist, load, _, _ in walk(model, 5, 6)]
    twists, loads = (np.stack(each) for each in zip(*walked, strict=True))
    new, wrenches = outputs(friction, 6)
    friction.rollout(
        friction.rest(), *arrays(wp.float64, twists, loads), 1e-3, new, wrenches
    )
    state, wrench = outputs(friction)
    for i, (twist, load) in enumerate(walked):
        friction.step(state, *arrays(wp.float64, twist, load), 1e-3, state, wrench)
        assert wrench.numpy() == pytest.approx(
            wrenches.numpy()[i], rel=1e-12, abs=1e-300
        )
    assert state.numpy() == pytest.approx(new.numpy(), rel=1e-12, abs=1e-300)


def test_no_allocation(monkeypatch):
    """A step neither makes an array nor waits, so that a CUDA graph can hold it."""
    friction = Model(MODELS["few"](), contacts=2, device="cpu")
    given = friction.rest(), *arrays(wp.float32, np.ones((2, 3)), np.ones(2))
    made = outputs(friction)

    def forbidden(*_, **__):
        raise AssertionError("an allocation or synchronisation")

    monkeypatch.setattr(wp.array, "__init__", forbidden)
    for name in ("synchronize", "synchronize_device", "synchronize_stream", "copy"):
        monkeypatch.setattr(wp, name, forbidden)
    friction.step(*given, 1e-3, *made)
    with pytest.raises(AssertionError, match="allocation"):
        friction.rest()


@pytest.mark.parametrize("name", ["few", "published"])
def test_source_of_gpus(name, tmp_path):
    """Kernels compile for GPUs on machines that have none."""
    friction = Model(MODELS[name](), contacts=1, device="cpu")
    wp.compile_aot_module(friction.kernel.module, arch=[80], module_dir=tmp_path)
    (made,) = tmp_path.rglob("*.sm80.*")
    assert made.stat().st_size > 1000


# ---------------------------------------------------------------------- wrong numbers


@pytest.mark.parametrize(
    "place, value",
    [("state", np.inf), ("twist", np.nan), ("load", -1.0), ("mu_s", 0.5)],
)
def test_bad_numbers(place, value):
    """A contact with bad numbers keeps its state and has no wrench; its neighbours do not see it."""
    model = MODELS["few"]()
    friction = Model(
        model,
        contacts=3,
        parameters={"mu_s": np.full(3, 1.2)},
        device="cpu",
        dtype=wp.float64,
    )
    given = {
        "state": np.zeros((3, *model.state_shape)),
        "twist": np.full((3, 3), 0.01),
        "load": np.ones(3),
    }
    if place in given:
        given[place].reshape(3, -1)[1, 0] = value
    else:
        row = friction.parameters.numpy()
        row[1, friction.names.index(place)] = value
        friction.parameters.assign(row)
    new, wrench = outputs(friction)
    friction.step(*arrays(wp.float64, *given.values()), 1e-3, new, wrench)
    _, expected = model.step(model.rest(), (0.01, 0.01, 0.01), 1.0, 1e-3)
    assert wrench.numpy() == pytest.approx(
        np.array([expected, 0.0 * expected, expected]), rel=1e-9
    )
    assert np.array_equal(new.numpy()[1], given["state"][1])
    what = "parameters" if place == "mu_s" else "state, twist and normal_force"
    with refused(
        rf"{what} must be finite and in range, got .* contacts \[1\]", pf.FrictionError
    ):
        friction.check()
    friction.check()


@pytest.mark.parametrize(
    "options, words",
    [
        ({"contacts": 0}, "contacts must"),
        ({"dtype": int}, "dtype must be wp.float32 or wp.float64"),
        ({"model": []}, "model must hold at least one"),
        ({"model": [MODELS["few"]()] * 2}, "which must name the model of each contact"),
        ({"which": [0, 1, 0]}, "which must be 3 whole numbers from 0 to 0"),
        (
            {"model": [MODELS["few"](), MODELS["published"]()], "which": [0, 1, 0]},
            "model must have one source",
        ),
        ({"parameters": {"mu": 1.0}}, "mu"),
        (
            {"parameters": {"mu_c": [1.0, 2.0]}},
            r"mu_c must be a number or have shape \(3,\), got \(2,\)",
        ),
    ],
)
def test_bad_options(options, words):
    with refused(words, pf.FrictionError):
        Model(**{"model": MODELS["few"](), "contacts": 3, "device": "cpu"} | options)


def test_bad_arrays():
    friction = Model(MODELS["few"](), contacts=2, device="cpu")
    given = [
        friction.rest(),
        *arrays(wp.float32, np.ones((2, 3)), np.ones(2)),
        1e-3,
        *outputs(friction),
    ]
    wrong = {
        "twist must have shape": (1, wp.zeros((2, 2), device="cpu")),
        "twist must be an array of Warp": (1, np.ones((2, 3))),
        "twist must be contiguous": (1, wp.zeros((3, 2), device="cpu").transpose()),
        "normal_force must have shape": (
            2,
            wp.zeros(2, dtype=wp.float64, device="cpu"),
        ),
        "dt must": (3, -1.0),
    }
    for words, (place, value) in wrong.items():
        with refused(words, pf.FrictionError):
            friction.step(*given[:place], value, *given[place + 1 :])
