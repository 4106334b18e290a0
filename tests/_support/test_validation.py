"""Checks of input at their limits: what just passes, what just does not, and the line that says so."""

import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from planarfriction._support import validation as v
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LARGEST
from tests.support.refusals import refused

ABOVE = float(np.nextafter(LARGEST, np.inf))


def message_of(check, *given, **options):
    with pytest.raises(InvalidValueError) as error:
        check("x", *given, **options)
    message = str(error.value)
    assert message.startswith("x") and "\n" not in message
    return message


@pytest.mark.parametrize(
    "value", [LARGEST, -LARGEST, 0.0, 3, np.float32(0.5), Fraction(1, 4), np.array(2.0)]
)
def test_numbers_that_pass_are_floats(value):
    found = v.number("x", value)
    assert type(found) is float and found == float(value)


@pytest.mark.parametrize(
    ("value", "rule"),
    [
        (ABOVE, "be at most 1e"),
        (-ABOVE, "be at most 1e"),
        (math.inf, "be finite"),
        (-math.inf, "be finite"),
        (math.nan, "be finite"),
        (10**400, "be finite"),
        (-(10**400), "be finite"),
        (True, "be a number and no truth value"),
        (1j, "be a number and not complex"),
        ("0.02", "be a number, got '0.02'"),
        ([1.0], "be a number"),
        (np.timedelta64(1, "s"), "no time with a separate unit"),
        (np.datetime64("2026-01-01"), "no date"),
        (np.ma.masked_array(1.0, True), "not masked"),
        (None, "be a number"),
    ],
)
def test_what_is_no_finite_number_is_refused(value, rule):
    assert rule in message_of(v.number, value)


def test_ends_of_ranges():
    assert (
        v.positive("x", v.SMALLEST) == v.SMALLEST
        and v.positive_load("x", 5e-324) == 5e-324
    )
    assert v.non_negative("x", 0) == 0.0 and v.length("x", v.LONGEST) == v.LONGEST
    assert "must be > 0, got 0" in message_of(
        v.positive, 0.0
    ) and "must be > 0" in message_of(v.positive_load, 0.0)
    assert "must be at least 1e-50" in message_of(v.positive, 0.9 * v.SMALLEST)
    assert "must be >= 0" in message_of(v.non_negative, -5e-324)
    assert "must be at most 1e+24" in message_of(v.length, 1.001 * v.LONGEST)
    assert (v.count("x", 3, 3, 3), v.count("x", 4.0, 3, 5)) == (3, 4)
    assert "an integer >= 3, got 2" in message_of(v.count, 2, 3)
    assert "an integer >= 1, got 1.5" in message_of(v.count, 1.5)
    assert "at most 5, got 6" in message_of(v.count, 6, 3, 5)
    assert v.number_in("x", " -2.5e-3") == -2.5e-3
    assert "be a number, got" in message_of(
        v.number_in, "1,5"
    ) and "be finite" in message_of(v.number_in, "-inf")


def test_batches_stand_before_what_is_inside():
    assert (
        v.batched(4, (2, 3)) == (4, 2, 3)
        and v.batched((5, 0), (3,)) == (5, 0, 3)
        and v.batched((), (3,)) == (3,)
    )
    assert len(v.batched([1] * 31, (3,))) == 32
    with refused("at most 32 axes and 30000000 numbers"):
        v.batched([1] * 32, (3,))
    assert v.batched(10_000_000, (3,)) == (10_000_000, 3)
    with refused("at most 32 axes"):
        v.batched(10_000_001, (3,))


def test_arrays_have_their_shape_and_say_where_they_are_wrong():
    given = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
    found = v.array("x", given, (None, 2))
    assert found is not given and (found == given).all()
    assert v.numbers("x", given) is given and v.finite_numbers("x", given) is given
    assert "have shape [any, 3], got shape [3, 2]" in message_of(
        v.array, given, (None, 3)
    )
    assert "have shape [2], got shape [3, 2]" in message_of(v.vector, given, 2)
    assert v.vector("x", [1, 2], 2).dtype == float
    for value, told in (
        (np.nan, "finite, got nan at index (2, 1)"),
        (-np.inf, "finite, got -inf at index (2, 1)"),
    ):
        given[2, 1] = value
        assert told in message_of(v.array, given, (None, 2)) and told in message_of(
            v.finite_numbers, given
        )
    given[2, 1] = -ABOVE
    assert "be at most 1e" in message_of(v.finite_numbers, given)
    given[2] = 4.0, -5.0
    assert v.array("x", given, (3, 2), largest=5.0)[2, 1] == -5.0
    assert "at most 4.9 in size, got -5.0 at index (2, 1)" in message_of(
        v.array, given, (3, 2), largest=4.9
    )
    assert "be >= 0, got -5.0 at index (2, 1)" in message_of(
        v.non_negative_array, given, (3, 2)
    )
    assert "be > 0, got -5.0 at index 5" in message_of(v.positive_array, given, (3, 2))
    given[2, 1] = 0.0
    assert v.non_negative_array("x", given, (3, 2))[2, 1] == 0.0
    assert "be > 0, got 0.0 at index 5" in message_of(v.positive_array, given, (3, 2))
    assert "rows of equal length" in message_of(v.numbers, [[1.0], [1.0, 2.0]])
    assert "no truth value" in message_of(v.numbers, [[1.0, True]])
    assert "at most 16 deep" in message_of(v.numbers, eval(17 * "[" + "'1'" + 17 * "]"))


def test_many_numbers_at_once():
    assert (v.non_negative_numbers("x", [0.0, LARGEST]) == [0.0, LARGEST]).all()
    assert "be at most 1e" in message_of(v.non_negative_numbers, [0.0, ABOVE])
    for bad in (-1.0, math.inf, math.nan):
        assert "be finite and >= 0" in message_of(v.non_negative_numbers, [0.0, bad])
    assert (v.filled("x", [[1.0], [2.0]], (2, 3)) == [[1.0] * 3, [2.0] * 3]).all()
    assert "have shape [2, 3], got shape [3, 1]" in message_of(
        v.filled, np.ones((3, 1)), (2, 3)
    )
    assert "be finite" in message_of(v.filled, math.nan, (2,))
    wide = np.broadcast_to(1.0, v.MOST_NUMBERS + 1)
    for check, given in (
        (v.finite_numbers, ()),
        (v.non_negative_numbers, ()),
        (v.array, ((None,),)),
    ):
        assert "hold at most 30000000 numbers" in message_of(check, wide, *given)
    v.within_range("x", -LARGEST, LARGEST)
    assert message_of(v.within_range, -ABOVE, 0.0).endswith(f"got {-ABOVE}")
    assert message_of(v.within_range, 0.0, ABOVE).endswith(f"got {ABOVE}")
    assert "be finite, got -inf" in message_of(v.within_range, -math.inf, math.inf)
    assert "be finite" in message_of(v.within_range, math.nan, math.nan)


def test_quantities_are_taken_in_plain_si_alone():
    class Stated:
        units = "N m / rad"

        def __float__(self):
            return 2.0

    assert v.number("x", Stated()) == 2.0
    for unit in ("mm", "deg", "%", "kN", 3):
        Stated.units = unit
        assert "in SI units" in message_of(v.number, Stated())


def test_texts_paths_and_choices():
    assert v.text("x", "a b") == "a b" and v.text("x", 100 * "a") == 100 * "a"
    for bad in ("", " a", "a ", "a\n", 3):
        assert "be a text that is not empty" in message_of(v.text, bad)
    assert "at most 100 characters, got 101" in message_of(v.text, 101 * "a")
    assert v.path("x", "a/b") == Path("a/b")
    assert "be a path" in message_of(v.path, b"a") and "be a path" in message_of(
        v.path, 3
    )
    assert v.choice("x", "reduced", ["distributed", "reduced"]) == "reduced"
    told = message_of(v.choice, "redused", ["distributed", "reduced"])
    assert (
        "must be one of distributed, reduced, got 'redused' (did you mean 'reduced'?)"
        in told
    )
    assert message_of(v.choice, "zzz", ["a", "b"]).endswith("one of a, b, got 'zzz'")
    assert v.choices("x", ("b", "a"), ["a", "b"]) == ["b", "a"]
    assert "be a list of a, b" in message_of(v.choices, "a", ["a", "b"])
    assert v.instance(
        "x", 3, int, "a number"
    ) == 3 and "be a number, got '3'" in message_of(v.instance, "3", int, "a number")


def test_tables_have_their_keys_and_no_others():
    v.keys("x", {"a": 1, "b": 2}, ["a"], ["b", "c"])
    assert "x key must be one of a, b" in message_of(
        v.keys, {"a": 1, "d": 2}, ["a"], ["b"]
    )
    assert "have the key 'a', got b" in message_of(v.keys, {"b": 1}, ["a"], ["b"])
    assert "have the key 'a', got none" in message_of(v.keys, {}, ["a"])
    assert "be a table of keys and values" in message_of(v.keys, [1], ["a"])


def test_shapes_that_do_not_broadcast_are_named():
    assert v.broadcast(one=np.ones((4, 1)), other=np.ones(3)) == (4, 3)
    with refused(r"one and other must broadcast, got shapes \[2\], \[3\]"):
        v.broadcast(one=np.ones(2), other=np.ones(3))
