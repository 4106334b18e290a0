"""Moments of the bristles of a patch: three states, per unit normal load, twists about the contact frame's origin.

In scaled coordinates `V_G = F V` (F upper triangular, `F'F` the patch's second moments of slip, so that `|V_G|` is the
root mean square of the cells' speeds) the state z [3] [m], conjugate to V_G, obeys

    z' = V_G - beta (lambda z + s m),   s = z . z_ss / |z_ss|^2,   lambda = |V_G|^2 / (V_G . z_ss),
    m = V_G - lambda z_ss,   W = -F' (sigma_0 z + sigma_1 z' + sigma_2 V_G)

`shape` is `(F_00, F_01, F_02, F_11, F_12, F_22, blend)`; `surface` is `(start, other)`, where in `data` the map of the
shape begins and, if `blend > 0`, that of the other shape which has this share in the steady state.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.kernels import steady
from planarfriction.kernels.rules import rule
from planarfriction.kernels.vectors import dot, plus, square, times


@kernel
def to_origin(shape, gx, gy, gs):
    """Return `F' g`."""
    return shape[0] * gx, shape[1] * gx + shape[3] * gy, shape[2] * gx + shape[4] * gy + shape[5] * gs


# ---------------------------------------------------------------------- the closure


@kernel
def closure(law, deflection, share, even):
    """Return `beta` of a state z: `deflection = |z|/|z_ss|`, `share` = s, `even`: its evenness."""
    cosine = share / xp.where(deflection > 0.0, deflection, 1.0)
    return formulas.slip_share(xp, deflection, cosine, even, law)


class Quartic(NamedTuple):
    """Fourth moments of a shape."""

    rows: tuple
    """Coefficients of `<u^4>` (see `steady.fourth_moments`)."""
    change: tuple
    """Derivatives of the coefficients by the blend of two maps."""
    blend: float


@kernel
def evenness(law, rows, change, blend, z):
    """Return `steady.evenness`, of coefficients `rows` that change with the blend, and its slope by z."""
    return steady.evenness(law, rows, z)


rule(evenness, "sv", {(0, 3): "{t0} * uneven({0}, {1}, {2}, {4})", (0, 4): "{t1}"}, uneven=steady.uneven)


@kernel
def rate(law, quartic, z, u, q):
    """Return `z'` at the scaled twist u that moves, whose steady state is q."""
    per_q2, power = 1.0 / square(q), dot(u, q)
    decay, share = square(u) / xp.where(power > 0.0, power, 1.0), dot(z, q) * per_q2
    even, _ = evenness(law, quartic.rows, quartic.change, quartic.blend, z)
    beta = closure(law, math.sqrt(square(z) * per_q2), share, even)
    return plus(u, -beta, plus(times(decay, z), share, plus(u, -decay, q)))
