"""Faces of pads with a common compliance over `xp` (see `coupled.face`): each step looks for the twist of its face.

Broyden's method looks for it as in `coupled.face_steps`, for all contacts at once and without derivatives, until the
residual is about the root of the rounding error. With the slopes there as constants, each step of Newton's method adds
an order of derivatives of the solution, and all digits.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from planarfriction._engine.codegen.rebinding import like
from planarfriction._engine.coupled.face_steps import TRIES
from planarfriction.tensors import distributed

ORDER = 2
"""Order up to which derivatives of a step are exact."""


class Face(NamedTuple):
    """A face and its bristles at the beginning of a step; the last axes of `load`, `dt` and `h` have length 1."""

    law: Any
    shape: Any
    """`distributed.Cells`."""
    compliance: Any
    """C, `[3, 3]`."""
    bristles: Any
    """`[..., d, N]`"""
    behind: Any
    """b, `[..., 3]`."""
    twist: Any
    """V, `[..., 3]`."""
    load: Any
    dt: Any
    h: Any
    """`dt + T` [s]."""

    def bent(self, wrench: Any) -> Any:
        """Return `b + C W`."""
        return self.behind + (self.compliance * wrench[..., None, :]).sum(-1)

    def step(self, xp: Any, face: Any) -> tuple[Any, Any]:
        """Return the bristles and the wrench after a step at a twist of the face."""
        load = self.load[..., None]
        by = distributed.drive(xp, self.law, self.shape, face)
        at = self.bristles, by, load, self.dt[..., None]
        new, pull = distributed.advance(xp, self.law, self.shape, *at)
        wrench = self.load * distributed.wrench(xp, self.shape, pull)
        return xp.where(load > 0.0, new, 0.0), wrench

    def lack(self, face: Any, wrench: Any) -> Any:
        """Return the residual `V - V_f + (b + C W)/h`."""
        return self.twist - face + self.bent(wrench) / self.h

    def pulled(self, xp: Any, stiffness: Any, bristles: Any) -> Any:
        """Return the wrench of bristles of a stiffness `[..., 1, N]` that deflect or move, with the opposite sign."""
        return distributed.wrench(xp, self.shape._replace(weights=stiffness), bristles)

    @property
    def stiff(self) -> Any:
        """Stiffness of the pieces `[..., 1, N]` [N/m]."""
        return self.law.sigma_0 * self.shape.stiff

    def held(self, xp: Any, twist: Any) -> Any:
        """Return the wrench by which bristles that stick resist a twist."""
        viscous = self.law.sigma_2 * self.shape.weights * self.load[..., None]
        stiffness = self.stiff * self.dt[..., None] + viscous
        return self.pulled(
            xp, stiffness, *distributed.drive(xp, self.law, self.shape, twist)
        )

    def stuck(self, xp: Any) -> tuple[Any, Any, Any]:
        """Return the twist of a face whose bristles stick, their wrench, and the slopes of `-lack`."""
        springs = -self.pulled(xp, self.stiff, self.bristles)
        free = self.twist + self.bent(springs) / self.h
        one = _eye(xp, free + 0.0 * self.law.mu_s[..., 0] * self.load)
        axes = self.compliance.reshape(3, *(1,) * (free.ndim - 1), 3)
        slopes = one + self.held(xp, axes) / self.h
        face = _solved(xp, slopes, free)
        return face, springs - self.held(xp, face), slopes


def evaluate(xp: Any, at: Face) -> tuple[Any, Any]:
    """Return the rate of the state and the wrench, of a face at `dt = 0`."""
    return xp.compiled(_evaluate, at)


def _evaluate(xp: Any, at: Face) -> tuple[Any, Any]:
    face, _, _ = at.stuck(xp)
    by = distributed.drive(xp, at.law, at.shape, face)
    rate, pull = distributed.evaluate(
        xp, at.law, at.shape, at.bristles, by, at.load[..., None]
    )
    return joined(xp, rate, at.twist - face), at.load * distributed.wrench(
        xp, at.shape, pull
    )


def step(xp: Any, at: Face) -> tuple[Any, Any]:
    """Return the state and the wrench after a step."""
    return xp.compiled(_step, at)


def _step(xp: Any, at: Face) -> tuple[Any, Any]:
    held = _constant(xp, at)
    face, found = _search(xp, held)
    one = _eye(xp, face)
    lacks = lambda face: held.lack(face, held.step(xp, face)[1])
    slopes = xp.where(held.load > 0.0, -xp.slopes(lacks, face, one), one)

    def newton(face: Any) -> tuple[Any, tuple]:
        new, wrench = at.step(xp, face)
        change = _solved(xp, slopes, at.lack(face, wrench))
        return face + xp.where(found, change, 0.0), (new, wrench)

    new, wrench = xp.repeat(newton, face, ORDER + 1)
    behind = at.behind - at.dt / at.h * at.bent(wrench)
    return joined(xp, new, xp.where(at.load > 0.0, behind, 0.0)), wrench


def _search(xp: Any, at: Face) -> tuple[Any, Any]:
    """Return the twists of the faces, and True `[..., 1]` where they were found."""
    face, pull, slopes = at.stuck(xp)
    one = _eye(xp, face)
    spin = distributed.drive(xp, at.law, at.shape, one[2])
    square = at.pulled(xp, at.stiff, *spin)[..., 2:] / at.stiff.sum(-1)
    metric = xp.concatenate(
        [one[0][..., :1], one[1][..., 1:2], square + 0.0 * face[..., :1]], -1
    )
    size = xp.root(xp.dot(pull, pull / metric, -1))
    largest = at.law.mu_s[..., 0] * at.load
    part = xp.where(size > largest, largest / xp.where(size > largest, size, 1.0), 1.0)
    enough = math.sqrt(xp.epsilon(face))

    def length(x: Any) -> Any:
        return xp.root(xp.dot(x, metric * x, -1))

    def body(last: tuple) -> tuple[Any, tuple]:
        face, slopes, change, best, least = last
        wrench = at.step(xp, face)[1]
        lack = at.lack(face, wrench)
        bends = length(at.behind) + length(at.bent(wrench) - at.behind)
        speed = length(at.twist) + bends / at.h
        misfit = length(lack) / xp.where(speed > 0.0, speed, 1.0)
        best = xp.where(misfit < least, face, best)
        least = xp.where(misfit < least, misfit, least)
        along = metric * change
        square = xp.dot(along, change, -1)
        along = xp.where(square > 0.0, along / xp.where(square > 0.0, square, 1.0), 0.0)
        slopes = slopes - xp.stack([lack[..., i : i + 1] * along for i in range(3)], 0)
        change = xp.where(least > enough, _solved(xp, slopes, lack), 0.0)
        return (least <= enough).all(), (face + change, slopes, change, best, least)

    face = at.twist + at.bent(part * pull) / at.h
    least = xp.full_like(face[..., :1], math.inf)
    start = face, one + part * (slopes - one), 0.0 * face, face, least
    *_, best, least = xp.until(body, start, TRIES)
    return best, least <= enough


def joined(xp: Any, bristles: Any, behind: Any) -> Any:
    """Return bristles `[..., d, N]` and what is behind them `[..., 3]` as a state."""
    return xp.concatenate([bristles.reshape(*bristles.shape[:-2], -1), behind], -1)


def _constant(xp: Any, value: Any) -> Any:
    """Return a record whose arrays are constants for differentiation."""
    if isinstance(value, tuple):
        return like(value, [_constant(xp, each) for each in value])
    return xp.stop_gradient(value) if hasattr(value, "dtype") else value


def _eye(xp: Any, x: Any) -> Any:
    """Return three unit vectors `[3, ..., 3]` for vectors x `[..., 3]`."""
    none = xp.full_like(x[..., 0], 0.0)
    rows = [xp.stack([none + float(i == j) for j in range(3)], -1) for i in range(3)]
    return xp.stack(rows, 0)


def _solved(xp: Any, rows: Any, right: Any) -> Any:
    """Return the solution `[..., 3]` of three equations with the rows `[3, ..., 3]`, by Cramer's rule."""
    a, b, c = rows
    across = xp.linalg.cross(b, c), xp.linalg.cross(c, a), xp.linalg.cross(a, b)
    sums = sum(right[..., i : i + 1] * across[i] for i in range(3))
    return sums / xp.dot(a, across[0], -1)
