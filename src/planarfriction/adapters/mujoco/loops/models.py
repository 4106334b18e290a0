"""Models that the steps of a `Host` serve; what users may set in them at any time: options, and parameters of patches.

Parameters stand in a custom numeric, which copies of a model may change. Size and displacement act where twists and
wrenches come in and go out. With the spin's row of the Jacobian times the size, the step in contact space sees the
patch in the model's own size: twists `(v, scale omega)`, torques over scale.
"""

from __future__ import annotations

from planarfriction._engine.codegen.vectors import copy
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import at, doubles, integers, integers32
from planarfriction.formulas import PARAMETERS, LawNumbers

LONGEST = 0.01
"""Longest time step [s] where MuJoCo makes contacts softer for it, and the integrator is implicit."""

DIGEST = 5
"""Numbers of the record of a prepared model in front of the parameters of its patches."""

COUNT = len(PARAMETERS)

_PLACES = tuple(
    LawNumbers._fields.index(name) for name in PARAMETERS if name in LawNumbers._fields
)
STIFF = 2
"""Sort of a patch (see `Host.laws`) on a pad with a stiffness of its own: sigma_0 of its record belongs to that."""

HANGS = 3
"""Sort of one on a pad with a common compliance as well, whose sigma_1 is 0."""

_SIGMA_0 = PARAMETERS.index("sigma_0")
_SIGMA_1 = PARAMETERS.index("sigma_1")
_SIGMA_2 = PARAMETERS.index("sigma_2")
_MU_C = PARAMETERS.index("mu_c")
_MU_S = PARAMETERS.index("mu_s")
_V_S = PARAMETERS.index("v_s")
_RATIO = PARAMETERS.index("breakaway_ratio")
_SCALE = PARAMETERS.index("scale")
_X = PARAMETERS.index("centre_x")
_Y = PARAMETERS.index("centre_y")


@kernel
def parameters_of(own, m, p):
    """Return the parameters of patch p in a model, in the order of `PARAMETERS`."""
    return at(
        doubles(integers(m + own.model.numeric_data)[0]), own.parameters + COUNT * p
    )


@kernel
def are_in_range(own, m):
    """Return True if the parameters of all patches follow their rules (`environments.RULES`)."""
    valid = True
    for p in range(own.count):
        q = parameters_of(own, m, p)
        for i in range(COUNT):
            valid = valid and xp.in_range(q[i])
        valid = (
            valid and q[_SIGMA_0] > 0.0 and q[_SIGMA_1] >= 0.0 and q[_SIGMA_2] >= 0.0
        )
        valid = valid and q[_MU_C] > 0.0 and q[_MU_S] >= q[_MU_C] and q[_V_S] > 0.0
        valid = valid and (q[_SIGMA_1] == 0.0 or integers(own.laws)[p] != HANGS)
        valid = valid and q[_RATIO] >= 0.0 and q[_RATIO] < 1.0 and q[_SCALE] > 0.0
    return valid


@kernel
def scale_of(own, m, p):
    """Return the size of patch p in a model, as a multiple of that of its friction model."""
    return parameters_of(own, m, p)[_SCALE]


@kernel
def displacement_of(own, m, p):
    """Return the displacement of patch p in a model along its axes [m]."""
    q = parameters_of(own, m, p)
    return q[_X], q[_Y]


@kernel
def write_laws(own, m, patches, problem, place):
    """Let the patches act with the laws of the model, in copies of their records behind the address `place`."""
    for p in range(patches.count):
        if integers(own.laws)[p] == 0:
            continue
        words = integers(own.record_words)[p]
        record = integers(problem.records[p])
        copied = integers(place)
        copy(record, copied, words)
        law = doubles(place)
        q = parameters_of(own, m, p)
        for i in range(len(_PLACES)):
            if i != _SIGMA_0 or integers(own.laws)[p] < STIFF:
                law[_PLACES[i]] = q[i]
        problem.records[p] = place
        place = at(place, words)


@kernel
def _alike(own, m, i):
    """Return True if two models share the array of row i of `Host.same`; the last bytes of names count by their map."""
    array = integers(own.same)[3 * i]
    count = integers(own.same)[3 * i + 1]
    size = integers(own.same)[3 * i + 2]
    n = integers32(m + count)[0]
    if n != integers32(own.m + count)[0]:
        return False
    if array >= 0:
        one = integers32(integers(m + array)[0])
        other = integers32(integers(own.m + array)[0])
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
        one = integers(m + own.model.numeric_data)[0]
        other = integers(own.m + own.model.numeric_data)[0]
        for i in range(own.parameters - DIGEST, own.parameters):
            alike = alike and doubles(one)[i] == doubles(other)[i]
    return alike


@kernel
def fits(own, m):
    """Return True if the options of a model fit its steps (`Friction` says which do not)."""
    offsets = own.model
    e = own.constants
    dt = doubles(m + own.model.timestep)[0]
    integrator = integers32(m + offsets.integrator)[0]
    implicit = integrator == e.IMPLICIT or integrator == e.IMPLICITFAST
    fit = (implicit or integrator == e.EULER) and integers32(
        m + offsets.noslip_iterations
    )[0] <= 0
    fit = fit and integers32(m + offsets.enableflags)[0] & e.SLEEP == 0
    softened = (
        implicit
        and dt <= LONGEST
        and integers32(m + offsets.disableflags)[0] & e.NO_REFSAFE == 0
    )
    for p in range(own.count):
        pair = integers(own.pair)[p]
        constant = doubles(integers(m + offsets.pair_solref)[0])[2 * pair]
        fit = fit and integers32(integers(m + offsets.pair_dim)[0])[pair] == 1
        fit = fit and (softened or constant <= 0.0 or dt <= 0.5 * constant)
    return fit and are_in_range(own, m)
