"""Which cells of a patch stick and which slip, along a motion that is known."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction.errors import InvalidValueError

if TYPE_CHECKING:
    from planarfriction.models import DistributedModel

SLIPPING = 0.5
"""A cell slips where its bristle takes up less than this share of the way that the cell goes [-]."""

AT_REST = 1e-3
"""A cell that goes less than this share of the largest deflection between two frames rests, and does not slip [-]."""


class SlipField(NamedTuple):
    """The cells of a contact at F frames."""

    bent: np.ndarray
    """Deflection of each bristle over its largest, `[F, N]` [-]."""
    slips: np.ndarray
    """Whether each cell slips, bool `[F, N]`."""


def bristles_of(model: Any) -> DistributedModel | None:
    """The distributed model of a contact's patch and law; None where they have no bristles."""
    from planarfriction.models import DistributedModel

    try:
        return DistributedModel(model.patch, model.law)
    except InvalidValueError:
        return None


def slip_field(
    bristles: DistributedModel,
    state: np.ndarray,
    times: np.ndarray,
    ways: np.ndarray,
    loads: np.ndarray,
    frames: np.ndarray,
    first: np.ndarray,
) -> SlipField:
    """The slip field of a contact at the instants `frames` (indices into `times`), from the bristles `state` `[2, N]`.

    `ways` `[T - 1, 3]` [m, m, rad] is how far the body moves on the contact from one of `times` `[T]` [s] to the next,
    in the frame of the contact, `loads` `[T]` [N], `first` `[3]` its twist at first [m/s, m/s, rad/s]. Of the way `u`
    of a cell `u - (z_1 - z_0)` is slip: what its bristle does not take up.
    """
    law, count, largest = bristles.law.numbers, len(bristles.patch.positions), bristles.law.largest_deflection
    levers, lean = bristles.patch.levers(), bristles.patch.asymmetries().T
    bent, slips = np.zeros((len(frames), count)), np.zeros((len(frames), count), dtype=bool)
    way, slip, frame = np.zeros(count), np.zeros(count), 1
    bent[0] = _bent(state, levers @ first, lean, law)
    for k, (step, dt) in enumerate(zip(ways, np.diff(times), strict=True)):
        if not dt > 0.0:
            continue
        before = state
        state, _ = bristles.step(state, step / dt, max(0.5 * (loads[k] + loads[k + 1]), 0.0), dt)
        moved = (levers @ step).T
        length = np.hypot(*moved)
        way += length
        slip += np.hypot(*(moved - (state - before)))
        if frame < len(frames) and k + 1 == frames[frame]:
            bent[frame] = _bent(state, moved.T / dt, lean, law)
            slips[frame] = (slip > SLIPPING * way) & (way > AT_REST * largest)
            way[:], slip[:], frame = 0.0, 0.0, frame + 1
    if len(frames) > 1:  # what moves at first has no way behind it, and does as right after it
        span = times[frames[1]] - times[frames[0]]
        slips[0] = slips[1] & (np.hypot(*(levers @ first).T) * span > AT_REST * largest)
    return SlipField(bent, slips)


def _bent(state: np.ndarray, velocity: np.ndarray, lean: np.ndarray, law: Any) -> np.ndarray:
    """Deflections `[2, N]` over the largest at the velocities `[N, 2]` of the cells, `[N]`."""
    steady = formulas.stribeck(np, np.hypot(*velocity.T), law) / law.sigma_0
    return np.hypot(*(state - lean * steady)) / steady
