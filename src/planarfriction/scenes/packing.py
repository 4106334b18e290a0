"""From a scene to the flat arrays of the compiled solver."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np

from planarfriction.kernels.body import Motion, System, system_of
from planarfriction.kernels.contacts import BODY, BODY_AXES, WORLD, Contacts, calls_of
from planarfriction.kernels.pointers import place_of
from planarfriction.models.base import PackedModel

SHAPE_INTERVAL = 1e-3
"""Longest time [s] that a patch keeps its shape while the load it depends on changes; held loads need no limit."""


class PackedScene(NamedTuple):
    """A scene as the solver sees it."""

    system: System
    state: np.ndarray
    """Bristles at rest, body velocity, pose."""
    natural: np.ndarray
    """Natural scale of each state: mu_c/sigma_0 for deflections and positions, v_s for velocities, angles over r."""
    models: list[PackedModel]
    """The model of each contact; the system holds addresses of its arrays."""
    loading: float
    """Time to compile the models' functions and the solver's, or to load them from the cache [s]."""


def breaks_of(scene, t_end: float) -> np.ndarray:
    """Times at which an input may jump or bend, from 0 to `t_end`, refined where a shape follows a continuous load."""
    breaks = scene.breaks(t_end)
    if not any(c.model.patch.depends_on_load and c.normal_force.hold == "linear" for c in scene.contacts):
        return breaks
    parts = np.maximum(np.ceil(np.diff(breaks) / SHAPE_INTERVAL - 1e-9).astype(int), 1)
    fine = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(breaks[:-1], breaks[1:], parts, strict=True)]
    return np.concatenate([*fine, [t_end]])


def pack(scene, t_end: float, *, sensitivities: bool = False) -> PackedScene:
    """Flat arrays of the scene from 0 to `t_end` [s]; with `sensitivities` what its derivatives need too."""
    breaks = breaks_of(scene, t_end)
    pieces, count = len(breaks) - 1, len(scene.contacts)
    middle = 0.5 * np.diff(breaks)
    load, row = np.empty((pieces, 2, count)), np.empty((pieces, count), np.int64)
    models: list[PackedModel] = []
    records: list[np.ndarray] = []
    for c, contact in enumerate(scene.contacts):
        load[:, 0, c], load[:, 1, c] = contact.normal_force.pieces(breaks)
        loads, which = _distinct_loads(contact.model.patch, load[:, 0, c] + load[:, 1, c] * middle)
        model = contact.model.packed(loads)
        row[:, c] = which + sum(len(each) for each in records)
        records.append(place_of(model.records) + model.records.strides[0] * np.arange(len(loads)))
        models.append(model)
    begin = time.perf_counter()
    calls = np.array([calls_of(model.functions, change=sensitivities) for model in models])
    loading = time.perf_counter() - begin
    contacts = Contacts(
        calls=calls,
        record=np.concatenate(records),
        mount=np.array([_mount(scene, contact) for contact in scene.contacts]),
        place=np.array([[*c.position, np.cos(c.angle), np.sin(c.angle)] for c in scene.contacts], dtype=float),
        count=np.array([contact.count for contact in scene.contacts], dtype=float),
        state=_starts([model.states for model in models]),
        linear=_starts([model.workspace for model in models]),
    )
    length = min(c.model.law.largest_deflection for c in scene.contacts)
    speed = min(c.model.law.numbers.v_s for c in scene.contacts)
    # a single point has no lever arm: its spin is measured in rad/s
    radius = max(model.radius for model in models) or 1.0
    arm = np.array([1.0, 1.0, 1.0 / radius])
    state = np.concatenate([np.zeros(contacts.state[-1]), scene.body.velocity, scene.body.position, [scene.body.angle]])
    natural = np.concatenate([*(model.natural for model in models), speed * arm, length * arm])
    system = system_of(contacts, _motion(scene, breaks, load, row, radius))
    return PackedScene(system, state, natural, models, loading)


def _starts(sizes: list[int]) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)


def _distinct_loads(patch, held: np.ndarray) -> tuple[Any, np.ndarray]:
    """Loads that need a shape of their own, and which of them each piece takes; pieces without load borrow one."""
    if not patch.depends_on_load:
        return [None], np.zeros(len(held), np.int64)
    positive = np.unique(held[held > 0.0])
    if len(positive) == 0:
        positive = np.array([1.0])
    return positive, np.minimum(np.searchsorted(positive, held), len(positive) - 1)


def _mount(scene, contact) -> int:
    if scene.velocity is not None:
        return BODY_AXES
    return WORLD if contact.mounted_on == "world" else BODY


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
        stop_time=max(c.model.law.numbers.sigma_1 / c.model.law.numbers.sigma_0 for c in scene.contacts),
    )
