"""Central differences of fourth order, and derivatives of models and scenes against them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import planarfriction as pf

MOTION = "vx", "vy", "omega", "x", "y", "theta"
WRENCH = "fx", "fy", "tau"


def differences(function: Callable, at: np.ndarray, steps) -> np.ndarray:
    """Return the slopes of a function by each entry of `at`, `[*result, *at.shape]`."""
    steps = np.broadcast_to(steps, at.shape)
    columns = []
    for index in np.ndindex(at.shape):
        change = np.zeros_like(at)
        change[index] = steps[index]
        near = np.subtract(function(at + change), function(at - change))
        far = np.subtract(function(at + 2 * change), function(at - 2 * change))
        columns.append((8.0 * near - far) / (12.0 * steps[index]))
    slopes = np.stack(columns, -1)
    return slopes.reshape(*slopes.shape[:-1], *at.shape)


def _assert_close(found, wanted, tolerance: float, name: str) -> None:
    """Compare arrays relative to the largest entry."""
    atol = tolerance * np.abs(wanted).max()
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=atol, err_msg=name)


def _of_each_cell(slopes: np.ndarray) -> np.ndarray:
    """Return the slopes of states by states as models do: those of a cell by its own bristle, the only ones."""
    if slopes.ndim == 2:
        return slopes
    own = np.einsum("anbn->abn", slopes)
    assert np.count_nonzero(slopes) <= np.count_nonzero(own)
    return own


def assert_rate_jacobians(
    model, state, twist, load, by_state, by_twist, tolerance=1e-6
) -> None:
    """Compare the Jacobians of rate and wrench with differences, relative to the largest entry of each."""
    found = model.jacobians(state, twist, load)
    for name, of in (("rate", model.rate), ("wrench", model.wrench)):
        slopes = differences(lambda z, of=of: of(z, twist, load), state, by_state)
        slopes = _of_each_cell(slopes) if name == "rate" else slopes
        _assert_close(getattr(found, f"{name}_state"), slopes, tolerance, name)
        slopes = differences(lambda v, of=of: of(state, v, load), twist, by_twist)
        _assert_close(getattr(found, f"{name}_twist"), slopes, tolerance, name)
    wrench = model.wrench(state, twist, load)
    _assert_close(load * found.wrench_load, wrench, 1e-12, "load")


def assert_step_jacobians(
    model, state, twist, load, dt, by_state, by_twist, tolerance=1e-6, **given
) -> None:
    """Compare the Jacobians of a step with differences, relative to the largest entry of each."""
    found = model.step_jacobians(state, twist, load, dt, **given)
    for i, name in enumerate(("state", "wrench")):

        def of(z, v, i=i):
            return model.step(z, v, load, dt, **given)[i]

        slopes = differences(lambda z, of=of: of(z, twist), state, by_state)
        slopes = _of_each_cell(slopes) if name == "state" else slopes
        _assert_close(getattr(found, f"{name}_state"), slopes, tolerance, name)
        slopes = differences(lambda v, of=of: of(state, v), twist, by_twist)
        _assert_close(getattr(found, f"{name}_twist"), slopes, tolerance, name)
    if load is not None:
        _assert_close(load * found.wrench_load, of(state, twist), 1e-12, "load")


def scene_slopes(make: Callable, at: float, step: float) -> list[np.ndarray]:
    """Return the slopes of motion `[m, 6]` and wrenches `[m, contacts, 3]` by a number of scenes, of tight runs."""

    def histories(number):
        data = pf.simulate(make(number), rtol=1e-11, atol=1e-11).data
        return [
            np.stack([data[name].values for name in names], -1)
            for names in (MOTION, WRENCH)
        ]

    runs = [histories(at + i * step) for i in (1, -1, 2, -2)]
    return [
        (8.0 * (near - back) - (far - far_back)) / (12.0 * step)
        for near, back, far, far_back in zip(*runs, strict=True)
    ]


def assert_sensitivities(
    found, column: int, make, at, step, tolerance, rounding=0.0
) -> None:
    """Compare a column of sensitivities of a scene with differences, relative to the largest slope of each history."""
    derivatives = found.d_motion, found.d_wrenches
    for slopes, wanted in zip(derivatives, scene_slopes(make, at, step), strict=True):
        axes = tuple(range(wanted.ndim - 1))
        errors = np.abs(slopes[..., column] - wanted).max(axes)
        allowed = tolerance * np.abs(wanted).max(axes) + rounding
        assert (errors <= allowed).all(), (found.names[column], errors / allowed)
