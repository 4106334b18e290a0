"""One part that a gripper holds, as it is recorded for a picture or a film."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction._support.validation import count
from planarfriction.online.controllers import Hold
from planarfriction.online.observer import FrictionObserver
from planarfriction_studies.rig.gripper import Gripper, Parts
from planarfriction_studies.rig.trials import known_model

EVERY = 10
"""Steps between the rows of a record."""


class GripRecord(NamedTuple):
    """Rows of a part that is held, T of them."""

    parts: Parts
    """The part and its fingers."""
    time: np.ndarray
    """Time `[T]` [s]."""
    slip: np.ndarray
    """Displacement of the part over the finger since the beginning `[T, 3]` [m, m, rad]."""
    centre: np.ndarray
    """Centre of mass in the hand `[T, 2]` [m]."""
    tilt: np.ndarray
    """Tilt of the hand `[T]` [rad]."""
    grip: np.ndarray
    """Grip force `[T]` [N]."""
    radius: np.ndarray
    """Radius of the contact `[T]` [m]."""
    mu_c: np.ndarray
    """Estimate of the Coulomb coefficient, and the ends of its 95 % interval `[T, 3]` [-]."""
    slips: np.ndarray
    """Probability of slip `[T]`."""


def record_hold(seed: int = 0, steps: int = 4000) -> GripRecord:
    """Hold a part of unknown friction for so many steps of 1 ms: a first slip, a tap after 2 s, a tilt after 2.5 s.

    Raises InvalidValueError for a seed or a number of steps that is not a whole number, or steps below 1.
    """
    tap = {"tap": (0.4, 0.5, 0.0), "tap_time": 2.0}
    tilt = {"tilt": -0.6, "tilt_time": 2.5, "tilt_duration": 1.0}
    parts = Parts(
        [0.25],
        [3.5e-4],
        [(0.012, -0.012)],
        [0.75],
        delay=0.02,
        bias=(0.03, -0.02, 2e-4),
        **tap,
        **tilt,
    )
    gripper = Gripper(parts, 15.0, seed=count("seed", seed, 0))
    observer = FrictionObserver(known_model(), batch=1)
    for sample in gripper.empty_hand():
        observer.update(sample)
    hold = Hold(observer)
    sample = gripper.measurement
    rows = []
    for step in range(count("steps", steps, 1)):
        sample = gripper.step(hold.update(sample))
        if step % EVERY == 0:
            e = hold.estimate
            shown = parts.tilt * np.clip(
                (gripper.time - parts.tilt_time) / parts.tilt_duration, 0, 1
            )
            mu = np.concatenate([e.mu_c[:, None], e.interval()[:, 0]], axis=1)
            found = (
                gripper.slip,
                gripper.centre,
                shown,
                gripper.normal_force,
                gripper.radius,
                mu,
                e.slip,
            )
            rows.append((gripper.time, *(each[0].copy() for each in found)))
    return GripRecord(parts, *(np.array(each) for each in zip(*rows, strict=True)))
