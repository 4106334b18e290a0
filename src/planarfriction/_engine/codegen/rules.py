"""Rules of `derive`: derivatives of functions and operators that it does not take apart.

They name the conventions at the kinks, and the forms of derivatives that lose no digits.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from planarfriction import formulas
from planarfriction._engine.codegen import vectors
from planarfriction._engine.codegen.vectors import dot, placed, plus, times, zeros
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel

_NONE: Mapping = MappingProxyType({})


class Rule(NamedTuple):
    """Derivative of a function that is not taken apart.

    In its texts `{0}`, `{1}` stand for the arguments, `{t}` for the result (`{t0}`, `{t1}` for several), `{b}` for its
    cotangent and `{d}` for the change of an argument.
    """

    results: str
    """Kind of each result: "s" for a number, "v" for a vector."""
    slopes: Mapping[Any, str] = _NONE
    """Derivative of the result by argument i, or of result r by argument i for the key (r, i); kept on the tape."""
    pulls: Mapping[int, str] = _NONE
    """Cotangent of argument i, where a derivative of a vector would be a matrix."""
    pushes: Mapping[int, str] = _NONE
    """Change of the result with argument i, where `pulls` has its cotangent."""
    names: Mapping[str, Any] = _NONE
    """Functions that the texts name, beside `NAMES`."""


@kernel
def per(x: float) -> float:
    """Return `1/x` for x > 0; 0 at 0, and so is its slope."""
    return 1.0 / xp.where(x > 0.0, x, math.inf)


@kernel
def ratio(x: float, y: float) -> float:
    """Return `x/y` for y > 0; 0 at 0, and so are its slopes."""
    return x * per(y)


@kernel
def _power_slope(x: float, exponent: float, raised: float) -> float:
    """Return the derivative of `x^exponent` by x; at 0 the right-hand limit for exponents >= 1."""
    return xp.where(
        x > 0.0, exponent * raised * per(x), xp.where(exponent == 1.0, 1.0, 0.0)
    )


@kernel
def _log(x: float) -> float:
    """Return `log x`; 0 at 0, where `x^e log x` vanishes."""
    return xp.log(xp.where(x > 0.0, x, 1.0))


@kernel
def slip_slope(deflection: float, breakaway: float) -> float:
    """Return the derivative of `slip_fraction` by the deflection, zero before breakaway and at full deflection.

    It is multiplied by how far a long step would have gone, 1e9, or by one over hardly any deflection.
    """
    partly = (deflection > breakaway) & (deflection < 1.0)
    return xp.where(
        partly, formulas.slip_fraction_slope(xp, deflection, breakaway), 0.0
    )


@kernel
def _slip_by_breakaway(deflection: float, breakaway: float) -> float:
    """Return the derivative of `formulas.slip_fraction` by the breakaway ratio."""
    return formulas.bristle_decay_by_breakaway(
        xp, slip_slope(deflection, breakaway), deflection, breakaway
    )


NAMES: dict[str, Any] = {
    "dot": dot, "formulas": formulas, "log_or_0": _log, "per": per, "placed": placed, "plus": plus,
    "power_slope": _power_slope, "ratio": ratio, "slip_by_breakaway": _slip_by_breakaway, "slip_slope": slip_slope,
    "times": times, "xp": xp, "zeros": zeros,
}  # fmt: skip
"""Functions that generated code and the texts of rules name."""

# Only the numerator: `derive` writes other quotients as products.
# No square of `per`, which 1e-160 takes out of range.
RULES: dict[Any, Rule] = {
    ast.Add: Rule("s", {0: "1.0", 1: "1.0"}),
    ast.Sub: Rule("s", {0: "1.0", 1: "-1.0"}),
    ast.Mult: Rule("s", {0: "{1}", 1: "{0}"}),
    ast.Div: Rule("s", {0: "1.0 / {1}"}),
    ast.USub: Rule("s", {0: "-1.0"}),
    plus: Rule(
        "v",
        {},
        {0: "{b}", 1: "dot({b}, {2})", 2: "times({1}, {b})"},
        {0: "{d}", 1: "times({d}, {2})", 2: "times({1}, {d})"},
    ),
    times: Rule(
        "v",
        {},
        {0: "dot({b}, {1})", 1: "times({0}, {b})"},
        {0: "times({d}, {1})", 1: "times({0}, {d})"},
    ),
    dot: Rule(
        "s",
        {},
        {0: "times({b}, {1})", 1: "times({b}, {0})"},
        {0: "dot({d}, {1})", 1: "dot({0}, {d})"},
    ),
    vectors.square: Rule(
        "s", {}, {0: "times(2.0 * {b}, {0})"}, {0: "2.0 * dot({0}, {d})"}
    ),
    # times the unit vector: one over a norm of 1e-160 leaves no room for another factor
    vectors.norm: Rule(
        "s",
        {"per": "per({t})"},
        {0: "times({b}, times({per}, {0}))"},
        {0: "ratio(dot({0}, {d}), {t})"},
    ),
    math.sqrt: Rule("s", {0: "0.5 * per({t})"}),
    per: Rule("s", {0: "-{t} * {t}"}),
    ratio: Rule("s", {0: "per({1})", 1: "-{t} * per({1})"}),
    xp.where: Rule("s", {1: "xp.where({0}, 1.0, 0.0)", 2: "xp.where({0}, 0.0, 1.0)"}),
    # of equal numbers the slope is that of the first
    xp.maximum: Rule(
        "s", {0: "xp.where({0} >= {1}, 1.0, 0.0)", 1: "xp.where({0} >= {1}, 0.0, 1.0)"}
    ),
    xp.minimum: Rule(
        "s", {0: "xp.where({0} <= {1}, 1.0, 0.0)", 1: "xp.where({0} <= {1}, 0.0, 1.0)"}
    ),
    xp.exp: Rule("s", {0: "{t}"}),
    xp.log: Rule("s", {0: "1.0 / {0}"}),
    xp.sin: Rule("s", {0: "xp.cos({0})"}),
    xp.cos: Rule("s", {0: "-xp.sin({0})"}),
    xp.power: Rule("s", {0: "power_slope({0}, {1}, {t})", 1: "{t} * log_or_0({0})"}),
    formulas.relaxation: Rule(
        "ss",
        {(0, 1): "-{t0}", (1, 1): "formulas.relaxation_slope(xp, {1}, {t0}, {t1})"},
    ),
    formulas.slip_fraction: Rule(
        "s", {1: "slip_slope({1}, {2})", 2: "slip_by_breakaway({1}, {2})"}
    ),
}
"""Rules by function or operator."""

QUOTIENT = Rule("s", {0: "{2}", 1: "-{t} * {2}"})
"""Rule of a quotient, whose third argument is one over the denominator."""


def rule(function: Callable, results: str, slopes: dict, **names: Any) -> None:
    """Give a function a `Rule`, whose texts may name the functions `names`."""
    RULES[function] = Rule(results, slopes, {}, {}, names)
