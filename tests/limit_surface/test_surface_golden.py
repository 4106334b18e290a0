"""Limit surfaces and laws are as recorded."""

import pytest

from tests.limit_surface import golden
from tests.support import subjects


@pytest.mark.parametrize("name", golden.SOURCES)
def test_surfaces_and_laws_are_those_that_were_recorded(name):
    subjects.check("surfaces", golden.SOURCES[name](), name)
