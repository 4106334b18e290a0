"""The step of the distributed model and its derivatives, cell by cell (see `steps.StepFunctions`).

A cell sees the velocity `u = B V` of its lever B (see `cells.Lever`); see `bristle_step` for the step of a bristle and
docs/physics.md, "Distributed model".
"""

from __future__ import annotations

from planarfriction.compiler import kernel
from planarfriction.kernels import bristle_step, cells
from planarfriction.kernels.contacts import traction
from planarfriction.kernels.general_cells import Bristle, slopes, slopes_of
from planarfriction.kernels.law import grip, squared
from planarfriction.kernels.steps import step_functions
from planarfriction.kernels.vectors import norm, plus, put, three


@kernel
def _traction(law, new, k, u):
    """Return the traction of a cell at the end of its step, per unit load."""
    return traction(law, new, plus(u, -k, new), u)


@kernel
def cell(law, z, u, dt):
    """Return the new bristle and the traction of a cell that moves at u."""
    speed = norm(u)
    new, k = bristle_step.step(law, z, u, speed, 1.0, grip(law, speed), dt)
    return new, _traction(law, new, k, u)


@kernel
def _step(lever, law, own, z, twist, dt, new, out):
    n, total = own.count, (0.0, 0.0, 0.0)
    for i in range(n):  # apart: in one loop the vectors do not fit into the processor's registers
        u = lever.seen(lever.of(own, i), twist)
        speed = norm(u)
        new[i] = bristle_step.predict(law, (z[i], z[n + i]), u, speed, 1.0, grip(law, speed), dt)[1]
    for i in range(n):
        one, bristle = lever.of(own, i), (z[i], z[n + i])
        u = lever.seen(one, twist)
        speed = norm(u)
        q = grip(law, speed)
        moved, k = bristle_step.finish(law, bristle, u, speed, 1.0, q, dt, norm(bristle) * q, new[i])
        new[i], new[n + i] = moved
        total = plus(total, own.weights[i], lever.wrench(one, _traction(law, moved, k, u)))
    put(out, total)


def step(lever, contact, z, v, dt, new, out):
    """Advance the bristles by `dt` at a held twist (see `formulas.relaxation`), and write the wrench at the end."""
    own = cells.read(contact)
    if own.law.gamma == 2.0:
        _step(lever, squared(own.law), own, z, three(v), dt, new, out)
    else:
        _step(lever, own.law, own, z, three(v), dt, new, out)


TEMPLATES = step, slopes
_MODEL = {"bristle": Bristle(None, cell, None, slopes_of(cell)), "read": cells.read}
ISOTROPIC = step_functions("isotropic", TEMPLATES, lever=cells.POSITIONS, **_MODEL)
TURNED = step_functions("turned", TEMPLATES, lever=cells.LEVERS, **_MODEL)
