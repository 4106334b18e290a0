"""Changes of functions along a direction: the same derivatives as in reverse, once and twice."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from planarfriction._engine.bristles.points import step as cell
from planarfriction._engine.codegen.derive import NotStraightError, derive
from planarfriction._engine.codegen.forward import forward, forwards
from planarfriction._engine.codegen.vectors import dot, norm, plus, square, times
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction.formulas import LawNumbers

LAW = LawNumbers(1e5, 300.0, 0.4, 0.5, 0.8, 1e-3, 1.7, 1.0, 0.3, 0.0)

_pushed = forward(cell, ("z", "u"), ("z", "u"))
_forth, _back = derive(cell, ("z", "u"), ("z", "u"))[-2:]


@njit
def _both(law, z, u, dt, dz, du, bar_new, bar_pull):
    new, pull, d_new, d_pull = _pushed(law, z, u, dt, dz, du)
    found, tape = _forth(law, z, u, dt)
    by_z, by_u = _back(tape, (bar_new, bar_pull))
    return (
        (new, pull),
        found,
        dot(bar_new, d_new) + dot(bar_pull, d_pull),
        dot(by_z, dz) + dot(by_u, du),
    )


def test_forwards_and_reverse_agree_on_the_step_of_a_bristle():
    rng = np.random.default_rng(0)
    for _ in range(200):
        z, u, dz, du = (
            tuple(scale * rng.normal(size=2)) for scale in (3e-6, 5e-3, 1e-6, 1e-3)
        )
        dt = 10.0 ** rng.uniform(-6.0, -2.0)
        step, found, forwards, reverse = _both(
            LAW, z, u, dt, dz, du, (1e6, -2e6), (1.0, 0.5)
        )
        for one, other in zip(step, found, strict=True):
            assert one == pytest.approx(
                other, rel=1e-13, abs=1e-14 * max(map(abs, other))
            )
        assert forwards == pytest.approx(reverse, rel=1e-9, abs=1e-9)


@kernel
def _curved(z, k):
    x, y = z
    return times(xp.exp(-x / k) / norm(z), (square(z), x * xp.sin(y))), -xp.power(
        y, k
    ) + xp.log(y) * xp.cos(x)


_once = forward(_curved, ("z",), ("z",))


@kernel
def _slopes(z, k, d):
    _, _, d_first, d_second = _once(z, k, d)
    return d_first, d_second


_TWICE = derive(_slopes, ("z",), ("z", "d"))
_forth_twice, _back_twice = _TWICE.forth, _TWICE.back


@njit
def _curvature(z, k, d, a, b):
    """a' d^2f_1 d and b d^2f_2 d, as a gradient, and the change along d itself."""
    found, tape = _forth_twice(z, k, d)
    return found, _back_twice(tape, (a, b))[0]


def test_a_change_is_differentiated_once_more():
    z = np.array([0.4, 0.9])
    k = 1.5
    d = (0.3, -0.7)
    a = (0.6, 1.1)
    b = -0.8
    h = 1e-5

    def cost(x) -> float:
        (one, other), _ = _curvature(tuple(x), k, d, a, b)
        return a[0] * one[0] + a[1] * one[1] + b * other

    expected = [(cost(z + h * e) - cost(z - h * e)) / (2.0 * h) for e in np.eye(2)]
    assert _curvature(tuple(z), k, d, a, b)[1] == pytest.approx(expected, rel=1e-8)


def test_what_is_no_straight_line_is_named():
    def loops(z):
        for _ in range(3):
            z = plus(z, 1.0, z)
        return z

    with pytest.raises(NotStraightError, match="is no assignment and no return"):
        forward(loops, ("z",), ("z",))


def test_several_directions_skip_what_does_not_change():
    """`sigma_1` and `sigma_2` move no bristle; other changes are those along one direction."""
    names = "sigma_0", "sigma_1", "sigma_2", "v_s"
    directions = tuple(
        (f"law.{name}", "z")[: 1 if name in ("sigma_1", "sigma_2") else 2]
        for name in names
    )
    many, moved = forwards(cell, directions, ("z", "u"))
    assert moved == ((True, True), (False, True), (False, True), (True, True))
    first, second, third, fourth = (forward(cell, by, ("z", "u")) for by in directions)

    @njit
    def both(law, z, u, dt, dz):
        one = first(law, z, u, dt, 1.0, dz)
        two = fourth(law, z, u, dt, 1.0, dz)
        three = second(law, z, u, dt, 1.0)
        four = third(law, z, u, dt, 1.0)
        return many(law, z, u, dt, 1.0, dz, 1.0, 1.0, 1.0, dz), (
            *one,
            *three[2:],
            *four[2:],
            *two[2:],
        )

    found, expected = both(LAW, (2e-6, -1e-6), (4e-3, 1e-3), 1e-4, (1e-6, 2e-6))
    np.testing.assert_allclose(found, expected, rtol=1e-12)
