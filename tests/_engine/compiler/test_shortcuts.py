"""Shortcuts of the compiler: the types that Numba finds, its own search and Python's collector as before."""

from __future__ import annotations

import gc
import itertools
import operator
import threading

import pytest
from numba.core import errors, types
from numba.core.registry import cpu_target
from numba.core.types.functions import BaseFunction

from planarfriction._engine.compiler import jit, sequential_jit
from planarfriction._engine.compiler.shortcuts import shortcuts

NUMBERS = (types.float64, types.float32, types.int64, types.boolean, types.complex128)
OPERATORS = (
    operator.add,
    operator.truediv,
    operator.lt,
    operator.and_,
    operator.getitem,
)
SEARCH = BaseFunction.get_call_type


def signature(function, arguments):
    """The signature of an operator on types, or the kind of error."""
    context = cpu_target.typing_context
    context.refresh()
    try:
        return context.resolve_value_type(function).get_call_type(
            context, arguments, {}
        )
    except errors.TypingError as error:
        return type(error)


def test_types_of_operators_are_those_that_numba_searches_for():
    cases = list(itertools.product(OPERATORS, itertools.product(NUMBERS, repeat=2)))
    searched = [signature(*case) for case in cases]
    with shortcuts():
        for _ in range(2):
            assert [signature(*case) for case in cases] == searched
    assert len({str(each) for each in searched}) == 10
    assert errors.TypingError in {each for each in searched if isinstance(each, type)}


@pytest.mark.parametrize("collecting", [True, False])
def test_numba_and_the_collector_are_left_as_they_were(collecting):
    if not collecting:
        gc.disable()
    try:
        with pytest.raises(ZeroDivisionError), shortcuts(), shortcuts():
            assert BaseFunction.get_call_type is not SEARCH
            assert not gc.isenabled()
            raise ZeroDivisionError
        assert gc.isenabled() is collecting
    finally:
        gc.enable()
    assert BaseFunction.get_call_type is SEARCH


def test_threads_that_overlap_leave_it_as_it_was_too():
    inside = threading.Event()
    leave = threading.Event()

    def other():
        with shortcuts():
            inside.set()
            leave.wait()

    thread = threading.Thread(target=other)
    thread.start()
    inside.wait()
    with shortcuts():
        leave.set()
        thread.join()
        assert BaseFunction.get_call_type is not SEARCH
        assert not gc.isenabled()
    assert BaseFunction.get_call_type is SEARCH
    assert gc.isenabled()


def harmonic(count):
    total = 0.0
    for i in range(count):
        total += 1.0 / (i + 1.0)
    return total


def test_an_entry_without_vector_instructions_gives_the_same_sum():
    count = 1001
    assert jit(harmonic)(count) == pytest.approx(harmonic(count), rel=1e-14)
    assert sequential_jit(harmonic)(count) == pytest.approx(harmonic(count), rel=1e-14)
