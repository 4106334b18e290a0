"""Runs of cases in engines: errors, and times of a step."""

from __future__ import annotations

import hashlib
import itertools
import json
import multiprocessing
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction._support.reading import read_text
from planarfriction._support.writing import write_text
from planarfriction.errors import FileError
from planarfriction_studies.referee.case import QUANTITIES, Case, Path3, Truth
from planarfriction_studies.referee.engines import Engine

MARKS = {
    "ok": "within what is allowed",
    "off": "up to ten times that",
    "fails": "beyond, or no result",
}

FRAMES = 16
"""Times of a path that are kept."""

_FAILS = 10.0
"""Error over what is allowed from which a result has nothing to do with the truth."""


@dataclass(frozen=True)
class Verdict:
    """Judgement of an engine in a case: the worst of its quantities and time steps."""

    case: str
    engine: str
    mark: str
    """ok, off, fails, or - where the engine has no words for the case."""
    error: float | None
    """Error of the worst quantity, in its unit."""
    allowed: float
    """Largest error that passes, in the same unit."""
    unit: str
    quantity: str
    """The worst quantity and its body."""
    dt: float
    """Time step of the worst one [s]."""
    cost: float | None
    """Median processor time of a step of the engine [s]."""
    start: float | None = None
    """Processor time to build the case and make the first step, in which engines compile [s]."""
    reason: str = ""
    """Reason of no result."""
    path: tuple[tuple[float, float, float], ...] = ()
    """Displacement and turn of the worst body at a few times [m, m, rad]: its film."""
    fingerprint: str = ""
    """Hash of the case, the settings, the versions and the time steps: a verdict with another one is not reused."""


def trace(case: Case, engine: Engine, dt: float) -> tuple[Path3, float, float]:
    """Run a case; return the path of its bodies, the median time of a step, and the time until the first one [s]."""
    begin = time.process_time()
    world = engine.build(case, dt)
    world.step(case.wrenches(None, *world.poses()))
    built = time.process_time() - begin
    for _ in range(1, round(case.settle / dt)):
        world.step(case.wrenches(None, *world.poses()))
    for i, body in enumerate(case.moving):
        if any(body.velocity):
            world.throw(i, np.array(body.velocity))
    steps = round(case.time / dt)
    poses = [world.poses()]
    costs = []
    for i in range(steps):
        wrenches = case.wrenches((i + 0.5) * dt, *poses[-1])
        start = time.process_time()
        world.step(wrenches)
        costs.append(time.process_time() - start)
        poses.append(world.poses())
    positions, rotations = (np.array(each) for each in zip(*poses, strict=True))
    turns = np.unwrap(np.arctan2(rotations[..., 1, 0], rotations[..., 0, 0]), axis=0)
    return (
        Path3(dt * np.arange(steps + 1), positions, turns),
        float(np.median(costs)),
        built,
    )


def judge(case: Case, engine: Engine, steps: Sequence[float] | None = None) -> Verdict:
    """Run a case in an engine with its time steps, or with others [s], and judge its worst quantity."""
    if reason := engine.cannot(case):
        return no_result("-", case, engine, reason)
    verdicts = [_judge(case, engine, dt) for dt in steps or case.steps]
    return max(
        verdicts,
        key=lambda each: np.inf if each.error is None else each.error / each.allowed,
    )


def no_result(
    mark: str, case: Case, engine: Engine, reason: str, dt: float = 0.0
) -> Verdict:
    """Return a verdict without numbers, for a reason in one line."""
    truth = case.truths[0]
    words = " ".join(reason.split())[:200]
    unit = QUANTITIES[truth.quantity]
    return Verdict(
        case.name,
        engine.name,
        mark,
        None,
        truth.allowed,
        unit,
        "",
        dt,
        None,
        reason=words,
    )


def _judge(case: Case, engine: Engine, dt: float) -> Verdict:
    try:
        path, cost, start = trace(case, engine, dt)
    except NotImplementedError as error:
        return no_result("-", case, engine, str(error), dt)
    except Exception as error:  # an engine may raise anything
        return no_result("fails", case, engine, f"{type(error).__name__}: {error}", dt)
    if not (np.isfinite(path.positions).all() and np.isfinite(path.turns).all()):
        return no_result("fails", case, engine, "positions are not finite", dt)
    errors = [abs(case.measure(truth, path) - truth.value) for truth in case.truths]
    error, truth = max(
        zip(errors, case.truths, strict=True),
        key=lambda pair: pair[0] / pair[1].allowed,
    )
    share = error / truth.allowed
    mark = "ok" if share <= 1.0 else "off" if share <= _FAILS else "fails"
    what = f"{truth.quantity} of {truth.body}"
    unit = QUANTITIES[truth.quantity]
    frames = _frames(case, truth, path)
    return Verdict(
        case.name,
        engine.name,
        mark,
        error,
        truth.allowed,
        unit,
        what,
        dt,
        cost,
        start,
        path=frames,
    )


def _frames(
    case: Case, truth: Truth, path: Path3
) -> tuple[tuple[float, float, float], ...]:
    """Return displacements and turns of the body of a truth, with four digits."""
    body = [each.name for each in case.moving].index(truth.body)
    kept = np.linspace(0, len(path.times) - 1, FRAMES).round().astype(int)
    rows = np.column_stack([path.positions[kept, body, :2], path.turns[kept, body]])
    x, y, turn = (
        [float(f"{each:.4g}") for each in column] for column in (rows - rows[0]).T
    )
    return tuple(zip(x, y, turn, strict=True))


class Apart:
    """Process of its own for each engine, as a context: an engine that crashes fails in that case alone."""

    def __init__(self) -> None:
        self._pool: ProcessPoolExecutor | None = None
        self._engine = ""

    def __enter__(self) -> Apart:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def _end(self) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
            self._pool = None

    def judge(
        self, case: Case, engine: Engine, steps: Sequence[float] | None = None
    ) -> Verdict:
        """Judge as the function `judge` does."""
        if self._engine != engine.name:
            self._end()
        if self._pool is None:
            self._pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))
            self._engine = engine.name
        try:
            return self._pool.submit(judge, case, engine, steps).result()
        except BrokenProcessPool:
            self._end()
            return no_result("fails", case, engine, "the engine ended the process")


class Kept:
    """Verdicts by case and engine, in a JSON file that each new one is written to."""

    def __init__(self, file: Path | None = None) -> None:
        self.file = file
        self.verdicts: dict[tuple[str, str], Verdict] = {}
        if file is None or not file.exists():
            return
        try:
            rows = [
                Verdict(**row)
                for row in json.loads(read_text(file, "verdicts of the referee"))
            ]
        except (TypeError, ValueError):
            raise FileError(
                f"{file}: has no verdicts of the referee: name another file, or remove it"
            ) from None
        self.verdicts = {(each.case, each.engine): each for each in rows}

    def add(self, verdict: Verdict) -> None:
        """Keep a verdict, in place of an earlier one."""
        self.verdicts[verdict.case, verdict.engine] = verdict
        if self.file is not None:
            write_text(
                self.file,
                json.dumps(to_rows([*self.verdicts.values()]), indent=1) + "\n",
            )

    def of(self, cases: Mapping[str, Case], engines: Sequence[Engine]) -> list[Verdict]:
        """Return the verdicts on these engines in these cases."""
        keys = ((case, engine.name) for engine in engines for case in cases)
        return [self.verdicts[key] for key in keys if key in self.verdicts]


def run(
    cases: Mapping[str, Case],
    engines: Sequence[Engine],
    kept: Kept,
    *,
    steps: Sequence[float] | None = None,
    judged: Callable[..., Verdict] = judge,
    progress: Callable[[int, int, str], None] = lambda done, of, words: None,
) -> None:
    """Judge all engines in all cases, but for what is kept; each verdict is kept at once, for a run that is ended."""
    pairs = list(itertools.product(engines, cases.values()))
    for done, (engine, case) in enumerate(pairs):
        progress(done, len(pairs), f"{engine.name}, {case.name}")
        own = _fingerprint(case, engine, steps)
        known = kept.verdicts.get((case.name, engine.name))
        if known is None or known.fingerprint != own:
            kept.add(replace(judged(case, engine, steps), fingerprint=own))


def _fingerprint(case: Case, engine: Engine, steps: Sequence[float] | None) -> str:
    versions = [
        metadata.version(package) for package in ("planarfriction", engine.package)
    ]
    return hashlib.sha256(
        repr((case, engine.settings, versions, steps)).encode()
    ).hexdigest()[:16]


def to_rows(verdicts: Sequence[Verdict]) -> list[dict[str, Any]]:
    """Return verdicts as plain rows for JSON."""
    return [asdict(each) for each in verdicts]
