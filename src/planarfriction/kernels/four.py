"""Sums of four numbers at a time, as vector code: the compiler does not find it in scalar sums this small.

The numbers are stored in single precision, and summed in double precision.
"""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_FLAGS = ("contract", "reassoc", "nsz")
_VECTOR = ir.VectorType(ir.DoubleType(), 4)
_STORED = ir.VectorType(ir.FloatType(), 4)
_INDEX = ir.IntType(32)


def _splat(builder, x):
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), x, _INDEX(0))
    return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(_INDEX, 4), [0, 0, 0, 0]))


def _vector(builder, numbers):
    result = ir.Constant(_VECTOR, ir.Undefined)
    for i in range(4):
        result = builder.insert_element(result, builder.extract_value(numbers, i), _INDEX(i))
    return result


def _load(context, builder, array_type, array, at):
    base = (
        context.make_array(array_type)(context, builder, array).data if isinstance(array_type, types.Array) else array
    )
    place = builder.bitcast(builder.gep(base, [at]), _STORED.as_pointer())
    return builder.fpext(builder.load(place, align=4), _VECTOR)


def _plus(builder, total, a, b):
    product = builder.fmul(a, b, flags=_FLAGS)
    return product if total is None else builder.fadd(total, product, flags=_FLAGS)


def _sum(builder, vector):
    parts = [builder.extract_element(vector, _INDEX(i)) for i in range(4)]
    even = builder.fadd(parts[0], parts[2], flags=_FLAGS)
    odd = builder.fadd(parts[1], parts[3], flags=_FLAGS)
    return builder.fadd(even, odd, flags=_FLAGS)


@intrinsic
def four_nodes(typingctx, data, at, node, row, w00, w01, w10, w11):
    """`sum w . data[p : p + 4]` over the nodes `p = at, at + node, at + row, at + row + node`; `data` contiguous."""

    def generate(context, builder, signature, args):
        array, first, node, row, *weights = args
        total = None
        for place, w in zip(_corners(builder, first, node, row), weights, strict=True):
            loaded = _load(context, builder, signature.args[0], array, place)
            total = _plus(builder, total, loaded, _vector(builder, w))
        return _sum(builder, total)

    return types.float64(data, types.intp, types.intp, types.intp, w00, w01, w10, w11), generate


@intrinsic
def four_nodes_levels(typingctx, data, at, node, row, step, t, w00, w01, w10, w11):
    """`four_nodes` of the sum over four levels, `step` apart, with weights `t`."""

    def generate(context, builder, signature, args):
        array, first, node, row, step, t, *weights = args
        shares = [_splat(builder, builder.extract_value(t, i)) for i in range(4)]
        total = None
        for place, w in zip(_corners(builder, first, node, row), weights, strict=True):
            inner = None
            for share in shares:
                loaded = _load(context, builder, signature.args[0], array, place)
                inner, place = _plus(builder, inner, loaded, share), builder.add(place, step)
            total = _plus(builder, total, inner, _vector(builder, w))
        return _sum(builder, total)

    return types.float64(data, types.intp, types.intp, types.intp, types.intp, t, w00, w01, w10, w11), generate


def _corners(builder, first, node, row):
    below = builder.add(first, row)
    return first, builder.add(first, node), below, builder.add(below, node)
