"""Tangential elasticity of a half-space that sticks to a rigid face over a patch.

A uniform shear traction q on a rectangle displaces the surface of a half-space, of shear modulus G and Poisson's ratio
nu, by

    u_x = 1/(2 pi G) int ((1 - nu)/d + nu x^2/d^3) q_x + nu x y/d^3 q_y dA

with the distance d and its components x, y (Cerruti); y alike. The tractions under a face that moves as a whole are
those whose displacements are those of the face (Johnson, Contact Mechanics, 1985, sections 3.6 and 4.3).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

MOST_RECTANGLES = 700
"""About the most rectangles that carry a traction of their own: finer cells are taken together."""


class Stuck(NamedTuple):
    """A patch that sticks all over to a face that moves as a whole."""

    shares: np.ndarray
    """Share of each cell in the tractions of shifts along x and y, `[N]` [-]."""
    stiffness: np.ndarray
    """Wrench about the origin per unit displacement of the face, `[3, 3]`."""


def stuck(
    positions: np.ndarray, areas: np.ndarray, sizes: np.ndarray, shear_modulus: float, poisson_ratio: float
) -> Stuck:  # fmt: skip
    """Return the tractions of cells at `positions` `[N, 2]` [m] with `areas` `[N]` and `sizes` `[N, 2]` [m]."""
    rectangle = _rectangles(positions, sizes)
    whole = np.bincount(rectangle, areas)
    places = np.array([np.bincount(rectangle, areas * each) for each in positions.T])
    places = (places / whole).T
    sides = np.broadcast_to(np.sqrt(whole)[:, None], places.shape)
    if len(whole) == len(areas):  # none is taken together with others
        sides = sizes
    moved = np.zeros((2, len(whole), 3))
    moved[0, :, 0] = 1.0
    moved[1, :, 1] = 1.0
    moved[0, :, 2] = -places[:, 1]
    moved[1, :, 2] = places[:, 0]
    moved = moved.reshape(-1, 3)
    soft = compliances(places, places, sides, shear_modulus, poisson_ratio)
    tractions = np.linalg.solve(soft, moved)
    stiffness = moved.T @ (np.tile(whole, 2)[:, None] * tractions)
    x, y = tractions.reshape(2, -1, 3).transpose(0, 2, 1)
    sheared = np.hypot(x[0], y[0]) + np.hypot(x[1], y[1])
    carried = sheared[rectangle] * areas
    return Stuck(carried / carried.sum(), 0.5 * (stiffness + stiffness.T))


def _rectangles(positions: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return the rectangle `[N]` that each cell belongs to; those of a symmetric patch are symmetric."""
    factor = math.ceil(math.sqrt(len(positions) / MOST_RECTANGLES))
    middle = 0.5 * (positions.min(axis=0) + positions.max(axis=0))
    steps = (positions - middle) / np.median(sizes, axis=0)
    if factor == 1:
        return np.arange(len(positions))
    # Cells on the middle line are a rectangle of their own.
    place = np.sign(steps) * np.ceil(np.abs(steps).round(6) / factor)
    return np.unique(place.astype(int), axis=0, return_inverse=True)[1].reshape(-1)


def compliances(
    points: np.ndarray, places: np.ndarray, sides: np.ndarray, shear_modulus: float, poisson_ratio: float
) -> np.ndarray:  # fmt: skip
    """Return displacements of P points, x then y, by unit tractions on rectangles at n places, `[2P, 2n]` [m/Pa]."""
    nu = poisson_ratio
    x = points[:, None, 0] - places[:, 0]
    y = points[:, None, 1] - places[:, 1]
    along = np.zeros_like(x)
    across = np.zeros_like(x)
    mixed = np.zeros_like(x)
    for side_x in (-0.5, 0.5):
        for side_y in (-0.5, 0.5):
            u = x + side_x * sides[:, 0]
            v = y + side_y * sides[:, 1]
            d = np.hypot(u, v)
            sign = math.copysign(1.0, side_x * side_y)
            along += sign * _weighed(u, v)  # int y^2/d^3
            across += sign * _weighed(v, u)  # int x^2/d^3
            mixed -= sign * d  # int x y/d^3
    # int 1/d is the sum of the first two.
    xx = (1.0 - nu) * along + across
    yy = along + (1.0 - nu) * across
    shears = np.block([[xx, nu * mixed], [nu * mixed, yy]])
    return shears / (2.0 * math.pi * shear_modulus)


def _weighed(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return `u ln(v + hypot(u, v))` but for a function of u, which differences between two v leave out."""
    size = np.abs(u)
    return u * np.arcsinh(v / np.where(size > 0.0, size, 1.0))
