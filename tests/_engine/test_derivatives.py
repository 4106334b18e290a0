"""Derivatives that are traced: against 60 digits and closed forms, forwards and backwards; refusals in one line."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest
from numba import njit

from planarfriction import formulas
from planarfriction._engine.bristles.points import step as cell
from planarfriction._engine.codegen.derivatives import derive, forward, forwards
from planarfriction._engine.codegen.ratios import per
from planarfriction._engine.codegen.rules import NotStraightError, primitive
from planarfriction._engine.codegen.symbolic_functions import twin
from planarfriction._engine.codegen.vectors import dot, norm, plus, square, times
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction.formulas import LawNumbers
from tests.support.referee import misfit, pulled

LAW = LawNumbers(1e5, 300.0, 0.4, 0.5, 0.8, 1e-3, 1.7, 1.0, 0.3, 0.0)
TWO = {"z": 2, "u": 2}


@kernel
def _traction(law, z, u):
    """A cell's friction while its bristle moves."""
    speed = norm(u)
    size = norm(z)
    grip = law.sigma_0 / formulas.stribeck(xp, speed, law)
    along = dot(z, u) * per(size)
    k = formulas.bristle_decay(xp, size * grip, along, speed, grip, law)
    rate = plus(u, -k, z)
    x, y = plus(times(-law.sigma_0, z), -law.sigma_1, rate)
    return (x - law.sigma_2 * u[0], y - law.sigma_2 * u[1]), k


BY = (
    "z",
    "u",
    "law.sigma_0",
    "law.sigma_1",
    "law.mu_c",
    "law.mu_s",
    "law.v_s",
    "law.gamma",
    "law.breakaway_ratio",
)
TRACTION = derive(_traction, BY, TWO)


def test_derivatives_are_those_of_60_digits():
    rng = np.random.default_rng(0)
    worst = 0.0
    for _ in range(100):
        (size, speed) = 10.0 ** rng.uniform([-12.0, -12.0], [-4.0, 0.0])
        (of_bristle, of_velocity) = rng.uniform(0, 6.28, 2)
        z = float(size * math.cos(of_bristle)), float(size * math.sin(of_bristle))
        u = float(speed * math.cos(of_velocity)), float(speed * math.sin(of_velocity))
        worst = max(worst, misfit(TRACTION, (LAW, z, u)))
    assert worst < 1e-12


def test_at_kinks_the_conventions_hold():
    @kernel
    def kinks(x, y):
        return (
            xp.minimum(x, y) + 10.0 * xp.maximum(x, y),
            xp.power(x, y),
            norm((x, x)),
            per(x),
            math.sqrt(x),
        )

    derived = derive(kinks, ("x", "y"), {})

    def pull(x, y, i):
        return pulled(
            derived.forth,
            derived.back,
            (x, y),
            tuple(1.0 if i == k else 0.0 for k in range(5)),
        )

    assert pull(2.0, 2.0, 0) == (11.0, 0.0)  # of equal numbers the first counts
    assert pull(0.0, 2.0, 1) == (0.0, 0.0)
    assert pull(0.0, 1.0, 1) == (1.0, 0.0)  # the limit from the right
    assert pull(0.0, 1.0, 2) == pull(0.0, 1.0, 3) == pull(0.0, 1.0, 4) == (0.0, 0.0)


def test_elementary_functions_have_their_derivatives():
    """Each against its derivative in a table of mathematics."""

    @kernel
    def several(x):
        return (
            abs(-x),
            2.0 / x,
            xp.exp(x),
            math.expm1(x),
            xp.log(x),
            xp.sin(x),
            xp.cos(x),
            math.cos(x),
            x / 2.0 - x,
        )

    derived = derive(several, ("x",), {})
    x = 0.7
    units = [tuple(float(i == k) for k in range(9)) for i in range(9)]
    found = [pulled(derived.forth, derived.back, (x,), unit)[0] for unit in units]
    e = math.exp(x)
    s = math.sin(x)
    c = math.cos(x)
    assert found == pytest.approx(
        [1.0, -2.0 / x**2, e, e, 1.0 / x, c, -s, -s, -0.5], rel=1e-14
    )


@kernel
def _decay(deflection, law):
    return formulas.bristle_decay(xp, deflection, 0.3, 1.0, 1e5, law)


def test_no_dust_where_a_bristle_sticks_or_is_fully_deflected():
    """Long steps multiply the slope by 1e9, small deflections by one over them: rounding of a cosine would show."""
    derived = derive(_decay, ("deflection", "law.breakaway_ratio"), {})
    for deflection in (0.0, 0.1, LAW.breakaway_ratio, 1.0, 1.5):
        assert pulled(derived.forth, derived.back, (deflection, LAW), 1.0) == (0.0, 0.0)
    assert pulled(derived.forth, derived.back, (0.6, LAW), 1.0)[0] > 1e3


@pytest.mark.parametrize(("size", "length"), [(1e-150, 1.0), (1e-300, 0.0)])
def test_the_slope_of_a_norm_is_a_unit_vector(size, length):
    """One over a norm leaves the range of numbers with another factor; squares of the second size are zero."""
    # In the order that C keeps.
    forth, back = map(twin, derive(norm, ("a",), {"a": 2})[-2:])
    _, tape = forth((3.0 * size, 4.0 * size))
    assert back(tape, 1e200)[0] == pytest.approx(
        (0.6e200 * length, 0.8e200 * length), rel=1e-14
    )


def test_a_primitive_goes_before_the_source():
    @kernel
    def rounded(x):
        return math.floor(x)

    @kernel
    def scaled(x, y):
        return rounded(x) * y

    with pytest.raises(
        NotStraightError,
        match=r"`return math.floor\(x\)` has no derivative .* give .* a `primitive`",
    ):
        derive(scaled, ("x",), {})
    primitive(rounded, lambda whole, x: (5.0,))

    @kernel
    def scaled_again(x, y):
        return rounded(x) * y

    derived = derive(scaled_again, ("x", "y"), {})
    assert pulled(derived.forth, derived.back, (2.5, 3.0), 1.0) == (15.0, 2.0)


def test_a_loop_of_known_length_has_derivatives():
    @kernel
    def series(x, y):
        total = 0.0
        for n in range(1, 6):
            total = total + y * xp.power(x, float(n)) / n
        return total

    derived = derive(series, ("x", "y"), {})
    (x, y) = (0.4, 3.0)
    by_x = y * sum(x ** (n - 1) for n in range(1, 6))
    by_y = sum(x**n / n for n in range(1, 6))
    assert pulled(derived.forth, derived.back, (x, y), 1.0) == pytest.approx(
        (by_x, by_y), rel=1e-14
    )


# ---------------------------------------------------------------------- forwards

_pushed = forward(cell, ("z", "u"), TWO)
_CELL = derive(cell, ("z", "u"), TWO)
_forth, _back = _CELL.forth, _CELL.back


@njit
def _both(law, z, u, dt, dz, du, bar_new, bar_pull):
    value, (d_new, d_pull) = _pushed(law, z, u, dt, dz, du)
    found, tape = _forth(law, z, u, dt)
    by_z, by_u = _back(tape, (bar_new, bar_pull))
    return (
        value,
        found,
        dot(bar_new, d_new) + dot(bar_pull, d_pull),
        dot(by_z, dz) + dot(by_u, du),
    )


def test_forwards_and_backwards_agree_on_the_step_of_a_bristle():
    rng = np.random.default_rng(0)
    for _ in range(200):
        z, u, dz, du = (
            tuple(scale * rng.normal(size=2)) for scale in (3e-6, 5e-3, 1e-6, 1e-3)
        )
        dt = 10.0 ** rng.uniform(-6.0, -2.0)
        step, found, ahead, behind = _both(
            LAW, z, u, dt, dz, du, (1e6, -2e6), (1.0, 0.5)
        )
        for one, other in zip(step, found, strict=True):
            assert one == pytest.approx(
                other, rel=1e-13, abs=1e-14 * max(map(abs, other))
            )
        assert ahead == pytest.approx(behind, rel=1e-9, abs=1e-9)


@kernel
def _curved(z, k):
    x, y = z
    return times(xp.exp(-x / k) / norm(z), (square(z), x * xp.sin(y))), -xp.power(
        y, k
    ) + xp.log(y) * xp.cos(x)


_once = forward(_curved, ("z",), {"z": 2})


@kernel
def _slopes(z, k, d):
    _, change = _once(z, k, d)
    return change


_TWICE = derive(_slopes, ("z",), {"z": 2, "d": 2})
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


def test_several_directions_are_those_one_by_one():
    """`sigma_1` and `sigma_2` move no bristle."""
    names = "sigma_0", "sigma_1", "sigma_2", "v_s"
    directions = tuple(
        (f"law.{name}", "z")[: 1 if name in ("sigma_1", "sigma_2") else 2]
        for name in names
    )
    many = forwards(cell, directions, TWO)
    first, second, third, fourth = (forward(cell, by, TWO) for by in directions)

    @njit
    def both(law, z, u, dt, dz):
        value, one = first(law, z, u, dt, 1.0, dz)
        apart = value, one, second(law, z, u, dt, 1.0)[1], third(law, z, u, dt, 1.0)[1]
        return many(law, z, u, dt, 1.0, dz, 1.0, 1.0, 1.0, dz), (
            *apart,
            fourth(law, z, u, dt, 1.0, dz)[1],
        )

    found, expected = both(LAW, (2e-6, -1e-6), (4e-3, 1e-3), 1e-4, (1e-6, 2e-6))
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert (
        not any(found[2][0])
        and not any(found[3][0])
        and any(found[2][1])
        and any(found[3][1])
    )


# ---------------------------------------------------------------------- refusals


def _branch(x):
    if x > 0.0:
        return x
    return -x


def _chosen(x):
    return x if x > 0.0 else -x


def _endless(x):
    while x > 1.0:
        x = 0.5 * x
    return x


def _raised(x):
    return x**2


def _vectors(z):
    return z + z


def _doubled(z):
    return 2.0 * plus(z, 1.0, z)


def _unknown(x):
    return nowhere(x)  # noqa: F821


def _none(x):
    y = x  # noqa: F841


@pytest.mark.parametrize(
    "function, words",
    [
        (_branch, "`if x > 0.0:` asks which way a comparison goes: use `xp.where`"),
        (
            _chosen,
            "`return x if x > 0.0 else -x` asks which way a comparison goes: use `xp.where`",
        ),
        (_endless, "`while x > 1.0:` asks which way"),
        (_raised, "`return x**2` cannot be traced (unsupported operand"),
        (_vectors, "`return z + z` is of vectors: use `plus`, `times`, `dot`"),
        (_doubled, "`return 2.0 * plus(z, 1.0, z)` is of vectors: use `plus`"),
        (
            _unknown,
            "`return nowhere(x)  # noqa: F821` cannot be traced (name 'nowhere' is not defined)",
        ),
    ],
)
def test_what_cannot_be_traced_is_named_with_its_line(function, words):
    with pytest.raises(NotStraightError) as refused:
        derive(function, (), {"z": 2})
    line = function.__code__.co_firstlineno + 1
    assert f"{function.__name__}, line {line}: {words}" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_functions_without_a_value_or_an_argument_are_named():
    with pytest.raises(NotStraightError, match="_none has no return"):
        derive(_none, ("x",), {})
    with pytest.raises(NotStraightError, match="_pulled has no argument y, only x"):
        derive(_pulled, ("y",), {})


def _pulled(x):
    return -x


PROGRAM = """
import linecache
linecache.cache.update({str(i): (1, None, [], "") for i in range(%d)})
from planarfriction._engine.codegen.derivatives import derive
from planarfriction._engine.published import published_step
derivatives = [derive(published_step.scaled_twist, ("twist",), {"twist": 3})] if %d else []
from planarfriction import formulas
derived = derive(formulas.bristle_decay, ("deflection", "along", "law.breakaway_ratio"), {})
print(derived.source, derived.forth.py_func.__code__.co_filename)
"""


def test_generated_text_is_the_same_in_every_process():
    texts = [
        subprocess.run(
            [sys.executable, "-c", PROGRAM % (n, n)],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for n in (0, 7)
    ]
    assert texts[0] == texts[1] and "law_breakaway_ratio" in texts[0]
