"""Steps whose pressure follows moments, for comparisons of single with double precision."""

from __future__ import annotations

from typing import Any

import numpy as np

import planarfriction as pf

LAW = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)


def _grid(
    columns: int, rows: int, away: tuple[float, float] = (0.0, 0.0)
) -> np.ndarray:
    """Return points in rows of 20 mm and columns of 10 mm, turned: rows of points lie along no axis."""
    x, y = np.meshgrid(
        np.linspace(-0.01, 0.01, columns),
        np.linspace(-0.005, 0.005, rows) if rows > 1 else [0.0],
    )
    c = np.cos(0.4)
    s = np.sin(0.4)
    return np.stack([c * x - s * y, s * x + c * y], -1).reshape(-1, 2) + away


PATCHES = {
    "two feet": pf.ContactPatch.points([(0.0, 0.0), (0.01, 0.003)]),
    "three feet": pf.ContactPatch.points([(0.0, 0.0), (0.01, 0.0), (0.002, 0.008)]),
    "three uneven feet": pf.ContactPatch.points(
        [(0.0, 0.0), (0.01, 0.0), (0.002, 0.008)], [1.0, 3.0, 1e-3]
    ),
    "four feet": pf.ContactPatch.points(_grid(2, 2)),
    "feet on a line": pf.ContactPatch.points(_grid(7, 1)),
    "feet beside the origin": pf.ContactPatch.points(_grid(3, 3, (0.05, -0.03))),
    "many points": pf.ContactPatch.points(_grid(9, 9)),
    "few discs": pf.ContactPatch.disc(0.01).discs(8),
    "24 discs": pf.ContactPatch.rectangle(0.02, 0.02).discs(24),
    "discs with a metric": pf.ContactPatch.rectangle(0.02, 0.01)
    .with_friction_metric([[1.0, 0.2], [0.2, 1.5]])
    .discs(12),
    "steep pressure": pf.ContactPatch.rectangle(
        0.04, 0.01, (9, 5), pressure=pf.LinearGradient((8.0, -20.0))
    ),
}


def rounded(values: Any) -> np.ndarray:
    """Return values of single precision in double precision."""
    return np.ascontiguousarray(np.asarray(values, np.float32).astype(float))


def drawn(model: Any, count: int, seed: int) -> tuple[np.ndarray, ...]:
    """Draw state, twist, load, time step and moments, as single precision has them.

    A sixth of the centres of pressure each lies inside, on a line between two cells, at a cell, about the patch, beyond
    it, and far beyond; some contacts have no load.
    """
    rng = np.random.default_rng(seed)
    places = model.patch.positions
    middle = model.patch.centre_of_pressure(1.0)
    radius = model.patch.contact_radius(1.0)
    twist = (
        rng.normal(size=(count, 3))
        * (1.0, 1.0, 100.0)
        * 10.0 ** rng.uniform(-5.0, -1.0, (count, 1))
    )
    load = 10.0 ** rng.uniform(-2.0, 2.0, count)
    away = radius * rng.normal(size=(count, 2))
    load[::40] = 0.0
    one, other = places[rng.integers(0, len(places), (2, count))]
    share = rng.uniform(size=(count, 1))
    centres = (
        rng.dirichlet(np.full(len(places), 0.3), count) @ places,
        share * one + (1.0 - share) * other,
        one,
        middle + away,
        middle + 3.0 * away,
        middle + 10.0 ** rng.uniform(0.0, 2.0, (count, 1)) * away,
    )
    centre = np.choose(rng.integers(0, len(centres), count)[:, None], centres)
    load, moments = (
        rounded(load),
        rounded(load[:, None] * centre[:, ::-1] * (1.0, -1.0)),
    )
    state = rounded(1e-6 * rng.normal(size=(count, *model.state_shape)))
    return (
        state,
        rounded(twist),
        load,
        rounded(np.full(count, 10.0 ** rng.uniform(-4.0, -2.0))),
        moments,
    )


def reference(model: Any, inputs: tuple[np.ndarray, ...]) -> np.ndarray:
    """Return the wrenches of steps in double precision."""
    *given, moments = inputs
    return model.step(*given, moments=moments)[1]


def fastest(model: Any, inputs: tuple[np.ndarray, ...]) -> np.ndarray:
    """Return the largest speed of a place of the patch in each contact [m/s]."""
    vx, vy, spin = inputs[1].T[..., None]
    x, y = model.patch.positions.T
    return np.hypot(vx - spin * y, vy + spin * x).max(-1)


def error(
    model: Any, inputs: tuple[np.ndarray, ...], found: Any, *, beside: Any = 0.0
) -> float:
    """Return the largest error of wrenches in the load, or the wrench where that is larger; torques over the radius.

    Only what is beyond `beside`, a share of the load, counts.
    """
    wanted = reference(model, inputs)
    lever = np.array([1.0, 1.0, 1.0 / np.abs(model.patch.positions).max()])
    size = np.maximum(inputs[2], np.abs(wanted * lever).max(1))[:, None]
    off = (
        np.abs(np.asarray(found, float) - wanted)
        * lever
        / np.where(size > 0.0, size, 1.0)
    )
    return float((off.max(1) - beside).max())  # NaN stays


def settled(model: Any, inputs: tuple[np.ndarray, ...]) -> np.ndarray:
    """Return True for loaded contacts whose cells that press stay the same within 1e-5 of the patch's size."""
    load = inputs[2]
    moments = inputs[4]
    near = 1e-5 * np.ptp(model.patch.positions, axis=0).max()
    angles = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    moved = (
        load[:, None] * near * np.stack([np.cos(angles), np.sin(angles)], -1)[:, None]
    )
    loaded = load > 0.0
    held = [
        model.patch.weights(load[loaded], moments=each[loaded]) > 0.0
        for each in (moments, *(moments + moved))
    ]
    same = loaded.copy()
    same[loaded] = np.all([(each == held[0]).all(1) for each in held], 0)
    return same
