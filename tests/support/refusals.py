"""What every mistake of a user gets: one line that says what is wrong."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from planarfriction.errors import FrictionError, InvalidValueError


@contextlib.contextmanager
def refused(words: str | None, kind: Any = InvalidValueError) -> Iterator[Any]:
    """Expect an error of a kind, or of one of several, whose message is one line that holds a pattern."""
    with pytest.raises(kind, match=words) as caught:
        yield caught
    assert "\n" not in str(caught.value)


def refusal(call: Callable, *arguments: Any, kind: Any = FrictionError) -> str:
    """Return the line with which a call is refused."""
    with refused(None, kind) as caught:
        call(*arguments)
    return str(caught.value)
