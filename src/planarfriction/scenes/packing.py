"""Scenes as flat arrays of the compiled solver, batch after batch of the motion's segments."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence

import numpy as np

from planarfriction._engine.body.body import Motion, System
from planarfriction._engine.body.contacts import BODY, BODY_AXES, WORLD, Contacts
from planarfriction._engine.compiler.calls import signature_of
from planarfriction._engine.compiler.memory import places_of
from planarfriction._engine.protocol import ARGUMENTS, ModelFunctions, calls_of
from planarfriction._engine.records.packed import PackedModel
from planarfriction._engine.records.partial_contact import STATES, following, under_edge
from planarfriction.errors import InvalidValueError
from planarfriction.models.base import refuse_pad
from planarfriction.scenes.contact import Contact
from planarfriction.scenes.signal import SAME_TIME, Signal, breaks_between, displacement
from planarfriction.scenes.start import first_slopes, first_states

ROOM = 1_000_000
"""Numbers of weights that are in memory at a time."""

SHAPE_INTERVAL = 1e-3
"""Longest time [s] that a patch keeps its shape while the load it depends on changes; held loads need no limit."""

BATCH = 4096
"""Segments that are packed at a time; fewer where their shapes take more than `records.packed.MAX_PACK_BYTES`."""

MOST_PIECES = 10**12
"""Segments of a motion, each of which the solver has to stop at."""


def _check(functions: ModelFunctions) -> None:
    """Raise InvalidValueError for functions of a model with other arguments than those with which they are called."""
    for name, each, count in zip(functions._fields, functions, ARGUMENTS, strict=True):
        if each and len(signature_of(each)) != count:
            rule = f"take {count} arguments (see ModelFunctions)"
            raise InvalidValueError(name, rule, len(signature_of(each)))


def packed_contact(
    contact: Contact,
    loads: Sequence[float | None] | np.ndarray,
    between: tuple[float, float] | None = None,
    outline: np.ndarray | None = None,
) -> PackedModel:
    """Pack the model of a contact (see `FrictionModel.packed`), with a pressure that follows the load if it does.

    `outline` is that of the body, for contacts with an edge.
    """
    packed = contact.model.packed(loads, between)
    if contact.edge:
        refuse_pad(contact.model, "an edge")
        return under_edge(contact.model.compiled, packed, outline)  # pyright: ignore[reportArgumentType]
    if contact.pressure == "fixed":
        return packed
    refuse_pad(contact.model, "a pressure that follows the load")
    return following(
        contact.model.compiled, packed, contact.centre_of_mass, contact.height
    )


def centres_of_pressure(
    contact: Contact, beside: np.ndarray, load: np.ndarray
) -> np.ndarray:
    """Return the centres of pressure `[M, 2]` [m] that were asked for `beside` the centre of mass `[M, 2]`, by loads.

    They lie within the patch; without load, in its middle.
    """
    patch = contact.model.reduction.patch
    (x, y) = np.transpose(contact.centre_of_mass + beside)
    moments = load[:, None] * np.stack([y, -x], axis=1)
    found = np.empty((len(load), 2))
    most = max(1, ROOM // patch.cells)
    for first in range(0, len(load), most):
        some = slice(first, first + most)
        found[some] = patch.weights(load[some], moments[some]) @ patch.positions
    return found


class Segments:
    """The inputs of a scene from 0 to `t_end` [s], linear on each piece between two breaks.

    Breaks are those of the signals; where the load of a patch whose shape follows it changes continuously, pieces are
    no longer than `SHAPE_INTERVAL`. Pieces go by their number, so that there may be more of them than memory holds.
    """

    def __init__(self, scene, t_end: float, marks=()) -> None:
        own = scene.breaks(t_end)
        self._breaks = breaks_between(np.concatenate([own[1:-1], marks]), t_end)
        """Breaks of the signals and `marks` [s], [S + 1]."""
        self._load = [
            contact.normal_force.pieces(self._breaks) for contact in scene.contacts
        ]
        self._force = scene.force and scene.force.pieces(self._breaks)
        self._velocity = scene.velocity and scene.velocity.pieces(self._breaks)
        movers = [contact.support_velocity for contact in scene.contacts]
        moves = any(each is not None for each in movers)
        self._mover = np.empty((0, len(movers), 9))
        if moves:
            each = [_mover(velocity, self._breaks) for velocity in movers]
            self._mover = np.stack(each, axis=1)
        self._anchors = [spring.anchor.pieces(self._breaks) for spring in scene.springs]
        lengths = np.diff(self._breaks)
        parts = np.ones(len(self._breaks) - 1)
        for contact, (_, slope) in zip(scene.contacts, self._load, strict=True):
            if contact.model.patch.depends_on_load:
                fine = np.ceil(lengths / SHAPE_INTERVAL - 1e-9)
                parts = np.where(slope != 0.0, np.maximum(fine, parts), parts)
        if parts.sum() > MOST_PIECES:
            rule = f"be at most {MOST_PIECES * SHAPE_INTERVAL:g} s if the shape of a patch changes with the load"
            raise InvalidValueError("t_end", rule, t_end)
        self._first = np.concatenate([[0], np.cumsum(parts)]).astype(np.int64)
        """Number of the first piece behind each break, [S + 1]."""
        self._step = lengths / parts
        self.count = int(self._first[-1])
        """Number of pieces."""
        moving = self._force is not None and (self._force[1][-1] != 0.0).any()
        moving |= moves and (self._mover[-1, :, 3:] != 0.0).any()
        moving |= any(velocity[-1].any() for _, velocity in self._anchors)
        changing = moving or any(slope[-1] != 0.0 for _, slope in self._load)
        self.settled = float(own[-1 if changing else -2])
        """Time of the last change of an input [s]."""

    def breaks(self, pieces: np.ndarray) -> np.ndarray:
        """Return the times [s] at which pieces begin; that of number `count` is the end."""
        here = self._behind(pieces)
        begin = (pieces - self._first[here]) * self._step[here] + self._breaks[here]
        return np.where(pieces == self.count, self._breaks[-1], begin)

    def load(self, c: int, pieces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the normal force of contact c at the start of pieces, and its slope."""
        return self._linear(self._load[c], pieces)

    def held(self, c: int, pieces: np.ndarray) -> np.ndarray:
        """Return the load in the middle of pieces [N], whose shape contact c has on them."""
        load, slope = self.load(c, pieces)
        return load + slope * (0.5 * (self.breaks(pieces + 1) - self.breaks(pieces)))

    def between(self, c: int) -> tuple[float, float]:
        """Return the lowest load > 0 and the highest whose shape contact c takes [N]; both 1 if it never has a load."""
        held = self.held(c, np.concatenate([self._first[:-1], self._first[1:] - 1]))
        held = held[held > 0.0]
        return (float(held.min()), float(held.max())) if len(held) else (1.0, 1.0)

    def largest(self, c: int) -> float:
        """Return the largest load of contact c [N]."""
        load, slope = self._load[c]
        return float(np.maximum(load, load + slope * np.diff(self._breaks)).max())

    def force(self, pieces: np.ndarray) -> np.ndarray:
        """Return the applied wrench at the start of pieces, and its slope, [S, 2, 3]."""
        if self._force is None:
            return np.zeros((len(pieces), 2, 3))
        return np.stack(self._linear(self._force, pieces), axis=1)

    def velocity(self, pieces: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the prescribed velocity at the start of pieces, and its slope, [S, 3] each; or None."""
        return None if self._velocity is None else self._linear(self._velocity, pieces)

    def mover(self, pieces: np.ndarray) -> np.ndarray:
        """Return displacement, velocity and acceleration of each contact's support as pieces begin, [S, C, 9].

        Empty [0, C, 9] where all stand still.
        """
        if not self._mover.any():
            return self._mover[:0]
        here = self._behind(pieces)
        since = (self.breaks(pieces) - self._breaks[here])[:, None, None]
        found = self._mover[here]
        by = found[..., :3]
        velocity = found[..., 3:6]
        slope = found[..., 6:]
        by = by + since * (velocity + 0.5 * since * slope)
        return np.concatenate([by, velocity + since * slope, slope], axis=-1)

    def anchors(self, pieces: np.ndarray) -> np.ndarray:
        """Return pose and velocity of the anchor of each spring as pieces begin, [S, K, 6]."""
        found = np.empty((len(pieces), len(self._anchors), 6))
        for k, anchor in enumerate(self._anchors):
            found[:, k] = np.hstack(self._linear(anchor, pieces))
        return found

    def _behind(self, pieces: np.ndarray) -> np.ndarray:
        """Return the break of the signals that pieces lie behind."""
        return np.minimum(
            np.searchsorted(self._first, pieces, side="right") - 1, len(self._step) - 1
        )

    def _linear(
        self, signal: tuple[np.ndarray, np.ndarray], pieces: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        here = self._behind(pieces)
        start = signal[0][here]
        slope = signal[1][here]
        since = self.breaks(pieces) - self._breaks[here]
        return start + slope * (since[:, None] if slope.ndim == 2 else since), slope


class SegmentBatches:
    """The motion of a scene from 0 to `t_end` [s] in consecutive batches, to be gone through once.

    A batch holds `most` pieces (default: `BATCH`), or as many as its shapes have room for. Where it ends leaves no
    trace in the results. `times` to record become breaks where they equal one up to rounding, so that they record the
    left limit. With `sensitivities` batches hold what derivatives need too, and the solver stops at `marks` [s].
    """

    def __init__(
        self,
        scene,
        t_end: float,
        *,
        times=None,
        sensitivities=False,
        marks=(),
        most: int | None = None,
    ) -> None:
        self._scene = scene
        self._times = times
        self._most = BATCH if most is None else most
        self._ahead = self._most
        self._pieces = Segments(scene, t_end, marks)
        self._done = 0
        contacts = scene.contacts
        self._between = [
            self._pieces.between(c) if contact.model.patch.depends_on_load else None
            for c, contact in enumerate(contacts)
        ]
        self.models: list[PackedModel] = []
        """The model of each contact, as packed last."""
        records, row, pieces = self._pack()
        begin = time.perf_counter()
        for each in self.models:
            _check(each.functions)
        calls = [calls_of(each.functions, change=sensitivities) for each in self.models]
        self.loading = time.perf_counter() - begin
        """Time to compile the models' functions and the solver's, or to load them from the cache [s]."""
        mounts = [WORLD if each.mounted_on == "world" else BODY for each in contacts]
        if scene.velocity is not None:
            mounts = [BODY_AXES] * len(mounts)
        self._contacts = Contacts(
            calls=np.array(calls),
            record=records,
            mount=np.array(mounts),
            place=np.array(
                [[*c.position, np.cos(c.angle), np.sin(c.angle)] for c in contacts],
                dtype=float,
            ),
            count=np.array([contact.count for contact in contacts], dtype=float),
            state=_starts([model.states for model in self.models]),
            linear=_starts([model.workspace for model in self.models]),
            stiff=np.array([model.stiff for model in self.models]),
            bristle=np.array(
                [each.model.reduction.patch.bristles for each in contacts]
            ),
        )
        laws = [contact.model.law for contact in contacts]
        peaks = [self._pieces.largest(c) for c in range(len(contacts))]
        bends = [
            peak / model.stiff if peak > 0.0 and model.stiff > 0.0 else 1.0
            for model, peak in zip(self.models, peaks, strict=True)
        ]
        # Deflections at the largest loads, as multiples of those that the laws name: 1 but for pads.
        bent = list(zip(bends, self.models, laws, strict=True))
        self._length = min(bend * law.largest_deflection for bend, _, law in bent)
        self._stop_time = max(
            bend * law.numbers.sigma_1 / law.numbers.sigma_0 for bend, _, law in bent
        )
        speed = min(model.velocity_scale * law.numbers.v_s for _, model, law in bent)
        # a single point has no lever arm: its spin is measured in rad/s
        self._radius = max(model.radius for model in self.models) or 1.0
        arm = np.array([1.0, 1.0, 1.0 / self._radius])
        body = scene.body
        self.state = np.concatenate(
            [self._first(), body.velocity, body.position, [body.angle]]
        )
        """Bristles as the scene starts, body velocity, pose."""
        self.state_scale = np.concatenate(
            [
                *(bend * model.state_scale for bend, model, _ in bent),
                speed * arm,
                self._length * arm,
            ]
        )
        """Nominal value of each state: mu_c/sigma_0 for deflections and positions, a share of v_s for velocities (that
        of a creep, `records.PackedModel.velocity_scale`), angles over r.

        The least of all contacts. Velocities are not measured against v_s itself: below it friction hardly changes with
        speed, but it does with direction.
        """
        self.bristles = self._contacts.state
        """First index of the bristles of each contact in the state, int [C + 1]."""
        self.cells = [model.cells for model in self.models]
        """Mask of the cells of each contact that have bristles, or None."""
        self._ready: System | None = self._system(row, pieces)

    def _first(self) -> np.ndarray:
        """Return the bristles with which the scene starts, those that the solver has."""
        if self._scene.start == "rest":
            return np.zeros(self._contacts.state[-1])
        states = first_states(self._scene, self._shaped)
        return self._flat([state[None] for state in states])[0]

    def first_slopes(self, d_loads: np.ndarray, d_pull: np.ndarray) -> np.ndarray:
        """Return changes `[K, n]` of the bristles of an equilibrium (see `start.first_slopes`)."""
        return self._flat(first_slopes(self._scene, self._shaped, d_loads, d_pull))

    @property
    def _shaped(self) -> np.ndarray:
        """Loads whose shapes the contacts have at first [N]."""
        first = np.zeros(1, np.int64)
        return np.concatenate(
            [self._pieces.held(c, first) for c in range(len(self.models))]
        )

    def _flat(self, states: list[np.ndarray]) -> np.ndarray:
        """Return states `[K, *state_shape]` of the contacts as the solver has them, `[K, n]`."""
        parts = []
        every = zip(states, self.models, self._contacts.bristle, strict=True)
        for state, model, each in every:
            flat = state.reshape(len(state), -1)
            if model.cells is not None:
                shape = len(state), each, len(model.cells)
                z, face = np.split(flat, [each * len(model.cells)], axis=1)
                z = z.reshape(shape)[..., model.cells]
                flat = np.hstack([z.reshape(len(state), -1), face])
            # Behind the bristles, the place of a pressure that follows the load.
            parts.append(np.pad(flat, ((0, 0), (0, model.states - flat.shape[1]))))
        return np.hstack(parts)

    def __iter__(self) -> Iterator[System]:
        while self._ready is not None or self._done < self._pieces.count:
            yield self._taken()

    def _taken(self) -> System:
        """Return the next batch, which nobody but the caller holds."""
        ready = self._ready
        self._ready = None
        if ready is None:
            records, row, pieces = self._pack()
            self._contacts = self._contacts._replace(record=records)
            ready = self._system(row, pieces)
        return ready

    def _pack(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Pack the next pieces: addresses of records, which of them each contact has on each piece, the pieces."""
        pieces = np.arange(
            self._done, min(self._done + self._ahead, self._pieces.count)
        )
        # Models that follow the load are packed anew, and not kept meanwhile.
        old = [
            None if between else model
            for model, between in zip(self.models, self._between, strict=False)
        ]
        rows = []
        count = len(pieces)
        self.models = []
        outline = self._scene.body.outline
        for c, contact in enumerate(self._scene.contacts):
            between = self._between[c]
            if between is None:
                model = old[c] if old else None
                self.models.append(
                    model or packed_contact(contact, [None], None, outline)
                )
                rows.append(np.zeros(len(pieces), np.int64))
                continue
            held = self._pieces.held(c, pieces[:count])
            # Any, where there is no load.
            loads, row = _in_order(np.where(held > 0.0, held, between[0]))
            between = between if self._most < MOST_PIECES else None
            self.models.append(packed_contact(contact, loads, between, outline))
            rows.append(row)
            packed = len(self.models[c].records)
            count = count if packed == len(loads) else int(np.argmax(row == packed))
        first = _starts([len(model.records) for model in self.models])
        self._done += count
        # One contact does not pack much more than another has room for.
        self._ahead = min(self._most, 2 * count)
        addresses = [places_of(model.records) for model in self.models]
        row = np.stack([row[:count] for row in rows], axis=1) + first[:-1]
        return np.concatenate(addresses), row, pieces[:count]

    def _system(self, row: np.ndarray, pieces: np.ndarray) -> System:
        scene = self._scene
        inputs = self._pieces
        models = self.models
        breaks = inputs.breaks(np.append(pieces, pieces[-1] + 1))
        load = np.array([inputs.load(c, pieces) for c in range(len(models))])
        driven = inputs.velocity(pieces)
        body = scene.body
        if driven is None:
            driven = np.empty((0, 3)), np.full((len(pieces), 3), [*body.gravity, 0.0])
        free = scene.velocity is None
        inertias = np.array([body.mass, body.mass, body.inertia])
        motion = Motion(
            inverse_mass=1.0 / inertias if free else np.zeros(3),
            body_axes=not free,
            breaks=breaks,
            load=load.transpose(2, 1, 0).copy(),
            force=inputs.force(pieces),
            velocity=driven[0],
            acceleration=driven[1],
            row=row,
            mover=inputs.mover(pieces),
            spring=np.array([spring.numbers for spring in scene.springs]).reshape(
                -1, 6
            ),
            anchor=inputs.anchors(pieces),
            stop_speed=float(scene.stop_speed or 0.0),
            stop_radius=self._radius,
            stop_time=self._stop_time,
            stop_length=self._length,
            settled=inputs.settled,
        )
        if self._times is not None:
            _meet(self._times, breaks)
        kept = tuple(
            array for model in models for array in (model.records, *model.keepalive)
        )
        follow = [contact.pressure == "follows" for contact in scene.contacts]
        pressures = STATES * sum(follow)
        return System(self._contacts, motion, kept, pressures)


def _in_order(loads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the different loads in the order of their first appearance, and the index of each load among them."""
    different, first, which = np.unique(loads, return_index=True, return_inverse=True)
    order = np.argsort(first)
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    return different[order], place[which]


def _meet(times: np.ndarray, breaks: np.ndarray) -> None:
    """Put ascending times that equal a break up to rounding onto it."""
    first, last = np.searchsorted(
        times, [breaks[0] - SAME_TIME, breaks[-1] + SAME_TIME]
    )
    some = times[first : last + 1]
    near = breaks[
        np.minimum(np.searchsorted(breaks, some - SAME_TIME), len(breaks) - 1)
    ]
    some[:] = np.where(np.abs(near - some) <= SAME_TIME, near, some)


def _starts(sizes: list[int]) -> np.ndarray:
    return np.cumsum([0, *sizes], dtype=np.int64)


def _mover(velocity: Signal | None, breaks: np.ndarray) -> np.ndarray:
    """Return displacement, velocity and acceleration of a support at the start of each piece, [S, 9]."""
    if velocity is None:
        return np.zeros((len(breaks) - 1, 9))
    return np.concatenate(
        [displacement(velocity, breaks[:-1]), *velocity.pieces(breaks)], axis=1
    )
