"""Planar rigid motions: power is the same at every point and in every frame."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planarfriction import geometry

numbers = st.floats(-10.0, 10.0)
vectors = st.tuples(numbers, numbers, numbers)
points = st.tuples(numbers, numbers)
angles = st.floats(-7.0, 7.0)
checked = settings(deadline=None, max_examples=50)

ROUNDING = 1e-12
"""Absolute: products of three numbers up to 10, each rounded at 1e-16 of 1e3, and a few of them."""


@given(vectors, vectors, points)
@checked
def test_power_is_the_same_at_every_point(twist, wrench, offset):
    moved = geometry.wrench_at(wrench, offset) @ geometry.twist_at(twist, offset)
    assert moved == pytest.approx(np.dot(wrench, twist), abs=ROUNDING)


@given(vectors, vectors, angles)
@checked
def test_power_is_the_same_in_every_frame(twist, wrench, angle):
    turned = geometry.rotate(wrench, angle) @ geometry.rotate(twist, angle)
    assert turned == pytest.approx(np.dot(wrench, twist), abs=ROUNDING)


@given(vectors, points, points)
@checked
def test_moves_add_up(vector, first, second):
    both = np.add(first, second)
    for move in (geometry.twist_at, geometry.wrench_at):
        assert move(move(vector, first), second) == pytest.approx(
            move(vector, both), abs=ROUNDING
        )
        assert move(move(vector, first), np.negative(first)) == pytest.approx(
            np.array(vector), abs=ROUNDING
        )


@given(vectors, angles, angles)
@checked
def test_turns_add_up(vector, first, second):
    turned = geometry.rotate(geometry.rotate(vector, first), second)
    assert turned == pytest.approx(
        geometry.rotate(vector, first + second), abs=ROUNDING
    )
    assert turned[2] == vector[2]


@given(vectors, points, angles)
@checked
def test_moving_and_turning_commute_when_the_offset_turns_too(vector, offset, angle):
    for move in (geometry.twist_at, geometry.wrench_at):
        turned_first = move(
            geometry.rotate(vector, angle), geometry.rotate(offset, angle)
        )
        assert turned_first == pytest.approx(
            geometry.rotate(move(vector, offset), angle), abs=ROUNDING
        )


def test_signs():
    """Counter-clockwise spin: a point to the right moves up, a point above moves left."""
    spin = (0.0, 0.0, 2.0)
    assert np.array_equal(geometry.twist_at(spin, (3.0, 0.0)), [0.0, 6.0, 2.0])
    assert np.array_equal(geometry.twist_at(spin, (0.0, 3.0)), [-6.0, 0.0, 2.0])
    # An upward force at the origin turns clockwise about a point to its right.
    assert np.array_equal(
        geometry.wrench_at((0.0, 5.0, 0.0), (3.0, 0.0)), [0.0, 5.0, -15.0]
    )
    assert np.array_equal(
        geometry.wrench_at((5.0, 0.0, 0.0), (0.0, 3.0)), [5.0, 0.0, 15.0]
    )
    # A quarter turn; cos(pi/2) in doubles is 6e-17.
    assert geometry.rotate((1.0, 0.0, 7.0), math.pi / 2) == pytest.approx(
        [0.0, 1.0, 7.0], abs=1e-16
    )
    assert geometry.rotate((1.0, 0.0), math.pi / 2) == pytest.approx(
        [0.0, 1.0], abs=1e-16
    )


def test_batches_broadcast():
    twists = np.ones((4, 1, 3))
    offsets = np.arange(10.0).reshape(5, 2)
    moved = geometry.twist_at(twists, offsets)
    assert moved.shape == geometry.wrench_at(twists, offsets).shape == (4, 5, 3)
    assert np.array_equal(moved[2, 3], geometry.twist_at(twists[2, 0], offsets[3]))
    turned = geometry.rotate(np.ones((4, 1, 3)), np.arange(5.0))
    assert turned.shape == (4, 5, 3)
    assert np.array_equal(turned[1, 4], geometry.rotate(np.ones(3), 4.0))


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-3, -0.7, 3.0, 6.5])
def test_a_chord_joins_the_ends_of_an_arc(angle):
    """A turntable moves a point at p by `(R(w dt) - I) p`; without spin the chord is the tangent."""
    dt = 1e-2
    p = np.array([0.3, -0.4])
    spin = angle / dt
    moved = dt * geometry.chord((-spin * p[1], spin * p[0], spin), dt)
    np.testing.assert_allclose(
        moved[:2],
        geometry.rotate(p, angle) - p,
        rtol=1e-3 if abs(angle) < 1e-6 else 1e-12,
    )
    assert moved[2] == pytest.approx(angle) and geometry.chord(
        (1.0, 2.0, 0.0), dt
    ).tolist() == [1.0, 2.0, 0.0]
    assert geometry.chord(np.ones((4, 1, 3)), np.ones(5)).shape == (4, 5, 3)
