"""Small spheres below the corners of a patch, for engines that find one point for each pair of shapes."""

from __future__ import annotations

import math

import numpy as np

from planarfriction_studies.referee.case import Case, Shape

ROUND = ("capsule", "sphere")
"""Shapes that touch in a line or in a point: they need no spheres."""

RADIUS = 1e-3
"""Radius of the spheres [m]."""

SHRUNK = 5e-4
"""Distance from the faces of a shape with spheres to those of its solid along z: the spheres touch first [m]."""

_RIM = 8
"""Number of spheres of a disc."""


def feet(case: Case, shape: Shape) -> np.ndarray:
    """Return the middles `[n, 3]` in the body of spheres of the patches that a shape has; none for what is round."""
    points = []
    for contact in case.contacts if shape.kind not in ROUND else ():
        if contact.pair[1] != shape.name:
            continue
        if len(contact.patch) == 1:
            angles = 2.0 * math.pi * np.arange(_RIM) / _RIM
            around = (contact.patch[0] - RADIUS) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        else:
            around = np.maximum(0.5 * np.array(contact.patch) - RADIUS, 0.0) * [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        inside = math.copysign(RADIUS, shape.position[2] - contact.at[2])
        lifted = np.column_stack([around, np.full(len(around), inside)])
        points.append(np.array(contact.at) + lifted)
    return np.concatenate(points) if points else np.zeros((0, 3))
