"""`planarfriction run`: simulate a scene with one or several models, compare, write files and draw."""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import planarfriction as pf
from planarfriction._support import validation
from planarfriction._support.writing import make_folder
from planarfriction.cli import INTERRUPTED, output
from planarfriction.cli.console import note, print_table, simulation_progress
from planarfriction.cli.options import WIDTH, find_patch
from planarfriction.errors import InvalidValueError, SimulationInterrupted, SolverError
from planarfriction.families import MODELS, SCENES

FINISHED = "success"
"""Status of a simulation that ran until its last time."""


def comparison(solutions: Mapping[str, pf.Solution]) -> list[list[str]]:
    """Return rows of text for a table with one column for each solution; differences are those from the first."""
    from planarfriction._support.shown import unit_for

    every = list(solutions.values())
    ends = {name: [_last(each, name) for each in every] for name in ("x", "y", "theta")}
    length = unit_for("length", ends["x"], ends["y"])
    angle = unit_for("angle", ends["theta"])
    units = {"x": length, "y": length, "angle": angle}
    rows = [
        [
            f"final {called} [{unit.label}]",
            *(f"{unit.factor * end:.5g}" for end in each),
        ]
        for (called, unit), each in zip(units.items(), ends.values(), strict=True)
    ]
    if len(every) > 1:
        off = [largest_differences(each, every[0]) for each in every[1:]]
        ways = (f"{1e3 * way:.4g}" for way, _ in off)
        angles = (f"{np.degrees(angle):.4g}" for _, angle in off)
        rows += [
            ["largest difference, position [mm]", "", *ways],
            ["largest difference, angle [deg]", "", *angles],
        ]
    statistics = [each.statistics for each in every]
    rows += [
        ["simulated time [s]", *(f"{_last(each, 'time'):g}" for each in every)],
        ["steps", *(f"{each.steps}" for each in statistics)],
        ["rejected steps", *(f"{each.rejections}" for each in statistics)],
        ["wall time [s]", *(f"{each.wall_time:.3g}" for each in statistics)],
        ["times faster than real time", *(_speed(each) for each in every)],
    ]
    if any(each.compile_time > 0.1 for each in statistics):
        times = (f"{each.compile_time:.3g}" for each in statistics)
        rows.append(["loading or compiling the solver [s]", *times])
    if any(each.status != FINISHED for each in every):
        rows.append(["ended", *(each.status for each in every)])
    return rows


def largest_differences(
    solution: pf.Solution, reference: pf.Solution
) -> tuple[float, float]:
    """Return the largest differences of position [m] and angle [rad] over the time that both solutions cover."""
    time = reference.histories["time"].values
    own = solution.histories["time"].values
    time = time[time <= own[-1]]
    dx, dy, dtheta = (
        np.interp(time, own, solution.histories[name].values)
        - reference.histories[name].values[: len(time)]
        for name in ("x", "y", "theta")
    )
    return np.hypot(dx, dy).max(), np.abs(dtheta).max()


def _last(solution: pf.Solution, name: str) -> float:
    return float(solution.histories[name].values[-1])


def _speed(solution: pf.Solution) -> str:
    wall = solution.statistics.wall_time
    return f"{_last(solution, 'time') / wall:.3g}" if wall > 0.0 else ""


SLIDE_SAMPLING = 1e-3
"""Time between samples of the free slide [s], which lasts a tenth of a second."""

BOTH = ("distributed", "reduced")
"""Models that "both" stands for."""


class Usual(NamedTuple):
    """Patch and law of a ready scene."""

    width: float = WIDTH
    """Width of a patch given by its name [m]."""
    patch: Callable[[], pf.ContactPatch] | None = None
    """Makes the patch; None for a disc."""
    law: Callable[[], pf.LuGre] = lambda: pf.LuGre(
        mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.9)
    )
    """Makes the law; that of the published experiments."""


_USUAL = {
    "drift": Usual(width=0.05),  # as published
    # a soft finger on a disc that it fills at 8 N: Hertz contact, of radius 6 mm at 1 N
    "pivot": Usual(
        width=0.024,
        patch=lambda: pf.ContactPatch.disc(
            0.012, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0, radius_max=0.012)
        ),
    ),
    "foot": Usual(width=0.06),
    # the ring that a curling stone stands on; granite on pebbled ice: bristles of 0.1 um, no viscous friction at cm/s
    "curling": Usual(
        width=0.13,
        patch=lambda: pf.ContactPatch.ring(0.0585, 0.0645),
        law=lambda: pf.LuGre(mu_c=0.01, sigma_0=1e5, sigma_1=10.0, sigma_2=0.0),
    ),
}
"""Patches and laws of ready scenes that have not those of most."""


def build_scenes(
    name: str,
    models: Sequence[str],
    *,
    settings: Mapping[str, Any] | None = None,
    **options: Any,
) -> dict[str, pf.Scene]:
    """Return the scenes to simulate, by the label of their model, with the values of `settings` by their paths."""
    makers = scene_makers(name, models, **options)
    scenes = {kind: make(**(settings or {})) for kind, make in makers.items()}
    return {kind or _label(scene): scene for kind, scene in scenes.items()}


def scene_makers(
    name: str,
    models: Sequence[str],
    *,
    cells: int | None = None,
    patch: str | None = None,
    size: Mapping[str, Any] | None = None,
    t_end: float | None = None,
) -> dict[str, Callable[..., pf.Scene]]:
    """Return functions that make the scenes of some values, by the kind of their model; "" for the file's own."""
    if t_end is not None:
        validation.positive("--t-end", t_end)
    kinds = [kind for each in models for kind in (BOTH if each == "both" else [each])]
    from_file = Path(name).suffix.lower() in (".toml", ".json")
    if not kinds and not from_file:
        kinds = BOTH if name == "in-hand" else ["distributed"]
    makes = {kind: MODELS[kind] for kind in kinds}
    if makes:
        _check_cells(cells, makes.values())
    if from_file:
        from planarfriction.sweeps.settings import Settable

        make = Settable(name)
        if patch is None and size:
            first, value = next(iter(size.items()))
            raise InvalidValueError(
                f"--{first.replace('_', '-')}", "be given only with --patch", value
            )
        below = None if patch is None else find_patch(patch, size or {})
        if not kinds and below is None and cells is None:
            return {"": make}
        return {
            kind: functools.partial(_with_models, make, kind, below, cells)
            for kind in kinds or [""]
        }
    validation.choice("scene", name, [*SCENES, "a scene file (.toml, .json)"])
    of_scene = _USUAL.get(name, Usual())
    if patch is None and not size and of_scene.patch is not None:
        contact_patch = of_scene.patch()
    else:
        contact_patch = find_patch(patch, size or {}, of_scene.width)
    law = of_scene.law()
    options: dict[str, Any] = {} if t_end is None else {"t_end": t_end}
    if name == "free-slide":
        options["save_every"] = SLIDE_SAMPLING
    found = {}
    for kind, make in makes.items():
        model = make(contact_patch, law, **_cells(make, cells))
        found[kind] = functools.partial(_ready, SCENES[name], model, options)
    return found


def _ready(
    make: Callable[..., pf.Scene], model: Any, options: dict[str, Any], /, **values: Any
) -> pf.Scene:
    """Make a ready scene: values that its function takes, such as `mass`, go there, the others to what it returns."""
    from planarfriction.sweeps.settings import Settable

    own = [name for name in inspect.signature(make).parameters if name != "model"]
    given = {name: values.pop(name) for name in own if name in values}
    scene = make(model, **options | given)
    return Settable(scene, own)(**values) if values else scene


def one_each(settings: Sequence[str]) -> dict[str, Any]:
    """Parse the values of `--set path=value`, by path."""
    if not settings:
        return {}
    from planarfriction.sweeps.settings import parse_all

    several = parse_all(settings)
    for path, values in several.items():
        if len(values) > 1:
            raise InvalidValueError(
                f"--set {path}",
                "be one value (planarfriction sweep takes several)",
                ", ".join(map(str, values)),
            )
    return {path: next(iter(values.values())) for path, values in several.items()}


def _cells(make: Any, cells: int | None) -> dict[str, int]:
    """Return the number of cells as an argument of a class of models, if it is given and these stand on one."""
    takes = "cells" in inspect.signature(make).parameters
    return {} if cells is None or not takes else {"cells": cells}


def _check_cells(cells: int | None, makes: Iterable[Any]) -> None:
    if cells is None:
        return
    validation.count("--cells", cells)
    if not any(_cells(make, cells) for make in makes):
        kinds = ", ".join(kind for kind, make in MODELS.items() if _cells(make, cells))
        raise InvalidValueError(
            "--cells",
            f"be given only for a model that has a number of cells ({kinds})",
            cells,
        )


def _label(scene: pf.Scene) -> str:
    """Return the kind of model that all contacts of a scene have, or "mixed"."""
    kinds = {MODELS.name_of(contact.model) for contact in scene.contacts}
    return (kinds.pop() if len(kinds) == 1 else None) or "mixed"


def _with_models(
    make_scene: Callable[..., pf.Scene],
    kind: str,
    patch: pf.ContactPatch | None,
    cells: int | None,
    /,
    **values: Any,
) -> pf.Scene:
    """Make a scene of some values with models of one kind on its own patches or on `patch`, laws as they are.

    The kind is "" for each as it is; `cells` goes to models that have a number of them.
    """
    scene = make_scene(**values)
    if not kind:
        _check_cells(cells, [type(contact.model) for contact in scene.contacts])
    contacts = []
    for contact in scene.contacts:
        model = contact.model
        make = MODELS[kind] if kind else type(model)
        if patch is not None or make is not type(model):
            wanted = getattr(model, "cells", None) if cells is None else cells
            below = model.patch if patch is None else patch
            model = make(below, model.law, **_cells(make, wanted))
        elif given := _cells(make, cells):
            model = dataclasses.replace(model, **given)
        contacts.append(dataclasses.replace(contact, model=model))
    return dataclasses.replace(scene, contacts=tuple(contacts))


def run(
    name: str,
    *,
    model: Sequence[str],
    settings: Sequence[str],
    rtol: float | None,
    t_end: float | None,
    max_steps: int | None,
    folder: Path | None,
    pictures: Sequence[str],
    **options: Any,
) -> int:
    """Simulate each scene, save as soon as it is done, print the comparison, draw; returns the exit code."""
    from planarfriction.scenes import simulate

    scenes = build_scenes(
        name, model, settings=one_each(settings), t_end=t_end, **options
    )
    limits: dict[str, Any] = {} if t_end is None else {"t_end": t_end}
    if rtol is not None:
        limits["rtol"] = validation.positive("--rtol", rtol)
    if max_steps is not None:
        limits["max_steps"] = validation.count("--max-steps", max_steps)
    if folder is not None:
        make_folder(folder)
    solutions: dict[str, pf.Solution] = {}
    try:
        for label, scene in scenes.items():
            with simulation_progress(
                label, limits.get("t_end", scene.t_end)
            ) as progress:
                solutions[label] = simulate(scene, progress=progress, **limits)
            _save(solutions[label], folder, label)
    except SimulationInterrupted as stop:
        return _keep_part(stop.solution, solutions, label, folder)
    except SolverError as error:
        if error.solution is not None:
            _keep_part(error.solution, solutions, label, folder)
        raise
    _print(solutions)
    if folder is not None and pictures:
        _draw(solutions, folder, pictures)
    return 0


def _keep_part(
    part: pf.Solution,
    solutions: dict[str, pf.Solution],
    label: str,
    folder: Path | None,
) -> int:
    note(f"stopped at t = {part.histories['time'].values[-1]:g} s of the {label} run")
    solutions[label] = part
    _save(part, folder, label)
    _print(solutions)
    return INTERRUPTED


def _save(solution: pf.Solution, folder: Path | None, label: str) -> None:
    if folder is not None:
        for path in output.write_solution(solution, folder, label):
            note(f"wrote {path}")


def _print(solutions: dict[str, pf.Solution]) -> None:
    name = next(iter(solutions.values())).scene.name
    print_table(name, ["", *solutions], comparison(solutions))


def _draw(
    solutions: dict[str, pf.Solution], folder: Path, pictures: Sequence[str]
) -> None:
    """Draw the histories of all runs, the motion of each, and the patch; animate each."""
    from planarfriction import plots

    first = next(iter(solutions.values()))
    name = output.slug(first.scene.name)
    if "plot" in pictures:
        with simulation_progress("drawing", 1.0):
            figures = {"histories": plots.plot_histories(solutions)}
            for label, solution in solutions.items():
                figures[f"motion-{output.slug(label)}"] = plots.plot_motion(solution)
            contact = first.scene.contacts[0]
            load = float(contact.normal_force(0.0))
            patch = contact.model.patch
            figures["patch"] = plots.plot_patch(patch, normal_force=load)
            for stem, figure in figures.items():
                path = folder / f"{name}-{stem}.png"
                note(f"wrote {output.write_picture(figure, path)}")
    if "animate" in pictures:
        for label, solution in solutions.items():
            path = folder / f"{name}-motion-{output.slug(label)}.gif"
            end = _last(solution, "time")
            with simulation_progress(f"drawing {path.name}", end) as progress:
                solution.animate(path, progress=progress)
            note(f"wrote {path}")
