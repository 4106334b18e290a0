"""The formulas: slopes against differences, limits, and the same number from NumPy and from compiled loops."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numba import njit

from planarfriction import formulas
from planarfriction._engine.bristles.law import law_of as read_law
from planarfriction._engine.compiler import compiled_math
from planarfriction.formulas import LawNumbers

LAW = {"mu_c": 0.7, "mu_s": 1.1, "v_s": 2e-3}
GAMMAS = (1.0, 1.5, 2.0, 3.0)

speeds = st.floats(0.0, 10.0) | st.floats(1e-12, 1e-2)
ratios = st.floats(0.0, 0.99)
deflections = st.floats(0.0, 3.0)
checked = settings(deadline=None, max_examples=100)


def law_of(**numbers):
    """A law with these numbers; the others stand for nothing here."""
    others = {
        "sigma_0": 1.0,
        "sigma_1": 0.0,
        "sigma_2": 0.0,
        "gamma": 2.0,
        "elasto_plastic": 0.0,
    }
    return LawNumbers(**{**others, "breakaway_ratio": 0.5, **LAW, **numbers})


def bristles_of(elasto_plastic, breakaway_ratio):
    return law_of(elasto_plastic=elasto_plastic, breakaway_ratio=breakaway_ratio)


def slope(function, x, step):
    """Central difference of fourth order; its error is step^4/30 of the fifth derivative."""
    near = function(x + step) - function(x - step)
    far = function(x + 2 * step) - function(x - 2 * step)
    return (8.0 * near - far) / (12.0 * step)


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 0.0999, 0.11, 2.0, 6.0])
def test_the_mean_of_what_turns_is_that_of_fifty_digits(angle):
    with mpmath.workdps(50):
        a = mpmath.mpf(angle)
        exact = [float((1 - mpmath.cos(a)) / a**2), float((a - mpmath.sin(a)) / a**3)]
    # 1e-13, and the difference at 0.11.
    assert formulas.turning_mean(np, angle) == pytest.approx(exact, rel=1e-12)


# ---------------------------------------------------------------------- Stribeck curve


@pytest.mark.parametrize("gamma", GAMMAS)
def test_stribeck_falls_from_static_to_coulomb_friction(gamma):
    g = formulas.stribeck(np, np.linspace(0.0, 1.0, 1000), law_of(gamma=gamma))
    assert g[0] == LAW["mu_s"]
    assert g[-1] == LAW["mu_c"]  # exp(-500) is far below rounding
    assert (np.diff(g) <= 0.0).all()
    at_v_s = formulas.stribeck(np, LAW["v_s"], law_of(gamma=gamma))
    assert at_v_s == pytest.approx(0.7 + 0.4 / math.e, rel=1e-15)  # rounding


# ---------------------------------------------------------------------- slip fraction


@given(ratios)
@checked
def test_slip_fraction_limits(ratio):
    below = ratio * np.array([0.0, 0.5, 0.999, 1.0])
    # Exactly: nothing may creep.
    assert np.array_equal(formulas.slip_fraction(np, below, ratio), np.zeros(4))
    assert np.array_equal(
        formulas.slip_fraction(np, np.array([1.0, 1.001, 7.0]), ratio), np.ones(3)
    )
    middle = formulas.slip_fraction(np, 0.5 * (1.0 + ratio), ratio)
    # 1e-16 of the deflection over a width of 0.01 or more.
    assert middle == pytest.approx(0.5, abs=1e-13)
    rising = formulas.slip_fraction(np, np.linspace(0.0, 1.2, 200), ratio)
    assert (np.diff(rising) >= 0.0).all()


@given(ratios, st.floats(0.01, 0.99))
@checked
def test_slip_fraction_is_the_published_sine(ratio, share):
    deflection = ratio + share * (1.0 - ratio)
    published = 0.5 + 0.5 * math.sin(
        math.pi * (deflection - 0.5 * (1.0 + ratio)) / (1.0 - ratio)
    )
    # As above.
    assert formulas.slip_fraction(np, deflection, ratio) == pytest.approx(
        published, abs=1e-13
    )


@pytest.mark.parametrize("ratio", [0.0, 0.5, 0.9])
def test_slip_fraction_slope_is_the_slope(ratio):
    width = 1.0 - ratio
    # Two steps away from the ends, where the curvature jumps.
    inside = ratio + width * np.linspace(0.02, 0.98, 97)
    expected = slope(
        lambda d: formulas.slip_fraction(np, d, ratio), inside, 5e-3 * width
    )
    # Truncation: step^4/30 of the fifth derivative, pi^5/2/width^5: 3e-9 of 1/width.
    assert formulas.slip_fraction_slope(np, inside, ratio) == pytest.approx(
        expected, abs=4e-9 / width
    )
    outside = np.array([0.0, 0.5 * ratio, ratio, 1.0, 2.0])
    # cos(pi/2 + rounding of the deflection over the width), over the width.
    assert formulas.slip_fraction_slope(np, outside, ratio) == pytest.approx(
        np.zeros(5), abs=1e-15 / width**2
    )


# ---------------------------------------------------------------------- bristle decay


@given(deflections, st.floats(-1.0, 1.0), st.floats(1e-6, 1.0), ratios)
@checked
def test_decay_bounds(deflection, cosine, speed, ratio):
    grip = 1e6
    plain = formulas.bristle_decay(
        np, deflection, cosine * speed, speed, grip, bristles_of(0.0, ratio)
    )
    elastic = formulas.bristle_decay(
        np, deflection, cosine * speed, speed, grip, bristles_of(1.0, ratio)
    )
    assert plain == speed * grip
    assert 0.0 <= elastic <= plain * (1 + 1e-15)  # beta lies in [0, 1]; rounding
    # Elastic, or the bristle is being relaxed.
    if deflection <= ratio or cosine == -1.0:
        assert elastic == 0.0
    if deflection >= 1.0 and cosine == 1.0:
        assert elastic == pytest.approx(plain, rel=1e-15)  # rounding


def test_traction_opposes_the_bristle_its_rate_and_the_velocity():
    assert formulas.traction(
        2.0, 3.0, 5.0, law_of(sigma_0=7.0, sigma_1=11.0, sigma_2=13.0)
    ) == -(14.0 + 33.0 + 65.0)


# ---------------------------------------------------------------------- the step


@given(st.floats(0.0, 50.0) | st.floats(0.0, 2e-3))
@checked
def test_relaxation(x):
    remaining, mean = formulas.relaxation(np, x)
    assert remaining == pytest.approx(math.exp(-x), rel=1e-15)
    exact = -math.expm1(-x) / x if x > 0.0 else 1.0
    # Above 1e-3 the difference 1 - exp(-x) loses 1e-16/x; below, the series is exact.
    assert mean == pytest.approx(
        exact, rel=3e-16 * (1.0 + (1.0 / x if x > 1e-3 else 0.0))
    )


def test_relaxation_of_endless_steps():
    remaining, mean = formulas.relaxation(np, np.array([1e3, 1e9, 1e30]))
    assert np.array_equal(remaining, np.zeros(3))
    assert mean == pytest.approx([1e-3, 1e-9, 1e-30], rel=1e-15)


@given(st.floats(0.0, 1e6), st.floats(0.0, 1e6), st.floats(-12.0, 9.0))
@example(0.0, 5e-324, 0.0)
@checked
def test_mean_decay(start, end, log_dt):
    dt = 10.0**log_dt
    k = formulas.mean_decay(start, end, dt)
    # A mean; rounding.
    assert min(start, end) * (1 - 1e-12) <= k <= max(start, end) * (1 + 1e-12)
    half = 0.5 * (start + end)
    x = 0.5 * (start + end) * dt
    # Second order: the half-way mean but for a share of x; the half of a denormal number is rounded too.
    if x < 1.0:
        assert abs(k - half) <= 0.5 * x * abs(start - end) + 1e-12 * half + 5e-324
    # Long steps: the end's, and what is left of the start less than its share of the step.
    if x > 10.0:
        assert abs(k - end) * dt <= 2.0 * abs(start - end) / half / x + 1e-12 * end * dt


@given(deflections, deflections)
@checked
def test_a_step_ends_within_reach(start, end):
    largest = formulas.reachable_deflection(np, start, bristles_of(1.0, 0.5))
    assert largest == max(start, 1.0)
    # Rounding.
    assert end * formulas.cap(np, end, largest) == pytest.approx(
        min(end, largest), rel=1e-15
    )
    # Plain LuGre is not capped.
    assert (
        formulas.cap(
            np, end, formulas.reachable_deflection(np, start, bristles_of(0.0, 0.5))
        )
        == 1.0
    )


# ---------------------------------------------------------------------- derivatives of a step


@pytest.mark.parametrize("ratio", [0.1, 0.5, 0.9])
def test_decay_by_breakaway_is_the_slope(ratio):
    deflection = ratio + (1.0 - ratio) * np.linspace(0.05, 0.95, 50)

    def decay(s):
        return formulas.bristle_decay(
            np, deflection, 0.3, 0.7, 2.0, bristles_of(1.0, s)
        )

    # Of k by the deflection.
    partial = (
        formulas.slip_fraction_slope(np, deflection, ratio) * 0.5 * (0.7 + 0.3) * 2.0
    )
    got = formulas.bristle_decay_by_breakaway(np, partial, deflection, ratio)
    expected = slope(decay, ratio, 1e-3 * (1.0 - ratio))
    # Truncation (1e-3)^4 of the fifth derivative, some 1e3, over the width; rounding.
    assert got == pytest.approx(expected, abs=1e-8 / (1.0 - ratio))
    # Beyond full deflection nothing moves.
    assert formulas.bristle_decay_by_breakaway(np, 1e-16, 1e6, ratio) == 0.0


def test_relaxation_slope_is_the_slope():
    x = 10.0 ** np.linspace(-5.0, 2.0, 300)
    got = formulas.relaxation_slope(np, x, *formulas.relaxation(np, x))
    # The slope is ((1 + x) exp(-x) - 1)/x^2, for small x as a series.
    series = -sum((n + 1) * (-x) ** n / float(math.factorial(n + 2)) for n in range(40))
    closed = -(-np.expm1(-x) - x * np.exp(-x)) / x**2
    # Above 0.1 a difference loses 1e-16/0.1^2.
    assert got == pytest.approx(np.where(x < 2.0, series, closed), rel=1e-13)
    assert formulas.relaxation_slope(np, 0.0, 1.0, 1.0) == -0.5


# ---------------------------------------------------------------------- NumPy against compiled loops


@njit(error_model="numpy")
def compiled(speed, deflection, along, grip, laws, decay_dt, out):
    """Every formula for every row, in compiled loops."""
    for i in range(speed.shape[0]):
        v = speed[i]
        d = deflection[i]
        a = along[i]
        q = grip[i]
        law = read_law(laws[i])
        s = law.breakaway_ratio
        out[i, 0] = formulas.stribeck(compiled_math, v, law)
        out[i, 1] = formulas.slip_fraction(compiled_math, d, s)
        out[i, 2] = formulas.slip_fraction_slope(compiled_math, d, s)
        out[i, 3] = formulas.bristle_decay(compiled_math, d, a, v, q, law)
        out[i, 4] = formulas.traction(d, a, v, law)
        left = formulas.relaxation(compiled_math, decay_dt[i])
        out[i, 5], out[i, 6] = left
        out[i, 7] = formulas.reachable_deflection(compiled_math, d, law)
        out[i, 8] = formulas.cap(compiled_math, d, 0.5)
        out[i, 9] = formulas.mean_decay(v, q, decay_dt[i])
        out[i, 10] = formulas.bristle_decay_by_breakaway(compiled_math, q, d, s)
        out[i, 11] = formulas.relaxation_slope(
            compiled_math, decay_dt[i], left[0], left[1]
        )


def test_every_formula_gives_the_same_number_in_compiled_loops():
    random = np.random.default_rng(11)
    n = 20_000
    v_s = random.uniform(1e-4, 1e-2, n)
    speed = random.choice([0.0, 0.1, 1.0, 3.0], n) * v_s * random.uniform(0.5, 1.5, n)
    mu_c = random.uniform(0.1, 1.0, n)
    mu_s = mu_c + random.uniform(0.0, 1.0, n)
    gamma = random.choice([0.5, 1.0, 1.5, 2.0, 3.0], n)
    ratio = random.uniform(0.0, 0.95, n)
    deflection = random.uniform(0.0, 1.3, n)
    grip = random.uniform(1.0, 10.0, n)
    along = random.uniform(-1.0, 1.0, n) * speed
    elasto_plastic = random.choice([0.0, 1.0], n)
    decay_dt = 10.0 ** random.uniform(-6, 2.5, n)
    out = np.empty((n, 12))
    sigma = random.uniform(0.0, 10.0, (3, n))
    law = LawNumbers(
        *sigma,
        mu_c,
        mu_s,
        v_s,
        gamma,
        elasto_plastic,
        ratio,
        random.choice([0.0, 1e-3], n),
    )
    compiled(speed, deflection, along, grip, np.stack(law, -1), decay_dt, out)
    bristle = (deflection, along, speed, grip, law)
    expected = [
        formulas.stribeck(np, speed, law),
        formulas.slip_fraction(np, deflection, ratio),
        formulas.slip_fraction_slope(np, deflection, ratio),
        formulas.bristle_decay(np, *bristle),
        formulas.traction(deflection, along, speed, law),
        *formulas.relaxation(np, decay_dt),
        formulas.reachable_deflection(np, deflection, law),
        formulas.cap(np, deflection, 0.5),
        formulas.mean_decay(speed, grip, decay_dt),
        formulas.bristle_decay_by_breakaway(np, grip, deflection, ratio),
        formulas.relaxation_slope(np, decay_dt, *formulas.relaxation(np, decay_dt)),
    ]
    # Each formula is some ten roundings of 1e-16. Where a number passes through zero (the sine's ends, which alpha and
    # its slope divide by a width of 0.05 or more; exp of large arguments) its rounding is a share of its largest value.
    for column, (got, wanted) in enumerate(zip(out.T, expected, strict=True)):
        finite = np.isfinite(wanted)
        assert np.array_equal(finite, np.isfinite(got)), column
        allowed = 1e-14 * np.abs(wanted[finite]) + 1e-15 * np.abs(wanted[finite]).max()
        # (1 - exp(-x))/x just above 1e-3 amplifies the last place of exp by 1/x.
        if column == 6:
            allowed = allowed + 6e-16 / np.maximum(decay_dt, 1e-3)
        if column == 11:  # and its slope, above 0.1, by 1/x^2
            allowed = allowed + 6e-16 / np.maximum(decay_dt, 0.1) ** 2
        assert (np.abs(got[finite] - wanted[finite]) <= allowed).all(), column
