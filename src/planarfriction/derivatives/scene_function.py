"""A scene as a function of numbers, with forward and reverse derivatives, for the tensor front ends."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from planarfriction._engine.compiler import threads
from planarfriction._support import validation
from planarfriction.derivatives.path import RTOL, KeptMotion
from planarfriction.derivatives.scene_inputs import (
    SCENE_PARAMETERS,
    STATES,
    SceneInputs,
)
from planarfriction.derivatives.scenes import scene_sensitivities
from planarfriction.errors import InvalidValueError
from planarfriction.scenes.contact import Contact, with_friction
from planarfriction.scenes.scene import Scene, SolverOptions
from planarfriction.scenes.signal import Signal

FACTORS = tuple(name for name in SCENE_PARAMETERS if name != "r")
"""Parameters of a scene that a function may take: the size of its patches is not among them."""

_OF_BODY = ("force", "velocity")
"""Signals with three components."""


class SceneFunction:
    """The motion `[M, 6]` and the wrenches `[M, C, 3]` of a scene as a function of P numbers, for B sets of numbers.

    The numbers are factors of parameters, components of the start, and the values of signals at their knots (all
    components of a knot together), in the order in which they are named. A motion that ends early stays as it ended.
    Different sets are simulated at the same time, in as many threads as there are processors. `options` are
    `SolverOptions`.
    """

    def __init__(
        self,
        scene: Scene,
        parameters: Sequence[str] = (),
        signals: Mapping[str, Any] | None = None,
        initial: Sequence[str] = (),
        **options: Any,
    ) -> None:
        self._parameters = validation.choices("parameters", parameters, FACTORS)
        self._knots = {
            name: validation.array(f"knots of {name}", t, (None,))
            for name, t in (signals or {}).items()
        }
        self._scene = scene
        self._initial = tuple(initial)
        self._options = SolverOptions(**options)
        self.count = len(self._inputs(scene).names)
        """Number P of numbers."""
        self.shapes = {
            name: (len(times), *(3,) * (name in _OF_BODY))
            for name, times in self._knots.items()
        }
        """Shape of the values of each signal: `[K]`, of force and velocity `[K, 3]`."""
        self.time = self._options.plan(scene, RTOL).times
        """Instants that are recorded `[M]` [s]."""
        self.results = (len(self.time), 6), (len(self.time), len(scene.contacts), 3)
        """Shapes of motion and wrenches."""

    def run(
        self, values: np.ndarray, kept: dict[bytes, KeptMotion] | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return motion `[B, M, 6]` and wrenches `[B, M, C, 3]` at `values` `[B, P]`; keep the motions in `kept`."""

        def one(row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            done = self._motion_at(row)
            if kept is not None:
                kept[row.tobytes()] = done
            motion, wrenches = done.recorded
            return self._filled(motion), self._filled(wrenches)

        return self._stacked(threads.each(one, list(values)))

    def pull(
        self,
        values: np.ndarray,
        of_motion: np.ndarray,
        of_wrenches: np.ndarray,
        kept: dict[bytes, KeptMotion] | None = None,
    ) -> np.ndarray:
        """Return derivatives `[B, P]` of costs from their derivatives by motion and by wrenches, shaped as these."""
        different, which = np.unique(values, axis=0, return_inverse=True)
        gradient = np.empty_like(values)

        def some(i: int) -> None:
            row = different[i]
            done = (kept or {}).get(row.tobytes()) or self._motion_at(row)
            for b in np.flatnonzero(which.reshape(-1) == i):
                bars = (
                    self._folded(bar[b], len(done.time))
                    for bar in (of_motion, of_wrenches)
                )
                gradient[b] = done.gradient(*bars) * self._per_factor(row)

        threads.each(some, range(len(different)))
        return gradient

    def push(
        self, values: np.ndarray, changes: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return changes of motion and wrenches for changes of the values `[B, P]`."""

        def one(pair: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
            row, change = pair
            options: dict[str, Any] = {
                "signals": self._knots,
                "initial": self._initial,
                "options": self._options,
            }
            result = scene_sensitivities(
                self._scene_at(row), self._parameters, **options
            )
            change = change * self._per_factor(row)
            return self._filled(result.d_motion @ change), self._filled(
                result.d_wrenches @ change
            )

        return self._stacked(threads.each(one, list(zip(values, changes, strict=True))))

    def _inputs(self, scene: Scene) -> SceneInputs:
        return SceneInputs(scene, self._parameters, self._knots, self._initial)

    def _motion_at(self, row: np.ndarray) -> KeptMotion:
        scene = self._scene_at(row)
        return KeptMotion(scene, self._inputs(scene), self._options)

    def _stacked(
        self, results: list[tuple[np.ndarray, np.ndarray]]
    ) -> tuple[np.ndarray, np.ndarray]:
        motion, wrenches = (
            np.array([result[i] for result in results]).reshape(-1, *self.results[i])
            for i in (0, 1)
        )
        return motion, wrenches

    def _filled(self, values: np.ndarray) -> np.ndarray:
        """Return values at all instants, from the values up to the end of the motion."""
        return values[np.minimum(np.arange(len(self.time)), len(values) - 1)]

    def _folded(self, bar: np.ndarray, count: int) -> np.ndarray:
        """Apply the transpose of `_filled`."""
        result = bar[:count].copy()
        result[-1] += bar[count:].sum(axis=0)
        return result

    def _per_factor(self, row: np.ndarray) -> np.ndarray:
        """Return the derivative by each number per derivative by a factor that is 1, as derivatives of scenes are."""
        slopes = np.ones(self.count)
        factors = dict(zip(self._parameters, row, strict=False))
        slopes[: len(factors)] = 1.0 / row[: len(factors)]
        first = len(factors) + len(self._initial)
        for name, shape in self.shapes.items():
            last = first + int(np.prod(shape))
            if name not in _OF_BODY:
                slopes[first:last] = factors.get("load", 1.0)
            first = last
        return slopes

    # ------------------------------------------------------------------ the scene with other numbers

    def _scene_at(self, row: np.ndarray) -> Scene:
        """Return the scene with these numbers in it."""
        values = iter(np.asarray(row, float).tolist())
        factors = {
            name: validation.positive(name, next(values)) for name in self._parameters
        }
        start = {name: next(values) for name in self._initial}
        signals = {
            name: np.reshape([next(values) for _ in range(int(np.prod(shape)))], shape)
            for name, shape in self.shapes.items()
        }
        scene = self._scene
        body = self._scene.body
        now = zip(STATES, (*body.velocity, *body.position, body.angle), strict=True)
        state = [start.get(name, value) for name, value in now]
        scaled = {
            name: getattr(body, name) * factors.get(name, 1.0)
            for name in ("mass", "inertia")
        }
        body = dataclasses.replace(
            body, velocity=state[:3], position=state[3:5], angle=state[5], **scaled
        )
        changed: dict[str, Any] = {
            name: self._signal(name, getattr(scene, name), values)
            for name, values in signals.items()
            if name in _OF_BODY
        }
        contacts = [
            self._contact(contact, signals, factors) for contact in scene.contacts
        ]
        return dataclasses.replace(scene, body=body, contacts=contacts, **changed)

    def _contact(
        self,
        contact: Contact,
        signals: dict[str, np.ndarray],
        factors: dict[str, float],
    ) -> Contact:
        name = f"{contact.name}.normal_force"
        load = contact.normal_force
        mu = factors.get("mu", 1.0)
        if name in signals:
            load = self._signal(name, load, signals[name])
        if "load" in factors:
            load = dataclasses.replace(load, values=factors["load"] * load.values)
        changed = with_friction(contact, mu)
        numbers = contact.model.law.numbers
        wanted = numbers._replace(mu_c=mu * numbers.mu_c, mu_s=mu * numbers.mu_s)
        if not np.allclose(changed.model.law.numbers, wanted, rtol=1e-12, atol=0.0):
            rule = f"not contain mu: {type(contact.model.law).__name__} has other friction coefficients too"
            raise InvalidValueError("parameters", rule, "mu")
        return dataclasses.replace(changed, normal_force=load)

    def _signal(self, name: str, old: Signal | None, values: np.ndarray) -> Signal:
        return Signal(self._knots[name], values, "linear" if old is None else old.hold)
