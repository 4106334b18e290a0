"""One implicit step of k patches in contact space: the twists, loads and wrenches at its end (docs/embedding.md).

The host says how twists V [3k] and loads N [k] at the end of the step follow the wrenches W [3k] that act during it,
`V = V_0 + A (W - W_0)` and `N = max(N_0 + B (W - W_0), 0)`. With the wrenches `w(V, N)` of the models' steps the
unknown is W alone, and

    s(W) = w(V(W), N(W)) - W = 0,      (I - P A - u B) dW = s,      P = dw/dV,  u = dw/dN

is its Newton step. Where P falls (`V.P V <= 0`) A dW leads downhill in energy, whatever A is: `A dW . s` falls from
`dW.A dW - dV.P dV > 0` to 0 at the next root, so that its sign tells whether a step has gone too far. Where friction
falls as the patch speeds up (Stribeck; a bristle that gives way within the step), rising directions are left out of P.
Where steps that may pass a root then turn in circles, a careful search halves them until they pass none: each lowers
the energy, of which the forces are, but for a small part, the slope, so that they come to rest at one of its minima.

A problem is a row of words (`layout`), so that compiled hosts call `solve` with two addresses.
"""

from __future__ import annotations

import math

import numpy as np

from planarfriction._engine.codegen.small_matrices import leave_out_rising, solved
from planarfriction._engine.codegen.vectors import clear, copy
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel, sequential_entry, sequential_jit
from planarfriction._engine.compiler.calls import call, pointer
from planarfriction._engine.compiler.memory import (
    Doubles,
    Place,
    arrays_at,
    at,
    doubles,
)
from planarfriction._engine.coupled.coupling_rows import (
    INVALID,
    ContactSolve,
    Patches,
    read,
)
from planarfriction._engine.coupled.coupling_steps import (
    step_all,
    step_all_with_slopes,
    write_load_slopes,
)
from planarfriction._engine.coupled.face import hang, unhang
from planarfriction._engine.coupled.following import follow

DOWNHILL = 0.5
"""Largest slope beyond the root along a Newton step at which it may end, as a share of that at its start."""

SHORTENINGS = 6
"""Times at most that a Newton step which went too far is shortened."""

ROUND = 24
"""Iterations of a round. Newton's method moves loads together with wrenches in some and
lets loads follow the wrenches in the rest; a problem in which one of these goes round
in circles is solved by the other."""

JOINT = 8
"""Iterations at the start of a round in which loads move together with the wrenches."""

HALVINGS = 40
"""Times at most that a careful Newton step which passed a root is halved."""

PATIENCE = 10
"""Iterations of a careful search, in those of a search."""

NEAR = 10.0
"""Misfit of the guess, over the tolerance, up to which a Newton step goes from there: rest need not be tried."""

SHARP = 1e-2
"""Share of the least misfit that a step on pads leaves at most where the next may keep its slopes."""

ROUNDING = 1e-13
"""Error of a twist, in the largest speed that goes into it, below which no step gets."""

NOISE = 1e-14
"""Difference of a twist from that which wrenches cause, in the sum of what they add, that is their rounding."""

LIGHTNESS = 1e-3
"""Speed [m/s] for which the whole load of a patch counts if it is wrong: a millionth of it is the usual tolerance."""

PRECISION = 1e-9
"""Error of a twist, in the largest speed that goes into it, with which a step has converged."""


@kernel
def _applied(m: Doubles, i: int, n: int, x: Doubles, start: float) -> float:
    """Return element i of `m x + start`, m of n columns."""
    for j in range(n):
        start += m[n * i + j] * x[j]
    return start


@kernel
def _size(patches: Patches, p: ContactSolve, i: int) -> float:
    """Return the sum of the magnitudes of all that goes into element i of the twists."""
    size = abs(p.twist_0[i])
    for j in range(3 * patches.count):
        size += abs(p.response[3 * patches.count * i + j] * p.wrench[j])
    return size


@kernel
def _load(patches: Patches, p: ContactSolve) -> None:
    """Write the loads that follow from the wrenches."""
    for k in range(patches.count):
        p.load[k] = xp.maximum(
            _applied(p.load_response, k, 3 * patches.count, p.wrench, p.load_0[k]), 0.0
        )


@kernel
def _host(patches: Patches, p: ContactSolve) -> None:
    """Write the twists and loads that follow from the wrenches."""
    n = 3 * patches.count
    for i in range(n):
        p.twist[i] = _applied(p.response, i, n, p.wrench, p.twist_0[i])
    _load(patches, p)


@kernel
def _misfit(patches: Patches, p: ContactSolve) -> float:
    """Return the difference of the twists and loads from those that the models' wrenches there cause [m/s].

    A load counts as the speed that all of it would cause as friction, and where it causes hardly any, by its share.
    """
    n = 3 * patches.count
    w = p.change
    largest = 0.0
    finite = True
    for i in range(n):
        w[i] = p.load[i // 3] * p.unit[i]
    for k in range(patches.count):
        missing = (
            xp.maximum(_applied(p.load_response, k, n, w, p.load_0[k]), 0.0) - p.load[k]
        )
        if missing != 0.0:
            wrong = LIGHTNESS * abs(missing) / (p.load[k] + abs(missing))
            finite = finite and xp.is_finite(wrong)
            largest = xp.maximum(largest, wrong)
        for i in range(3 * k, 3 * k + 3):
            gap = abs(_applied(p.response, i, n, w, p.twist_0[i]) - p.twist[i])
            if i == 3 * k + 2:
                gap *= patches.radius[k]
            else:
                gap = xp.maximum(gap, p.response[n * i + i] * abs(missing))
            finite = finite and xp.is_finite(gap)
            largest = xp.maximum(largest, gap)
    return largest if finite else math.inf


@kernel
def _follows(
    patches: Patches, p: ContactSolve, k: int, keep_loads: bool
) -> tuple[float, float]:
    """Return what the load of patch k lacks of that which the wrenches cause, and 1 if it moves with them, else 0."""
    n = 3 * patches.count
    load = p.load[k]
    lacks = _applied(p.load_response, k, n, p.wrench, p.load_0[k]) - load
    return lacks, 0.0 if keep_loads or (load == 0.0 and lacks < 0.0) else 1.0


@kernel
def _write_residual(
    patches: Patches, p: ContactSolve, k: int, keep_loads: bool
) -> None:
    """Write the right-hand side of the Newton step for patch k into `change`."""
    gap = at(p.gap, 3 * k)
    load = p.load[k]
    lacks, follows = _follows(patches, p, k, keep_loads)
    for i in range(3):
        one = 3 * k + i
        slopes = at(p.slopes, 3 * one)
        p.change[one] = (load + follows * lacks) * p.unit[one] - p.wrench[one]
        p.change[one] += follows * lacks * (p.unit_loaded[one] - p.unit[one])
        p.change[one] += slopes[0] * gap[0] + slopes[1] * gap[1] + slopes[2] * gap[2]


@kernel
def _write_rows(patches: Patches, p: ContactSolve, k: int, keep_loads: bool) -> None:
    """Write the rows of patch k in the system of the Newton step."""
    n = 3 * patches.count
    a = at(p.response, 3 * n * k)
    _, follows = _follows(patches, p, k, keep_loads)
    for i in range(3):
        one = 3 * k + i
        slopes = at(p.slopes, 3 * one)
        for j in range(n):
            caused = slopes[0] * a[j] + slopes[1] * a[n + j] + slopes[2] * a[2 * n + j]
            loaded = follows * p.unit_loaded[one] * p.load_response[n * k + j]
            p.matrix[n * one + j] = (1.0 if j == one else 0.0) - caused - loaded


@kernel
def _solved_on_body(patches: Patches, p: ContactSolve) -> float:
    """Solve the Newton step of patches on a rigid body; return the sign of the determinant of its system.

    With the rows T of the patches and the mobility R of the body `A = T R T'`, so that `dW = s + P T R q` and
    `(I - T' P T R) q = T' s`, three equations for the wrench `q = T' dW` on the body.
    """
    q = p.turned
    m = p.matrix
    clear(q, 3)
    clear(m, 9)
    for i in range(3 * patches.count):
        slopes = at(p.slopes, 3 * i)
        row = at(patches.rows, 3 * i)
        others = at(patches.rows, 9 * (i // 3))
        for j in range(3):
            caused = (
                slopes[0] * others[j]
                + slopes[1] * others[3 + j]
                + slopes[2] * others[6 + j]
            )
            for r in range(3):
                m[3 * r + j] -= row[r] * caused * p.mobility[j]
            q[j] += row[j] * p.change[i]
    for j in range(3):
        m[4 * j] += 1.0
    sign = solved(m, q, 3)
    for j in range(3):
        q[j] *= p.mobility[j]
    for i in range(3 * patches.count):
        slopes = at(p.slopes, 3 * i)
        others = at(patches.rows, 9 * (i // 3))
        for j in range(3):
            p.change[i] += slopes[j] * _applied(others, j, 3, q, 0.0)
    return sign


@kernel
def _newton(patches: Patches, p: ContactSolve, keep_loads: bool, falling: bool) -> bool:
    """Write the Newton step from the wrenches into `change` and `move`; return True if it leads downhill.

    `falling`: without the directions in which slopes rise. Twists and loads need not be those that the wrenches cause:
    what they lack of these goes into the step, but not rounding, which stiff bristles would multiply.
    """
    n = 3 * patches.count
    for i in range(n):
        gap = _applied(p.response, i, n, p.wrench, p.twist_0[i]) - p.twist[i]
        rounded = abs(gap) <= NOISE * abs(p.twist_0[i]) or abs(gap) <= NOISE * _size(
            patches, p, i
        )
        p.gap[i] = 0.0 if rounded else gap
    for k in range(patches.count):
        slopes = at(p.slopes, 9 * k)
        for i in range(9):
            slopes[i] = p.load[k] * p.unit_slopes[9 * k + i]
        if falling:
            leave_out_rising(slopes, at(p.scale, 3 * k), p.turned, at(p.turned, 9))
        _write_residual(patches, p, k, keep_loads)
    if patches.rigid > 0:
        sign = _solved_on_body(patches, p)
    else:
        for k in range(patches.count):
            _write_rows(patches, p, k, keep_loads)
        sign = solved(p.matrix, p.change, n)
    downhill = _downhill(patches, p)
    return sign > 0.0 and downhill > 0.0


@kernel
def _downhill(patches: Patches, p: ContactSolve) -> float:
    """Write `A dW` into `move`; return `A dW . (dW - dV.P dV)` with P as it is, rising directions and all."""
    n = 3 * patches.count
    move = p.move
    downhill = 0.0
    for i in range(n):
        move[i] = _applied(p.response, i, n, p.change, 0.0)
    for i in range(n):
        k = i // 3
        caused = (
            p.unit_slopes[3 * i] * move[3 * k]
            + p.unit_slopes[3 * i + 1] * move[3 * k + 1]
        )
        downhill += move[i] * (
            p.change[i]
            - p.load[k] * (caused + p.unit_slopes[3 * i + 2] * move[3 * k + 2])
        )
    return downhill


@kernel
def _slope(patches: Patches, p: ContactSolve) -> float:
    """Return `A dW . s` at the wrenches."""
    total = 0.0
    for i in range(3 * patches.count):
        total += p.move[i] * (p.load[i // 3] * p.unit[i] - p.wrench[i])
    return total


@kernel
def too_far(first: float, here: float) -> bool:
    """Return True where a slope beyond the root says to go back; one that is not positive at its start says nothing."""
    return first > 0.0 and not here >= -DOWNHILL * first


@kernel
def shortening_of(first: float, here: float) -> float:
    """Return the share of a displacement to try next, from its slope at the start and the negative one at its end."""
    return xp.minimum(xp.maximum(first / (first - here), 0.1), 0.7)


@kernel
def _go(
    patches: Patches, p: ContactSolve, keep_loads: bool, whole: bool, careful: bool
) -> None:
    """Go along the Newton step from the wrenches, and, unless it is to be `whole`, back where it goes too far.

    Twists change by what the step adds, which keeps digits that `V_0 + A W` has lost where patches stick. A `careful`
    step goes too far where it passes a root.
    """
    n = 3 * patches.count
    w = p.wrench
    first = _slope(patches, p)
    far = 1.0
    copy(w, p.start, n)
    for i in range(n):
        p.gap[i] += p.twist[i]
    most = HALVINGS if careful else SHORTENINGS
    for shortening in range(most + 1):
        for i in range(n):
            w[i] = p.start[i] + far * p.change[i]
            p.twist[i] = p.gap[i] + far * p.move[i]
        if not keep_loads:
            _load(patches, p)
        step_all(patches, p)
        here = _slope(patches, p)
        passed = first > 0.0 and not here >= 0.0 if careful else too_far(first, here)
        if whole or not passed or shortening == most:
            break
        far *= 0.5 if careful else shortening_of(first, here)
    if keep_loads:
        _load(patches, p)


@kernel
def _valid(patches: Patches, p: ContactSolve, words: Doubles) -> bool:
    """Return True if all inputs are in range, and none is negative that must not be."""
    valid = p.dt[0] >= 0.0
    for i in range(patches.row.records):
        valid = valid and xp.in_range(words[i])
    for k in range(patches.count):
        valid = valid and p.free_load[k] >= 0.0
    for i in range(3 * patches.count):
        valid = valid and p.response[(3 * patches.count + 1) * i] >= 0.0
    return valid


@kernel
def prepare(patches: Patches, p: ContactSolve) -> float:
    """Write twists and loads without wrenches, and the scale; return the largest speed [m/s] that goes into a twist."""
    n = 3 * patches.count
    a = p.response
    largest = 0.0
    for i in range(n):
        caused = _applied(a, i, n, p.guess, 0.0)
        p.twist_0[i] = p.free_twist[i] - caused
        lever = patches.radius[i // 3] if i % 3 == 2 else 1.0
        largest = xp.maximum(largest, lever * (abs(p.free_twist[i]) + abs(caused)))
        p.scale[i] = math.sqrt(a[n * i + i]) if a[n * i + i] > 0.0 else 1.0
    for k in range(patches.count):
        p.load_0[k] = p.free_load[k] - _applied(p.load_response, k, n, p.guess, 0.0)
    return largest


@kernel
def _largest_speed(patches: Patches, p: ContactSolve) -> float:
    """Write the models' wrenches; return the largest sum of speeds [m/s] that they and the host put into a twist."""
    largest = 0.0
    for i in range(3 * patches.count):
        p.wrench[i] = p.load[i // 3] * p.unit[i]
    for i in range(3 * patches.count):
        lever = patches.radius[i // 3] if i % 3 == 2 else 1.0
        largest = xp.maximum(largest, lever * _size(patches, p, i))
    return largest


@kernel
def _start(
    patches: Patches, p: ContactSolve, tolerance: float, careful: bool
) -> tuple[float, bool]:
    """Step at the best of the twists that the wrenches cause, of rest, and of those that the bristles' wrenches cause.

    The bristles' wrenches, as they are at rest, stand in for a guess. Return the misfit, and True for rest.
    """
    n = 3 * patches.count
    _host(patches, p)
    step_all(patches, p)
    misfit = _misfit(patches, p)
    if misfit > NEAR * tolerance:
        clear(p.twist, n)
        step_all(patches, p)
        at_rest = _misfit(patches, p)
        if at_rest <= misfit:
            return at_rest, True
        guessed = careful
        for i in range(n):
            guessed = guessed or p.wrench[i] != 0.0
        if not guessed:
            for i in range(n):
                p.wrench[i] = p.load[i // 3] * p.unit[i]
            _host(patches, p)
            step_all(patches, p)
            moving = _misfit(patches, p)
            if moving < misfit:
                return moving, False
            clear(p.wrench, n)
        _host(patches, p)
        step_all(patches, p)
    return misfit, False


@kernel
def _copy(
    patches: Patches, twist: Doubles, load: Doubles, to_twist: Doubles, to_load: Doubles
) -> None:
    copy(twist, to_twist, 3 * patches.count)
    copy(load, to_load, patches.count)


@kernel
def restrain(patches: Patches, p: ContactSolve) -> bool:
    """Scale wrenches that did not converge, so that they do no more work than the bristles give.

    Return True if the bristles forget.

    The models' wrenches W at their twists V take at least `-W.V dt` from the bristles; under `s W` the host moves at
    `V_0 + s A W`. If that is more work at s = 1, s is that of the least; if it is still more, the bristles are let go,
    which gives all they hold, and s W does no work then, since none is done at s = 0.
    """
    n = 3 * patches.count
    w = p.wrench
    move = p.move
    work = 0.0
    begin = 0.0
    bends = 0.0
    forget = False
    for i in range(n):
        move[i] = _applied(p.response, i, n, w, 0.0)
        work = work + w[i] * p.twist[i]
        begin = begin + w[i] * p.twist_0[i]
        bends = bends + w[i] * move[i]
    if begin + bends > work:
        s = (
            xp.minimum(xp.maximum(-0.5 * begin / bends, 0.0), 1.0)
            if bends > 0.0
            else 0.0
        )
        forget = s * (begin + s * bends) > work
        for i in range(n):
            w[i] = s * w[i]
            p.twist[i] = p.twist_0[i] + s * move[i]
    return forget


@kernel
def _stick(patches: Patches, p: ContactSolve) -> None:
    """Write the slopes of patches that stick all over; the stiffness of a pad does not grow with its load."""
    for k in range(patches.count):
        per = p.dt[0]
        if patches.pad[k] != 0:
            per = p.dt[0] / p.load[k] if p.load[k] > 0.0 else 0.0
        for i in range(9 * k, 9 * k + 9):
            p.unit_slopes[i] = -per * patches.stuck[i] - patches.viscous[i]


@kernel
def _search(
    patches: Patches, p: ContactSolve, tolerance: float, most: int, careful: bool
) -> tuple[float, bool]:
    """Write the twists and loads of the least misfit; return that, and True if states and wrenches are those there."""
    misfit, rest = _start(patches, p, tolerance, careful)
    best = math.inf
    known = False
    if patches.linear > 0:
        known = rest and not careful
        if known:
            _stick(patches, p)
    for iteration in range(most + 1):
        p.iterations[0] = iteration
        if misfit < best:
            best = misfit
            _copy(patches, p.twist, p.load, p.best_twist, p.best_load)
        if misfit <= tolerance or iteration == most or misfit == math.inf:
            break
        keep_loads = iteration % ROUND >= JOINT
        # Dear: not before they are needed, which at rest they are not.
        if not known:
            step_all_with_slopes(patches, p)
        write_load_slopes(patches, p)
        for falling in range(2):
            if _newton(patches, p, keep_loads, falling > 0):
                break
        _go(patches, p, keep_loads, rest, careful)
        rest = False
        misfit = _misfit(patches, p)
        known = patches.soft > 0 and misfit <= SHARP * best and not careful
    if not misfit <= best:
        _copy(patches, p.best_twist, p.best_load, p.twist, p.load)
    return best, misfit <= best


@kernel
def find(
    patches: Patches, p: ContactSolve, rounding: float, most: int, again: bool
) -> tuple[float, float]:
    """Solve from the wrenches, and `again` where that fails, with care and without them, for a longer time.

    Return the misfit of the twists and loads, whose states and wrenches are written, and that which is accepted.
    """
    tolerance = xp.maximum(p.tolerance[0], rounding * prepare(patches, p))
    accepted = tolerance
    best = math.inf
    current = False
    taken = 0.0
    # One copy of the search in the code: it compiles in two thirds of the time.
    for attempt in range(2):
        if attempt > 0:
            taken = p.iterations[0]
            _copy(patches, p.twist, p.load, p.kept_twist, p.kept_load)
            clear(p.wrench, 3 * patches.count)
        steps = most if attempt == 0 else PATIENCE * most
        misfit, known = _search(patches, p, tolerance, steps, attempt > 0)
        p.iterations[0] += taken
        current = known and misfit <= best
        if misfit <= best:
            best = misfit
        else:
            _copy(patches, p.kept_twist, p.kept_load, p.twist, p.load)
        if attempt == 0 and best > tolerance:
            if not current:
                step_all(patches, p)
            accepted = xp.maximum(tolerance, PRECISION * _largest_speed(patches, p))
            current = True
        if best <= accepted or not again:
            break
    if not current:
        step_all(patches, p)
    return best, accepted


@sequential_entry
def solve(patches_at: Place, problem_at: Place) -> None:
    """Solve the problem of one row; arguments are the addresses of its `Patches` and of that row."""
    patches = read(patches_at)
    p = arrays_at(patches.row, problem_at)
    p.iterations[0] = INVALID
    p.residual[0] = math.inf
    if not _valid(patches, p, doubles(problem_at)):
        return
    follow(patches, p, problem_at)
    again = p.again[0] > 0.0
    hang(patches, p)
    best, accepted = find(patches, p, ROUNDING, np.int64(p.most[0]), again)
    for i in range(3 * patches.count):
        p.wrench[i] = p.load[i // 3] * p.unit[i]
    for k in range(patches.count):
        if p.load[k] == 0.0:  # without load there is no memory
            for i in range(patches.firsts[k], patches.firsts[k + 1]):
                p.new[i] = 0.0
    if best > accepted and again and restrain(patches, p):
        clear(p.new, patches.states)
    unhang(patches, p)
    p.residual[0] = best
    p.converged[0] = 1.0 if best <= accepted else 0.0


@sequential_jit
def solve_batch(words: np.ndarray, problems: np.ndarray, first: int, last: int) -> None:
    """Solve the problems [E, words] from `first` to `last`; `words` are the row of their `Patches`."""
    patches = read(words)
    for e in range(first, last):
        call(
            patches.solve,
            (pointer(words), at(pointer(problems), problems.shape[1] * e)),
        )
