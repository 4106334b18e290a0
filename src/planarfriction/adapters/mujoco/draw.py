# pyright: reportAttributeAccessIssue=false
# (MuJoCo describes few of its names to type checkers.)
"""Patches drawn into a MuJoCo scene: outlines, friction (blue as in `plots`), centres of rotation (black)."""

from __future__ import annotations

import itertools
from typing import Any

import mujoco
import numpy as np

from planarfriction.errors import InvalidValueError
from planarfriction.patch import ContactPatch

OUTLINE = (0.3, 0.3, 0.3, 1.0)
"""Colour of an outline: red, green, blue, opacity."""

FRICTION = (0.0, 0.45, 0.7, 1.0)
"""Colour of a friction force."""

CENTRE = (0.0, 0.0, 0.0, 1.0)
"""Colour of a centre of rotation."""

STANDS = 1e-6
"""Speed of the rim [m/s] below which a patch turns about nothing: what sticks moves by rounding."""

FAR = 5.0
"""Sizes of the patch within which the centre of rotation is drawn; further off the patch slides."""

_CLOSING = 0.1
"""Gap between cells, of the side of a cell, that an outline does not show: cells cut by a rim are drawn smaller."""

_FINE = 0.01
"""Error of an outline that does not show, of the size of the patch."""


def outlines(patch: ContactPatch) -> list[np.ndarray]:
    """Return the rims of a patch, closed, `[M, 2]` [m] each: of its outline, else those around its cells."""
    import shapely

    if patch.outline is not None:
        outer, holes = patch.outline.rims()
        rims = [np.concatenate([rim, rim[:1]]) for rim in (outer, *holes)]
    else:
        half = 0.5 * np.sqrt(patch.areas)[:, None]
        gap = _CLOSING * float(np.sqrt(patch.areas.max()))
        cells = shapely.box(*(patch.positions - half).T, *(patch.positions + half).T)
        whole = shapely.union_all(
            shapely.buffer(cells, gap, join_style="mitre")
        ).buffer(-gap, join_style="mitre")
        rims = [
            shapely.get_coordinates(rim)
            for rim in shapely.get_parts(shapely.boundary(whole))
        ]
    error = _FINE * _size(patch)
    return [
        shapely.get_coordinates(shapely.LineString(rim).simplify(error)) for rim in rims
    ]


def draw_patch(
    scene: Any,
    patch: ContactPatch,
    frame: tuple[np.ndarray, np.ndarray],
    wrench: np.ndarray,
    twist: np.ndarray,
    newton: float,
    scale: float = 1.0,
) -> None:
    """Add the patch, `scale` times as large, with its origin [3] and axes [3, 3] as rows in the world.

    A newton is drawn as `newton` [m].

    Raises `InvalidValueError` where the scene has no room for more geoms.
    """
    origin, axes = frame
    size = scale * _size(patch)
    for rim in outlines(patch):
        corners = origin + scale * rim @ axes[:2]
        for start, end in itertools.pairwise(corners):
            _connect(
                scene, mujoco.mjtGeom.mjGEOM_CAPSULE, 0.04 * size, start, end, OUTLINE
            )
    force = wrench[:2] @ axes[:2]
    if force.any():
        _connect(
            scene,
            mujoco.mjtGeom.mjGEOM_ARROW,
            0.08 * size,
            origin,
            origin + newton * force,
            FRICTION,
        )
    vx, vy, omega = twist
    if max(np.hypot(vx, vy), size * abs(omega)) > STANDS and np.hypot(
        vx, vy
    ) < FAR * size * abs(omega):
        centre = origin + np.array([-vy, vx]) / omega @ axes[:2]
        _connect(
            scene,
            mujoco.mjtGeom.mjGEOM_CYLINDER,
            0.1 * size,
            centre,
            centre + 0.1 * size * axes[2],
            CENTRE,
        )


def _size(patch: ContactPatch) -> float:
    """Return the distance of the furthest cell from the origin [m]."""
    return float(np.hypot(*patch.positions.T).max() + np.sqrt(patch.areas.max()))


def _connect(
    scene: Any,
    kind: Any,
    width: float,
    start: np.ndarray,
    end: np.ndarray,
    colour: tuple,
) -> None:
    if scene.ngeom >= scene.maxgeom:
        raise InvalidValueError(
            "scene", "have room for more geoms (maxgeom)", scene.maxgeom
        )
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(
        geom, kind, np.zeros(3), np.zeros(3), np.zeros(9), np.array(colour, np.float32)
    )
    mujoco.mjv_connector(geom, kind, width, start, end)
    geom.emission = 0.7  # seen in the dark of a contact too
    geom.category = mujoco.mjtCatBit.mjCAT_DECOR
    scene.ngeom += 1
