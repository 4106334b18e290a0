"""A batch gives, bit for bit, what its members give alone, in whatever order they lie in memory.

BLAS rounds a product with one row differently from one with many, on most processors: a test that passes on one
machine says little about the next, but elementwise products are the same everywhere.
"""

import numpy as np
import pytest

import planarfriction as pf
from tests.support.anisotropic import PATCHES as ANISOTROPIC
from tests.support.contacts import ELASTIC, FEET, PLAIN

MAP = pf.ContactPatch.from_pressure(
    np.random.default_rng(1).uniform(size=(5, 4)) ** 3, (0.002, 0.0015), name="map"
)
SOFT = pf.ContactPatch.disc(
    0.01, 7, pressure=pf.SoftFinger(c=0.007, n=0.4, k_per_newton=1.5), name="soft"
)
LOADED = pf.ContactPatch.from_pressure(
    {0.5: np.eye(4) + 0.1, 2.0: np.ones((4, 4)) / 3.0}, 1e-3, name="maps over load"
)
METRIC, CELLS = ANISOTROPIC["both"], ANISOTROPIC["cells"]
ONE_METRIC = ANISOTROPIC["metric"]

LAWS = {"plain": PLAIN, "elasto-plastic": ELASTIC}

SURFACES = {
    "cells": pf.LimitSurfaceCells(MAP),
    "cells, metric": pf.LimitSurfaceCells(METRIC),
    "cells, metrics": pf.LimitSurfaceCells(CELLS),
    "feet": pf.LimitSurfaceCells(FEET),
    "exact": pf.LimitSurfaceExact(MAP),
    "table": pf.LimitSurfaceTable(MAP, segments=8),
    "table, feet": pf.LimitSurfaceTable(FEET, segments=8),
    "table, metrics": pf.LimitSurfaceTable(CELLS, segments=8),
    "published table": pf.LimitSurfaceTablePublished(MAP, segments=8),
    "ellipsoid": pf.LimitSurfaceEllipsoid(MAP),
    "ellipsoid, metric": pf.LimitSurfaceEllipsoid(METRIC),
}

MODELS = {
    "distributed": lambda law: pf.DistributedModel(MAP, law),
    "distributed, one cell": lambda law: pf.DistributedModel(
        pf.ContactPatch.points([(0.01, 0.02)]), law
    ),
    "distributed, metrics": lambda law: pf.DistributedModel(CELLS, law),
    "distributed, soft": lambda law: pf.DistributedModel(SOFT, law),
    "distributed, maps over load": lambda law: pf.DistributedModel(LOADED, law),
    "reduced": lambda law: pf.ReducedModel(MAP, law, cells=12),
    "reduced, metric": lambda law: pf.ReducedModel(METRIC, law, cells=12),
    "published": lambda law: pf.ReducedModelPublished(MAP, law),
    "published, metric": lambda law: pf.ReducedModelPublished(
        ONE_METRIC, law, surface=pf.LimitSurfaceTable(ONE_METRIC, segments=8)
    ),
    "published, soft": lambda law: pf.ReducedModelPublished(SOFT, law),
}

RANDOM = np.random.default_rng(7)
TWISTS = (
    RANDOM.normal(size=(2, 5, 3))
    * [1e-2, 1e-2, 1.0]
    * 10.0 ** RANDOM.uniform(-4.0, 1.0, size=(2, 5, 1))
)
TWISTS[0, 1] = 0.0
LAYOUTS = {
    "as it is": lambda rows: rows,
    "columns first": np.asfortranarray,
    "strided": lambda rows: np.repeat(rows, 2, axis=1)[:, ::2],
}
layouts = pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)


def same(batch, alone, index):
    """All that a call returns, member by member."""
    batch, alone = (
        (values,) if isinstance(values, np.ndarray | float) else values
        for values in (batch, alone)
    )
    for of_batch, of_one in zip(batch, alone, strict=True):
        np.testing.assert_array_equal(of_batch[index], of_one)


@layouts
@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)
def test_limit_surfaces(surface, layout):
    twists = layout(TWISTS)
    wrenches = layout(RANDOM.normal(size=TWISTS.shape) * [1.0, 1.0, 0.01])
    for method in ("wrench", "dissipation", "jacobian"):
        batch = getattr(surface, method)(twists)
        for index in np.ndindex(2, 5):
            same(batch, getattr(surface, method)(twists[index].copy()), index)
    batch = surface.twist(wrenches)
    for index in np.ndindex(2, 5):
        same(batch, surface.twist(wrenches[index].copy()), index)


@layouts
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("make", MODELS.values(), ids=MODELS)
def test_models(make, law, layout):
    model = make(law)
    random = np.random.default_rng(3)
    scale = 1e-6 * (np.array([1.0, 1.0, 0.01]) if model.state_shape == (3,) else 1.0)
    states = layout(random.normal(size=(2, 5, *model.state_shape)) * scale)
    states[1, 1] = 0.0
    twists = layout(TWISTS)
    loads = layout(random.uniform(0.5, 2.0, size=(2, 5)))
    loads[0, 3] = 0.0
    dts = 10.0 ** random.uniform(-6.0, -2.0, size=(2, 5))
    for method in ("rate", "wrench", "jacobians", "step", "step_jacobians"):
        call = getattr(model, method)
        steps = (dts,) if method.startswith("step") else ()
        batch = call(states, twists, loads, *steps)
        shared = call(states[0, 0], twists, 1.0, *(1e-4 for _ in steps))
        for index in np.ndindex(2, 5):
            alone = (
                states[index].copy(),
                twists[index].copy(),
                float(loads[index]),
                *(float(s[index]) for s in steps),
            )
            same(batch, call(*alone), index)
            alone = (
                states[0, 0].copy(),
                twists[index].copy(),
                1.0,
                *(1e-4 for _ in steps),
            )
            same(shared, call(*alone), index)
