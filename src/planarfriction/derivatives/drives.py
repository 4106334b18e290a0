"""The quantities with respect to which a motion is differentiated: factors, knots of signals, the initial state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.kernels import tangent
from planarfriction.kernels.body import System
from planarfriction.kernels.tangent import Drives
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
- `mass`, `inertia`: of the body, forces held (gravity pulls in proportion to the mass);
- `load`: every normal force; not where a patch changes its shape with it.
"""

STATES = ("vx", "vy", "omega", "x", "y", "theta")
"""Velocity and pose of the body, in the order of the state."""

MOST_KNOTS = 1000
"""Knots of a signal: each has a derivative of all states."""

_OF_EQUILIBRIUM = (tangent.NORMAL_FORCE, tangent.FORCE, tangent.LOAD, tangent.MASS)
"""What changes how bristles start that carry the load, and whose derivative is known."""

_COLUMNS = {"force": ("fx", "fy", "tau"), "velocity": STATES[:3]}


class Knots:
    """The knots of one signal of a scene: numbers added to it there, joined in time as its own samples are."""

    def __init__(self, scene: Scene, name: str, times: Any) -> None:
        at = f"knots of {name}"
        times = validation.array(at, times, (None,))
        if not 1 <= len(times) <= MOST_KNOTS:
            raise InvalidValueError(at, f"be 1 to {MOST_KNOTS} times", len(times))
        if times[0] < 0.0 or times[-1] > scene.t_end or (np.diff(times) <= SAME_TIME).any():
            raise InvalidValueError(at, f"increase, between 0 and {scene.t_end:g} s", times.tolist())
        self.name, self.times = name, times
        if name in _COLUMNS:
            self.kind = tangent.FORCE if name == "force" else tangent.VELOCITY
            self.signal, self.components = getattr(scene, name), tuple(enumerate(_COLUMNS[name]))
        else:
            names = [f"{contact.name}.normal_force" for contact in scene.contacts]
            self.kind, self.components = tangent.NORMAL_FORCE, ((names.index(name), ""),)
            self.signal = scene.contacts[names.index(name)].normal_force
        hold = "previous" if self.signal is None else self.signal.hold
        self.hats = Signal(times, np.eye(len(times)), hold)
        """For each knot what a change of one there adds to the signal."""
        before = times if hold == "previous" else np.append(0.0, times[:-1])
        self.begins = np.append(0.0, before[1:])
        """When each knot begins to have an effect [s]."""


def _refuse_shapes(scene: Scene, parameters: Any, signals: Mapping[str, Any]) -> None:
    """Derivatives by a load hold the patch, which is wrong where the patch follows the load."""
    for contact in scene.contacts:
        for name in (*parameters, *signals):
            if contact.model.patch.depends_on_load and name in ("load", f"{contact.name}.normal_force"):
                rule = f"not contain {name}: the shape of the patch of contact {contact.name!r} changes with the load"
                raise InvalidValueError("parameters" if name == "load" else "signals", rule, name)


class Columns:
    """The derivatives of a motion, one after another in the order in which they begin."""

    def __init__(self, scene: Scene, parameters: Any, signals: Any, initial: Any) -> None:
        if not isinstance(scene, Scene):
            raise InvalidValueError("scene", "be a Scene", type(scene).__name__)
        parameters = validation.choices("parameters", parameters, SCENE_PARAMETERS)
        driven = scene.velocity is not None
        initial = validation.choices("initial", initial, STATES[3:] if driven else STATES)
        valid = [f"{contact.name}.normal_force" for contact in scene.contacts] + ["velocity" if driven else "force"]
        signals = {} if signals is None else signals
        if not isinstance(signals, Mapping):
            raise InvalidValueError("signals", "be a table of knots [s] by the name of a signal", signals)
        _refuse_shapes(scene, parameters, signals)
        self._knots = [Knots(scene, validation.choice("a signal", name, valid), t) for name, t in signals.items()]
        plain = [(name, SCENE_PARAMETERS[name], 0) for name in parameters]
        plain += [(name, tangent.INITIAL, STATES.index(name)) for name in initial]
        begins, sources = [np.zeros(len(plain))], [np.full((len(plain), 2), -1)]
        self.of = {name: slice(i, i + 1) for i, (name, _, _) in enumerate(plain)}
        """Where the derivatives with respect to each name stand; those of a signal knot by knot."""
        for s, knots in enumerate(self._knots):
            many, first = len(knots.times), len(plain)
            plain += [
                (f"{knots.name}[{k}]" + (f".{part}" if part else ""), knots.kind, place)
                for k in range(many)
                for place, part in knots.components
            ]
            each = np.repeat(np.arange(many), len(knots.components))
            begins.append(knots.begins[each])
            sources.append(np.stack([np.full(len(each), s), each], axis=1))
            self.of[knots.name] = slice(first, len(plain))
        self.names = tuple(name for name, _, _ in plain)
        begin = np.concatenate(begins)
        self._order = np.argsort(begin, kind="stable")
        self._begin, source = begin[self._order], np.concatenate(sources)[self._order].astype(int)
        mine = [np.flatnonzero(source[:, 0] == s) for s in range(len(self._knots))]
        self._sources = [(columns, source[columns, 1]) for columns in mine]
        pairs = np.array([[kind, place] for _, kind, place in plain], int).reshape(-1, 2)[self._order]
        inputs, which = np.unique(pairs, axis=0, return_inverse=True)
        kinds = (np.ascontiguousarray(column) for column in (*pairs.T, *inputs.T))
        kind, place, input_kind, input_place = kinds
        self._drives = Drives(kind, place, np.zeros((len(plain), 2)), which.reshape(-1), input_kind, input_place)
        self.inputs = len(inputs)
        """How many different inputs are behind the numbers."""
        self._scale = np.ones(len(plain))
        self._hats: list[tuple[np.ndarray, np.ndarray]] = []

    @property
    def marks(self) -> np.ndarray:
        """Where the solver has to stop [s]."""
        return np.concatenate([np.zeros(0), *(knots.times for knots in self._knots)])

    def start(self, scene: Scene, windows: SegmentBatches, slope: np.ndarray) -> None:
        """Choose the units in which errors are judged, and write the derivatives [P, n] at the start."""
        natural, start = windows.state_scale[-6:], np.abs(windows.state[-6:])
        grip = sum(contact.count * np.abs(contact.normal_force.values).max() for contact in scene.contacts) or 1.0
        arm = natural[3] / natural[5]
        for p, (kind, place) in enumerate(zip(self._drives.kind, self._drives.place, strict=True)):
            if kind == tangent.NORMAL_FORCE:
                self._scale[p] = np.abs(scene.contacts[place].normal_force.values).max() or 1.0
            elif kind == tangent.FORCE:
                self._scale[p] = grip * (arm if place == 2 else 1.0)
            elif kind == tangent.VELOCITY and scene.velocity is not None:
                self._scale[p] = max(np.abs(scene.velocity.values[:, place]).max(), natural[place])
            elif kind == tangent.INITIAL:
                self._scale[p] = max(start[place], natural[place])
                slope[p, slope.shape[1] - 6 + place] = self._scale[p]
        if scene.start != "rest":
            self._start_held(scene, windows, slope)

    def _start_held(self, scene: Scene, windows: SegmentBatches, slope: np.ndarray) -> None:
        """Write the derivatives of bristles that carry the load at the start; refuse those of others."""
        count = len(slope)
        say = self._drives.kind != tangent.INERTIA
        for (columns, knot), knots in zip(self._sources, self._knots, strict=True):
            say[columns] = knots.hats(0.0)[knot] != 0.0
        kinds = _OF_EQUILIBRIUM if scene.start == "equilibrium" else ()
        refused = np.flatnonzero(say & ~np.isin(self._drives.kind, kinds))
        if len(refused):
            name = self.names[self._order[refused[0]]]
            rule = f"be 'rest' for the derivative with respect to {name}, on which the initial bristles depend"
            raise InvalidValueError("start", rule, scene.start)
        d_loads, d_pull = np.zeros((count, len(scene.contacts))), np.zeros((count, 3))
        for p in np.flatnonzero(say):
            kind, place = self._drives.kind[p], self._drives.place[p]
            if kind == tangent.LOAD:
                d_loads[p] = [float(contact.normal_force(0.0)) for contact in scene.contacts]
            elif kind == tangent.MASS:
                d_pull[p, :2] = scene.body.mass * np.array(scene.body.gravity)
        for (columns, knot), knots in zip(self._sources, self._knots, strict=True):
            share, place = knots.hats(0.0)[knot], self._drives.place[columns]
            changes = d_loads if knots.kind == tangent.NORMAL_FORCE else d_pull
            changes[columns, place] = self._scale[columns] * share
        slope[:, :-6] = windows.first_slopes(d_loads, d_pull) if count else slope[:, :-6]

    def enter(self, system: System) -> None:
        """Take the pieces of the window that comes next."""
        self._hats = [knots.hats.pieces(system.motion.breaks) for knots in self._knots]

    def at(self, piece: int, end: float) -> Drives:
        """The numbers that affect a piece of the window, which ends at `end` [s]."""
        count = int(np.searchsorted(self._begin, end - SAME_TIME))
        drives = self._drives
        for (start, slope), (column, knot) in zip(self._hats, self._sources, strict=True):
            drives.weight[column, 0] = self._scale[column] * start[piece, knot]
            drives.weight[column, 1] = self._scale[column] * slope[piece, knot]
        kind, place, weight, which = (values[:count] for values in drives[:4])
        return Drives(kind, place, weight, which, drives.input_kind, drives.input_place)

    def gained(self, drives: Drives, moments: np.ndarray) -> np.ndarray:
        """What a cost gains on a piece per number, from the moments [U, 2] of the inputs."""
        moments = moments[drives.input]
        of_signal = (drives.weight * moments).sum(axis=1)
        driven = drives.weight[:, 1] * moments[:, 0]
        gained = np.where(drives.kind == tangent.VELOCITY, driven, of_signal)
        return np.where(drives.kind <= tangent.LOAD, moments[:, 0], gained)

    def begin(self, drives: Drives, slope: np.ndarray) -> None:
        """Put the derivatives of a prescribed velocity onto that with which a piece begins."""
        for p in np.flatnonzero(drives.kind == tangent.VELOCITY):
            slope[p, slope.shape[1] - 6 + drives.place[p]] = drives.weight[p, 0]

    def sorted(self, values: np.ndarray) -> np.ndarray:
        """Derivatives [..., P] per unit of each number, in the order of `names`."""
        result = np.empty_like(values)
        result[..., self._order] = values / self._scale
        return result
