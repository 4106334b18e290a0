"""Limit surface in three dimensions, next to another one: as a picture, or interactive."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps

import planarfriction as pf
from planarfriction import geometry
from planarfriction._support import validation
from planarfriction.errors import needing
from planarfriction.families import SURFACES
from planarfriction.plots import style

POLAR_SEGMENTS = 90
"""Mesh of the direction sphere from pole to pole: fine enough that the facets of a 21 x
21 patch look as they are."""

AZIMUTH_SEGMENTS = 180
"""Mesh of the direction sphere, around."""

_AXES = ("fx [-]", "fy [-]", "τ/r [-]")

_UNDER_THE_POINTER = (
    "fx %{x:.4f}<br>fy %{y:.4f}<br>τ/r %{z:.4f}<br><br>sliding along<br>"
    "vx %{customdata[0]:.3f}<br>vy %{customdata[1]:.3f}<br>r ω %{customdata[2]:.3f}<extra></extra>"
)

_LIGHT = np.array([0.35, -0.6, 0.72])


def sample_limit_surface(
    surface: Any, polar: np.ndarray, azimuth: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return twists in the directions of a sphere and their wrenches for mu f_N = 1, about the contact frame's origin.

    The directions are the unit sphere of scaled twists at the centre of pressure,
    `(vx, vy, r omega) = (sin p cos a, sin p sin a, cos p)`; `polar` and `azimuth` [rad] broadcast to `[...]`, the
    results have shape `[..., 3]` [m/s, m/s, rad/s] and [1, 1, m].
    """
    z = np.cos(polar)
    # sin(pi) is not quite 0, and a spin about a cell must be exact
    sine = np.where(np.abs(z) < 1.0, np.sin(polar), 0.0)
    x, y, z = np.broadcast_arrays(sine * np.cos(azimuth), sine * np.sin(azimuth), z)
    twists = geometry.twist_at(
        np.stack([x, y, z / surface.contact_radius], -1), -surface.centre_of_pressure
    )
    return twists, surface.wrench(twists)


def plot_limit_surface(
    surface: Any, *, beside: Any = "ellipsoid", size: Any = None, ax: Any = None
) -> style.PlotFigure:
    """Draw the limit surface (fx, fy, tau/r) for mu f_N = 1 about the centre of pressure, next to another one.

    `surface` is any limit surface; `beside` another one, "ellipsoid" for that of the same patch, or None to draw
    `surface` alone. Both panels have the same limits and colours, for the height tau/r. All axes are dimensionless.
    `size` is the width and the height of the figure [inch]; `ax` are axes of three dimensions (`projection="3d"`) to
    draw `surface` alone into.

    Raises InvalidValueError unless both are limit surfaces, and for a wrong size or axes.
    """
    if ax is not None:
        style.check_axes("ax", ax, size, three=True)
        beside = None
    names, scaled, limit = _sampled(surface, beside)
    if ax is None:
        figure = style.new_figure(4.4 * len(names), 4.3, size)
        drawn = figure.subplots(
            1, len(names), squeeze=False, subplot_kw={"projection": "3d"}
        )[0]
    else:
        figure = ax.figure
        drawn = [ax]
    for axes, name, (directions, mesh) in zip(drawn, names, scaled, strict=True):
        draw_surface(axes, mesh, directions, limit)
        axes.set_title(style.wrapped(name, 30), fontsize="medium")
    return figure


def interactive_limit_surface(surface: Any, *, beside: Any = "ellipsoid") -> Any:
    """Return the picture of `plot_limit_surface` as a plotly figure, to rotate, zoom and read with the mouse.

    `.show()` opens it in the browser, `.write_html(path)` writes it. The label at the pointer shows the friction wrench
    and the direction of sliding that belongs to it.

    Raises MissingExtraError without plotly, the extra `[plotly]`, and InvalidValueError unless both are limit surfaces.
    """
    names, scaled, limit = _sampled(surface, beside)
    with needing("plotly", "plotly"):
        from plotly import graph_objects as go
        from plotly.subplots import make_subplots
    figure = make_subplots(
        cols=len(names), specs=[[{"type": "scene"}] * len(names)], subplot_titles=names
    )
    for column, (directions, mesh) in enumerate(scaled):
        points = dict(zip("xyz", np.moveaxis(mesh, -1, 0), strict=True))
        # The page reads arrays of two dimensions alone.
        points["customdata"] = np.round(directions, 6).tolist()
        drawn = go.Surface(
            **points,
            hovertemplate=_UNDER_THE_POINTER,
            colorscale="Cividis",
            showscale=False,
            cmin=-limit,
            cmax=limit,
        )
        figure.add_trace(drawn, row=1, col=column + 1)
    scene: dict[str, Any] = {
        "aspectmode": "cube",
        "camera": {"eye": {"x": 1.5, "y": -2.2, "z": 1.0}},
    }
    for name, text in zip("xyz", _AXES, strict=True):
        scene[f"{name}axis"] = {"range": [-limit, limit], "title": {"text": text}}
    figure.update_scenes(scene)
    title = {"text": "Limit surface, μ f<sub>N</sub> = 1", "x": 0.5}
    figure.update_layout(margin={"l": 0, "r": 0, "t": 60, "b": 0}, title=title)
    return figure


def _sampled(
    surface: Any, beside: Any
) -> tuple[list[str], list[tuple[np.ndarray, np.ndarray]], float]:
    """Return titles and `scaled_samples` of the surfaces to draw, and the limit of the axes."""
    validation.instance(
        "surface", surface, pf.limit_surface.LimitSurface, "a limit surface"
    )
    shown = {f"{surface.patch.name}: {kind_of(surface)}": surface}
    if beside is not None:
        if isinstance(beside, str) and beside == "ellipsoid":
            beside = pf.LimitSurfaceEllipsoid(
                surface.patch, normal_force=surface.normal_force
            )
        words = 'a limit surface, "ellipsoid" or None'
        validation.instance("beside", beside, pf.limit_surface.LimitSurface, words)
        shown[kind_of(beside)] = beside
    scaled = [scaled_samples(each, *even_mesh(each)) for each in shown.values()]
    return [*shown], scaled, 1.05 * max(float(np.abs(mesh).max()) for _, mesh in scaled)


def even_mesh(surface: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the polar angles `[P, 1]` and azimuths `[1, A]` [rad] that lie close where the surface bends little.

    There points are far apart for a small turn of the twist, as about a pad: facets of even angles would show.
    """
    polar = np.linspace(0.0, np.pi, POLAR_SEGMENTS + 1)
    azimuth = np.linspace(0.0, 2 * np.pi, AZIMUTH_SEGMENTS + 1)
    for _ in range(2):  # the second time with what lay between the points of the first
        _, points = scaled_samples(surface, polar[:, None], azimuth[None, :])
        down, around = (
            np.linalg.norm(np.diff(points, axis=axis), axis=-1).max(axis=1 - axis)
            for axis in (0, 1)
        )
        polar = _evened(polar, down)
        azimuth = _evened(azimuth, around)
    return polar[:, None], azimuth[None, :]


def _evened(angles: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return as many angles, by half spread evenly along the `steps` between them and by half as they are."""
    way = steps / steps.sum() + np.diff(angles) / (angles[-1] - angles[0])
    place = np.append(0.0, np.cumsum(way))
    return np.interp(np.linspace(0.0, place[-1], len(angles)), place, angles)


def scaled_samples(
    surface: Any, polar: np.ndarray, azimuth: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return directions `(vx, vy, r omega)` and points `(fx, fy, tau/r)` of a surface at the centre of pressure.

    Both are pure numbers of shape `[..., 3]`; the directions have length 1.
    """
    twists, wrenches = sample_limit_surface(surface, polar, azimuth)
    scale = np.array([1.0, 1.0, surface.contact_radius])
    centre = surface.centre_of_pressure
    return geometry.twist_at(twists, centre) * scale, geometry.wrench_at(
        wrenches, centre
    ) / scale


def kind_of(surface: Any) -> str:
    """Return the words for the kind of a surface."""
    name = SURFACES.name_of(surface)
    return (name and SURFACES.words(name)) or type(surface).__name__


def _of_facets(values: np.ndarray) -> np.ndarray:
    """Return the mean of `values` `[P, A, ...]` over the four corners of each facet."""
    pairs = values[:-1] + values[1:]
    return 0.25 * (pairs[:, :-1] + pairs[:, 1:])


def draw_surface(
    axes: Any, mesh: np.ndarray, directions: np.ndarray, limit: float
) -> Any:
    """Draw a limit surface, points `mesh` `[P, A, 3]` with their `directions`, into 3-D axes up to `limit`."""
    # The outward normal of a limit surface is the twist itself: shading needs no differences of the mesh.
    light = _LIGHT / np.linalg.norm(_LIGHT)
    lightness = 0.62 + 0.38 * np.clip(-_of_facets(directions) @ light, -0.6, 1.0)
    height = _of_facets(mesh[..., 2])
    colours = colormaps["cividis"](0.6 + 0.4 * height / limit)
    colours[..., :3] *= lightness[..., None]
    drawn = axes.plot_surface(
        *np.moveaxis(mesh, -1, 0),
        facecolors=colours,
        rstride=1,
        cstride=1,
        linewidth=0,
        antialiased=False,
        shade=False,
        rasterized=True,  # thousands of facets
    )
    narrow = style.axes_width(axes) < 0.5 * style.NARROW
    ticks = [-1.0, 0.0, 1.0] if narrow else [-1.0, -0.5, 0.0, 0.5, 1.0]
    for name, label in (("x", "$f_x$"), ("y", "$f_y$"), ("z", "$\\tau/r$")):
        look = {"lim": (-limit, limit), "ticks": ticks, "label": f"{label} [-]"}
        axes.set(**{f"{name}{key}": value for key, value in look.items()})
        getattr(axes, f"{name}axis").labelpad = -6.0 if narrow else 4.0
    axes.tick_params(labelsize="x-small" if narrow else "small")
    if narrow:
        axes.tick_params(pad=0)
    axes.set_box_aspect((1.0, 1.0, 1.0), zoom=0.75 if narrow else 0.9)
    axes.view_init(elev=22, azim=-55)
    return drawn
