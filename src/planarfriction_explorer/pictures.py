"""Pictures of a state as plain arrays and tables, and its numbers as HTML: lengths in mm, surfaces without units."""

from __future__ import annotations

import html
from typing import Any

import numpy as np

from planarfriction import geometry
from planarfriction.errors import InvalidValueError
from planarfriction.limit_surface import LimitSurface, LimitSurfaceCells
from planarfriction.plots.limit_surface import scaled_samples
from planarfriction.plots.style import ELLIPSOID, REDUCED, REFERENCE
from planarfriction_explorer import looks
from planarfriction_explorer.drawing import Drawing
from planarfriction_explorer.state import Answer, State

MM = 1e3
"""Millimetres in a metre."""

ARROWS = 11
"""Most arrows of the slip field along a side."""

POLAR = 37
"""Points of the mesh of a limit surface from pole to pole."""

AZIMUTH = 73
"""Points of the mesh of a limit surface, around."""

RAYS = 121
"""Points of a section."""

LEAST = 1e-9
"""Friction, as a share of `mu_c f_N`, below which its direction is only rounding."""

REACH = 0.4
"""Length of the arrow of a force of mu_c f_N, as a share of the width of the map."""

COLOURS = {"friction": REDUCED, "surface": REFERENCE, "ellipsoid": ELLIPSOID}
"""Colour of each wrench, the same in all pictures."""


def pressure_image(drawing: Drawing) -> dict[str, list[Any]]:
    """Return the map as the columns of one image whose rows run from the bottom up [mm]."""
    width = MM * drawing.width
    height = MM * drawing.height
    peak = drawing.pressures.max(initial=0.0)
    shown = drawing.pressures[::-1] / (peak if peak > 0.0 else 1.0)
    image = np.where(shown > 0.0, shown, np.nan)  # what does not press is left white
    return {
        "image": [image],
        "x": [-width / 2],
        "y": [-height / 2],
        "dw": [width],
        "dh": [height],
    }


def slip_arrows(state: State) -> dict[str, list[float]]:
    """Return velocities of points that press, as arrows [mm] of which the fastest is as long as they are apart."""
    drawing = state.drawing
    rows, columns = drawing.pressures.shape
    step = int(np.ceil(max(rows, columns) / ARROWS))
    chosen = np.zeros((rows, columns), dtype=bool)
    chosen[(rows // 2) % step :: step, (columns // 2) % step :: step] = True
    points = drawing.grid.centres()[(chosen & (drawing.pressures > 0.0)).ravel()]
    velocity = geometry.twist_at(np.array(state.twist), points)[:, :2]
    fastest = np.hypot(*velocity.T).max(initial=0.0) or 1.0
    ends = points + step * drawing.cell_size * (velocity / fastest)
    return _arrows(points, ends)


def wrench_arrows(state: State, answer: Answer | None) -> dict[str, Any]:
    """Return forces of law, surface and ellipsoid as arrows from the centre of pressure [mm], one over the other."""
    if answer is None:
        return {
            **_arrows(np.zeros((0, 2)), np.zeros((0, 2))),
            "colour": [],
            "width": [],
        }
    start = np.tile(state.drawing.surface.centre_of_pressure, (3, 1))
    longest = REACH * max(state.drawing.width, state.drawing.height)
    return {
        **_arrows(start, start + longest * answer.points[:, :2]),
        "colour": list(COLOURS.values()),
        "width": [8, 5, 2],
    }


def _arrows(starts: np.ndarray, ends: np.ndarray) -> dict[str, list[float]]:
    """Return shafts, and angles [rad] of triangles at the tips, which point up at an angle of 0.

    Lists, since each array goes to the browser as a message of its own.
    """
    along = ends - starts
    names = zip(("x0", "y0", "x1", "y1"), [*starts.T, *ends.T], strict=True)
    angle = np.arctan2(along[:, 1], along[:, 0]) - np.pi / 2
    return {
        **{name: (MM * each).tolist() for name, each in names},
        "angle": angle.tolist(),
    }


def points_of_interest(state: State) -> dict[str, list[float]]:
    """Return the centre of rotation [mm], in no row where there is none."""
    centre = state.centre_of_rotation
    return (
        {"x": [], "y": []}
        if centre is None
        else {"x": [MM * centre[0]], "y": [MM * centre[1]]}
    )


def section(surface: LimitSurface, angle: float) -> np.ndarray:
    """Return points (force, torque) where a limit surface meets a plane, closed, `[M, 2]` [1, m], per unit `mu f_N`.

    The plane holds torques about the centre of pressure and forces in the direction `angle` [rad]. Its rays W meet the
    surface at `W/(-W . V)`, with V the twist of unit dissipation that `LimitSurface.twist` gives.
    """
    turn = np.linspace(0.0, 2.0 * np.pi, RAYS)
    points = np.stack([np.cos(turn), surface.contact_radius * np.sin(turn)], axis=1)
    rays = np.stack(
        [np.cos(angle) * points[:, 0], np.sin(angle) * points[:, 0], points[:, 1]],
        axis=1,
    )
    rays = geometry.wrench_at(rays, -surface.centre_of_pressure)
    return points / -np.einsum("ij,ij->i", rays, surface.twist(rays))[:, None]


def section_lines(
    state: State, answer: Answer, *, quick: bool = False
) -> tuple[float, dict[str, np.ndarray]]:
    """Return the direction [deg] of the friction, 0 without a force, and the sections there, `[M, 2]` [N, N mm].

    They are `surface`, `ellipsoid` and the single point `friction` of the law; `quick` as in `surface_figure`.
    """
    drawing = state.drawing
    (fx, fy, torque) = answer.points[0]
    force = np.hypot(fx, fy)
    angle = np.arctan2(fy, fx) if force > LEAST else 0.0
    lines = {
        "surface": section(_drawn(drawing, quick), angle),
        "ellipsoid": section(drawing.ellipsoid, angle),
    }
    lines["friction"] = np.array([[force, torque * drawing.surface.contact_radius]])
    strength = state.law.numbers.mu_c * state.normal_force
    return float(np.degrees(angle)), {
        name: strength * points * [1.0, MM] for name, points in lines.items()
    }


def _drawn(drawing: Drawing, quick: bool) -> LimitSurface:
    """Return the surface to draw: the smooth table, or a sum over the cells while a brush moves."""
    return LimitSurfaceCells(drawing.patch) if quick else drawing.table


def surface_figure(state: State, *, quick: bool = False) -> dict[str, Any]:
    """Return the limit surface and ellipsoid in 3-D with the wrenches of the state, as a plotly figure of plain tables.

    The surface is that of the smooth table of the patch. While a brush moves, `quick` takes a sum over the cells, which
    has lumps.
    """
    drawing = state.drawing
    surface = _drawn(drawing, quick)
    polar = np.linspace(0.0, np.pi, POLAR)[:, None]
    azimuth = np.linspace(0.0, 2.0 * np.pi, AZIMUTH)[None]
    mesh = scaled_samples(surface, polar, azimuth)[1]
    rings = _wires(scaled_samples(drawing.ellipsoid, polar[::6], azimuth)[1])
    spokes = _wires(
        np.swapaxes(scaled_samples(drawing.ellipsoid, polar, azimuth[:, ::6])[1], 0, 1)
    )
    shell = {
        "type": "surface",
        "name": "limit surface",
        **_coordinates(mesh),
        "surfacecolor": mesh[..., 2],
        "colorscale": [[0.0, "#5B9BC8"], [1.0, "#CFE3F1"]],
        "opacity": 0.45,  # the wrenches inside are seen
        "showscale": False,
        "showlegend": True,
        "hoverinfo": "skip",
    }
    wires = {
        "type": "scatter3d",
        "name": "ellipsoid",
        "mode": "lines",
        **_coordinates(np.concatenate([rings, spokes])),
        "line": {"color": COLOURS["ellipsoid"], "width": 2},
        "hoverinfo": "skip",
    }
    return {
        "data": [shell, wires, *(_marker(name, np.zeros(3)) for name in COLOURS)],
        "layout": _layout(),
    }


def moved(figure: dict[str, Any], answer: Answer) -> dict[str, Any]:
    """Return the figure of a limit surface with the wrenches of an answer; what has not changed is the same object."""
    markers = [
        _marker(name, point) for name, point in zip(COLOURS, answer.points, strict=True)
    ]
    return {**figure, "data": [*figure["data"][:2], *markers]}


def _wires(lines: np.ndarray) -> np.ndarray:
    """Join lines `[K, M, 3]` to one with gaps."""
    gaps = np.full((len(lines), 1, 3), np.nan)
    return np.concatenate([lines, gaps], axis=1).reshape(-1, 3)


def _coordinates(points: np.ndarray) -> dict[str, np.ndarray]:
    return {
        name: np.ascontiguousarray(each)
        for name, each in zip("xyz", np.moveaxis(points, -1, 0), strict=True)
    }


_NAMES = {
    "friction": "friction of the law",
    "surface": "on the limit surface",
    "ellipsoid": "on the ellipsoid",
}


def _marker(name: str, point: np.ndarray) -> dict[str, Any]:
    """Return a line from the middle to the wrench with a ball at its end."""
    return {
        "type": "scatter3d",
        "name": _NAMES[name],
        "mode": "lines+markers",
        **_coordinates(np.stack([np.zeros(3), point])),
        "line": {"color": COLOURS[name], "width": 6},
        "marker": {"color": COLOURS[name], "size": [0, 8]},
        "hovertemplate": "fx %{x:.4f}<br>fy %{y:.4f}<br>τ/r %{z:.4f}<extra></extra>",
    }


def _layout() -> dict[str, Any]:
    limit = 1.35  # room for what Stribeck and viscous terms add
    axes = {
        f"{name}axis": {"range": [-limit, limit], "title": {"text": text}}
        for name, text in zip("xyz", ("fx", "fy", "τ/r"), strict=True)
    }
    camera = {
        "eye": {"x": 1.7, "y": -2.3, "z": 1.05},
        "center": {"x": 0.0, "y": 0.0, "z": -0.12},
    }
    return {
        "scene": {**axes, "aspectmode": "cube", "camera": camera},
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
        "legend": {"orientation": "h", "y": 0, "itemsizing": "constant"},
        "uirevision": "kept",  # the view that was turned to stays
        "autosize": True,
    }


_ROWS = {
    "friction": "Friction, steady sliding",
    "surface": "Limit surface, μ<sub>c</sub> f<sub>N</sub>",
    "ellipsoid": "Ellipsoid",
}


def numbers_table(state: State, found: Answer, seconds: float) -> str:
    """Return the table of the wrenches, centre of rotation, power, and the error of the ellipsoid."""
    rows = "".join(
        f"<tr><td style='color:{COLOURS[name]}'><b>{text}</b></td>"
        + "".join(f"<td>{value:.4f}</td>" for value in _shown(found, name))
        + "</tr>"
        for name, text in _ROWS.items()
    )
    (force, angle) = state.drawing.largest_errors
    centre = state.centre_of_rotation
    where = (
        "none, no rotation"
        if centre is None
        else f"({1e3 * centre[0]:.2f}, {1e3 * centre[1]:.2f}) mm"
    )
    return (
        f"{looks.TABLE}<div id='answer'><table><tr><th></th><th>fx [N]</th><th>fy [N]</th><th>τ [N mm]</th></tr>{rows}"
        f"</table><p>Centre of rotation: {where}. Dissipated power: {1e3 * found.power:.4g} mW.</p>"
        f"<p>The ellipsoid is off by {found.force_error:.3f} of μ<sub>c</sub> f<sub>N</sub> in the wrench and by "
        f"{found.angle_error:.1f}° in the twist here; over all directions by up to {max(force, found.force_error):.3f} "
        f"and {max(angle, found.angle_error):.1f}°.</p><p><small>Answered in {1e3 * seconds:.1f} ms</small></p></div>"
    )


def holding_line(state: State) -> str:
    """Return a line that says whether two such contacts hold the part, and how hard each has to press."""
    try:
        needed = state.needed_load
    except InvalidValueError as error:
        return f"<p id='hold'>{html.escape(str(error))}.</p>"
    holds = (
        "holds"
        if state.normal_force > needed
        else "<span style='color:#C0392B'>slips</span>"
    )
    what = f"{1e3 * state.mass:g} g, {MM * state.lever:g} mm off-centre"
    return (
        f"<p id='hold'>Will it hold? A part ({what}) between two such contacts <b>{holds}</b>: each has to press with "
        f"<b>{needed:.3g} N</b>, and presses with {state.normal_force:g} N.</p>"
    )


def grid_line(state: State) -> str:
    """Return a line on what the cells of the map, and finer ones, cost against the continuous patch."""
    errors = state.drawing.grid_errors
    if errors is None:
        return "<p id='grid'>Errors of this grid of many cells: <code>patch.grid_error()</code>.</p>"
    return (
        f"<p id='grid'>Errors of a sum over the cells of this grid: {errors[0]}; <code>patch.refined(3)</code>: "
        f"{errors[1]}.</p>"
    )


def _shown(found: Answer, name: str) -> list[float]:
    """Return a wrench in N and N mm, without -0."""
    fx, fy, tau = getattr(found, name)
    return [round(each, 4) + 0.0 for each in (fx, fy, 1e3 * tau)]
