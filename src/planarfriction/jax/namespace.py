"""The array namespace of JAX."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from planarfriction._engine.cells.moment_pressure import (
    OVERSHOT,
    SHORTENINGS,
    SOFTNESS,
    STEPS,
)
from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.tensors.namespace import Namespace


class _Tilt(NamedTuple):
    """Cells in scaled coordinates about their centre of pressure, as `cells.tilt.Scaled`.

    Sums are written out: where JAX traces a step again, as under `jax.vmap` of a rollout, it does so in single
    precision, and products of matrices are the only operations that do not keep double precision then.
    """

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
        _, u, v = self.corners.T
        mean_u = (share * u).sum() / own
        mean_v = (share * v).sum() / own
        u = u - mean_u
        v = v - mean_v
        uu = (share * u * u).sum() + soft
        uv = (share * u * v).sum()
        vv = (share * v * v).sum() + soft
        right = self.asked[1] - mean_u
        up = self.asked[2] - mean_v
        one = uu * vv - uv * uv
        a = (vv * right - uv * up) / one
        b = (uu * up - uv * right) / one
        return jnp.stack([1.0 / own - a * mean_u - b * mean_v, a, b])

    def pressure(self, plane: jax.Array) -> jax.Array:
        """Return the pressure of a plane on the cells `[N]`; < 0 where these lift."""
        return (self.corners * plane).sum(-1)

    def slope(self, plane: jax.Array, step: jax.Array) -> jax.Array:
        """Return the slope of the dual along a step at a plane."""
        here = self.pressure(plane)
        share = jnp.where(here > 0.0, self.share * self.pressure(step), 0.0)
        return (
            SOFTNESS * (plane[1:] * step[1:]).sum()
            - (step * self.asked).sum()
            + (share * here).sum()
        )

    def share_of(self, plane: jax.Array, step: jax.Array) -> jax.Array:
        """Return the share of a step to go.

        The loop keeps its condition. Of many loops side by side the compiler evaluates a condition in two places, and
        rounds it differently there: with one that is computed again they may never end.
        """
        most = OVERSHOT * abs(self.slope(plane, step))

        def too_far(far):
            return self.slope(plane + far * step, step) > most

        def body(last):
            far = 0.5 * last[0]
            return far, too_far(far) & (far > 0.5**SHORTENINGS)

        whole = jnp.ones_like(most)
        return jax.lax.while_loop(lambda last: last[1], body, (whole, too_far(whole)))[
            0
        ]

    def pressing(self, narrow: jax.Array) -> jax.Array:
        """Return the cells that press in the end, bool `[N]`."""

        def body(last):
            plane, _, count = last
            soft = jnp.where((count > 0) | narrow, SOFTNESS, 0.0)
            before = self.pressure(plane) > 0.0
            whole = self.fitted(before, soft)
            done = ((self.pressure(whole) > 0.0) == before).all()
            far = jax.lax.cond(
                done,
                lambda step: jnp.ones(()),
                lambda step: self.share_of(plane, step),
                whole - plane,
            )
            return plane + far * (whole - plane), done, count + 1

        first = jnp.array([1.0, 0.0, 0.0]), jnp.asarray(False), jnp.asarray(0)
        plane, _, _ = jax.lax.while_loop(
            lambda last: ~last[1] & (last[2] < STEPS), body, first
        )
        return self.pressure(plane) > 0.0


@jax.jit
def pressing(u, v, share, x, y, narrow) -> jax.Array:
    """Return the cells that press, bool `[..., N]` (see `Namespace.pressing`)."""
    one = jnp.ones_like(u)
    corners = jnp.stack([one, u, v], -1)
    asked = jnp.concatenate([one[..., :1], x, y], -1)

    def found(corners, share, asked, narrow):
        return _Tilt(corners, share, asked).pressing(narrow)

    cells, shares, places = (
        each.reshape(-1, *each.shape[asked.ndim - 1 :])
        for each in (corners, share, asked)
    )
    return jax.vmap(found)(cells, shares, places, narrow.reshape(-1)).reshape(u.shape)


def _until(body: Any, start: Any, most: int) -> Any:
    """Return `Namespace.until`, whose loop keeps its condition as that of `_Tilt.share_of` does."""

    def once(last):
        count, _, state = last
        return count + 1, *body(state)

    first = jnp.asarray(0), jnp.asarray(False), start
    return jax.lax.while_loop(lambda last: ~last[1] & (last[0] < most), once, first)[2]


def _repeat(body: Any, state: Any, times: int) -> Any:
    _, results = jax.lax.scan(lambda last, _: body(last), state, None, times)
    return jax.tree.map(lambda each: each[-1], results)


def _compiled(function: Any, record: Any) -> Any:
    """Return `Namespace.compiled`."""
    leaves, structure = jax.tree.flatten(record)
    arrays = [each for each in leaves if hasattr(each, "dtype")]
    plain = tuple(None if hasattr(each, "dtype") else each for each in leaves)
    return _run(function, structure, plain, arrays)


@functools.partial(jax.jit, static_argnums=(0, 1, 2))
def _run(function: Any, structure: Any, plain: tuple[Any, ...], arrays: list) -> Any:
    """Return the result for a record of leaves that are plain, arrays where these are None."""
    others = iter(arrays)
    leaves = [next(others) if each is None else each for each in plain]
    return function(xp, jax.tree.unflatten(structure, leaves))


def _slopes(function: Any, x: jax.Array, units: jax.Array) -> jax.Array:
    """Return `Namespace.slopes` forwards, which takes a tenth of the time."""
    same = jnp.broadcast_to(x, units.shape)
    return jax.jvp(function, (same,), (units,))[1].swapaxes(0, -1)


def _real(name: str, value: Any, like: Any = None) -> jax.Array:
    if not isinstance(value, jax.Array) and type(value) is not float:
        if isinstance(value, (list, tuple)) and any(
            isinstance(each, jax.Array) for each in value
        ):
            value = jnp.stack([_real(name, each) for each in value])
        else:
            checked = validation.numbers(name, value)
            if isinstance(value, (int, float)) and not isinstance(value, np.generic):
                # A plain number takes the precision of what it meets.
                value = float(checked)
            elif (
                isinstance(value, (np.ndarray, np.generic))
                and value.dtype.char in "efd"
                and value.dtype.isnative
            ):
                # Plain, which a masked array is not even if it masks nothing.
                value = np.asarray(value)
            else:
                value = jnp.asarray(checked, float)
    array = jnp.asarray(value)
    if jnp.issubdtype(array.dtype, jnp.floating):
        return array
    if array.dtype == bool or jnp.issubdtype(array.dtype, jnp.complexfloating):
        raise InvalidValueError(
            name, "be an array of real numbers", f"one of {array.dtype}"
        )
    return array.astype(float)


def _extremes(name: str, value: jax.Array) -> tuple[float, float] | None:
    if (
        isinstance(value, Tracer)
        or not value.size
        or any(device.platform != "cpu" for device in value.devices())
    ):
        return None
    numbers = np.asarray(value)
    low = float(numbers.min())
    high = float(numbers.max())
    validation.within_range(name, low, high)
    return low, high


def _in_double(function: Any, *arrays: jax.Array) -> jax.Array:
    precision = jnp.result_type(*arrays)
    with jax.enable_x64(True):
        wide = [jax.lax.convert_element_type(each, jnp.float64) for each in arrays]
        return jax.lax.convert_element_type(function(*wide), precision)


xp = Namespace(
    jnp,
    broadcast_arrays=jnp.broadcast_arrays,
    stop_gradient=jax.lax.stop_gradient,
    integers=lambda x: x.astype(jnp.int32),
    real=_real,
    extremes=_extremes,
    pressing=pressing,
    until=_until,
    repeat=_repeat,
    compiled=_compiled,
    slopes=_slopes,
    to_numpy=lambda value: np.asarray(value) if isinstance(value, jax.Array) else value,
    from_numpy=lambda array, like: jnp.asarray(array, like.dtype),
    in_double=_in_double,
    widened=lambda x: x,
    narrowed=lambda result, *inputs: result,
)
