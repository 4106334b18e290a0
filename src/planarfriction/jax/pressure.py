"""Pressure that follows the moments of the load: `kernels.tilt` written with operations of JAX, with derivatives.

Which cells press is found without derivatives. With these the plane has a closed form, whose derivatives are those of
the rule: cells that are about to lift press with nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from planarfriction.kernels.tilt import FARTHEST, NARROW, OVERSHOT, REACH, SHORTENINGS, SOFTNESS, STEPS
from planarfriction.tensors.distributed import Cells, positions_of
from planarfriction.tensors.steps import Part


def centre_of(moments: jax.Array, load: jax.Array) -> jax.Array:
    """Return the centre of pressure `(-m_y, m_x)/f_N` `[..., 2]` [m]; 0 without load."""
    loaded = (load > 0.0)[..., None]
    turned = jnp.stack([-moments[..., 1], moments[..., 0]], -1)
    return jnp.clip(jnp.where(loaded, turned / jnp.where(loaded, load[..., None], 1.0), 0.0), -REACH, REACH)


class _Tilt(NamedTuple):
    """Cells in scaled coordinates about their centre of pressure, as `kernels.tilt.Scaled`."""

    corners: jax.Array
    """`(1, u, v)` of each cell `[N, 3]`."""
    share: jax.Array
    """Shares of the cells `[N]`, whose sum is 1."""
    asked: jax.Array
    """`(1, u, v)` of the centre that is asked for."""

    def fitted(self, pressing: jax.Array, soft: Any) -> jax.Array:
        """Return the plane `[3]` with total and centre by the cells that press."""
        share = jnp.where(pressing, self.share, 0.0)
        own = share.sum()
        mean = share @ self.corners[:, 1:] / own
        away = self.corners[:, 1:] - mean
        spread = (share[:, None] * away).T @ away + soft * jnp.eye(2)
        right, one = self.asked[1:] - mean, spread[0, 0] * spread[1, 1] - spread[0, 1] ** 2
        a = (spread[1, 1] * right[0] - spread[0, 1] * right[1]) / one
        b = (spread[0, 0] * right[1] - spread[0, 1] * right[0]) / one
        return jnp.stack([1.0 / own - a * mean[0] - b * mean[1], a, b])

    def slopes(self, plane: jax.Array, step: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Return the slope of the dual along a step, and how it rises."""
        here, along = self.corners @ plane, self.corners @ step
        share = jnp.where(here > 0.0, self.share * along, 0.0)
        slope = SOFTNESS * (plane[1:] @ step[1:]) - step @ self.asked + share @ here
        return slope, SOFTNESS * (step[1:] @ step[1:]) + share @ along

    def share_of(self, plane: jax.Array, step: jax.Array) -> jax.Array:
        """Return the share of a step to go."""
        first, _ = self.slopes(plane, step)

        def ends(far: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
            here, rise = self.slopes(plane + far * step, step)
            return here, rise, ~(abs(here) > OVERSHOT * abs(first)) | ((far == 1.0) & (here < 0.0))

        def body(last):
            far, low, high, here, rise, _, count = last
            low, high = jnp.where(here > 0.0, low, far), jnp.where(here > 0.0, far, high)
            ahead = far - here / rise
            far = jnp.where((low < ahead) & (ahead < high), ahead, 0.5 * (low + high))
            return far, low, high, *ends(far), count + 1

        whole = jnp.ones_like(first)
        start = whole, jnp.zeros_like(first), whole, *ends(whole), jnp.asarray(1)
        return jax.lax.while_loop(lambda last: ~last[5] & (last[6] < SHORTENINGS), body, start)[0]

    def pressing(self, narrow: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Return the cells that press in the end, bool `[N]`, and the softness with which their plane is found."""

        def body(last):
            plane, _, _, count = last
            soft = jnp.where((count > 0) | narrow, SOFTNESS, 0.0)
            before = self.corners @ plane > 0.0
            whole = self.fitted(before, soft)
            done = ((self.corners @ whole > 0.0) == before).all()
            far = jax.lax.cond(done, lambda step: jnp.ones(()), lambda step: self.share_of(plane, step), whole - plane)
            return plane + far * (whole - plane), soft, done, count + 1

        first = jnp.array([1.0, 0.0, 0.0]), jnp.asarray(0.0), jnp.asarray(False), jnp.asarray(0)
        plane, soft, _, _ = jax.lax.while_loop(lambda last: ~last[2] & (last[3] < STEPS), body, first)
        return self.corners @ plane > 0.0, soft


def tilted(positions: jax.Array, weights: jax.Array, centre: jax.Array) -> jax.Array:
    """Return weights `[..., N]` of cells at `positions` `[2, N]` that press about a `centre` `[..., 2]` [m]."""
    batch = jnp.broadcast_shapes(weights.shape[:-1], centre.shape[:-1])
    given = jnp.broadcast_to(weights, (*batch, weights.shape[-1])).reshape(-1, weights.shape[-1])
    asked = jnp.broadcast_to(centre, (*batch, 2)).reshape(-1, 2)
    return jax.vmap(lambda w, c: _tilted(positions, w, c))(given, asked).reshape(*batch, -1)


def _tilted(positions: jax.Array, weights: jax.Array, centre: jax.Array) -> jax.Array:
    total = weights.sum()
    share = weights / jnp.where(total > 0.0, total, 1.0)
    middle = positions @ share
    away = positions - middle[:, None]
    spread = (share * away) @ away.T
    size = spread[0, 0] + spread[1, 1]
    per_length = jnp.where(size > 0.0, 1.0 / jnp.sqrt(jnp.where(size > 0.0, size, 1.0)), 0.0)
    narrow = ~(spread[0, 0] * spread[1, 1] - spread[0, 1] ** 2 > NARROW * size**2)
    asked = (centre - middle) * per_length
    square = asked @ asked
    asked *= jnp.where(square > FARTHEST**2, FARTHEST / jnp.sqrt(jnp.where(square > 0.0, square, 1.0)), 1.0)
    one = jnp.ones((1, len(share)))
    tilt = _Tilt(jnp.concatenate([one, away * per_length]).T, share, jnp.concatenate([jnp.ones(1), asked]))
    pressing, soft = _Tilt(*jax.lax.stop_gradient(tuple(tilt))).pressing(jax.lax.stop_gradient(narrow))
    pressed = share * jnp.where(pressing, jnp.maximum(tilt.corners @ tilt.fitted(pressing, soft), 0.0), 0.0)
    found = pressed.sum()
    return jnp.where(total > 0.0, pressed * total / jnp.where(found > 0.0, found, 1.0), weights)


class Pressed(NamedTuple):
    """A model whose pressure has followed its load."""

    parts: tuple[Part, ...]
    moved: jax.Array | None
    """Displacement of parts besides `[..., 2]` [m]; None of cells."""

    def seen(self, twist: jax.Array) -> jax.Array:
        """Return the twist that the parts see."""
        if self.moved is None:
            return twist
        vx, vy, spin = jnp.moveaxis(twist, -1, 0)
        return jnp.stack(jnp.broadcast_arrays(vx - spin * self.moved[..., 1], vy + spin * self.moved[..., 0], spin), -1)

    def pull(self, wrench: jax.Array) -> jax.Array:
        """Return their wrench about the origin."""
        if self.moved is None:
            return wrench
        return wrench.at[..., 2].add(self.moved[..., 0] * wrench[..., 1] - self.moved[..., 1] * wrench[..., 0])


def follow(equations: Any, parts: Sequence[Part], centre: jax.Array) -> Pressed:
    """Return parts with their pressure about `centre` `[..., 2]` [m].

    Cells follow by themselves; parts share the load as if they were cells, and move where that does not reach.
    """
    if isinstance(parts[0].shape, Cells):
        part = parts[0]
        weights = tilted(positions_of(jnp, part.shape), part.shape.weights, centre)[..., None, :]
        return Pressed((part._replace(shape=part.shape._replace(weights=weights)),), None)
    places = jnp.stack([jnp.stack(equations.centre(part.shape)) for part in parts], -1)
    shares = tilted(places, jnp.stack([jnp.asarray(part.share, float) for part in parts]), centre)
    shared = tuple(part._replace(share=shares[..., k, None]) for k, part in enumerate(parts))
    return Pressed(shared, centre - shares @ places.T)
