"""Tables, JSON and a page of what the referee found."""

from __future__ import annotations

import html
import json
import platform
from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import date
from importlib import metadata
from pathlib import Path
from statistics import median
from typing import Any

from planarfriction._support.writing import write_text
from planarfriction.plots.style import PlotFigure, new_figure, tidy
from planarfriction_studies.referee.case import Case
from planarfriction_studies.referee.engines import Engine
from planarfriction_studies.referee.pictures import film, scene
from planarfriction_studies.referee.run import MARKS, Verdict, to_rows

COLOURS = {"ok": "#2a7f3f", "off": "#b8860b", "fails": "#b22222", "-": "#888888"}


def table(verdicts: Sequence[Verdict]) -> tuple[list[str], list[list[str]]]:
    """Return headings and rows: a row for each case, a column for each engine, and how many each passes."""
    engines = list(dict.fromkeys(each.engine for each in verdicts))
    found = {(each.case, each.engine): each for each in verdicts}
    rows = [
        [case, *(_cell(found.get((case, engine))) for engine in engines)]
        for case in dict.fromkeys(each.case for each in verdicts)
    ]
    passed = {
        engine: sum(each.mark == "ok" for each in verdicts if each.engine == engine)
        for engine in engines
    }
    judged = {
        engine: sum(each.engine == engine for each in verdicts) for engine in engines
    }
    rows.append(
        ["ok", *(f"{passed[engine]} of {judged[engine]}" for engine in engines)]
    )
    rows.append(
        [
            "median step [µs]",
            *(_median(verdicts, engine, "cost", 1e6) for engine in engines),
        ]
    )
    rows.append(
        [
            "median start [s]",
            *(_median(verdicts, engine, "start", 1.0) for engine in engines),
        ]
    )
    return ["case", *engines], rows


def _cell(verdict: Verdict | None) -> str:
    if verdict is None or verdict.error is None:
        return "" if verdict is None else verdict.mark
    share = verdict.error / verdict.allowed
    return f"{verdict.mark} {share:{'.0f' if share >= 10.0 else '.2g'}}"


def _median(verdicts: Sequence[Verdict], engine: str, name: str, scale: float) -> str:
    times = [
        getattr(each, name)
        for each in verdicts
        if each.engine == engine and getattr(each, name) is not None
    ]
    return f"{scale * median(times):.{0 if scale > 1.0 else 1}f}" if times else ""


OURS = (", patches", ", cells")
"""Ends of the names of engines with this library's friction."""


def simulators(
    verdicts: Sequence[Verdict],
) -> dict[str, tuple[list[str], list[list[str]]]]:
    """Return a table for each simulator that has patches: errors of its own friction, as it comes and best, and theirs.

    Best are the settings that pass the most cases.
    """
    found = {(each.case, each.engine): each for each in verdicts}
    passed = Counter(each.engine for each in verdicts if each.mark == "ok")
    tables = {}
    engines = list(dict.fromkeys(each.engine for each in verdicts))
    for name in dict.fromkeys(engine.split(",")[0] for engine in engines):
        own = [
            engine
            for engine in engines
            if engine.split(",")[0] == name and not engine.endswith(OURS)
        ]
        if not own or name + OURS[0] not in engines:
            continue
        columns = list(
            dict.fromkeys([own[0], max(own, key=passed.__getitem__), name + OURS[0]])
        )
        rows = [
            [case, *(shown(found.get((case, engine))) for engine in columns)]
            for case in dict.fromkeys(
                each.case for each in verdicts if each.engine in columns
            )
        ]
        tables[name] = ["case", *columns], rows
    return tables


def shown(verdict: Verdict | None) -> str:
    """Return the error of the worst quantity, in a unit that it is a one of at least."""
    if verdict is None or verdict.error is None:
        return "" if verdict is None else verdict.mark
    prefix, scale = next(
        ((p, s) for p, s in PREFIXES if verdict.error >= s), PREFIXES[-1]
    )
    number = verdict.error / scale
    digits = format(float(f"{number:.2g}"), "g") if number >= 1e-3 else "< 0.001"
    return f"{digits} {prefix}{verdict.unit}"


PREFIXES = (("", 1.0), ("m", 1e-3), ("µ", 1e-6), ("n", 1e-9))
"""Prefixes of units, and their factors."""


def picture(case: str, verdicts: Sequence[Verdict]) -> PlotFigure:
    """Draw the errors of all engines in a case over what is allowed."""
    own = [each for each in verdicts if each.case == case]
    figure = new_figure(7.0, 0.8 + 0.26 * len(own))
    axes = figure.subplots()
    for row, each in enumerate(own):
        if each.error is None:
            axes.text(
                1.0,
                row,
                each.reason,
                va="center",
                ha="left",
                fontsize="small",
                color=COLOURS[each.mark],
            )
            continue
        share = min(max(each.error / each.allowed, 1e-4), 1e4)
        axes.plot(share, row, "o", color=COLOURS[each.mark])
    axes.axvline(1.0, color="0.5", linewidth=1.0)
    axes.set(
        xscale="log",
        xlim=(1e-4, 1e4),
        ylim=(len(own) - 0.5, -0.5),
        xlabel="error over what is allowed",
    )
    axes.set_yticks(range(len(own)), [each.engine for each in own], fontsize="small")
    tidy(axes)
    return figure


def stated(engines: Sequence[Engine]) -> dict[str, Any]:
    """Return date, machine, versions and settings."""
    packages = dict.fromkeys(
        ["planarfriction", *(engine.package for engine in engines)]
    )
    return {
        "date": date.today().isoformat(),
        "machine": f"{platform.system()} {platform.machine()}, {_processor()}, Python {platform.python_version()}",
        "versions": {package: metadata.version(package) for package in packages},
        "settings": {
            engine.name: engine.settings.replace("as it comes", "default")
            for engine in engines
        },
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown processor"
    return next(
        (line.split(":")[1].strip() for line in lines if line.startswith("model name")),
        "unknown processor",
    )


def write(
    verdicts: Sequence[Verdict],
    cases: Mapping[str, Case],
    engines: Sequence[Engine],
    folder: Path | None,
) -> list[Path]:
    """Write JSON with what was run, a page, and pictures to a folder, if there is one. Return what is new."""
    if folder is None:
        return []
    run = stated(engines)
    write_text(
        folder / "referee.json",
        json.dumps({**run, "verdicts": to_rows(verdicts)}, indent=1) + "\n",
    )
    for name, case in cases.items():
        picture(name, verdicts).savefig(folder / f"{name}.svg")
        scene(case).savefig(folder / f"{name}-scene.svg")
        write_text(folder / f"{name}-film.svg", film(case, verdicts))
    write_text(folder / "referee.html", page(verdicts, cases, run))
    return [folder / "referee.json", folder / "referee.html"]


def page(
    verdicts: Sequence[Verdict], cases: Mapping[str, Case], run: Mapping[str, Any]
) -> str:
    """Return a page: the table, what was run, and each case with its truths, its picture and its results."""
    headings, rows = table(verdicts)
    sections = "".join(_section(case, verdicts) for case in cases.values())
    versions = ", ".join(
        f"{name} {version}" for name, version in run["versions"].items()
    )
    marks = "; ".join(f"{mark}: {words}" for mark, words in MARKS.items())
    return f"""<!doctype html><html lang="en"><meta charset="utf-8"><title>The referee</title><style>
body {{ font: 15px/1.45 sans-serif; max-width: 75em; margin: 2em auto; padding: 0 1em }}
table {{ border-collapse: collapse; font-size: 13px }} td, th {{ padding: .25em .6em; text-align: left }}
tr {{ border-bottom: 1px solid #ddd }} {" ".join(f".{mark} {{ color: {COLOURS[mark]} }}" for mark in MARKS)}
</style><h1>The referee: friction against the truth</h1>
<p>{html.escape(run["date"])}; {html.escape(run["machine"])}; {html.escape(versions)}. {html.escape(marks)};
numbers are errors over what is allowed. In pictures, what is fixed is grey, and dashed is where the truth says
that bodies end; green arrows are velocities, pink ones forces. In films, each engine moves the body that it
moves worst.</p>
{_table(headings, rows)}
<h2>Settings</h2>{_table(["engine", "settings"], [list(item) for item in run["settings"].items()])}
{sections}</html>
"""


def _table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = "".join(f"<th>{html.escape(each)}</th>" for each in headings)
    lines = ([html.escape(each) for each in row] for row in rows)
    cells = (
        "".join(f'<td class="{each.split(" ")[0]}">{each}</td>' for each in line)
        for line in lines
    )
    return (
        f"<table><tr>{head}</tr>{''.join(f'<tr>{line}</tr>' for line in cells)}</table>"
    )


def _section(case: Case, verdicts: Sequence[Verdict]) -> str:
    truths = [
        [
            each.body,
            each.quantity,
            f"{each.value:.6g}",
            f"{each.error:.0e}",
            f"{each.allowed:.3g}",
            each.source,
        ]
        for each in case.truths
    ]
    results = [
        [each.engine, each.mark, *_numbers(each), each.reason]
        for each in verdicts
        if each.case == case.name
    ]
    name = html.escape(case.name)
    return f"""<h2 id="{name}">{html.escape(case.title)}</h2><p>{html.escape(case.about)}</p>
<p>Allowed: {html.escape(case.why)}</p><p><img src="{name}-scene.svg" alt="the bodies of the case">
<img src="{name}.svg" alt="errors of all engines"></p>
<p><img src="{name}-film.svg" alt="film: the worst body of each engine"></p>
{_table(["engine", "mark", "error", "allowed", "worst quantity", "time step", "cost [µs]", "start [s]", ""], results)}
<details><summary>Truths</summary>
{_table(["body", "quantity", "value", "its error", "allowed", "source"], truths)}</details>"""


def _numbers(verdict: Verdict) -> list[str]:
    if verdict.error is None:
        return [""] * 6
    cost = "" if verdict.cost is None else f"{1e6 * verdict.cost:.0f}"
    start = "" if verdict.start is None else f"{verdict.start:.2g}"
    return [
        f"{verdict.error:.3g} {verdict.unit}", f"{verdict.allowed:.3g} {verdict.unit}", verdict.quantity,
        f"{1e3 * verdict.dt:g} ms", cost, start,
    ]  # fmt: skip
