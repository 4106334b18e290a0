"""Small matrices, row by row in memory."""

from __future__ import annotations

import math
from typing import Any

from planarfriction._engine.codegen.vectors import Vector, times
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles

SWEEPS = 5
"""Sweeps of Jacobi rotations over a matrix [3, 3], which converge with their square from the second or third on."""


@kernel
def applied(m: Doubles, a: Any) -> Vector:
    """Return `M a` of a matrix [3, 3] in memory."""
    return (
        m[0] * a[0] + m[1] * a[1] + m[2] * a[2],
        m[3] * a[0] + m[4] * a[1] + m[5] * a[2],
        m[6] * a[0] + m[7] * a[1] + m[8] * a[2],
    )


@kernel
def inverse(shift: float, m: Doubles) -> Vector:
    """Return `(shift I - M)^-1` of a matrix [3, 3] in memory, nine numbers."""
    a = shift - m[0]
    b = -m[1]
    c = -m[2]
    d = -m[3]
    e = shift - m[4]
    f = -m[5]
    g = -m[6]
    h = -m[7]
    i = shift - m[8]
    r = e * i - f * h
    p = f * g - d * i
    w = d * h - e * g
    cofactors = (
        r,
        c * h - b * i,
        b * f - c * e,
        p,
        a * i - c * g,
        c * d - a * f,
        w,
        b * g - a * h,
        a * e - b * d,
    )
    return times(1.0 / (a * r + b * p + c * w), cofactors)


@kernel
def inverse_2(shift: float, m: Vector) -> Vector:
    """Return `(shift I - M)^-1` of a matrix [2, 2]."""
    a = shift - m[0]
    b = -m[1]
    c = -m[2]
    d = shift - m[3]
    per = 1.0 / (a * d - b * c)
    return per * d, -per * b, -per * c, per * a


@kernel
def _rotate(s: Doubles, q: Doubles, i: int, j: int) -> None:
    """Rotate the symmetric matrix s [3, 3], so that `s_ij = 0`; its axes are the columns of q."""
    off = s[3 * i + j]
    half = 0.5 * (s[4 * j] - s[4 * i]) / (off if off != 0.0 else 1.0)
    tangent = (1.0 if half >= 0.0 else -1.0) / (
        abs(half) + math.sqrt(half * half + 1.0)
    )
    tangent = tangent if off != 0.0 else 0.0
    cosine = 1.0 / math.sqrt(tangent * tangent + 1.0)
    sine = tangent * cosine
    for m in range(3):
        one = s[3 * m + i]
        other = s[3 * m + j]
        s[3 * m + i] = cosine * one - sine * other
        s[3 * m + j] = sine * one + cosine * other
        one = q[3 * m + i]
        other = q[3 * m + j]
        q[3 * m + i] = cosine * one - sine * other
        q[3 * m + j] = sine * one + cosine * other
    for m in range(3):
        one = s[3 * i + m]
        other = s[3 * j + m]
        s[3 * i + m] = cosine * one - sine * other
        s[3 * j + m] = sine * one + cosine * other


@kernel
def leave_out_rising(p: Doubles, scale: Doubles, s: Doubles, q: Doubles) -> None:
    """Take out of the slopes p [3, 3] the directions in which they rise; `scale` are twists of unit energy."""
    for i in range(3):
        for j in range(3):
            s[3 * i + j] = 0.5 * (p[3 * i + j] + p[3 * j + i]) * scale[i] * scale[j]
            q[3 * i + j] = 1.0 if i == j else 0.0
    for turn in range(3 * SWEEPS):
        _rotate(s, q, 1 if turn % 3 == 2 else 0, 1 if turn % 3 == 0 else 2)
    for m in range(3):
        rise = xp.maximum(s[4 * m], 0.0)
        for i in range(3):
            for j in range(3):
                p[3 * i + j] -= (
                    rise * q[3 * i + m] * q[3 * j + m] / (scale[i] * scale[j])
                )


@kernel
def solved(m: Doubles, x: Doubles, n: int) -> float:
    """Solve `m x' = x` in place, by elimination with pivots; return the sign of the determinant.

    m [n, n] is lost. Where it is singular, the numbers that it does not determine are 0.
    """
    sign = 1.0
    for c in range(n):
        pivot = c
        for r in range(c + 1, n):
            if abs(m[n * r + c]) > abs(m[n * pivot + c]):
                pivot = r
        if pivot != c:
            sign = -sign
            for j in range(c, n):
                m[n * c + j], m[n * pivot + j] = m[n * pivot + j], m[n * c + j]
            x[c], x[pivot] = x[pivot], x[c]
        if m[n * c + c] < 0.0:
            sign = -sign
        per = 1.0 / m[n * c + c] if m[n * c + c] != 0.0 else 0.0
        m[n * c + c] = per
        for r in range(c + 1, n):
            part = m[n * r + c] * per
            for j in range(c + 1, n):
                m[n * r + j] -= part * m[n * c + j]
            x[r] -= part * x[c]
    for c in range(n - 1, -1, -1):
        for j in range(c + 1, n):
            x[c] -= m[n * c + j] * x[j]
        x[c] *= m[n * c + c]
    return sign
