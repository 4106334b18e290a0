"""Contacts in parts at some loads, as compiled code reads them."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from planarfriction.compiled.packed import PackedModel
from planarfriction.compiler.calls import address_of
from planarfriction.compiler.memory import place_of, places_of, row_of, rows_of
from planarfriction.equality import by_parts
from planarfriction.kernels.contacts import calls_of
from planarfriction.kernels.parts import FUNCTIONS, PartsContact
from planarfriction.kernels.quick_steps import JACOBIAN, jacobians_address
from planarfriction.kernels.rollouts import PartAddresses


@by_parts
class Part(NamedTuple):
    """A part of a contact at one load."""

    share: float
    """Share of the load that the part carries [-]."""
    shape: Any
    """Shape of its patch, in the form of its model (`ReducedShape` or `PublishedShape`)."""


class Frame(NamedTuple):
    """Axes in which the compiled step of a contact works: `V' = T V` goes in, `W = T' W'` comes out."""

    lever: np.ndarray
    """T `[3, 3]`."""
    spins: bool
    """False for a point: its third state takes no part and keeps its value."""


class Kind(NamedTuple):
    """Compiled functions and records of a kind of model of three states."""

    steps: ModuleType
    """Module of its steps, such as `kernels.reduced_step`."""
    step_function: Any
    """Function of `kernels.step_slopes`."""
    jacobian_function: Any
    """Function `..._jacobian` of `kernels.step_slopes`."""
    records: Callable[[Any, Sequence[Any], float], PackedModel]
    """Pack one part: a law, its shapes at R loads and the lever arm [m]."""
    surface: Callable[[Any], tuple[np.ndarray, np.ndarray]]
    """Three integers of the limit surface or the maps of a shape, and their flat numbers."""
    framed: Callable[[Any], tuple[Any, Frame | None]] = lambda shape: (shape, None)
    """Shape that steps instead of another one, and the frame that leads there; None for the contact's own."""

    def row(self, law: Any, shape: Any) -> np.ndarray:
        """Return the numbers of law and shape."""
        return np.array([*law.numbers, *shape.numbers])


class ContactAtLoad:
    """A contact with the shapes of its parts at one load."""

    def __init__(self, kind: Kind, law: Any, parts: Sequence[Part]) -> None:
        self._kind, self._law, self.parts = kind, law, tuple(parts)
        framed = [kind.framed(part.shape) for part in parts]
        self._shapes, self.frame = [shape for shape, _ in framed], framed[0][1]

    @functools.cached_property
    def packed(self) -> PackedModel:
        """The contact as the solver reads it, with one record."""
        return packed_parts(self._kind, self._law, [self.parts], 0.0)

    @functools.cached_property
    def _rows(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Numbers of law, shape and surface of each part, and the numbers of the surface: the places point to them."""
        surfaces = [self._kind.surface(shape) for shape in self._shapes]
        rows = [self._kind.row(self._law, shape) for shape in self._shapes]
        return [
            (np.array([*row, *surface]), np.ascontiguousarray(data))
            for row, (surface, data) in zip(rows, surfaces, strict=True)
        ]

    @functools.cached_property
    def places(self) -> np.ndarray:
        """Places of the parts (`kernels.rollouts.PartAddresses`) for steps, flat."""
        step = self._kind.steps.step_address()
        both = zip(self.parts, self._rows, strict=True)
        places = [PartAddresses(step, place_of(row), place_of(data), part.share) for part, (row, data) in both]
        return np.concatenate([row_of(place) for place in places])

    @functools.cached_property
    def jacobian_places(self) -> np.ndarray:
        """Places of the parts for derivatives of steps, flat, behind the address of the function that reads them."""
        calls = np.array([jacobians_address()], np.int64).view(float)
        function = address_of(self._kind.jacobian_function, JACOBIAN)
        both = zip(self.parts, self._records, strict=True)
        places = [PartAddresses(function, place_of(record.records), 0, part.share) for part, record in both]
        return np.concatenate([calls, *(row_of(place) for place in places)])

    @functools.cached_property
    def _records(self) -> list[PackedModel]:
        """Records of the parts, to which the places of derivatives point."""
        return [self._kind.records(self._law, [shape], 0.0) for shape in self._shapes]


def packed_parts(kind: Kind, law: Any, loaded: Sequence[Sequence[Part]], radius: float) -> PackedModel:
    """Pack a contact for the solver from its parts at R loads; `radius` is its lever arm [m]."""
    each = [kind.records(law, [part.shape for part in same], radius) for same in zip(*loaded, strict=True)]
    if len(each) == 1:
        return each[0]
    return _joined(each, np.array([[part.share for part in parts] for parts in loaded]))


def _joined(parts: Sequence[PackedModel], shares: np.ndarray) -> PackedModel:
    """Join P packed parts at the same R loads, with their shares `[R, P]`, to one contact."""
    one, count = parts[0], len(parts)
    calls = calls_of(one.functions, change=True)
    records = np.stack([places_of(part.records) for part in parts], axis=1)
    shares = np.ascontiguousarray(shares)
    record = PartsContact(count, one.states, one.workspace, calls, records, shares)
    return one._replace(
        functions=FUNCTIONS,
        records=rows_of(record, len(shares), records=places_of(records), shares=places_of(shares)),
        states=count * one.states,
        workspace=count * one.workspace,
        state_scale=np.tile(one.state_scale, count),
        keepalive=(calls, records, shares, *(array for part in parts for array in (part.records, *part.keepalive))),
    )
