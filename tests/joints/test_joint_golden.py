"""Numbers and texts of joints' fits as they were written down: starts, slopes, spreads, tables, searches."""

from __future__ import annotations

import json

import pytest

from tests.joints import golden
from tests.support.written import differences, plain


@pytest.mark.parametrize("name", golden.SOURCES)
def test_joints_say_what_was_written_down(name):
    written = json.loads(golden.FILE.read_text(encoding="utf-8"))[name]

    assert differences(plain(golden.SOURCES[name]()), written, 1e-3 if name == "searches" else 1e-5) == []
