"""Recorded results: any mixture of numbers and texts as plain data, and its comparison with what was written down."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from tests.models.golden import sums

FEW = 12
"""Most numbers of an array that are written one by one; of larger ones five weighted sums are."""

ROUNDING = 1e-15
"""Size below which a number is what rounding left of zero."""

NUMBER = re.compile(r"(?<![A-Za-z_\d.])[+-]?(?:\d[\d,]*\.?\d*(?:e[+-]?\d+)?|inf|nan)(?![A-Za-z_\d])")


def plain(value: Any) -> Any:
    """Return a result as plain data for JSON: lists, tables, texts, and numbers that are not finite as texts."""
    if isinstance(value, Mapping):
        return {str(name): plain(each) for name, each in value.items()}
    if isinstance(value, np.ndarray) and value.size > FEW:
        seen = np.isfinite(value)
        return [plain(seen.sum()), *plain([each * value.size**-0.5 for each in sums(np.where(seen, value, 0.0))])]
    if isinstance(value, (list, tuple, np.ndarray)):
        return [plain(each) for each in value]
    if value is None or isinstance(value, (str, bool, np.bool_)):
        return value if value is None or isinstance(value, str) else bool(value)
    if abs(value) < ROUNDING:
        return 0.0
    return float(f"{value:.9g}") if np.isfinite(value) else str(float(value))


def differences(found: Any, written: Any, rel: float, at: str = "") -> list[str]:
    """List where plain data differ: numbers by more than `rel` of the largest of their list, texts but for digits.

    Numbers in texts may differ by 1 % and by one in the last digit, as they are rounded.
    """
    if isinstance(written, dict) and isinstance(found, dict):
        lists = [differences(found.get(name), written.get(name), rel, f"{at}/{name}") for name in {**written, **found}]
        return [each for some in lists for each in some]
    if isinstance(written, str) and isinstance(found, str):
        same = NUMBER.sub("#", found).split() == NUMBER.sub("#", written).split()
        both = zip(NUMBER.findall(found), NUMBER.findall(written), strict=True) if same else ()
        off = [f"{at}: {one} for {other}" for one, other in both if not _close(one, other)]
        return off if same else [f"{at}:\n{found}\nfor\n{written}"]
    if isinstance(written, list) and isinstance(found, list) and len(written) == len(found):
        numbers = [abs(each) for each in written if isinstance(each, float)]
        size = max(numbers, default=0.0)
        lists = [
            differences(one, other, rel * size / (abs(other) or 1.0), f"{at}[{i}]")
            if isinstance(one, float) and isinstance(other, float)
            else differences(one, other, rel, f"{at}[{i}]")
            for i, (one, other) in enumerate(zip(found, written, strict=True))
        ]
        return [each for some in lists for each in some]
    if isinstance(written, float) and isinstance(found, float):
        return [] if abs(found - written) <= rel * (abs(written) or 1.0) else [f"{at}: {found!r} for {written!r}"]
    return [] if found == written else [f"{at}: {found!r} for {written!r}"]


def _close(found: str, written: str) -> bool:
    one, other = (float(each.replace(",", "")) for each in (found, written))
    digits = written.partition("e")[0].partition(".")[2]
    exponent = int(written.partition("e")[2] or 0)
    return found == written or abs(one - other) <= 0.01 * abs(other) + 1.01 * 10.0 ** (exponent - len(digits))
