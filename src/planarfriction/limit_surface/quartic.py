"""A convex quartic that approximates a limit surface."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction.errors import FrictionError, InvalidValueError, needing
from planarfriction.geometry import transformed
from planarfriction.limit_surface.base import LimitSurface, _rows, scaling
from planarfriction.limit_surface.cells import LimitSurfaceCells
from planarfriction.limit_surface.comparison import directions
from planarfriction.limit_surface.loops.twists import BAD_WRENCH
from planarfriction.patch import ContactPatch

POWERS = np.array(
    [
        powers
        for powers in itertools.product(range(4, -1, -1), repeat=3)
        if sum(powers) == 4
    ]
)
"""Powers of `fx, fy, tau/r` in the 15 monomials, `[15, 3]`: x^4, x^3 y, x^3 z, x^2 y^2, ..."""

MARGIN = 1e-4
"""Least eigenvalue of the certificate, `H'' >= 1e-4 |x|^2`: no facets, no corners (the unit sphere's is 4)."""

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
    of_coefficients = np.zeros((36, 15))
    of_matrix = np.zeros((36, 9, 9))
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
    matrix = cp.Variable((9, 9), symmetric=True)
    least = cp.Variable()
    of_coefficients, of_matrix = _certificate_equations()
    scale = np.abs(coefficients).max()
    wanted = of_coefficients @ (coefficients / scale)
    rules = [
        of_matrix @ cp.vec(matrix, order="C") == wanted,
        matrix - least * np.eye(9) >> 0,
    ]
    problem = cp.Problem(cp.Maximize(least), rules)
    _solve(problem)
    found = 0.5 * (matrix.value + matrix.value.T)  # pyright: ignore[reportOptionalMemberAccess, reportOptionalOperand]
    missing = wanted - of_matrix @ found.reshape(81)
    return scale * (
        found + np.linalg.lstsq(of_matrix, missing, rcond=None)[0].reshape(9, 9)
    )


def least_squares(rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the coefficients `[15]` of the convex quartic of least `|rows c - values|`, `[M, 15]` and `[M]`.

    Without the constraint where that is convex anyway: then to rounding, otherwise to the solver's tolerance.
    """
    free = np.linalg.lstsq(rows, values, rcond=None)[0]
    if (
        np.linalg.matrix_rank(rows) == 15
        and np.linalg.eigvalsh(certificate(free))[0] >= MARGIN
    ):
        return free
    cp = _cvxpy()
    coefficients = cp.Variable(15)
    matrix = cp.Variable((9, 9), symmetric=True)
    of_coefficients, of_matrix = _certificate_equations()
    # the same least squares in 15 rows, whatever the number of samples
    triangle = np.asarray(np.linalg.qr(np.column_stack([rows, values]), mode="r"))
    scale = np.abs(triangle).max()
    problem = cp.Problem(
        cp.Minimize(
            cp.sum_squares((triangle[:, :15] @ coefficients - triangle[:, 15]) / scale)
        ),
        [
            of_coefficients @ coefficients == of_matrix @ cp.vec(matrix, order="C"),
            matrix >> MARGIN * np.eye(9),
        ],
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
    with needing("cvxpy", "quartic"):
        import cvxpy
    return cvxpy


_SLOPE_LEFT = 1e-14
"""Slope at which the wrench of a unit twist is found, relative to the twist [-]."""

_SAMPLES = 400
"""Directions at which a patch's own surface is fitted: 1600 residuals for 15 numbers."""


@dataclass(frozen=True, eq=False)
class LimitSurfaceQuartic(LimitSurface):
    """Limit surface `H(fx, fy, tau/r) = 1` about the centre of pressure, with a convex homogeneous quartic H.

    The twist of a wrench is along the gradient of H, in closed form. Convexity is certified by a sum of squares:
    `z' H''(x) z = y' Q y` with `y = (x_i z_j)` and positive definite `Q` (every convex quartic of three variables has
    such a Q). The 15 coefficients are fitted by least squares under that constraint to the surface of the patch, or by
    `LimitSurfaceQuartic.fit` to measured pairs.

    Compiled models use it as a table of `segments`, like `LimitSurfaceTable`. Needs the extra `quartic` (cvxpy).

    Raises InvalidValueError for coefficients that are not those of a convex quartic, MissingExtraError without cvxpy.

    Source: Zhou, Paolini, Bagnell, Mason 2016.
    """

    surface: LimitSurface | None = dataclasses.field(default=None, kw_only=True)
    """Surface to which it is fitted; by default `LimitSurfaceCells(patch)`."""

    coefficients: np.ndarray | None = dataclasses.field(default=None, kw_only=True)
    """Coefficients of the 15 monomials `POWERS`, `[15]`; by default fitted to `surface`, for each load."""

    segments: int = dataclasses.field(default=20, kw_only=True)
    """Segments per quadrant of the table for compiled code [-]."""

    def __post_init__(self) -> None:
        if self.surface is not None and not isinstance(self.surface, LimitSurface):
            raise InvalidValueError("surface", "be a limit surface", self.surface)
        super().__post_init__()
        if self.coefficients is not None:
            given = validation.array("coefficients", self.coefficients, (15,))
            if not np.linalg.eigvalsh(certificate(given))[0] > 0.0:
                raise InvalidValueError(
                    "coefficients", "be those of a convex quartic", given.tolist()
                )
            given.setflags(write=False)
            self._set(coefficients=given)

    @classmethod
    def fit(
        cls,
        wrench: ArrayLike,
        twist: ArrayLike,
        *,
        patch: ContactPatch,
        normal_force: float | None = None,
        velocity_weight: float = 1.0,
    ) -> LimitSurfaceQuartic:
        """Fit a convex quartic to measured pairs: `H(W) = 1`, with the gradient of H along the twist.

        `wrench` `[M, 3]` are friction wrenches per unit `mu f_N` on the moving body, `twist` `[M, 3]` its twists, whose
        magnitude does not matter; both about the origin of the contact frame. The patch only defines the centre and
        radius of the scaled coordinates, not the shape, so a guess is enough. `velocity_weight` weights the squares of
        the gradients' components across the twists against those of `H - 1`.

        Raises `InvalidValueError` for pairs of the wrong shape, fewer than 5, not finite or zero.
        """
        wrench = _rows("wrench", wrench)
        twist = _rows("twist", twist)
        if wrench.ndim != 2 or wrench.shape != twist.shape or len(wrench) < 5:
            shapes = f"{list(wrench.shape)}, {list(twist.shape)}"
            raise InvalidValueError(
                "twist", "have as many rows as wrench, five or more", shapes
            )
        for name, rows in (("wrench", wrench), ("twist", twist)):
            if not (np.abs(rows).max(axis=1) > 0.0).all():
                raise InvalidValueError(name, "not be zero in any row", rows.tolist())
        validation.instance("patch", patch, ContactPatch, "a ContactPatch")
        if normal_force is not None:
            normal_force = validation.positive_load("normal_force", normal_force)
        frame = scaling(
            patch.centre_of_pressure(normal_force),
            float(patch.contact_radius(normal_force)),
        )
        points = -np.linalg.solve(frame.T, wrench.T).T
        weight = validation.non_negative("velocity_weight", velocity_weight)
        coefficients = _fitted(points, twist @ frame.T, weight)
        return cls(patch, normal_force=normal_force, coefficients=coefficients)

    @functools.cached_property
    def quartic(self) -> np.ndarray:
        """The 15 coefficients.

        Raises MissingExtraError without cvxpy where they are fitted, FrictionError where the fit fails.
        """
        if self.coefficients is not None:
            return self.coefficients
        surface = self.surface or LimitSurfaceCells(
            self.patch, normal_force=self.normal_force
        )
        if self.normal_force is not None:
            surface = surface.at(self.normal_force)
        scaled = directions(_SAMPLES)
        frame = self._frame()
        points = -np.linalg.solve(
            frame.T, surface.wrench(np.linalg.solve(frame, scaled.T).T).T
        ).T
        return _fitted(points, scaled, 1.0)

    @functools.cached_property
    def convexity(self) -> float:
        """Smallest eigenvalue of the certificate `Q`; if it is not negative, the surface is proven to be convex.

        Raises MissingExtraError without cvxpy, FrictionError where the fit fails.
        """
        return float(np.linalg.eigvalsh(certificate(self.quartic))[0])

    # ------------------------------------------------------------------ the protocol

    def _value(self, points: np.ndarray) -> np.ndarray:
        return monomials(points) @ self.quartic

    def _gradient(self, points: np.ndarray) -> np.ndarray:
        return np.einsum("mci,c->mi", gradients(points), self.quartic)

    def _hessian(self, points: np.ndarray) -> np.ndarray:
        return np.einsum("mcij,c->mij", hessians(points), self.quartic)

    def _find_twists(self, wrenches: np.ndarray, found: np.ndarray) -> float:
        scaling = self._scaling
        size = np.abs(wrenches).max(axis=1)
        if not (np.isfinite(size).all() and (size > 0.0).all()):
            return BAD_WRENCH
        targets = (wrenches / size[:, None]) @ scaling[:9].reshape(3, 3).T
        targets /= np.linalg.norm(targets, axis=1)[:, None]
        # H(h) = 1 along the target, and Phi(V) = h . V = 4 for its gradient V there
        x = targets / self._value(targets)[:, None] ** 0.25
        found[:] = transformed(scaling[9:18].reshape(3, 3), 0.25 * self._gradient(x))
        return 0.0

    def _conjugate(self, units: np.ndarray) -> np.ndarray:
        """Return `x` with `grad H(x) = 4 V` for unit vectors `[M, 3]`: the least of the convex `H(x)/4 - V . x`.

        By damped Newton steps.
        """
        x = units / np.cbrt(self._value(units))[:, None]  # the minimum along V itself
        active = np.arange(len(units))
        for _ in range(100):
            slope = 0.25 * self._gradient(x[active]) - units[active]
            left = np.linalg.norm(slope, axis=1) > _SLOPE_LEFT
            active = active[left]
            slope = slope[left]
            if not active.size:
                break
            move = -np.linalg.solve(0.25 * self._hessian(x[active]), slope[..., None])[
                ..., 0
            ]
            value = 0.25 * self._value(x[active]) - np.einsum(
                "mi,mi->m", units[active], x[active]
            )
            downhill = np.einsum("mi,mi->m", slope, move)
            trying = np.arange(len(active))
            length = 1.0
            while trying.size and length > 1e-6:
                who = active[trying]
                trial = x[who] + length * move[trying]
                reached = 0.25 * self._value(trial) - np.einsum(
                    "mi,mi->m", units[who], trial
                )
                good = (
                    reached <= value[trying] + 0.1 * length * downhill[trying] + 1e-15
                )
                x[who[good]] = trial[good]
                trying = trying[~good]
                length = 0.5 * length
            size = np.linalg.norm(
                0.25 * self._gradient(x[active]) - units[active], axis=1
            )
            # Else at rounding, or far and still damped.
            moved = size < 0.5 * np.linalg.norm(slope, axis=1)
            active = active[moved | (size > 1e-10)]
        return x

    def direction(self, units: np.ndarray) -> np.ndarray:
        """Return `h` with `H(h) = 1` and its gradient along the twist."""
        x = self._conjugate(units)
        return x / self._value(x)[:, None] ** 0.25

    def direction_slope(self, units: np.ndarray) -> np.ndarray:
        """Return `dh/dV_S`, from `x(V) = Phi^(1/3) h` and `dx/dV = (H''(x)/4)^-1`, Phi that of the unit twist."""
        x = self._conjugate(units)
        root = self._value(x) ** 0.25  # Phi^(1/3)
        h = x / root[:, None]
        slope = np.linalg.inv(0.25 * self._hessian(x)) / root[:, None, None]
        return slope - np.einsum("mi,mj->mij", h, h) / (3.0 * root**3)[:, None, None]


def _fitted(
    points: np.ndarray, twists: np.ndarray, velocity_weight: float
) -> np.ndarray:
    """Return the coefficients with `H = 1` at `points` `[M, 3]` and gradients of length 4 along `twists` `[M, 3]`."""
    units = twists / np.linalg.norm(twists, axis=1)[:, None]
    across = np.eye(3) - np.einsum("mi,mj->mij", units, units)
    parts = (
        0.25
        * np.sqrt(velocity_weight)
        * np.einsum("mij,mcj->mic", across, gradients(points))
    )
    rows = np.concatenate([monomials(points), parts.reshape(-1, 15)])
    return least_squares(
        rows, np.append(np.ones(len(points)), np.zeros(3 * len(points)))
    )
