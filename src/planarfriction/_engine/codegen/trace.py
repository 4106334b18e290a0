"""Straight-line functions traced with symbols, operation by operation.

A kernel is called in Python with `Number`s instead of floats, which note each operation on a `Trace`. A function
that asks which way a comparison goes is traced once for either answer, and a `Branch` joins the results. Loops run
as long as their count is known. Compiled functions are called through their Python twins (see `symbolic_functions`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from planarfriction._engine.codegen import operators
from planarfriction._engine.codegen.operators import Operator


class Undecided(Exception):
    """A comparison that decides how a function goes on."""

    def __init__(self, condition: Number) -> None:
        super().__init__(condition.name)
        self.condition = condition


class Operation(NamedTuple):
    """One operation on names and constants."""

    name: str
    """Name of its result."""
    kind: str
    """"real", "index", "wide" (64 bits) or "bool"."""
    operator: Operator
    arguments: tuple[Any, ...]
    """Names, or constants of Python."""


class Block(NamedTuple):
    """Operations and branches in order, and names or constants of the results."""

    operations: list[Any]
    results: tuple[Any, ...]


class Branch(NamedTuple):
    """Numbers that come out of one block or of another."""

    outcomes: tuple[tuple[str, str], ...]
    """Name and kind of each."""
    condition: str
    yes: Block
    no: Block


def _asking(operator: Operator) -> Callable[[Any, Any], Any]:
    """Return a method of two numbers whose result is a truth."""
    return lambda one, other: one.trace.note(operator, "bool", one, other)


class Number:
    """A number of which the name is known, not the value."""

    __slots__ = ("kind", "name", "trace")

    def __init__(self, trace: Trace, name: str, kind: str = "real") -> None:
        self.trace = trace
        self.name = name
        self.kind = kind

    def __bool__(self) -> bool:
        return self.trace.decide(self)

    def __add__(self, other: Any) -> Any:
        return self if _is(other, 0.0) else self._noted(operators.ADD, self, other)

    def __radd__(self, other: Any) -> Any:
        return self if _is(other, 0.0) else self._noted(operators.ADD, other, self)

    def __sub__(self, other: Any) -> Any:
        return self if _is(other, 0.0) else self._noted(operators.SUBTRACT, self, other)

    def __rsub__(self, other: Any) -> Any:
        return (
            -self if _is(other, 0.0) else self._noted(operators.SUBTRACT, other, self)
        )

    def __mul__(self, other: Any) -> Any:
        if _is(other, 0.0):
            return other
        if _is(other, 1.0):
            return self
        return (
            -self if _is(other, -1.0) else self._noted(operators.MULTIPLY, self, other)
        )

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        return self if _is(other, 1.0) else self._noted(operators.DIVIDE, self, other)

    def __rtruediv__(self, other: Any) -> Any:
        return other if _is(other, 0.0) else self._noted(operators.DIVIDE, other, self)

    def __neg__(self) -> Number:
        return self._noted(operators.NEGATE, self)

    def __abs__(self) -> Number:
        return self._noted(operators.ABS, self)

    __lt__ = _asking(operators.LESS)
    __le__ = _asking(operators.LESS_OR_EQUAL)
    __gt__ = _asking(operators.GREATER)
    __ge__ = _asking(operators.GREATER_OR_EQUAL)
    __eq__ = _asking(operators.EQUAL)
    __ne__ = _asking(operators.NOT_EQUAL)  # type: ignore[assignment]

    def __and__(self, other: Any) -> Any:
        return (
            _asking(operators.AND)(self, other)
            if isinstance(other, Number)
            else other and self
        )

    def __or__(self, other: Any) -> Any:
        return (
            _asking(operators.OR)(self, other)
            if isinstance(other, Number)
            else other or self
        )

    __rand__ = __and__
    __ror__ = __or__
    __hash__ = None  # type: ignore[assignment]

    def __lshift__(self, other: Any) -> Any:
        return self._noted(operators.SHIFT, self, other)

    def _noted(self, operator: Operator, *arguments: Any) -> Number:
        return self.trace.note(operator, kind_of(arguments), *arguments)


def _key(argument: Any) -> Any:
    """Return a key that tells arguments of a call apart."""
    if isinstance(argument, list):
        return tuple(map(_key, argument))
    if isinstance(argument, Number):
        return argument.name
    return (
        (type(argument), argument)
        if isinstance(argument, (int, float))
        else id(argument)
    )


def _is(value: Any, constant: float) -> bool:
    return not isinstance(value, Number) and value == constant


def kind_of(arguments: tuple) -> str:
    """Return the kind of a result: an index if all arguments are indices or truths."""
    if any(isinstance(each, Number) and each.kind == "wide" for each in arguments):
        return "wide"
    wholes = ("index", "bool")
    whole = all(
        each.kind in wholes if isinstance(each, Number) else isinstance(each, int)
        for each in arguments
    )
    return "index" if whole else "real"


class Trace:
    """Record of a function, operation by operation; the same operation is noted once."""

    def __init__(self) -> None:
        self.operations: list[Any] = []
        self._known: dict[tuple, Number] = {}
        self._called: dict[tuple, tuple] = {}
        self._answers: dict[str, bool] = {}
        self._count = 0

    def _new(self, kind: str) -> Number:
        self._count += 1
        return Number(self, f"t{self._count}", kind)

    def note(self, operator: Operator, kind: str, *arguments: Any) -> Number:
        """Return the result of an operation."""
        if kind == "real" and operator not in (operators.READ, operators.REAL):
            arguments = tuple(
                _real(each) if getattr(each, "kind", "index") == "index" else each
                for each in arguments
            )
        names = tuple(
            each.name if isinstance(each, Number) else each for each in arguments
        )
        key = operator, *((type(each), each) for each in names)
        if key not in self._known:
            self._known[key] = self._new(kind)
            self.operations.append(
                Operation(self._known[key].name, kind, operator, names)
            )
        return self._known[key]

    def decide(self, condition: Number) -> bool:
        """Return the answer to a condition; raise `Undecided` for one that is new."""
        if condition.name not in self._answers:
            raise Undecided(condition)
        return self._answers[condition.name]

    def call(self, function: Callable[..., Any], arguments: tuple) -> Any:
        """Return the results of a function after both ways of each of its comparisons.

        The function has no side effects but on lists that it is given.
        """
        rows = [each for each in flat(arguments) if isinstance(each, list)]
        before = [list(row) for row in rows]
        key = function, *map(_key, flat(arguments))
        if key in self._called:
            result, contents, _ = self._called[key]
            for row, numbers in zip(rows, contents, strict=True):
                row[:] = numbers
            return result
        try:
            return function(*arguments)
        except Undecided as fork:
            condition = fork.condition.name
        sides = []
        for answer in (True, False):
            for row, numbers in zip(rows, before, strict=True):
                row[:] = numbers
            block, result = self._side(function, arguments, condition, answer)
            sides.append((block, (result, *(tuple(row) for row in rows))))
        (yes, if_so), (no, if_not) = sides
        outcomes: list[Number] = []
        inside = [[], []]
        result, *contents = self._merged(if_so, if_not, outcomes, inside)
        for row, numbers in zip(rows, contents, strict=True):
            row[:] = numbers
        blocks = [
            Block(block, tuple(each))
            for block, each in zip((yes, no), inside, strict=True)
        ]
        self.operations.append(
            Branch(
                tuple((each.name, each.kind) for each in outcomes), condition, *blocks
            )
        )
        self._called[key] = result, contents, arguments
        return result

    def _side(
        self, function: Callable, arguments: tuple, condition: str, answer: bool
    ) -> tuple[list[Any], Any]:
        """Return the operations of a function after an answer, and its result."""
        before = len(self.operations)
        known = dict(self._known)
        called = dict(self._called)
        self._answers[condition] = answer
        result = self.call(function, arguments)
        del self._answers[condition]
        block = self.operations[before:]
        del self.operations[before:]
        self._known = known
        self._called = called
        return block, result

    def _merged(
        self, yes: Any, no: Any, outcomes: list[Number], inside: list[list]
    ) -> Any:
        """Return a result that has new names where its two forms differ."""
        if isinstance(yes, tuple):
            items = [
                self._merged(a, b, outcomes, inside)
                for a, b in zip(yes, no, strict=True)
            ]
            return type(yes)(*items) if hasattr(yes, "_fields") else tuple(items)
        a, b = (each.name if isinstance(each, Number) else each for each in (yes, no))
        if type(a) is type(b) and a == b:
            return yes
        number = self._new(kind_of((yes, no)))
        outcomes.append(number)
        for side, name in zip(inside, (a, b), strict=True):
            side.append(name)
        return number


class Table:
    """An array that stands in the source; if its numbers are given, those at known places are known."""

    def __init__(self, trace: Trace, name: str, numbers: Any = None) -> None:
        self.trace = trace
        self.name = name
        self.numbers = numbers

    def __getitem__(self, place: Any) -> Any:
        if self.numbers is not None and not isinstance(place, Number):
            return float(self.numbers[place])
        return self.trace.note(operators.READ, "real", self.name, place)


def traced(function: Callable[[Trace], Any]) -> Block:
    """Return the operations of a function of a `Trace`; its results are numbers or tuples, one after another."""
    trace = Trace()
    results = flat(trace.call(function, (trace,)))
    return Block(
        trace.operations,
        tuple(
            each.name if isinstance(each, Number) else float(each) for each in results
        ),
    )


def flat(results: Any) -> Iterator[Any]:
    """Yield the numbers of nested tuples."""
    if isinstance(results, tuple):
        for each in results:
            yield from flat(each)
    else:
        yield results


# ---------------------------------------------------------------------- mathematics of symbols


def _function(
    operator: Operator, plain: Callable[..., Any], kind: str | None = "real"
) -> Callable[..., Any]:
    """Return a function that notes its call, or computes it where all arguments are known; None: of their own kind."""

    def call(*arguments: Any) -> Any:
        symbols = [each for each in arguments if isinstance(each, Number)]
        return (
            symbols[0].trace.note(operator, kind or kind_of(arguments), *arguments)
            if symbols
            else plain(*arguments)
        )

    return call


def _real(x: Any) -> Any:
    """Return a real number for a whole one or a truth."""
    if not isinstance(x, Number):
        return float(x) if isinstance(x, (int, float)) else x
    return x if x.kind == "real" else x.trace.note(operators.REAL, "real", x)


def _where(condition: Any, a: Any, b: Any) -> Any:
    if not isinstance(condition, Number):
        return a if condition else b
    if not isinstance(a, Number) and not isinstance(b, Number) and a == b:
        return a
    return condition.trace.note(operators.WHERE, kind_of((a, b)), condition, a, b)


def _power(x: Any, exponent: Any) -> Any:
    return x * x if _is(exponent, 2.0) else _pow(x, exponent)


_pow = _function(operators.POWER, math.pow)


class Mathematics:
    """Functions for symbols in place of `math` and of the functions that kernels take from NumPy."""

    pi = math.pi
    inf = math.inf
    where = staticmethod(_where)
    power = staticmethod(_power)
    sqrt = staticmethod(_function(operators.SQRT, math.sqrt))
    exp = staticmethod(_function(operators.EXP, math.exp))
    expm1 = staticmethod(_function(operators.EXPM1, math.expm1))
    log = staticmethod(_function(operators.LOG, math.log))
    sin = staticmethod(_function(operators.SIN, math.sin))
    cos = staticmethod(_function(operators.COS, math.cos))
    atan2 = staticmethod(_function(operators.ATAN2, math.atan2))
    floor = staticmethod(_function(operators.FLOOR, math.floor))
    minimum = staticmethod(_function(operators.MINIMUM, min, None))
    maximum = staticmethod(_function(operators.MAXIMUM, max, None))
    is_finite = staticmethod(_function(operators.IS_FINITE, math.isfinite, "bool"))
    integer = staticmethod(_function(operators.INTEGER, int, "index"))
    real = float64 = staticmethod(_real)


class CompiledMathematics(Mathematics):
    """Functions for symbols in place of `compiled_math`."""

    exp = staticmethod(_function(operators.EXP_NEAR, math.exp))
    sin = staticmethod(_function(operators.SIN_NEAR, math.sin))
    wide = staticmethod(_function(operators.WIDE, int, "wide"))
    of_bits = staticmethod(_function(operators.OF_BITS, float))
