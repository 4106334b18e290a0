"""Terminal output of the commands: progress on stderr, tables on stdout."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table


@contextmanager
def simulation_progress(label: str, t_end: float) -> Iterator[Callable[[float], None]]:
    """Show a progress bar over simulated time [s]; a spinner until the first report, while kernels are compiled."""
    with _bar() as bar:
        task = bar.add_task(f"{label}: preparing (compiles once after installation)", total=None)

        def report(time: float) -> None:
            bar.update(task, completed=time, total=t_end, description=f"{label}: {time:.2f} of {t_end:g} s")

        yield report


@contextmanager
def work_progress(label: str) -> Iterator[Callable[[str], None]]:
    """Show a spinner that names the current work."""
    with _bar() as bar:
        task = bar.add_task(label, total=None)
        yield lambda name: bar.update(task, description=f"{label}: {name}")


@contextmanager
def count_progress(label: str) -> Iterator[Callable[[int, int, str], None]]:
    """Show a progress bar over finished things of all, with a description."""
    with _bar() as bar:
        task = bar.add_task(label, total=None)
        yield lambda done, of, words: bar.update(task, completed=done, total=of, description=f"{label}: {words}")


@contextmanager
def _bar() -> Iterator[Progress]:
    console = Console(stderr=True)
    words = TextColumn("{task.description}", markup=False)
    columns = SpinnerColumn(), words, BarColumn(bar_width=30), TimeElapsedColumn()
    bar = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    if bar.disable:  # not even begun: rich before 15 ends such a bar with an empty line
        yield bar
    else:
        with bar:
            yield bar


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
