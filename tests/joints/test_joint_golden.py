"""Fits of joints are as recorded: starts, slopes, spreads, tables, searches."""

import pytest

from tests.joints import golden
from tests.support import subjects


@pytest.mark.parametrize("name", golden.SOURCES)
def test_joints_are_those_that_were_recorded(name):
    subjects.check("joints", golden.SOURCES[name](), name)
