"""Rule for the places of patches in their contacts, one for all simulators.

A patch lies in the plane of its contact. Its origin is that of its site or frame, moved along the normal into this
plane; where a curved side touches, it is the centre of the contact forces, which move over a body that rolls. The
functions have no branches: MuJoCo's and MuJoCo Warp's loops compile them, MJX traces them, Drake calls them.
"""

# No `from __future__ import annotations` here: Warp reads the types themselves.

import functools
import types
from collections.abc import Callable
from typing import Any

import numpy as np

AUTO = 0
"""Origin at the centre of the contact forces where a curved side touches, else at the site."""

AT_SITE = 1
"""Origin at the site or frame of the patch, moved into the plane of the contact."""

AT_CONTACT = 2
"""Origin at the centre of the contact forces."""

OWN = 1
"""Bit of a cylinder on the patch's own body, whose curved side may touch."""

OTHER = 2
"""Bit of a cylinder on the other body."""

ROUND = 4
"""Bit of a shape that is curved all over, on either body."""

CURVED = 0.5
"""Square of the sine of the angle between a cylinder's axis and the normal above which its curved side touches."""

ALONG = 1e-12
"""Square of the sine of the angle between a frame's x axis and the normal below which its y axis takes its place."""

FLAT = 0.25
"""Square of that sine below which a patch that was in contact before keeps its x axis, carried along with its body."""

MARGIN = 0.1
"""Share of its size by which a patch may lie beside its contact, and sine of the least angle of x to the normal."""

BEYOND = 1
"""Fault of a patch: the contact forces act beyond it."""

ALONG_X = 2
"""Fault of a patch: the x axis of its site or frame lies along the normal."""

FAULTS = 3
"""Number of faults, none included: 0."""

_FAULTS = {
    BEYOND: 'contact forces act beyond the patch: put the {} into the contact, or use centre="contact"',
    ALONG_X: "its x axis lies along the normal of the contact, where its y axis takes its place",
}


def onto_plane(place: Any, middle: Any, normal: Any) -> Any:
    """Return a place `[3]` moved along the normal onto the plane through the `middle` of the contact points."""
    x = middle[0] - place[0]
    y = middle[1] - place[1]
    z = middle[2] - place[2]
    height = normal[0] * x + normal[1] * y + normal[2] * z
    return (
        place[0] + height * normal[0],
        place[1] + height * normal[1],
        place[2] + height * normal[2],
    )


def bend(
    over: Any, tilt: Any, both: Any, normal: Any, apart: Any, when: Any, dt: Any
) -> Any:
    """Return what the velocity of a patch gains in half a step as its contact moves on and its normal turns `[3]`.

        dt/2 (b + u_n n x (w_a + w_b)),    b = (v - (n . v) n) x (w_a - w_b),    u_n = u_n0 +- dt/2 n . b

    v (`over`) is the velocity of the smaller body's surface less that of this body's centre, and `tilt` the difference
    of the two spins: the contact goes along with the centre, over material that turns. u_n0 (`apart`) is the mean speed
    at which the two points that touch leave each other, in this step (`when` = 1) or in the last one (-1), u_n that of
    the surfaces, and `both` the sum of the spins: what leaves, leaves along the normal, which turns too.
    """
    half = 0.5 * dt
    along = normal[0] * over[0] + normal[1] * over[1] + normal[2] * over[2]
    x = over[0] - along * normal[0]
    y = over[1] - along * normal[1]
    z = over[2] - along * normal[2]
    first = y * tilt[2] - z * tilt[1]
    second = z * tilt[0] - x * tilt[2]
    third = x * tilt[1] - y * tilt[0]
    leaves = apart + when * half * (
        normal[0] * first + normal[1] * second + normal[2] * third
    )
    first += leaves * (normal[1] * both[2] - normal[2] * both[1])
    second += leaves * (normal[2] * both[0] - normal[0] * both[2])
    third += leaves * (normal[0] * both[1] - normal[1] * both[0])
    return half * first, half * second, half * third


def where(condition: Any, one: Any, other: Any) -> Any:
    """Return one value where the condition holds, else the other."""
    return one if condition else other


def x_axis(x: Any, y: Any, last: Any, normal: Any) -> Any:
    """Return the x axis of a patch `[3]`, and cosine and sine of the angle to it from the last one, carried along.

    x and y are axes of its site or frame, and `last` is its x axis of the last step, which went along with its body:
    their parts across the normal. x is turned to the side of the last one, which takes its place below `FLAT`; without
    a last one y takes the place of x below `ALONG`, and the angle is 0.
    """
    flat = x[0] * x[0] + x[1] * x[1] + x[2] * x[2]
    kept = last[0] * last[0] + last[1] * last[1] + last[2] * last[2]
    carried = kept >= ALONG
    keeps = where(carried, where(flat < FLAT, 1.0, 0.0), 0.0)
    other = where(carried, 0.0, where(flat < ALONG, 1.0, 0.0))
    side = where(x[0] * last[0] + x[1] * last[1] + x[2] * last[2] < 0.0, -1.0, 1.0)
    own = where(carried, side, 1.0) * (1.0 - keeps - other)
    a = own * x[0] + keeps * last[0] + other * y[0]
    b = own * x[1] + keeps * last[1] + other * y[1]
    c = own * x[2] + keeps * last[2] + other * y[2]
    size = (a * a + b * b + c * c) ** 0.5
    a = a / size
    b = b / size
    c = c / size
    per = where(carried, kept, 1.0) ** -0.5
    cosine = per * (last[0] * a + last[1] * b + last[2] * c)
    sine = normal[0] * (last[1] * c - last[2] * b) + normal[1] * (
        last[2] * a - last[0] * c
    )
    sine += normal[2] * (last[0] * b - last[1] * a)
    return a, b, c, where(carried, cosine, 1.0), where(carried, per * sine, 0.0)


def x_axis_with(choose: Callable[..., Any]) -> Callable[..., Any]:
    """Return `x_axis` for numbers among which a function of its own chooses, in place of `where`."""
    function = types.FunctionType(x_axis.__code__, {**globals(), "where": choose})
    return functools.update_wrapper(function, x_axis)


def across(axis: Any, normal: Any) -> Any:
    """Return the square of the sine of the angle between an axis and the normal, both of length 1."""
    along = axis[0] * normal[0] + axis[1] * normal[1] + axis[2] * normal[2]
    return 1.0 - along * along


def excess(x: Any, y: Any, scale: Any, reach: Any) -> Any:
    """Return the distances in x and y [m] by which a point lies beyond a patch resized by `scale`; < 0 within it."""
    return abs(x - scale * reach[0]) - scale * reach[2], abs(
        y - scale * reach[1]
    ) - scale * reach[3]


def reach_of(patch: Any) -> tuple[float, ...]:
    """Return the middle of a patch in x and y, and its half widths, with the margin of its size, [4] [m]."""
    half = 0.5 * np.sqrt(patch.areas.max())
    least = patch.positions.min(axis=0) - half
    largest = patch.positions.max(axis=0) + half
    margin = MARGIN * size_of(patch)
    return *(0.5 * (least + largest)).tolist(), *(
        0.5 * (largest - least) + margin
    ).tolist()


def size_of(patch: Any) -> float:
    """Return the largest distance of a patch from its origin [m]."""
    return float(np.hypot(*patch.positions.T).max() + 0.5 * np.sqrt(patch.areas.max()))


def fault_line(kind: str, name: str, between: tuple[str, str], fault: int) -> str:
    """Return a line about a patch that does not lie in its contact; `kind` is that of its place, a site or frame."""
    return f"{kind} {name} of the contact between {' and '.join(between)}: {_FAULTS[fault].format(kind)}"
