"""Results of the studies, to be recorded in `studies/tests/recorded`: see `tests.support.recording`."""

from __future__ import annotations

import contextlib
import importlib.util
import itertools
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np

from planarfriction_studies import experiments
from planarfriction_studies.experiments.experiment import Work
from tests.support import recorded, shown

FOLDER = Path(__file__).parents[2] / "studies" / "tests" / "recorded"


def told(name: str, found: Any) -> Any:
    """Tell a result; of what measures times the words of its figures and tables, and what it compares."""
    if name != "timing":
        return recorded.plain(found)
    kept = recorded.plain(replace(found, findings=[], verdict="", numbers={}, data={}))
    for picture in kept["pictures"]:
        for panel in picture["figure"]["panels"]:
            panel.update(
                limits=None,
                words=[each for each, *_ in panel["words"]],
                lines=[each[:4] for each in panel["lines"]],
            )
    for table in kept["tables"]:
        table["rows"] = [row[:1] for row in table["rows"]]
    return kept


def check(name: str, found: Any) -> None:
    """Assert that a result is the recorded one."""
    recorded.check(FOLDER / f"{name}.json", told(name, found))


def experiment(name: str) -> Callable[[], Any]:
    """Return a function that runs the quick version of an experiment."""
    return lambda: experiments.find_experiment(name).run(Work(quick=True))


def beyond() -> Any:
    """Run the quick version of `beyond` with times that are made up: of a run by its states, of a step by its turn."""
    from planarfriction_studies.experiments.beyond import ladder

    def solved(scene: Any, t_end: float = 1.0) -> Any:
        states = sum(np.prod(contact.model.state_shape) for contact in scene.contacts)
        return SimpleNamespace(
            statistics=SimpleNamespace(wall_time=1e-5 * t_end * float(states))
        )

    ticks = itertools.count(1)
    clock = SimpleNamespace(process_time=lambda: 1e-6 * next(ticks) ** 2)
    with changed(ladder, simulate=solved, time=clock):
        return experiment("beyond")()


# ---------------------------------------------------------------------- measured data


def measured() -> dict[str, Any]:
    """Fit and score all models on a few cases of each task, as the command does, and draw the pictures."""
    from planarfriction_studies.measured import Benchmark, contactnets
    from planarfriction_studies.measured.benchmark import table, to_dict
    from planarfriction_studies.measured.figures import draw
    from planarfriction_studies.measured.library import LIBRARY

    models = {name: entry.make() for name, entry in LIBRARY.items() if not entry.needs}
    benchmark = Benchmark(models)
    for name, cases in benchmark.cases.items():
        sides = [
            [case for case in cases if case.is_training is side]
            for side in (True, False)
        ]
        few = {"slides": (16, 6), "pushes": (3, 5), "series": (2, 8), "onsets": (3, 4)}[
            name
        ]
        benchmark.cases[name] = [
            case
            for side, count in zip(sides, few, strict=True)
            for case in _spread(side, count)
        ]
    # Further ones take other ways on other processors.
    with changed(contactnets, STEPS=2):
        benchmark.run()
    tasks = benchmark.results
    found = to_dict(benchmark)
    for task in found["tasks"].values():
        for model in task["models"].values():
            assert model.pop("seconds") >= 0.0
    return {
        "left out": benchmark.left_out,
        "all": found,
        "tables": {task: table(benchmark, task) for task in tasks},
        "pictures": {task: draw(benchmark, task) for task in tasks},
        "answers": {
            task: {name: each.answers for name, each in found.items()}
            for task, found in tasks.items()
        },
        "tosses": _tosses(benchmark.cases["slides"]),
    }


def _tosses(cases: list[Any]) -> list[Any]:
    """Estimate what differs from toss to toss with the spreads that the fit begins with."""
    from planarfriction_studies.measured import contactnets
    from planarfriction_studies.measured.end_regions import EndRegions, moved_to

    questions = [case.question for case in cases]
    begun = contactnets.TossModel()
    linear = begun.linear(questions)
    model = begun._with_usual(linear, cases)
    changes, spread, counts = model._estimate(linear, questions)
    ends = model.ends(questions)
    moved = moved_to(questions, ends[0])
    far = model.distances(cases)
    sized = replace(model, sized=EndRegions.fitted(moved, far))
    squares = contactnets._squares(np.array(model.spreads), linear, cases, counts)
    fitted = (
        model.fitted_values(),
        model.check(cases),
        sized.regions(questions, 0.8),
        sized.sized,
    )
    return [
        *linear,
        model.usual,
        changes,
        spread,
        counts,
        *ends,
        moved,
        far,
        squares,
        *fitted,
        model.answer_all(questions),
    ]


def _spread(cases: list[Any], count: int) -> list[Any]:
    return [cases[i] for i in np.linspace(0, len(cases) - 1, count).astype(int)]


def replayed() -> dict[str, Any]:
    """Read the measured pushes and the logs of the joint, and make joints like it."""
    from planarfriction.limit_surface import LimitSurfaceExact
    from planarfriction_studies.measured import (
        joints,
        replayed_pushes,
        synthetic_joints,
    )

    pushes = {
        "single": replayed_pushes.single_pushes(),
        "in time": replayed_pushes.pushes_in_time(),
    }
    logs = joints.read_logs()
    told = {
        name: [
            [
                each.board,
                each.name,
                each.mu,
                each.path.times,
                each.path.values,
                each.start,
                each.end,
            ]
            for each in found
        ]
        for name, found in pushes.items()
    }
    return {
        **told,
        "errors": [
            replayed_pushes.errors(found[::25], LimitSurfaceExact)
            for found in pushes.values()
        ],
        "logs": [_log(log) for log in logs],
        "made": [
            [each.terms, [_log(log) for log in each.logs]]
            for each in map(_joint(synthetic_joints, logs), range(4))
        ],
    }


def _log(log: Any) -> list[Any]:
    return [log.time, log.q, log.drive.kp, log.on]


def _joint(module: Any, logs: Any) -> Callable[[int], Any]:
    return lambda seed: module.synthetic_joint(seed, logs[:2])


# ---------------------------------------------------------------------- commands

COMMANDS = (
    "reproduce --list", "referee --list --engine MuJoCo", "measured --seed -1",
    "measured --task onsets --only none", "measured --own nothing.py:f", "measured --own own.py:predict --task pushes",
    "measured --own own.py:held --task pushes", "measured --task pushes --only ellipsoid --out found",
    "measured --task pushes --only uncoupled --json", "reproduce --quick --full", "reproduce --only nothing",
    "bench --only nothing", "bench --only in_hand.reduced --rounds 0", "bench --compare nothing.json",
    "bench --compare own.py --force", "bench --only in_hand.reduced", "online trials --parts 1",
    "online trials --parts 4 --json trials.json", "online demo --out a.txt", "online demo --seed -1", "online demo",
    "referee --case none", "referee --case stop --step 0",
    "referee --case stop --engine MuJoCo --step 0.002 --json judged.json --out judged",
    "simulators --case stop --engine MuJoCo --json judged.json", "referee export cases",
)  # fmt: skip


MACHINE = {"date": "today", "machine": "a machine", "versions": {"a": "1"}}
"""Facts of a run that differ from machine to machine, made up."""


def commands() -> dict[str, Any]:
    """Call the commands of the studies in an empty folder, with results of trials and a machine that are made up."""
    from planarfriction_studies.commands.online import WORDS
    from planarfriction_studies.referee import report, run
    from planarfriction_studies.rig import demo, trials

    own = "def predict(question):\n    return [0.0, 0.0, 0.0]\ndef held(question):\n    return question.wrenches\n"
    made = {name: 0.123 * i for i, name in enumerate(WORDS)}
    hold = demo.record_hold
    stated = report.stated
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        ExitStack() as stack,
    ):
        Path("own.py").write_text(own, encoding="utf-8")
        told = lambda parts, seed, progress: {"parts": parts, "seed": seed} | made
        stack.enter_context(changed(trials, run_trials=told))
        stack.enter_context(changed(demo, record_hold=lambda seed: hold(seed, 100)))
        stack.enter_context(
            changed(report, stated=lambda engines: stated(engines) | MACHINE)
        )
        stack.enter_context(changed(run, _fingerprint=lambda *_: "fingerprint"))
        found = shown.called(COMMANDS)
        return found | {
            path.name: recorded.text(path.read_text(encoding="utf-8"))
            for path in Path().rglob("*.json")
        }


# ---------------------------------------------------------------------- benchmarks

SHORT: dict[str, dict[str, Any]] = {
    "exported": {"STEPS": 2, "SAMPLES": 1000},
    "gradients": {"STEPS": 20},
    "simulator_costs": {
        "ROUNDS": 1, "STEPS": 2, "ENVIRONMENTS": 2, "MJX_STEPS": 2, "MJX_ROUNDS": 1, "WORLDS": 2
    },
    "workflows": {"POWER_STEPS": 2, "DURATION": 0.2, "_MASSES": (0.1,), "_OFFSETS": (0.0,), "_GRIPS": (1.0,)},
}  # fmt: skip
"""Numbers of benchmarks that make them long, by module."""

LONG = (
    "export.step.reduced",
    "identify.",
    "mjx.",
    "mujoco_warp.",
    "sensitivities.",
    "warp.",
)
"""Benchmarks that compile for long; of exported steps those of one model show what both share."""


def benchmark(name: str) -> list[Any] | None:
    """Run a benchmark in its shortest form: its line, with the number of a call for its time, and what calls returned.

    None without what it needs.
    """
    from planarfriction_studies import bench
    from planarfriction_studies.bench import running, whole_runs

    returned: list[Any] = []
    calls = itertools.count(1)

    def timed(action: Callable[[], Any], repeats: int = 1, inner: int = 1) -> float:
        returned.append([repeats, inner, recorded.plain(action())])
        return float(next(calls))

    def simulated(scene: Any, **options: Any) -> Any:
        found = whole_runs_simulate(scene, **options)
        if (now := [options, recorded.plain(found)]) not in returned:
            returned.append(now)
        return replace(
            found, statistics=replace(found.statistics, wall_time=float(next(calls)))
        )

    whole_runs_simulate = whole_runs.simulate
    with ExitStack() as stack:
        for module in {
            each for each in vars(running).values() if isinstance(each, ModuleType)
        }:
            values = dict(SHORT.get(module.__name__.rpartition(".")[2], {}))
            values |= {
                each: timed for each in ("median", "once") if hasattr(module, each)
            }
            stack.enter_context(changed(module, **values))
        lsoda = lambda scene, t_end: timed(lambda: [type(scene).__name__, t_end])
        stack.enter_context(changed(whole_runs, simulate=simulated, lsoda_time=lsoda))
        (found,) = bench.run([name])
    if name == "sweep":  # whose words have times and megabytes
        found = replace(found, baseline=recorded.NUMBER.sub("#", found.baseline))
    return None if found.value is None else [recorded.plain(found), returned]


def benchmarks() -> dict[str, Any]:
    """Run the benchmarks that do not compile for long."""
    from planarfriction_studies.bench import BENCHMARKS

    return {name: benchmark(name) for name in BENCHMARKS if not name.startswith(LONG)}


# ---------------------------------------------------------------------- rig


def rig() -> dict[str, Any]:
    """Hold, slide, turn and hinge four parts with the library's controllers and the published rules."""
    from planarfriction_studies.rig import demo, pictures, trials

    base = trials.random_parts(2, 5, 1)
    found: dict[str, Any] = {"parts": base}
    with changed(trials, HOLD_STEPS=700, EXPLORED_STEPS=300, AFTER_STEPS=50):
        runs: dict[Any, Any] = {}
        for task in ("hold", "slide", "turn", "hinge"):
            parts, goal, _ = trials._task(task, base, 5, 1)
            parts = replace(
                parts,
                tap_time=0.3,
                tilt_time=min(float(np.max(parts.tilt_time)), 0.4),
                tilt_duration=0.2,
            )
            for ours in (True, False):
                run = trials.trial(task, parts, goal, 0.6, ours=ours, seed=3)
                runs[task, ours] = run | {"goal": np.broadcast_to(goal, len(parts))}
                found[f"{task}, {'ours' if ours else 'rule'}"] = [
                    parts,
                    runs[task, ours],
                ]
        found["shares"] = trials._shares(runs)
    record = demo.record_hold(1, 500)
    return found | {
        "record": record,
        "picture": pictures.plot_grip(record),
        "early": pictures.plot_grip(record, 20),
    }


# ---------------------------------------------------------------------- referee


def referee() -> dict[str, Any]:
    """Read all cases, draw and export them, and report results that are made up."""
    from planarfriction_studies.referee import case, export, pictures, report
    from planarfriction_studies.referee.run import Verdict

    cases = case.all_cases()
    verdicts = []
    engines = ("A", "A, best", "B")
    for i, (each, engine) in enumerate(itertools.product(cases.values(), engines)):
        truth = each.truths[i % len(each.truths)]
        about = (
            truth.allowed,
            case.QUANTITIES[truth.quantity],
            f"{truth.quantity} of {truth.body}",
            2e-3,
        )
        path = tuple((0.001 * k * i, 0.002 * k, 0.01 * k * i) for k in range(16))
        verdicts += [
            Verdict(
                each.name,
                engine,
                "ok",
                0.01 * i * truth.allowed,
                *about,
                1e-5 * (i + 1),
                0.1 * i,
                path=path,
            ),
            Verdict(
                each.name,
                engine,
                "off",
                (2.0 + 0.1 * i) * truth.allowed,
                *about,
                2e-5,
                0.3,
                path=path,
            ),
            Verdict(
                each.name,
                engine,
                "fails",
                (20.0 + i) * truth.allowed,
                *about,
                2e-4,
                None,
                path=path,
            ),
            Verdict(each.name, engine, "-", None, *about, None, None, "no words"),
        ][i % 4 : i % 4 + 1]
    run = MACHINE | {"settings": {"A": "default"}}
    places = np.random.default_rng(0).normal(size=(20, 3))
    with tempfile.TemporaryDirectory() as folder:
        for name in ("push", "ramp", "in_hand", "anisotropic"):
            export.export_case(cases[name], Path(folder))
        files = {
            path.name: recorded.text(path.read_text(encoding="utf-8"))
            for path in sorted(Path(folder).iterdir())
        }
    return {
        "cases": cases,
        "moments": {
            name: [[body.name, body.moments] for body in each.moving]
            for name, each in cases.items()
        },
        "wrenches": {
            name: [_wrenches(each, places, t) for t in (None, 0.1, 0.37)]
            for name, each in cases.items()
        },
        "scenes": {name: pictures.scene(each) for name, each in cases.items()},
        "films": {
            name: recorded.text(pictures.film(each, verdicts))
            for name, each in cases.items()
        },
        "files": files,
        "pictures": {name: report.picture(name, verdicts) for name in ("stop", "disc")},
        "page": recorded.text(
            report.page(verdicts, {name: cases[name] for name in ("stop", "disc")}, run)
        ),
        "table": report.table(verdicts),
        "simulators": report.simulators(verdicts),
    }


def _wrenches(case: Any, places: np.ndarray, t: float | None) -> np.ndarray:
    count = len(case.moving)
    return case.wrenches(
        t, np.resize(places, (count, 3)), np.tile(np.eye(3)[[1, 2, 0]], (count, 1, 1))
    )


def mujoco() -> dict[str, Any]:
    """Make a few steps of each case in each kind of MuJoCo."""
    from planarfriction_studies.referee import case
    from planarfriction_studies.referee.engines.mujoco import ENGINES

    found: dict[str, Any] = {}
    for each in case.all_cases().values():
        for engine in ENGINES:
            reason = engine.cannot(each)
            found[f"{each.name}, {engine.name}"] = [
                engine.settings,
                reason,
                None if reason else _steps(each, engine),
            ]
    return found


def _steps(case: Any, engine: Any) -> list[Any]:
    world = engine.build(case, 2e-3)
    for i, body in enumerate(case.moving):
        if any(body.velocity):
            world.throw(i, np.array(body.velocity))
    for k in range(10):
        world.step(case.wrenches(0.1 * k, *world.poses()))
    return list(world.poses())


@contextmanager
def changed(module: Any, **values: Any) -> Iterator[None]:
    """Change constants of a module for a while."""
    before = {name: getattr(module, name) for name in values}
    vars(module).update(values)
    try:
        yield
    finally:
        vars(module).update(before)


SUBJECTS: dict[str, Callable[[], Any]] = {
    **{name: experiment(name) for name in experiments.EXPERIMENTS},
    "beyond": beyond,
    "benchmarks": benchmarks,
    "measured": measured,
    "replayed": replayed,
    "rig": rig,
    "referee": referee,
    **({"called": commands} if importlib.util.find_spec("mujoco") else {}),
}
"""Name of a file -> function that computes what it holds."""
