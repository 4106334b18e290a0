"""Inner functions: no machine code of their own, the same numbers in their callers, and no crash from Python."""

from __future__ import annotations

import math

import pytest
from numba import njit
from numba.core import event
from numba.core.errors import TypingError

from planarfriction._engine.compiler import kernel

POINT = 0.7


@kernel
def wave(x):
    return math.sin(3.0 * x) + x if x > 0.0 else -x


@kernel
def twice(x):
    total = 0.0
    for each in (x, -x):
        total += wave(each)
    return total


def outer(x):
    return twice(x) + wave(x)


def symbol_of(function) -> tuple:
    """The code of a compiled function, and its name in there."""
    (compiled,) = function.overloads.values()
    return compiled.library, compiled.fndesc.llvm_func_name


def test_callers_take_inner_functions_in_and_give_the_same_numbers():
    compiled = njit(outer)
    assert compiled(POINT) == pytest.approx(
        2.0 * math.sin(3.0 * POINT) + 3.0 * POINT, rel=1e-15
    )
    library, name = symbol_of(compiled)
    assert library.get_pointer_to_function(name) != 0
    inside = library.get_llvm_str()
    for function in (wave, twice):
        library, name = symbol_of(function)
        assert library.get_pointer_to_function(name) == 0
        assert name not in inside


def test_inner_functions_skip_passes_that_find_nothing_in_them():
    @kernel
    def half(x):
        return 0.5 * x

    @njit
    def whole(x):
        return half(x) + half(x)

    with event.install_recorder("numba:run_pass") as recorder:
        whole(POINT)
    passes = [
        each.data["name"].split(" [")[0] for _, each in recorder.buffer if each.is_start
    ]
    assert passes.count("nopython_type_inference") == 2
    assert passes.count("inline_closure_likes") == passes.count("native_lowering") == 1
    assert passes.count("lowering of inner functions") == 1


def test_an_inner_function_called_from_python_is_an_error_and_no_crash():
    @kernel
    def third(x):
        return x / 3.0

    with pytest.raises(TypeError):
        third(POINT)


def test_what_does_not_compile_says_where():
    @kernel
    def wrong(x):
        return x + "a word"

    with pytest.raises(TypingError, match="No implementation of function") as error:
        njit(lambda x: wrong(x))(POINT)
    assert 'return x + "a word"' in str(error.value)
