"""The step of the distributed model and its derivatives, cell by cell (see `steps.StepFunctions`).

A cell sees the velocity `u = B V` of its lever B (see `cells.Lever`); see `bristle_step` for the step of a bristle and
docs/physics.md, "Distributed model".
"""

from __future__ import annotations

from planarfriction.compiler import kernel
from planarfriction.compiler.memory import at
from planarfriction.kernels import bristle_step, cells
from planarfriction.kernels.cell_blocks import (
    BLOCK,
    LANES,
    WEIGHT,
    Z,
    divided,
    room,
)
from planarfriction.kernels.cell_passes import advance, end_traction
from planarfriction.kernels.general_cells import bristle, slopes
from planarfriction.kernels.law import grip
from planarfriction.kernels.steps import step_functions
from planarfriction.kernels.vectors import norm, plus, put, three


@kernel
def cell(law, z, u, dt):
    """Return the new bristle and the traction of a cell that moves at u."""
    speed = norm(u)
    new, k = bristle_step.step(law, z, u, speed, 1.0, grip(law, speed), dt)
    return new, end_traction(law, new, k, u)


@kernel
def copy(count, of, to):
    """Copy numbers."""
    for i in range(count):
        to[i] = of[i]


@kernel
def fill(lever, size, own, z, first, count, lanes, block):
    """Copy cells into a block, and fill its lanes up with cells without load at the origin."""
    n, numbers = own.count, len(lever.of(own, first))
    for i in range(count, lanes):
        for m in range(numbers):
            block[m * LANES + i] = 0.0
        for m in range(size):
            block[Z + m * LANES + i] = 0.0
        block[WEIGHT + i] = 0.0
    for m in range(size):
        copy(count, at(z, m * n + first), at(block, Z + m * LANES))
    copy(count, at(own.weights, first), at(block, WEIGHT))
    for m in range(numbers):
        copy(count, at(own.cells, m * n + first), at(block, m * LANES))


@kernel
def _empty(size, block, first, count, n, new):
    for m in range(size):
        copy(count, at(block, Z + m * LANES), at(new, m * n + first))


@kernel
def _step(lever, advance, size, law, own, z, twist, dt, new, out):
    n, all_of, block = own.count, (0.0, 0.0, 0.0), room(BLOCK)
    _, lanes = divided(n)
    for first in range(0, n, lanes):
        count = min(lanes, n - first)
        fill(lever, size, own, z, first, count, lanes, block)
        all_of = plus(all_of, 1.0, advance(lever, law, block, 1, lanes, twist, dt))
        _empty(size, block, first, count, n, new)
    put(out, all_of)


def step(lever, advance, size, contact, z, v, dt, new, out):
    """Advance the bristles by `dt` at a held twist (see `formulas.relaxation`), and write the wrench at the end."""
    own = cells.read(contact)
    _step(lever, advance, size, own.law, own, z, three(v), dt, new, out)


TEMPLATES = step, slopes
_MODEL = {"advance": advance, "size": 2, "bristle": bristle(None, cell), "read": cells.read}
ISOTROPIC = step_functions("isotropic", TEMPLATES, lever=cells.POSITIONS, **_MODEL)
TURNED = step_functions("turned", TEMPLATES, lever=cells.LEVERS, **_MODEL)
