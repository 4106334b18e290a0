"""Terminal output of the commands: progress on stderr, tables on stdout."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

EVERY = 10.0
"""Time between lines of progress where there is no terminal [s]."""


@contextmanager
def simulation_progress(label: str, t_end: float) -> Iterator[Callable[[float], None]]:
    """Show a progress bar over simulated time [s]; a spinner until the first report, while kernels are compiled."""
    with _bar() as bar:
        task = bar.add_task(f"{label}: preparing (compiles once after installation)", total=None)

        def report(time: float) -> None:
            bar.update(task, completed=time, total=t_end, description=f"{label}: {time:.2f} of {t_end:g} s")

        yield report


@contextmanager
def work_progress(label: str) -> Iterator[Callable[..., None]]:
    """Show the current work, `report(words)`, with a bar over finished things of all: `report(words, done, of)`."""
    with _bar() as bar:
        task = bar.add_task(label, total=None)

        def report(words: str, done: float | None = None, of: float | None = None) -> None:
            bar.update(task, completed=done, total=of, description=f"{label}: {words}")

        yield report


@contextmanager
def _bar() -> Iterator[Any]:
    from planarfriction.compiler.notice import expect_compilation

    expect_compilation()  # the bar says it
    console = Console(stderr=True)
    words = TextColumn("{task.description}", markup=False)
    columns = SpinnerColumn(), words, BarColumn(bar_width=30), TimeElapsedColumn()
    bar = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    with _Lines() if bar.disable else bar as shown:  # rich before 15 ends a bar that is not shown with an empty line
        yield shown


class _Lines:
    """Progress for a file or a pipe: a line on stderr every `EVERY` seconds, written by a thread of its own."""

    def __enter__(self) -> _Lines:
        self._words, self._begin, self._done = "", time.monotonic(), threading.Event()
        self._writer = threading.Thread(target=self._write, daemon=True)
        self._writer.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()
        self._writer.join()

    def _write(self) -> None:
        while not self._done.wait(EVERY):
            note(f"{self._words}, {time.monotonic() - self._begin:.0f} s")

    def add_task(self, description: str, total: float | None = None) -> int:
        """Take the words that lines begin with."""
        self._words = description
        return 0

    def update(self, task: int, *, description: str, **_: Any) -> None:
        """Take new words."""
        self._words = description


def note(text: str) -> None:
    """Print a remark in one line on stderr, apart from the results."""
    print(text, file=sys.stderr, flush=True)


def print_table(title: str, headings: Sequence[str], rows: Sequence[Sequence[str]], *, width: int = 200) -> None:
    """Print a table on stdout: columns with numbers are aligned on the right, words on the left.

    It is as wide as the terminal; elsewhere `width` letters are enough for every table that programs may read.
    """
    table = Table(title=title, title_justify="left", title_style="bold", header_style="bold")
    for number, heading in enumerate(headings):
        numbers = number > 0 and any(character.isdigit() for row in rows for character in row[number][:2])
        name = number == 0 and not any(" " in row[0] for row in rows)  # stays in one piece
        table.add_column(heading, justify="right" if numbers else "left", overflow="fold", no_wrap=name)
    for row in rows:
        table.add_row(*row)
    console = Console(markup=False, highlight=False)  # units in brackets are no markup
    if not console.is_terminal:
        console = Console(markup=False, highlight=False, width=width)
    console.print(table)
