"""Operations of numbers that a trace notes: their sources in Python and in C, and their costs.

Everything that is written from a trace goes by these records; `derivatives` has their partial derivatives.
"""

from __future__ import annotations

from typing import NamedTuple


class Operator(NamedTuple):
    """An operation of numbers."""

    python: str
    """Source for Numba, `{0}`, `{1}` for the arguments."""
    c: str
    """Source in C, `{name}` for the name of a function."""
    name: str = ""
    """Name of a function of `math.h`, in double precision."""
    own: bool = False
    """True for functions that C sources may bring along in a form for vector code."""
    cost: int = 1
    """Time in sums and products."""


def _infix(python: str, c: str = "", cost: int = 1) -> Operator:
    return Operator(f"{{0}} {python} {{1}}", f"{{0}} {c or python} {{1}}", cost=cost)


def _function(
    name: str,
    cost: int,
    *,
    python: str = "",
    own: bool = False,
    arguments: str = "({0})",
) -> Operator:
    return Operator(
        (python or f"xp.{name}") + arguments, "{name}" + arguments, name, own, cost
    )


ADD = _infix("+")
SUBTRACT = _infix("-")
MULTIPLY = _infix("*")
DIVIDE = _infix("/", cost=8)
NEGATE = Operator("-{0}", "-{0}")
ABS = _function("fabs", 1, python="abs")

LESS = _infix("<")
LESS_OR_EQUAL = _infix("<=")
GREATER = _infix(">")
GREATER_OR_EQUAL = _infix(">=")
EQUAL = _infix("==")
NOT_EQUAL = _infix("!=")
AND = _infix("&", "&&")
OR = _infix("|", "||")
IS_FINITE = Operator("xp.is_finite({0})", "isfinite({0})")

WHERE = Operator("xp.where({0}, {1}, {2})", "{0} ? {1} : {2}")
MINIMUM = Operator("xp.minimum({0}, {1})", "{0} < {1} ? {0} : {1}")
MAXIMUM = Operator("xp.maximum({0}, {1})", "{0} > {1} ? {0} : {1}")

SQRT = _function("sqrt", 8, python="math.sqrt", own=True)
POWER = _function("pow", 30, python="xp.power", arguments="({0}, {1})")
EXP = _function("exp", 16)
EXPM1 = _function("expm1", 16)
LOG = _function("log", 16)
SIN = _function("sin", 14)
COS = _function("cos", 14)
ATAN2 = _function("atan2", 30, arguments="({0}, {1})")
FLOOR = _function("floor", 1, python="math.floor")
EXP_NEAR = _function("exp", 16, own=True)
"""Function of `compiled_math`, whose domain is smaller than that of `math.h`."""
SIN_NEAR = _function("sin", 14, own=True)
"""Function of `compiled_math`, for the right half of the circle."""

READ = Operator("{0}[{1}]", "{0}[{1}]")
"""Number of a table, at an index."""
REAL = Operator("float({0})", "(real){0}")
"""Real number of an index."""
INTEGER = Operator("int({0})", "(int)({0})")
WIDE = Operator("int({0})", "(long long)(int)({0})")
"""Integer of 64 bits."""
SHIFT = _infix("<<")
OF_BITS = Operator("of_bits({0})", "of_bits({0})")
"""Real number that has the 64 bits of an integer."""

SHORT = frozenset((ADD, SUBTRACT, MULTIPLY, NEGATE))
"""Operations that take no longer than to read a number from memory."""
