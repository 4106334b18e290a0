"""Numbers of limit surfaces and laws as they were written down."""

from __future__ import annotations

import json

import pytest

from tests.limit_surface import golden
from tests.support.written import differences, plain


@pytest.mark.parametrize("name", golden.SOURCES)
def test_surfaces_and_laws_say_what_was_written_down(name):
    written = json.loads(golden.FILE.read_text(encoding="utf-8"))[name]

    assert differences(plain(golden.SOURCES[name]()), written, 1e-7) == []
