"""Derivatives that the computer writes: against 60 digits, and what is told where none can be written."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest

from planarfriction import formulas
from planarfriction._engine.codegen.derive import NotStraightError, derive
from planarfriction._engine.codegen.rules import per, rule
from planarfriction._engine.codegen.vectors import dot, norm, plus, times
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction.formulas import LawNumbers
from tests.support.referee import misfit, pulled

LAW = LawNumbers(1e5, 300.0, 0.4, 0.5, 0.8, 1e-3, 1.7, 1.0, 0.3, 0.0)


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
TRACTION = derive(_traction, BY, ("z", "u"))


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

    derived = derive(kinks, ("x", "y"))

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


@kernel
def _decay(deflection, law):
    return formulas.bristle_decay(xp, deflection, 0.3, 1.0, 1e5, law)


def test_no_dust_where_a_bristle_sticks_or_is_fully_deflected():
    """Long steps multiply the slope by 1e9, small deflections by one over them: rounding of a cosine would show."""
    derived = derive(_decay, ("deflection", "law.breakaway_ratio"))
    for deflection in (0.0, 0.1, LAW.breakaway_ratio, 1.0, 1.5):
        assert pulled(derived.forth, derived.back, (deflection, LAW), (1.0,)) == (
            0.0,
            0.0,
        )
    assert pulled(derived.forth, derived.back, (0.6, LAW), (1.0,))[0] > 1e3


def test_a_rule_goes_before_the_source():
    @kernel
    def rounded(x):
        return math.floor(x)

    @kernel
    def scaled(x, y):
        return rounded(x) * y

    with pytest.raises(
        NotStraightError,
        match=r"floor.* has no source to write derivatives from: give it a `rule`",
    ):
        derive(scaled, ("x",))
    rule(rounded, "s", {0: "5.0"})
    derived = derive(scaled, ("x", "y"))
    assert pulled(derived.forth, derived.back, (2.5, 3.0), (1.0,)) == (15.0, 2.0)


def _loop(x):
    for _ in range(3):
        x = x * x
    return x


def _branch(x):
    if x > 0.0:
        return x
    return -x


def _chosen(x):
    return x if x > 0.0 else -x


def _raised(x):
    return x**2


def _vectors(x):
    v = x, x
    return v + v


def _unknown(x):
    return nowhere(x)  # noqa: F821


def _none(x):
    y = x  # noqa: F841


@pytest.mark.parametrize(
    "function, words",
    [
        (_loop, "`for _ in range(3):` is no assignment"),
        (_branch, "`if x > 0.0:` is no assignment"),
        (_chosen, "`x if x > 0.0 else -x` is no straight line: use `xp.where`"),
        (_raised, "`x ** 2` is no straight line"),
        (_vectors, "`v + v` is of vectors: use `plus`"),
        (_unknown, "`nowhere` is not known"),
        (_none, "has no return"),
    ],
)
def test_what_is_no_straight_line_is_named_with_its_line(function, words):
    with pytest.raises(NotStraightError) as refused:
        derive(function, ("x",))
    assert words in str(refused.value)
    line = function.__code__.co_firstlineno + (0 if function is _none else 1)
    last = line + (1 if function is _vectors else 0)
    assert f"{function.__name__}, line {last}: " in str(refused.value)


def test_an_argument_that_is_none_is_named():
    with pytest.raises(NotStraightError, match="has no argument y, only x"):
        derive(_chosen, ("y",))


PROGRAM = """
import linecache
linecache.cache.update({str(i): (1, None, [], "") for i in range(%d)})
from planarfriction._engine.codegen import derive
from planarfriction._engine.published import published_step
derivatives = [derive.derive(published_step.scaled_twist, ("twist",), ("twist",))] if %d else []
from planarfriction import formulas
derived = derive.derive(formulas.bristle_decay, ("deflection", "along", "law.breakaway_ratio"))
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
    assert texts[0] == texts[1] and "slip_fraction" in texts[0]
