"""Rules of derivatives: partial derivatives of operations and of functions, and the trace that keeps who follows which.

Each operation has its partial derivatives in `PARTIALS`. A function with a kink, or one that loses digits if it is
differentiated operation by operation, declares its own as a `primitive`, as with `custom_jvp` in JAX.
"""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from planarfriction import formulas
from planarfriction._engine.codegen import operators, vectors
from planarfriction._engine.codegen.operators import Operator
from planarfriction._engine.codegen.ratios import per, ratio
from planarfriction._engine.codegen.rebinding import Rewriting
from planarfriction._engine.codegen.symbolic_functions import NAMES, SYMBOLS
from planarfriction._engine.codegen.trace import (
    CompiledMathematics,
    Number,
    Trace,
    flat,
)
from planarfriction._engine.compiler import compiled_math as xp


class NotStraightError(TypeError):
    """A function for which no derivative can be written."""


symbolic = Rewriting(SYMBOLS, NAMES)
"""Function of symbols from a kernel, without primitives."""

_primitives: list[tuple[Any, Callable]] = []


@functools.cache
def differentiable() -> Rewriting:
    """Return the map from kernels to functions of the symbols of a `Tape`."""
    return Rewriting([*SYMBOLS, *_primitives], NAMES)


def primitive(function: Any, partials: Callable[..., tuple]) -> None:
    """Declare the derivatives of a function instead of tracing them.

    `partials(result, *arguments)` returns the derivative by each argument, numbers of a vector in a tuple, and 0.0 for
    an argument that it does not depend on. If there are several results, it returns such a tuple for each of them.
    """
    value = symbolic(function)
    slopes = symbolic(partials)

    def call(*arguments: Any) -> Any:
        tape = next(
            (each.trace for each in flat(arguments) if isinstance(each, Number)), None
        )
        if tape is None:
            return value(*arguments)
        with tape.paused():
            result = value(*arguments)
        tape.step(result, arguments, slopes)
        return result

    _primitives.append((function, call))
    differentiable.cache_clear()


@symbolic
def _power_slope(x: Any, exponent: Any, raised: Any) -> Any:
    """Return the derivative of `x^exponent` by x; at 0 the right-hand limit for exponents >= 1."""
    return xp.where(
        x > 0.0, exponent * raised * per(x), xp.where(exponent == 1.0, 1.0, 0.0)
    )


@symbolic
def _log(x: Any) -> Any:
    """Return `log x`; 0 at 0, where `x^e log x` vanishes."""
    return xp.log(xp.where(x > 0.0, x, 1.0))


_per = symbolic(per)
_where = CompiledMathematics.where

# By a constant; see `Tape.note` for others.
PARTIALS: dict[Operator, Callable[..., tuple]] = {
    operators.ADD: lambda t, a, b: (1.0, 1.0),
    operators.SUBTRACT: lambda t, a, b: (1.0, -1.0),
    operators.MULTIPLY: lambda t, a, b: (b, a),
    operators.DIVIDE: lambda t, a, b: (
        1.0 / b,
        0.0,
    ),
    operators.NEGATE: lambda t, a: (-1.0,),
    operators.ABS: lambda t, a: (_where(a >= 0.0, 1.0, -1.0),),
    operators.SQRT: lambda t, a: (0.5 * _per(t),),
    operators.POWER: lambda t, x, exponent: (_power_slope(x, exponent, t), t * _log(x)),
    operators.EXP: lambda t, a: (t,),
    operators.EXP_NEAR: lambda t, a: (t,),
    operators.EXPM1: lambda t, a: (t + 1.0,),
    operators.LOG: lambda t, a: (1.0 / a,),
    operators.SIN: lambda t, a: (CompiledMathematics.cos(a),),
    operators.SIN_NEAR: lambda t, a: (CompiledMathematics.cos(a),),
    operators.COS: lambda t, a: (-CompiledMathematics.sin(a),),
    operators.WHERE: lambda t, condition, a, b: (
        0.0,
        _where(condition, 1.0, 0.0),
        _where(condition, 0.0, 1.0),
    ),
    operators.MINIMUM: lambda t, a, b: (
        _where(a <= b, 1.0, 0.0),
        _where(a <= b, 0.0, 1.0),
    ),
    operators.MAXIMUM: lambda t, a, b: (
        _where(a >= b, 1.0, 0.0),
        _where(a >= b, 0.0, 1.0),
    ),
    operators.REAL: lambda t, a: (0.0,),
}
"""Partial derivatives of the result t of an operation by its arguments; of equal numbers the first one counts."""


def _slip_fraction(alpha: Any, _: Any, deflection: Any, breakaway_ratio: Any) -> tuple:
    """Return no slope before breakaway and at full deflection.

    The slope is multiplied by how far a long step would have gone, 1e9, or by one over hardly any deflection: rounding
    of the cosine would show.
    """
    partly = (deflection > breakaway_ratio) & (deflection < 1.0)
    slope = xp.where(
        partly, formulas.slip_fraction_slope(xp, deflection, breakaway_ratio), 0.0
    )
    return (
        0.0,
        slope,
        formulas.bristle_decay_by_breakaway(xp, slope, deflection, breakaway_ratio),
    )


def _relaxation(results: tuple, _: Any, x: Any) -> tuple:
    remaining, mean = results
    return (0.0, -remaining), (0.0, formulas.relaxation_slope(xp, x, remaining, mean))


def _unit(size: Any, a: Any) -> tuple:
    """Return the unit vector of `a`; zeros without a direction.

    Quotients, since compilers order products anew: one over a norm of 1e-160 leaves the range of numbers if it is
    squared, or multiplied by anything but its vector.
    """
    divisor = xp.where(size > 0.0, size, 1.0)
    return (tuple(each / divisor for each in a),)


primitive(vectors.norm, _unit)
primitive(per, lambda t, x: (-t * t,))
primitive(ratio, lambda t, x, y: (per(y), -t * per(y)))
primitive(formulas.relaxation, _relaxation)
primitive(formulas.slip_fraction, _slip_fraction)


# ---------------------------------------------------------------------- traces


class Step(NamedTuple):
    """A step of the chain rule: numbers that come out of others."""

    results: tuple
    arguments: tuple
    partials: Callable[[], tuple]
    """Return a tuple for each result, as `primitive` describes it."""


class Tape(Trace):
    """A trace that keeps the steps of the chain rule."""

    def __init__(self) -> None:
        super().__init__()
        self.steps: list[Step] = []
        self._stepped: set[str] = set()
        self._pauses = 0

    @contextlib.contextmanager
    def paused(self) -> Iterator[None]:
        """Note operations, but no steps."""
        self._pauses += 1
        yield
        self._pauses -= 1

    def step(
        self, result: Any, arguments: tuple, partials: Callable[..., tuple]
    ) -> None:
        """Keep a step, unless it is part of another one."""
        if self._pauses:
            return
        several = isinstance(result, tuple)
        numbers = tuple(each for each in flat((result,)))
        self._stepped.update(each.name for each in numbers if isinstance(each, Number))
        found = functools.partial(partials, result, *arguments)
        self.steps.append(
            Step(numbers, arguments, found if several else lambda: (found(),))
        )

    def note(self, operator: Operator, kind: str, *arguments: Any) -> Number:
        """Return the result of an operation; one that has a derivative is a step."""
        if self._pauses or kind != "real":
            return super().note(operator, kind, *arguments)
        if operator == operators.DIVIDE and isinstance(arguments[1], Number):
            return self._quotient(*arguments)
        result = super().note(operator, kind, *arguments)
        if operator not in PARTIALS:
            raise NotStraightError(
                f"has no derivative (`{operator.python}`): give the function a `primitive`"
            )
        if result.name not in self._stepped:
            self.step(result, arguments, PARTIALS[operator])
        return result

    def _quotient(self, a: Any, b: Number) -> Number:
        """Return a quotient as a product with `1/b`, which its derivatives share."""
        with self.paused():
            per_b = 1.0 / b
            result = a * per_b
        self.step(result, (a, b), lambda t, a, b: (per_b, -t * per_b))
        return result

    def decide(self, condition: Number) -> bool:
        """Refuse to decide how a function goes on."""
        raise NotStraightError(
            "asks which way a comparison goes: use `xp.where`, and `&` for `and`"
        )
