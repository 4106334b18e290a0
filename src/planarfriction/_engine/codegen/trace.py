"""Straight-line functions traced with symbols, operation by operation.

A kernel is called in Python with `Number`s instead of floats, which note each operation on a `Trace`. A function
that asks which way a comparison goes is traced once for either answer, and a `Branch` joins the results. Loops run
as long as their count is known. Compiled functions are called through their Python twins (see `twins`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple


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
    text: str
    """Source with `{0}`, `{1}` for the arguments, `$` before the name of a mathematical function, and `@` before the
    name of a function of `compiled_math`, whose domain may be smaller."""
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


def _asking(text: str) -> Callable[[Any, Any], Any]:
    """Return an operator of two numbers whose result is a truth."""
    return lambda one, other: one.trace.note(text, "bool", one, other)


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
        return self if _is(other, 0.0) else self._noted("{0} + {1}", self, other)

    def __radd__(self, other: Any) -> Any:
        return self if _is(other, 0.0) else self._noted("{0} + {1}", other, self)

    def __sub__(self, other: Any) -> Any:
        return self if _is(other, 0.0) else self._noted("{0} - {1}", self, other)

    def __rsub__(self, other: Any) -> Any:
        return -self if _is(other, 0.0) else self._noted("{0} - {1}", other, self)

    def __mul__(self, other: Any) -> Any:
        if _is(other, 0.0):
            return other
        if _is(other, 1.0):
            return self
        return -self if _is(other, -1.0) else self._noted("{0} * {1}", self, other)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        return self if _is(other, 1.0) else self._noted("{0} / {1}", self, other)

    def __rtruediv__(self, other: Any) -> Any:
        return other if _is(other, 0.0) else self._noted("{0} / {1}", other, self)

    def __neg__(self) -> Number:
        return self._noted("-{0}", self)

    def __abs__(self) -> Number:
        return self._noted("$fabs({0})", self)

    __lt__ = _asking("{0} < {1}")
    __le__ = _asking("{0} <= {1}")
    __gt__ = _asking("{0} > {1}")
    __ge__ = _asking("{0} >= {1}")
    __eq__ = _asking("{0} == {1}")
    __ne__ = _asking("{0} != {1}")  # type: ignore[assignment]

    def __and__(self, other: Any) -> Any:
        return (
            _asking("{0} && {1}")(self, other)
            if isinstance(other, Number)
            else other and self
        )

    def __or__(self, other: Any) -> Any:
        return (
            _asking("{0} || {1}")(self, other)
            if isinstance(other, Number)
            else other or self
        )

    __rand__ = __and__
    __ror__ = __or__
    __hash__ = None  # type: ignore[assignment]

    def __lshift__(self, other: Any) -> Any:
        return self._noted("{0} << {1}", self, other)

    def _noted(self, text: str, *arguments: Any) -> Number:
        return self.trace.note(text, kind_of(arguments), *arguments)


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

    def note(self, text: str, kind: str, *arguments: Any) -> Number:
        """Return the result of an operation."""
        names = tuple(
            each.name if isinstance(each, Number) else each for each in arguments
        )
        key = text, *((type(each), each) for each in names)
        if key not in self._known:
            self._known[key] = self._new(kind)
            if kind == "real" and "[" not in text:  # indices of tables stay whole
                kinds = [getattr(each, "kind", "") for each in arguments]
                text = text.format(
                    *(
                        f"(real){{{i}}}" if one == "index" else f"{{{i}}}"
                        for i, one in enumerate(kinds)
                    )
                )
            self.operations.append(Operation(self._known[key].name, kind, text, names))
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
        return self.trace.note(self.name + "[{0}]", "real", place)


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
    text: str, plain: Callable[..., Any], kind: str | None = "real"
) -> Callable[..., Any]:
    """Return a function that notes its call, or computes it where all arguments are known; None: of their own kind."""

    def call(*arguments: Any) -> Any:
        symbols = [each for each in arguments if isinstance(each, Number)]
        return (
            symbols[0].trace.note(text, kind or kind_of(arguments), *arguments)
            if symbols
            else plain(*arguments)
        )

    return call


def _where(condition: Any, a: Any, b: Any) -> Any:
    if not isinstance(condition, Number):
        return a if condition else b
    if not isinstance(a, Number) and not isinstance(b, Number) and a == b:
        return a
    return condition.trace.note("{0} ? {1} : {2}", kind_of((a, b)), condition, a, b)


def _power(x: Any, exponent: Any) -> Any:
    return x * x if _is(exponent, 2.0) else _pow(x, exponent)


_pow = _function("$pow({0}, {1})", math.pow)


class Mathematics:
    """Functions for symbols in place of `math` and of the functions that kernels take from NumPy."""

    pi = math.pi
    inf = math.inf
    where = staticmethod(_where)
    power = staticmethod(_power)
    sqrt = staticmethod(_function("$sqrt({0})", math.sqrt))
    exp = staticmethod(_function("$exp({0})", math.exp))
    expm1 = staticmethod(_function("$expm1({0})", math.expm1))
    log = staticmethod(_function("$log({0})", math.log))
    sin = staticmethod(_function("$sin({0})", math.sin))
    cos = staticmethod(_function("$cos({0})", math.cos))
    atan2 = staticmethod(_function("$atan2({0}, {1})", math.atan2))
    floor = staticmethod(_function("$floor({0})", math.floor))
    minimum = staticmethod(_function("{0} < {1} ? {0} : {1}", min, None))
    maximum = staticmethod(_function("{0} > {1} ? {0} : {1}", max, None))
    is_finite = staticmethod(_function("isfinite({0})", math.isfinite, "bool"))
    integer = staticmethod(_function("(int)({0})", int, "index"))
    real = float64 = staticmethod(_function("{0}", float))


class CompiledMathematics(Mathematics):
    """Functions for symbols in place of `compiled_math`."""

    exp = staticmethod(_function("@exp({0})", math.exp))
    sin = staticmethod(_function("@sin({0})", math.sin))
    wide = staticmethod(_function("(long long)(int)({0})", int, "wide"))
    of_bits = staticmethod(_function("of_bits({0})", float))
