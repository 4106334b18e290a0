"""From a scene to the flat arrays of the compiled solver."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction.kernels import anisotropic
from planarfriction.kernels import contacts as kernels
from planarfriction.kernels.body import Motion
from planarfriction.kernels.contacts import Contacts
from planarfriction.kernels.reduced import LINEAR
from planarfriction.models import DistributedModel, ReducedModel
from planarfriction.models.reduced_map import ReducedShape, owner

SHAPE_INTERVAL = 1e-3
"""Longest time [s] that a patch keeps its shape while the load it depends on changes; held loads need no limit."""

SHAPE_NUMBERS = 7
"""Numbers of a shape: those of the moment model, which has the most."""


class PackedScene(NamedTuple):
    """A scene as the solver sees it."""

    contacts: Contacts
    motion: Motion
    state: np.ndarray
    """Bristles at rest, body velocity, pose."""
    natural: np.ndarray
    """Natural scale of each state: mu_c/sigma_0 for deflections and positions, v_s for velocities, angles over r."""
    loaded: list[np.ndarray]
    """Distributed contacts: which cells of the model ever carry load and have bristles here; reduced: empty."""


class _Shapes:
    """Collects the shapes of all contacts, flat."""

    def __init__(self) -> None:
        self.weights: list[np.ndarray] = []
        self.weight_start: list[int] = []
        self.shape: list[np.ndarray] = []
        self.surface: list[tuple[int, int, int]] = []
        self.data: list[np.ndarray] = []
        self._size = {"weights": 0, "data": 0}
        self._stored: dict[int, int] = {}

    def add_distributed(self, weights: np.ndarray, cells: np.ndarray | None) -> int:
        """`cells`: numbers of anisotropic cells, the same array for all shapes of a contact."""
        self.weight_start.append(self._size["weights"])
        self.weights.append(weights)
        self._size["weights"] += len(weights)
        start = 0 if cells is None else self._start_of(cells)
        return self._add(np.zeros(0), (0, start, len(weights)))

    def add_reduced(self, shape) -> int:
        numbers, root = shape.surface.numbers, shape.root
        start = self._start_of(numbers.data)
        self.weight_start.append(0)
        metric = (root[0, 0], root[0, 1], root[1, 1])
        return self._add(np.array([*shape.numbers, *metric]), (numbers.kind, start, numbers.size))

    def add_moments(self, shapes: list[ReducedShape]) -> list[int]:
        """All shapes of a contact at once: there may be hundreds."""
        first = len(self.surface)
        factors = np.array([shape.factor for shape in shapes])[:, *np.triu_indices(3)]
        rows = np.column_stack([factors, [shape.blend for shape in shapes]])
        self.shape.append(np.ascontiguousarray(rows))  # else the solver is compiled once more
        for shape in shapes:
            start = self._start_of(shape.data)
            self.surface.append((start, start if shape.other is None else self._start_of(shape.other), 0))
        self.weight_start += [0] * len(shapes)
        return list(range(first, len(self.surface)))

    def _add(self, numbers: np.ndarray, surface: tuple[int, int, int]) -> int:
        row = np.zeros((1, SHAPE_NUMBERS))
        row[0, : len(numbers)] = numbers
        self.shape.append(row)
        self.surface.append(surface)
        return len(self.surface) - 1

    def _start_of(self, data: np.ndarray) -> int:
        """Where an array begins in `data`, each stored once, pieces of one array with all of it."""
        if id(data) not in self._stored:
            whole, start = owner(data)
            if id(whole) not in self._stored:
                self._stored[id(whole)] = self._size["data"]
                self.data.append(whole)
                self._size["data"] += len(whole)
            self._stored[id(data)] = self._stored[id(whole)] + start
        return self._stored[id(data)]


def breaks_of(scene, t_end: float) -> np.ndarray:
    """Times at which an input may jump or bend, from 0 to `t_end`, refined where a shape follows a continuous load."""
    breaks = scene.breaks(t_end)
    if not any(c.model.patch.depends_on_load and c.normal_force.hold == "linear" for c in scene.contacts):
        return breaks
    parts = np.maximum(np.ceil(np.diff(breaks) / SHAPE_INTERVAL - 1e-9).astype(int), 1)
    fine = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(breaks[:-1], breaks[1:], parts, strict=True)]
    return np.concatenate([*fine, [t_end]])


def pack(scene, t_end: float) -> PackedScene:
    """Flat arrays of the scene from 0 to `t_end` [s]."""
    breaks = breaks_of(scene, t_end)
    pieces = len(breaks) - 1
    middle = 0.5 * (breaks[:-1] + breaks[1:])
    load = np.empty((pieces, 2, len(scene.contacts)))
    row = np.empty((pieces, len(scene.contacts)), np.int64)
    shapes = _Shapes()
    sizes: list[tuple[int, int, int]] = []  # bristle states, cells, linearisation numbers
    cells: list[np.ndarray] = []
    loaded: list[np.ndarray] = []
    natural: list[np.ndarray] = []
    radii: list[float] = []
    for c, contact in enumerate(scene.contacts):
        load[:, 0, c], load[:, 1, c] = contact.normal_force.pieces(breaks)
        held = load[:, 0, c] + load[:, 1, c] * (middle - breaks[:-1])
        values, row_of_value = _distinct_loads(contact.model.patch, held)
        model = contact.model
        scale = model.law.mu_c / model.law.sigma_0
        if isinstance(model, DistributedModel):
            weights = np.atleast_2d([model.patch.weights(value) for value in values])
            ever = weights.max(axis=0) > 0.0
            numbers = _anisotropic_cells(model.patch, ever)
            rows = [shapes.add_distributed(np.ascontiguousarray(w[ever]), numbers) for w in weights]
            count = int(ever.sum())
            sizes.append((2 * count, count, (7 if numbers is None else anisotropic.LINEAR_NUMBERS) * count))
            cells.append(model.patch.positions[ever])
            loaded.append(ever)
            natural.append(np.full(2 * count, scale))
            offset = model.patch.positions[ever] - np.average(model.patch.positions[ever], axis=0)
            radius = float(np.hypot(*offset.T).mean())
        else:
            moments = isinstance(model, ReducedModel)
            shapes_here = model.shapes_at(values) if moments else [model.shape_at(value) for value in values]
            add = shapes.add_moments if moments else lambda each: [shapes.add_reduced(shape) for shape in each]
            rows = add(shapes_here)
            radius = max(shape.contact_radius for shape in shapes_here)
            sizes.append((3, 0, LINEAR if moments else 27))
            cells.append(np.empty((0, 2)))
            loaded.append(np.empty(0, bool))
            natural.append(scale * np.array([1.0, 1.0, 1.0 if moments else radius]))
        row[:, c] = np.array(rows)[row_of_value]
        radii.append(radius)
    offsets = np.concatenate([np.zeros((1, 3), np.int64), np.cumsum(sizes, axis=0)])
    positions = np.concatenate(cells)
    contacts = Contacts(
        kind=np.array([_kind(contact.model) for contact in scene.contacts]),
        law=np.array([np.array(c.model.law.numbers) for c in scene.contacts]),
        mount=np.array([_mount(scene, contact) for contact in scene.contacts]),
        place=np.array([[*c.position, np.cos(c.angle), np.sin(c.angle)] for c in scene.contacts], dtype=float),
        count=np.array([contact.count for contact in scene.contacts], dtype=float),
        state=np.ascontiguousarray(offsets[:, 0]),
        linear=np.ascontiguousarray(offsets[:, 2]),
        cell=np.ascontiguousarray(offsets[:, 1]),
        x=np.ascontiguousarray(positions[:, 0]),
        y=np.ascontiguousarray(positions[:, 1]),
        weights=np.concatenate([np.zeros(0), *shapes.weights]),
        weight_start=np.array(shapes.weight_start),
        shape=np.concatenate(shapes.shape),
        surface=np.array(shapes.surface),
        data=shapes.data[0] if len(shapes.data) == 1 else np.concatenate([np.zeros(0), *shapes.data]),
    )
    length = min(c.model.law.mu_c / c.model.law.sigma_0 for c in scene.contacts)
    speed = min(c.model.law.v_s for c in scene.contacts)
    radius = max(radii) or 1.0  # a single point has no lever arm: its spin is measured in rad/s
    arm = np.array([1.0, 1.0, 1.0 / radius])
    state = np.concatenate([np.zeros(offsets[-1, 0]), scene.body.velocity, scene.body.position, [scene.body.angle]])
    return PackedScene(
        contacts,
        _motion(scene, breaks, load, row, radius),
        state,
        np.concatenate([*natural, speed * arm, length * arm]),
        loaded,
    )


def _distinct_loads(patch, held: np.ndarray) -> tuple[list[None] | np.ndarray, np.ndarray]:
    """Loads that need a shape of their own, and which of them each piece takes; pieces without load borrow one."""
    if not patch.depends_on_load:
        return [None], np.zeros(len(held), np.int64)
    positive = np.unique(held[held > 0.0])
    if len(positive) == 0:
        positive = np.array([1.0])
    return positive, np.minimum(np.searchsorted(positive, held), len(positive) - 1)


def _kind(model) -> int:
    if isinstance(model, ReducedModel):
        return kernels.REDUCED
    if not isinstance(model, DistributedModel):
        return kernels.PUBLISHED
    return kernels.ANISOTROPIC if model.patch.anisotropic else kernels.DISTRIBUTED


def _anisotropic_cells(patch, ever: np.ndarray) -> np.ndarray | None:
    """The cells' numbers of `kernels.anisotropic`, flat; None where friction is the same in all directions."""
    if not patch.anisotropic:
        return None
    levers, asymmetry = patch.levers()[ever], patch.asymmetries()[ever]
    numbers = [*(levers[:, i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2))), *asymmetry.T]
    return np.concatenate(numbers)


def _mount(scene, contact) -> int:
    if scene.velocity is not None:
        return kernels.BODY_AXES
    return kernels.WORLD if contact.mounted_on == "world" else kernels.BODY


def _motion(scene, breaks: np.ndarray, load: np.ndarray, row: np.ndarray, radius: float) -> Motion:
    pieces = len(breaks) - 1
    force = np.zeros((pieces, 2, 3))
    if scene.force is not None:
        force[:, 0], force[:, 1] = scene.force.pieces(breaks)
    body: Any = scene.body
    if scene.velocity is None:
        velocity = np.empty((0, 3))
        acceleration = np.tile([*body.gravity, 0.0], (pieces, 1)).astype(float)
        inverse_mass = np.array([1.0 / body.mass, 1.0 / body.mass, 1.0 / body.inertia])
    else:
        velocity, acceleration = (np.ascontiguousarray(part) for part in scene.velocity.pieces(breaks))
        inverse_mass = np.zeros(3)
    return Motion(
        inverse_mass=inverse_mass,
        body_axes=scene.velocity is not None,
        breaks=breaks,
        load=load,
        force=force,
        velocity=velocity,
        acceleration=acceleration,
        row=row,
        stop_speed=float(scene.stop_speed or 0.0),
        stop_radius=radius,
        stop_time=max(c.model.law.sigma_1 / c.model.law.sigma_0 for c in scene.contacts),
    )
