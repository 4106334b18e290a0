"""Which cells of a patch stick and which slip, along a motion that is known."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction.errors import InvalidValueError
from planarfriction.laws import FrictionLaw

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


def slip_field(
    model: Any, times: np.ndarray, ways: np.ndarray, loads: np.ndarray, frames: np.ndarray
) -> SlipField | None:
    """The slip field of a contact's patch under its law, at the instants `frames` (indices into `times`), or None.

    `ways` `[T - 1, 3]` [m, m, rad] is how far the body moves on the contact from one of `times` `[T]` [s] to the next,
    in the frame of the contact, `loads` `[T]` [N]. The bristles are those of `DistributedModel`, from rest, whatever
    the model of the contact: so the field of a reduced model is that of the patch on its path. Of the way `u` of a cell
    `u - (z_1 - z_0)` is slip. None where the model's law or patch has no distributed bristles.
    """
    from planarfriction.models import DistributedModel

    if not isinstance(model.law, FrictionLaw):
        return None
    try:
        bristles = DistributedModel(model.patch, model.law)
    except InvalidValueError:
        return None
    law, state, count = model.law.numbers, bristles.rest(), len(bristles.patch.positions)
    levers, lean = bristles.patch.levers(), bristles.patch.asymmetries().T
    bent, slips = np.zeros((len(frames), count)), np.zeros((len(frames), count), dtype=bool)
    way, slip, frame = np.zeros(count), np.zeros(count), 1
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
            steady = formulas.stribeck(np, length / dt, law) / law.sigma_0
            bent[frame] = np.hypot(*(state - lean * steady)) / steady
            slips[frame] = (slip > SLIPPING * way) & (way > AT_REST * model.law.largest_deflection)
            way[:], slip[:], frame = 0.0, 0.0, frame + 1
    if len(frames) > 1:  # what goes on before the first frame is not known: as after it
        bent[0], slips[0] = np.where(slips[1], bent[1], 0.0), slips[1]
    return SlipField(bent, slips)
