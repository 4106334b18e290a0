"""Response of MuJoCo's step to wrenches on patches, while the set of active constraints holds.

`H = M + Jc' D Jc` over the constraint rows in their quadratic range, and `Jc' C Jc` over elliptic contacts that slide
(C is the Hessian of their cone); `X = H^-1 J'`. The integrator goes on by `v + dt Mh^-1 M qacc` with its own metric Mh:
twists answer with `A = dt J Mh^-1 M X`, loads with `B = -sum D Jc X` over the rows of their contacts.
"""

from __future__ import annotations

from planarfriction._engine.codegen.vectors import copy
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.calls import call_c
from planarfriction._engine.compiler.memory import at, doubles, integers, integers32
from planarfriction.adapters.mujoco.loops.elimination import (
    backward,
    eliminate,
    multiply,
)
from planarfriction.adapters.mujoco.loops.geometry import owners_of, places_of

MISFIT = 3e-9
"""Speed [m/s] by which a constraint may leave its range without a new solution."""


@kernel
def is_sparse(own, m):
    """Return True if the Jacobian of the constraints is sparse."""
    return call_c(own.functions.mj_isSparse, (m,)) & 0xFFFFFFFF != 0


@kernel
def row_of(own, d, sparse, r):
    """Return row r of the constraints' Jacobian: the count of its numbers, and the addresses of numbers and columns."""
    if sparse:
        first = integers32(integers(d + own.data.efc_J_rowadr)[0])[r]
        count = integers32(integers(d + own.data.efc_J_rownnz)[0])[r]
        return (
            count,
            at(integers(d + own.data.efc_J)[0], first),
            integers(d + own.data.efc_J_colind)[0] + 4 * first,
        )
    return own.nv, at(integers(d + own.data.efc_J)[0], own.nv * r), 0


@kernel
def column(columns, i):
    """Return the column of number i of a row."""
    return integers32(columns)[i] if columns != 0 else i


@kernel
def row_times(own, d, sparse, r, x):
    """Return row r of the constraints' Jacobian times a vector."""
    count, numbers, columns = row_of(own, d, sparse, r)
    total = 0.0
    for i in range(count):
        total += doubles(numbers)[i] * x[column(columns, i)]
    return total


@kernel
def _add_rows(own, d, sparse, one, other, factor, h):
    """Add to h the product of two rows of the constraints' Jacobian."""
    count, left, rows = row_of(own, d, sparse, one)
    others, right, columns = row_of(own, d, sparse, other)
    for i in range(count):
        scaled = factor * doubles(left)[i]
        if scaled != 0.0:
            first = own.nv * column(rows, i)
            for j in range(others):
                h[first + column(columns, j)] += scaled * doubles(right)[j]


@kernel
def _update(own, m, d, s, sparse, nefc):
    """Bring states and forces of the constraints, and the Hessians of cones, to the acceleration in the data.

    The solver may leave states behind that are not those of its forces.
    """
    acceleration = doubles(integers(d + own.data.qacc)[0])
    aref = doubles(integers(d + own.data.efc_aref)[0])
    for r in range(nefc):
        s.misses[r] = row_times(own, d, sparse, r, acceleration) - aref[r]
    call_c(own.functions.mj_constraintUpdate, (m, d, s.misses, 0, 1))


@kernel
def _add_cones(own, d, sparse, h):
    """Add the Hessians of elliptic contacts that slide."""
    contacts = integers(d + own.data.contact)[0]
    states = integers32(integers(d + own.data.efc_state)[0])
    for c in range(integers32(d + own.data.ncon)[0]):
        contact = contacts + own.contact.size * c
        row = integers32(contact + own.contact.efc_address)[0]
        dim = integers32(contact + own.contact.dim)[0]
        if row < 0 or states[row] != own.constants.CONE:
            continue
        for i in range(dim):
            for j in range(dim):
                _add_rows(
                    own,
                    d,
                    sparse,
                    row + i,
                    row + j,
                    doubles(contact + own.contact.H)[dim * i + j],
                    h,
                )


@kernel
def _stiff(own, m, d, s, sparse, nefc):
    """Write M, and H."""
    if own.inertia >= 0:
        call_c(own.functions.mj_fullM, (m, s.inertia, integers(d + own.inertia)[0]))
    else:
        call_c(own.functions.mj_fullM, (m, d, s.inertia))
    h = s.stiff
    inertia = s.inertia
    cones = False
    copy(inertia, h, own.nv * own.nv)
    _update(own, m, d, s, sparse, nefc)
    states = integers32(integers(d + own.data.efc_state)[0])
    weights = doubles(integers(d + own.data.efc_D)[0])
    for r in range(nefc):
        if states[r] == own.constants.QUADRATIC:
            _add_rows(own, d, sparse, r, r, weights[r], h)
        cones = cones or states[r] == own.constants.CONE
    if cones:
        _add_cones(own, d, sparse, h)


@kernel
def _has_metric(own, m):
    """Return True if the integrator has another metric than M."""
    integrator = integers32(m + own.model.integrator)[0]
    damping = doubles(integers(m + own.model.dof_damping)[0])
    if integrator != own.constants.EULER:
        return True
    damped = False
    if integers32(m + own.model.disableflags)[0] & own.constants.NO_EULERDAMP == 0:
        for i in range(own.nv):
            damped = damped or damping[i] > 0.0
    return damped


@kernel
def _free_metric(own, m, d, s, metric, dt):
    """Add the derivatives of free bodies, which newer versions turn by all of them, gyroscopic ones too."""
    for f in range(own.free_count):
        joint = integers(own.free_joints)[f]
        first = integers(own.free_dofs)[f]
        if (
            call_c(own.functions.mjd_freeMhat, (m, d, joint, dt, s.block, 0))
            & 0xFFFFFFFF
            != 0
        ):
            for i in range(6):
                for j in range(6):
                    metric[own.nv * (first + i) + first + j] = s.block[6 * i + j]


@kernel
def _metric(own, m, d, s):
    """Write the metric of the integrator in the place of H."""
    nv = own.nv
    metric = s.stiff
    dt = doubles(m + own.model.timestep)[0]
    copy(s.inertia, metric, nv * nv)
    integrator = integers32(m + own.model.integrator)[0]
    if integrator == own.constants.EULER:
        for i in range(nv):
            metric[(nv + 1) * i] += (
                dt * doubles(integers(m + own.model.dof_damping)[0])[i]
            )
        return
    fast = integrator == own.constants.IMPLICITFAST
    call_c(own.functions.mjd_smooth_vel, (m, d, 0 if fast else 1))
    base = m if own.slopes.in_model != 0 else d
    counts = integers32(integers(base + own.slopes.D_rownnz)[0])
    firsts = integers32(integers(base + own.slopes.D_rowadr)[0])
    columns = integers32(integers(base + own.slopes.D_colind)[0])
    slopes = doubles(integers(d + own.data.qDeriv)[0])
    for i in range(nv):
        for c in range(firsts[i], firsts[i] + counts[i]):
            j = columns[c]
            if not fast:
                metric[nv * i + j] -= dt * slopes[c]
            elif j <= i:
                metric[nv * i + j] -= dt * slopes[c]
                if j < i:
                    metric[nv * j + i] -= dt * slopes[c]
    if fast and own.functions.mjd_freeMhat != 0:
        _free_metric(own, m, d, s, metric, dt)


@kernel
def _loads(own, d, sparse, nefc):
    """Write loads, their moments and their responses into the problem."""
    host = own.host
    s = own.scratch
    k = own.host.count
    columns = 3 * own.host.count + 1
    load = own.problem.free_load
    answers = own.problem.load_response
    owners = owners_of(own.scratch, nefc)
    moments = own.problem.moments
    points = places_of(own.scratch, nefc)
    for p in range(k):
        load[p] = 0.0
        moments[2 * p] = 0.0
        moments[2 * p + 1] = 0.0
        for i in range(3 * k):
            answers[3 * k * p + i] = 0.0
    states = integers32(integers(d + host.data.efc_state)[0])
    weights = doubles(integers(d + host.data.efc_D)[0])
    force = doubles(integers(d + host.data.efc_force)[0])
    for r in range(nefc):
        p = owners[r]
        if p < 0:
            continue
        load[p] += force[r]
        moments[2 * p] += points[nefc + r] * force[r]
        moments[2 * p + 1] -= points[r] * force[r]
        if states[r] != host.constants.QUADRATIC:
            continue
        count, numbers, places = row_of(host, d, sparse, r)
        for i in range(count):
            factor = weights[r] * doubles(numbers)[i]
            first = columns * column(places, i)
            if factor != 0.0:
                for c in range(3 * k):
                    answers[3 * k * p + c] -= factor * s.answers[first + c]
    for p in range(k):
        load[p] = xp.maximum(load[p], 0.0)


@kernel
def respond(own, m, d, sparse, nefc):
    """Write twists, loads and their responses, at the accelerations and forces in the data, into the problem."""
    host = own.host
    s = own.scratch
    nv = host.nv
    n = 3 * host.count
    dt = doubles(m + host.model.timestep)[0]
    columns = n + 1
    jacobian = s.jacobian
    answers = s.answers
    _stiff(host, m, d, s, sparse, nefc)
    stiff = s.stiff
    eliminate(stiff, nv)
    for i in range(nv):
        for c in range(n):
            answers[columns * i + c] = jacobian[nv * c + i]
        answers[columns * i + n] = 0.0
    backward(stiff, nv, answers, columns)
    acceleration = doubles(integers(d + host.data.qacc)[0])
    velocity = doubles(integers(d + host.data.qvel)[0])
    for i in range(nv):
        answers[columns * i + n] = acceleration[i]
    held = answers
    if _has_metric(host, m):
        held = s.held
        multiply(s.inertia, nv, answers, columns, held)
        _metric(host, m, d, s)
        eliminate(stiff, nv)
        backward(stiff, nv, held, columns)
    response = own.problem.response
    twist = own.problem.free_twist
    for r in range(n):
        twist[r] = s.drift[r]
        for c in range(n):
            response[n * r + c] = 0.0
        for i in range(nv):
            factor = jacobian[nv * r + i]
            if factor != 0.0:
                twist[r] += factor * (velocity[i] + dt * held[columns * i + n])
                for c in range(n):
                    response[n * r + c] += dt * factor * held[columns * i + c]
    _loads(own, d, sparse, nefc)


@kernel
def leaves_range(own, m, d, s, sparse, nefc):
    """Return True if the acceleration `more` takes a constraint out of its range: the solution does not hold."""
    kinds = integers32(integers(d + own.data.efc_type)[0])
    states = integers32(integers(d + own.data.efc_state)[0])
    inverse = doubles(integers(d + own.data.efc_R)[0])
    more = s.more
    loss = doubles(integers(d + own.data.efc_frictionloss)[0])
    dt = doubles(m + own.model.timestep)[0]
    e = own.constants
    for r in range(nefc):
        change = row_times(own, d, sparse, r, more)
        kind = kinds[r]
        state = states[r]
        if change == 0.0 or kind == e.EQUALITY:
            continue
        if kind == e.ELLIPTIC:
            if dt * abs(change) > MISFIT:
                return True
            continue
        miss = s.misses[r] + change
        beyond = miss
        then = e.QUADRATIC if miss < 0.0 else e.SATISFIED
        if kind == e.FRICTION_DOF or kind == e.FRICTION_TENDON:
            bound = inverse[r] * loss[r]
            then = (
                e.LINEARNEG
                if miss <= -bound
                else (e.LINEARPOS if miss >= bound else e.QUADRATIC)
            )
            beyond = abs(miss) - bound
        if then != state and dt * abs(beyond) > MISFIT:
            return True
    return False
