"""Compiled functions called by their addresses, so that the caller is compiled once for all.

Such a function takes addresses (int64), pointers to doubles and numbers (float64) and returns nothing: arguments stay
in registers. Its machine code is cached on disk; its address is looked up anew in each process.
"""

from __future__ import annotations

import functools
import inspect
from typing import Any

import numpy as np
from llvmlite import ir
from llvmlite.binding import add_symbol
from numba import types
from numba.extending import intrinsic

from planarfriction._engine.compiler.memory import Doubles, place_of

_POINTER = types.CPointer(types.float64)
_KINDS = {int: types.int64, Doubles: _POINTER, float: types.float64}
_NAMES = {
    "Place": types.int64,
    "int": types.int64,
    "Doubles": _POINTER,
    "float": types.float64,
}
_ARGUMENTS: dict[Any, types.Type] = {**_KINDS, **_NAMES}
"""Types of arguments by their annotations, which may be names."""


def signature_of(function: Any) -> tuple:
    """Return the types of the arguments of a compiled function, which its annotations declare; none is an address."""
    annotations = function.py_func.__annotations__
    return tuple(
        _ARGUMENTS[annotations.get(name, "Place")]
        for name in inspect.signature(function.py_func).parameters
    )


def _compiled(function: Any, signature: tuple) -> Any:
    function.compile(signature)
    return function.overloads[signature]


@functools.cache
def address_of(function: Any) -> int:
    """Return the address in this process of a compiled function whose arguments are annotated."""
    compiled = _compiled(function, signature_of(function))
    return compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)


def c_address_of(function: Any, count: int) -> int:
    """Return the address of a compiled `kernels.callback` for C libraries, which give it `count` addresses."""
    compiled = _compiled(function, (types.int64,) * count)
    return compiled.library.get_pointer_to_function(
        compiled.fndesc.llvm_cfunc_wrapper_name
    )


@intrinsic
def call(typingctx: Any, address: types.Type, arguments: types.Type) -> Any:
    """Call the function at `address` with a tuple of arguments; an array passes the address of its first number."""
    if any(
        isinstance(argument, types.Array) and argument.layout != "C"
        for argument in arguments
    ):
        return None

    def type_of(argument: types.Type) -> types.Type:
        if isinstance(argument, (types.CPointer, types.Array)):
            return _POINTER
        return types.float64 if isinstance(argument, types.Float) else types.int64

    kinds = tuple(type_of(argument) for argument in arguments)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        target, packed = args
        values = []
        for i, argument in enumerate(signature.args[1]):
            value = builder.extract_value(packed, i)
            if isinstance(argument, types.Array):
                value = context.make_array(argument)(context, builder, value).data
            if kinds[i] == _POINTER:
                value = builder.bitcast(value, ir.DoubleType().as_pointer())
            values.append(value)
        kind = context.call_conv.get_function_type(types.none, kinds)
        function = builder.inttoptr(target, kind.as_pointer())
        # No such function raises: whatever is not finite is found by the caller in its results.
        context.call_conv.call_function(builder, function, types.none, kinds, values)
        return context.get_dummy_value()

    return types.void(address, arguments), generate


@intrinsic
def pointer(typingctx: Any, array: types.Type) -> Any:
    """Return the pointer to the first number of a contiguous array."""
    if not (isinstance(array, types.Array) and array.layout == "C"):
        return None

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return context.make_array(signature.args[0])(context, builder, args[0]).data

    return types.CPointer(array.dtype)(array), generate


@intrinsic
def call_c(typingctx: Any, address: types.Type, arguments: types.Type) -> Any:
    """Call the function of a C library at `address` with a tuple of integers, doubles and pointers; return its word."""
    if any(
        not isinstance(argument, (types.Integer, types.Float, types.CPointer))
        for argument in arguments
    ):
        return None
    word = ir.IntType(64)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        target, packed = args
        values = []
        for i, argument in enumerate(signature.args[1]):
            wanted = types.float64 if isinstance(argument, types.Float) else types.int64
            value = builder.extract_value(packed, i)
            pointer = isinstance(argument, types.CPointer)
            values.append(
                builder.ptrtoint(value, word)
                if pointer
                else context.cast(builder, value, argument, wanted)
            )
        kind = ir.FunctionType(word, [value.type for value in values])
        return builder.call(builder.inttoptr(target, kind.as_pointer()), values)

    return types.int64(address, arguments), generate


def shared_word(name: str) -> tuple[np.ndarray, Any]:
    """Return a word of this process that compiled code finds by its name: an array [1], and a compiled reader."""
    word = np.zeros(1, np.int64)
    add_symbol(name, place_of(word))

    @intrinsic
    def read_word(typingctx: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            place = builder.module.globals.get(name) or ir.GlobalVariable(
                builder.module, ir.IntType(64), name
            )
            place.linkage = "external"
            return builder.load(place)

        return types.int64(), generate

    return word, read_word
