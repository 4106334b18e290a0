"""Steps of all patches at the twists and loads of a problem in contact space."""

from __future__ import annotations

from planarfriction._engine.codegen.vectors import clear, copy
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.calls import call
from planarfriction._engine.compiler.memory import Doubles, Integers, at
from planarfriction._engine.coupled.coupling_rows import ContactSolve, Patches

LOAD_STEP = 1e-6
"""Share of a load over which wrenches of a pad are compared for their slope."""


@kernel
def _bring_back(step: Doubles, dx: float, dy: float) -> None:
    """Bring the wrench of a shifted patch, and its slopes, to the twist and the wrench about the origin."""
    for i in range(3):  # slopes by the spin: it moves the patch
        row = at(step, 3 + 3 * i)
        row[2] += dx * row[1] - dy * row[0]
    step[2] += dx * step[1] - dy * step[0]
    for j in range(3):
        step[9 + j] += dx * step[6 + j] - dy * step[3 + j]


@kernel
def step_patch(
    patches: Patches, p: ContactSolve, functions: Integers, k: int, load: float
) -> None:
    """Step patch k under a load, at the twist that it sees."""
    p.seen[3] = load
    first = patches.firsts[k]
    bristles = at(p.state, first), p.seen, p.dt[0], at(p.new, first)
    call(functions[k], (p.acting[k], *bristles, p.step))


@kernel
def _yields(patches: Patches, p: ContactSolve, k: int) -> bool:
    """Return True if the load of patch k depends on any wrench."""
    n = 3 * patches.count
    yields = False
    for j in range(n):
        yields = yields or p.load_response[n * k + j] != 0.0
    return yields


@kernel
def write_load_slopes(patches: Patches, p: ContactSolve) -> None:
    """Write the slopes of the wrenches by the loads; of a pad, by a step under another load."""
    for k in range(patches.count):
        one = 3 * k
        load = p.load[k]
        for i in range(3):
            p.unit_loaded[one + i] = p.unit[one + i]
        if (
            patches.pad[k] != 0
            and p.acting[k] != 0
            and load > 0.0
            and _yields(patches, p, k)
        ):
            copy(at(p.twist, one), p.seen, 3)
            step_patch(patches, p, patches.steps, k, (1.0 + LOAD_STEP) * load)
            for i in range(3):
                p.unit_loaded[one + i] += (p.step[i] - p.unit[one + i]) / LOAD_STEP


@kernel
def _step_acting(
    patches: Patches, p: ContactSolve, functions: Integers, k: int
) -> None:
    """Step patch k at the twist of a problem: write the new state and the wrench per unit load."""
    seen = p.seen
    dx = p.shift[2 * k]
    dy = p.shift[2 * k + 1]
    spin = p.twist[3 * k + 2]
    if p.acting[k] == 0:
        clear(p.step, 12)
    else:
        seen[0] = p.twist[3 * k] - spin * dy
        seen[1] = p.twist[3 * k + 1] + spin * dx
        seen[2] = spin
        step_patch(patches, p, functions, k, p.load[k])
        if dx != 0.0 or dy != 0.0:
            _bring_back(p.step, dx, dy)
    for i in range(3):
        p.unit[3 * k + i] = p.step[i]


@kernel
def step_all(patches: Patches, p: ContactSolve) -> None:
    """Step all patches at the twists of a problem: write the new state and wrenches per unit load."""
    for k in range(patches.count):
        _step_acting(patches, p, patches.steps, k)


@kernel
def step_all_with_slopes(patches: Patches, p: ContactSolve) -> None:
    """Step all patches and write the slopes of the wrenches by the twists as well."""
    for k in range(patches.count):
        _step_acting(patches, p, patches.slopes, k)
        for i in range(9):
            p.unit_slopes[9 * k + i] = p.step[3 + i]
