"""A step of a plant with patch friction: solved in contact space, and repeated with the wrenches found.

Drake does not tell how its contacts react to wrenches. The first guess of this reaction is that of the bodies without
contact, which is never too stiff; each evaluation of the plant's step corrects it.
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from planarfriction._engine.cells.moment_pressure import tilted
from planarfriction._engine.records.packed import PackedModel
from planarfriction.adapters.drake.plant_copy import Shadow
from planarfriction.coupling import CoupledPatches, HostStep
from planarfriction.models.base import lever_of

PASSES = 12
"""Largest number of evaluations of the plant's step."""

MISFIT = 1e-7
"""Twists that come out [m/s] within which they are what was solved for: what Drake's own solver leaves open."""

NOTICED = 1e-6
"""Twists that come out [m/s] so far off say how contacts answer; below, what gets no better is taken."""

RESOLUTION = 1e-6
"""Share of its momentum within which Drake's solver ends a step (`SapSolverParameters`): of all that touches."""

QUIET = 1e-9
"""Changes of twists [m/s] that are not worth asking for: a thousandth of a micrometre in a second."""

STIFFEST = 1e-6
"""Least response to a change that is learnt, as a share of what was expected."""

_ONES = np.ones(3)


class Asked(NamedTuple):
    """The end of a step, as flat vectors patch by patch."""

    bristles: np.ndarray
    wrenches: np.ndarray
    force: np.ndarray
    """Generalized force of the wrenches `[nv]`."""
    owed: np.ndarray
    """Difference between the twists of the plant and those that the bristles have seen."""
    axes: np.ndarray
    """x axes of the patches in their frames; 0 before the first contact."""
    twists: np.ndarray
    loads: np.ndarray
    covers: np.ndarray
    """Pressed shares of the cells of patches under contact surfaces; 0 without contact."""
    touching: list[bool]
    answers: np.ndarray
    """Reaction of twists and loads to wrenches at the end, from which the next step starts."""
    velocities: np.ndarray
    """Velocities of the plant `[nv]` at the end of the step."""
    report: tuple[float, ...]
    """Passes, iterations, residual, misfit, whether the step in contact space has converged."""


class Asking:
    """Steps of patches on a shadow. What it keeps is scratch: each step starts from what it is given."""

    def __init__(self, shadow: Shadow, coupled: CoupledPatches, size: int) -> None:
        k = len(coupled.models)
        self._coupled = coupled
        self._shadow = shadow
        self._row = CouplingRow(coupled, shadow)
        self._normals = np.zeros((k, 3))
        self._moments = np.zeros((k, 2, 6))
        """Maps of forces and their moments about the world's origin to the moments about the patches' origins."""
        self._touching = [False] * k
        self._levers = np.ones(3 * k)
        self._levers[2::3] = [lever_of(model) for model in coupled.models]
        self._rows = np.zeros((3 * k, size))
        self._moved = np.zeros((size, 3 * k))
        """Jacobian of the twists `[3k, nv]`; velocities that wrenches cause without contact `[nv, 3k]`."""
        self._open = MISFIT
        """Twists [m/s] that Drake's solver leaves open, next to heavy or fast bodies more than `MISFIT`."""

    def step(
        self,
        applied: np.ndarray,
        bristles: np.ndarray,
        wrench: np.ndarray,
        force: np.ndarray,
        owed: np.ndarray,
        axes: np.ndarray,
        answers: np.ndarray,
        covers: np.ndarray,
    ) -> Asked:
        """Take a step from the state of the shadow, under generalized forces `applied` and friction.

        From `bristles`, the `wrench` of each patch in the last step, the generalized `force` that these were, the
        twists that bristles are `owed` (those that they saw in the last step were off by them), its x `axes`, its
        `answers`, and the `covers` of its cells.
        """
        row = self._row
        row.held = {}
        pressed = np.zeros(len(covers))
        passes = 0
        iterations = 0
        solved = False
        misfit = np.inf
        bristles = bristles.copy()
        wrench = wrench.copy()
        owed = owed.copy()
        axes = axes.copy()
        self._forget()
        np.copyto(row.follows, abs(row.follows))
        while True:
            velocity = self._shadow.step(applied + force)
            pushes = self._shadow.pushes(first=passes == 0)
            passes += 1
            new = self._touch(pushes, bristles, wrench, owed, axes)
            if new:
                self._press(new, pushes, bristles, covers, pressed)
                np.copyto(row.follows, abs(row.follows))
                if passes == 1:
                    self._answer_as_before(answers)
                wrench = self._pressed(wrench)
                owed = self._pressed(owed)
                solved = False
                misfit = np.inf
            twist = self._twists(velocity) + owed
            load = np.maximum((self._normals * pushes[:, :3]) @ _ONES, 0.0)
            if solved:
                off = twist - row.twist
                last = misfit
                misfit = self._speed(off, load - row.load)
                if (
                    misfit <= self._open
                    or passes >= PASSES
                    or 0.5 * last < misfit <= NOTICED
                ):
                    break
                if misfit > last:  # learnt where contacts came or went
                    self._answer_freely()
                elif misfit > max(NOTICED, self._open):
                    self._learn(
                        wrench - row.guess, twist - row.free_twist, load - row.free_load
                    )
            # The axes have, since the last step.
            turned = self._moved.T @ (wrench @ self._rows - force)
            row.free_twist[:] = twist + turned
            row.free_load[:] = load
            row.guess[:] = wrench
            row.state[:] = bristles
            row.moments[:] = (self._moments @ pushes[:, :, None]).ravel()
            iterations += row.solve()
            # Pressures stay for the rest of the step.
            np.copyto(row.follows, -abs(row.follows))
            change = row.wrench - wrench
            wrench = row.wrench.copy()
            solved = True
            force = wrench @ self._rows
            moved = self._speed(turned + row.response @ change)
            if moved <= QUIET:
                misfit = moved
                off = 0.0 * owed
                twist = row.twist
                break
        report = passes, iterations, row.residual[0], misfit, row.converged[0]
        answers = np.concatenate([row.response.ravel(), row.load_response.ravel()])
        return Asked(
            row.new,
            wrench,
            force,
            off,
            axes,
            twist - owed,
            load,
            pressed,
            self._touching,
            answers,
            velocity,
            report,
        )

    def _twists(self, velocity: np.ndarray) -> np.ndarray:
        """Return how far patches move in the step that the shadow took last, per dt: what is held keeps its place."""
        twists = self._rows @ velocity
        touching = [p for p, touches in enumerate(self._touching) if touches]
        for p, bend in zip(touching, self._shadow.bends(touching), strict=True):
            twists[3 * p : 3 * p + 3] += bend
        return twists

    def _forget(self) -> None:
        self._touching = [False] * len(self._touching)
        for each in (self._rows, self._moved, self._row.response):
            each.fill(0.0)

    def _touch(
        self,
        pushes: np.ndarray,
        bristles: np.ndarray,
        wrench: np.ndarray,
        owed: np.ndarray,
        axes: np.ndarray,
    ) -> list[int]:
        """Place patches that touch for the first time in this step, and return them.

        Their bristles, wrenches and what they are owed are carried into their axes of this step, in place.
        """
        if all(self._touching):
            return []
        new = [
            p
            for p, touching in enumerate(self._touching)
            if not touching and pushes[p, :3].any()
        ]
        for p in new:
            one = slice(3 * p, 3 * p + 3)
            placed = self._shadow.rows(p, pushes[p, :3], axes[one])
            self._rows[one], self._normals[p], self._moments[p], axes[one], turn = (
                placed
            )
            for vectors in (self._coupled.states(bristles)[p], wrench[one], owed[one]):
                vectors[:2] = np.tensordot(turn, vectors[:2], 1)
            self._touching[p] = True
        if new:
            self._moved, momentum = self._shadow.moved(self._rows)
            self._answer_freely()
            speeds = self._levers * np.sqrt(
                self._row.response.diagonal() / self._shadow.dt
            )
            self._open = max(MISFIT, RESOLUTION * momentum * speeds.max())
        return new

    def _press(
        self, new: list[int], pushes: np.ndarray, bristles: np.ndarray, before: np.ndarray, pressed: np.ndarray
    ) -> None:  # fmt: skip
        """Give patches under contact surfaces the pressure of these, and write which cells are `pressed`.

        Drake takes the force of each polygon at its centroid. A plane over the pressures brings their centre there.
        """
        for p in new:
            one = self._shadow.covers[p]
            if one.stop == one.start:
                continue
            loads, cover = self._shadow.pressed(p)
            if loads.any():
                model = self._coupled.models[p]
                mx, my = self._moments[p] @ pushes[p]
                load = self._normals[p] @ pushes[p, :3]
                centre = np.array([[-my, mx]]) / load
                loads = tilted(model.patch.positions, loads[None], centre)[0]
                pressing = model._pressing(loads, (before[one], cover))
                self._row.held |= self._coupled._press(
                    bristles[None], np.zeros((1, len(self._touching))), (), {p: pressing}
                )  # fmt: skip
                pressed[one] = cover

    def _answer_freely(self) -> None:
        """Take the response of the bodies without contact: none is larger, so that each pass gets closer."""
        np.matmul(self._rows, self._moved, out=self._row.response)
        self._row.load_response.fill(0.0)

    def _answer_as_before(self, answers: np.ndarray) -> None:
        """Take the response of the last step if the same patches touched in it."""
        k = len(self._touching)
        if answers[:k].tolist() == self._touching:
            twists, loads = np.split(answers[k:], [9 * k * k])
            self._row.response[:], self._row.load_response[:] = (
                twists.reshape(3 * k, -1),
                loads.reshape(k, -1),
            )

    def _pressed(self, wrench: np.ndarray) -> np.ndarray:
        """Return values of the patches that touch, and zeros for the others."""
        return (
            wrench
            if all(self._touching)
            else np.where(np.repeat(self._touching, 3), wrench, 0.0)
        )

    def _speed(self, twist: np.ndarray, load: np.ndarray | None = None) -> float:
        """Return the size of changes of twists, and of loads in the speed that they could cause [m/s]."""
        speeds = self._levers * twist
        squares = speeds @ speeds
        if load is not None:
            caused = self._row.response.diagonal()[::3] * load
            squares += caused @ caused
        return math.sqrt(squares)

    def _learn(self, wrench: np.ndarray, twist: np.ndarray, load: np.ndarray) -> None:
        """Correct the responses by changes that came out: of twists symmetrically, of rank one.

        Contacts only stiffen: `A - A_true >= 0`. Where a correction takes all that A has, contacts came or went, or the
        change was too small for Drake's solver.
        """
        response = self._row.response
        load_response = self._row.load_response
        expected = response @ wrench
        off = expected - twist
        along = expected @ wrench
        load_response += np.outer(load - load_response @ wrench, expected / along)
        gap = off @ wrench
        if 1e-9 * along < gap < (1.0 - STIFFEST) * along:
            corrected = response - np.outer(off, off) / gap
            scale = 1.0 / np.sqrt(np.maximum(np.diagonal(response), 1e-300))
            if np.linalg.eigvalsh(scale[:, None] * corrected * scale)[0] > -1e-9:
                response[:] = corrected


class CouplingRow(SimpleNamespace):
    """Arrays of a `coupled.coupling_rows.ContactSolve`, solved in place: a step of Drake has no time for more."""

    def __init__(self, coupled: CoupledPatches, shadow: Shadow) -> None:
        words = coupled._blank_problem(shadow.follows)
        k = len(coupled.models)
        super().__init__(
            **{
                name: words[0, place]
                for name, place in coupled._packed.layout.slices.items()
            }
        )
        self.response = self.response.reshape(3 * k, 3 * k)
        self.load_response = self.load_response.reshape(k, 3 * k)
        self.dt[:] = shadow.dt
        self.held: dict[int, PackedModel] = {}
        """Patches under pressures that are given."""
        self._coupled = coupled
        self._words = words

    def solve(self) -> int:
        """Fill in `new, wrench, twist, load, residual, converged`; the iterations taken."""
        self.wrench[:] = self.guess
        count = int(self._coupled._solve(self._words, self.held)[0])
        if count < 0:
            self._refuse()
        return count

    def _refuse(self) -> None:
        """Let the public step say what is wrong."""
        k = len(self.free_load)
        twist = self.free_twist.reshape(k, 3)
        guess = self.guess.reshape(k, 3)
        moments = self.moments.reshape(k, 2) if self.follows.any() else None
        host = HostStep(
            twist, self.free_load, guess, self.response, self.load_response, moments
        )
        self._coupled.step(self.state, host, self.dt[0])
