"""Notebook views of records: a small picture and a few numbers beside it."""

from __future__ import annotations

import base64
import dataclasses
import html
import io
from typing import Any

import numpy as np

import planarfriction as pf
from planarfriction._support.shown import unit_for
from planarfriction.errors import FrictionError
from planarfriction.identify.parameters import LAW
from planarfriction.patch.grid import grid_sides
from planarfriction.plots import style
from planarfriction.plots.limit_surface import scaled_samples
from planarfriction.plots.motion import draw_motion
from planarfriction.scenes.solution import columns_of

_LOAD = 1.0
"""Load [N] at which a patch is shown whose shape depends on it."""

_SPEEDS = 5.0
"""Speeds of the picture of a law, over its v_s."""

_DIRECTIONS = 120
"""Twists whose wrenches make the section of a limit surface."""


def patch_html(patch: pf.ContactPatch) -> str:
    """Return a thumbnail of the pressure, cells, size, contact radius and centre of pressure of a patch."""
    load = _LOAD if patch.depends_on_load else None
    rows = {"cells": f"{patch.cells}", "size": _size(patch)}
    if (figure := _pressure(patch, load)) is not None:
        rows["contact radius"] = _length(float(patch.contact_radius(load)))
        rows["centre of pressure"] = _point(patch.centre_of_pressure(load))
    if load is not None:
        rows["shown at"] = f"{load:g} N"
    return _beside(figure, f"ContactPatch {patch.name!r}", rows)


def surface_html(surface: pf.limit_surface.LimitSurface) -> str:
    """Return a section of the limit surface through force along x and torque, its patch and its contact radius."""
    rows = {"patch": f"{surface.patch.name!r} of {surface.patch.cells} cells"}
    figure = None
    try:
        rows["contact radius"] = _length(surface.contact_radius)
        rows["centre of pressure"] = _point(surface.centre_of_pressure)
        rows["section"] = "fx across, τ/r up, per µ f_N"
        figure = _section(surface)
    except FrictionError:  # no load for a shape that depends on it
        rows["shape"] = "depends on the load: give a normal_force"
    return _beside(figure, type(surface).__name__, rows)


def law_html(law: Any) -> str:
    """Return the friction of steady sliding over the speed, with the parameters of a law."""
    names = [each.name for each in dataclasses.fields(law)]
    rows = {
        name: _parameter(name, value)
        for name in names
        if (value := getattr(law, name)) is not None
    }
    figure = style.new_figure(1.8, 1.2)
    axes = figure.add_subplot()
    speed = np.linspace(0.0, _SPEEDS * law.numbers.v_s, 200)
    axes.plot(
        1e3 * speed, law.steady_friction(speed), color=style.REDUCED, linewidth=1.5
    )
    axes.set(xlabel="mm/s", ylabel="f/f_N", ylim=(0.0, None))
    return _beside(figure, type(law).__name__, rows)


def model_html(model: Any) -> str:
    """Return the pressure of the patch of a model, with its law and its state."""
    figure = _pressure(model.patch, _LOAD if model.patch.depends_on_load else None)
    rows = {
        "patch": f"{model.patch.name!r} of {model.patch.cells} cells",
        "law": repr(model.law),
        "state": f"{list(model.state_shape)} [{model.state_units}]",
    }
    return _beside(figure, type(model).__name__, rows)


def scene_html(scene: pf.Scene) -> str:
    """Return the body, the contacts and the duration of a scene, with the pressure of its first contact."""
    rows = {
        "duration": f"{scene.t_end:g} s, from {scene.start}",
        "body": f"{scene.body.mass:g} kg, {scene.body.inertia:.3g} kg m²",
    }
    rows |= {
        f"contact {each.name!r}": repr(each).partition(": ")[2].rstrip(")")
        for each in scene.contacts
    }
    patch = scene.contacts[0].model.patch
    figure = None if patch.depends_on_load else _pressure(patch, None)
    return _beside(figure, f"Scene {scene.name!r}", rows)


def solution_html(solution: pf.Solution) -> str:
    """Return a drawing of the motion of the body, with the end and the cost of the run."""
    time = solution.histories["time"].values
    x, y, theta = columns_of(solution, "x", "y", "theta")[-1]
    cost = solution.statistics
    rows = {
        "status": f"{solution.status}: {solution.message}",
        "samples": f"{len(time)}, to {float(time[-1]):g} s",
        "end": f"{_point((x, y))}, rotated by {np.degrees(theta):.2f} deg",
        "cost": f"{cost.steps} steps, {1e3 * cost.wall_time:.3g} ms",
    }
    figure = None
    title = "Solution"
    if solution.scene is not None:
        title = f"Solution {solution.scene.name!r}"
        figure = style.new_figure(4.0, 3.0)
        draw_motion(figure, solution)
    return _beside(figure, title, rows)


def _pressure(patch: pf.ContactPatch, load: float | None) -> style.PlotFigure | None:
    try:
        weights = patch.weights(load)
    except FrictionError:  # a shape that there is not at this load
        return None
    figure = style.new_figure(1.5, 1.5)
    axes = figure.add_subplot()
    if patch.grid is None:
        axes.scatter(
            *patch.positions.T,
            s=60 * weights / weights.max(),
            c=weights,
            cmap=style.PRESSURE_MAP,
        )
        axes.margins(0.3)
    else:
        grid = patch.grid
        pixels = np.full((grid.rows, grid.columns), np.nan)
        shares = 1.0 if patch.point_shares is None else patch.point_shares
        pixels[grid.locate(patch.positions)] = weights / (patch.areas * shares)
        width, height = grid_sides(grid)
        axes.imshow(
            pixels,
            cmap=style.PRESSURE_MAP,
            vmin=0.0,
            extent=(0.0, width, 0.0, height),
            interpolation="nearest",
        )
    axes.set(aspect="equal")
    axes.set_axis_off()
    return figure


def _section(surface: pf.limit_surface.LimitSurface) -> style.PlotFigure:
    # From a slide along x on to a spin.
    around = np.linspace(0.5 * np.pi, -1.5 * np.pi, _DIRECTIONS + 1)
    fx, _, torque = scaled_samples(surface, around, np.zeros(1))[1].T
    figure = style.new_figure(1.5, 1.5)
    axes = figure.add_subplot()
    axes.plot(fx, torque, color=style.REDUCED, linewidth=1.5)
    for line in (axes.axhline, axes.axvline):
        line(0.0, color="0.8", linewidth=0.6, zorder=0)
    axes.set(aspect="equal")
    axes.set_axis_off()
    return figure


def _size(patch: pf.ContactPatch) -> str:
    # Points, lines.
    cell = patch.cell_size or (0.0, 0.0)
    if patch.grid is None or min(cell) == 0.0:
        width, height = np.ptp(patch.positions, axis=0) + cell
    else:
        width, height = grid_sides(patch.grid)
    unit = unit_for("length", max(width, height))
    return f"{unit.factor * width:.3g} x {unit.factor * height:.3g} {unit.label}"


def _parameter(name: str, value: Any) -> str:
    unit = LAW[name].unit if name in LAW else ""
    return (
        f"{value:g} {unit}".removesuffix(" -")
        if isinstance(value, (int, float))
        else f"{value}"
    )


def _length(value: float) -> str:
    unit = unit_for("length", value)
    return f"{unit.factor * value:.4g} {unit.label}"


def _point(point: Any) -> str:
    return f"({1e3 * float(point[0]):.2f}, {1e3 * float(point[1]):.2f}) mm".replace(
        "-0.00", "0.00"
    )


def _beside(figure: style.PlotFigure | None, title: str, rows: dict[str, str]) -> str:
    """Return a picture and a table in one row of HTML, all of it in one piece: nothing is loaded from elsewhere."""
    picture = ""
    if figure is not None:
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", dpi=96, bbox_inches="tight")
        data = base64.b64encode(buffer.getvalue()).decode()
        picture = f'<img alt="" src="data:image/png;base64,{data}">'
    cells = (
        [f'<td style="text-align:left">{html.escape(each)}</td>' for each in row]
        for row in rows.items()
    )
    lines = "".join(f"<tr>{''.join(each)}</tr>" for each in cells)
    look = 'style="color:inherit;font:inherit"'
    table = f"<div><b>{html.escape(title)}</b><table {look}>{lines}</table></div>"
    return (
        f'<div style="display:flex;align-items:center;gap:1em">{picture}{table}</div>'
    )
