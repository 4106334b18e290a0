"""Patches, plans, estimates, scenes, frames, sweeps, the explorer's answers, and replies to bad input are as recorded.

`tests/support/computed.py` and `tests/support/replies.py` compute them, `python -m tests.support.recording NAME`
records them again. Most follow closed forms that other tests check; these records see every other number and word.
"""

import json

import numpy as np
import pytest

from tests.support import recorded, subjects

ELSEWHERE = "figures", "commands", "fits", "surfaces"
"""Results of which a folder has a test of its own."""


@pytest.mark.parametrize(
    "name", [name for name in subjects.SUBJECTS if name not in ELSEWHERE]
)
def test_results_are_those_that_were_recorded(name):
    subjects.check(name, subjects.SUBJECTS[name]())


def told(value):
    return json.loads(json.dumps(recorded.plain(value)))


def test_a_record_sees_numbers_words_and_data():
    row = {"value": 1.0, "reference": 1.1, "tolerance": 0.2}
    value = {
        "number": 1.0,
        "words": "it is 1.25 m",
        "array": np.arange(9.0),
        "row": row,
        "kept": [1, "a", None, True],
    }
    changes = {
        "number": 1.001,
        "words": "it is 1.27 m",
        "array": np.arange(9.0) ** 1.001,
        "row": {"value": 1.05, "reference": 1.1, "tolerance": 0.2},
        "kept": [1, "b", None, True],
    }
    assert [*recorded.differences(told(value), told(value))] == []
    for name, other in changes.items():
        assert [*recorded.differences(told(value | {name: other}), told(value))], name
    assert [
        *recorded.differences(
            told(value | {"words": "it is 1.26 m", "number": 1.0 + 1e-9}), told(value)
        )
    ] == []


def test_what_two_runs_disagree_about_is_not_compared():
    one = {
        "time": 1.0,
        "near": 2.0,
        "words": "in 3 ms, 4 times",
        "array": np.arange(9.0),
    }
    other = {
        "time": 3.0,
        "near": 2.0001,
        "words": "in 5 ms, 4 times",
        "array": np.arange(9.0) + 1e-5,
    }
    kept = recorded.shared(told(one), told(other))
    assert kept["time"] is None and kept["words"] == "in # ms, 4 times"
    for third in (
        other,
        one | {"time": 9.0, "words": "in 8 ms, 4 times", "near": 2.001},
    ):
        assert [*recorded.differences(told(third), kept)] == []
    for name, wrong in {
        "near": 2.1,
        "words": "in 3 ms, 6 times",
        "array": np.arange(9.0) + 0.01,
    }.items():
        assert [*recorded.differences(told(one | {name: wrong}), kept)], name
