"""Limit surface in three dimensions, with the ellipsoid beside it."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps

from planarfriction import geometry, validation
from planarfriction.families import SURFACES
from planarfriction.plots import style

POLAR_SEGMENTS, AZIMUTH_SEGMENTS = 90, 180
"""Mesh of the direction sphere: fine enough that the facets of a 21 x 21 patch look as they are."""

_LIGHT = np.array([0.35, -0.6, 0.72])


def sample_limit_surface(surface: Any, polar: np.ndarray, azimuth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Twists around the direction sphere and their wrenches for mu f_N = 1, about the contact frame's origin.

    The directions are the unit sphere of scaled twists at the centre of pressure,
    `(vx, vy, r omega) = (sin p cos a, sin p sin a, cos p)`; `polar` and `azimuth` [rad] broadcast to `[...]`, the
    results have shape `[..., 3]` [m/s, m/s, rad/s] and [1, 1, m].
    """
    z = np.cos(polar)
    sine = np.where(
        np.abs(z) < 1.0, np.sin(polar), 0.0
    )  # sin(pi) is not quite 0, and a spin about a cell must be exact
    x, y, z = np.broadcast_arrays(sine * np.cos(azimuth), sine * np.sin(azimuth), z)
    twists = geometry.twist_at(np.stack([x, y, z / surface.contact_radius], -1), -surface.centre_of_pressure)
    return twists, surface.wrench(twists)


def plot_limit_surface(surface: Any, *, ellipsoid: Any = None) -> style.PlotFigure:
    """Draw the limit surface (fx, fy, tau/r) for mu f_N = 1 about the centre of pressure, the ellipsoid beside it.

    `surface` is any limit surface; `ellipsoid` the one to compare with, by default `LimitSurfaceEllipsoid` of the same
    patch. Both panels share their limits and their colours, the height tau/r. All three axes are pure numbers.
    """
    from planarfriction.limit_surface import LimitSurface, LimitSurfaceEllipsoid

    validation.instance("surface", surface, LimitSurface, "a limit surface")
    beside = ellipsoid
    if beside is not None:
        validation.instance("ellipsoid", ellipsoid, LimitSurface, "a limit surface or None")
    else:
        beside = LimitSurfaceEllipsoid(surface.patch, normal_force=surface.normal_force)
    polar = np.linspace(0.0, np.pi, POLAR_SEGMENTS + 1)[:, None]
    azimuth = np.linspace(0.0, 2 * np.pi, AZIMUTH_SEGMENTS + 1)[None, :]
    scaled = [scaled_samples(each, polar, azimuth) for each in (surface, beside)]
    limit = 1.05 * max(float(np.abs(mesh).max()) for _, mesh in scaled)
    figure = style.new_figure(9.6, 4.8)
    names = (f"{surface.patch.name}: {_kind(surface)}", _kind(beside))
    for column, ((directions, mesh), name) in enumerate(zip(scaled, names, strict=True)):
        axes = figure.add_subplot(1, 2, column + 1, projection="3d")
        draw_surface(axes, mesh, directions, limit)
        axes.set_title(name, fontsize="medium")
    return figure


def scaled_samples(surface: Any, polar: np.ndarray, azimuth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions `(vx, vy, r omega)` and points `(fx, fy, tau/r)` of `sample_limit_surface` at the centre of pressure.

    Both are pure numbers of shape `[..., 3]`; the directions have length 1.
    """
    twists, wrenches = sample_limit_surface(surface, polar, azimuth)
    scale, centre = np.array([1.0, 1.0, surface.contact_radius]), surface.centre_of_pressure
    return geometry.twist_at(twists, centre) * scale, geometry.wrench_at(wrenches, centre) / scale


def _kind(surface: Any) -> str:
    name = SURFACES.name_of(surface)
    return (name and SURFACES.words(name)) or type(surface).__name__


def draw_surface(axes: Any, mesh: np.ndarray, directions: np.ndarray, limit: float, *, opacity: float = 1.0) -> Any:
    """Draw a limit surface, points `mesh` `[P, A, 3]` with their `directions`, into 3-D axes up to `limit`."""
    # The outward normal of a limit surface is the twist itself: shading needs no differences of the mesh.
    normal = -directions[:-1, :-1]
    lightness = 0.62 + 0.38 * np.clip(normal @ (_LIGHT / np.linalg.norm(_LIGHT)), -0.6, 1.0)
    colours = colormaps["cividis"](0.6 + 0.4 * mesh[:-1, :-1, 2] / limit)
    colours[..., :3] *= lightness[..., None]
    colours[..., 3] = opacity
    drawn = axes.plot_surface(
        *np.moveaxis(mesh, -1, 0), rstride=1, cstride=1, facecolors=colours, linewidth=0, antialiased=False, shade=False
    )
    ticks = [-1.0, -0.5, 0.0, 0.5, 1.0]
    for name, label in (("x", "$f_x$"), ("y", "$f_y$"), ("z", "$\\tau/r$")):
        axes.set(**{f"{name}lim": (-limit, limit), f"{name}ticks": ticks, f"{name}label": f"{label} [-]"})
    axes.tick_params(labelsize="small")
    axes.set_box_aspect((1.0, 1.0, 1.0), zoom=0.9)
    axes.view_init(elev=22, azim=-55)
    return drawn
