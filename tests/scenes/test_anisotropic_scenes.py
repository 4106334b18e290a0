"""Direction-dependent friction in scenes and files, and who refuses it."""

import math

import numpy as np
import pytest
from scipy import integrate

import planarfriction as pf
from planarfriction.errors import FileError
from planarfriction.scenes import driven, in_hand
from tests.support.anisotropic import (
    GRAIN,
    GRAINS,
    LEANS,
    PATCHES,
    PLAIN,
    STRIBECK,
    reduced,
)
from tests.support.files import again
from tests.support.refusals import refused
from tests.support.repository import script

every_patch = pytest.mark.parametrize("name", PATCHES)


def test_a_block_with_a_grooved_sole_drifts_as_the_closed_form_says():
    example = script("examples/grooved_incline.py")
    slope = math.radians(25.0)
    for kind in ("distributed", "reduced"):
        assert example.drift_of(example.slide(slope, kind)) == pytest.approx(
            example.drift(slope), abs=1e-4
        )
    limit = example.steepest_at_rest()
    assert (
        np.hypot(*(example.slide(limit - 0.002).data[v].values[-1] for v in "xy"))
        < 1e-4
    )
    assert (
        np.hypot(*(example.slide(limit + 0.01).data[v].values[-1] for v in "xy")) > 1e-3
    )


@every_patch
def test_the_solver_agrees_with_an_independent_integration(name):
    """The patch is moved as prescribed; the bristles are integrated from `rate` by a general solver."""
    model = pf.DistributedModel(PATCHES[name], STRIBECK)
    twist = pf.Signal.sampled(
        [0.0, 0.05], [(0.0, 0.0, 0.0), (3e-3, -1e-3, 0.4)], hold="linear"
    )
    data = pf.simulate(
        driven(model, twist=twist, at="origin", t_end=0.05), rtol=1e-8, atol=1e-7
    ).data

    def rate(t, z):
        return (
            model.rate(z.reshape(model.state_shape) * 1e-6, twist(t), 1.0).ravel() * 1e6
        )

    run = integrate.solve_ivp(
        rate, (0.0, 0.05), model.rest().ravel(), method="LSODA", rtol=1e-9, atol=1e-9
    )
    wrench = model.wrench(
        run.y[:, -1].reshape(model.state_shape) * 1e-6, twist(0.05), 1.0
    )
    np.testing.assert_allclose(
        [data[v].values[-1, 0] for v in ("fx", "fy", "tau")],
        wrench,
        rtol=1e-5,
        atol=1e-8,
    )


@every_patch
def test_a_free_body_converges_in_few_steps(name):
    """A wrong Jacobian would cost the solver its order: many more steps, and results that depend on the tolerance."""
    model = pf.DistributedModel(PATCHES[name], STRIBECK)
    plain = pf.DistributedModel(PLAIN, STRIBECK)
    loose, tight = (
        pf.simulate(in_hand(model, t_end=0.4), rtol=rtol, atol=50 * rtol)
        for rtol in (1e-5, 1e-8)
    )
    reference = pf.simulate(in_hand(plain, t_end=0.4), rtol=1e-8, atol=5e-7)
    assert tight.statistics.steps < 2.0 * reference.statistics.steps
    for history in ("x", "y"):
        np.testing.assert_allclose(loose.data[history], tight.data[history], atol=2e-6)


def test_scenes_round_trip_to_the_bit(tmp_path):
    for patch in PATCHES.values():
        scene = in_hand(pf.DistributedModel(patch, STRIBECK))
        read = again(scene, tmp_path).contacts[0].model.patch
        assert np.array_equal(read.levers(), patch.levers())
        assert np.array_equal(read.asymmetries(), patch.asymmetries())


SHORT = """
t_end = 1.0
body = { mass = 1.0, inertia = 1e-3 }
[contact]
normal_force = 1.0
law = {}
[contact.patch]
shape = "disc"
radius = 0.01
cells = 7
metric = { angle = 0.4, along = 1.3, across = 0.6 }
asymmetry = [0.1, 0]
"""


def test_a_grain_in_a_scene_file(tmp_path):
    (tmp_path / "scene.toml").write_text(SHORT)
    patch = pf.Scene.from_file(tmp_path / "scene.toml").contacts[0].model.patch
    np.testing.assert_array_equal(patch.metric, GRAIN)
    np.testing.assert_array_equal(patch.asymmetry, [0.1, 0.0])
    for old, new, message in (
        (
            "along = 1.3",
            "along = -1",
            r"\[contact.patch.metric\]: along must be > 0, got -1.0",
        ),
        ("along = 1.3, ", "", r"\[contact.patch.metric\]: missing key 'along'"),
        ("across", "acros", "unknown key 'acros'"),
        ("[0.1, 0]", "[2, 0]", r"\[contact.patch\]: asymmetry must be shorter than 1"),
    ):
        (tmp_path / "wrong.toml").write_text(SHORT.replace(old, new))
        with refused(message, FileError):
            pf.Scene.from_file(tmp_path / "wrong.toml")


def test_finer_cells_keep_their_friction():
    fine = PATCHES["cells"].refined(2)
    assert np.array_equal(fine.metric, np.repeat(GRAINS, 4, axis=0))
    assert np.array_equal(fine.asymmetry, np.repeat(LEANS, 4, axis=0))
    assert np.array_equal(PATCHES["both"].refined(3).metric, GRAIN)


def test_dropped_cells_take_their_metric_along():
    kept = np.arange(PLAIN.cells) % 3 > 0
    pressure = np.where(kept, 1.0, 0.0)
    patch = pf.ContactPatch(
        PLAIN.positions, PLAIN.areas, pressure, metric=GRAINS, asymmetry=LEANS
    )
    assert np.array_equal(patch.metric, GRAINS[kept])
    assert np.array_equal(patch.asymmetry, LEANS[kept])


# ---------------------------------------------------------------------- wrong input


@pytest.mark.parametrize(
    ("metric", "asymmetry", "message"),
    [
        (
            [[1.0, 2.0], [2.0, 1.0]],
            None,
            "metric must be symmetric and positive definite",
        ),
        (
            [[1.0, 0.1], [0.0, 1.0]],
            None,
            "metric must be symmetric and positive definite",
        ),
        (np.zeros((2, 2)), None, "metric must be symmetric and positive definite"),
        (np.eye(3), None, r"metric must have shape \[2, 2\], got shape \[3, 3\]"),
        (np.tile(np.eye(2), (3, 1, 1)), None, r"metric must have shape \[12, 2, 2\]"),
        ([[math.nan, 0.0], [0.0, 1.0]], None, "metric must be finite"),
        (None, (0.6, 0.8), "asymmetry must be shorter than 1"),
        (None, 0.5, r"asymmetry must have shape \[2\]"),
        (None, np.zeros((3, 2)), r"asymmetry must have shape \[12, 2\]"),
    ],
)
def test_wrong_metrics_get_one_line(metric, asymmetry, message):
    with refused(message):
        PLAIN.with_friction_metric(metric, asymmetry)


@pytest.mark.parametrize(
    "make",
    [
        lambda: pf.LimitSurfaceTablePublished(PATCHES["metric"]),
        lambda: pf.LimitSurfaceEllipsoid(PATCHES["cell metrics"]),
        lambda: pf.ReducedModelPublished(PATCHES["metric"], STRIBECK),
        lambda: reduced(PATCHES["cell metrics"]),
        lambda: reduced(PATCHES["both"]),
        lambda: pf.ReducedModelPublished(
            PATCHES["metric"], STRIBECK, surface=pf.LimitSurfaceTable(PLAIN)
        ),
        lambda: pf.identify.identify_motion([], PATCHES["metric"], None),  # pyright: ignore
    ],
)
def test_what_knows_only_isotropic_friction_refuses(make):
    with refused("must"):
        make()
