"""Maps over all directions with continuous slopes: from values on the faces of a cube to what `kernels.cube` reads.

A function of the direction alone, constant along rays, is known at the nodes of the six faces, which are `P = +-e_k +
a e_i + b e_j` with k, i, j in cyclic order. Within a face a cubic Hermite patch has continuous slopes by itself.
Across the edge between two faces k and i, at `s e_k + q e_i + z e_j`, it has them if both faces share the value F and
the slope F_j at the nodes there, and if at the nodes

    s F_k + q F_i + z F_j = 0   (constant along rays),
    s F_kj + q F_ij + F_j + z F_jj = 0   (the same, along the edge),

where F_i, F_ij are slopes of face k and F_k, F_kj of face i, and F_jj is that of a cubic spline along the edge, which
alone has one value of it on both sides of a node. At a corner three such relations fix the three mixed slopes.
"""

from __future__ import annotations

import functools
import itertools

import numpy as np

GHOSTS = 3
"""Nodes beyond each edge of a face that its own spline sees, so that slopes at edges are as good as inside."""

_INNER = slice(GHOSTS, -GHOSTS)


def face_nodes(n: int) -> np.ndarray:
    """Return directions of the nodes of the six faces and their ghosts, `[6, K, K, 3]`, `K = 2 n + 1 + 2 GHOSTS`."""
    a, b = np.meshgrid(_coordinates(n, GHOSTS), _coordinates(n, GHOSTS), indexing="ij")
    result = np.empty((6, *a.shape, 3))
    for face in range(6):
        k = face % 3
        result[face, ..., k] = 1.0 if face < 3 else -1.0
        result[face, ..., (k + 1) % 3], result[face, ..., (k + 2) % 3] = a, b
    return result


def mirrored(values: np.ndarray) -> np.ndarray:
    """Return values `[6, K, K, ...]` of an odd function from those on the positive faces `[3, K, K, ...]`."""
    return np.concatenate([values, -values[:, ::-1, ::-1]])


def hermite(values: np.ndarray) -> np.ndarray:
    """Return the numbers of all nodes `[6, 2 n + 1, 2 n + 1, 4, M]`, from values `[6, K, K, M]` at `face_nodes(n)`.

    The four numbers of a node are the value, its slopes by a and b and the mixed slope, per coordinate of the face.
    """
    n = (values.shape[1] - 1) // 2 - GHOSTS
    slope = _spline_slope(n, GHOSTS)[_INNER]
    by_a = np.einsum("ri,fijm->frjm", slope, values, optimize=True)
    result = np.empty((6, 2 * n + 1, 2 * n + 1, 4, values.shape[-1]))
    result[:, :, :, 0], result[:, :, :, 1] = values[:, _INNER, _INNER], by_a[:, :, _INNER]
    result[:, :, :, 2] = np.einsum("rj,fijm->firm", slope, values[:, _INNER], optimize=True)
    result[:, :, :, 3] = np.einsum("rj,fijm->firm", slope, by_a, optimize=True)
    gradients = _match_corners(result)
    bends = _match_edges(result, gradients)
    _mix_corners(result, bends)
    return result


def level_matrix(count: int) -> np.ndarray:
    """Return the matrix `[count + 2, count]` from values over [0, 1] to coefficients of their cubic B-spline.

    The fourth differences at both ends vanish, so that the first two and the last two pieces are one polynomial each.
    """
    system = np.zeros((count + 2, count + 2))
    for i in range(count):
        system[i, i : i + 3] = 1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0
    system[count, :5] = system[count + 1, -5:] = 1.0, -4.0, 6.0, -4.0, 1.0
    return np.linalg.inv(system)[:, :count]


def flat(numbers: np.ndarray, components: int, faces: int) -> np.ndarray:
    """Return the numbers of `hermite`, M = levels x components, as `kernels.cube` reads them, slopes per node spacing.

    Single precision. What both sides of an edge store is rounded alike, so that values and the slopes along it stay
    the same; those across it then differ by 1e-7 of them.
    """
    nodes = numbers.shape[1]
    per = 2.0 / (nodes - 1)
    scaled = numbers[:faces] * np.array([1.0, per, per, per * per])[:, None]
    levels = scaled.shape[-1] // components
    return (
        scaled.reshape(faces, nodes, nodes, 4, levels, components)
        .transpose(0, 1, 2, 4, 5, 3)
        .ravel()
        .astype(np.float32)
    )


def _coordinates(n: int, ghosts: int = 0) -> np.ndarray:
    return np.arange(-n - ghosts, n + ghosts + 1) / n


@functools.lru_cache(maxsize=16)
def _spline_slope(n: int, ghosts: int = 0) -> np.ndarray:
    """Return the matrix from values at the nodes to the slopes there of the cubic spline through them."""
    from scipy.interpolate import CubicSpline

    nodes = _coordinates(n, ghosts)
    return CubicSpline(nodes, np.eye(len(nodes)))(nodes, 1)


@functools.lru_cache(maxsize=16)
def _clamped_spline(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return matrices from values at nodes and slopes at both ends to slopes and second derivatives at the nodes."""
    from scipy.interpolate import CubicSpline

    nodes, count = _coordinates(n), 2 * n + 1
    basis = np.eye(count + 2)
    ends = ((1, basis[count]), (1, basis[count + 1]))
    spline = CubicSpline(nodes, basis[:count], bc_type=ends)  # pyright: ignore
    return spline(nodes, 1), spline(nodes, 2)


def _nodes_at(numbers: np.ndarray, k: int, point: tuple) -> np.ndarray:
    """Return the nodes of the face of axis k at a point on the cube, whose coordinates are 1, -1 or a slice."""
    place = [p if isinstance(p, slice) else (-1 if p > 0 else 0) for p in (point[(k + 1) % 3], point[(k + 2) % 3])]
    return numbers[k if point[k] > 0 else k + 3][tuple(place)]


def _entry(k: int, axis: int) -> int:
    """Return the index of the slope along `axis` among the numbers of a node on a face of axis k."""
    return 1 if axis == (k + 1) % 3 else 2


_CORNERS = tuple(itertools.product((1.0, -1.0), repeat=3))


def _match_corners(numbers: np.ndarray) -> dict[tuple, np.ndarray]:
    """Give each corner one value and one gradient, the means of its three faces; return the gradients `[3, M]`."""
    result = {}
    for p in _CORNERS:
        nodes = [_nodes_at(numbers, k, p) for k in range(3)]
        gradient = np.zeros((3, numbers.shape[-1]))
        for k, node in enumerate(nodes):
            i, j = (k + 1) % 3, (k + 2) % 3
            gradient[i] += node[1] / 3.0
            gradient[j] += node[2] / 3.0
            gradient[k] -= p[k] * (p[i] * node[1] + p[j] * node[2]) / 3.0
        value = (nodes[0][0] + nodes[1][0] + nodes[2][0]) / 3.0
        for k, node in enumerate(nodes):
            node[0], node[1], node[2] = value, gradient[(k + 1) % 3], gradient[(k + 2) % 3]
        result[p] = gradient
    return result


def _match_edges(numbers: np.ndarray, gradients: dict[tuple, np.ndarray]) -> dict[tuple, np.ndarray]:
    """Match values and slopes along the edges at their inner nodes; return `z F_j + F_jj` at each corner, by edge."""
    n = (numbers.shape[1] - 1) // 2
    slope, z, inner = _spline_slope(n), _coordinates(n)[:, None], slice(1, -1)
    to_slope, to_bend = _clamped_spline(n)
    bends = {}
    for j, s, q in itertools.product(range(3), (1.0, -1.0), (1.0, -1.0)):
        k, i = (j + 1) % 3, (j + 2) % 3
        point: list = [None] * 3
        point[k], point[i], point[j] = s, q, slice(None)
        one, two = _nodes_at(numbers, k, tuple(point)), _nodes_at(numbers, i, tuple(point))
        corners = []
        for end in (-1.0, 1.0):
            point[j] = end
            corners.append(tuple(point))
        shared = 0.5 * (one[:, 0] + two[:, 0])
        known = np.concatenate([shared, [gradients[corner][j] for corner in corners]])
        along, bend = to_slope @ known, to_bend @ known
        one[:, 0] = two[:, 0] = shared
        one[:, _entry(k, j)] = two[:, _entry(i, j)] = along
        across, back = one[:, _entry(k, i)], two[:, _entry(i, k)]
        miss = (s * back + q * across + z * along)[inner]
        across[inner] -= 0.5 * q * miss
        back[inner] -= 0.5 * s * miss
        mixed, mixed_back = slope @ across, slope @ back
        miss = s * mixed_back + q * mixed + along + z * bend
        one[inner, 3] = (mixed - 0.5 * q * miss)[inner]
        two[inner, 3] = (mixed_back - 0.5 * s * miss)[inner]
        for corner, m in zip(corners, (0, -1), strict=True):
            bends[corner, j] = corner[j] * along[m] + bend[m]
    return bends


def _mix_corners(numbers: np.ndarray, bends: dict[tuple, np.ndarray]) -> None:
    """Write mixed slopes at the corners: N_k = p_i p_j F_ij of face k obeys N_i + N_k = -(p_j F_j + F_jj) at edge j."""
    for p in _CORNERS:
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            twice = bends[p, k] - bends[p, i] - bends[p, j]
            _nodes_at(numbers, k, p)[3] = 0.5 * p[i] * p[j] * twice
