"""A contact of n cells, cell by cell, whose bristles follow any law, `z' = f(z, u)` with the traction `t(z, u)`.

A bristle has d components, two of a point or three of a disc; the state of the contact is `z [d, n]`. With `u = B V`
of a cell (see `cells.Lever`) and the derivatives `A = df/dz`, `F = df/du`, `C = dt/dz`, `E = dt/du`, each [d, d],
`D = shift I - A` is inverted cell by cell; `W = sum w B' t`. The functions are described at
`protocol.ModelFunctions` and `protocol.StepFunctions`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction._engine.bristles.law import traction
from planarfriction._engine.cells.cell_blocks import LANES, scratch
from planarfriction._engine.cells.cells import Lever
from planarfriction._engine.codegen.ratios import ratio
from planarfriction._engine.codegen.small_matrices import inverse, inverse_2
from planarfriction._engine.codegen.vectors import (
    Vector,
    copy,
    dot,
    matrix_applied,
    matrix_applied_back,
    matrix_product,
    plus,
    put,
    put_all,
    reader_of,
    scatter,
    three,
    times,
)
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles, Place, arrays_at, at
from planarfriction._engine.protocol import ROWS

MATRICES = 5
"""Matrices [d, d] of a cell in a linearisation: A, F, the inverse of D, C and E; number by number, [5 d d, n]."""

LINEAR = 3
"""Matrices of a cell whose bristle is `Bristle.linear`: A, F and the inverse."""

A = 0
"""Place of the matrix df/dz: slope of the rate by the bristle."""

F = 1
"""Place of the matrix df/du: slope of the rate by the velocity."""

INVERSE = 2
"""Place of the inverse of D."""

C = 3
"""Place of the matrix dt/dz: slope of the traction by the bristle."""

E = 4
"""Place of the matrix dt/du: slope of the traction by the velocity."""

OF_DISCS = 9 * LANES
"""Numbers of the inverses of D of a block of discs."""


class Bristle(NamedTuple):
    """Compiled functions of bristles of d components."""

    size: int
    """d"""
    vector: Any
    """`(row, first, stride)`: return d numbers."""
    matrix: Any
    """`(row, first, stride)`: return d^2 numbers."""
    identity: tuple
    """Identity matrix [d, d], row by row."""
    inverse: Any
    """`(shift, a)`: return the inverse of `shift I - A`."""
    linear: bool
    """True if the traction is `-(sigma_0 z + sigma_1 z' + sigma_2 u)`: C and E then follow from A and F."""


def bristle(size: int, linear: bool) -> Bristle:
    """Return the functions of a bristle of two or three components."""
    identity = tuple(float(i % (size + 1) == 0) for i in range(size * size))
    readers = reader_of(size), reader_of(size * size)
    return Bristle(
        size, *readers, identity, inverse if size == 3 else inverse_2, linear
    )


@kernel
def _matrix(bristle: Bristle, lin: Doubles, which: int, i: int, n: int) -> Vector:
    """Return a matrix of cell i."""
    return bristle.matrix(lin, which * bristle.size * bristle.size * n + i, n)


@kernel
def _factored(
    record: Any,
    shift: float,
    lin: Doubles,
    first: int,
    end: int,
    out: Doubles,
    stride: int,
    lever: Lever,
    bristle: Bristle,
) -> Vector:
    """Invert D of the cells from `first` to `end` into rows of `stride`; return the sums of `factor` over these."""
    total = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    n = record.count
    for i in range(first, end):
        inverse = bristle.inverse(shift, _matrix(bristle, lin, A, i, n))
        scatter(out, i - first, stride, inverse)
        driven = matrix_product(inverse, _matrix(bristle, lin, F, i, n))
        if bristle.linear:
            pull = record.law.sigma_0 + record.law.sigma_1 * shift
            p = plus(times(-pull, driven), -record.law.sigma_2, bristle.identity)
        else:
            p = plus(
                matrix_product(_matrix(bristle, lin, C, i, n), driven),
                1.0,
                _matrix(bristle, lin, E, i, n),
            )
        total = plus(
            total, record.weights[i], lever.around(lever.read(record.cells, i, n), p)
        )
    return total


def factor(
    contact: Place, z: Doubles, shift: float, lin: Doubles, stiffness: Doubles, *, lever: Lever, bristle: Bristle,
    read: Any,
) -> None:  # fmt: skip
    """Invert D, write `sum w B' (C D^-1 F + E) B`."""
    record = read(contact)
    n = record.count
    square = bristle.size * bristle.size
    inverses = at(lin, INVERSE * square * n)
    if bristle.size == 2:
        put_all(
            stiffness,
            _factored(record, shift, lin, 0, n, inverses, n, lever, bristle),
        )
        return
    # Of discs it becomes vector code only if it writes to memory apart from what it reads.
    total = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    block = scratch(OF_DISCS)
    for first in range(0, n, LANES):
        end = xp.minimum(first + LANES, n)
        some = _factored(record, shift, lin, first, end, block, LANES, lever, bristle)
        total = plus(total, 1.0, some)
        for m in range(square):
            copy(at(block, m * LANES), at(inverses, m * n + first), end - first)
    put_all(stiffness, total)


def eliminate(
    contact: Place, z: Doubles, shift: float, r: Doubles, lin: Doubles, w: Doubles, *, lever: Lever, bristle: Bristle,
    read: Any,
) -> None:  # fmt: skip
    """Write `sum w B' C D^-1 r`."""
    record = read(contact)
    total = (0.0, 0.0, 0.0)
    n = record.count
    for i in range(n):
        residual = bristle.vector(r, i, n)
        solved = matrix_applied(_matrix(bristle, lin, INVERSE, i, n), residual)
        if bristle.linear:
            t = plus(
                times(record.law.sigma_1, residual),
                -record.law.sigma_0 - record.law.sigma_1 * shift,
                solved,
            )
        else:
            t = matrix_applied(_matrix(bristle, lin, C, i, n), solved)
        total = plus(
            total, record.weights[i], lever.wrench(lever.read(record.cells, i, n), t)
        )
    put(w, total)


def back_substitute(
    contact: Place, z: Doubles, r: Doubles, dv: Doubles, lin: Doubles, out: Doubles, *, lever: Lever,
    bristle: Bristle, read: Any,
) -> None:  # fmt: skip
    """Solve `D out = r + F B dV`."""
    record = read(contact)
    twist = three(dv)
    n = record.count
    for i in range(n):
        driven = matrix_applied(
            _matrix(bristle, lin, F, i, n),
            lever.seen(lever.read(record.cells, i, n), twist),
        )
        driven = plus(driven, 1.0, bristle.vector(r, i, n))
        scatter(out, i, n, matrix_applied(_matrix(bristle, lin, INVERSE, i, n), driven))


@kernel
def _along(change: Vector, u: Vector, rate: Vector) -> Vector:
    """Return the part of a change of z' that the damping of a pad sees: along u, while its lambda is inside (0, 1)."""
    square = dot(u, u)
    share = ratio(dot(rate, u), square)
    inside = share > 0.0 and share < 1.0
    return times(ratio(dot(change, u), square) if inside else 0.0, u)


def change(
    contact: Place, z: Doubles, zdot: Doubles, lin: Doubles, dz: Doubles, dzdot: Doubles, rows: Doubles,
    friction: float, size: float, *, lever: Lever, bristle: Bristle, read: Any, pad: bool,
) -> None:  # fmt: skip
    """Write the changes of `z'` and of the wrench; bristles and their limits grow with friction."""
    record = read(contact)
    rows = arrays_at(ROWS, rows)
    total = (0.0, 0.0, 0.0)
    n = record.count
    twist = (rows.d_twist[0], rows.d_twist[1], rows.d_twist[2] + size * rows.twist[2])
    for i in range(n):
        cell = lever.read(record.cells, i, n)
        dz_i = bristle.vector(dz, i, n)
        grown = times(friction, bristle.vector(z, i, n))
        u = lever.seen(cell, twist)
        a = plus(dz_i, -1.0, grown)
        by_z = _matrix(bristle, lin, A, i, n)
        rate = plus(
            matrix_applied(by_z, a),
            1.0,
            matrix_applied(_matrix(bristle, lin, F, i, n), u),
        )
        scatter(dzdot, i, n, rate)
        if bristle.linear:
            t = plus(traction(record.law, a, rate, u), -record.law.sigma_0, grown)
        else:  # the traction sees the bristle as it is, and only its rate as that of a smaller one
            slower = matrix_applied(by_z, grown)
            if pad:
                v = lever.seen(cell, three(rows.twist))
                slower = _along(slower, v, bristle.vector(zdot, i, n))
            t = plus(
                matrix_applied(_matrix(bristle, lin, C, i, n), dz_i),
                record.law.sigma_1,
                slower,
            )
            t = plus(t, 1.0, matrix_applied(_matrix(bristle, lin, E, i, n), u))
        total = plus(total, record.weights[i], lever.wrench(cell, t))
    put(rows.d_wrench, plus(total, size * rows.wrench[2], (0.0, 0.0, 1.0)))


def solve_transposed(
    contact: Place,
    z: Doubles,
    r: Doubles,
    lin: Doubles,
    out: Doubles,
    *,
    bristle: Bristle,
    read: Any,
) -> None:
    """Solve `D' out = r`."""
    n = read(contact).count
    for i in range(n):
        scatter(
            out,
            i,
            n,
            matrix_applied_back(
                _matrix(bristle, lin, INVERSE, i, n), bristle.vector(r, i, n)
            ),
        )


def pull_back(
    contact: Place, z: Doubles, lin: Doubles, dzdot: Doubles, rows: Doubles, out: Doubles, *, lever: Lever,
    bristle: Bristle, read: Any,
) -> None:  # fmt: skip
    """Write the transpose of `change`."""
    record = read(contact)
    rows = arrays_at(ROWS, rows)
    total = (0.0, 0.0, 0.0)
    n = record.count
    wrench = three(rows.d_wrench)
    for i in range(n):
        cell = lever.read(record.cells, i, n)
        rate = bristle.vector(dzdot, i, n)
        t = times(record.weights[i], lever.seen(cell, wrench))
        if bristle.linear:
            rate = plus(rate, -record.law.sigma_1, t)
            by_z = times(-record.law.sigma_0, t)
            by_u = times(-record.law.sigma_2, t)
        else:
            by_z = matrix_applied_back(_matrix(bristle, lin, C, i, n), t)
            by_u = matrix_applied_back(_matrix(bristle, lin, E, i, n), t)
        scatter(
            out,
            i,
            n,
            plus(by_z, 1.0, matrix_applied_back(_matrix(bristle, lin, A, i, n), rate)),
        )
        by_u = plus(
            by_u, 1.0, matrix_applied_back(_matrix(bristle, lin, F, i, n), rate)
        )
        total = plus(total, 1.0, lever.wrench(cell, by_u))
    put(rows.d_twist, total)


FUNCTIONS = factor, eliminate, back_substitute, change, solve_transposed, pull_back
