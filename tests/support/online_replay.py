"""Measured pushes and slides as streams for an observer: friction as it is found on the way, and by a whole-log fit."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

import planarfriction as pf
from planarfriction.online import FrictionObserver, Measurement, Sensors
from planarfriction_studies.measured import push_series, slides
from planarfriction_studies.measured.tables import read_table

GRAVITY = 9.81
"""Gravity [m/s^2]."""

GUESS = 0.4
"""Friction coefficient from which an observer begins [-]."""

FORCE_NOISE, SPEED_ERROR, NO_BIAS = 0.02, 1e-3, (1e-3, 1e-3, 1e-4)
"""Noise of a measured friction force [N], error of a velocity [m/s], bias of a wrench [N, N, N m]."""

MODEL_ERROR = 0.2
"""Relative error of a wrench of the limit surface [-]: friction of measured supports differs by as much."""

MU_SPREAD, RADIUS_SPREAD, RATIO_SPREAD = 0.5, 0.05, 0.5
"""Spreads of the logs of mu_c, of the radius, and of mu_s/mu_c: peaks at the beginning of a slip are lost [-]."""

LEAST_ROWS = 10
"""Rows of a slide that is replayed."""


class Stream(NamedTuple):
    """A log of T rows as samples for an observer."""

    name: str
    """Name of the push or the slide."""
    time: np.ndarray
    """Time `[T]` [s]."""
    wrench: np.ndarray
    """Friction wrench on the object, its own axes, `[T, 3]` [N, N, N m]."""
    twist: np.ndarray
    """Velocity of the object, its own axes, `[T, 3]` [m/s, m/s, rad/s]."""
    sliding: np.ndarray
    """True where it slides `[T]`."""
    load: float
    """Normal force [N]."""
    patch: pf.ContactPatch
    """The contact."""


def push_streams(folder: Path | None = None) -> Iterator[Stream]:
    """Yield the pushes of `mlab_pushes`: friction is minus the wrench of the finger, as the object hardly speeds up."""
    motion = ["vx_mps", "vy_mps", "wz_radps"]
    force = ["fx_N", "fy_N", "tau_Nm"]
    table = read_table(
        "series",
        ["push_id", "t_s", "yaw_rad", *motion, *force, "sliding"],
        ["run"],
        folder=folder,
    )
    patch = push_series.feet()
    for (run, number), rows in table[
        ~table["run"].isin(push_series.OTHER_FEET)
    ].groupby(["run", "push_id"], sort=False):
        yaw = rows["yaw_rad"].to_numpy()
        time = rows["t_s"].to_numpy()
        twist, wrench = (
            push_series.to_object(rows[names].to_numpy(), yaw)
            for names in (motion, force)
        )
        sliding = rows["sliding"].to_numpy() > 0
        if sliding.any():
            yield Stream(
                f"push {number:g} of {run}",
                time,
                -wrench,
                twist,
                sliding,
                push_series.WEIGHT,
                patch,
            )


def slide_streams(folder: Path | None = None) -> Iterator[Stream]:
    """Yield the slides of `contactnets`, one of each toss: friction is mass times acceleration, from the motion."""
    motion = ["vx_mps", "vy_mps", "wz_radps"]
    columns = ["toss", "unique_id", "t_s", "yaw_rad", *motion, "sliding"]
    table = read_table("slides", columns, folder=folder)
    for number, rows in table.drop_duplicates(["unique_id", "t_s"]).groupby(
        "unique_id"
    ):
        time = rows["t_s"].to_numpy()
        sliding = rows["sliding"].to_numpy() > 0
        if sliding.sum() < LEAST_ROWS:
            continue
        world = rows[motion].to_numpy()
        wrench = np.gradient(world, time, axis=0) * (
            slides.MASS,
            slides.MASS,
            slides.INERTIA,
        )
        twist, wrench = (
            push_series.to_object(each, rows["yaw_rad"].to_numpy())
            for each in (world, wrench)
        )
        yield Stream(
            f"slide {number:g}",
            time,
            wrench,
            twist,
            sliding,
            slides.MASS * GRAVITY,
            slides.face(),
        )


def replay(stream: Stream) -> tuple[np.ndarray, np.ndarray, float]:
    """Return mu_c `[T]` and its 95 % interval `[T, 2]` as an observer finds them, and mu_c of a fit to the whole log.

    The fit is that of least squares of the sliding rows, `W = mu f_N h(V)`.
    """
    patch = stream.patch
    (length, _) = stream.twist.shape
    surface = pf.LimitSurfaceTable(patch)
    model = pf.ReducedModel(patch, pf.LuGre(mu_c=GUESS, mu_s=GUESS, sigma_2=0.0))
    sensors = Sensors(force_noise=FORCE_NOISE, torque_noise=FORCE_NOISE * surface.contact_radius, quantum=SPEED_ERROR,
                      slip_rate=1.0 / float(np.median(np.diff(stream.time))), base=surface.contact_radius)  # fmt: skip
    observer = FrictionObserver(model, surface=surface, normal_force=stream.load, sensors=sensors, bias=NO_BIAS,
                                radius_spread=RADIUS_SPREAD, mu_spread=MU_SPREAD, ratio_spread=RATIO_SPREAD,
                                model_error=MODEL_ERROR)  # fmt: skip
    mu = np.empty(length)
    interval = np.empty((length, 2))
    for k in range(length):
        twist = stream.twist[k] * stream.sliding[k]
        found = observer.update(
            Measurement(stream.time[k], stream.wrench[k], stream.load, twist)
        )
        mu[k], interval[k] = found.mu_c, found.interval()[0]
    scale = np.array([1.0, 1.0, 1.0 / surface.contact_radius])
    unit = stream.load * surface.wrench(stream.twist[stream.sliding]) * scale
    return (
        mu,
        interval,
        float((unit * stream.wrench[stream.sliding] * scale).sum() / (unit**2).sum()),
    )
