"""Pressure that follows the moments of the load over `xp`: `cells.moment_pressure` in operations with derivatives.

A front end finds which cells press, without derivatives (`Namespace.pressing`). With these the plane has a closed form,
whose derivatives are those of the rule: cells that are about to lift press with nothing.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any, NamedTuple

from planarfriction._engine.cells import moment_pressure
from planarfriction._engine.cells.moment_pressure import FARTHEST, NARROW, SOFTNESS
from planarfriction.tensors.distributed import Cells, positions_of


def centre_of(xp: Any, moments: Any, load: Any) -> Any:
    """Return the centre of pressure `(-m_y, m_x)/f_N` `[..., 2]` [m]; 0 without load."""
    return xp.stack(
        xp.over(moment_pressure.centre)(
            moments[..., 0], moments[..., 1], xp.where(load > 0.0, load, math.inf)
        ),
        -1,
    )


def twist_at(xp: Any, twist: Any, offset: Any) -> Any:
    """Return twists `[..., 3]` at points displaced by `offset` `[..., 2]` [m] (see `geometry.twist_at`)."""
    spin = twist[..., 2]
    vx = twist[..., 0] - spin * offset[..., 1]
    vy = twist[..., 1] + spin * offset[..., 0]
    return xp.stack(xp.broadcast_arrays(vx, vy, spin), -1)


def wrench_from(xp: Any, wrench: Any, offset: Any) -> Any:
    """Return wrenches `[..., 3]` about the origin from those about points displaced by `offset` `[..., 2]` [m]."""
    fx = wrench[..., 0]
    fy = wrench[..., 1]
    return xp.stack(
        xp.broadcast_arrays(
            fx, fy, wrench[..., 2] + offset[..., 0] * fy - offset[..., 1] * fx
        ),
        -1,
    )


def tilted(xp: Any, positions: Any, weights: Any, centre: Any) -> Any:
    """Return weights `[..., N]` of cells at `positions`, x then y `[..., N]`, that press about a centre `[..., 2]`.

    Numbers are of double precision: where the centre lies beyond all cells, the plane has slopes of `1/SOFTNESS`.
    """

    def mean(values: Any, by: Any) -> Any:
        return (by * values).sum(-1, keepdims=True)

    total = weights.sum(-1, keepdims=True)
    share = weights / xp.where(total > 0.0, total, 1.0)
    (x, y) = positions
    away = []
    for each, to in ((x, centre[..., :1]), (y, centre[..., 1:])):
        middle = mean(each, share)
        away.append((each - middle, to - middle))
    (dx, cx), (dy, cy) = away
    xx = mean(dx * dx, share)
    xy = mean(dx * dy, share)
    yy = mean(dy * dy, share)
    size = xx + yy
    per_length = xp.where(
        size > 0.0, 1.0 / xp.sqrt(xp.where(size > 0.0, size, 1.0)), 0.0
    )
    narrow = ~(xx * yy - xy * xy > NARROW * size * size)
    u, v, cx, cy = (each * per_length for each in (dx, dy, cx, cy))
    square = cx * cx + cy * cy
    back = xp.where(
        square > FARTHEST**2,
        FARTHEST / xp.sqrt(xp.where(square > 0.0, square, 1.0)),
        1.0,
    )
    u, v, share, cx, cy, narrow = xp.broadcast_arrays(
        u, v, share, back * cx, back * cy, narrow
    )
    held = (
        xp.stop_gradient(each)
        for each in (u, v, share, cx[..., :1], cy[..., :1], narrow[..., :1])
    )
    pressing = xp.pressing(*held)

    one = xp.where(pressing, share, 0.0)
    own = one.sum(-1, keepdims=True)
    mx = mean(u, one) / own
    my = mean(v, one) / own
    du = u - mx
    dv = v - my
    soft = xp.where(narrow[..., :1] | ~pressing.all(-1)[..., None], SOFTNESS, 0.0)
    xx = mean(du * du, one) + soft
    xy = mean(du * dv, one)
    yy = mean(dv * dv, one) + soft
    right = cx - mx
    up = cy - my
    per = 1.0 / (xx * yy - xy * xy)
    a = per * (yy * right - xy * up)
    b = per * (xx * up - xy * right)
    plane = 1.0 / own + a * du + b * dv
    pressed = xp.where(pressing, share * xp.where(plane > 0.0, plane, 0.0), 0.0)
    found = pressed.sum(-1, keepdims=True)
    return xp.where(
        total > 0.0, pressed * total / xp.where(found > 0.0, found, 1.0), weights
    )


class Pressed(NamedTuple):
    """A model whose pressure has followed its load."""

    contact: Any
    moved: Any
    """Displacement of the patch `[..., 2]` [m]; None of cells, which share the load in another way."""

    def seen(self, xp: Any, twist: Any) -> Any:
        """Return the twist that the patch sees."""
        return twist if self.moved is None else twist_at(xp, twist, self.moved)

    def pull(self, xp: Any, wrench: Any) -> Any:
        """Return its wrench about the origin."""
        return wrench if self.moved is None else wrench_from(xp, wrench, self.moved)


def _shared(xp: Any, levers: Any, weights: Any, remainder: Any, centre: Any) -> Any:
    return tilted(
        xp, positions_of(xp, levers) + xp.stop_gradient(remainder), weights, centre
    )


def follow(xp: Any, equations: Any, contact: Any, centre: Any) -> Pressed:
    """Return a model with its pressure about `centre` `[..., 2]` [m]: cells share the load, another patch moves."""
    shape = contact.shape
    if isinstance(shape, Cells):
        weights = xp.in_double(partial(_shared, xp), *shape[:3], centre)[..., None, :]
        return Pressed(contact._replace(shape=shape._replace(weights=weights)), None)
    return Pressed(contact, centre - xp.stack(equations.centre(shape), -1))
