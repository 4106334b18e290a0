"""`planarfriction measured`: compare models on measured data."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from planarfriction import validation
from planarfriction.cli import INTERRUPTED, output
from planarfriction.cli.console import note, print_table, work_progress
from planarfriction.cli.options import load_function
from planarfriction.errors import InvalidValueError
from planarfriction.writing import make_folder, write_text


def show_list() -> None:
    """Print the models of the library and the tasks."""
    from planarfriction_studies.measured.library import LIBRARY
    from planarfriction_studies.measured.tasks import TASKS

    rows = [[name, entry.words, "" if entry.installed else f"[{entry.extra}]"] for name, entry in LIBRARY.items()]
    print_table("Models", ["name", "description", "needs"], rows)
    print_table("Tasks", ["name", "description"], [[task.name, task.title] for task in TASKS.values()])


def measured(
    tasks: Sequence[str],
    only: Sequence[str],
    own: Sequence[str],
    *,
    tables: Path | None,
    folder: Path | None,
    seed: int,
    as_json: bool,
) -> int:
    """Compare, show and write; returns the exit code. An interrupt keeps the models that are done."""
    from planarfriction_studies.measured import TASKS, Benchmark
    from planarfriction_studies.measured.library import LIBRARY

    validation.count("--seed", seed, 0)
    left_out: list[str] = []
    models = _library(only, left_out) if only or not own else {}
    for entry in own:
        name, model = load_function("--own", entry)
        if name in models or name in LIBRARY:
            raise InvalidValueError("--own", "have a name that differs from those of the library's models", name)
        models[name] = model
    if folder is not None:
        make_folder(folder)
    benchmark = Benchmark(models, tasks or tuple(TASKS), tables, seed)
    benchmark.left_out += left_out
    code = 0
    try:
        with work_progress("measured") as progress:
            benchmark.run(progress)
    except KeyboardInterrupt:
        done = sum(map(len, benchmark.results.values()))
        note(f"interrupted: {done} of {len(models) * len(benchmark.tasks)} results are finished")
        code = INTERRUPTED
    show(benchmark, as_json)
    if folder is not None and benchmark.results:
        write(benchmark, folder)
    return code


def _library(only: Sequence[str], left_out: list[str]) -> dict[str, Any]:
    from planarfriction_studies.measured.benchmark import library
    from planarfriction_studies.measured.library import LIBRARY

    chosen = [validation.choice("--only", name, LIBRARY) for name in only] or list(LIBRARY)
    there = library(left_out)
    return {name: there[name] for name in chosen if name in there}


def show(benchmark: Any, as_json: bool) -> None:
    """Print the tables, or JSON."""
    from planarfriction_studies.measured.report import table, to_dict
    from planarfriction_studies.measured.tasks import TASKS

    if as_json:
        print(json.dumps(to_dict(benchmark), indent=1))
        return
    for name in benchmark.results:
        cases = next(iter(benchmark.results[name].values())).scores
        counts = sum(each.cases for each in cases.values()) if name != "slides" else next(iter(cases.values())).cases
        print_table(
            f"{TASKS[name].title} ({counts} {'tosses' if name == 'slides' else 'tests'})", *table(benchmark, name)
        )
        for model, result in benchmark.results[name].items():
            if result.fitted:
                for key, value in result.checked.items():
                    note(f"{model}: {key} {value:.3g}")
                note(f"{model}, fitted: {', '.join(f'{key} {value:.4g}' for key, value in result.fitted.items())}")
    for text in benchmark.left_out:
        note(f"left out: {text}")


def write(benchmark: Any, folder: Path) -> None:
    """Write JSON and pictures."""
    from planarfriction_studies.measured.figures import draw
    from planarfriction_studies.measured.report import to_dict

    path = folder / "measured.json"
    write_text(path, json.dumps(to_dict(benchmark), indent=1) + "\n")
    note(f"wrote {path}")
    for name in benchmark.results:
        note(f"wrote {output.write_picture(draw(benchmark, name), folder / f'measured-{name}.png')}")
