"""Models at some loads, as the solver, steps and `coupling` read them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction.compiler.calls import address_of
from planarfriction.compiler.memory import place_of, row_of
from planarfriction.equality import by_parts
from planarfriction.kernels.steps import Stepped

MAX_PACK_BYTES = 64e6
"""Bytes of shapes that a model packs at a time, if that is more than one shape."""

MAX_PACK_SECONDS = 0.25
"""Time [s] for which a model builds the shapes that it packs at a time, if that is more than one shape."""

VELOCITY_SCALE = 0.1
"""Natural scale of the velocity of a body on a patch, as a share of v_s [-] (see `PackedModel`)."""


@by_parts
class PackedModel(NamedTuple):
    """A model at R loads, in the form that the compiled solver reads."""

    functions: Any
    """Compiled `kernels.contacts.ModelFunctions` of the model."""
    records: np.ndarray
    """Data of the contact for these functions, a row of words for each load, `[R, words]` (`compiler.memory`)."""
    states: int
    """Number of bristle states of a contact."""
    workspace: int
    """Number of values that a linearisation needs."""
    state_scale: np.ndarray
    """Natural scale of each state, `[states]`: its value at full deflection."""
    radius: float
    """Lever arm [m] that turns the spin of the patch into a speed."""
    keepalive: tuple[np.ndarray, ...]
    """Arrays whose addresses are in the records; the caller of the functions must keep them alive."""
    cells: np.ndarray | None = None
    """Mask of the cells of the model that have bristles here, bool `[N]`, where states belong to cells."""
    velocity_scale: float = VELOCITY_SCALE
    """Natural scale of the body's velocity, as a share of v_s [-].

    A body that is about to slip, or has just stopped, creeps at 1e-4 to 1e-2 of v_s, and friction depends on the
    direction of its twist however slow it is. If errors were measured against v_s itself, that direction would be
    noise, and a patch that just holds could give way, or the other way round.
    """

    reference: float = 0.0
    """Reference load [N] of a law whose stiffness does not grow with the load; 0 of others."""
    bristle: int = 2
    """Components of a bristle, for such a law."""

    def table(self, function: Any, square: int) -> np.ndarray:
        """Return the words of `kernels.steps.Stepped`, which hold as long as the records; `square` as there."""
        loads, words = self.records.shape
        address = address_of(function)
        fields = address, self.states, square, loads, place_of(self.records), words
        return row_of(Stepped(*fields, self.reference, self.bristle))
