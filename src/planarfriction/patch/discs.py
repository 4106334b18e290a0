"""A patch as a few small discs: clusters of its cells, each with the load, centre and second moment of its cells.

The fewer the discs, the larger they are, and the more their own law of friction stands for. Clusters are those of
Lloyd's iteration: least `sum w |rho - c|^2`. Only one period of a patch with mirrors is clustered, so that a symmetric
patch has symmetric discs; the result does not depend on the order of cells, and turns with the patch.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import warnings
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planarfriction._support import validation
from planarfriction.geometry import rotate
from planarfriction.patch.disc_friction import disc_friction
from planarfriction.patch.outline import with_outline
from planarfriction.patch.pressure import PerCell
from planarfriction.patch.shared import SharedPressure, mean_weights

if TYPE_CHECKING:
    from planarfriction.patch.contact_patch import ContactPatch

REMEMBERED = 8
"""Patches whose discs are kept: choosing them takes longer than a short run, and models with other laws ask again."""

OF_ALL_LOADS = 2
"""Times as many discs stand for a patch whose shape depends on the load.

Steady friction of a Hertz contact at 0.5 to 10 N differs from that of fine cells by 0.3 to 1.6 % rms of `mu f_N` with
48 discs, by 0.6 to 2 % with 24, and by 0.2 to 0.3 % with 24 that are chosen for one load.
"""

SAME = 1e-9
"""Relative difference of positions, shares and second moments below which they are the same."""

SLANTED = np.array([1.0, 0.5 * (1.0 + math.sqrt(5.0))])
"""Direction along which no two cells of a grid are level: sorted along it, equal patches are equal cell by cell."""

STEPS = 60
"""Steps of Lloyd's iteration while partitions are compared."""

LAST_STEPS = 200
"""Steps of Lloyd's iteration of the partition that is taken."""

WORK = 3e6
"""Distances between cells and centres that are computed, about: bounds the number of seeds."""

MOST_SEEDS = 12
"""Seeds of one arrangement of centres on the mirrors."""

NEAR_BEST = 1.02
"""Cost over the least up to which partitions are compared by their friction."""

COMPARED = 8
"""Largest number of partitions that are compared by their friction."""

BESIDE = np.array([(0.1, 0.0), (0.0, 0.1), (0.25, 0.0), (0.0, 0.25), (0.17, 0.17)])
"""Centres of rotation beside the centre of pressure, in radii of gyration: the slope of friction at a pure spin."""

HEAVIER = 10.0
"""Weight of errors there over those elsewhere."""

PLACES = 40
"""Other centres of rotation: about so many cells."""


def discs(patch: ContactPatch, n: Any) -> ContactPatch:
    """Implement `ContactPatch.discs`."""
    n = patch.cells if n is None else validation.count("n", n)
    n = OF_ALL_LOADS * n if patch.depends_on_load else n
    return own_discs(patch) if patch.cells <= n else _few_discs(patch, n)[0]


def members_of(patch: ContactPatch, n: int) -> Membership | None:
    """Return the cells of each of the discs that stand for a patch; None if each is one disc."""
    n = OF_ALL_LOADS * n if patch.depends_on_load else n
    return None if patch.cells <= n else _few_discs(patch, n)[1]


def own_discs(patch: ContactPatch) -> ContactPatch:
    """Return the patch with each cell as the disc of its second moment; points remain points."""
    radii = np.sqrt((patch.cell_extents() ** 2).sum(axis=1) / 6.0)
    if patch.has_discs or not radii.any():
        return patch
    # Of the size, said when the patch was made.
    with warnings.catch_warnings(action="ignore"):
        return with_outline(
            dataclasses.replace(patch, radii=radii, point_shares=None), patch.outline
        )


@functools.lru_cache(REMEMBERED)
def _few_discs(patch: ContactPatch, n: int) -> tuple[ContactPatch, Membership]:
    """Return fewer discs than the patch has cells, and these; each kind of friction has its own discs."""
    cells = own_discs(patch)
    places = np.stack(cells.lever_coordinates(*cells.positions.T), -1)
    weights = mean_weights(cells)
    squares = 0.5 * cells.lever_radii**2
    groups = _kinds(cells)
    parts = []
    for group, count in zip(groups, _counts(places, weights, groups, n), strict=True):
        clusters = _clusters(places[group], weights[group], squares[group], count)
        parts.append(clusters._replace(cells=group[clusters.cells]))
    sizes = [len(part.places) for part in parts]
    first = np.repeat([group[0] for group in groups], sizes)
    start = np.cumsum([0, *sizes])
    labels = np.concatenate(
        [part.labels + at for part, at in zip(parts, start[:-1], strict=True)]
    )
    order = np.argsort(labels, kind="stable")
    members = np.concatenate([part.cells for part in parts])[order]
    parted = np.concatenate([part.parted for part in parts])[order]
    begins = np.searchsorted(labels[order], np.arange(start[-1]))
    chosen_cells = Membership(members, parted, begins)
    root = np.eye(2) if cells.root is None else cells.root
    # Radius of a disc in the space of its metric over its radius.
    ratio = np.broadcast_to(np.sqrt(0.5 * (root**2).sum((-2, -1))), cells.cells)
    radii = np.concatenate([part.radii for part in parts]) / ratio[first]
    shared = SharedPressure(cells, members, parted, begins, radii)
    areas = shared.sums(cells.areas)
    fields: dict[str, Any] = {"radii": radii}
    # One for all discs if they are of one kind.
    chosen = first if len(groups) > 1 else first[0]
    if cells.metric is not None:
        fields["metric"] = np.broadcast_to(cells.metric, (cells.cells, 2, 2))[chosen]
    if cells.asymmetry is not None:
        fields["asymmetry"] = cells.asymmetries()[chosen]
    law = shared if cells.depends_on_load else PerCell(shared.relative(cells.positions))
    joined = np.concatenate([part.places for part in parts])
    positions = _from_lever_coordinates(cells, joined, first)
    with warnings.catch_warnings(action="ignore"):
        few = type(patch)(positions, areas, law, None, patch.name, **fields)
    return few, chosen_cells


class Membership(NamedTuple):
    """Cells of a patch in clusters: membership m is a part of a cell."""

    cells: np.ndarray
    """Cell of each membership, in the order of clusters, `[M]`."""
    parted: np.ndarray
    """Part of the cell, `[M]`."""
    begins: np.ndarray
    """First membership of each cluster, `[n]`."""

    def sums(self, values: np.ndarray) -> np.ndarray:
        """Return the sums `[..., n]` of values `[..., N]` of cells over those of each cluster."""
        parts = values[..., self.cells] * self.parted
        return np.add.reduceat(parts, self.begins, axis=-1)


def clusters_of(patch: ContactPatch, shares: np.ndarray, n: int) -> Membership:
    """Return up to n clusters of the cells of a patch with these `shares` `[N]`."""
    squares = (patch.cell_extents() ** 2).sum(axis=1) / 12.0
    found = _clusters(patch.positions, shares, squares, n)
    order = np.argsort(found.labels, kind="stable")
    labels = found.labels[order]
    begins = np.searchsorted(labels, np.arange(labels[-1] + 1))
    return Membership(found.cells[order], found.parted[order], begins)


def mirrors(patch: ContactPatch) -> int:
    """Return the number of mirrors of the shape of a patch that lie on its principal axes."""
    weights = patch.areas / patch.areas.sum()
    middle, axes, scale = _frame(patch.positions, weights)
    points = (patch.positions - middle) @ axes / scale
    order = np.argsort(points @ SLANTED, kind="stable")
    period = _period(points[order], weights[order], np.ones(len(order)))
    return int((period.signs.prod(axis=1) < 0.0).sum())


# ---------------------------------------------------------------------- friction that depends on the direction


def _from_lever_coordinates(
    patch: ContactPatch, places: np.ndarray, cells: np.ndarray
) -> np.ndarray:
    """Return the positions whose lever coordinates are `places` `[n, 2]`, with the metrics of these `cells` `[n]`."""
    if patch.root is None:
        return places
    root = np.broadcast_to(patch.root, (patch.cells, 2, 2))[cells]
    turned = np.stack([-places[:, 1], places[:, 0]], -1)  # L (-y, x) of positions
    turned = np.linalg.solve(root, turned[..., None])[..., 0]
    return np.stack([turned[:, 1], -turned[:, 0]], -1)


def _kinds(patch: ContactPatch) -> list[np.ndarray]:
    """Return the cells of each kind of friction."""
    if patch.metric is None and patch.asymmetry is None:
        return [np.arange(patch.cells)]
    metric = np.eye(2) if patch.metric is None else patch.metric
    metric = np.broadcast_to(metric, (patch.cells, 2, 2))
    numbers = np.hstack([metric.reshape(-1, 4), patch.asymmetries()])
    kind = np.unique(numbers, axis=0, return_inverse=True)[1].reshape(-1)
    return [np.flatnonzero(kind == k) for k in range(kind.max() + 1)]


def _counts(
    places: np.ndarray, weights: np.ndarray, groups: list[np.ndarray], n: int
) -> list[int]:
    """Return the numbers of discs of the kinds of friction, which are n or fewer in all, and at least one each.

    Proportional to `w r`, the share times the radius of gyration of a kind, with which the sum of costs is least.
    """
    sizes = []
    for group in groups:
        w = weights[group]
        p = places[group]
        total = max(w.sum(), 1e-300)
        sizes.append(math.sqrt(max(total * (w @ (p - w @ p / total) ** 2).sum(), 0.0)))
    per_size = n / max(sum(sizes), 1e-300)
    return [
        min(len(g), max(1, math.floor(s * per_size + SAME)))
        for g, s in zip(groups, sizes, strict=True)
    ]


# ---------------------------------------------------------------------- clusters of cells of one kind


class _Clusters(NamedTuple):
    """Discs of cells, and the cells of each disc: a cell on a mirror is parted between a disc and its image."""

    places: np.ndarray
    """Centres `[n, 2]`."""
    radii: np.ndarray
    """Radii `[n]`."""
    cells: np.ndarray
    """Cell of each membership `[M]`."""
    labels: np.ndarray
    """Disc of the same, `[M]`."""
    parted: np.ndarray
    """Part of the cell that belongs to the disc, `[M]`; those of a cell add up to 1."""


class _Period(NamedTuple):
    """One of the equal pieces into which the symmetries divide a patch, in coordinates of `_frame`."""

    points: np.ndarray
    """`[M, 2]`."""
    weights: np.ndarray
    """Share of the load of the points, less for those that lie in several periods, `[M]`."""
    squares: np.ndarray
    """Second moments of the cells about themselves, `[M]`."""
    images: np.ndarray
    """Cells that are the images of each, `[G, M]`; the first is the cell itself."""
    signs: np.ndarray
    """Signs of the coordinates of the images, `[G, 2]`."""
    parted: np.ndarray
    """One over the number of periods in which a cell lies, `[M]`."""

    @property
    def inverted(self) -> bool:
        """True if the only symmetry is `p -> -p`, which has no mirror as a border."""
        return len(self.signs) == 2 and self.signs[1].tolist() == [-1.0, -1.0]

    def images_of(self, on_axes: np.ndarray) -> np.ndarray:
        """Return the first of the images `[G, k]` that is the same as each, for centres held `on_axes` `[k, 2]`."""
        different = (self.signs[:, None, None] != self.signs[None, :, None]) & ~on_axes
        return np.argmax(~different.any(axis=-1), axis=1)


class _Partition(NamedTuple):
    """Clusters of the points of a period."""

    centres: np.ndarray
    on_axes: np.ndarray
    """Coordinates `[k, 2]` of centres that are held at 0."""


def _clusters(
    places: np.ndarray, weights: np.ndarray, squares: np.ndarray, n: int
) -> _Clusters:
    """Return the discs of points with `weights` `[N]` and second moments of their own; fewer where n does not fit."""
    if len(places) <= n:
        each = np.arange(len(places))
        whole = np.ones(len(places))
        return _Clusters(places, np.sqrt(2.0 * squares), each, each, whole)
    weights = weights if weights.any() else np.ones(len(places))
    weights = weights / weights.sum()
    middle, axes, scale = _frame(places, weights)
    points = (places - middle) @ axes / scale
    order = np.argsort(points @ SLANTED, kind="stable")
    points = points[order]
    weights = weights[order]
    squares = squares[order] / scale**2
    period = _period(points, weights, squares)
    chosen = _chosen(period, points, weights, squares, n)
    centres, radii, cells, labels, parted = _finished(period, chosen)
    return _Clusters(
        centres @ axes.T * scale + middle, radii * scale, order[cells], labels, parted
    )


def _frame(
    places: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the mean of points, their principal axes as columns, and their radius of gyration.

    Where the axes are not determined, those of the coordinates; they point to the side with the farther load.
    """
    middle = weights @ places
    offset = places - middle
    scale = math.sqrt(weights @ (offset**2).sum(axis=1)) or 1.0
    x, y = offset.T / scale
    xx = weights @ x**2
    xy = weights @ (x * y)
    yy = weights @ y**2
    angle = 0.0 if abs(xy) < SAME else 0.5 * math.atan2(2.0 * xy, xx - yy)
    axes = rotate(np.eye(2), angle).T
    if yy - xx > SAME and angle == 0.0:
        axes = axes[:, ::-1]
    turned = offset @ axes / scale
    lean = weights @ (turned * (x**2 + y**2)[:, None] + turned**3)
    return middle, axes * np.where(lean < -SAME, -1.0, 1.0), scale


_FLIPS = ((-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0))
"""Signs of the coordinates of images: mirrored at x = 0, at y = 0, at both."""


def _period(points: np.ndarray, weights: np.ndarray, squares: np.ndarray) -> _Period:
    """Return one period of the symmetries of points sorted along `SLANTED`: mirrors on both axes, or `p -> -p`."""
    every = np.arange(len(points))
    near = SAME * float(np.abs(points).max())
    found = {(1.0, 1.0): every}
    for flip in _FLIPS:
        image = np.empty_like(every)
        image[np.argsort(points * flip @ SLANTED, kind="stable")] = every
        alike = all(
            np.abs(each[image] - each).max() <= SAME * each.max()
            for each in (weights, squares)
        )
        # All points lie on an axis.
        known = any(np.array_equal(image, other) for other in found.values())
        if alike and not known and np.abs(points[image] - points * flip).max() <= near:
            found[flip] = image
    signs = np.array(list(found))
    images = np.array(list(found.values()))
    mirrored = [k for k, flip in enumerate(_FLIPS[:2]) if flip in found]
    # without mirrors any one of a point and its image will do
    inside = (
        (points[:, mirrored] >= -near).all(axis=1) if mirrored else every <= images[-1]
    )
    parted = 1.0 / (images == every).sum(axis=0)
    period = np.flatnonzero(inside)
    own = points[period], (weights * parted)[period], squares[period]
    return _Period(*own, images[:, period], signs, parted[period])


def _arrangements(period: _Period, n: int) -> list[tuple[int, int, int, int]]:
    """Return numbers of centres inside, held at x = 0, at y = 0 and at both, whose images are n in all."""
    flips = {tuple(each) for each in period.signs}
    at_x, at_y, at_both = (flip in flips for flip in _FLIPS)
    pair = max(1, len(flips) // 2)
    spread = period.weights @ period.points**2 / period.weights.sum()
    width, height = np.sqrt(spread) + SAME
    most_x = min(n // pair, int(math.sqrt(n * height / width)) + 1) if at_x else 0
    most_y = min(n // pair, int(math.sqrt(n * width / height)) + 1) if at_y else 0
    ways = []
    for both in range(1 + (at_both and n > 0)):
        for x in range(most_x + 1):
            for y in range(most_y + 1):
                rest = n - both - pair * (x + y)
                if rest >= 0 and rest % len(flips) == 0:
                    ways.append((rest // len(flips), x, y, both))
    return ways


def _partitions(period: _Period, n: int) -> list[_Partition]:
    """Return the partitions into n clusters that cost little more than the best, the best first."""
    # Compiled code, which a patch alone does not need.
    from planarfriction._engine.cells import clusters

    points = period.points
    weights = period.weights
    ways = [way for way in _arrangements(period, n) if 0 < sum(way) <= len(points)]
    labels = np.empty(len(points), int)
    turned = np.empty(len(points), bool)
    work = len(points) * n / len(period.signs) * 0.5 * STEPS * max(len(ways), 1)
    found: list[tuple[float, _Partition]] = []
    for inside, at_x, at_y, at_both in ways:
        k = inside + at_x + at_y + at_both
        for seed in range(min(MOST_SEEDS, max(1, round(WORK / work)))):
            centres = np.empty((k, 2))
            on_axes = np.zeros((k, 2), bool)
            clusters.seeds(points, weights, seed * k, centres)
            if period.inverted:
                on_axes[_lowest(np.hypot(*centres.T), at_both)] = True
            else:
                left = _lowest(centres[:, 0], k)
                on_axes[left[:at_x], 0] = True
                rest = left[at_x:]
                low = rest[_lowest(centres[rest, 1], at_y + at_both)]
                on_axes[low, 1] = True
                on_axes[low[_lowest(centres[low, 0], at_both)], 0] = True
            centres[on_axes] = 0.0
            held = points, weights, period.inverted, on_axes
            cost = clusters.lloyd(*held, STEPS, centres, labels, turned)
            if cost < np.inf:
                found.append((cost, _Partition(centres, on_axes)))
    found.sort(key=lambda each: each[0])
    return _different(found)


def _lowest(values: np.ndarray, count: int) -> np.ndarray:
    """Return the indices of the lowest of some values, in their order."""
    return np.argsort(values, kind="stable")[:count]


def _different(found: list[tuple[float, _Partition]]) -> list[_Partition]:
    """Return the cheapest of partitions sorted by their cost; equal costs are equal partitions."""
    kept: list[tuple[float, _Partition]] = []
    for cost, partition in found:
        if cost > NEAR_BEST * found[0][0] or len(kept) == COMPARED:
            break
        if not kept or cost > kept[-1][0] * (1.0 + 1e-6):
            kept.append((cost, partition))
    return [partition for _, partition in kept]


def _chosen(
    period: _Period,
    points: np.ndarray,
    weights: np.ndarray,
    squares: np.ndarray,
    n: int,
) -> _Partition:
    """Return the partition into n clusters whose friction is nearest to that of all cells.

    A patch with two mirrors, or that is the same when turned by half a turn, has a disc in its middle for odd numbers
    only, so that n - 1 is tried too.
    """
    centred = (period.signs == -1.0).all(axis=1).any()
    good: list[_Partition] = []
    while not good:
        for number in (n, n - 1) if centred and n > 2 else (n,):
            good += _partitions(period, number)
        n -= 1
    if len(good) == 1:
        return good[0]
    elsewhere = period.points[:: max(1, len(period.points) // PLACES)]
    centres = np.concatenate([elsewhere, BESIDE])
    heavier = np.repeat([1.0, HEAVIER], [len(elsewhere), len(BESIDE)])[:, None]
    wanted = weights @ _pulls(points, np.sqrt(2.0 * squares), centres)

    def error(partition: _Partition) -> float:
        places, radii, cells, labels, parted = _finished(period, partition)
        shares = np.bincount(labels, weights[cells] * parted)
        missing = shares @ _pulls(places, radii, centres) - wanted
        return float((heavier * missing**2).sum())

    return min(good, key=error)


def _finished(period: _Period, chosen: _Partition) -> _Clusters:
    """Return the discs of a partition and of its images."""
    from planarfriction._engine.cells import clusters

    points = period.points
    weights = period.weights
    k = len(chosen.centres)
    on_axes = chosen.on_axes
    centres = chosen.centres.copy()
    labels = np.empty(len(points), int)
    turned = np.empty(len(points), bool)
    clusters.lloyd(
        points, weights, period.inverted, on_axes, LAST_STEPS, centres, labels, turned
    )
    points = np.where(turned[:, None], -points, points)
    share = np.bincount(labels, weights, k)
    for axis in range(2):
        mean = np.bincount(labels, weights * points[:, axis], k) / share
        centres[:, axis] = np.where(on_axes[:, axis], 0.0, mean)
    squares = ((points - centres[labels]) ** 2).sum(axis=1) + period.squares
    radii = np.sqrt(2.0 * np.bincount(labels, weights * squares, k) / share)
    images = np.where(turned, period.images[::-1], period.images)
    same = period.images_of(on_axes)  # [G, k]
    number = (same == np.arange(len(same))[:, None]).ravel()
    numbered = (np.cumsum(number) - 1).reshape(same.shape)
    disc = np.take_along_axis(numbered, same, axis=0)
    places = (period.signs[:, None] * centres).reshape(-1, 2)[number] + 0.0
    radii = np.tile(radii, len(same))[number]
    parted = np.tile(period.parted, len(same))
    return _Clusters(places, radii, images.ravel(), disc[:, labels].ravel(), parted)


def _pulls(places: np.ndarray, radii: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """Return friction `[K, n, 3]` per share of load against unit spins about K centres; a disc has its own torque."""
    x, y = places.T
    ux = -(y - centres[:, 1:])
    uy = x - centres[:, :1]
    c_t, c_s, speed = disc_friction(ux**2 + uy**2, radii**2)
    per_speed = np.divide(1.0, speed, out=np.zeros_like(speed), where=speed > 0.0)
    fx = c_t * ux * per_speed
    fy = c_t * uy * per_speed
    return np.stack([fx, fy, x * fy - y * fx + 0.5 * c_s * radii**2 * per_speed], -1)
