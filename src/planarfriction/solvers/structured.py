"""The driver of the structured solver: runs the compiled loop in slices, collects statistics, suggests remedies."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from planarfriction._engine.body import rosenbrock as kernels
from planarfriction._engine.body.body import System
from planarfriction._engine.body.integration import IntegrationProgress, Method, Output
from planarfriction._engine.compiler import missing, parallel, threads
from planarfriction._engine.compiler.calls import address_of, signature_of
from planarfriction._support.equality import ByValue
from planarfriction.errors import InvalidValueError
from planarfriction.solvers.statistics import Statistics

_STATES_PER_SLICE = 400_000
"""Steps times states between two looks at the clock and the keyboard: some 20 ms."""

_FIRST_STEP = 1e-6
"""First trial step [s]: below the relaxation time of a bristle, so that it is hardly ever rejected."""

_STEP_LIMIT = 5
"""Outcome beside those of the compiled loop: all steps that a run may try are taken."""

_MESSAGES = {
    kernels.DONE: ("success", "reached the end"),
    kernels.AT_REST: ("at rest", "the body came to rest"),
    kernels.APART: ("left its contacts", "the body left its last contact"),
    kernels.PAUSED: ("interrupted", "interrupted before the end"),
    kernels.STEP_TOO_SMALL: (
        "step too small",
        "the step size fell below the resolution of time: loosen rtol, or check the scene for extreme parameters",
    ),
    _STEP_LIMIT: (
        "step limit",
        "max_steps steps were tried before the end: raise it, or check the scene for extreme parameters",
    ),
}

_loaded: set[Callable[..., int]] = set()
"""Compiled loops that are in this process: later runs need not ask."""


_MOST_PROCESSES = 3
"""Processes that compile the solver beside this one: two of its functions take half of the time."""


@contextlib.contextmanager
def compiled_together() -> Iterator[None]:
    """Let other processes compile functions of the solver in this block, if they are not on disk yet."""
    functions = () if kernels.advance in _loaded else kernels.FUNCTIONS
    jobs = {
        function: i
        for i, function in enumerate(functions)
        if missing(function, signature_of(function))
    }
    processes = min(threads.processors() - 1, _MOST_PROCESSES, len(jobs) - 1)
    if processes < 1 or not parallel.possible():
        yield
        return
    with parallel.sharing(
        "from planarfriction.solvers import structured; structured.serve()",
        jobs,
        processes,
    ):
        yield


def serve() -> None:
    """Compile functions of the solver for another process."""
    parallel.serve(lambda job: address_of(kernels.FUNCTIONS[job]))


def start_of(state: np.ndarray) -> IntegrationProgress:
    """Return the progress of an integration that has yet to begin."""
    clock = np.array([0.0, _FIRST_STEP, np.inf])
    return IntegrationProgress(
        np.array(state, dtype=float),
        np.zeros(2, np.int64),
        clock,
        np.zeros(4, np.int64),
    )


def tried(at: IntegrationProgress) -> int:
    """Return the number of steps that an integration has tried, accepted or not."""
    return int(at.statistics[kernels.STEPS] + at.statistics[kernels.REJECTIONS])


@dataclass(frozen=True, eq=False)
class Integration(ByValue):
    """Outcome of `integrate`; its arrays contain the requested times that were reached."""

    output: Output
    """The recorded values."""
    status: str
    """Status at the end, as in a `Solution`."""
    message: str
    """Reason for the end, in one sentence."""
    statistics: Statistics
    """Number of steps and computing time."""


def integrate(
    windows: Iterable[System],
    output: Output,
    state: np.ndarray,
    *,
    method: Method,
    rtol: float,
    atol: np.ndarray,
    progress: Callable[[float], None] | None = None,
    max_steps: float = math.inf,
) -> Integration:
    """Integrate a motion, given in windows, from its first break to its last, and record it at `output.time`.

    Each window continues where the previous one ends, and is released before the next one is requested. `state`
    contains bristles, body velocity and pose; `atol` is the absolute tolerance of each of its entries. `progress` is
    called with the simulated time from time to time, and before each further window. After `max_steps` steps, rejected
    ones included, it ends with the status "step limit". Ctrl-C ends with the status "interrupted", or with
    `KeyboardInterrupt` if nothing has been recorded yet.

    Raises `InvalidValueError` for `rtol <= 0`.
    """
    if not (np.isfinite(rtol) and rtol > 0.0):
        raise InvalidValueError("rtol", "be > 0", rtol)
    if not (np.isfinite(atol).all() and (atol > 0.0).all()):
        raise InvalidValueError("atol", "be > 0", float(np.min(atol)))
    at = start_of(state)
    outcome = kernels.PAUSED
    wall_time = 0.0
    compile_time = 0.0
    slice_steps = max(20, _STATES_PER_SLICE // len(state))
    try:
        for system in windows:
            if kernels.advance not in _loaded:
                begin = time.perf_counter()
                first = kernels.Run(
                    system, method, output, start_of(state), rtol=rtol, atol=atol
                )
                # Compiles, or loads from the cache, and takes no step.
                kernels.advance(first.address, 0)
                compile_time = time.perf_counter() - begin
                _loaded.add(kernels.advance)
            run = kernels.Run(system, method, output, at, rtol=rtol, atol=atol)
            breaks = system.motion.breaks
            at.cursor[0] = 0
            outcome = kernels.PAUSED
            while outcome == kernels.PAUSED:
                begin = time.perf_counter()
                left = max_steps - tried(at)
                outcome = (
                    kernels.advance(run.address, min(slice_steps, left))
                    if left > 0
                    else _STEP_LIMIT
                )
                wall_time += time.perf_counter() - begin
                if progress is not None:
                    piece = min(int(at.cursor[0]), len(breaks) - 1)
                    progress(float(breaks[piece] + at.clock[0]))
            del system, run
            if outcome != kernels.DONE:
                break
    except KeyboardInterrupt:
        if at.cursor[1] == 0:  # while compiling: there is nothing to keep yet
            raise
        outcome = kernels.PAUSED
    reached = int(at.cursor[1])
    kept = Output(
        *(array[:reached] if len(array) else array for array in output[:-1]),
        ended=output.ended,
    )
    status, message = _MESSAGES[int(outcome)]
    statistics = Statistics(
        *at.statistics.tolist(), wall_time=wall_time, compile_time=compile_time
    )
    return Integration(kept, status, message, statistics)
