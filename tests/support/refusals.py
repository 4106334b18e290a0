"""What every mistake of a user gets: one line that says what is wrong."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import pytest

from planarfriction.errors import InvalidValueError


@contextlib.contextmanager
def refused(words: str, kind: Any = InvalidValueError) -> Iterator[None]:
    """Expect an error of a kind, or of one of several, whose message is one line that holds a pattern."""
    with pytest.raises(kind, match=words) as caught:
        yield
    assert "\n" not in str(caught.value)
