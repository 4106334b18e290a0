"""The step in contact space of `planarfriction.coupling`, written with JAX operations and with derivatives.

The same steps of Newton's method as `coupled.coupling` takes, which says why; here as one flat loop with one evaluation
of the models a round, so that environments side by side wait for each other as little as they can, and little is
compiled. Derivatives are those of the equation that is solved, at its solution.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from planarfriction._engine.coupled.coupling import (
    DOWNHILL,
    JOINT,
    ROUND,
    ROUNDING,
    SHORTENINGS,
)

_GUESS = 0
"""Kind of evaluation: the twists that the guess causes."""

_REST = 1
"""Kind of evaluation: twists at rest."""

_SEARCH = 2
"""Kind of evaluation: a point along a Newton step."""

ROUNDING_SINGLE = 1e-5
"""`ROUNDING` in single precision, in which the response of a host has that much less digits.

What a body moves, its bristles give, to the last digit; so a held body does not creep however large this is."""


class UnitLoadFriction(NamedTuple):
    """Friction of the models' steps."""

    wrench: Callable[[jax.Array, jax.Array], jax.Array]
    """Wrenches per unit load `[k, 3]` at twists `[k, 3]` and loads `[k]` [N]."""
    by_load: bool
    """True if wrenches per unit load depend on the loads."""


class HostResponse(NamedTuple):
    """Response of twists and loads at the end of a step to the wrenches w `[3k]` that act during it."""

    twist: jax.Array
    """Twists without wrenches, `[3k]`."""
    load: jax.Array
    """Loads without wrenches, `[k]`."""
    response: jax.Array
    """A, `[3k, 3k]`."""
    load_response: jax.Array
    """B, `[k, 3k]`."""

    def twists(self, w: jax.Array) -> jax.Array:
        """Return the twists `[k, 3]`."""
        return (self.twist + self.response @ w).reshape(-1, 3)

    def loads(self, w: jax.Array) -> jax.Array:
        """Return the loads `[k]`."""
        load = self.load + self.load_response @ w
        return jnp.where(load > 0.0, load, 0.0)


class Solved(NamedTuple):
    """Wrenches that fit."""

    wrench: jax.Array
    """`[3k]`"""
    iterations: jax.Array
    residual: jax.Array
    """[m/s], as in `coupling.CoupledStep`."""
    converged: jax.Array


class _Round(NamedTuple):
    """State that one round of the loop leaves to the next."""

    phase: Any
    w: Any
    """Wrenches at which the next round evaluates, with their twists and loads."""
    twist: Any
    load: Any
    unit: Any
    """Friction per unit load at the guess, with its slopes, those of the wrench by the load, and the misfit."""
    slopes: Any
    by_load: Any
    misfit: Any
    start: Any
    """Newton step under trial: start, change of wrenches and of twists, `A dW . s` at its start, share tried."""
    change: Any
    move: Any
    first: Any
    far: Any
    tries: Any
    whole: Any
    held: Any
    iterations: Any
    best: Any
    fits: Any
    wrench: Any
    """Wrench of the models where the misfit was least."""
    done: Any


class _Search(NamedTuple):
    """Search for the wrenches of one step."""

    unit: UnitLoadFriction
    host: HostResponse
    lever: jax.Array
    """Factors `[k, 3]` that make speeds of twists: 1, 1 and the radius of the patch [m]."""
    diagonal: jax.Array
    """Diagonal of A, `[k, 3]`."""
    scale: jax.Array
    """Twists of unit energy, `[k, 3]`."""
    near: jax.Array
    """Misfit [m/s] at which wrenches fit."""
    speeds: jax.Array
    """Twists of which the searched ones are sums, `[k, 3]`."""
    most: int
    """Largest number of iterations."""

    def evaluate(self, twist, load):
        """Return the friction per unit load `[k, 3]`, its slopes `[k, 3, 3]`, and of wrenches by loads `[k, 3]`."""

        def slope(along, more):
            return jax.jvp(self.unit.wrench, (twist, load), (along, more))

        eye = jnp.broadcast_to(jnp.eye(3)[:, None], (3, len(twist), 3))
        unit, slopes = jax.vmap(
            lambda along: slope(along, 0.0 * load), out_axes=(None, -1)
        )(eye)
        by_load = (
            load[:, None] * slope(0.0 * twist, jnp.ones_like(load))[1]
            if self.unit.by_load
            else 0.0
        )
        return unit, slopes, unit + by_load

    def misfit(self, twist, load, unit):
        """Return the largest speed [m/s] by which twists and loads miss those that the friction `unit` causes."""
        host = self.host
        w = (load[:, None] * unit).ravel()
        gap = abs(host.twists(w) - twist) * self.lever
        missing = abs(host.loads(w) - load)
        gap = jnp.maximum(
            gap, self.diagonal * missing[:, None] * jnp.array([1.0, 1.0, 0.0])
        )
        return jnp.where(jnp.isfinite(gap).all(), gap.max(), jnp.inf)

    def rounding(self, load, slopes):
        """Return the misfit [m/s] that the last digit of the twists makes where friction rises steeply with them."""
        moved = (abs(load[:, None, None] * slopes) @ self.speeds[..., None])[..., 0]
        eps = jnp.finfo(moved.dtype).eps
        return 2.0 * eps * (self.diagonal * self.lever * moved).max()

    def newton(self, w, twist, load, unit, slopes, by_load, held):
        """Return the step, the twists that it adds, and `A dW . s` at its start."""
        host = self.host
        count = len(load)
        lacks = host.load + host.load_response @ w - load
        follows = jnp.where(held | ((load == 0.0) & (lacks < 0.0)), 0.0, 1.0)
        own = load[:, None, None] * slopes
        both = jnp.stack([own, _without_rising(own, self.scale)])
        caused = (
            both @ host.response.reshape(count, 3, -1)
            + (follows[:, None] * by_load)[..., None] * (host.load_response[:, None])
        )
        matrix = jnp.eye(3 * count) - caused.reshape(2, 3 * count, -1)
        base = (
            load[:, None] * unit
            + (follows * lacks)[:, None] * by_load
            - w.reshape(-1, 3)
        )
        right = base + (both @ (host.twists(w) - twist)[..., None])[..., 0]
        change, sign = _solved(matrix, right.reshape(2, -1))
        move = change @ host.response.T
        towards = move.reshape(2, count, 3)
        downhill = (
            towards
            * (change.reshape(towards.shape) - (own @ towards[..., None])[..., 0])
        ).sum((1, 2))
        plain = (sign[0] > 0.0) & (downhill[0] > 0.0)
        change = jnp.where(plain, change[0], change[1])
        move = jnp.where(plain, move[0], move[1])
        return change, move, (move * ((load[:, None] * unit).ravel() - w)).sum()

    def next_round(self, c: _Round) -> _Round:
        """Evaluate the models once: take a step if it leads far enough downhill, else try less of it."""
        host = self.host
        unit, slopes, by_load = self.evaluate(c.twist, c.load)
        searching = c.phase == _SEARCH
        here = (c.move * ((c.load[:, None] * unit).ravel() - c.w)).sum()
        far_enough = (
            c.whole
            | (here >= -DOWNHILL * c.first)
            | ~(c.first > 0.0)
            | (c.tries == SHORTENINGS)
        )
        accepted = ~searching | far_enough
        load = jnp.where(c.held, host.loads(c.w), c.load)
        misfit = self.misfit(c.twist, load, unit)
        # the better of the guess and of rest
        back = (c.phase == _REST) & (misfit > c.misfit)
        twist = jnp.where(back, host.twists(c.w), c.twist)
        misfit = jnp.where(back, c.misfit, misfit)
        unit = jnp.where(back, c.unit, unit)
        slopes = jnp.where(back, c.slopes, slopes)
        by_load = jnp.where(back, c.by_load, by_load)
        near = jnp.maximum(self.near, self.rounding(load, slopes))
        to_rest = (c.phase == _GUESS) & (misfit > near)
        iterations = c.iterations + (searching & far_enough)
        better = accepted & (misfit < c.best)
        best = jnp.where(better, misfit, c.best)
        fits = jnp.where(better, misfit <= near, c.fits)
        wrench = jnp.where(better, (load[:, None] * unit).ravel(), c.wrench)
        done = (
            accepted
            & ~to_rest
            & ((misfit <= near) | (iterations >= self.most) | (misfit == jnp.inf))
        )
        # a new step, or less of the last
        held = jnp.where(accepted, iterations % ROUND >= JOINT, c.held)
        change, move, first = self.newton(c.w, twist, load, unit, slopes, by_load, held)
        change, move, first = (
            jnp.where(accepted, new, old)
            for new, old in zip(
                (change, move, first), (c.change, c.move, c.first), strict=True
            )
        )
        slope = jnp.where(c.first == here, 1.0, c.first - here)
        far = jnp.where(accepted, 1.0, c.far * jnp.clip(c.first / slope, 0.1, 0.7))
        start = jnp.where(accepted, c.w, c.start)
        w = jnp.where(to_rest, c.w, start + far * change)
        return _Round(
            phase=jnp.where(to_rest, _REST, _SEARCH), w=w, twist=jnp.where(to_rest, 0.0, host.twists(w)),
            load=jnp.where(to_rest | held, load, host.loads(w)), unit=unit, slopes=slopes, by_load=by_load,
            misfit=misfit, start=start, change=change, move=move, first=first, far=far,
            tries=jnp.where(accepted, 0, c.tries + 1), whole=jnp.where(accepted, c.phase == _REST, c.whole) & ~back,
            held=held & ~to_rest, iterations=iterations, best=best, fits=fits, wrench=wrench, done=done,
        )  # fmt: skip


def solve(
    unit: UnitLoadFriction,
    host: HostResponse,
    guess: jax.Array,
    radius: jax.Array,
    tolerance: float,
    most: int,
) -> Solved:
    """Solve for the wrenches `w(V, N)` with the V and N that they cause; `guess` `[3k]`, `radius` `[k]` [m]."""
    count = len(host.load)
    lever = jnp.ones((len(host.load), 3)).at[:, 2].set(radius)
    caused = host.response @ guess
    speeds = (abs(host.twist + caused) + abs(caused)).reshape(-1, 3)
    rounding = ROUNDING if speeds.dtype == jnp.float64 else ROUNDING_SINGLE
    near = jnp.maximum(tolerance, rounding * (lever * speeds).max())
    diagonal = jnp.diagonal(host.response).reshape(-1, 3)
    scale = jnp.where(diagonal > 0.0, jnp.sqrt(abs(diagonal)), 1.0)
    search = _Search(unit, host, lever, diagonal, scale, near, speeds, most)
    none = jnp.zeros(3 * count)
    zeros = jnp.zeros((count, 3))
    first = _Round(
        phase=jnp.asarray(_GUESS), w=guess, twist=host.twists(guess), load=host.loads(guess),
        unit=zeros, slopes=jnp.zeros((count, 3, 3)), by_load=zeros, misfit=jnp.asarray(jnp.inf),
        start=guess, change=none, move=none, first=jnp.asarray(0.0), far=jnp.asarray(1.0), tries=jnp.asarray(0),
        whole=jnp.asarray(False), held=jnp.asarray(False), iterations=jnp.asarray(0),
        best=jnp.asarray(jnp.inf), fits=jnp.asarray(False), wrench=none, done=jnp.asarray(False),
    )  # fmt: skip
    end = jax.lax.while_loop(lambda c: ~c.done, search.next_round, first)
    return Solved(end.wrench, end.iterations, end.best, end.fits)


def fitting(unit: UnitLoadFriction, host: HostResponse, found: jax.Array) -> jax.Array:
    """Return the wrenches `found`, with the derivatives of `w(V, N) - W = 0` by all that is in `unit` and `host`."""

    def gap(w):
        load = host.loads(w)
        return (load[:, None] * unit.wrench(host.twists(w), load)).ravel() - w

    def linear(slope, right):
        return jnp.linalg.solve(jax.jacobian(slope)(right), right)

    return jax.lax.custom_root(
        gap, jax.lax.stop_gradient(found), lambda _, w: w, linear
    )


def _without_rising(slopes: jax.Array, scale: jax.Array) -> jax.Array:
    """Return the slopes `[k, 3, 3]` without rising directions; `scale` `[k, 3]` are twists of unit energy."""
    both = scale[:, :, None] * scale[:, None, :]
    rises, axes = jnp.linalg.eigh(0.5 * (slopes + slopes.mT) * both)
    return slopes - (axes * jnp.maximum(rises, 0.0)[:, None]) @ axes.mT / both


def _solved(matrix: jax.Array, right: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Return the solutions `[..., n]`, 0 where there are none, and signs of the determinants."""
    factors, pivots = jax.scipy.linalg.lu_factor(matrix)
    found = jax.scipy.linalg.lu_solve((factors, pivots), right[..., None])[..., 0]
    swaps = (pivots != jnp.arange(pivots.shape[-1])).sum(-1)
    sign = jnp.sign(jnp.diagonal(factors, axis1=-2, axis2=-1)).prod(-1) * (
        1.0 - 2.0 * (swaps % 2)
    )
    return jnp.where(jnp.isfinite(found), found, 0.0), sign
