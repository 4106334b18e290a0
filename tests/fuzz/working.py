"""Small uses of results: they must be finite."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import xarray as xr
from judge import finite

import planarfriction as pf


@functools.singledispatch
def use(value: Any) -> None:
    """Arrays, numbers and tuples of them."""
    finite(value)


@use.register
def _(data: xr.Dataset) -> None:
    """Check that each failed run of a sweep, and no other, gives a reason."""
    for status, each in zip(
        data.status.values.ravel(), data.failure.values.ravel(), strict=True
    ):
        assert (status == "failed") == bool(each)


@use.register
def _(patch: pf.ContactPatch) -> None:
    for results in (
        patch.weights(1.0),
        patch.centre_of_pressure(1.0),
        patch.contact_radius(1.0),
        patch.area(1.0),
    ):
        finite(results, "a property of the patch")
    finite(patch.moments(2, 1.0), "moments")
    pf.ContactPatch.from_dict(patch.to_dict())


@use.register
def _(pressure: pf.patch.Pressure) -> None:
    cells = len(pressure.values[0]) if isinstance(pressure, pf.PressureMaps) else None
    cells = len(pressure.values) if isinstance(pressure, pf.patch.PerCell) else cells
    positions = np.array([(0.0, 0.0), (0.01, 0.0), (0.0, 0.01)])
    positions = positions if cells is None else np.zeros((cells, 2))
    for load in (0.5, 2.0):
        finite(pressure.relative(positions, np.array(load)), "pressure")


@use.register
def _(law: pf.laws.FrictionLaw) -> None:
    finite(law.numbers, "numbers of the law")
    patch = pf.ContactPatch.points([(0.0, 0.0), (0.01, 0.0)])
    model = pf.DistributedModel(patch, law)
    state = model.rest()
    for twist in ((1e-9, 0.0, 0.0), (1e-3, 1e-4, 0.1), (1.0, 0.0, 10.0)):
        state, wrench = model.step(state, twist, 1.0, 1e-3)
        finite((state, wrench), "a step")


@use.register
def _(law: pf.Coulomb) -> None:
    finite(
        law.wrench(
            pf.LimitSurfaceEllipsoid(pf.ContactPatch.disc(0.01, 5)),
            (1.0, 0.0, 1.0),
            1.0,
        ),
        "wrench",
    )


@use.register
def _(surface: pf.limit_surface.LimitSurface) -> None:
    surface = (
        surface.at(1.0)
        if surface.normal_force is None and surface.patch.depends_on_load
        else surface
    )
    for twist in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.01, -0.005, 1.0)):
        finite(
            (
                surface.wrench(twist),
                surface.dissipation(twist),
                surface.jacobian(twist),
            ),
            "the surface",
        )


@use.register
def _(model: pf.models.FrictionModel) -> None:
    state = model.rest()
    for twist in (
        (1e-9, 0.0, 0.0),
        (1e-3, 1e-4, 0.1),
        (1.0, 0.0, 10.0),
        (0.0, 0.0, 0.0),
    ):
        state, wrench = model.step(state, twist, 1.0, 1e-3)
        finite((state, wrench), "a step")
    finite(tuple(model.jacobians(state, (1e-3, 0.0, 0.1), 1.0)), "a Jacobian")


@use.register
def _(signal: pf.Signal) -> None:
    finite((signal(0.05), signal.left(0.05), signal.breaks), "the signal")
    assert pf.Signal.from_dict(signal.to_dict()) == signal


@use.register
def _(scene: pf.Scene) -> None:
    again = pf.Scene.from_dict(scene.to_dict())
    assert again.digest() == scene.digest()
    try:
        solution = pf.simulate(
            scene, t_end=min(scene.t_end, 0.01), save_every=min(scene.t_end, 0.01)
        )
    except pf.errors.SolverError:
        return
    use(solution)


@use.register
def _(contact: pf.Contact) -> None:
    use(pf.Scene(pf.Body(1.0, 0.01), [contact], 0.01))


@use.register
def _(body: pf.Body) -> None:
    use(
        pf.Scene(
            body,
            [
                pf.Contact(
                    pf.ReducedModelPublished(pf.ContactPatch.disc(0.01, 5), pf.LuGre()),
                    1.0,
                )
            ],
            0.01,
        )
    )


@use.register
def _(solution: pf.Solution) -> None:
    for name, history in solution.histories.items():
        finite(np.asarray(getattr(history, "values", history)), name)


@use.register
def _(grid: pf.patch.Grid) -> None:
    finite((grid.centres(), grid.cell_area), "the grid")


@use.register
def _(log: pf.identify.Log) -> None:
    finite((log.interval, log.twist, log.wrench), "the log")
