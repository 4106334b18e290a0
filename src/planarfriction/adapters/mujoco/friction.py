# pyright: reportAttributeAccessIssue=false
# (MuJoCo describes few of its names to type checkers.)
"""Steps of MuJoCo with patch friction, implicit in contact space."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from planarfriction.adapters.mujoco.patches import Patch, Placed, check_once, words
from planarfriction.adapters.mujoco.responses import responses
from planarfriction.coupling import CoupledPatches, CoupledStep, HostStep
from planarfriction.errors import InvalidValueError

INTEGRATORS = {
    int(mujoco.mjtIntegrator.mjINT_EULER): "Euler",
    int(mujoco.mjtIntegrator.mjINT_IMPLICIT): "implicit",
    int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST): "implicitfast",
}

PASSES = 3
"""How often a step is solved anew where other constraints have become active through it."""

MISFIT = 1e-8
"""Twists that come out [m/s] within which the active constraints have held."""


class Report(NamedTuple):
    """What a step took."""

    iterations: int
    """Newton iterations of all passes."""
    passes: int
    residual: float
    """Of the step in contact space [m/s]."""
    misfit: float
    """Between the twists that were solved for and those that came out [m/s, rad/s]."""
    converged: bool


class Friction:
    """Patch friction for a model that `prepare` has made ready; `step` takes the place of `mj_step`.

    States live in the data, in the last numbers of `userdata`: whoever copies or restores these gets the friction too.
    One object steps any number of data of its model, one at a time.

    Raises `InvalidValueError` for an integrator without a fixed metric, noslip iterations, too little user data, names
    that are not in the model, pairs with friction of their own.
    """

    def __init__(self, m: Any, patches: Sequence[Patch]) -> None:
        check_once(patches)
        self.m, self.patches, self._placed = m, tuple(patches), [Placed(m, patch) for patch in patches]
        if m.opt.integrator not in INTEGRATORS:
            rule = f"be {', '.join(INTEGRATORS.values())}"
            name = mujoco.mjtIntegrator(m.opt.integrator).name.removeprefix("mjINT_")
            raise InvalidValueError("integrator", rule, name)
        if m.opt.noslip_iterations > 0:
            rule = "be 0: they change what has been solved"
            raise InvalidValueError("noslip_iterations", rule, m.opt.noslip_iterations)
        for placed in self._placed:
            placed.check_step(m)
        if m.nuserdata < words(patches):
            raise InvalidValueError("nuserdata", f"be at least {words(patches)} (prepare adds them)", m.nuserdata)
        self.coupled = CoupledPatches([patch.model for patch in patches])
        self._first, self._size = m.nuserdata - words(patches), self.coupled.state_shape[0]
        self.report: Report | None = None
        self.last: CoupledStep | None = None
        """What the last step came to, in the frames of the patches."""
        self._lin = np.zeros((2, 3, m.nv)), np.zeros((2, 3, m.nv))

    # ------------------------------------------------------------------ what the data hold

    def state(self, d: Any) -> np.ndarray:
        """The state of all patches, a view of `userdata`; `coupled.states` gives each its shape."""
        return d.userdata[self._first : self._first + self._size]

    def wrenches(self, d: Any) -> np.ndarray:
        """Of the last step `[k, 3]`, a view of `userdata`: the guess of the next."""
        first = self._first + 2 * self._size
        return d.userdata[first : first + 3 * len(self.patches)].reshape(-1, 3)

    def reset(self, d: Any) -> None:
        """Let all bristles rest."""
        d.userdata[self._first : self._first + words(self.patches)] = 0.0

    # ------------------------------------------------------------------ a step

    def step(self, d: Any) -> None:
        """`mj_step` with friction. `qfrc_applied` is the user's before and after."""
        m, dt, applied = self.m, self.m.opt.timestep, d.qfrc_applied.copy()
        mujoco.mj_step1(m, d)
        jacobian, rows = self._geometry(d)
        wrench = self.wrenches(d).ravel().copy()
        wrench[np.repeat([len(own) == 0 for own in rows], 3)] = 0.0
        state, iterations, passes = self.state(d).copy(), 0, 0
        self._apply(d, applied + wrench @ jacobian)
        while True:
            found = responses(m, d, jacobian, rows)
            free = (jacobian @ found.velocity).reshape(-1, 3)
            host = HostStep(free, _loads(d, rows), wrench.reshape(-1, 3), found.twist_response, found.load_response)
            step = self.coupled.step(state, host, dt)
            wrench, iterations, passes = step.wrench.ravel(), iterations + int(step.iterations), passes + 1
            d.qfrc_applied[:] = applied + wrench @ jacobian
            d.qacc_warmstart[:] = d.qacc
            if passes == PASSES:
                break
            self._apply(d, d.qfrc_applied)
            came_out = (jacobian @ responses(m, d, jacobian, rows).velocity).reshape(-1, 3)
            if abs(came_out - step.twist).max() <= MISFIT:
                break
        mujoco.mj_step2(m, d)
        d.qfrc_applied[:] = applied
        self._advance(d, state, step, jacobian, rows, iterations, passes)

    def _apply(self, d: Any, force: np.ndarray) -> None:
        d.qfrc_applied[:] = force
        mujoco.mj_fwdActuation(self.m, d)
        mujoco.mj_fwdAcceleration(self.m, d)
        mujoco.mj_fwdConstraint(self.m, d)

    def _advance(self, d: Any, state, step: CoupledStep, jacobian, rows, iterations: int, passes: int) -> None:
        """Bristles go on with the twists and loads that came out."""
        dt, twist, loads = self.m.opt.timestep, (jacobian @ d.qvel).reshape(-1, 3), _loads(d, rows)
        new = self.coupled.states(self.state(d))
        for patch, before, after, held, load in zip(
            self.patches, self.coupled.states(state), new, twist, loads, strict=True
        ):
            after[...] = patch.model.step(before, held, float(load), dt)[0]
        self.wrenches(d)[:] = step.wrench
        misfit = float(abs(twist - step.twist).max())
        self.report = Report(iterations, passes, float(step.residual), misfit, bool(step.converged))
        self.last = step

    def _geometry(self, d: Any) -> tuple[np.ndarray, list[np.ndarray]]:
        """Jacobian of the twists `[3k, nv]`, and the constraint rows of each patch; zero and none without contact."""
        jacobian, rows = np.zeros((3 * len(self.patches), self.m.nv)), []
        moves, turns = self._lin
        for p, placed in enumerate(self._placed):
            chosen, sign = placed.contacts(d)
            rows.append(d.contact.efc_address[chosen])
            if len(chosen):
                centre, axes = placed.frame(d, chosen, sign)
                for side, body in enumerate(placed.bodies):
                    mujoco.mj_jac(self.m, d, moves[side], turns[side], centre, body)
                jacobian[3 * p : 3 * p + 2] = axes[:2] @ (moves[1] - moves[0])
                jacobian[3 * p + 2] = axes[2] @ (turns[1] - turns[0])
        return jacobian, rows


def _loads(d: Any, rows: list[np.ndarray]) -> np.ndarray:
    """Normal forces `[k]`."""
    return np.array([max(d.efc_force[own].sum(), 0.0) for own in rows])
