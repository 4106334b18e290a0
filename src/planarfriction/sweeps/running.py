"""`sweep`: run a scene for every combination of some quantities, and continue where an earlier sweep ended."""

from __future__ import annotations

import itertools
import pickle
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from planarfriction._engine.compiler import threads
from planarfriction._support import validation
from planarfriction._support.described import described
from planarfriction.errors import InvalidValueError, SweepError, SweepInterrupted
from planarfriction.scenes import Scene, Solution
from planarfriction.scenes.simulation import BRISTLES
from planarfriction.sweeps.keys import Keys
from planarfriction.sweeps.records import (
    FAILED,
    OWN,
    TURN,
    Batch,
    Bookkeeper,
    Index,
    Record,
    reason_of,
    run_all,
)
from planarfriction.sweeps.settings import Settable, check_takes, grid_of

if TYPE_CHECKING:
    import xarray as xr

_BETWEEN = 0.5
"""Time between two reports of progress [s]."""

_AHEAD = 2
"""Number of batches of runs that wait for each worker of an executor, so that none is
idle and little memory is used."""

_WORKERS = 64
"""Number of workers of an executor that does not tell it: each gets one run until the
first has ended."""

_BATCH = 64
"""Largest number of runs that are handed out together."""

_ENDED = "the executor ended ({}): finished runs are kept, sweep again to continue"
"""Message about an executor that ended, with its reason."""


@described
class Progress(NamedTuple):
    """Progress of a sweep; as text it is one line."""

    runs: int
    """Number of runs in the sweep."""
    done: int
    """Finished runs, including those found from an earlier sweep."""
    found: int
    """Runs found from an earlier sweep."""
    failed: int
    """Runs that failed."""
    damaged: int
    """Damaged files of earlier runs; these runs are repeated."""
    left: float | None
    """Estimated remaining time [s], from the time of the runs so far; None before the first."""

    def __str__(self) -> str:
        counts = {
            "found": self.found,
            "failed": self.failed,
            "damaged and done again": self.damaged,
        }
        words = ", ".join(f"{count} {name}" for name, count in counts.items() if count)
        text = f"{self.done} of {self.runs} runs{f' ({words})' if words else ''}"
        if self.left is None or self.done == self.runs:
            return text
        return f"{text}, {_duration(self.left)} left"


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    minutes = seconds / 60.0
    return f"{minutes:.0f} min" if minutes < 90.0 else f"{minutes / 60.0:.1f} h"


_Job = tuple[Index, str, Scene]
"""Run that has been handed out: its place in the grid, its key, its scene."""


def sweep(
    make_scene: Callable[..., Scene] | Scene | str | Path,
    values: Mapping[str, Any],
    *,
    out: str | Path | None = None,
    executor: Executor | None = None,
    bristles: str = "none",
    measure: Callable[[Solution], Any] | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> xr.Dataset:
    """Simulate a scene for every combination of some quantities; returns a dataset with a dimension for each of them.

    Runs that are already in `out` are not repeated: a run is identified by its scene, the name and source of its
    measurement, and the library, whatever code makes the scene. If the process is killed, only the runs in progress and
    those of the last half second, and of a fiftieth of the time so far, are lost. Equal scenes give equal bits, in any
    order and with any executor on the same kind of processor.

    A failed run does not end the sweep: `status` says how each run ended ("success", "at rest", "failed"), `failure`
    why it failed, and `out` has its scene in `<run>.failed.json`. The next call tries it again. `run` names each run.

    Parameters
    ----------
    make_scene
        Function that returns the Scene for some values, which it receives by name; or a Scene, or the path of a scene
        file, whose values have dotted names like "fingers.law.mu_c".
    values
        For the name of each quantity, a list of numbers, texts or booleans, or a mapping from labels to values of any
        kind.
    out
        Folder that keeps the runs in files; None to keep nothing.
    executor
        Any `concurrent.futures.Executor`; by default threads, one for each processor.
    bristles
        "all" records the state of each contact too, as `simulate` does.
    measure
        Function of a Solution that returns what the dataset should contain: a number, a mapping from names to numbers,
        texts or arrays, an xarray object, or a Solution, such as `tactile.read` adds fields to; with `out`, a function
        that is defined with a name. By default the Solution as it is. Of a Solution, the dataset has all `data`, at all
        instants that any of the runs records: NaN where a run has no value, and its last values after its body has come
        to rest.
    progress
        Called with a `Progress` from time to time; `print` is enough.

    Raises
    ------
    InvalidValueError
        A parameter breaks its rule.
    FileError
        The folder cannot be written.
    SweepError
        All runs failed, or the executor did.
    SweepInterrupted
        Ctrl-C; carries the dataset so far. Finished runs stay in `out`.
    """
    if executor is not None:
        validation.instance(
            "executor", executor, Executor, "a concurrent.futures.Executor, or None"
        )
    sweeping = Sweeping(make_scene, values, out, bristles, measure, progress)
    if isinstance(executor, ProcessPoolExecutor):
        try:
            pickle.dumps(measure)
        except Exception as error:
            raise InvalidValueError(
                "measure",
                "be a function that other processes can import, such as one defined in a module",
                reason_of(error),
            ) from None
    book = sweeping.book
    try:
        sweeping.go(executor)
    except KeyboardInterrupt:
        raise SweepInterrupted(str(sweeping.progress()), book.dataset()) from None
    if book.failed == sweeping.grid.size:  # the mistake is in what all runs share
        raise SweepError(
            f"all {book.failed} runs failed; the first: {book.first_failure()}"
        )
    return book.dataset()


def finished_runs(
    make_scene: Callable[..., Scene] | Scene | str | Path,
    values: Mapping[str, Any],
    *,
    out: str | Path,
    bristles: str = "none",
    measure: Callable[[Solution], Any] | None = None,
) -> xr.Dataset:
    """Return the dataset of the runs that are in the folder of a `sweep` by now; `status` is "missing" for the others.

    The arguments are those of the sweep, which may be killed, or go on meanwhile.

    Raises InvalidValueError for an argument that breaks its rule, and FileError for a folder that cannot be written.
    """
    sweeping = Sweeping(make_scene, values, out, bristles, measure, None)
    for _ in sweeping.jobs():
        pass
    return sweeping.book.dataset()


class Sweeping:
    """Sweep in progress: hands out the runs and gives their results to the bookkeeper."""

    def __init__(
        self,
        make_scene: Any,
        values: Any,
        out: Any,
        bristles: Any,
        measure: Any,
        report: Any,
    ) -> None:
        """Check the arguments of a sweep, and prepare it."""
        self.grid = grid = grid_of(values)
        if callable(make_scene):
            self._make_scene = check_takes(make_scene, list(grid.values))
        elif isinstance(make_scene, (Scene, str, Path)):
            self._make_scene = make = Settable(make_scene)
            make.check(grid.values)
        else:
            raise InvalidValueError(
                "make_scene",
                "be a function that returns a Scene, a Scene, or a path",
                make_scene,
            )
        for name in OWN:
            if name in grid.labels:
                raise InvalidValueError(
                    "name of a swept quantity", f"not be one of {', '.join(OWN)}", name
                )
        for name, given, of in (
            ("measure", measure, "Solution"),
            ("progress", report, "Progress"),
        ):
            if not (given is None or callable(given)):
                raise InvalidValueError(
                    name, f"be a function of a {of}, or None", given
                )
        self._bristles = validation.choice("bristles", bristles, BRISTLES)
        self._keys = Keys(measure, out is not None, self._bristles)
        self._measure = measure
        self._report = report
        if out is not None and not str(validation.path("out", out)).isprintable():
            raise InvalidValueError(
                "out", "be a path of printable characters", ascii(str(out))
            )
        if out is not None and Path(out).suffix == ".zarr":
            raise InvalidValueError(
                "out",
                "be a folder (the dataset becomes a zarr store by its own method: data.to_zarr(path, zarr_format=2))",
                str(out),
            )
        self.book = Bookkeeper(grid, out)
        self._ended = ""
        self._size = 1
        self._begin = self._reported = time.monotonic()
        self._stopped = threading.Event()

    def progress(self) -> Progress:
        """Return the progress so far."""
        book = self.book
        runs = self.grid.size
        done = book.found + book.new
        spent = time.monotonic() - self._begin
        left = spent / book.new * (runs - done) if book.new else None
        return Progress(runs, done, book.found, book.failed, book.damaged, left)

    def go(self, executor: Executor | None) -> None:
        """Do all runs that are not done, so few at a time that the use of memory does not grow."""
        try:
            if executor is not None:
                self._go(executor, getattr(executor, "_max_workers", None), None)
                return
            workers = threads.processors()
            with ThreadPoolExecutor(workers, "sweep") as own:
                self._go(own, workers, self._stopped.is_set)
        finally:
            self.book.flush(at_once=True)

    def _go(
        self,
        executor: Executor,
        workers: int | None,
        stopped: Callable[[], bool] | None,
    ) -> None:
        pending: dict[Future, list[_Job]] = {}
        most = workers or _WORKERS
        jobs = self.jobs()
        again = []
        try:
            while True:
                batch = []
                if len(pending) < most * (_AHEAD if self.book.new else 1):
                    batch = (
                        again.pop()
                        if again
                        else list(itertools.islice(jobs, self._share(workers, pending)))
                    )
                if batch:
                    try:
                        scenes = [scene for *_, scene in batch]
                        given = self._measure, self._bristles, stopped
                        future = executor.submit(run_all, Batch(scenes, *given))
                    except RuntimeError as error:  # broken, or shut down
                        raise SweepError(_ENDED.format(reason_of(error))) from None
                    pending[future] = batch
                elif not pending:
                    break
                # Without a batch to hand out, whoever waits hears from time to time that none is done.
                done, _ = wait(pending, 0.0 if batch else _BETWEEN, FIRST_COMPLETED)
                again += self._take(done, pending)
                self._tell()
        except BaseException:
            self._stopped.set()
            for future in pending:
                future.cancel()
            # Threads of its own, which hand over what they have.
            if stopped is not None:
                wait(pending)
            done = [each for each in pending if each.done() and not each.cancelled()]
            self._take(done, pending)
            raise
        finally:
            self._tell(at_once=True)

    def _share(self, workers: int | None, pending: dict[Future, list[_Job]]) -> int:
        """Return how many runs to hand out together: fewer towards the end, where workers are to end together."""
        if workers is None:
            return self._size
        progress = self.progress()
        left = progress.runs - progress.done - sum(map(len, pending.values()))
        return min(self._size, 1 + left // (_AHEAD * workers))

    def jobs(self) -> Iterator[_Job]:
        """Yield the runs that are to be done, after noting those that are found, or have no scene, on the way."""
        for index, values in self.grid.points():
            try:
                scene = self._make_scene(**values)
            except Exception as error:
                record = Record(FAILED, f"make_scene: {reason_of(error)}", {})
                self.book.add(index, "", record, None)
                continue
            if not isinstance(scene, Scene):
                raise InvalidValueError(
                    "make_scene", "return a Scene", type(scene).__name__
                )
            scene = self._keys.shared(scene)
            key = self._keys.key(scene)
            if self.book.look_up(index, key, scene):
                self._tell()
            else:
                yield index, key, scene

    def _take(
        self, done: Iterable[Future], pending: dict[Future, list[_Job]]
    ) -> list[list[_Job]]:
        """Note the runs of batches that have ended; returns those that were not reached, in batches."""
        again = []
        for future in done:
            # `exception` returns the worker's error, so that a KeyboardInterrupt raised here is this process's own.
            error = CancelledError() if future.cancelled() else future.exception()
            jobs = pending.pop(future)
            if isinstance(error, (BrokenExecutor, CancelledError)):
                self._ended = _ENDED.format(reason_of(error))
                continue
            # In a process that heard Ctrl-C too: these runs are not done.
            if isinstance(error, KeyboardInterrupt):
                continue
            # any other error means that the executor lost the runs, or could not send one of them
            if error is not None:
                failed = Record(FAILED, reason_of(error), {})
                records = [failed] if len(jobs) == 1 else []
                size = 1
            else:
                records, spent = future.result()
                fitting = int(len(records) * TURN / (spent + 1e-9))
                self._size = size = max(1, min(fitting, _BATCH))
            for (index, key, scene), record in zip(jobs, records, strict=False):
                self.book.add(index, key, record, scene)
            left = jobs[len(records) :]
            again += [left[first : first + size] for first in range(0, len(left), size)]
        self.book.flush()
        if self._ended:
            raise SweepError(self._ended)
        return again

    def _tell(self, at_once: bool = False) -> None:
        now = time.monotonic()
        if self._report is not None and (at_once or now - self._reported >= _BETWEEN):
            self._reported = now
            try:
                self._report(self.progress())
            except Exception as error:
                raise InvalidValueError(
                    "progress", "be a function of a Progress", reason_of(error)
                ) from error
