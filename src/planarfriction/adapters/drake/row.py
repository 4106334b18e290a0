"""A problem of coupled patches that is written and solved in place, because a step of Drake has no time for more."""

from __future__ import annotations

import numpy as np

from planarfriction.coupling import ITERATIONS, TOLERANCE, CoupledPatches, HostStep
from planarfriction.kernels.coupling import solve_batch


class CouplingRow:
    """Arguments and results of `CoupledPatches.step`, as views of one row of words."""

    def __init__(self, coupled: CoupledPatches, dt: float) -> None:
        packed, k = coupled._packed, len(coupled.models)
        self._coupled, self._dt, self._packed, n = coupled, dt, packed, 3 * k
        self._words = np.zeros((1, packed.words))
        part = {name: self._words[0, place] for name, place in packed.parts.items()}
        part["dt"][:], part["tolerance"][:], part["most"][:] = dt, TOLERANCE, ITERATIONS
        self._words.view(np.int64)[:, packed.parts["records"]] = packed.records
        part["shares"][:] = packed.shares
        self.state, self.guess, self.free_twist, self.free_load = (
            part[name] for name in ("state", "guess", "free_twist", "free_load")
        )
        self.response, self.load_response = part["response"].reshape(n, n), part["load_response"].reshape(k, n)
        self.new, self.wrench, self.twist, self.load = (part[name] for name in ("new", "wrench", "twist", "load"))
        self._iterations, self.residual, self.converged = (
            part[name] for name in ("iterations", "residual", "converged")
        )

    def solve(self) -> int:
        """Fill in `new, wrench, twist, load, residual, converged`; the iterations taken."""
        self.wrench[:] = self.guess
        if self._packed.following:
            count = int(self._coupled._solve(self._words)[0])
        else:
            solve_batch(self._packed.row, self._words, 0, 1)
            count = int(self._iterations[0])
        if count < 0:
            self._refuse()
        return count

    def _refuse(self) -> None:
        """Let the public step say what is wrong."""
        k = len(self.free_load)
        twist, guess = self.free_twist.reshape(k, 3), self.guess.reshape(k, 3)
        host = HostStep(twist, self.free_load, guess, self.response, self.load_response)
        self._coupled.step(self.state, host, self._dt)
