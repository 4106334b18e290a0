"""A contact of the reduced model as the solver calls it (see `kernels.moments`; equations: `kernels.reduced`).

In scaled coordinates `V_G = F V`, with `g = -(sigma_0 z + sigma_1 z' + sigma_2 V_G)`, the wrench is `F' g`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import types

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.compiler.memory import Floats, reader
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import moments
from planarfriction.kernels.contacts import functions_of
from planarfriction.kernels.reduced import closure, closure_partials, to_origin
from planarfriction.kernels.steady import STILL, evenness, fourth_moments, scaled_twist, steady, steady_slopes
from planarfriction.kernels.vectors import applied_back, dot, norm, plus, put_all, times


class ReducedPatch(NamedTuple):
    """A patch: F, upper triangular, and the share of the other map in its steady sliding."""

    f_00: float
    f_01: float
    f_02: float
    f_11: float
    f_12: float
    f_22: float
    blend: float


class ReducedContact(NamedTuple):
    """A contact of the reduced model."""

    law: LawNumbers
    shape: ReducedPatch
    data: Floats
    """Map of steady sliding (see `kernels.steady`)."""
    other: int
    """Offset of the other map."""


read = reader(ReducedContact)


@kernel
def _maps(own):
    return types.int64(0), own.other


@kernel
def _read(contact):
    return read(contact)


@kernel
def _seen(own, v):
    return scaled_twist(own.shape, v[0], v[1], v[2])


@kernel
def _wrench(own, t):
    return to_origin(own.shape, t[0], t[1], t[2])


@kernel
def _as_it_is(own, z):
    return z


@kernel
def _evenness(own, z):
    return evenness(own.law, fourth_moments(own.shape, _maps(own), own.data), z)


@kernel
def _rate(own, z, u):
    """Return `V_G - beta (lambda z + s m)`; at rest zero."""
    v, rate = norm(u), (0.0, 0.0, 0.0)
    if v > STILL:
        q = steady(own.law, own.shape, _maps(own), own.data, u, v).q
        power, per_q2 = dot(u, q), 1.0 / dot(q, q)
        decay, share = v * v / xp.where(power > 0.0, power, 1.0), dot(z, q) * per_q2
        beta = closure(own.law, math.sqrt(dot(z, z) * per_q2), share, _evenness(own, z)[0])
        rate = plus(u, -beta, plus(times(decay, z), share, plus(u, -decay, q)))
    return rate


@kernel
def _slopes(own, z, u, m):
    """Write the slopes; at rest the rates do not depend on z and follow the twist."""
    v = norm(u)
    if v > STILL:
        _slopes_at(own, z, u, v, m)
    else:
        put_all(m.by_z, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        put_all(m.by_u, (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0))


@kernel
def _slopes_at(own, z, u, v, m):
    j = m.scratch
    q = steady_slopes(own.law, own.shape, _maps(own), own.data, u[0], u[1], u[2], v, j)
    even, even_z = _evenness(own, z)
    per_power, per_q2 = 1.0 / dot(u, q), 1.0 / dot(q, q)
    decay, share, deflection = v * v * per_power, dot(z, q) * per_q2, math.sqrt(dot(z, z) * per_q2)
    per_deflection = 1.0 / deflection if deflection > 0.0 else 0.0
    beta, by_deflection, by_share, by_breakaway = closure_partials(own.law, deflection, share, even)
    across = plus(u, -decay, q)
    g = plus(times(decay, z), share, across)
    # slopes of beta, lambda and s, by z and by V_G
    beta_z = times(per_q2, plus(times(by_deflection * per_deflection, z), by_share, q))
    beta_z = plus(beta_z, own.law.breakaway_ratio * by_breakaway, even_z)
    q_u = times(per_q2, applied_back(j, q))
    decay_u = times(per_power, plus(times(2.0, u), -decay, plus(q, 1.0, applied_back(j, u))))
    share_u = plus(times(per_q2, applied_back(j, z)), -2.0 * share, q_u)
    beta_u = plus(times(by_share, share_u), -by_deflection * deflection, q_u)
    for i in range(3):
        for k in range(3):
            same = 1.0 if i == k else 0.0
            g_k = (z[i] - share * q[i]) * decay_u[k] + across[i] * share_u[k] + share * (same - decay * j[3 * i + k])
            m.by_z[3 * i + k] = -beta * (decay * same + across[i] * q[k] * per_q2) - g[i] * beta_z[k]
            m.by_u[3 * i + k] = same - g[i] * beta_u[k] - beta * g_k


_MODEL = moments.ThreeStates(_read, _seen, _wrench, _seen, _as_it_is, _as_it_is, 0.0, _rate, _slopes)
FUNCTIONS = functions_of("reduced", moments.TEMPLATES, model=_MODEL)
