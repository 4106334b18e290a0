"""Patches of a step in contact space, as `coupled.coupling` reads them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.compiler.calls import address_of
from planarfriction._engine.compiler.memory import Layout, StructBuffer, places_of
from planarfriction._engine.coupled.bodies import RigidPatches, step_bodies
from planarfriction._engine.coupled.coupling import solve
from planarfriction._engine.coupled.coupling_rows import Followers, Patches, layout
from planarfriction._engine.coupled.steps import ready
from planarfriction._engine.records.base import CompiledModel
from planarfriction._engine.records.packed import PackedModel


class PackedPatches(NamedTuple):
    """Patches as compiled code sees them."""

    patches: StructBuffer
    """`Patches` of compiled code."""
    layout: Layout
    """Layout of the row of a problem."""
    records: np.ndarray
    """Addresses of the patches' records, int `[k]`; 0 of those that follow their loads."""
    sizes: np.ndarray
    """Words of the patches' records, int `[k]`; 0 of those that follow their loads."""
    following: list[int]
    """Patches whose shapes follow their loads."""
    kept: list[PackedModel | None]
    """Objects behind the addresses, which have to be kept alive."""


def packed_patches(
    models: Sequence[CompiledModel], levers: Sequence[float]
) -> PackedPatches:
    """Pack patches whose lever arms [m] turn spins into speeds."""
    inner = [each.bristles for each in models]
    fixed = [each.fixed for each in inner]
    records = np.array(
        [0 if each is None else places_of(each.records)[0] for each in fixed], np.int64
    )
    sizes = np.array(
        [0 if each is None else each.records.shape[1] for each in fixed], np.int64
    )
    places, words = zip(*(each.points() for each in inner), strict=True)
    columns = (np.ascontiguousarray(each) for each in np.concatenate(places).T)
    followers = Followers(
        *columns,
        np.cumsum([0, *map(len, places)]),
        np.array(words, np.int64),
        np.array([each.moves for each in inner], np.int64),
    )
    moved = sum(each.moves * len(at) for each, at in zip(inner, places, strict=True))
    bounds = np.cumsum([0, *(math.prod(each.state_shape) for each in models)])
    shared = len(followers.x), int(followers.words.sum()), moved
    rows = layout(len(models), int(bounds[-1]), *shared)
    none = np.zeros((3, 3))
    soft = [none if each.compliance is None else each.compliance for each in models]
    patches = Patches(
        count=len(models),
        states=int(bounds[-1]),
        solve=address_of(solve),
        steps=np.array([address_of(each.functions.step) for each in inner], np.int64),
        slopes=np.array(
            [address_of(each.functions.slopes) for each in inner], np.int64
        ),
        firsts=bounds.astype(np.int64),
        radius=np.array(levers),
        pad=np.array([each.of_pad for each in models], np.int64),
        soft=int(all(each.of_pad for each in models)),
        linear=int(all(each.held[0].any() for each in models)),
        stuck=np.ravel([each.held[0] for each in models]),
        viscous=np.ravel([each.held[1] for each in models]),
        bristle=np.array([each.components for each in models], np.int64),
        compliance=np.ravel(soft),
        back=np.ravel([np.linalg.pinv(each, hermitian=True) for each in soft]),
        lag=np.array([each.lag for each in models]),
        rigid=0,
        rows=np.zeros((0, 3)),
        followers=followers,
        row=rows.offsets,
    )
    following = [p for p, each in enumerate(fixed) if each is None]
    return PackedPatches(StructBuffer(patches), rows, records, sizes, following, fixed)


class PackedBody(NamedTuple):
    """A rigid body on patches as `coupled.bodies.step_bodies` sees it."""

    words: np.ndarray
    """Words of its `RigidPatches`."""
    states: int
    """Number of states of its patches."""
    scratch: int
    """Words of the row of a problem."""
    records: np.ndarray
    """Addresses of the patches' records, as in `PackedPatches`."""
    fixed: bool
    """True if no patch follows its load."""
    alone: bool
    """True of one patch, whose load is a number."""
    kept: Any
    """Objects behind the addresses, which have to be kept alive."""


def packed_body(
    packed: PackedPatches,
    blank: np.ndarray,
    per_mass: np.ndarray,
    to_patches: np.ndarray,
    alone: bool,
) -> PackedBody:
    """Pack a body by the inverses of mass, mass and inertia, and the rows that give the twists of its patches.

    `blank` is a problem without inputs; `alone` as in `PackedBody`.
    """
    ready(step_bodies)
    to_patches = np.ascontiguousarray(to_patches)
    patches = packed.patches.record
    # A face moves against its body; one patch has three equations anyway.
    rigid = int(patches.count > 1 and not any(patches.lag))
    on_body: Any = StructBuffer(patches._replace(rigid=rigid, rows=to_patches))
    body = StructBuffer(RigidPatches(on_body.words, blank, per_mass))
    return PackedBody(
        words=body.words,
        states=packed.patches.record.states,
        scratch=packed.layout.size,
        records=packed.records,
        fixed=not packed.following,
        alone=alone,
        kept=(body, on_body, packed),
    )
