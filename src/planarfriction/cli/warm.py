"""`planarfriction warm`: compile everything in advance, with progress."""

from __future__ import annotations

from planarfriction.cli.console import print_table, work_progress


def warm() -> None:
    """Compile everything, with progress on stderr, and print the time of each part."""
    from planarfriction.warm import warm_up

    with work_progress("compiling") as progress:
        times = warm_up(progress=progress)
    times["all"] = sum(times.values())
    rows = [[words, f"{seconds:.2f}"] for words, seconds in times.items()]
    print_table("Compiled or read from the cache", ["part", "time [s]"], rows)
