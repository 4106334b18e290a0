"""Fit of a convex homogeneous quartic: least squares with a certificate of convexity."""

from __future__ import annotations

import functools
import itertools
from typing import Any

import numpy as np

from planarfriction.errors import FrictionError, MissingExtraError

POWERS = np.array([powers for powers in itertools.product(range(4, -1, -1), repeat=3) if sum(powers) == 4])
"""Powers of `fx, fy, tau/r` in the 15 monomials, `[15, 3]`: x^4, x^3 y, x^3 z, x^2 y^2, ..."""

MARGIN = 1e-4
"""Least eigenvalue of the certificate, `H'' >= 1e-4 |x|^2`: no facets, no corners (the unit sphere's is 4)."""

ELLIPSOID = np.zeros(15)
"""Coefficients of `(x^2 + y^2 + z^2)^2`."""
for _row, _powers in enumerate(POWERS):
    ELLIPSOID[_row] = {4: 1.0, 2: 2.0}.get(_powers.max(), 0.0) if (_powers % 2 == 0).all() else 0.0


_TENSORS = np.zeros((15, 3, 3, 3, 3))
"""Symmetric tensors T of the monomials: `T x x x x`, gradients `4 T x x x`, second derivatives `12 T x x`."""
for _index in itertools.product(range(3), repeat=4):
    _TENSORS[(np.bincount(_index, minlength=3) == POWERS).all(axis=1), *_index] = 1.0
_TENSORS /= _TENSORS.sum(axis=(1, 2, 3, 4), keepdims=True)


def monomials(points: np.ndarray) -> np.ndarray:
    """Return the 15 monomials at points `[M, 3]`, shape `[M, 15]`."""
    return np.einsum("mci,mi->mc", 0.25 * gradients(points), points)


def gradients(points: np.ndarray) -> np.ndarray:
    """Return the gradients of the monomials, shape `[M, 15, 3]`."""
    return np.einsum("mcij,mj->mci", hessians(points) / 3.0, points)


def hessians(points: np.ndarray) -> np.ndarray:
    """Return the second derivatives of the monomials, shape `[M, 15, 3, 3]`."""
    return 12.0 * np.einsum("cijkl,mk,ml->mcij", _TENSORS, points, points)


@functools.cache
def _certificate_equations() -> tuple[np.ndarray, np.ndarray]:
    """Return `C [36, 15]` and `Y [36, 81]` of `z' H(x) z = y' Q y` as `C c = Y vec(Q)`, `y = (x_i z_j)`.

    One row for each monomial `x_i x_j z_k z_l`, i <= j, k <= l.
    """
    pairs = list(itertools.combinations_with_replacement(range(3), 2))
    row = {pair: number for number, pair in enumerate(itertools.product(pairs, pairs))}
    of_coefficients, of_matrix = np.zeros((36, 15)), np.zeros((36, 9, 9))
    for i, j, k, n in itertools.product(range(3), repeat=4):  # (x_i z_k) (x_j z_n)
        here = row[(min(i, j), max(i, j)), (min(k, n), max(k, n))]
        of_coefficients[here] += 12.0 * _TENSORS[:, i, j, k, n]
        of_matrix[here, 3 * i + k, 3 * j + n] += 1.0
    return of_coefficients, of_matrix.reshape(36, 81)


def certificate(coefficients: np.ndarray) -> np.ndarray:
    """Return the matrix `Q [9, 9]` of the quartic with the largest smallest eigenvalue, exact in its equations.

    Positive semidefinite: the quartic is convex, as `z' H(x) z = y' Q y >= 0` for all x, z.
    """
    cp = _cvxpy()
    matrix, least = cp.Variable((9, 9), symmetric=True), cp.Variable()
    of_coefficients, of_matrix = _certificate_equations()
    scale = np.abs(coefficients).max()
    wanted = of_coefficients @ (coefficients / scale)
    rules = [of_matrix @ cp.vec(matrix, order="C") == wanted, matrix - least * np.eye(9) >> 0]
    problem = cp.Problem(cp.Maximize(least), rules)
    _solve(problem)
    found = 0.5 * (matrix.value + matrix.value.T)  # pyright: ignore[reportOptionalMemberAccess, reportOptionalOperand]
    missing = wanted - of_matrix @ found.reshape(81)
    return scale * (found + np.linalg.lstsq(of_matrix, missing, rcond=None)[0].reshape(9, 9))


def least_squares(rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the coefficients `[15]` of the convex quartic of least `|rows c - values|`, `[M, 15]` and `[M]`.

    Without the constraint where that is convex anyway: then to rounding, otherwise to the solver's tolerance.
    """
    free = np.linalg.lstsq(rows, values, rcond=None)[0]
    if np.linalg.matrix_rank(rows) == 15 and np.linalg.eigvalsh(certificate(free))[0] >= MARGIN:
        return free
    cp = _cvxpy()
    coefficients, matrix = cp.Variable(15), cp.Variable((9, 9), symmetric=True)
    of_coefficients, of_matrix = _certificate_equations()
    # the same least squares in 15 rows, whatever the number of samples
    triangle = np.asarray(np.linalg.qr(np.column_stack([rows, values]), mode="r"))
    scale = np.abs(triangle).max()
    problem = cp.Problem(
        cp.Minimize(cp.sum_squares((triangle[:, :15] @ coefficients - triangle[:, 15]) / scale)),
        [of_coefficients @ coefficients == of_matrix @ cp.vec(matrix, order="C"), matrix >> MARGIN * np.eye(9)],
    )
    _solve(problem)
    return coefficients.value


def _solve(problem: Any) -> None:
    cp = _cvxpy()
    try:
        problem.solve(solver=cp.CLARABEL)
    except cp.error.SolverError as error:
        raise FrictionError(f"the fit of the quartic failed: {error}") from None
    if problem.status not in ("optimal", "optimal_inaccurate"):
        raise FrictionError(f"the fit of the quartic failed: {problem.status}")


def _cvxpy() -> Any:
    try:
        import cvxpy
    except ImportError:
        raise MissingExtraError("cvxpy", "quartic") from None
    return cvxpy
