"""Figures open a window by themselves, and say so where none can open."""

import pytest
from matplotlib import pyplot

from planarfriction.plots import style


def test_a_figure_without_a_window_says_so(monkeypatch):
    monkeypatch.setattr(pyplot, "get_backend", lambda: "Agg")
    monkeypatch.setattr(pyplot, "show", lambda: pytest.fail("a window opens"))
    with pytest.warns(
        UserWarning, match=r"no window can open here \(Agg\): use savefig"
    ):
        style.PlotFigure().show()
    style.PlotFigure().show(warn=False)


def test_a_figure_is_shown_once_by_pyplot(monkeypatch):
    shown = []
    monkeypatch.setattr(pyplot, "get_backend", lambda: "qtagg")
    monkeypatch.setattr(pyplot, "show", lambda: shown.append(pyplot.get_fignums()))
    pyplot.close("all")
    figure = style.PlotFigure()
    figure.show()
    assert pyplot.gcf() is figure
    figure.show()
    assert shown == [[1], [1]]
    pyplot.close("all")
