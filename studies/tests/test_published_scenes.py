"""The published experiments at the default tolerances, against converged solutions of the same equations."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.geometry import wrench_at
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction_studies.experiments.facts import converged

ELASTIC = pf.LuGre(mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.9))
PLAIN = pf.LuGre(mu_s=1.2)
MODELS = {"d": pf.DistributedModel, "r": pf.ReducedModelPublished}
CELL = 0.02 / 21


def sampled(solution: pf.Solution, name: str, times: np.ndarray) -> np.ndarray:
    """Values at recorded times (the published ones are multiples of 0.01 s)."""
    values = solution.data[name].to_numpy()
    return values[np.rint(times / 0.01).astype(int)]


@functools.cache
def patch(name: str, width: float = 0.02) -> pf.ContactPatch:
    return PUBLISHED_PATCHES[name](width=width)


def assert_in_hand(solution: pf.Solution, key: str) -> None:
    # What is asked of the defaults: 2e-6 m and 2e-5 rad at every sample, of motions of 2 cm and 0.15 rad.
    expected = converged(key)
    for name, tolerance in (("x", 2e-6), ("y", 2e-6), ("theta", 2e-5)):
        np.testing.assert_allclose(
            sampled(solution, name, expected["time"]),
            expected[name],
            rtol=0.0,
            atol=tolerance,
        )


@pytest.mark.parametrize("load", [1, 2])
@pytest.mark.parametrize("kind", ["d", "r"])
@pytest.mark.parametrize("shape", ["Circle", "Square"])
def test_in_hand(shape, kind, load):
    model = MODELS[kind](patch(shape), ELASTIC)
    solution = pf.simulate(
        pf.scenes.in_hand(model, normal_force=pf.scenes.in_hand_load(load))
    )
    assert_in_hand(solution, f"in_hand/{shape}/{kind}{load}")


def test_in_hand_force_is_that_of_one_finger():
    solution = pf.simulate(
        pf.scenes.in_hand(pf.DistributedModel(patch("Circle"), ELASTIC))
    )
    expected = converged("in_hand/Circle/d1")
    # The converged forces come from other steps: near a slip the force follows the velocity, hence 2e-3 of 1 N.
    for name, tolerance in (("fx", 2e-3), ("fy", 2e-3), ("tau", 2e-5)):
        found = sampled(solution, name, expected["time"])[:, 0]
        np.testing.assert_allclose(found, expected[name], rtol=0.0, atol=tolerance)


@pytest.mark.parametrize("kind", ["d", "r"])
def test_in_hand_with_changing_pressure(kind):
    """`k = 2`, `R = 6 f_N^(1/3)` cells, updated with the load; the reduced model keeps its table and rescales r."""
    finger = pf.SoftFinger(c=6.0 * CELL, n=1.0 / 3.0, k=2.0, radius_max=0.01)
    soft = pf.ContactPatch.rectangle(0.02, cells=21, pressure=finger)
    if kind == "d":
        model = pf.DistributedModel(soft, ELASTIC)
    else:
        # From 5.36 N on the radius is at its cap.
        surface = pf.LimitSurfaceTablePublished(soft, normal_force=6.0)
        model = pf.ReducedModelPublished(
            soft, ELASTIC, surface=surface, on_load_change="rescale"
        )
    assert_in_hand(pf.simulate(pf.scenes.in_hand(model)), f"load_dependent/{kind}1")


@pytest.mark.parametrize("kind", ["d", "r"])
@pytest.mark.parametrize("shape", ["Circle", "Square", "Line", "NonConvex1"])
def test_velocity_driven(shape, kind):
    model = MODELS[kind[0]](patch(shape), ELASTIC)
    solution = pf.simulate(pf.scenes.driven(model))
    expected = converged(f"driven/{shape}/{kind}")
    found = np.stack(
        [
            sampled(solution, name, expected["time"])[:, 0]
            for name in ("fx", "fy", "tau")
        ],
        axis=-1,
    )
    found = wrench_at(found, model.patch.centre_of_pressure())
    for i, (name, tolerance) in enumerate((("fx", 2e-5), ("fy", 2e-5), ("tau", 2e-7))):
        np.testing.assert_allclose(
            found[:, i], expected[name], rtol=0.0, atol=tolerance, err_msg=name
        )


@pytest.mark.parametrize("kind", ["d", "d_ep", "r", "r_ep"])
def test_tangential_drift(kind):
    law = ELASTIC if kind.endswith("_ep") else PLAIN
    model = MODELS[kind[0]](patch("Circle", 0.05), law)
    solution = pf.simulate(pf.scenes.drift(model))
    expected = converged(f"drift/{kind}")
    for name in ("x", "theta"):
        # 5e-4 of the span: the drift of the plain model adds up over 40,000 times the size of one step's error.
        span = np.abs(expected[name]).max()
        found = sampled(solution, name, expected["time"])
        np.testing.assert_allclose(
            found, expected[name], rtol=0.0, atol=5e-4 * span, err_msg=name
        )


@pytest.mark.parametrize("load", ["tangential", "normal"])
def test_elasto_plastic_plateaus_are_exact(load):
    model = pf.DistributedModel(patch("Circle", 0.05), ELASTIC)
    solution = pf.simulate(pf.scenes.drift(model, load=load), t_end=1.0)
    stiffness = ELASTIC.sigma_0 * 9.81
    # Asked: 1e-4.
    assert float(solution.data.x[-1]) == pytest.approx(1.0 / stiffness, rel=1e-6)
    if load == "normal":
        theta = 0.03 / (stiffness * model.patch.second_moment())
        assert theta == pytest.approx(1.067983e-5, rel=1e-6)
        assert float(solution.data.theta[-1]) == pytest.approx(theta, rel=1e-6)


def test_elasto_plastic_bristles_do_not_drift_where_plain_ones_do():
    creep = {}
    for name, law in (("elastic", ELASTIC), ("plain", PLAIN)):
        x = pf.simulate(
            pf.scenes.drift(pf.DistributedModel(patch("Circle", 0.05), law))
        ).data.x
        # the load repeats itself every 1/3 s: whole periods apart, before the torque begins
        creep[name] = float(
            x.sel(time=2.67, method="nearest") - x.sel(time=1.67, method="nearest")
        )
    scale = 1.0 / (ELASTIC.sigma_0 * 9.81)
    assert abs(creep["elastic"]) < 1e-4 * scale
    assert creep["plain"] > 0.1 * scale
