"""Numbers and texts of fits as they were written down: starts, derivatives, uncertainties, tables, plans, windows."""

from __future__ import annotations

import json

import pytest

from tests.identify import golden
from tests.support.written import differences, plain


@pytest.mark.parametrize("name", golden.SOURCES)
def test_fits_say_what_was_written_down(name):
    written = json.loads(golden.FILE.read_text(encoding="utf-8"))[name]
    # derivatives of slides are differences of two simulations
    assert differences(plain(golden.SOURCES[name]()), written, 1e-3 if name == "slides" else 1e-5) == []
