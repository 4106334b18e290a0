"""Everything that a result shows, told by plain values, and its comparison with values that were recorded.

An array is told by its shape, its norm and weighted sums, a figure by its words, colours and data. Recorded numbers are
those that runs for other processors find too, `within` some scatter; the others (times, rounding) are `null`, `#`
and `…` in texts.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

RTOL = 1e-5
"""Share of a number, or of the norm of an array, that a processor may change [-]."""

SCATTER, MOST = 100.0, 0.2
"""Allowed change of a number over that between the two runs, and the share of it from which it is not recorded [-]."""

SHARE = 0.2
"""Share of the tolerance of a comparison by which its numbers may change: most are errors [-]."""

COLUMNS = 9
"""Most columns of an array that are told one by one."""

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")

FINGERPRINT = re.compile("[0-9a-f]{32}")
"""Names of runs, which change with the version of the library and of packages."""

PARTS = re.compile(r"(\. |\n|\|)")
"""Ends of sentences, lines and cells of a table."""

# ---------------------------------------------------------------------- plain values


def plain(value: Any) -> Any:
    """Tell a value by dictionaries, lists, texts and numbers."""
    if isinstance(value, str) and FINGERPRINT.fullmatch(value):
        return "fingerprint"
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, np.ndarray) and value.ndim == 0:
        return plain(value[()])
    if isinstance(value, (float, np.generic)):
        number = value.item() if isinstance(value, np.generic) else value
        return (
            number
            if not isinstance(number, float) or math.isfinite(number)
            else str(number)
        )
    if hasattr(value, "savefig"):
        return figure(value)
    if hasattr(value, "histories"):  # of a simulation
        return {
            name: plain(np.asarray(each.values))
            for name, each in value.histories.items()
        }
    if hasattr(value, "coords"):  # of xarray
        return {
            str(name): [list(v.dims), dict(v.attrs), plain(v.to_numpy())]
            for name, v in value.variables.items()
        }
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if hasattr(value, "_asdict"):
        return plain(value._asdict())
    if dataclasses.is_dataclass(value):
        return {
            each.name: plain(getattr(value, each.name))
            for each in dataclasses.fields(value)
        }
    if not hasattr(value, "__iter__"):
        return type(value).__name__
    values = value if isinstance(value, np.ndarray) else [*value]
    numbers = np.asarray(values).dtype.kind in "biuf" if _even(values) else False
    return (
        array(values)
        if numbers and np.size(values) > 4
        else [plain(each) for each in values]
    )


def _even(values: Any) -> bool:
    return isinstance(values, np.ndarray) or all(
        isinstance(each, (int, float, np.number)) for each in values
    )


def array(values: Any) -> Any:
    """Tell an array by its shape, its norm and two sums with fixed weights, of finite values.

    Each of a few columns is told by itself: their units differ.
    """
    values = np.ma.filled(np.ma.asarray(values, float), np.nan)
    if values.ndim == 2 and values.shape[1] <= COLUMNS:
        return [array(column) for column in values.T]
    flat = values.ravel()
    places = np.flatnonzero(np.isfinite(flat))
    shape = " x ".join(map(str, values.shape)) + (
        "" if len(places) == len(flat) else f", {len(places)} finite"
    )
    flat = flat[places]
    sums = [float(flat @ np.cos(k * (places + 1.0))) for k in (1, 2)]
    return {"shape": shape, "sums": [float(np.linalg.norm(flat)), *sums]}


def text(words: str) -> dict[str, Any]:
    """Tell a long text by its different lines, without numbers, and by its numbers."""
    lines = NUMBER.sub("#", re.sub(r">\s*<", ">\n<", words)).splitlines()
    numbers = np.array([float(each) for each in NUMBER.findall(words)])
    return {
        "lines": len(lines),
        "words": [*dict.fromkeys(lines)],
        "numbers": array(np.arcsinh(1e4 * numbers)),
    }


def figure(shown: Any) -> dict[str, Any]:
    """Tell the words, colours and data of a figure."""
    return {
        "size": [float(each) for each in shown.get_size_inches()],
        "words": [text.get_text() for text in shown.texts],
        "legends": [legend(each) for each in shown.legends],
        "panels": [panel(axes) for axes in shown.axes],
    }


def legend(shown: Any) -> list[Any]:
    """Tell the entries of a legend."""
    pairs = zip(shown.get_texts(), shown.legend_handles, strict=True)
    return [[text.get_text(), *look(entry)] for text, entry in pairs]


def look(artist: Any) -> list[Any]:
    """Tell how a line or an area is drawn."""
    from matplotlib.colors import to_hex

    if hasattr(artist, "get_marker"):
        return [
            to_hex(artist.get_color()),
            artist.get_linestyle(),
            str(artist.get_marker()),
        ]
    colours = (
        getattr(artist, name, list)() for name in ("get_facecolor", "get_edgecolor")
    )
    return [
        [to_hex(each, keep_alpha=True) for each in np.reshape(colour, (-1, 4))[:3]]
        for colour in colours
    ]


def panel(axes: Any) -> dict[str, Any]:
    """Tell the words and data of a panel."""
    from matplotlib.ticker import FixedFormatter

    told: dict[str, Any] = {
        "titles": [axes.get_title(loc) for loc in ("left", "center", "right")],
        "labels": [axes.get_xlabel(), axes.get_ylabel()],
        "scales": [axes.get_xscale(), axes.get_yscale()],
        "limits": [float(each) for each in (*axes.get_xlim(), *axes.get_ylim())],
        "words": [[text.get_text(), *(plain(each) for each in text.get_position())] for text in axes.texts],
        "lines": [[str(line.get_label()), *look(line), array(line.get_xydata())] for line in axes.lines],
        "areas": [[str(each.get_label()), *look(each), array(_outline(each))] for each in axes.patches],
        "sets": [faces(each) if axes.name == "3d" else points(each) for each in axes.collections],
        "images": [[array(each.get_array()), array(each.get_extent())] for each in axes.images],
        "legend": legend(axes.get_legend()) if axes.get_legend() else [],
    }  # fmt: skip
    for name, axis in (("x ticks", axes.xaxis), ("y ticks", axes.yaxis)):
        formatter = axis.get_major_formatter()
        if isinstance(formatter, FixedFormatter):
            told[name] = [array(axis.get_ticklocs()), list(formatter.seq)]
    return told


def points(shown: Any) -> list[Any]:
    """Tell a set of markers or shapes by its colours, places, first outlines and values."""
    outlines = [array(path.vertices) for path in shown.get_paths()[:9]]
    values = shown.get_array()
    return [
        *look(shown),
        array(shown.get_offsets()),
        outlines,
        None if values is None else array(values),
    ]


def faces(shown: Any) -> list[Any]:
    """Tell what a surface or lines in three dimensions cover, in no order: those equally deep change places."""
    corners = [path.vertices for path in shown.get_paths()] or [np.empty((0, 2))]
    colours = np.reshape(shown.get_facecolor(), (-1, 4))
    return [array(np.sort(each, axis=0)) for each in (np.concatenate(corners), colours)]


def _outline(area: Any) -> np.ndarray:
    return area.get_patch_transform().transform_path(area.get_path()).vertices


def lines(value: Any) -> str:
    """Return JSON with a line for each part."""
    parts = [f"{json.dumps(name)}: {_lines(each)}" for name, each in value.items()]
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _lines(value: Any) -> str:
    one = json.dumps(value, ensure_ascii=False)
    if len(one) < 200 or not isinstance(value, (dict, list)):
        return one
    if isinstance(value, dict):
        return (
            "{\n"
            + ",\n".join(
                f"{json.dumps(name)}: {_lines(each)}" for name, each in value.items()
            )
            + "\n}"
        )
    return "[\n" + ",\n".join(map(_lines, value)) + "\n]"


# ---------------------------------------------------------------------- values that runs share


def shared(one: Any, *others: Any) -> Any:
    """Return what all runs agree about, with `null` for other numbers and `#` for those of texts."""
    if isinstance(one, dict):
        if "sums" in one:
            within = SCATTER * max(_apart(one, other) for other in others)
            size = one["sums"][0]
            if within <= RTOL * size:
                return one
            return one | (
                {"within": within} if within < MOST * size else {"sums": None}
            )
        if "tolerance" in one:
            return one
        # A line of a benchmark, whose numbers may be times.
        timed = "baseline_value" in one
        each = {
            name: (value, *(other[name] for other in others))
            for name, value in one.items()
        }
        return {
            name: _same(*runs)
            if timed and isinstance(runs[0], float)
            else shared(*runs)
            for name, runs in each.items()
        }
    if isinstance(one, list):
        return [shared(*runs) for runs in zip(one, *others, strict=True)]
    if isinstance(one, str):
        parts = [PARTS.split(each) for each in (one, *others)]
        if len({len(each) for each in parts}) > 1:
            return "…"
        return "".join(_shared_part(*runs) for runs in zip(*parts, strict=True))
    if isinstance(one, float):
        within = SCATTER * max(abs(one - other) for other in others)
        return (
            one
            if within <= RTOL * abs(one)
            else {"near": one, "within": within}
            if within < MOST * abs(one)
            else None
        )
    # Such as a number of steps.
    return one if all(one == other for other in others) else None


def _same(one: float, *others: float) -> float | None:
    """Return a number that all runs have in common, and no other one, which is a time."""
    return (
        one
        if all(math.isclose(one, other, rel_tol=1e-12) for other in others)
        else None
    )


def _shared_part(one: str, *others: str) -> str:
    if len({NUMBER.sub("#", each) for each in (one, *others)}) > 1:
        return "…"  # such as 10^{-17} beside 3 x 10^{-17}
    numbers = zip(*(NUMBER.findall(each) for each in others), strict=True)
    return NUMBER.sub(
        lambda found: found[0] if {found[0]} == {*next(numbers)} else "#", one
    )


def _apart(one: Mapping[str, Any], other: Mapping[str, Any]) -> float:
    return max(abs(a - b) for a, b in zip(one["sums"], other["sums"], strict=True))


def check(path: Path, found: Any, part: str | None = None) -> None:
    """Assert that plain values are those that a file has recorded, or a part of it."""
    kept = json.loads(path.read_text(encoding="utf-8"))
    kept = kept if part is None else kept[part]
    wrong = [*differences(json.loads(json.dumps(found)), kept)]
    assert not wrong, "\n".join(wrong[:20])


def differences(found: Any, kept: Any, place: str = "") -> Iterator[str]:
    """Yield a line for each difference between values that were found and those that were recorded."""
    same = True
    if isinstance(kept, dict) and kept.keys() == {"near", "within"}:
        same = isinstance(found, float) and abs(found - kept["near"]) <= kept["within"]
    elif (
        isinstance(kept, dict)
        and "sums" in kept
        and isinstance(found, dict)
        and "sums" in found
    ):
        same = found["shape"] == kept["shape"]
        if same and kept["sums"] is not None:
            same = _apart(found, kept) <= kept.get("within", RTOL * kept["sums"][0])
    elif (
        isinstance(kept, dict)
        and isinstance(found, dict)
        and found.keys() == kept.keys()
    ):
        if "tolerance" in kept:
            yield from _comparison(found, kept, place)
        else:
            for name in kept:
                yield from differences(found[name], kept[name], f"{place}/{name}")
    elif isinstance(kept, list) and isinstance(found, list) and len(found) == len(kept):
        for i, pair in enumerate(zip(found, kept, strict=True)):
            yield from differences(*pair, f"{place}/{i}")
    elif isinstance(kept, str) and isinstance(found, str):
        same = _alike(found, kept)
    elif isinstance(kept, float) and isinstance(found, (int, float)):
        same = math.isclose(found, kept, rel_tol=RTOL)
    elif kept is not None or not isinstance(found, (int, float)):
        same = found == kept
    if not same:
        yield f"{place}: found {found!r:.300}, recorded {kept!r:.300}"


def _comparison(
    found: dict[str, Any], kept: dict[str, Any], place: str
) -> Iterator[str]:
    """Yield the differences of a comparison: its numbers are errors, of which only the size is known."""
    for name, value in kept.items():
        if isinstance(value, float) and isinstance(found[name], float):
            size = value if name == "tolerance" else kept["tolerance"]
            if abs(found[name] - value) > SHARE * size + RTOL * abs(value):
                yield f"{place}/{name}: found {found[name]}, recorded {value}, tolerance {kept['tolerance']}"
        else:
            yield from differences(found[name], value, f"{place}/{name}")


def _alike(found: str, kept: str) -> bool:
    """Return True if two texts differ at most in the last digit of their numbers, or in what is not kept."""
    if kept == "…":
        return True
    parts = PARTS.split(found), PARTS.split(kept)
    return len(parts[0]) == len(parts[1]) and all(
        b == "…" or _alike_part(a, b) for a, b in zip(*parts, strict=True)
    )


def _alike_part(found: str, kept: str) -> bool:
    pattern = re.compile(f"{NUMBER.pattern}|#")
    if pattern.sub("#", found) != pattern.sub("#", kept):
        return False
    pairs = zip(pattern.findall(found), pattern.findall(kept), strict=True)
    return all(
        "#" in (a, b) or abs(float(a) - float(b)) <= 1.01 * _last_digit(b)
        for a, b in pairs
    )


def _last_digit(number: str) -> float:
    digits, _, exponent = number.partition("e")
    return 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))
