"""Contacts whose pressure follows the load of their body."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planarfriction.compiled.following import STATES, following
from planarfriction.compiled.packed import PackedModel
from planarfriction.scenes.scene import Contact

__all__ = ["STATES", "centres_of_pressure", "packed_contact"]

ROOM = 1_000_000
"""Numbers of weights that are in memory at a time."""


def packed_contact(
    contact: Contact, loads: Sequence[float | None] | np.ndarray, between: tuple[float, float] | None = None
) -> PackedModel:
    """Pack the model of a contact (see `FrictionModel.packed`), with a pressure that follows the load if it does."""
    packed = contact.model.packed(loads, between)
    if contact.pressure == "fixed":
        return packed
    return following(contact.model.compiled, packed, contact.centre_of_mass, contact.height)


def centres_of_pressure(contact: Contact, beside: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Return the centres of pressure `[M, 2]` [m] that were asked for `beside` the centre of mass `[M, 2]`, by loads.

    They lie within the patch; without load, in its middle.
    """
    patch, (x, y) = contact.model.reduction.patch, np.transpose(contact.centre_of_mass + beside)
    moments = load[:, None] * np.stack([y, -x], axis=1)
    found, most = np.empty((len(load), 2)), max(1, ROOM // patch.cells)
    for first in range(0, len(load), most):
        some = slice(first, first + most)
        found[some] = patch.weights(load[some], moments[some]) @ patch.positions
    return found
