"""Compiled functions called by their addresses, so that the caller is compiled once for all of them.

Such a function takes addresses (int64), pointers to doubles and numbers (float64) and returns nothing: arguments stay
in registers. Its machine code is cached on disk; its address is looked up anew in each process.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from llvmlite import ir
from llvmlite.binding import add_symbol
from numba import types
from numba.extending import intrinsic

from planarfriction.compiler.memory import place_of

_ARGUMENTS = {"p": types.int64, "d": types.CPointer(types.float64), "f": types.float64}
"""Types of the letters of `words`: place (address), doubles (pointer), number."""


Function = tuple[Any, str]
"""A compiled function and a letter for each of its arguments: p, d or f."""


def signature_of(words: str) -> tuple:
    """Return the types of the arguments with these letters."""
    return tuple(_ARGUMENTS[word] for word in words)


def _compiled(function: Any, signature: tuple) -> Any:
    function.compile(signature)
    return function.overloads[signature]


@functools.cache
def address_of(function: Any, words: str) -> int:
    """Return the address of a compiled function in this process; `words` has a letter for each argument: p, d or f."""
    compiled = _compiled(function, signature_of(words))
    return compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)


def c_address_of(function: Any, words: int) -> int:
    """Return the address of a compiled `kernels.callback` for C libraries, which give it `words` addresses."""
    compiled = _compiled(function, (types.int64,) * words)
    return compiled.library.get_pointer_to_function(compiled.fndesc.llvm_cfunc_wrapper_name)


@intrinsic
def call(typingctx, address, arguments):
    """Call the function at `address` with a tuple of arguments; an array passes the address of its first number."""
    if any(isinstance(given, types.Array) and given.layout != "C" for given in arguments):
        return None

    def passed(given):
        if isinstance(given, (types.CPointer, types.Array)):
            return _ARGUMENTS["d"]
        return types.float64 if isinstance(given, types.Float) else types.int64

    kinds = tuple(passed(given) for given in arguments)

    def generate(context, builder, signature, args):
        target, packed = args
        values = []
        for i, given in enumerate(signature.args[1]):
            value = builder.extract_value(packed, i)
            if isinstance(given, types.Array):
                value = context.make_array(given)(context, builder, value).data
            if kinds[i] == _ARGUMENTS["d"]:
                value = builder.bitcast(value, ir.DoubleType().as_pointer())
            values.append(value)
        kind = context.call_conv.get_function_type(types.none, kinds)
        function = builder.inttoptr(target, kind.as_pointer())
        # No such function raises: whatever is not finite is found by the caller in its results.
        context.call_conv.call_function(builder, function, types.none, kinds, values)
        return context.get_dummy_value()

    return types.void(address, arguments), generate


@intrinsic
def pointer(typingctx, array):
    """Return the pointer to the first number of a contiguous array."""
    if not (isinstance(array, types.Array) and array.layout == "C"):
        return None

    def generate(context, builder, signature, args):
        return context.make_array(signature.args[0])(context, builder, args[0]).data

    return types.CPointer(array.dtype)(array), generate


@intrinsic
def call_c(typingctx, address, arguments):
    """Call the function of a C library at `address` with a tuple of integers, doubles and pointers; return its word."""
    if any(not isinstance(given, (types.Integer, types.Float, types.CPointer)) for given in arguments):
        return None
    word = ir.IntType(64)

    def generate(context, builder, signature, args):
        target, packed = args
        values = []
        for i, given in enumerate(signature.args[1]):
            wanted = types.float64 if isinstance(given, types.Float) else types.int64
            value = builder.extract_value(packed, i)
            pointer = isinstance(given, types.CPointer)
            values.append(builder.ptrtoint(value, word) if pointer else context.cast(builder, value, given, wanted))
        kind = ir.FunctionType(word, [value.type for value in values])
        return builder.call(builder.inttoptr(target, kind.as_pointer()), values)

    return types.int64(address, arguments), generate


def shared_word(name: str) -> tuple[np.ndarray, Any]:
    """Return a word of this process that compiled code finds by its name: an array [1], and a compiled reader."""
    word = np.zeros(1, np.int64)
    add_symbol(name, place_of(word))

    @intrinsic
    def read_word(typingctx):
        def generate(context, builder, signature, args):
            place = builder.module.globals.get(name) or ir.GlobalVariable(builder.module, ir.IntType(64), name)
            place.linkage = "external"
            return builder.load(place)

        return types.int64(), generate

    return word, read_word
