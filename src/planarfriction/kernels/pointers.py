"""Compiled functions called by their addresses, so that the caller is compiled once for all of them.

Such a function takes addresses of doubles (int64) and numbers (float64) and returns nothing: arguments stay in
registers. Its machine code is cached on disk; its address is looked up anew in each process.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from llvmlite import ir
from llvmlite.binding import add_symbol
from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array

from planarfriction.compiler.interrupts import heard_between_passes

_DOUBLES, _FLOATS = types.CPointer(types.float64), types.CPointer(types.float32)


@functools.cache
def address_of(function: Any, words: str) -> int:
    """Address of a compiled function in this process; `words` has a letter for each argument: p(lace) or f(loat)."""
    signature = tuple(types.int64 if word == "p" else types.float64 for word in words)
    with heard_between_passes():
        function.compile(signature)
    compiled = function.overloads[signature]
    return compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)


def place_of(array: np.ndarray) -> int:
    """Address of the first number of a contiguous array, floats, doubles or integers, which the caller keeps alive."""
    assert array.dtype in (np.float32, np.float64, np.int64) and array.flags.c_contiguous
    return array.ctypes.data


@intrinsic
def call(typingctx, address, arguments):
    """Call the function at `address` with a tuple of arguments; an array passes the address of its first number."""
    if any(isinstance(given, types.Array) and given.layout != "C" for given in arguments):
        return None
    kinds = tuple(types.float64 if isinstance(given, types.Float) else types.int64 for given in arguments)

    def generate(context, builder, signature, args):
        target, packed = args
        values = []
        for i, given in enumerate(signature.args[1]):
            value = builder.extract_value(packed, i)
            if isinstance(given, types.Array):
                value = builder.ptrtoint(context.make_array(given)(context, builder, value).data, ir.IntType(64))
            values.append(value)
        kind = context.call_conv.get_function_type(types.none, kinds)
        function = builder.inttoptr(target, kind.as_pointer())
        # No such function raises: whatever is not finite is found by the caller in its results.
        context.call_conv.call_function(builder, function, types.none, kinds, values)
        return context.get_dummy_value()

    return types.void(address, arguments), generate


@intrinsic
def address(typingctx, array, i):
    """Address of number i of a contiguous array."""
    if not (isinstance(array, types.Array) and array.layout == "C" and isinstance(i, types.Integer)):
        return None

    def generate(context, builder, signature, args):
        first = context.make_array(signature.args[0])(context, builder, args[0]).data
        return builder.ptrtoint(builder.gep(first, [args[1]]), ir.IntType(64))

    return types.int64(array, types.int64), generate


@intrinsic
def doubles(typingctx, address):
    """The doubles at an address: `doubles(a)[i]`."""
    if not isinstance(address, types.Integer):
        return None

    def generate(context, builder, signature, args):
        return builder.inttoptr(args[0], ir.DoubleType().as_pointer())

    return _DOUBLES(address), generate


@intrinsic
def floats(typingctx, address):
    """The numbers of single precision at an address."""
    if not isinstance(address, types.Integer):
        return None

    def generate(context, builder, signature, args):
        return builder.inttoptr(args[0], ir.FloatType().as_pointer())

    return _FLOATS(address), generate


@intrinsic
def integers(typingctx, address):
    """The 64-bit integers at an address."""
    if not isinstance(address, types.Integer):
        return None

    def generate(context, builder, signature, args):
        return builder.inttoptr(args[0], ir.IntType(64).as_pointer())

    return types.CPointer(types.int64)(address), generate


@intrinsic
def at(typingctx, address, i):
    """Address of number i from there on."""
    if not (isinstance(address, types.Integer) and isinstance(i, types.Integer)):
        return None

    def generate(context, builder, signature, args):
        return builder.add(args[0], builder.mul(args[1], ir.Constant(ir.IntType(64), 8)))

    return types.int64(types.int64, types.int64), generate


def _array_over(context, builder, kind, address, shape):
    """An array that owns nothing, over contiguous doubles at an address."""
    eight = ir.Constant(ir.IntType(64), 8)
    strides = [eight] if len(shape) == 1 else [builder.mul(shape[1], eight), eight]
    array = context.make_array(kind)(context, builder)
    data = builder.inttoptr(address, ir.DoubleType().as_pointer())
    populate_array(array, data=data, shape=shape, strides=strides, itemsize=eight, meminfo=None)
    return array._getvalue()


@intrinsic
def vector(typingctx, address, count):
    """An array over `count` doubles at an address."""
    kind = types.Array(types.float64, 1, "C")

    def generate(context, builder, signature, args):
        return _array_over(context, builder, kind, args[0], args[1:])

    return kind(types.int64, types.int64), generate


@intrinsic
def matrix(typingctx, address, rows, columns):
    """An array over `rows` x `columns` doubles at an address."""
    kind = types.Array(types.float64, 2, "C")

    def generate(context, builder, signature, args):
        return _array_over(context, builder, kind, args[0], args[1:])

    return kind(types.int64, types.int64, types.int64), generate


@intrinsic
def integers32(typingctx, address):
    """The 32-bit integers at an address."""
    if not isinstance(address, types.Integer):
        return None

    def generate(context, builder, signature, args):
        return builder.inttoptr(args[0], ir.IntType(32).as_pointer())

    return types.CPointer(types.int32)(address), generate


@intrinsic
def call_c(typingctx, address, arguments):
    """Call the function of a C library at `address` with a tuple of integers and doubles; the word that it returns."""
    if any(not isinstance(given, (types.Integer, types.Float)) for given in arguments):
        return None
    word = ir.IntType(64)

    def generate(context, builder, signature, args):
        target, packed = args
        values = []
        for i, given in enumerate(signature.args[1]):
            wanted = types.float64 if isinstance(given, types.Float) else types.int64
            values.append(context.cast(builder, builder.extract_value(packed, i), given, wanted))
        kind = ir.FunctionType(word, [value.type for value in values])
        return builder.call(builder.inttoptr(target, kind.as_pointer()), values)

    return types.int64(address, arguments), generate


def c_address_of(function: Any, words: int) -> int:
    """Address of a compiled `kernels.callback` for C libraries, which give it `words` addresses."""
    signature = (types.int64,) * words
    with heard_between_passes():
        function.compile(signature)
    compiled = function.overloads[signature]
    return compiled.library.get_pointer_to_function(compiled.fndesc.llvm_cfunc_wrapper_name)


def shared_word(name: str) -> tuple[np.ndarray, Any]:
    """A word of this process that compiled code finds by its name: as an array [1], and as a compiled function."""
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
