"""Roll-outs of the published reduced model and their adjoint, in vector code (see `lanes`)."""

from __future__ import annotations

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import jit, kernel
from planarfriction.kernels import lanes
from planarfriction.kernels.bind import bind
from planarfriction.kernels.lanes import FIELDS, LANES, OMEGA, OWN, ROW, SLOTS, TWIST, LaneModel, put_slot, slot
from planarfriction.kernels.law import LAW, LawNumbers
from planarfriction.kernels.moment_steps import Contact
from planarfriction.kernels.published_contact import PublishedPatch
from planarfriction.kernels.published_step import NAMES, HeldTwist, pull_back, scaled_twist, taped_step
from planarfriction.kernels.surfaces import (
    BILINEAR,
    bilinear_blend,
    bilinear_frame,
    bilinear_inset,
    place,
    sliding,
    sliding_jacobian,
)
from planarfriction.kernels.vectors import gathered, norm, times

_NUMBERS = len(NAMES)

# Fields of `w`. The table's corners lie where the sliding and its slopes come to lie.
_SLIDING, _SLOPES, _PLACE, _END = (FIELDS + SLOTS * n for n in (0, 3, 12, 16))

_SCRATCH = OWN
"""Nine numbers in `own`."""


# ---------------------------------------------------------------------- limit surface, for all slots


@kernel
def _places(w, count, size):
    """Find the corner and the position of each twist in the bilinear table, and its polar angle."""
    row = 4 * (4 * size + 1)
    for i in range(count):
        x, y, s = slot(w, TWIST, i)
        mirror = xp.where(s < 0.0, -1.0, 1.0)
        p, q, a, b, polar, _ = place(size, mirror * x, mirror * y, mirror * s)
        w[_PLACE + i], w[_PLACE + 3 * SLOTS + i] = float(p * row + 4 * q), polar
        w[_PLACE + SLOTS + i], w[_PLACE + 2 * SLOTS + i] = a, b


@kernel
def _corners(w, count, data, start, size):
    """Read the four corners of `h` to the place where `u` and its slopes will lie."""
    row = 4 * (4 * size + 1)
    for i in range(count):
        p = start + int(w[_PLACE + i])
        for c in range(3):
            at = _SLIDING + 4 * c * SLOTS + i
            w[at], w[at + SLOTS] = data[p + c], data[p + c + 4]
            w[at + 2 * SLOTS], w[at + 3 * SLOTS] = data[p + c + row], data[p + c + row + 4]


@kernel
def _corner(w, c, i, a, b):
    at = _SLIDING + 4 * c * SLOTS + i
    return bilinear_blend(w[at], w[at + SLOTS], w[at + 2 * SLOTS], w[at + 3 * SLOTS], a, b)


@kernel
def _slope_row(corner, frame, moving, c):
    """Return a row of `du/dV_S`; that of the ellipsoid at rest."""
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
def _bilinear_one(w, i, a, b):
    """Return `u` of a slot, its speed, and the twist mirrored to the positive side of the equator."""
    twist = slot(w, TWIST, i)
    v, mirror = norm(twist), xp.where(twist[2] < 0.0, -1.0, 1.0)
    h = _corner(w, 0, i, a, b)[0], _corner(w, 1, i, a, b)[0], _corner(w, 2, i, a, b)[0]
    return times(mirror * v, h), v, times(mirror, twist)


@kernel
def _bilinear(w, count):
    """Compute `u` from the corners."""
    for i in range(count):
        put_slot(w, _SLIDING, i, _bilinear_one(w, i, w[_PLACE + SLOTS + i], w[_PLACE + 2 * SLOTS + i])[0])


@kernel
def _bilinear_slopes(w, count, size):
    """Compute `u` and its Jacobian from the corners."""
    for i in range(count):
        a, b, polar = slot(w, _PLACE + SLOTS, i)
        u, v, (x, y, s) = _bilinear_one(w, i, a, b)
        frame, inset = bilinear_frame(size, x, y, s, polar), bilinear_inset(size, a, polar)
        jx = _slope_row(_corner(w, 0, i, inset, b), frame, v > 0.0, 0)
        jy = _slope_row(_corner(w, 1, i, inset, b), frame, v > 0.0, 1)
        js = _slope_row(_corner(w, 2, i, inset, b), frame, v > 0.0, 2)
        put_slot(w, _SLIDING, i, u)
        put_slot(w, _SLOPES, i, jx)
        put_slot(w, _SLOPES + 3 * SLOTS, i, jy)
        put_slot(w, _SLOPES + 6 * SLOTS, i, js)


@kernel
def _surface(w, count, surface, data, slopes, j):
    """Compute `u` and, with `slopes`, its Jacobian for all slots; `j` [9]: scratch."""
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
        x, y, s = twist = slot(w, TWIST, i)
        v = norm(twist)
        put_slot(w, _SLIDING, i, sliding(kind, data, start, size, x, y, s, v))
        if slopes:
            sliding_jacobian(kind, data, start, size, x, y, s, v, j)
            for m in range(9):
                w[_SLOPES + m * SLOTS + i] = j[m]


# ---------------------------------------------------------------------- bound to this model


@kernel
def _begin(own, c, surface, data):
    pass


@kernel
def _contact(own, c):
    row = gathered(own, ROW + c, LANES, _NUMBERS)
    return Contact(LawNumbers(*row[:LAW]), PublishedPatch(*row[LAW:]), 0, 0)


@kernel
def _scaled(own, c, twist):
    return scaled_twist(_contact(own, c).shape, twist)


@kernel
def _prepare(w, own, inputs, lanes, steps, slopes):
    _surface(w, lanes * steps, inputs.surface[0, 0], inputs.data, slopes, own[_SCRATCH:])


@kernel
def _step(w, contact, c, z, dt):
    twist = slot(w, TWIST, c)
    return taped_step(contact, HeldTwist(twist, w[OMEGA + c], norm(twist), slot(w, _SLIDING, c)), z, dt)


@kernel
def _advance(w, own, c, z, none, dt):
    step = _step(w, _contact(own, c), c, z, dt)
    return step.new, step.wrench


@kernel
def _retreat(w, own, c, z, dt, new, pull):
    contact = _contact(own, c)
    step = _step(w, contact, c, z, dt)
    return step.wrench, pull_back(contact, step, gathered(w, _SLOPES + c, SLOTS, 9), new, pull)


_MODEL = LaneModel(_begin, _scaled, _prepare, _advance, _retreat, _END, OWN + 9)
rollout = bind(lanes.rollout, _MODEL, "published_rollout", jit)
gradient = bind(lanes.gradient, _MODEL, "published_gradient", jit)
