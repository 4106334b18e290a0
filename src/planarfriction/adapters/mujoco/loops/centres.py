"""Origins of patches that follow the contact forces, and patches that do not lie in their contacts.

The centre of the contact forces is known once these are, with the friction of the last step. The patch then moves
there, by as much as its bodies move on each other: forces on faces at rest jump about from step to step, as MuJoCo
finds other points or gives them other shares, and a patch that followed them would gradually release what it holds.
"""

from __future__ import annotations

import math

from planarfriction._engine.codegen.vectors import dot, plus, square, three
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import at, doubles, integers
from planarfriction._engine.coupled import placing
from planarfriction.adapters.mujoco.loops.geometry import (
    across,
    axes,
    column,
    is_at_contact,
    is_curved,
    owners_of,
    places_of,
)
from planarfriction.adapters.mujoco.loops.models import displacement_of, scale_of

FOLLOWS = 1e-3
"""Angle [rad] by which bodies roll on each other, and displacement in lever arms of the patch by which they slide, in a
step in which the origin moves all the way to the centre of the contact forces; less in proportion."""

excess = kernel(placing.excess)


@kernel
def _centre(d, own, s, nefc, p):
    """Return the force of the contacts of patch p, and their centre in its frame."""
    owners = owners_of(s, nefc)
    places = places_of(s, nefc)
    total = 0.0
    x = 0.0
    y = 0.0
    force = doubles(integers(d + own.data.efc_force)[0])
    for r in range(nefc):
        if owners[r] == p:
            total = total + force[r]
            x = x + force[r] * places[r]
            y = y + force[r] * places[nefc + r]
    return (total, x / total, y / total) if total > 0.0 else (0.0, 0.0, 0.0)


@kernel
def _share(own, d, s, p, radius, dt):
    """Return the share of the displacement to the centre that patch p, of a lever arm `radius`, takes in this step."""
    velocity = doubles(integers(d + own.data.qvel)[0])
    rows = at(s.jacobian, 3 * own.nv * p)
    vx = s.drift[3 * p]
    vy = s.drift[3 * p + 1]
    for i in range(own.nv):
        vx = vx + rows[i] * velocity[i]
        vy = vy + rows[own.nv + i] * velocity[i]
    slid = math.sqrt(vx * vx + vy * vy) / radius if radius > 0.0 else 0.0
    return xp.minimum(1.0, dt * (s.tilts[p] + slid) / FOLLOWS)


@kernel
def _move(own, s, nefc, p, guess, dx, dy):
    """Move the origin of patch p: its Jacobian, its contacts, and the guess of its wrench, whose forces stay."""
    nv = own.nv
    rows = at(s.jacobian, 3 * own.nv * p)
    frame = at(s.frames, 6 * p)
    for i in range(nv):
        rows[i] -= dy * rows[2 * nv + i]
        rows[nv + i] += dx * rows[2 * nv + i]
    s.drift[3 * p] -= dy * s.drift[3 * p + 2]
    s.drift[3 * p + 1] += dx * s.drift[3 * p + 2]
    guess[2] -= dx * guess[1] - dy * guess[0]
    owners = owners_of(s, nefc)
    places = places_of(s, nefc)
    for r in range(nefc):
        if owners[r] == p:
            places[r], places[nefc + r] = places[r] - dx, places[nefc + r] - dy
    x, y, _ = axes(s, p)
    frame[3], frame[4], frame[5] = plus(plus(three(at(frame, 3)), dx, x), dy, y)


@kernel
def _fault(own, m, d, s, p, x, y):
    """Return the fault of patch p, with the centre of its contact forces at x, y in its frame."""
    scale = scale_of(own, m, p)
    (dx, dy) = displacement_of(own, m, p)
    reach = at(doubles(own.extents), 4 * p)
    site = integers(own.site)[p]
    if (
        not is_at_contact(own, d, s, p)
        and xp.maximum(*excess(x - dx, y - dy, scale, reach)) > 0.0
    ):
        return placing.BEYOND
    along = column(at(doubles(integers(d + own.data.site_xmat)[0]), 9 * site), 0)
    upright = across(along, axes(s, p)[2]) < placing.MARGIN**2
    return placing.ALONG_X if upright and not is_curved(own, d, s, p) else 0


@kernel
def _support(own, m, d, s, p, support):
    """Write the face of the other geom, if it is a box, into the frame of patch p; none if they meet at an edge.

    Lengths are those of the patch in the size of its friction model.
    """
    other = integers(own.other)[p]
    shrunk = 1.0 / scale_of(own, m, p)
    support[4] = 0.0
    if integers(own.on_box)[p] == 0:
        return
    x, y, normal = axes(s, p)
    turned = at(doubles(integers(d + own.data.geom_xmat)[0]), 9 * other)
    half = at(doubles(integers(m + own.model.geom_size)[0]), 3 * other)
    place = three(at(doubles(integers(d + own.data.geom_xpos)[0]), 3 * other))
    away = plus(place, -1.0, three(at(s.frames, 6 * p + 3)))
    for k in range(3):
        if across(column(turned, k), normal) < placing.MARGIN**2:
            i = (k + 1) % 3
            j = (k + 2) % 3
            first = column(turned, i)
            support[0], support[1] = shrunk * dot(x, away), shrunk * dot(y, away)
            support[2], support[3] = dot(x, first), dot(y, first)
            support[4] = shrunk * half[i]
            support[5] = shrunk * half[j]


@kernel
def _resize(own, m, s, nefc, p, guess):
    """Displace patch p from its origin, and go over to twists, torques and places in the size of its friction model."""
    scale = scale_of(own, m, p)
    (dx, dy) = displacement_of(own, m, p)
    _move(own, s, nefc, p, guess, dx, dy)
    rows = at(s.jacobian, 3 * own.nv * p)
    owners = owners_of(s, nefc)
    places = places_of(s, nefc)
    for i in range(own.nv):
        rows[2 * own.nv + i] *= scale
    s.drift[3 * p + 2] *= scale
    guess[2] /= scale
    for r in range(nefc):
        if owners[r] == p:
            places[r], places[nefc + r] = places[r] / scale, places[nefc + r] / scale


@kernel
def follow_centres(own, m, d, s, nefc, radius, problem, kept):
    """Move origins towards the centres of the contact forces, remember them, and note a patch that is misplaced.

    Displace the patches from there, and write the faces that bear them (see `models`).
    """
    kept.misplaced[0], dt = 0.0, doubles(m + own.model.timestep)[0]
    for p in range(own.count):
        held = at(kept.held, 3 * p)
        centre = at(kept.centre, 3 * p)
        site = integers(own.site)[p]
        centre[0] = 0.0
        centre[1] = 0.0
        centre[2] = 0.0
        if s.counts[p] == 0:
            continue
        force, x, y = _centre(d, own, s, nefc, p)
        if force > 0.0:
            fault = _fault(own, m, d, s, p, x, y)
            if fault != 0:
                kept.misplaced[0] = placing.FAULTS * p + fault
        guess = at(problem.guess, 3 * p)
        if is_at_contact(own, d, s, p):
            lever = scale_of(own, m, p) * radius[p]
            share = (
                1.0 if square(three(held)) == 0.0 else _share(own, d, s, p, lever, dt)
            )
            _move(own, s, nefc, p, guess, share * x, share * y)
        turned = at(doubles(integers(d + own.data.site_xmat)[0]), 9 * site)
        place = three(at(doubles(integers(d + own.data.site_xpos)[0]), 3 * site))
        away = plus(three(at(s.frames, 6 * p + 3)), -1.0, place)
        for i in range(3):
            centre[i] = dot(column(turned, i), away)
        _resize(own, m, s, nefc, p, guess)
        _support(own, m, d, s, p, at(problem.support, 6 * p))
