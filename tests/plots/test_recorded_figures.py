"""Figures have the words, colours and data that were recorded."""

from tests.support import shown, subjects


def test_figures_are_those_that_were_recorded():
    subjects.check("figures", shown.figures())
