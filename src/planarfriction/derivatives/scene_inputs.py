"""Numbers by which a motion is differentiated: factors, knots of signals, the initial state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from planarfriction._engine.body import tangent
from planarfriction._engine.body.body import System
from planarfriction._engine.body.tangent import Drives
from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.laws.base import refuse_rate_law
from planarfriction.scenes.packing import SegmentBatches
from planarfriction.scenes.scene import Scene
from planarfriction.scenes.signal import SAME_TIME, Signal

SCENE_PARAMETERS = {
    "mu": tangent.FRICTION,
    "r": tangent.SIZE,
    "mass": tangent.MASS,
    "inertia": tangent.INERTIA,
    "load": tangent.LOAD,
}
"""Parameters of `scene_sensitivities`, each a factor that is 1 for the scene as it is:

- `mu`: mu_c and mu_s of every contact;
- `r`: the size of every patch, about the origin of its contact frame (positions, contact radius, second moment);
- `mass`, `inertia`: of the body, forces held (gravity acts in proportion to the mass);
- `load`: every normal force; not where a patch changes its shape with it.
"""

STATES = ("vx", "vy", "omega", "x", "y", "theta")
"""Velocity and pose of the body, in the order of the state."""

MOST_KNOTS = 1000
"""Largest number of knots of a signal: each has a derivative of all states."""

_OF_EQUILIBRIUM = (tangent.NORMAL_FORCE, tangent.FORCE, tangent.LOAD, tangent.MASS)
"""Kinds of numbers by which the start of bristles that carry the load can be differentiated."""

_COMPONENTS = {"force": ("fx", "fy", "tau"), "velocity": STATES[:3]}


class Knots:
    """Knots of one signal of a scene: numbers added to it there, joined in time as its own samples are."""

    def __init__(self, scene: Scene, name: str, times: Any) -> None:
        at = f"knots of {name}"
        times = validation.array(at, times, (None,))
        if not 1 <= len(times) <= MOST_KNOTS:
            raise InvalidValueError(at, f"be 1 to {MOST_KNOTS} times", len(times))
        if (
            times[0] < 0.0
            or times[-1] > scene.t_end
            or (np.diff(times) <= SAME_TIME).any()
        ):
            raise InvalidValueError(
                at, f"increase, between 0 and {scene.t_end:g} s", times.tolist()
            )
        self.name = name
        self.times = times
        if name in _COMPONENTS:
            self.kind = tangent.FORCE if name == "force" else tangent.VELOCITY
            signal = getattr(scene, name)
            self.components = tuple(enumerate(_COMPONENTS[name]))
        else:
            place = [
                f"{contact.name}.normal_force" for contact in scene.contacts
            ].index(name)
            self.kind = tangent.NORMAL_FORCE
            self.components = ((place, ""),)
            signal = scene.contacts[place].normal_force
        hold = "previous" if signal is None else signal.hold
        self.hats = Signal(times, np.eye(len(times)), hold)
        """Change of the signal per change of each knot."""
        before = times if hold == "previous" else np.append(0.0, times[:-1])
        self.begins = np.append(0.0, before[1:])
        """Times [s] at which the knots begin to have an effect."""

    def numbers(self) -> list[tuple[str, int, int]]:
        """Return the name, the kind and the place of each number, knot by knot."""
        return [
            (f"{self.name}[{k}]" + (f".{part}" if part else ""), self.kind, place)
            for k in range(len(self.times))
            for place, part in self.components
        ]


class SceneInputs:
    """P numbers of a scene, sorted by the time at which they begin to have an effect.

    Derivatives are carried per `scale` of each number, so that errors are judged alike; `in_order` returns them per
    unit and in the order of `names`.
    """

    def __init__(
        self, scene: Scene, parameters: Any, signals: Any, initial: Any
    ) -> None:
        if not isinstance(scene, Scene):
            raise InvalidValueError("scene", "be a Scene", type(scene).__name__)
        self._scene = scene
        driven = scene.velocity is not None
        parameters = validation.choices("parameters", parameters, SCENE_PARAMETERS)
        if "mu" in parameters:
            for contact in scene.contacts:
                refuse_rate_law(contact.model.law, "derivatives by mu")
        initial = validation.choices(
            "initial", initial, STATES[3:] if driven else STATES
        )
        self._knots = _knots_of(scene, parameters, signals)
        numbers = [(name, SCENE_PARAMETERS[name], 0) for name in parameters]
        numbers += [(name, tangent.INITIAL, STATES.index(name)) for name in initial]
        begins = [np.zeros(len(numbers))]
        sources = [np.full((len(numbers), 2), -1)]
        self.columns = {name: slice(i, i + 1) for i, (name, _, _) in enumerate(numbers)}
        """Derivatives with respect to each name, in the order of `names`; of a signal knot by knot."""
        for s, knots in enumerate(self._knots):
            values = knots.numbers()
            each = np.repeat(np.arange(len(knots.times)), len(knots.components))
            self.columns[knots.name] = slice(len(numbers), len(numbers) + len(values))
            numbers += values
            begins.append(knots.begins[each])
            sources.append(np.stack([np.full(len(each), s), each], axis=1))
        self.names = tuple(name for name, _, _ in numbers)
        begin = np.concatenate(begins)
        self._order = np.argsort(begin, kind="stable")
        self._begin = begin[self._order]
        source = np.concatenate(sources)[self._order].astype(int)
        mine = [np.flatnonzero(source[:, 0] == s) for s in range(len(self._knots))]
        self._sources = [(columns, source[columns, 1]) for columns in mine]
        pairs = np.array([[kind, place] for _, kind, place in numbers], int).reshape(
            -1, 2
        )[self._order]
        inputs, which = np.unique(pairs, axis=0, return_inverse=True)
        kind, place, input_kind, input_place = (
            np.ascontiguousarray(column) for column in (*pairs.T, *inputs.T)
        )
        self._drives = Drives(
            kind,
            place,
            np.zeros((len(numbers), 2)),
            which.reshape(-1),
            input_kind,
            input_place,
        )
        self.inputs = len(inputs)
        """Number of different inputs behind the numbers."""
        self._scale = np.ones(len(numbers))
        self.input_scale = np.ones(len(inputs))
        """Scale of each input, which all of its numbers share."""
        self._system: System | None = None
        self._hats: list[tuple[np.ndarray, np.ndarray]] = []
        """Pieces of the signals' changes between the breaks of the system."""

    @property
    def marks(self) -> np.ndarray:
        """Times [s] at which the solver has to stop."""
        return np.concatenate([np.zeros(0), *(knots.times for knots in self._knots)])

    # ------------------------------------------------------------------ the start of the motion

    def start(self, batches: SegmentBatches) -> np.ndarray:
        """Choose the scales of the numbers, and return the derivatives at the start `[P, n]`."""
        scene = self._scene
        slopes = np.zeros((len(self.names), len(batches.state)))
        smallest = batches.state_scale[-6:]
        start = np.abs(batches.state[-6:])
        grip = (
            sum(
                contact.count * np.abs(contact.normal_force.values).max()
                for contact in scene.contacts
            )
            or 1.0
        )
        arm = smallest[3] / smallest[5]
        for p, (kind, place) in enumerate(
            zip(self._drives.kind, self._drives.place, strict=True)
        ):
            if kind == tangent.NORMAL_FORCE:
                self._scale[p] = (
                    np.abs(scene.contacts[place].normal_force.values).max() or 1.0
                )
            elif kind == tangent.FORCE:
                self._scale[p] = grip * (arm if place == 2 else 1.0)
            elif kind == tangent.VELOCITY and scene.velocity is not None:
                self._scale[p] = max(
                    np.abs(scene.velocity.values[:, place]).max(), smallest[place]
                )
            elif kind == tangent.INITIAL:
                self._scale[p] = max(start[place], smallest[place])
                slopes[p, place - 6] = self._scale[p]
        self.input_scale[self._drives.input] = self._scale
        if scene.start != "rest" and len(slopes):
            slopes[:, :-6] = self._bristles_at_start(batches)
        return slopes

    def _bristles_at_start(self, batches: SegmentBatches) -> np.ndarray:
        """Return the derivatives of bristles that carry the load at the start; refuse other bristles."""
        scene = self._scene
        drives = self._drives
        count = len(self.names)
        moves = drives.kind != tangent.INERTIA
        for (columns, knot), knots in zip(self._sources, self._knots, strict=True):
            moves[columns] = knots.hats(0.0)[knot] != 0.0
        kinds = _OF_EQUILIBRIUM if scene.start == "equilibrium" else ()
        refused = np.flatnonzero(moves & ~np.isin(drives.kind, kinds))
        if len(refused):
            name = self.names[self._order[refused[0]]]
            rule = f"be 'rest' for the derivative with respect to {name}, on which the initial bristles depend"
            raise InvalidValueError("start", rule, scene.start)
        d_loads = np.zeros((count, len(scene.contacts)))
        d_pull = np.zeros((count, 3))
        d_loads[moves & (drives.kind == tangent.LOAD)] = [
            float(each.normal_force(0.0)) for each in scene.contacts
        ]
        d_pull[moves & (drives.kind == tangent.MASS), :2] = scene.body.mass * np.array(
            scene.body.gravity
        )
        for (columns, knot), knots in zip(self._sources, self._knots, strict=True):
            changes = d_loads if knots.kind == tangent.NORMAL_FORCE else d_pull
            changes[columns, drives.place[columns]] = (
                self._scale[columns] * knots.hats(0.0)[knot]
            )
        return batches.first_slopes(d_loads, d_pull)

    # ------------------------------------------------------------------ along the motion

    def at(self, system: System, piece: int) -> Drives:
        """Return the numbers that affect a piece of the system."""
        breaks = system.motion.breaks
        drives = self._drives
        if system is not self._system:
            self._system = system
            self._hats = [knots.hats.pieces(breaks) for knots in self._knots]
        count = int(np.searchsorted(self._begin, breaks[piece + 1] - SAME_TIME))
        for (start, slope), (column, knot) in zip(
            self._hats, self._sources, strict=True
        ):
            drives.weight[column, 0] = self._scale[column] * start[piece, knot]
            drives.weight[column, 1] = self._scale[column] * slope[piece, knot]
        return drives._replace(
            **{
                name: getattr(drives, name)[:count]
                for name in ("kind", "place", "weight", "input")
            }
        )

    def begin(self, drives: Drives, slopes: np.ndarray) -> None:
        """Write the derivatives of a prescribed velocity into the derivatives `[P, n]` at the start of a piece."""
        for p in np.flatnonzero(drives.kind == tangent.VELOCITY):
            slopes[p, drives.place[p] - 6] = drives.weight[p, 0]

    def gained(self, drives: Drives, moments: np.ndarray) -> np.ndarray:
        """Return the gain of a cost on a piece per number, from the moments `[U, 2]` of the inputs."""
        moments = moments[drives.input]
        of_signal = (drives.weight * moments).sum(axis=1)
        of_velocity = drives.weight[:, 1] * moments[:, 0]
        gained = np.where(drives.kind == tangent.VELOCITY, of_velocity, of_signal)
        return np.where(drives.kind <= tangent.LOAD, moments[:, 0], gained)

    def in_order(self, values: np.ndarray) -> np.ndarray:
        """Return derivatives `[..., P]` per unit of each number, in the order of `names`."""
        result = np.empty_like(values)
        result[..., self._order] = values / self._scale
        return result


def _knots_of(scene: Scene, parameters: Any, signals: Any) -> list[Knots]:
    """Return the checked knots of signals; derivatives by a load hold the shape of the patch."""
    valid = [f"{contact.name}.normal_force" for contact in scene.contacts]
    valid += ["force" if scene.velocity is None else "velocity"]
    signals = {} if signals is None else signals
    if not isinstance(signals, Mapping):
        raise InvalidValueError(
            "signals", "be a table of knots [s] by the name of a signal", signals
        )
    for contact in scene.contacts:
        for name in (*parameters, *signals):
            if contact.model.patch.depends_on_load and name in (
                "load",
                f"{contact.name}.normal_force",
            ):
                rule = f"not contain {name}: the shape of the patch of contact {contact.name!r} changes with the load"
                raise InvalidValueError(
                    "parameters" if name == "load" else "signals", rule, name
                )
    return [
        Knots(scene, validation.choice("signals", name, valid), times)
        for name, times in signals.items()
    ]
