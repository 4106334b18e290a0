"""A contact of the reduced model as the solver calls it (see `kernels.moments`; equations: `kernels.reduced`).

In scaled coordinates `V_G = F V`, with `g = -(sigma_0 z + sigma_1 z' + sigma_2 V_G)`, the wrench is `F' g`.
"""

from __future__ import annotations

from typing import NamedTuple

from numba import types

from planarfriction.compiler import kernel
from planarfriction.compiler.memory import Floats, at, reader
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import moments
from planarfriction.kernels.contacts import functions_of
from planarfriction.kernels.derive import derive
from planarfriction.kernels.reduced import Quartic, rate, to_origin
from planarfriction.kernels.steady import STILL, fourth_moments, scaled_twist, steady
from planarfriction.kernels.vectors import applied_back, norm, plus, put, put_all


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
def _quartic(own):
    rows = fourth_moments(own.shape, _maps(own), own.data)
    return Quartic(rows, rows, 0.0)


@kernel
def _rate(own, z, u):
    """Return the rate of the state; at rest zero."""
    v, found = norm(u), (0.0, 0.0, 0.0)
    if v > STILL:
        found = rate(own.law, _quartic(own), z, u, steady(own.law, own.shape, _maps(own), own.data, u, v).q)
    return found


_SLOPES = derive(rate, ("z", "u", "q"), ("z", "u", "q"))
_forth, _back = _SLOPES.forth, _SLOPES.back


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
    found = steady(own.law, own.shape, _maps(own), own.data, u, v)
    _, tape = _forth(own.law, _quartic(own), z, u, found.q)
    for i in range(3):
        unit = (1.0 if i == 0 else 0.0), (1.0 if i == 1 else 0.0), (1.0 if i == 2 else 0.0)
        by_z, by_u, by_q = _back(tape, (unit,))
        put(at(m.by_z, 3 * i), by_z)
        put(at(m.by_u, 3 * i), plus(by_u, 1.0, applied_back(found.by_u, by_q)))


_MODEL = moments.ThreeStates(_read, _seen, _wrench, _seen, _as_it_is, _as_it_is, 0.0, _rate, _slopes)
FUNCTIONS = functions_of("reduced", moments.TEMPLATES, model=_MODEL)
