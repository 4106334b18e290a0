"""Models at some loads, as the solver, steps and `coupling` read them."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction.compiler.calls import address_of
from planarfriction.compiler.memory import places_of, row_of, rows_of
from planarfriction.equality import by_parts
from planarfriction.kernels.contacts import calls_of
from planarfriction.kernels.parts import FUNCTIONS, PartsContact
from planarfriction.kernels.steps import WORDS, Parts

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
    """Mask of the cells of the model that have bristles here, bool `[N]`, where states are those of cells."""
    velocity_scale: float = VELOCITY_SCALE
    """Natural scale of the body's velocity, as a share of v_s [-].

    A body that is about to slip, or has just stopped, creeps at 1e-4 to 1e-2 of v_s, and friction depends on the
    direction of its twist however slow it is. If errors were measured against v_s itself, that direction would be
    noise, and a patch that just holds could give way, or the other way round.
    """


class PackedParts:
    """A model at R loads, in P parts that share the twist and the load."""

    def __init__(self, parts: Sequence[PackedModel], shares: np.ndarray) -> None:
        self.parts = tuple(parts)
        self.shares = np.ascontiguousarray(shares)
        """Share of the load that each part carries, `[R, P]`."""
        self.addresses = np.stack([places_of(part.records) for part in parts], axis=1)
        """Addresses of the records of the parts, `[R, P]`; they live as long as this object."""

    def table(self, function: Any, square: int) -> np.ndarray:
        """Return the words of `kernels.steps.Parts`; `square` are the numbers of d new/dz of a part."""
        (loads, count), states = self.addresses.shape, self.parts[0].states
        address = address_of(function, WORDS)
        return row_of(Parts(address, count, states, square, loads, self.addresses, self.shares))

    @functools.cached_property
    def joined(self) -> PackedModel:
        """The parts as one contact, as the solver reads it."""
        one, count = self.parts[0], len(self.parts)
        if count == 1:
            return one
        calls = calls_of(one.functions, change=True)
        record = PartsContact(count, one.states, one.workspace, calls, self.addresses, self.shares)
        places = {"records": places_of(self.addresses), "shares": places_of(self.shares)}
        return one._replace(
            functions=FUNCTIONS,
            records=rows_of(record, len(self.shares), **places),
            states=count * one.states,
            workspace=count * one.workspace,
            state_scale=np.tile(one.state_scale, count),
            keepalive=(calls, self.addresses, self.shares, *self._arrays()),
        )

    def _arrays(self) -> Iterator[np.ndarray]:
        for part in self.parts:
            yield from (part.records, *part.keepalive)
