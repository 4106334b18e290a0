"""Measured data, referee and rig give what was recorded, and the comparison with records sees what changes."""

from __future__ import annotations

import json

import numpy as np
import pytest

from planarfriction_studies.experiments.experiment import compare
from tests.support import recorded
from tests.support.studied import SUBJECTS, check


@pytest.mark.parametrize(
    "name", ["measured", "replayed", "rig", "referee", pytest.param("mujoco", marks=pytest.mark.mujoco)]
)
def test_it_gives_what_was_recorded(name):
    if name not in SUBJECTS:
        pytest.skip(f"needs {name}")
    check(name, SUBJECTS[name]())


def told(value):
    return json.loads(json.dumps(recorded.plain(value)))


def test_a_record_sees_numbers_words_and_data():
    row = compare("x", 1.0, 1.1, "published", 0.2, "m", "rounding")
    value = {"number": 1.0, "words": "it is 1.25 m", "array": np.arange(9.0), "row": row, "kept": [1, "a", None, True]}
    changes = {
        "number": 1.001,
        "words": "it is 1.27 m",
        "array": np.arange(9.0) ** 1.001,
        "row": compare("x", 1.05, 1.1, "published", 0.2, "m", "rounding"),
        "kept": [1, "b", None, True],
    }
    assert [*recorded.differences(told(value), told(value))] == []
    for name, other in changes.items():
        assert [*recorded.differences(told(value | {name: other}), told(value))], name
    assert [*recorded.differences(told(value | {"words": "it is 1.26 m", "number": 1.0 + 1e-9}), told(value))] == []


def test_what_two_runs_disagree_about_is_not_compared():
    one = {"time": 1.0, "near": 2.0, "words": "in 3 ms, 4 times", "array": np.arange(9.0)}
    other = {"time": 3.0, "near": 2.0001, "words": "in 5 ms, 4 times", "array": np.arange(9.0) + 1e-5}
    kept = recorded.shared(told(one), told(other))
    assert kept["time"] is None and kept["words"] == "in # ms, 4 times"
    for third in (other, one | {"time": 9.0, "words": "in 8 ms, 4 times", "near": 2.001}):
        assert [*recorded.differences(told(third), kept)] == []
    for name, wrong in {"near": 2.1, "words": "in 3 ms, 6 times", "array": np.arange(9.0) + 0.01}.items():
        assert [*recorded.differences(told(one | {name: wrong}), kept)], name
