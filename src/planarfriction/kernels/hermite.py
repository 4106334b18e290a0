"""Cubic Hermite patches of three components, read in vector code: the compiler does not find it in sums this small.

A node holds four numbers for each component: value, slope along rows, slope along columns, mixed slope, per interval.
They are stored in single precision and summed in double precision, four at a time. A patch is read at `u` of the way
from one row to the next and `v` of that from one column to the next, with its slopes by both; what nobody asks for, the
compiler drops.
"""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_FLAGS = ("contract", "reassoc", "nsz")
_DOUBLE, _INDEX = ir.DoubleType(), ir.IntType(32)
_VECTOR = ir.VectorType(_DOUBLE, 4)
_STORED = ir.VectorType(ir.FloatType(), 4)

# Weights of value and slope at the first node and at the next, cubic polynomials of the place between them from the
# constant on, and their derivatives.
_NEAR = ((1.0, 0.0, -3.0, 2.0), (0.0, 1.0, -2.0, 1.0))
_NEXT = ((0.0, 0.0, 3.0, -2.0), (0.0, 0.0, -1.0, 1.0))
_NEAR_SLOPES = ((0.0, -6.0, 6.0), (1.0, -4.0, 3.0))
_NEXT_SLOPES = ((0.0, 6.0, -6.0), (0.0, -2.0, 3.0))


def _splat(builder, x):
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), x, _INDEX(0))
    return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(_INDEX, 4), [0, 0, 0, 0]))


def _plus(builder, total, a, b):
    product = builder.fmul(a, b, flags=_FLAGS)
    return product if total is None else builder.fadd(total, product, flags=_FLAGS)


def _polynomials(builder, x, both, order):
    """Return a vector of two polynomials of x, number `order[i]` of `both` in its place i."""
    result = None
    for coefficients in reversed(tuple(zip(*both, strict=True))):
        constant = ir.Constant(_VECTOR, [coefficients[k] for k in order])
        result = (
            constant if result is None else builder.fadd(constant, builder.fmul(result, x, flags=_FLAGS), flags=_FLAGS)
        )
    return result


def _weights(builder, u, v):
    """Return the weights of the four numbers of four nodes: of the value, of the slope by u and of that by v."""
    rows, columns = (0, 1, 0, 1), (0, 0, 1, 1)
    u, v = _splat(builder, u), _splat(builder, v)
    along = [_polynomials(builder, u, both, rows) for both in (_NEAR, _NEXT, _NEAR_SLOPES, _NEXT_SLOPES)]
    across = [_polynomials(builder, v, both, columns) for both in (_NEAR, _NEXT, _NEAR_SLOPES, _NEXT_SLOPES)]

    def products(a, b):
        return [builder.fmul(along[a + i], across[b + j], flags=_FLAGS) for i in (0, 1) for j in (0, 1)]

    return products(0, 0), products(2, 0), products(0, 2)


def _load(context, builder, kind, array, at):
    base = context.make_array(kind)(context, builder, array).data if isinstance(kind, types.Array) else array
    place = builder.bitcast(builder.gep(base, [at]), _STORED.as_pointer())
    return builder.fpext(builder.load(place, align=4), _VECTOR)


def _sum(builder, vector):
    halves = [
        builder.shuffle_vector(vector, vector, ir.Constant(ir.VectorType(_INDEX, 2), places))
        for places in ([0, 1], [2, 3])
    ]
    pair = builder.fadd(*halves, flags=_FLAGS)
    return builder.fadd(*(builder.extract_element(pair, _INDEX(i)) for i in (0, 1)), flags=_FLAGS)


def _weighed(builder, weights, numbers):
    """Return the sum over the four nodes."""
    total = None
    for w, four in zip(weights, numbers, strict=True):
        total = _plus(builder, total, four, w)
    return _sum(builder, total)


def _corners(builder, first, node, row):
    below = builder.add(first, row)
    return first, builder.add(first, node), below, builder.add(below, node)


def _vectors(context, builder, kind, values):
    """Return a tuple of tuples of three numbers."""
    three = types.UniTuple(types.float64, 3)
    return context.make_tuple(builder, kind, [context.make_tuple(builder, three, each) for each in values])


@intrinsic
def patch(typingctx, data, at, node, row, u, v):
    """Read components, slopes by u and slopes by v, three each, of the patch whose first node is at `data[at]`.

    Its nodes are at `at, at + node, at + row, at + row + node`; `data` is contiguous.
    """
    result = types.UniTuple(types.UniTuple(types.float64, 3), 3)

    def generate(context, builder, signature, args):
        array, first, node, row, u, v = args
        corners = _corners(builder, first, node, row)
        nodes = [
            [_load(context, builder, data, array, builder.add(place, first.type(4 * m))) for place in corners]
            for m in range(3)
        ]
        sums = ([_weighed(builder, weights, each) for each in nodes] for weights in _weights(builder, u, v))
        return _vectors(context, builder, result, sums)

    return result(data, types.intp, types.intp, types.intp, types.float64, types.float64), generate


@intrinsic
def patch_of_levels(typingctx, data, at, node, row, t, t_slopes, u, v):
    """Read a `patch` of a sum over four levels, 12 numbers apart, with weights `t`; fourth, that with `t_slopes`."""
    result = types.UniTuple(types.UniTuple(types.float64, 3), 4)

    def generate(context, builder, signature, args):
        array, first, node, row, *levels, u, v = args
        corners = _corners(builder, first, node, row)
        shares, slopes = ([_splat(builder, builder.extract_value(four, i)) for i in range(4)] for four in levels)
        nodes, changes = [], []
        for m in range(3):
            loaded = [
                [_load(context, builder, data, array, builder.add(place, first.type(12 * k + 4 * m))) for k in range(4)]
                for place in corners
            ]
            for sums, weights in ((nodes, shares), (changes, slopes)):
                sums.append([_over_levels(builder, weights, each) for each in loaded])
        by_value, by_u, by_v = _weights(builder, u, v)
        sums = ((by_value, nodes), (by_u, nodes), (by_v, nodes), (by_value, changes))
        return _vectors(
            context, builder, result, ([_weighed(builder, w, each) for each in all_of] for w, all_of in sums)
        )

    four = types.UniTuple(types.float64, 4)
    return result(data, types.intp, types.intp, types.intp, four, four, types.float64, types.float64), generate


def _over_levels(builder, weights, numbers):
    total = None
    for w, four in zip(weights, numbers, strict=True):
        total = _plus(builder, total, four, w)
    return total
