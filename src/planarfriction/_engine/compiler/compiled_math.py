"""The `xp` of compiled loops: scalar functions without calls and branches, so that loops over cells become vector code.

The C library's `exp` and `sin` keep the compiler from vectorising a loop; these polynomials do not (measured on 317
cells: a third of the time). Each states its domain and error; the tests check both.
Polynomials are summed in pairs (Estrin), which keeps the chain of dependent operations short where a single bristle is
stepped. The coefficients have the least largest error over the domain (Remez), which needs two or three
terms less than the series.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.core.compiler import Compiler
from numba.extending import intrinsic

from planarfriction._engine.compiler.numba_compat import part
from planarfriction.formulas import LARGEST

# Not `reassoc`: the two-part constants of the argument reductions rely on the order of operations.
_inline = njit(
    error_model="numpy",
    fastmath={"contract"},
    forceinline=True,
    pipeline_class=part("planarfriction._engine.compiler.inlining", "Inner", Compiler),
    _nrt=False,
    no_cpython_wrapper=True,
    no_cfunc_wrapper=True,
)

_LOG2_E = 1.4426950408889634
_LN2_HIGH = (
    6.93147180369123816490e-01  # the first 33 bits of ln 2: k * _LN2_HIGH is exact
)
_LN2_LOW = 1.90821492927058770002e-10
_SHIFT = 1.5 * 2.0**52  # a sum with it has no digits behind the point
_EXP_LARGEST = 708.0  # beyond it the result leaves the range of normal doubles


@intrinsic
def _bits_to_float(typingctx: Any, bits: types.Type) -> Any:
    """Return the double that has the 64 bits of an integer."""
    return types.float64(
        types.int64
    ), lambda context, builder, signature, args: builder.bitcast(
        args[0], ir.DoubleType()
    )


@intrinsic
def _float_to_bits(typingctx: Any, x: types.Type) -> Any:
    """Return the integer that has the 64 bits of a double."""
    return types.int64(
        types.float64
    ), lambda context, builder, signature, args: builder.bitcast(
        args[0], ir.IntType(64)
    )


@_inline
def where(condition: bool, a: float, b: float) -> float:
    """Return `a` where the condition holds, else `b`."""
    return a if condition else b


@_inline
def in_range(x: float) -> bool:
    """Return True for a number not beyond the largest that is taken: products of three and their squares stay
    finite."""
    return abs(x) <= LARGEST


@_inline
def is_finite(x: float) -> bool:
    """Return True unless a number is NaN or infinite. (`math.isfinite` takes x - x, which reordering turns into 0.)"""
    return abs(x) <= 1.7976931348623157e308


@_inline
def minimum(a: float, b: float) -> float:
    """Return the smaller of two numbers."""
    return a if a < b else b


@_inline
def maximum(a: float, b: float) -> float:
    """Return the larger of two numbers."""
    return a if a > b else b


@_inline
def in_order(x: float) -> int:
    """Return an integer for a double, larger for larger ones: the largest of many integers is found in vector code.

    Of negative numbers only that they are less than the others.
    """
    return _float_to_bits(x)


@_inline
def rounded(x: float) -> tuple[float, float]:
    """Return the integer k that is nearest to a number below 1000, and `2^k`.

    k stands in the last bits of a sum: processors before AVX-512 have no vector code that makes integers of doubles.
    """
    shifted = x + _SHIFT
    return shifted - _SHIFT, _bits_to_float((_float_to_bits(shifted) + 1023) << 52)


@_inline
def _halved(x: float) -> tuple[float, float]:
    """Return `2^k` and `e^r - 1` of the rest r, with `e^x = 2^k e^r` and `|r| <= ln(2)/2`; x is limited to +-708."""
    x = minimum(maximum(x, -_EXP_LARGEST), _EXP_LARGEST)
    k, scale = rounded(x * _LOG2_E)
    r = (x - k * _LN2_HIGH) - k * _LN2_LOW
    r2 = r * r
    r4 = r2 * r2
    low = (0.5000000000000011 + r * 0.16666666666666413) + r2 * (
        0.041666666666530155 + r * 0.008333333333494463
    )
    high = (0.0013888888943630218 + r * 0.00019841269506574313) + r2 * (
        2.4801493098786526e-05 + r * 2.755758637826493e-06
    )
    highest = 2.763024842399636e-07 + r * 2.500006005363822e-08
    return scale, r + r2 * ((low + r4 * high) + (r4 * r4) * highest)


@_inline
def exp(x: float) -> float:
    """Return `e^x`, relative error below 6e-16, argument limited to +-708."""
    scale, rest = _halved(x)
    return scale + scale * rest


@_inline
def expm1(x: float) -> float:
    """Return `e^x - 1`, relative error below 6e-16, argument limited to +-708."""
    scale, rest = _halved(x)
    return (scale - 1.0) + scale * rest


@_inline
def log(x: float) -> float:
    """Return the natural logarithm of a normal double x > 0, relative error below 1e-15; about -709 at x = 0."""
    bits = _float_to_bits(x)
    exponent = (bits >> 52) - 1023
    mantissa = _bits_to_float((bits & 0x000FFFFFFFFFFFFF) | 0x3FF0000000000000)
    high = mantissa > 1.4142135623730951
    m = 0.5 * mantissa if high else mantissa
    k = float(exponent + 1 if high else exponent)
    s = (m - 1.0) / (m + 1.0)
    q = s * s
    p = 1.0 / 21.0
    p = p * q + 1.0 / 19.0
    p = p * q + 1.0 / 17.0
    p = p * q + 1.0 / 15.0
    p = p * q + 1.0 / 13.0
    p = p * q + 1.0 / 11.0
    p = p * q + 1.0 / 9.0
    p = p * q + 1.0 / 7.0
    p = p * q + 1.0 / 5.0
    p = p * q + 1.0 / 3.0
    return k * _LN2_HIGH + (k * _LN2_LOW + 2.0 * s * (1.0 + q * p))


@_inline
def power(x: float, exponent: float) -> float:
    """Return `x^exponent` for x >= 0 and exponent > 0; the square, the usual Stribeck exponent, is exact."""
    if exponent == 2.0:
        return x * x
    return where(x > 0.0, exp(exponent * log(x)), 0.0)


@_inline
def sin(x: float) -> float:
    """Return the sine for |x| <= pi/2, absolute error below 4e-16."""
    q = x * x
    q2 = q * q
    q4 = q2 * q2
    low = (-0.1666666666666626 + q * 0.008333333333291249) + q2 * (
        -0.00019841269826532476 + q * 2.7557316776588648e-06
    )
    high = (
        -2.5051890908075402e-08 + q * 1.604841188205156e-10
    ) + q2 * -7.37703133227332e-13
    return x + x * q * (low + q4 * high)


@_inline
def cos(x: float) -> float:
    """Return the cosine for |x| <= pi/2, absolute error below 4e-16."""
    q = x * x
    q2 = q * q
    q4 = q2 * q2
    low = (0.04166666666666652 - q * 0.0013888888888869506) + q2 * (
        2.4801587293967007e-05 - q * 2.755731788617287e-07
    )
    high = (
        2.087663514887468e-09 - q * 1.1464747733290135e-11
    ) + q2 * 4.627676268649195e-14
    return (1.0 - 0.5 * q) + q2 * (low + q4 * high)


@_inline
def atan2(y: float, x: float) -> float:
    """Return the angle of the vector (x, y) in (-pi, pi], absolute error below 1e-15; 0 for the zero vector."""
    across = abs(y)
    along = abs(x)
    small = minimum(across, along)
    large = maximum(across, along)
    # beyond tan(pi/8) the angle is taken from the diagonal, which keeps the argument of the series below 0.4143
    diagonal = small > 0.41421356237309503 * large
    numerator = small - large if diagonal else small
    denominator = small + large if diagonal else large
    t = numerator / (denominator if denominator > 0.0 else 1.0)
    q = t * t
    q2 = q * q
    q4 = q2 * q2
    q8 = q4 * q4
    first = (-1.0 / 3.0 + q * (1.0 / 5.0)) + q2 * (-1.0 / 7.0 + q * (1.0 / 9.0))
    second = (-1.0 / 11.0 + q * (1.0 / 13.0)) + q2 * (-1.0 / 15.0 + q * (1.0 / 17.0))
    third = (-1.0 / 19.0 + q * (1.0 / 21.0)) + q2 * (-1.0 / 23.0 + q * (1.0 / 25.0))
    fourth = (-1.0 / 27.0 + q * (1.0 / 29.0)) + q2 * (-1.0 / 31.0 + q * (1.0 / 33.0))
    last = (-1.0 / 35.0 + q * (1.0 / 37.0)) + q2 * (-1.0 / 39.0 + q * (1.0 / 41.0))
    series = (first + q4 * second) + q8 * ((third + q4 * fourth) + q8 * last)
    angle = t + t * q * series
    angle = angle + 0.7853981633974483 if diagonal else angle
    angle = 1.5707963267948966 - angle if across > along else angle
    angle = 3.141592653589793 - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle
