"""Signals: values on both sides of a jump, exact pieces, content as identity, and one clear line for bad input."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction import FrictionError, Signal
from planarfriction.scenes.signal import sample_times
from tests.support.refusals import refusal, refused

EPS = 4 * np.finfo(float).eps  # a handful of roundings


def test_a_held_signal_jumps_at_its_samples():
    signal = Signal.sampled([1.0, 2.0, 3.0], [10.0, 20.0, 30.0])
    assert signal([0.0, 1.0, 1.5, 2.0, 2.5, 3.0, 9.0]).tolist() == [
        10,
        10,
        10,
        20,
        20,
        30,
        30,
    ]
    assert signal.left([0.0, 1.0, 1.5, 2.0, 2.5, 3.0, 9.0]).tolist() == [
        10,
        10,
        10,
        10,
        20,
        20,
        30,
    ]
    assert float(signal(2.0)) == 20.0


def test_a_linear_signal_is_joined_by_straight_lines():
    signal = Signal.sampled([1.0, 2.0, 4.0], [0.0, 1.0, 0.0], hold="linear")
    t = np.array([0.0, 1.0, 1.25, 2.0, 3.0, 4.0, 9.0])
    assert signal(t).tolist() == [0.0, 0.0, 0.25, 1.0, 0.5, 0.0, 0.0]
    assert signal.left(t).tolist() == signal(t).tolist()
    assert signal.breaks.tolist() == [1.0, 2.0, 4.0]


@pytest.mark.parametrize(
    "values", [[0.0, 1.0, 2.0], [[0.0, 0.0], [0.0, 1.0], [0.0, 1.0]]]
)
def test_samples_so_close_that_the_slope_overflows_are_refused(values):
    wrong = r"far enough apart for a finite slope, got 0 s, then 4.94066e-324 s"
    with refused(wrong):
        Signal.sampled([0.0, 5e-324, 0.02], values, hold="linear")(0.01)
    held = Signal.sampled([0.0, 5e-324, 0.02], values)
    assert np.array_equal(held(0.01), values[1])


def test_vector_signals_keep_their_columns():
    signal = Signal.sampled(
        [0.0, 1.0], [[1.0, 2.0, 3.0], [3.0, 2.0, 1.0]], hold="linear"
    )
    assert signal.columns == 3
    assert signal(0.5).tolist() == [2.0, 2.0, 2.0]
    assert signal(np.zeros((4, 5))).shape == (4, 5, 3)
    assert Signal.constant([1.0, 2.0, 3.0])(7.0).tolist() == [1.0, 2.0, 3.0]
    assert Signal.constant(2).columns is None


def test_samples_that_change_nothing_are_no_breaks():
    assert Signal.constant(3.0).breaks.size == 0
    assert Signal.sampled(
        [0.0, 1.0, 2.0, 3.0], [1.0, 1.0, 2.0, 2.0]
    ).breaks.tolist() == [2.0]
    assert Signal.sampled(
        [0.0, 1.0, 2.0, 3.0], [1.0, 1.0, 2.0, 2.0], hold="linear"
    ).breaks.tolist() == [1.0, 2.0]
    held = Signal.sampled([0.0, 1.0], [[0.0, 5.0], [0.0, 6.0]])
    assert held.breaks.tolist() == [1.0]


@given(
    values=st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=12),
    hold=st.sampled_from(["previous", "linear"]),
    extra=st.lists(st.floats(-1.0, 2.0), max_size=6),
    start=st.floats(-0.5, 0.5),
)
@settings(deadline=None, max_examples=50)
def test_pieces_give_the_signal_back(values, hold, extra, start):
    signal = Signal.sampled(start + 0.1 * np.arange(len(values)), values, hold)
    # Exact at the samples, held or linear.
    assert signal(signal.times).tolist() == signal.values.tolist()
    own = signal.breaks
    # No pieces too short to tell apart.
    extra = [t for t in extra if all(abs(t - other) > 1e-6 for other in own)]
    breaks = np.unique(np.concatenate([own, extra, [-2.0, 3.0]]))
    first, slope = signal.pieces(breaks)
    assert first.shape == slope.shape == (len(breaks) - 1,)
    if hold == "previous":
        assert (slope == 0.0).all()
        assert (first == signal(breaks[:-1])).all()
    # Rounding of slope * (up to 6 s).
    scale = np.abs(values).max() + np.abs(slope).max() * 6.0
    middle = 0.5 * (breaks[1:] + breaks[:-1])
    for t in (breaks[:-1], middle):
        assert (
            np.abs(first + slope * (t - breaks[:-1]) - signal(t)).max() <= EPS * scale
        )
    ends = first + slope * np.diff(breaks)
    assert np.abs(ends - signal.left(breaks[1:])).max() <= EPS * scale


def test_pieces_do_not_mind_breaks_that_are_off_by_rounding():
    times = np.arange(100) * 0.01
    signal = Signal.sampled(times, np.arange(100.0))
    added = np.cumsum(np.full(100, 0.01)) - 0.01
    assert (added != times).any()
    first, slope = signal.pieces(np.append(added, 1.0))
    assert first.tolist() == signal.values.tolist()
    assert not slope.any()


def test_pieces_refuse_to_average_over_a_jump():
    signal = Signal.sampled([0.0, 1.0], [0.0, 1.0])
    with refused(
        r"breaks must contain the breaks of the signal, got none at t = 1 s",
        FrictionError,
    ):
        signal.pieces([0.0, 0.5, 1.5])
    with refused("increasing times", FrictionError):
        signal.pieces([0.0, 0.0])


def test_sine_is_sampled_at_multiples_of_dt_and_held():
    signal = Signal.sine(1.73, 0.91, 2.0, t_end=2.0)
    assert signal.times.tolist() == [i * 0.01 for i in range(201)]
    assert (
        signal(0.0375) == signal(0.03) == 1.73 + 0.91 * np.sin(4 * np.pi * (3 * 0.01))
    )
    assert Signal.sine(0.0, 1.0, 1.0, t_end=1.0, phase=np.pi / 2)(0.0) == 1.0


@given(count=st.integers(0, 3000), dt=st.sampled_from([0.01, 1e-3, 0.1, 0.02, 1 / 148]))
@settings(deadline=None, max_examples=50)
def test_sample_times_do_not_accumulate_and_reach_the_end(count, dt):
    times = sample_times(count * dt, dt)
    assert times.tolist() == [i * dt for i in range(count + 1)]


def test_held_is_what_a_digital_controller_sends():
    ramp = Signal.sampled([0.0, 1.0], [0.0, 1.0], hold="linear").held(0.25)
    assert ramp == Signal.sampled(
        [0.0, 0.25, 0.5, 0.75, 1.0], [0.0, 0.25, 0.5, 0.75, 1.0]
    )


def test_signals_are_immutable_and_compare_by_content():
    times = np.array([0.0, 1.0])
    signal = Signal.sampled(times, [1.0, 2.0])
    times[0] = 0.5
    assert signal.times[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        signal.values[0] = 3.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        signal.hold = "linear"
    same = Signal.sampled([0, 1], [1, 2])
    assert signal == same
    assert hash(signal) == hash(same)
    assert signal != Signal.sampled([0, 1], [1, 2], hold="linear")
    # Equal, so equal hashes.
    assert hash(Signal.constant(0.0)) == hash(Signal.constant(-0.0))
    assert signal.breaks.tolist() == [1.0]
    with pytest.raises(ValueError, match="read-only"):
        signal.breaks[0] = 3.0
    assert dataclasses.replace(signal, values=[2.0, 2.0]).breaks.tolist() == []
    assert dataclasses.replace(signal, hold="linear").breaks.tolist() == [0.0, 1.0]


@given(
    values=st.lists(
        st.lists(
            st.floats(allow_nan=False, allow_infinity=False), min_size=3, max_size=3
        ),
        min_size=1,
    ),
    hold=st.sampled_from(["previous", "linear"]),
)
@settings(deadline=None, max_examples=25)
def test_plain_data_round_trips_to_the_bit(values, hold):
    signal = Signal.sampled(np.arange(len(values)) / 3.0, values, hold)
    assert Signal.from_dict(signal.to_dict()) == signal


def test_short_forms_of_plain_data(tmp_path):
    (tmp_path / "load.csv").write_text("# a comment\ntime,left,right\n0,1,2\n0.5,3,4\n")
    assert Signal.from_dict(2) == Signal.constant(2.0)
    assert Signal.from_dict([1, 2, 3]) == Signal.constant([1.0, 2.0, 3.0])
    assert Signal.from_dict(
        {"csv": "load.csv", "value": "right"}, tmp_path
    ) == Signal.sampled([0, 0.5], [2, 4])
    both = Signal.from_dict(
        {"csv": "load.csv", "value": ["right", "left"], "hold": "linear"}, tmp_path
    )
    assert both == Signal.sampled([0, 0.5], [[2, 1], [4, 3]], "linear")
    sine = {"offset": 1.0, "amplitude": 0.5, "frequency": 2, "t_end": 1.0}
    assert Signal.from_dict({"sine": sine}) == Signal.sine(1.0, 0.5, 2.0, t_end=1.0)
    ramp = {"times": [0, 1], "values": [0, 1], "hold": "linear", "dt": 0.5}
    assert Signal.from_dict(ramp) == Signal.sampled([0, 0.5, 1], [0, 0.5, 1])


@pytest.mark.parametrize(
    ("times", "values", "hold", "message"),
    [
        (
            [0, 2, 1],
            [1, 2, 3],
            "previous",
            "times must increase, got 2 s, then 1 s at index 2 (unsorted)",
        ),
        (
            [2e9, 1999999999.5],
            [1, 2],
            "previous",
            "times must increase, got 2000000000 s, then 1999999999.5 s at index 1 (unsorted)",
        ),
        (
            [0, 1, 1],
            [1, 2, 3],
            "previous",
            "times must increase, got 1 s, then 1 s at index 2 (a duplicate)",
        ),
        ([], [], "previous", "times must have at least one sample, got an empty array"),
        (
            [0, 1],
            [1, 2, 3],
            "previous",
            "values must have one row per time (2), got shape [3]",
        ),
        (
            [0, 1],
            [1, np.nan],
            "previous",
            "values must be finite, got nan at index (1,)",
        ),
        (
            [0, np.inf],
            [1, 2],
            "previous",
            "times must be finite, got inf at index (1,)",
        ),
        ([[0, 1]], [1, 2], "previous", "times must have shape [any], got shape [1, 2]"),
        (
            [0, 1],
            [[[1]], [[2]]],
            "previous",
            "values must have shape [any], got shape [2, 1, 1]",
        ),
        (
            ["a", 1],
            [1, 2],
            "previous",
            "times must be an array of numbers, got ['a', 1]",
        ),
        (
            [0, 1],
            [1, 2],
            "lineer",
            "hold must be one of previous, linear, got 'lineer' (did you mean 'linear'?)",
        ),
    ],
)
def test_bad_samples(times, values, hold, message):
    assert refusal(Signal.sampled, times, values, hold) == message


def test_a_force_that_dips_below_zero_is_named_with_its_time():
    Signal.sampled([0, 1], [0, 1]).check_non_negative("normal_force")
    with pytest.raises(FrictionError) as caught:
        Signal.sampled([0, 0.25, 0.5], [1.0, -0.3, -0.4], "linear").check_non_negative(
            "normal_force"
        )
    assert str(caught.value) == "normal_force must be >= 0, got -0.3 at t = 0.25 s"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,load\n0,1\n", "no column 'value'"),
        ("time,vlaue\n0,1\n", "no column 'value' (did you mean 'vlaue'?)"),
        ("time,value\n0,1\n1,abc\n", "line 3, column 'value': 'abc' is not a number"),
        ("# units\ntime,value\n\n0,1\n1\n", "line 5 has 1 columns, the header has 2"),
        ("time,value\n", "has a header line but no rows"),
        ("", "is empty"),
        (
            "time,value\n1,1\n0,1\n",
            "times must increase, got 1 s, then 0 s at index 1 (unsorted)",
        ),
        ("time,value\n0,nan\n", "line 2, column 'value': 'nan' is not finite"),
    ],
)
def test_bad_csv_files_get_one_line(tmp_path, text, message):
    path = tmp_path / "load.csv"
    path.write_text(text)
    line = refusal(Signal.from_csv, path)
    assert message in line and str(path) in line


def test_missing_and_wrong_files_get_one_line(tmp_path):
    with refused(r"none\.csv: no such file", FrictionError):
        Signal.from_csv(tmp_path / "none.csv")
    with refused("is a folder", FrictionError):
        Signal.from_csv(tmp_path)
    (tmp_path / "picture.csv").write_bytes(b"\x89PNG\xff\xfe\x00")
    with refused("not a text file", FrictionError):
        Signal.from_csv(tmp_path / "picture.csv")


def test_what_moves_a_scene_is_no_larger_than_anything_that_exists():
    large = Signal.constant([0.01, 1e155, 1.0])  # a table of numbers may hold it
    model = pf.DistributedModel(pf.ContactPatch.disc(0.01, 5), pf.LuGre())
    with refused(r"twist must be at most 1e\+50 in size, got 1e\+155"):
        pf.scenes.driven(model, twist=large)
