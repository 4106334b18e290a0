"""Terminal output of the commands: progress on stderr, tables on stdout."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
)
from rich.table import Table

EVERY = 10.0
"""Time between lines of progress where there is no terminal [s]."""


@contextmanager
def simulation_progress(label: str, t_end: float) -> Iterator[Callable[[float], None]]:
    """Show a progress bar over simulated time [s]; a spinner until the first report, while kernels are compiled."""
    with _bar(f"{label}: preparing (compiles once after installation)") as update:
        yield lambda time: update(f"{label}: {time:.2f} of {t_end:g} s", time, t_end)


@contextmanager
def work_progress(label: str) -> Iterator[Callable[..., None]]:
    """Show the current work, `report(words)`, with a bar over finished things of all: `report(words, done, of)`."""
    with _bar(label) as update:
        yield lambda words, done=None, of=None: update(f"{label}: {words}", done, of)


@contextmanager
def _bar(words: str) -> Iterator[Callable[..., None]]:
    from planarfriction._engine.compiler.messages import expect_compilation

    expect_compilation()  # the bar says it
    console = Console(stderr=True)
    # Rich before 15 ends a bar that is not shown with an empty line.
    if not console.is_terminal:
        with _lines(words) as update:
            yield update
        return
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=30),
    )
    with Progress(
        *columns, TimeElapsedColumn(), console=console, transient=True
    ) as bar:
        task = bar.add_task(words, total=None)
        yield lambda words, done, of: bar.update(
            task, completed=done, total=of, description=words
        )


@contextmanager
def _lines(words: str) -> Iterator[Callable[..., None]]:
    """Show progress in a file or a pipe: a line on stderr every `EVERY` seconds, written by a thread of its own."""
    begin = time.monotonic()
    ended = threading.Event()

    def write() -> None:
        while not ended.wait(EVERY):
            note(f"{words}, {time.monotonic() - begin:.0f} s")

    def update(new: str, *_: object) -> None:
        nonlocal words
        words = new

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    try:
        yield update
    finally:
        ended.set()
        writer.join()


def note(text: str) -> None:
    """Print a remark in one line on stderr, apart from the results."""
    print(text, file=sys.stderr, flush=True)


def print_table(
    title: str,
    headings: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    width: int = 100,
) -> None:
    """Print a table on stdout: columns with numbers are aligned on the right, words on the left.

    It is as wide as the terminal. Elsewhere it has at most `width` letters: columns that do not fit follow in another
    table, which begins with the first column.
    """
    console = Console(markup=False, highlight=False)  # units in brackets are no markup
    groups = [range(len(headings))]
    if not console.is_terminal:
        console = Console(markup=False, highlight=False, width=width)
        groups = _groups(headings, rows, width)
    for columns in groups:
        table = Table(
            title=title, title_justify="left", title_style="bold", header_style="bold"
        )
        for number in columns:
            numbers = number > 0 and any(
                character.isdigit() for row in rows for character in row[number][:2]
            )
            # Stays in one piece.
            name = number == 0 and not any(" " in row[0] for row in rows)
            table.add_column(
                headings[number],
                justify="right" if numbers else "left",
                overflow="fold",
                no_wrap=name,
            )
        for row in rows:
            table.add_row(*(row[number] for number in columns))
        console.print(table)


def _groups(
    headings: Sequence[str], rows: Sequence[Sequence[str]], width: int
) -> list[Sequence[int]]:
    """Return the numbers of the columns of each table, so that no word of it is broken at `width` letters."""
    words = [
        [word for text in column for word in text.split()]
        for column in zip(headings, *rows, strict=True)
    ]
    least = [3 + max(map(len, column), default=0) for column in words]
    groups: list[list[int]] = [[0]]
    for number in range(1, len(headings)):
        taken = sum(least[each] for each in groups[-1]) + least[number] + 1
        if taken > width and len(groups[-1]) > 1:
            groups.append([0])
        groups[-1].append(number)
    return list(groups)
