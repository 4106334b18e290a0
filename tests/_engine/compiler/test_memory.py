"""Records and scratch memory: what Python writes is what compiled code reads by the same names."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pytest
from numba import njit

from planarfriction._engine.compiler import SOURCES
from planarfriction._engine.compiler.memory import (
    Doubles,
    Integers,
    Layout,
    StructBuffer,
    arrays_at,
    exists,
    offsets_of,
    place_of,
    places_of,
    reader,
    row_of,
    rows_of,
)


class Numbers(NamedTuple):
    """A record without arrays."""

    a: float
    b: int


class Arrays(NamedTuple):
    """A record with arrays, and with a record of its own."""

    first: int
    numbers: Numbers
    values: Doubles
    marks: Integers
    nothing: Doubles


read, read_numbers = reader(Arrays), reader(Numbers)
VALUES, MARKS = np.array([0.5, 1.5, 2.5]), np.array([7, 8], np.int64)
RECORD = Arrays(3, Numbers(0.25, -4), VALUES, MARKS, np.empty(0))


@njit
def seen(place):
    own = read(place)
    return (
        own.first,
        own.numbers.a,
        own.numbers.b,
        own.values[2],
        own.marks[1],
        exists(own.values),
        exists(own.nothing),
    )


@njit
def doubled(place, n):
    own = read(place)
    for i in range(n):
        own.values[i] *= 2.0
    return own.values[0]


@njit
def totals(rows):
    total = 0.0
    for row in rows:
        own = read_numbers(row)
        total += own.a * own.b
    return total


def test_compiled_code_reads_a_record_by_its_names():
    packed = StructBuffer(RECORD)
    assert seen(packed.address) == (3, 0.25, -4, 2.5, 8, True, False)
    assert seen(packed.words) == seen(packed.address)


def test_arrays_are_those_of_the_caller():
    own = VALUES.copy()
    assert doubled(StructBuffer(RECORD._replace(values=own)).address, 3) == 1.0
    assert own.tolist() == [1.0, 3.0, 5.0]


def test_rows_differ_in_their_columns_only():
    assert totals(rows_of(Numbers(2.0, 3), 3, b=np.array([1, 2, 3]))) == 12.0
    weights = np.arange(6.0).reshape(3, 2)
    rows = rows_of(RECORD, 3, values=places_of(weights))
    assert [doubled(row, 1) for row in rows] == [0.0, 4.0, 8.0]


def test_an_array_of_another_type_is_refused():
    for wrong in (VALUES.astype(np.float32), MARKS):
        with pytest.raises(AssertionError):
            row_of(RECORD._replace(values=wrong))
    with pytest.raises(AssertionError):
        place_of(np.zeros((3, 3))[:, 0])


class Scratch(NamedTuple):
    """Arrays of one block."""

    matrix: Doubles
    count: Integers
    vector: Doubles


LAYOUT = Layout(Scratch, vector=3, matrix=(2, 3), count=1)
OFFSETS = LAYOUT.offsets


@njit
def fill(block):
    p = arrays_at(OFFSETS, block)
    p.count[0] = 9
    p.matrix[5] = 2.0
    p.vector[0] = 1.0


def test_a_layout_names_the_parts_of_a_block():
    assert (
        isinstance(OFFSETS, offsets_of(Scratch))
        and tuple(OFFSETS) == (0, 6, 7)
        and LAYOUT.size == 10
    )
    block = np.zeros(LAYOUT.size)
    fill(block)
    assert block[LAYOUT.slices["count"]].view(np.int64).tolist() == [9]
    assert (
        block[LAYOUT.slices["matrix"]].tolist() == [0.0] * 5 + [2.0] and block[7] == 1.0
    )


def test_a_new_block_has_the_shapes_of_its_layout():
    made = LAYOUT.made(vector=VALUES)
    assert (
        made.matrix.shape == (2, 3)
        and made.count.dtype == np.int64
        and made.vector is VALUES
    )
    made.count[0] = 5
    assert made.matrix.tolist() == [[0.0] * 3] * 2


def freed_too_early(function: ast.FunctionDef) -> Iterator[str]:
    """Yield the arrays of a function that are made in it and reached by a pointer: Numba frees them at once."""
    given = {each.arg for each in function.args.args}
    for node in ast.walk(function):
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id == "pointer"
        ):
            yield from {
                each.id for each in ast.walk(node.args[0]) if isinstance(each, ast.Name)
            } - given


@pytest.mark.parametrize("file", SOURCES.files, ids=lambda file: file.stem)
def test_pointers_are_to_arrays_that_a_caller_keeps_alive(file):
    """The last use of an array is where its pointer is taken, and memory in use would be given to another thread."""
    functions = [
        each
        for each in ast.walk(ast.parse(file.read_text()))
        if isinstance(each, ast.FunctionDef)
    ]
    assert {
        each.name: found for each in functions if (found := [*freed_too_early(each)])
    } == {}
