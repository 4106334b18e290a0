"""Patches, plans, estimates, scenes, frames, sweeps, the explorer's answers, and replies to bad input are as recorded.

`tests/support/computed.py` and `tests/support/replies.py` compute them, `python -m tests.support.subjects NAME` records
them again. Most follow closed forms that other tests check; these records see every other number and word.
"""

import pytest

from tests.support import recorded, shown, subjects

NAMES = [name for name in subjects.OF_LIBRARY if name not in ("figures", "commands")]


@pytest.mark.parametrize("name", NAMES)
def test_results_are_those_that_were_recorded(name):
    recorded.check(shown.FOLDER / f"{name}.json", recorded.plain(subjects.OF_LIBRARY[name]()))
