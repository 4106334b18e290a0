"""Parameters of patches, read from the model that steps: in a custom numeric, which copies of a model may change.

Size and displacement act where twists and wrenches come in and go out. With the spin's row of the Jacobian times the
size, the step in contact space sees the patch in the model's own size: twists `(v, scale omega)`, torques over scale.
"""

from __future__ import annotations

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.compiler.memory import at, doubles, integers
from planarfriction.formulas import PARAMETERS, LawNumbers
from planarfriction.kernels.vectors import copy

COUNT = len(PARAMETERS)

_PLACES = tuple(LawNumbers._fields.index(name) for name in PARAMETERS if name in LawNumbers._fields)
_SIGMA_0, _SIGMA_1, _SIGMA_2, _MU_C, _MU_S, _V_S, _RATIO, _SCALE, _X, _Y = range(COUNT)


@kernel
def parameters_of(own, m, p):
    """Return the parameters of patch p in a model, in the order of `PARAMETERS`."""
    return at(doubles(integers(m + own.model.numeric_data)[0]), own.parameters + COUNT * p)


@kernel
def are_in_range(own, m):
    """Return True if the parameters of all patches follow their rules (`environments.RULES`)."""
    valid = True
    for p in range(own.count):
        q = parameters_of(own, m, p)
        for i in range(COUNT):
            valid = valid and xp.in_range(q[i])
        valid = valid and q[_SIGMA_0] > 0.0 and q[_SIGMA_1] >= 0.0 and q[_SIGMA_2] >= 0.0
        valid = valid and q[_MU_C] > 0.0 and q[_MU_S] >= q[_MU_C] and q[_V_S] > 0.0
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
        words, record, copied = integers(own.record_words)[p], integers(problem.records[p]), integers(place)
        copy(record, copied, words)
        law, q = doubles(place), parameters_of(own, m, p)
        for i in range(len(_PLACES)):
            law[_PLACES[i]] = q[i]
        problem.records[p] = place
        place = at(place, words)
