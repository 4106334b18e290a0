"""Moments of the bristles of a patch: three states, per unit normal load, twists about the contact frame's origin.

In scaled coordinates `V_G = F V` (F upper triangular, `F'F` the patch's second moments of slip, so that `|V_G|` is the
root mean square of the cells' speeds) the state z [3] [m], conjugate to V_G, obeys

    z' = V_G - beta (lambda z + s m),   s = z . z_ss / |z_ss|^2,   lambda = |V_G|^2 / (V_G . z_ss),
    m = V_G - lambda z_ss,   W = -F' (sigma_0 z + sigma_1 z' + sigma_2 V_G)

`shape` is `(F_00, F_01, F_02, F_11, F_12, F_22, blend)`; `surface` is `(start, other)`, where in `data` the map of the
shape begins and, if `blend > 0`, that of the other shape which has this share in the steady state.
"""

from __future__ import annotations

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel


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


@kernel
def closure_partials(law, deflection, share, even):
    """Return `beta` and its partial derivatives with respect to `deflection`, `share` and the breakaway `s_ba even`."""
    per = xp.where(deflection > 0.0, 1.0 / xp.where(deflection > 0.0, deflection, 1.0), 0.0)
    beta, by_deflection, by_cosine, by_breakaway = formulas.slip_share_partials(xp, deflection, share * per, even, law)
    return beta, by_deflection - by_cosine * share * per * per, by_cosine * per, by_breakaway
