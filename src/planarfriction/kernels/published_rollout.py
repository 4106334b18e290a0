"""Roll-outs of the reduced model and their discrete adjoint, `LANES` contacts abreast in vector code.

Contacts advance together, a chunk of steps at a time. All numbers of a chunk lie in one flat array `w`: field after
field of `SLOTS` numbers, a slot for each step and contact. What belongs to a contact alone lies likewise in `own`, in
fields of `LANES` numbers. That lets the compiler vectorise: offsets between fields are constants, so that it sees that
no two fields meet, and indices are sums of constants and a counter, so that it sees that none is negative. What does
not depend on the bristles (the limit surface) is done for all slots of a chunk first.

`rows` [B or 1, NUMBERS] (see `published_adjoint`), `twist` [B or 1, T, 3], `load` [B or 1, T] and `dt` [T], each held
over its step.
"""

from __future__ import annotations

import math

import numpy as np

from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import inlined, jit, kernel
from planarfriction.kernels.law import LawNumbers
from planarfriction.kernels.published_adjoint import NUMBERS, Shape, linearise, pull_back, row_of, scaled_twist, wrench
from planarfriction.kernels.surfaces import (
    BILINEAR,
    bilinear_blend,
    bilinear_frame,
    bilinear_inset,
    place,
    sliding,
    sliding_jacobian,
)

LANES = 8
SLOTS = 128

# Nearer to the spin axis (tangent of the angle, squared) u is looked up: the product of its Jacobian with V_S, which is
# the same and costs less, loses digits to the large slopes there, and the Jacobian is not quite that of this place.
_NEAR_AXIS = 1e-6

# Fields of `w`. The table's place and corners lie where the sliding and its Jacobian come to lie.
TWIST, SLIDING = 0, 3 * SLOTS
SLOPE_X, SLOPE_Y, SLOPE_S = 6 * SLOTS, 9 * SLOTS, 12 * SLOTS
OMEGA, LOAD, WRENCH, STATE = 15 * SLOTS, 16 * SLOTS, 17 * SLOTS, 20 * SLOTS
TWIST_BAR, LOAD_BAR, PLACE = 23 * SLOTS, 26 * SLOTS, 27 * SLOTS
FIELDS = 31 * SLOTS

# Fields of `own`: numbers of the contact and their gradient, and what one step hands to the next.
ROW, ROW_BAR, CARRY = 0, NUMBERS * LANES, 2 * NUMBERS * LANES
OWN = (2 * NUMBERS + 3) * LANES


# ---------------------------------------------------------------------- limit surface, for all slots


@kernel
def _places(w, count, size):
    """Corner and position in the bilinear table of each twist, and its polar angle."""
    row = 4 * (4 * size + 1)
    for i in range(count):
        x, y, s = w[TWIST + i], w[TWIST + SLOTS + i], w[TWIST + 2 * SLOTS + i]
        mirror = xp.where(s < 0.0, -1.0, 1.0)
        p, q, a, b, polar, _ = place(size, mirror * x, mirror * y, mirror * s)
        w[PLACE + i], w[PLACE + SLOTS + i] = float(p * row + 4 * q), a
        w[PLACE + 2 * SLOTS + i], w[PLACE + 3 * SLOTS + i] = b, polar


@kernel
def _corners(w, count, data, start, size):
    """The four corners of `h`, where `u` and its Jacobian will lie."""
    row = 4 * (4 * size + 1)
    for i in range(count):
        p = start + int(w[PLACE + i])
        for c in range(3):
            w[SLIDING + 4 * c * SLOTS + i] = data[p + c]
            w[SLIDING + (4 * c + 1) * SLOTS + i] = data[p + c + 4]
            w[SLIDING + (4 * c + 2) * SLOTS + i] = data[p + c + row]
            w[SLIDING + (4 * c + 3) * SLOTS + i] = data[p + c + row + 4]


@inlined
def _corner(w, c, i, a, b):
    at = SLIDING + 4 * c * SLOTS + i
    return bilinear_blend(w[at], w[at + SLOTS], w[at + 2 * SLOTS], w[at + 3 * SLOTS], a, b)


@inlined
def _slot(w, field, i):
    return w[field + i], w[field + SLOTS + i], w[field + 2 * SLOTS + i]


@inlined
def _put(w, field, i, a, b, c):
    w[field + i], w[field + SLOTS + i], w[field + 2 * SLOTS + i] = a, b, c


@kernel
def _bilinear(w, count):
    for i in range(count):
        x, y, s = _slot(w, TWIST, i)
        a, b = w[PLACE + SLOTS + i], w[PLACE + 2 * SLOTS + i]
        scale = xp.where(s < 0.0, -1.0, 1.0) * math.sqrt(x * x + y * y + s * s)
        hx, hy, hs = _corner(w, 0, i, a, b)[0], _corner(w, 1, i, a, b)[0], _corner(w, 2, i, a, b)[0]
        _put(w, SLIDING, i, scale * hx, scale * hy, scale * hs)


@inlined
def _slope_row(corner, frame, moving, c):
    """A row of `du/dV_S`; that of the ellipsoid at rest."""
    radial, polar, azimuth = frame
    x = corner[0] * radial[0] + corner[1] * polar[0] + corner[2] * azimuth[0]
    y = corner[0] * radial[1] + corner[1] * polar[1] + corner[2] * azimuth[1]
    s = corner[0] * radial[2] + corner[1] * polar[2] + corner[2] * azimuth[2]
    return (
        xp.where(moving, x, 1.0 if c == 0 else 0.0),
        xp.where(moving, y, 1.0 if c == 1 else 0.0),
        xp.where(moving, s, 1.0 if c == 2 else 0.0),
    )


@kernel
def _bilinear_slopes(w, count, size):
    for i in range(count):
        x, y, s = _slot(w, TWIST, i)
        a, b, polar = w[PLACE + SLOTS + i], w[PLACE + 2 * SLOTS + i], w[PLACE + 3 * SLOTS + i]
        v = math.sqrt(x * x + y * y + s * s)
        mirror = xp.where(s < 0.0, -1.0, 1.0)
        frame = bilinear_frame(size, mirror * x, mirror * y, mirror * s, polar)
        inset = bilinear_inset(size, a, polar)
        hx, hy, hs = _corner(w, 0, i, a, b)[0], _corner(w, 1, i, a, b)[0], _corner(w, 2, i, a, b)[0]
        jx = _slope_row(_corner(w, 0, i, inset, b), frame, v > 0.0, 0)
        jy = _slope_row(_corner(w, 1, i, inset, b), frame, v > 0.0, 1)
        js = _slope_row(_corner(w, 2, i, inset, b), frame, v > 0.0, 2)
        _put(w, SLIDING, i, mirror * v * hx, mirror * v * hy, mirror * v * hs)
        _put(w, SLOPE_X, i, jx[0], jx[1], jx[2])
        _put(w, SLOPE_Y, i, jy[0], jy[1], jy[2])
        _put(w, SLOPE_S, i, js[0], js[1], js[2])


@kernel
def _surface(w, count, surface, data, slopes, j):
    """`u` and, with `slopes`, its Jacobian for all slots; `j` [9]: scratch."""
    kind, start, size = surface[0], surface[1], surface[2]
    if kind == BILINEAR:
        _places(w, count, size)
        _corners(w, count, data, start, size)
        if slopes:
            _bilinear_slopes(w, count, size)
        else:
            _bilinear(w, count)
        return
    for i in range(count):
        x, y, s = _slot(w, TWIST, i)
        v = math.sqrt(x * x + y * y + s * s)
        if slopes:
            sliding_jacobian(kind, data, start, size, x, y, s, v, j)
            for m in range(9):
                w[SLOPE_X + m * SLOTS + i] = j[m]
        if slopes and x * x + y * y > _NEAR_AXIS * s * s:
            ux, uy, us = j[0] * x + j[1] * y + j[2] * s, j[3] * x + j[4] * y + j[5] * s, j[6] * x + j[7] * y + j[8] * s
        else:
            ux, uy, us = sliding(kind, data, start, size, x, y, s, v)
        _put(w, SLIDING, i, ux, uy, us)


# ---------------------------------------------------------------------- steps, for the contacts abreast


@inlined
def _law(own, c):
    return LawNumbers(
        own[ROW + c], own[ROW + LANES + c], own[ROW + 2 * LANES + c],
        own[ROW + 3 * LANES + c], own[ROW + 4 * LANES + c], own[ROW + 5 * LANES + c],
        own[ROW + 6 * LANES + c], own[ROW + 7 * LANES + c], own[ROW + 8 * LANES + c], own[ROW + 9 * LANES + c],
    )  # fmt: skip


@inlined
def _shape(own, c):
    return Shape(
        own[ROW + 10 * LANES + c], own[ROW + 11 * LANES + c], own[ROW + 12 * LANES + c], own[ROW + 13 * LANES + c]
    )


@inlined
def _carried(own, c):
    return own[CARRY + c], own[CARRY + LANES + c], own[CARRY + 2 * LANES + c]


@inlined
def _carry(own, c, x, y, t):
    own[CARRY + c], own[CARRY + LANES + c], own[CARRY + 2 * LANES + c] = x, y, t


@inlined
def _forward_one(w, own, c, dt):
    law, shape = _law(own, c), _shape(own, c)
    x, y, s = _slot(w, TWIST, c)
    ux, uy, us = _slot(w, SLIDING, c)
    zx, zy, zt = _carried(own, c)
    load = w[LOAD + c]
    step = linearise(law, shape, x, y, s, ux, uy, us, zx, zy, zt, dt)
    fx, fy, tau = wrench(law, shape, step, w[OMEGA + c])
    _put(w, STATE, c, zx, zy, zt)
    b, none = step.bristle, load == 0.0
    _put(w, WRENCH, c, xp.where(none, 0.0, load * fx), xp.where(none, 0.0, load * fy), xp.where(none, 0.0, load * tau))
    _carry(own, c, xp.where(none, 0.0, b.nx), xp.where(none, 0.0, b.ny), xp.where(none, 0.0, shape.r * b.ns))


@kernel
def _forward(w, own, lanes, dt):
    """One step of the contacts, whose slots begin at the start of `w`."""
    for c in range(lanes):  # the body apart: inlined later, it leaves the compiler a loop that it can count
        _forward_one(w, own, c, dt)


@inlined
def _backward_one(w, own, c, dt):
    law, shape = _law(own, c), _shape(own, c)
    x, y, s = _slot(w, TWIST, c)
    ux, uy, us = _slot(w, SLIDING, c)
    zx, zy, zt = _slot(w, STATE, c)
    wx, wy, wt = _slot(w, WRENCH, c)
    step = linearise(law, shape, x, y, s, ux, uy, us, zx, zy, zt, dt)
    zx, zy, zt = _carried(own, c)
    jx, jy, js = _slot(w, SLOPE_X, c), _slot(w, SLOPE_Y, c), _slot(w, SLOPE_S, c)
    slope = (jx[0], jx[1], jx[2], jy[0], jy[1], jy[2], js[0], js[1], js[2])
    bar = pull_back(law, shape, step, slope, w[OMEGA + c], w[LOAD + c], dt, wx, wy, wt, zx, zy, zt)
    _carry(own, c, bar.zx, bar.zy, bar.zt)
    _put(w, TWIST_BAR, c, bar.vx, bar.vy, bar.omega)
    w[LOAD_BAR + c] = bar.load
    own[ROW_BAR + c] += bar.sigma_0
    own[ROW_BAR + LANES + c] += bar.sigma_1
    own[ROW_BAR + 2 * LANES + c] += bar.sigma_2
    own[ROW_BAR + 3 * LANES + c] += bar.mu_c
    own[ROW_BAR + 4 * LANES + c] += bar.mu_s
    own[ROW_BAR + 5 * LANES + c] += bar.v_s
    own[ROW_BAR + 6 * LANES + c] += bar.gamma
    own[ROW_BAR + 8 * LANES + c] += bar.breakaway_ratio
    own[ROW_BAR + 10 * LANES + c] += bar.centre_x
    own[ROW_BAR + 11 * LANES + c] += bar.centre_y
    own[ROW_BAR + 12 * LANES + c] += bar.contact_radius
    own[ROW_BAR + 13 * LANES + c] += bar.second_moment


@kernel
def _backward(w, own, lanes, dt):
    """One step of the contacts backwards: carries the cotangent of the state."""
    for c in range(lanes):
        _backward_one(w, own, c, dt)


# ---------------------------------------------------------------------- roll-outs


@kernel
def _begin(own, rows, carried, first, lanes):
    """Rows of the contacts from `first` on, and what they carry; no gradient yet."""
    for c in range(lanes):
        row = rows[row_of(first + c, len(rows))]
        for m in range(NUMBERS):
            own[ROW + m * LANES + c] = row[m]
            own[ROW_BAR + m * LANES + c] = 0.0
        _carry(own, c, carried[first + c, 0], carried[first + c, 1], carried[first + c, 2])


@kernel
def _read(w, own, twist, load, first, lanes, begin, end):
    """Scaled twists, spins and loads of the steps from `begin` to `end`."""
    for c in range(lanes):
        shape = _shape(own, c)
        twists, loads = twist[row_of(first + c, len(twist))], load[row_of(first + c, len(load))]
        for t in range(begin, end):
            i = (t - begin) * lanes + c
            x, y, s = scaled_twist(shape, twists[t, 0], twists[t, 1], twists[t, 2])
            _put(w, TWIST, i, x, y, s)
            w[OMEGA + i], w[LOAD + i] = twists[t, 2], loads[t]


@kernel
def _copy_in(w, field, values, first, lanes, begin, end):
    """Three components of each step into a field."""
    for c in range(lanes):
        own = values[row_of(first + c, len(values))]
        for t in range(begin, end):
            _put(w, field, (t - begin) * lanes + c, own[t, 0], own[t, 1], own[t, 2])


@kernel
def _copy_out(w, field, values, first, lanes, begin, end):
    """A field into three components of each step."""
    for c in range(lanes):
        own = values[first + c]
        for t in range(begin, end):
            own[t, 0], own[t, 1], own[t, 2] = _slot(w, field, (t - begin) * lanes + c)


@jit
def rollout(rows, surface, data, z, twist, load, dt, first, last, wrench, states):
    """Steps of the contacts `first` to `last`: `z` [B, 3] in place, wrenches into `wrench` [B, T, 3].

    The state before each step goes into `states` [B, T, 3], unless that is empty.
    """
    w, own, scratch, steps = np.empty(FIELDS), np.empty(OWN), np.empty(9), dt.shape[0]
    for b in range(first, last, LANES):
        lanes = min(LANES, last - b)
        chunk = SLOTS // lanes
        _begin(own, rows, z, b, lanes)
        for begin in range(0, steps, chunk):
            end = min(begin + chunk, steps)
            _read(w, own, twist, load, b, lanes, begin, end)
            _surface(w, (end - begin) * lanes, surface, data, False, scratch)
            for t in range(begin, end):
                _forward(w[(t - begin) * lanes :], own, lanes, dt[t])
            _copy_out(w, WRENCH, wrench, b, lanes, begin, end)
            if states.shape[1] > 0:
                _copy_out(w, STATE, states, b, lanes, begin, end)
        for c in range(lanes):
            z[b + c, 0], z[b + c, 1], z[b + c, 2] = _carried(own, c)


@jit
def gradient(
    rows, surface, data, states, twist, load, dt, wrench_bar, first, last, z_bar, twist_bar, load_bar, row_bar
):
    """Adjoint of `rollout` with its `states`; `z_bar` [B, 3] comes in as the cotangent of the state at the end.

    `wrench_bar` [B or 1, T, 3]; `twist_bar` [B, T, 3], `load_bar` [B, T] and `row_bar` [B, NUMBERS] are written.
    """
    w, own, scratch, steps = np.empty(FIELDS), np.empty(OWN), np.empty(9), dt.shape[0]
    for b in range(first, last, LANES):
        lanes = min(LANES, last - b)
        chunk = SLOTS // lanes
        _begin(own, rows, z_bar, b, lanes)
        for end in range(steps, 0, -chunk):
            begin = max(end - chunk, 0)
            _read(w, own, twist, load, b, lanes, begin, end)
            _copy_in(w, STATE, states, b, lanes, begin, end)
            _copy_in(w, WRENCH, wrench_bar, b, lanes, begin, end)
            _surface(w, (end - begin) * lanes, surface, data, True, scratch)
            for t in range(end - 1, begin - 1, -1):
                _backward(w[(t - begin) * lanes :], own, lanes, dt[t])
            _copy_out(w, TWIST_BAR, twist_bar, b, lanes, begin, end)
            for c in range(lanes):
                for t in range(begin, end):
                    load_bar[b + c, t] = w[LOAD_BAR + (t - begin) * lanes + c]
        for c in range(lanes):
            z_bar[b + c, 0], z_bar[b + c, 1], z_bar[b + c, 2] = _carried(own, c)
            for m in range(NUMBERS):
                row_bar[b + c, m] = own[ROW_BAR + m * LANES + c]
