"""Compiling in several processes at once, which hand on their machine code on disk.

Numba compiles one function at a time in a process, most of it in Python, so that threads gain nothing.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

_PATIENCE = 0.5
"""Longest wait [s] before Ctrl-C is heard where a wait cannot be interrupted."""


class Crew:
    """Processes that do jobs, numbered, from the last to the first, while this process takes them from the first on.

    Each process runs `code`, which calls `serve`. A job whose process ends is done by another.
    """

    def __init__(self, code: str, jobs: Iterable[int], processes: int) -> None:
        self.seconds: dict[int, float] = {}
        """Time that each job of another process took [s]."""
        self._left = list(jobs)
        self._busy = set()
        self._open = True
        self._changed = threading.Condition()
        pipes: dict[str, Any] = {
            "stdin": subprocess.PIPE,
            "stdout": subprocess.PIPE,
            "stderr": subprocess.DEVNULL,
        }
        where = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        command = [sys.executable, "-c", code]
        self._workers = [
            subprocess.Popen(command, env=where, bufsize=0, **pipes)
            for _ in range(processes)
        ]
        self._listeners = [
            threading.Thread(target=self._lead, args=(worker,))
            for worker in self._workers
        ]

    def __enter__(self) -> Crew:
        for each in self._listeners:
            each.start()
        return self

    def __exit__(self, *error: object) -> None:
        with self._changed:
            self._open = False
        for worker in self._workers:
            worker.kill()
        for each in self._listeners:
            each.join()
        for worker in self._workers:
            with worker:
                pass

    def take(self, job: int) -> bool:
        """Return True if a job is for this process to do; waits for a process that is at it, and tells False then."""
        with self._changed:
            while job in self._busy:
                self._changed.wait(_PATIENCE)
            if job in self._left:
                self._left.remove(job)
            return job not in self.seconds

    def _lead(self, worker: Any) -> None:
        """Give a process job after job, until none is left or it has ended."""
        while (job := self._next()) is not None:
            try:
                worker.stdin.write(f"{job}\n".encode())
                seconds = float(worker.stdout.readline())
            except (OSError, ValueError):
                seconds = None
            with self._changed:
                self._busy.remove(job)
                self._changed.notify_all()
                if seconds is None:
                    self._left.append(job)
                    return
                self.seconds[job] = seconds

    def _next(self) -> int | None:
        with self._changed:
            if not (self._open and self._left):
                return None
            job = self._left.pop()
            self._busy.add(job)
            return job


def serve(work: Callable[[int], Any]) -> None:
    """Do the jobs whose numbers come on the standard input; answers each with the time that it took [s]."""
    from planarfriction._engine.compiler.messages import expect_compilation

    expect_compilation()
    with contextlib.suppress(KeyboardInterrupt):
        for line in sys.stdin:
            begin = time.perf_counter()
            work(int(line))
            print(time.perf_counter() - begin, flush=True)


_sharing: dict[Any, tuple[Crew, int]] = {}
"""Functions that a crew is compiling, and the numbers of their jobs."""


@contextlib.contextmanager
def sharing(code: str, jobs: dict[Any, int], processes: int) -> Iterator[None]:
    """Let other processes, which run `code`, compile functions of these jobs in this block."""
    with Crew(code, jobs.values(), processes) as crew:
        _sharing.update({function: (crew, job) for function, job in jobs.items()})
        try:
            yield
        finally:
            for function in jobs:
                _sharing.pop(function, None)


def wait_for(function: Any) -> None:
    """Return when no other process is compiling a function: its machine code is on disk, or this process makes it."""
    crew, job = _sharing.get(function, (None, 0))
    if crew is not None:
        crew.take(job)


def possible() -> bool:
    """Return True if this process may start others like itself: it is Python, no child, and shares nothing yet."""
    alone = multiprocessing.parent_process() is None and not _sharing
    return alone and Path(sys.executable or "").stem.lower().startswith("python")
