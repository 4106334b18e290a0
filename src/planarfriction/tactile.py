"""Fields over a contact, as a tactile sensor under it would measure them (docs/tactile.md).

`forces`, `slip_ratio` and `displacement` take models of NumPy, PyTorch or JAX, any batch axes first, and are
differentiable in the latter two. A field has one value for each cell of a `DistributedModel` or disc of a
`ReducedModel`, at `model.reduction.patch.positions`.
"""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planarfriction import formulas, half_space
from planarfriction._engine.bristles import discs, elastic
from planarfriction._engine.cells.cell_loops import KINDS
from planarfriction._support import validation
from planarfriction._support.described import described
from planarfriction.errors import InvalidValueError
from planarfriction.laws.base import refuse_rate_law
from planarfriction.models import DistributedModel, FrictionModel
from planarfriction.pads import HalfSpace
from planarfriction.patch.discs import clusters_of
from planarfriction.scenes.slip import parted
from planarfriction.scenes.solution import History, Solution, scene_of
from planarfriction.tensors import distributed
from planarfriction.tensors.elements import joined, split
from planarfriction.tensors.models import CellsModel
from planarfriction.tensors.namespace import Namespace, shaped
from planarfriction.tensors.steps import inner

SLIPS = 0.97
"""Slip ratio above which a cell counts as slipping [-]."""

FLAT = 1e-9
"""Width of the centres of cells over their length below which they lie on a line."""

NUMPY = Namespace(
    np,
    pow=np.power,
    broadcast_arrays=np.broadcast_arrays,
    stop_gradient=lambda x: x,
    integers=lambda x: x.astype(int),
)
"""The array namespace of NumPy."""


@described
class Markers(NamedTuple):
    """Points on the face of a pad whose displacement is asked for (see `markers`)."""

    positions: np.ndarray
    """`[P, 2]` [m]"""
    response: np.ndarray
    """Displacement per deflection of a bristle, `[P, 2, d, N]` [-]."""


class _Contact(NamedTuple):
    """A model and its inputs as arrays of one library."""

    xp: Namespace
    law: Any
    shape: distributed.Cells
    bristles: Any
    """Deflections `[..., d, N]` [m]."""
    seen: Any
    """Velocities that the bristles see, `[..., d, N]` [m/s]."""
    load: Any
    """Normal force `[..., 1, 1]` [N]."""


def forces(model: Any, state: Any, twist: Any, normal_force: Any) -> Any:
    """Return the friction forces of the cells on the moving body, `[..., d, N]` [N]: `wrench = sum_i B_i' f_i`.

    `f_i = -w_i f_N (sigma_0 z_i + sigma_1 zdot_i + sigma_2 u_i)`, of a pad `-K_i z_i` and the damping. B are the
    `levers()` of the patch of the cells; the third row of discs is their spin. Behind a common compliance `twist` is
    that of the face, which is the body's if the contact moves steadily.

    Raises InvalidValueError for a model without cells, for `RateLaw`, and as `model.wrench` does.
    """
    at = _contact(model, state, twist, normal_force)
    _, pull = distributed.evaluate(
        at.xp, at.law, at.shape, at.bristles, (at.seen,), at.load
    )
    return at.load * at.shape.weights * pull


def tractions(
    model: FrictionModel, state: Any, twist: Any, normal_force: Any
) -> np.ndarray:
    """Return the mean tractions over the area of the cells, `forces` over `areas`, `[..., d, N]` [Pa]; NumPy only.

    Raises InvalidValueError as `forces` does.
    """
    found = forces(model, state, twist, normal_force)
    return found / _cells_of(model).patch.areas


def slip_ratio(model: Any, state: Any, twist: Any, normal_force: Any) -> Any:
    """Return the deflection of each bristle over the largest at its velocity, `[..., N]` [-]: 1 in steady sliding.

    `sigma_0 |z_i|/g(|u_i|)`, of a pad `K_i |z_i|/(w_i f_N g)`, of a disc over `|W|/S` too (`formulas.disc_friction`);
    with asymmetric friction `z_i - a_i g/sigma_0` counts, from where a bristle rests. Cells without load have 0.

    Raises InvalidValueError as `forces` does.
    """
    at = _contact(model, state, twist, normal_force)
    xp = at.xp
    kind = KINDS[at.shape.kind]
    borne = at.load * at.shape.weights
    speed = xp.norm(at.seen, -2)
    pull = speed
    if kind.element.size == 3:
        *_, speed, pull = xp.over(discs.sliding)(split(at.seen))
        pull = xp.norm(joined(xp, pull), -2)
    per_pull = xp.where(speed > 0.0, pull / xp.where(speed > 0.0, speed, 1.0), 1.0)
    largest = formulas.stribeck(xp, speed, at.law) / at.law.sigma_0 * per_pull
    z = at.bristles
    if kind.pad:
        piece = elastic.Elastic(at.law, at.shape.stiff, borne)
        z = xp.over(elastic.factors)(piece)[0] * z
    elif kind.leans:
        z = z - at.shape.levers[-2:] * largest
    return xp.where(borne > 0.0, xp.norm(z, -2) / largest, 0.0)[..., 0, :]


def slipping_area(
    model: FrictionModel,
    state: Any,
    twist: Any,
    normal_force: Any,
    *,
    above: float = SLIPS,
) -> np.ndarray:
    """Return the area of the cells whose `slip_ratio` is larger than `above`, `[...]` [m2]; NumPy only.

    Coarse, and no measurement: of 24 discs on a pad it differs from the elastic solution by a tenth to a seventh of the
    patch on average, by a quarter at worst.

    Raises InvalidValueError as `forces` does, and unless `above` lies between 0 and 1.
    """
    limit = validation.number("above", above)
    if not 0.0 < limit < 1.0:
        raise InvalidValueError("above", "lie between 0 and 1", above)
    slips = slip_ratio(model, state, twist, normal_force) > limit
    return slips @ _cells_of(model).patch.areas


def markers(model: FrictionModel, points: ArrayLike) -> Markers:
    """Return markers on the face of a pad at `points` `[P, 2]` [m].

    On a `Pad.half_space` they move by the forces of the cells, also beside the contact (Cerruti). On another pad they
    move with the cells next to them, between the centres of these by thin-plate splines; a common compliance adds the
    displacement by the whole wrench.

    Raises InvalidValueError for a model without cells, for points of another shape, and, without a half-space, for a
    patch whose cells lie on one line.
    """
    few = _cells_of(model)
    points = validation.array("points", points, (None, 2))
    if isinstance(model.pad, HalfSpace):
        return Markers(points, _by_forces(model, few, model.pad, points))
    response = np.zeros((len(points), 2, few.patch.bristles, few.patch.cells))
    response[:, 0, 0] = response[:, 1, 1] = -_spline(few.patch.positions, points)
    common = None if few.pad is None else few.pad.compliance(few.patch)
    if common is not None and few.pad is not None:
        pieces = few.pad.pieces(few.patch, few.law)
        wrenches = -pieces * np.moveaxis(few.patch.levers(), 0, -1)
        response += np.einsum("pka,ab,mbn->pkmn", _moved(points), common, wrenches)
    return Markers(points, response)


def displacement(model: Any, state: Any, markers: Markers) -> Any:
    """Return the displacement of markers on the face of a pad against its back, `[..., P, 2]` [m].

    The pad is on the moving body, whose face stays behind: `-z` where a cell is. On a half-space it is that by the
    forces `-K_i z_i`. A pad on what lies below has the opposite sign.

    Raises InvalidValueError for a model without cells, a state of another shape, and markers of another model.
    """
    xp, z = _bristles(model, state)
    validation.instance("markers", markers, Markers, "made by markers(model, points)")
    points, axes, d, n = markers.response.shape
    if z.shape[-2:] != (d, n):
        rule = f"belong to a model with bristles {list(z.shape[-2:])}"
        raise InvalidValueError("markers", rule, [d, n])
    response = markers.response.reshape(points * axes, d * n).T
    if xp is not NUMPY:
        response = xp.from_numpy(response, z)
    return (z.reshape(*z.shape[:-2], d * n) @ response).reshape(
        *z.shape[:-2], points, axes
    )


def read(
    solution: Solution, contact: str | None = None, *, points: ArrayLike | None = None
) -> Solution:
    """Return a solution whose `data` hold the fields of a contact at all samples too.

    Variables `slip_ratio_<contact>` `[T, N]` [-] and `forces_<contact>` `[T, d, N]` [N], and with `points` `[P, 2]` [m]
    in the contact frame `displacement_<contact>` `[T, P, 2]` [m], as the functions of these names return them.
    `contact` is a name; None takes the only one. Bristles have to be recorded: `simulate(scene, bristles="all")`.

    Raises InvalidValueError if they are not, for a contact that does not exist, and as these functions do; FileError
    for a solution without its scene.
    """
    validation.instance("solution", solution, Solution, "a Solution")
    index = solution.contact_index(contact)
    chosen = scene_of(solution, "a field").contacts[index]
    recorded = solution.histories.get(f"bristles_{chosen.name}")
    if recorded is None:
        rule = "be recorded for fields: simulate(scene, bristles='all')"
        raise InvalidValueError("bristles", rule, "none")
    twist = solution.contact_twist(chosen.name)
    load = np.maximum(solution.histories["normal_force"].values[:, index], 0.0)
    at = recorded.values, twist, load
    cell = f"cell_{chosen.name}"
    new = {
        "slip_ratio": History(
            ("time", cell),
            slip_ratio(chosen.model, *at),
            {"units": "1", "long_name": "deflection over its limit"},
        ),
        "forces": History(
            ("time", "component", cell),
            forces(chosen.model, *at),
            {"units": "N", "long_name": "friction on the body, cell by cell"},
        ),
    }
    if points is not None:
        moved = displacement(chosen.model, at[0], markers(chosen.model, points))
        new["displacement"] = History(
            ("time", f"marker_{chosen.name}", "xy"),
            moved,
            {"units": "m", "long_name": "displacement of markers on the face of a pad"},
        )
    named = {f"{name}_{chosen.name}": each for name, each in new.items()}
    return dataclasses.replace(
        solution, histories={**dict(solution.histories), **named}
    )


def _by_forces(
    model: FrictionModel, few: DistributedModel, pad: HalfSpace, points: np.ndarray
) -> np.ndarray:
    """Return the displacement of points on a half-space per deflection of a bristle, `[P, 2, d, N]`.

    The force of a disc acts on its cells by their shares of the load, its torque along circles about its centre.
    """
    patch = model.patch
    law = pad.shear_modulus / pad.bodies, pad.poisson_ratio
    shears = half_space.compliances(points, patch.positions, patch.cell_extents(), *law)
    shears = shears.reshape(2, len(points), 2, patch.cells).swapaxes(0, 1)
    shears = shears / patch.areas
    assert few.pad is not None
    pieces = -few.pad.pieces(few.patch, few.law)
    if few.patch.cells == patch.cells:
        response = np.zeros((len(points), 2, few.patch.bristles, patch.cells))
        response[:, :, :2] = (
            shears * pieces
        )  # no spin of a single cell moves its neighbours
        return response
    members = clusters_of(
        patch,
        pad.shares(patch),
        model.cells,  # pyright: ignore[reportAttributeAccessIssue]
    )
    weights = patch.weights()
    x, y = patch.positions.T
    load = members.sums(weights)
    shifted = members.sums(shears * weights) / load
    turned = members.sums((shears[:, :, 1] * x - shears[:, :, 0] * y) * weights) / load
    centre_x, centre_y = members.sums(np.array([x, y]) * weights) / load
    square = members.sums((x * x + y * y) * weights) / load
    square -= centre_x**2 + centre_y**2
    turned -= centre_x * shifted[:, :, 1] - centre_y * shifted[:, :, 0]
    arm = few.patch.levers()[:, 2, 2]
    alone = square <= FLAT * arm**2
    turned *= np.where(alone, 0.0, arm / np.where(alone, 1.0, square))
    return np.concatenate([shifted, turned[:, :, None]], axis=2) * pieces


def _moved(points: np.ndarray) -> np.ndarray:
    """Return the displacements of points per displacement of a face about the origin, `[P, 2, 3]`."""
    moved = np.zeros((len(points), 2, 3))
    moved[:, 0, 0] = 1.0
    moved[:, 1, 1] = 1.0
    moved[:, 0, 2] = -points[:, 1]
    moved[:, 1, 2] = points[:, 0]
    return moved


def _spline(centres: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the displacement of points over those of the centres of cells, `[P, N]`."""
    from scipy.interpolate import RBFInterpolator

    middle = centres.mean(axis=0)
    size = np.abs(centres - middle).max()
    if np.linalg.matrix_rank(centres - middle, tol=FLAT * size) < 2:
        rule = "have three cells that are not on one line"
        raise InvalidValueError("patch", rule, f"{len(centres)} cells")
    spline = RBFInterpolator((centres - middle) / size, np.eye(len(centres)), degree=1)
    return spline((points - middle) / size)


def _cells_of(model: Any) -> DistributedModel:
    """Return the model of NumPy whose cells carry the bristles of a model."""
    few = model.reduction if isinstance(model, FrictionModel) else None
    if not isinstance(few, DistributedModel):
        rule = "be one of NumPy with bristles in cells or discs"
        raise InvalidValueError("model", rule, type(model).__name__)
    return few


def _bristles(model: Any, state: Any) -> tuple[Any, Any]:
    """Return the namespace of a model and its bristles `[..., d, N]`, without a face behind them."""
    if isinstance(model, CellsModel):
        z = shaped("state", model._number("state", state), model.state_shape)
        return model.xp, model.parted(z)[0]
    few = _cells_of(model)
    z, *_ = few._inputs(state, np.zeros(3), 0.0)
    return NUMPY, parted(few, z)[0]


def _contact(model: Any, state: Any, twist: Any, normal_force: Any) -> _Contact:
    """Return a model and checked inputs as arrays."""
    xp, z = _bristles(model, state)
    if isinstance(model, CellsModel):
        _, v, load = model._inputs(state, twist, normal_force)
        law, shape = model._contact_at(None)
    else:
        few = _cells_of(model)
        refuse_rate_law(few.law, "fields of a contact")
        _, v, load, _ = few._inputs(state, twist, normal_force)
        law = few.law.numbers
        stiff = None if few.pad is None else few.compiled.stiff
        shape = distributed.cells_of(few, 1.0, float)._replace(
            weights=few.patch.weights(load)[..., None, :], stiff=stiff
        )
    (seen,) = distributed.drive(xp, law, shape, v)
    return _Contact(xp, law, shape, z, seen, inner(load))
