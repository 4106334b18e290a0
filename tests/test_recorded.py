"""Patches, plans, estimates, scenes, frames, sweeps, the explorer's answers, and replies to bad input are as recorded.

`tests/support/computed.py` and `tests/support/replies.py` compute them, `python -m tests.support.recording NAME`
records them again. Most follow closed forms that other tests check; these records see every other number and word.
"""

import pytest

from tests.support import subjects

ELSEWHERE = "figures", "commands", "fits", "joints", "surfaces"
"""Results of which a folder has a test of its own."""


@pytest.mark.parametrize("name", [name for name in subjects.SUBJECTS if name not in ELSEWHERE])
def test_results_are_those_that_were_recorded(name):
    subjects.check(name, subjects.SUBJECTS[name]())
