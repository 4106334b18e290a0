"""Models that the steps of a `Host` serve, and the options that fit them, which users may set at any time."""

from __future__ import annotations

from planarfriction.adapters.mujoco.loops.parameters import are_in_range
from planarfriction.compiler import kernel
from planarfriction.compiler.memory import doubles, integers, integers32

LONGEST = 0.01
"""Longest time step [s] where MuJoCo makes contacts softer for it, and the integrator is implicit."""

DIGEST = 5
"""Numbers of the record of a prepared model in front of the parameters of its patches."""


@kernel
def _alike(own, m, i):
    """Return True if two models share the array of row i of `Host.same`; the last bytes of names count by their map."""
    array, count, size = integers(own.same)[3 * i], integers(own.same)[3 * i + 1], integers(own.same)[3 * i + 2]
    n = integers32(m + count)[0]
    if n != integers32(own.m + count)[0]:
        return False
    if array >= 0:
        one, other = integers32(integers(m + array)[0]), integers32(integers(own.m + array)[0])
        for j in range(n * size // 4):
            if one[j] != other[j]:
                return False
    return True


@kernel
def serves(own, m):
    """Return True for the model itself, and for its copies: those of the same bodies, names and prepared patches."""
    if m == own.m:
        return True
    alike = True
    for i in range(own.same_count):
        alike = alike and _alike(own, m, i)
    if alike:
        one, other = integers(m + own.model.numeric_data)[0], integers(own.m + own.model.numeric_data)[0]
        for i in range(own.parameters - DIGEST, own.parameters):
            alike = alike and doubles(one)[i] == doubles(other)[i]
    return alike


@kernel
def fits(own, m):
    """Return True if the options of a model fit its steps (`Friction` says which do not)."""
    at, e, dt = own.model, own.constants, doubles(m + own.model.timestep)[0]
    integrator = integers32(m + at.integrator)[0]
    implicit = integrator == e.IMPLICIT or integrator == e.IMPLICITFAST
    fit = (implicit or integrator == e.EULER) and integers32(m + at.noslip_iterations)[0] <= 0
    fit = fit and integers32(m + at.enableflags)[0] & e.SLEEP == 0
    softened = implicit and dt <= LONGEST and integers32(m + at.disableflags)[0] & e.NO_REFSAFE == 0
    for p in range(own.count):
        pair = integers(own.pairs)[p]
        constant = doubles(integers(m + at.pair_solref)[0])[2 * pair]
        fit = fit and integers32(integers(m + at.pair_dim)[0])[pair] == 1
        fit = fit and (softened or constant <= 0.0 or dt <= 0.5 * constant)
    return fit and are_in_range(own, m)
