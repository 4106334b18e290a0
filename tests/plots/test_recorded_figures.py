"""Figures have the words, colours and data that were recorded."""

import pytest

from tests.support import recorded, shown


@pytest.fixture(scope="module")
def figures():
    return shown.figures()


def test_figures_are_those_that_were_recorded(figures):
    recorded.check(shown.FOLDER / "figures.json", recorded.plain(figures))
