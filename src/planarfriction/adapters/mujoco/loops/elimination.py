"""Linear equations of kinematic trees: dense in memory, with their zeros left out.

Degrees of freedom are numbered from the roots to the leaves. Eliminated from the last to the first, the matrices of
trees keep their zeros, and so do those of trees in contact as far as their contacts let them.
"""

from __future__ import annotations

from planarfriction._engine.compiler import kernel


@kernel
def eliminate(a, n):
    """Turn a [n, n] into what `backward` solves with; its symmetric part is positive definite."""
    for k in range(n - 1, -1, -1):
        inverse = 1.0 / a[n * k + k]
        for i in range(k):
            factor = a[n * i + k]
            if factor != 0.0:
                factor *= inverse
                a[n * i + k] = factor
                for j in range(k):
                    if a[n * k + j] != 0.0:
                        a[n * i + j] -= factor * a[n * k + j]


@kernel
def backward(a, n, x, columns):
    """Solve for x [n, columns] in place, with an eliminated matrix."""
    for k in range(n - 1, -1, -1):
        for i in range(k):
            factor = a[n * i + k]
            if factor != 0.0:
                for c in range(columns):
                    x[columns * i + c] -= factor * x[columns * k + c]
    for k in range(n):
        for j in range(k):
            factor = a[n * k + j]
            if factor != 0.0:
                for c in range(columns):
                    x[columns * k + c] -= factor * x[columns * j + c]
        inverse = 1.0 / a[n * k + k]
        for c in range(columns):
            x[columns * k + c] *= inverse


@kernel
def multiply(a, n, x, columns, out):
    """Compute `out = a x`, a [n, n] with zeros, x and out [n, columns]."""
    for i in range(n):
        for c in range(columns):
            out[columns * i + c] = 0.0
        for j in range(n):
            factor = a[n * i + j]
            if factor != 0.0:
                for c in range(columns):
                    out[columns * i + c] += factor * x[columns * j + c]
