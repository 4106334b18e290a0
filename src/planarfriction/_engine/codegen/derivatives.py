"""Derivatives of functions of numbers: a function is traced once, and the chain rule is a sweep over its operations.

Forwards the sweep gives the changes of results along changes of arguments (JVP), backwards the cotangents of arguments
from those of the results (VJP), with the partial derivatives of `rules`. Both are written as Python and compiled like
any other kernel.
"""

from __future__ import annotations

import functools
import inspect
import linecache
import math
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from planarfriction._engine.codegen.rules import (
    NotStraightError,
    Step,
    Tape,
    differentiable,
)
from planarfriction._engine.codegen.source import (
    identifier,
    line_of,
    names_in,
    needed,
    run_source,
    text_of,
)
from planarfriction._engine.codegen.trace import (
    CompiledMathematics,
    Number,
    Operation,
    Trace,
    flat,
)
from planarfriction._engine.compiler import compiled_math, kernel

_HERE = Path(__file__).parent


# ---------------------------------------------------------------------- traces


class Components(tuple):
    """Components of a vector, which `+` and `*` do not join or repeat as they do with tuples."""

    def _refuse(self, *_: Any) -> Any:
        raise NotStraightError("is of vectors: use `plus`, `times`, `dot`")

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = (
        __neg__
    ) = _refuse


class Argument(Number):
    """An argument: a number, or a record whose fields are read by name."""

    __slots__ = ("lengths",)

    def __init__(self, trace: Trace, name: str, lengths: Mapping[str, int]) -> None:
        super().__init__(trace, name)
        self.lengths = lengths

    def __getattr__(self, field: str) -> Any:
        if field.startswith("_"):
            raise AttributeError(field)
        return _argument(self.trace, f"{self.name}.{field}", self.lengths)


def _argument(trace: Trace, name: str, lengths: Mapping[str, int]) -> Any:
    """Return the symbol of an argument, or of a field of one; a vector if its length is given."""
    if name in lengths:
        return Components(Number(trace, f"{name}[{i}]") for i in range(lengths[name]))
    return Argument(trace, name, lengths)


def _symbols_like(trace: Trace, value: Any, name: str) -> Any:
    """Return symbols for the numbers of a value, which lie in the same places of a value of a name."""
    if isinstance(value, tuple):
        return tuple(
            _symbols_like(trace, each, f"{name}[{i}]") for i, each in enumerate(value)
        )
    return Number(trace, name)


class _Traced:
    """A function after a call with symbols: its tape and its value, which took the first `values` operations."""

    def __init__(self, function: Callable, lengths: Mapping[str, int]) -> None:
        self.function = getattr(function, "py_func", function)
        if not inspect.isfunction(self.function):
            raise NotStraightError(
                f"{self.function!r} cannot be traced: give it a `primitive`"
            )
        self.where = f"{self.function.__module__}.{self.function.__qualname__}"
        self.arguments = list(inspect.signature(self.function).parameters)
        self.lengths = lengths
        self.tape = Tape()
        given = [
            CompiledMathematics if name == "xp" else self.argument(name)
            for name in self.arguments
        ]
        try:
            self.value = differentiable()(self.function)(*given)
        except Exception as error:
            raise NotStraightError(self._refusal(error)) from error
        self.values = len(self.tape.operations)
        if any(each is None for each in flat((self.value,))):
            raise NotStraightError(f"{self.where} has no return")

    def argument(self, path: str) -> Any:
        """Return the symbol of an argument, or of a field of one (`law.mu_c`)."""
        head, _, _ = path.partition(".")
        if head not in self.arguments:
            raise NotStraightError(
                f"{self.where} has no argument {head}, only {', '.join(self.arguments)}"
            )
        return _argument(self.tape, path, self.lengths)

    def _refusal(self, error: Exception) -> str:
        """Return one line about the line of the source that cannot be traced."""
        why = (
            error
            if isinstance(error, NotStraightError)
            else f"cannot be traced ({error})"
        )
        for frame, line in reversed(list(traceback.walk_tb(error.__traceback__))):
            file = Path(frame.f_code.co_filename)
            if file.parent != _HERE:
                text = linecache.getline(str(file), line).strip()
                return f"{file.stem}.{frame.f_code.co_qualname}, line {line}: `{text}` {why}"
        return f"{self.where} {why}"


# ---------------------------------------------------------------------- sweeps


def _is_zero(value: Any) -> bool:
    return not isinstance(value, Number) and value == 0.0


def _terms(
    arguments: Sequence[Any], partials: Sequence[Any]
) -> Iterator[tuple[str, Any]]:
    """Yield the numbers that a result depends on, by name, with its derivatives by them."""
    for argument, slope in zip(arguments, partials, strict=True):
        if isinstance(argument, tuple) and isinstance(slope, tuple):
            yield from _terms(argument, slope)
        elif isinstance(argument, Number) and not _is_zero(slope):
            yield argument.name, slope


def _along(steps: Sequence[Step], names: set[str]) -> Iterator[Step]:
    """Yield the steps whose results depend on some numbers, to whose `names` their results are added."""
    for step in steps:
        if any(
            isinstance(each, Number) and each.name in names
            for each in flat(step.arguments)
        ):
            names.update(each.name for each in step.results if isinstance(each, Number))
            yield step


def pull_back(tape: Tape, value: Any, bars: Any, by: set[str]) -> dict[str, Any]:
    """Return the cotangents of numbers from those of a value of the tape; zeros are left out."""
    known: dict[str, Any] = {}

    def add(number: Any, bar: Any) -> None:
        known[number] = known.get(number, 0.0) + bar

    active = set(by)
    steps = list(_along(tape.steps, active))
    for number, bar in zip(flat((value,)), flat((bars,)), strict=True):
        if isinstance(number, Number):
            add(number.name, bar)
    with tape.paused():
        for step in reversed(steps):
            step_bars = [
                known.pop(each.name, 0.0) if isinstance(each, Number) else 0.0
                for each in step.results
            ]
            if all(map(_is_zero, step_bars)):
                continue
            for bar, partials in zip(step_bars, step.partials(), strict=True):
                for name, slope in _terms(step.arguments, partials):
                    if name in active and not _is_zero(bar):
                        add(name, slope * bar)
    return known


def push(tape: Tape, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the changes of all numbers of the tape along those of some; zeros are left out."""
    known = dict(changes)
    with tape.paused():
        for step in _along(tape.steps, set(changes)):
            for number, partials in zip(step.results, step.partials(), strict=True):
                terms = [
                    slope * known[name]
                    for name, slope in _terms(step.arguments, partials)
                    if name in known
                ]
                if isinstance(number, Number) and terms:
                    known[number.name] = sum(terms, 0.0)
    return known


# ---------------------------------------------------------------------- source


class Derivative(NamedTuple):
    """A function with its derivative, both compiled into their callers."""

    function: Callable
    by: tuple[str, ...]
    """Arguments, or fields of arguments, whose cotangents `back` returns, in this order."""
    source: str
    """Text of `forth` and `back`."""
    forth: Any
    """Return the value and a tape, from the arguments of the function."""
    back: Any
    """Return the cotangents of `by`, from the tape and the cotangents of the numbers of the value."""


def derive(
    function: Callable, by: Sequence[str], lengths: Mapping[str, int]
) -> Derivative:
    """Write the derivative of a function backwards.

    `by` are the arguments to differentiate by, a field of a record as `law.mu_c`; `lengths` are those of the arguments
    and fields that are vectors, by name. Loops may go on a number of times that is known.
    Raises `NotStraightError` with the line that cannot be traced. The text depends on nothing but the sources.
    """
    return _derived(function, tuple(by), tuple(sorted(lengths.items())))


@functools.cache
def _derived(function: Callable, by: tuple[str, ...], lengths: tuple) -> Derivative:
    traced = _Traced(function, dict(lengths))
    wanted = tuple(traced.argument(path) for path in by)
    bars = _symbols_like(traced.tape, traced.value, "bars")
    cotangents = pull_back(
        traced.tape, traced.value, bars, {each.name for each in flat(wanted)}
    )
    results = _mapped(wanted, lambda number: cotangents.get(number.name, 0.0))

    # What depends on the cotangents is done on the way back; all else, slopes among it, on the way forth.
    later = {each.name for each in flat((bars,))}
    for each in traced.tape.operations:
        if later.intersection(names_in(each)):
            later.add(each.name)
    back = needed(
        [each for each in traced.tape.operations if each.name in later], _atoms(results)
    )
    read = dict.fromkeys(
        [name for each in back for name in names_in(each)] + _atoms(results)
    )
    kept = [name for name in read if isinstance(name, str) and name not in later]

    tape = f"({''.join(f'{identifier(name)}, ' for name in kept)})"
    forth = _body(_in_turn(traced), [*_atoms(traced.value), *kept])
    forth.append(f"return {_text(traced.value)}, {tape}")
    lines = [f"{tape} = tape"] if kept else []
    lines += _body(back, [each for each in _atoms(results) if each in later], set(kept))
    lines.append(f"return {_text(results)}")
    source = (
        text_of(f"forth({', '.join(traced.arguments)})", forth)
        + "\n\n"
        + text_of("back(tape, bars)", lines)
    )
    space = _run(traced.where, source)
    return Derivative(
        traced.function, by, source, kernel(space["forth"]), kernel(space["back"])
    )


def forward(function: Callable, by: Sequence[str], lengths: Mapping[str, int]) -> Any:
    """Write the derivative of a function forwards: a kernel `(arguments..., changes of by...)`.

    It returns the value and its change. Arguments and errors are those of `derive`.
    """
    return forwards(function, (by,), lengths)


def forwards(
    function: Callable, directions: Sequence[Sequence[str]], lengths: Mapping[str, int]
) -> Any:
    """Write a function with its changes along several directions, each the names of arguments that change.

    The kernel takes the arguments, then the changes of each direction, and returns the value, then its change along
    each. Common operations are computed once.
    """
    return _pushed(
        function, tuple(map(tuple, directions)), tuple(sorted(lengths.items()))
    )


@functools.cache
def _pushed(
    function: Callable, directions: tuple[tuple[str, ...], ...], lengths: tuple
) -> Any:
    traced = _Traced(function, dict(lengths))
    heads = list(traced.arguments)
    results = [traced.value]
    for i, direction in enumerate(directions):
        changes = {}
        for path in direction:
            heads.append(f"change_of_{identifier(path)}_{i}")
            argument = traced.argument(path)
            symbols = _symbols_like(traced.tape, argument, heads[-1])
            for number, change in zip(flat((argument,)), flat((symbols,)), strict=True):
                changes[number.name] = change
        known = push(traced.tape, changes)
        results.append(
            _mapped(traced.value, lambda number, known=known: _change(number, known))
        )
    lines = _body(_in_turn(traced), _atoms(tuple(results)))
    source = text_of(
        f"pushed({', '.join(heads)})", [*lines, f"return {_text(tuple(results))}"]
    )
    return kernel(_run(traced.where, source)["pushed"])


def _change(number: Any, known: Mapping[str, Any]) -> Any:
    return known.get(number.name, 0.0) if isinstance(number, Number) else 0.0


def _mapped(value: Any, function: Callable[[Any], Any]) -> Any:
    """Return a value with another number for each of its numbers."""
    return (
        tuple(_mapped(each, function) for each in value)
        if isinstance(value, tuple)
        else function(value)
    )


def _atoms(value: Any) -> list[Any]:
    """Return the names and constants of the numbers of a value."""
    return [
        each.name if isinstance(each, Number) else float(each)
        for each in flat((value,))
    ]


def _text(value: Any) -> str:
    """Return the source of a value."""
    if isinstance(value, tuple):
        return f"({''.join(f'{_text(each)}, ' for each in value)})"
    return identifier(*_atoms(value))


def _in_turn(traced: _Traced) -> list[Operation]:
    """Return the operations of a trace, with derivatives behind the values that they depend on.

    Else the processor would keep all values until the last one is known.
    """
    turns: dict[str, int] = {}
    for i, each in enumerate(traced.tape.operations):
        known = [turns[name] for name in names_in(each) if name in turns]
        turns[each.name] = i if i < traced.values else max(known, default=0)
    return sorted(traced.tape.operations, key=lambda each: turns[each.name])


def _body(
    operations: Sequence[Operation],
    results: Sequence[Any],
    known: set[str] = frozenset(),
) -> list[str]:
    """Return the lines that compute results; what no operation makes and is not known is read from the arguments."""
    used = needed(operations, results)
    made = {each.name for each in used} | known
    names = [name for each in used for name in names_in(each)] + [
        each for each in results if isinstance(each, str)
    ]
    read = [name for name in dict.fromkeys(names) if name not in made]
    inputs = [
        f"{identifier(name)} = {name}" for name in read if identifier(name) != name
    ]
    return inputs + list(map(line_of, used))


def _run(where: str, source: str) -> dict[str, Any]:
    return run_source(
        where,
        source,
        {"xp": compiled_math, "math": math, "inf": math.inf, "nan": math.nan},
    )
