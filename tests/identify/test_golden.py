"""Fits are as recorded: starts, derivatives, uncertainties, tables, plans, windows."""

import pytest

from tests.identify import golden
from tests.support import subjects


@pytest.mark.parametrize("name", golden.SOURCES)
def test_fits_are_those_that_were_recorded(name):
    subjects.check("fits", golden.SOURCES[name](), name)
