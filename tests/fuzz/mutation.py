"""Files and tables that are not quite what they were."""

from __future__ import annotations

import copy
import random
from typing import Any

TEXTS = [
    "",
    "x",
    "123",
    "nan",
    "inf",
    "φ\n\t\"'\\",
    "\0",
    "a" * 5000,
    "../../etc/passwd",
    "/dev/zero",
    "disc",
]
NUMBERS = [
    0,
    -0.0,
    1,
    -1,
    2,
    1e-300,
    5e-324,
    1e-9,
    1e9,
    1e155,
    1e300,
    -1e300,
    10**18,
    10**400,
    1e5,
    0.5,
    True,
    False,
]
LISTS = [[], [[]], [1], [1, 2], [1, 2, 3], ["x"], [[1, 2], [3]]]
ODD = [*TEXTS, *NUMBERS, *LISTS, float("nan"), float("inf"), None, {}, {"x": 1}]

BYTES = [bytes([letter]) for letter in b"\0\xff\n\r\"',;[]{}#=-+eE.0"]
BYTES += [
    b"\xfe\xff",
    b"\xef\xbb\xbf",
    "φ".encode(),
    b"\xed\xa0\x80",
    b" " * 100,
    b'"\n"',
    b"a" * 200_000,
    b"[" * 2000,
]
BYTES += [b"nan", b"inf", b"1e400", b"1e300", b"9" * 5000, b"-1", b"0x1"]
"""Pieces that readers stumble over."""


def places(data: Any, path: tuple = ()) -> list[tuple]:
    """Paths to all values inside a table."""
    items = (
        data.items()
        if isinstance(data, dict)
        else enumerate(data)
        if isinstance(data, list)
        else ()
    )
    found = [path] if path else []
    for key, value in items:
        found += places(value, (*path, key))
    return found


def mutated(data: dict[str, Any], draw: random.Random) -> dict[str, Any]:
    """The table with one to three entries changed, dropped, renamed, moved or nested."""
    data = copy.deepcopy(data)
    for _ in range(draw.choice([1, 1, 1, 2, 3])):
        everywhere = places(data)
        if not everywhere:
            break
        *where, key = draw.choice(everywhere)
        parent: Any = data
        for step in where:
            parent = parent[step]
        change = draw.randrange(9)
        if change == 0:
            del parent[key]
        elif change == 1 and isinstance(parent, dict):
            name = draw.choice(
                [key + "s", key.upper(), "", "φ", "kind", "shape", draw.choice(TEXTS)]
            )
            parent[name] = parent.pop(key)
        elif change == 2:
            *other, last = draw.choice(everywhere)
            source: Any = data
            with_it = True
            for step in other:
                try:
                    source = source[step]
                except (KeyError, IndexError, TypeError):
                    with_it = False
            if with_it:
                with_value = source.get(last) if isinstance(source, dict) else None
                parent[key] = copy.deepcopy(with_value)
        elif change == 3:
            parent[key] = draw.choice(
                [[parent[key]], {"x": parent[key]}, [parent[key]] * 3]
            )
        elif (
            change == 4
            and isinstance(parent[key], (int, float))
            and not isinstance(parent[key], bool)
        ):
            value = parent[key] * draw.choice(
                [-1.0, 1e-6, 1e-3, 0.1, 10.0, 1e3, 1e6, 1e12, 1e150]
            )
            parent[key] = (
                int(value)
                if isinstance(parent[key], int) and abs(value) < 1e18
                else value
            )
        elif change == 5 and isinstance(parent[key], list) and parent[key]:
            draw.choice(
                [lambda x: x.pop(), lambda x: x.append(x[0]), lambda x: x.reverse()]
            )(parent[key])
        else:
            parent[key] = copy.deepcopy(draw.choice(ODD))
    return data


def mutated_bytes(data: bytes, draw: random.Random) -> bytes:
    """The file with one to four places changed, dropped, doubled or cut off."""
    for _ in range(draw.choice([1, 1, 2, 4])):
        at = draw.randrange(len(data) + 1)
        length = draw.choice([1, 1, 2, 4, 16, 256])
        change = draw.randrange(7)
        if change == 0:
            data = data[:at] + data[at + length :]
        elif change == 1:
            data = data[:at] + draw.choice(BYTES) + data[at:]
        elif change == 2:
            data = data[:at] + draw.choice(BYTES) + data[at + length :]
        elif change == 3:
            data = data[:at]
        elif change == 4:
            other = draw.randrange(len(data) + 1)
            data = data[:at] + data[other : other + 16 * length] + data[at:]
        else:
            data = data[:at] + draw.randbytes(length) + data[at + length :]
    return data
