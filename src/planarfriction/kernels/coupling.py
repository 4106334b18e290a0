"""One implicit step of k patches in contact space: the twists, loads and wrenches at its end (docs/embedding.md).

The host says how twists V [3k] and loads N [k] at the end of the step follow the wrenches W [3k] that act during it,
`V = V_0 + A (W - W_0)` and `N = max(N_0 + B (W - W_0), 0)`. With the wrenches `w(V, N)` of the models' steps the
unknown is W alone, and

    s(W) = w(V(W), N(W)) - W = 0,      (I - P A - u B) dW = s,      P = dw/dV,  u = dw/dN

is its Newton step. Where P falls (`V.P V <= 0`) A dW leads downhill in energy, whatever A is: `A dW . s` falls from
`dW.A dW - dV.P dV > 0` to 0 at the next root, so that its sign tells whether a step has gone too far. Where friction
falls as the patch speeds up (Stribeck; a bristle that gives way within the step), rising directions are left out of P.

A problem is a row of words (`layout`), so that compiled hosts call `solve` with two addresses.
"""

from __future__ import annotations

import functools
import math

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import entry, jit, kernel
from planarfriction.compiler.calls import address, address_of, call
from planarfriction.compiler.memory import at, doubles, integers
from planarfriction.kernels.coupling_rows import INVALID, read
from planarfriction.kernels.small_matrices import leave_out_rising, solved

DOWNHILL = 0.5
"""How far beyond the root along a Newton step it may end, as a share of the slope at its start."""

SHORTENINGS = 6
"""How often a Newton step that went too far is shortened."""

JOINT, ROUND = 8, 24
"""Of every ROUND iterations the first JOINT let the loads move with the wrenches, in the others they follow behind:
where both turn against each other, one of the two ways gets on."""

ROUNDING = 1e-13
"""Error of a twist, in the largest speed that goes into it, below which no step gets."""


@kernel
def _applied(m, i, n, x, start):
    """Element i of `m x + start`, m of n columns."""
    for j in range(n):
        start += m[n * i + j] * x[j]
    return start


@kernel
def evaluate(own, problem):
    """Step all pieces at the twists of the row: new state, and wrenches with their slopes per unit load."""
    row = own.row
    unit, slopes = doubles(at(problem, row.unit)), doubles(at(problem, row.unit_slopes))
    dt, step = doubles(at(problem, row.dt))[0], doubles(at(problem, row.step))
    for i in range(3 * own.count):
        unit[i] = 0.0
    for i in range(9 * own.count):
        slopes[i] = 0.0
    for c in range(own.pieces):
        p, first, record = integers(own.owners)[c], integers(own.firsts)[c], integers(at(problem, row.records))[c]
        if record == 0:
            continue
        places = record, at(problem, row.state + first), at(problem, row.twist + 3 * p)
        call(integers(own.functions)[c], (*places, dt, at(problem, row.new + first), at(problem, row.step)))
        share = doubles(at(problem, row.shares))[c]
        for i in range(3):
            unit[3 * p + i] += share * step[i]
        for i in range(9):
            slopes[9 * p + i] += share * step[3 + i]


@kernel
def _host(own, problem, w, held):
    """Twists and, unless they are held, loads of the row as they follow from wrenches w."""
    row, n = own.row, 3 * own.count
    a, b = doubles(at(problem, row.response)), doubles(at(problem, row.load_response))
    twist, load = doubles(at(problem, row.twist)), doubles(at(problem, row.load))
    for i in range(n):
        twist[i] = _applied(a, i, n, w, doubles(at(problem, row.twist_0))[i])
    if not held:
        for p in range(own.count):
            load[p] = xp.maximum(_applied(b, p, n, w, doubles(at(problem, row.load_0))[p]), 0.0)


@kernel
def _misfit(own, problem):
    """How far the twists and loads of the row are from those that the models' wrenches there cause [m/s].

    A load counts as the speed that all of it would cause as friction.
    """
    row, k, n = own.row, own.count, 3 * own.count
    a, b = doubles(at(problem, row.response)), doubles(at(problem, row.load_response))
    twist, load, unit = doubles(at(problem, row.twist)), doubles(at(problem, row.load)), doubles(at(problem, row.unit))
    w, largest, finite = doubles(at(problem, row.change)), 0.0, True
    for i in range(n):
        w[i] = load[i // 3] * unit[i]
    for p in range(k):
        missing = xp.maximum(_applied(b, p, n, w, doubles(at(problem, row.load_0))[p]), 0.0) - load[p]
        for i in range(3 * p, 3 * p + 3):
            gap = abs(_applied(a, i, n, w, doubles(at(problem, row.twist_0))[i]) - twist[i])
            if i == 3 * p + 2:
                gap *= doubles(own.radius)[p]
            else:
                gap = xp.maximum(gap, a[n * i + i] * abs(missing))
            finite = finite and xp.is_finite(gap)
            largest = xp.maximum(largest, gap)
    return largest if finite else math.inf


@kernel
def _newton(own, problem, w, held, falling):
    """The Newton step from wrenches w into `change` and `move` of the row. Whether it leads downhill.

    `falling`: without the directions in which slopes rise. The twists and loads of the row need not be those that w
    causes: what they lack of these goes into the step.
    """
    row, k, n = own.row, own.count, 3 * own.count
    a, b = doubles(at(problem, row.response)), doubles(at(problem, row.load_response))
    twist, load, gap = doubles(at(problem, row.twist)), doubles(at(problem, row.load)), doubles(at(problem, row.gap))
    unit, unit_slopes = doubles(at(problem, row.unit)), doubles(at(problem, row.unit_slopes))
    m, change, move = doubles(at(problem, row.matrix)), doubles(at(problem, row.change)), doubles(at(problem, row.move))
    for i in range(n):
        gap[i] = _applied(a, i, n, w, doubles(at(problem, row.twist_0))[i]) - twist[i]
    for p in range(k):
        slopes = doubles(at(problem, row.slopes + 9 * p))
        for i in range(9):
            slopes[i] = load[p] * unit_slopes[9 * p + i]
        if falling:
            s, q = doubles(at(problem, row.turned)), doubles(at(problem, row.turned + 9))
            leave_out_rising(slopes, doubles(at(problem, row.scale + 3 * p)), s, q)
        lacks = _applied(b, p, n, w, doubles(at(problem, row.load_0))[p]) - load[p]
        follows = 0.0 if held or (load[p] == 0.0 and lacks < 0.0) else 1.0
        for i in range(3):
            one, x, y, s = 3 * p + i, slopes[3 * i], slopes[3 * i + 1], slopes[3 * i + 2]
            change[one] = (load[p] + follows * lacks) * unit[one] - w[one]
            change[one] += x * gap[3 * p] + y * gap[3 * p + 1] + s * gap[3 * p + 2]
            for j in range(n):
                caused = x * a[n * 3 * p + j] + y * a[n * (3 * p + 1) + j] + s * a[n * (3 * p + 2) + j]
                m[n * one + j] = (1.0 if j == one else 0.0) - caused - follows * unit[one] * b[n * p + j]
    sign, downhill = solved(m, change, n), 0.0
    for i in range(n):
        move[i] = _applied(a, i, n, change, 0.0)
    for i in range(n):
        p = i // 3
        caused = unit_slopes[3 * i] * move[3 * p] + unit_slopes[3 * i + 1] * move[3 * p + 1]
        downhill += move[i] * (change[i] - load[p] * (caused + unit_slopes[3 * i + 2] * move[3 * p + 2]))
    return sign > 0.0 and downhill > 0.0


@kernel
def _slope(own, problem, w):
    """`A dW . s` at wrenches w."""
    row, total = own.row, 0.0
    load, unit, move = doubles(at(problem, row.load)), doubles(at(problem, row.unit)), doubles(at(problem, row.move))
    for i in range(3 * own.count):
        total += move[i] * (load[i // 3] * unit[i] - w[i])
    return total


@kernel
def _go(own, problem, w, held, whole):
    """Go along the Newton step from wrenches w, and, unless it is to be `whole`, back where it goes too far."""
    row, n = own.row, 3 * own.count
    start, change = doubles(at(problem, row.start)), doubles(at(problem, row.change))
    first, far = _slope(own, problem, w), 1.0
    for i in range(n):
        start[i] = w[i]
    for shortening in range(SHORTENINGS + 1):
        for i in range(n):
            w[i] = start[i] + far * change[i]
        _host(own, problem, w, held)
        evaluate(own, problem)
        here = _slope(own, problem, w)
        if whole or here >= -DOWNHILL * first or not first > 0.0 or shortening == SHORTENINGS:
            break
        far *= xp.minimum(xp.maximum(first / (first - here), 0.1), 0.7)
    if held:
        _host(own, problem, w, False)


@kernel
def _valid(own, problem):
    """Whether all inputs are in range, and none is negative that must not be."""
    row, given = own.row, doubles(problem)
    valid = given[row.dt] >= 0.0
    for i in range(row.records):
        valid = valid and xp.in_range(given[i])
    for p in range(own.count):
        valid = valid and given[row.free_load + p] >= 0.0
    for i in range(3 * own.count):
        valid = valid and given[row.response + (3 * own.count + 1) * i] >= 0.0
    return valid


@kernel
def _prepare(own, problem):
    """Twists and loads without wrenches, and the scale. The largest speed [m/s] that goes into a twist."""
    row, n, largest = own.row, 3 * own.count, 0.0
    a, b, guess = doubles(at(problem, row.response)), doubles(at(problem, row.load_response)), at(problem, row.guess)
    twist_0, load_0, scale = at(problem, row.twist_0), at(problem, row.load_0), doubles(at(problem, row.scale))
    for i in range(n):
        free = doubles(at(problem, row.free_twist))[i]
        caused = _applied(a, i, n, doubles(guess), 0.0)
        doubles(twist_0)[i] = free - caused
        lever = doubles(own.radius)[i // 3] if i % 3 == 2 else 1.0
        largest = xp.maximum(largest, lever * (abs(free) + abs(caused)))
        scale[i] = math.sqrt(a[n * i + i]) if a[n * i + i] > 0.0 else 1.0
    for p in range(own.count):
        doubles(load_0)[p] = doubles(at(problem, row.free_load))[p] - _applied(b, p, n, doubles(guess), 0.0)
    return largest


@kernel
def _start(own, problem, w, tolerance):
    """Evaluate the better of the twists that wrenches w cause and of rest. The misfit, and whether it is rest."""
    row, n = own.row, 3 * own.count
    _host(own, problem, w, False)
    evaluate(own, problem)
    misfit = _misfit(own, problem)
    if misfit > tolerance:
        twist = doubles(at(problem, row.twist))
        for i in range(n):
            twist[i] = 0.0
        evaluate(own, problem)
        at_rest = _misfit(own, problem)
        if at_rest <= misfit:
            return at_rest, True
        _host(own, problem, w, False)
        evaluate(own, problem)
    return misfit, False


@entry
def solve(patches, problem):
    """Solve the problem of one row, whose address comes in; `patches` is that of its `Patches`."""
    own = read(patches)
    row, k, n, given, w = own.row, own.count, 3 * own.count, doubles(problem), doubles(at(problem, own.row.wrench))
    given[row.iterations], given[row.residual] = INVALID, math.inf
    if not _valid(own, problem):
        return
    tolerance = xp.maximum(given[row.tolerance], ROUNDING * _prepare(own, problem))
    misfit, rest = _start(own, problem, w, tolerance)
    best, iterations = math.inf, 0
    while True:
        if misfit < best:
            best = misfit
            for i in range(n):
                given[row.best_twist + i] = given[row.twist + i]
            for p in range(k):
                given[row.best_load + p] = given[row.load + p]
        if misfit <= tolerance or iterations >= given[row.most] or misfit == math.inf:
            break
        held = iterations % ROUND >= JOINT
        if not _newton(own, problem, w, held, False):
            _newton(own, problem, w, held, True)
        _go(own, problem, w, held, rest)
        iterations, rest = iterations + 1, False
        misfit = _misfit(own, problem)
    if not misfit <= best:
        for i in range(n):
            given[row.twist + i] = given[row.best_twist + i]
        for p in range(k):
            given[row.load + p] = given[row.best_load + p]
        evaluate(own, problem)
    for i in range(n):
        w[i] = given[row.load + i // 3] * given[row.unit + i]
    _forget_unloaded(own, problem)
    given[row.iterations], given[row.residual], given[row.converged] = (
        iterations,
        best,
        1.0 if best <= tolerance else 0.0,
    )


@kernel
def _forget_unloaded(own, problem):
    """A patch without load keeps no memory."""
    row, states = own.row, doubles(at(problem, own.row.new))
    for c in range(own.pieces):
        last = integers(own.firsts)[c + 1] if c + 1 < own.pieces else own.states
        if doubles(at(problem, row.load))[integers(own.owners)[c]] == 0.0:
            for i in range(integers(own.firsts)[c], last):
                states[i] = 0.0


@functools.cache
def solve_address() -> int:
    """Where `solve` is in this process."""
    return address_of(solve, "pp")


@jit
def solve_batch(patches, problems, first, last):
    """Solve the problems [E, words] from `first` to `last`; `patches` is the row of their `Patches`."""
    own = read(patches)
    for e in range(first, last):
        call(own.solve, (address(patches, 0), address(problems, problems.shape[1] * e)))
