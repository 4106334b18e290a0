"""Choice of contacts with patch friction, and preparation of a plant for it."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.geometry import (
    Capsule,
    Cylinder,
    Ellipsoid,
    GeometryId,
    ProximityProperties,
    Role,
    RoleAssign,
    Sphere,
)
from pydrake.multibody.plant import CoulombFriction
from pydrake.multibody.tree import BodyIndex, FrameIndex

from planarfriction._engine.coupled import placing
from planarfriction._support import validation
from planarfriction._support.equality import Checked
from planarfriction.coupling import follows
from planarfriction.errors import InvalidValueError
from planarfriction.models import FrictionModel

CENTRES = ("auto", "frame", "contact")
"""Ways to place the centre of a patch."""

PRESSURES = ("auto", "follows", "fixed", "surface")
"""Ways to place the pressure of a patch."""

_ROUND = Sphere, Capsule, Ellipsoid
"""Shapes that touch in points, not faces."""

_MATERIAL = ("material", "coulomb_friction")


@dataclass(frozen=True)
class PatchContact(Checked):
    """A contact patch between two geometries, attached to the body of a frame.

    The x axis of the patch is that of the frame, projected on the contact plane; where it lies along the normal at the
    first contact, the y axis of the frame takes its place. On a body that rolls it does not reverse as the frame's
    does: within 30 degrees of the normal it goes along with the body, and then is on the same side as before. Bristles
    are carried into the axes of each step. The normal points into the frame's body. The twist is that of this body
    relative to the other one, and the wrench acts on this body.

    Raises InvalidValueError unless `geometries` are two names, `centre` is an option and `model` a friction model.
    """

    model: FrictionModel
    frame: str
    """Name of a frame on the body that owns the patch."""
    geometries: tuple[str, str]
    """Names of the two collision geometries in contact, or of bodies, which stand for all their geometries."""
    centre: str = "auto"
    """Origin of the patch in the plane of the contact: below that of the "frame" along the normal, or the centre of the
    forces of "contact"; "auto" follows the contact of a side that is a single sphere, capsule or ellipsoid, and of the
    curved side of a single cylinder."""
    pressure: str = "auto"
    """Pressure that "follows" the moments of the contact forces (see `ContactPatch.weights`), or is "fixed" to the
    patch; "auto" is fixed if one side is a single sphere, capsule or ellipsoid. With "surface" the cells bear the
    pressure of Drake's hydroelastic contact surface where they lie (see `FrictionModel.step`, `loads`), and that of the
    patch where Drake has points of contact."""

    def __post_init__(self) -> None:
        validation.instance("model", self.model, FrictionModel, "a friction model")
        validation.text("frame", self.frame)
        names = self.geometries
        if isinstance(names, str) or not (
            isinstance(names, Sequence) and len(names) == 2
        ):
            raise InvalidValueError(
                "geometries",
                "be the names of two geometries or bodies",
                self.geometries,
            )
        self._set(
            geometries=tuple(
                validation.text("geometries", name) for name in self.geometries
            )
        )
        validation.choice("centre", self.centre, CENTRES)
        validation.choice("pressure", self.pressure, PRESSURES)


class Placed:
    """A patch found in a plant."""

    def __init__(self, plant: Any, scene_graph: Any, patch: PatchContact) -> None:
        self.patch = patch
        self.frame = _frame(plant, patch.frame)
        sides = [_geometries(plant, scene_graph, name) for name in patch.geometries]
        bodies = [_body_of(plant, scene_graph, side[0]) for side in sides]
        owner = self.frame.body()
        if owner.index() not in [body.index() for body in bodies]:
            raise InvalidValueError(
                "frame",
                f"be on the body of one of the geometries {patch.geometries}",
                patch.frame,
            )
        if bodies[0].index() == bodies[1].index():
            raise InvalidValueError("geometries", "be on two bodies", patch.geometries)
        own = int(bodies[1].index() == owner.index())
        self.other = bodies[1 - own].body_frame()
        self.pairs = {
            (a.get_value(), b.get_value())
            for a, b in itertools.product(sides[own], sides[1 - own])
        }
        """Pairs of ids of geometries, the owner's first."""
        inspector = scene_graph.model_inspector()
        self._check_friction(inspector, sides)
        shapes = [
            inspector.GetShape(side[0]) if len(side) == 1 else None for side in sides
        ]
        faces = not any(isinstance(shape, _ROUND) for shape in shapes)
        self.follows = patch.pressure == "follows" or (
            patch.pressure == "auto" and faces and follows(patch.model)
        )
        """True if the pressure follows the contact forces."""
        self.surface = None
        """Cells `[3, N]` of a patch with the pressure of a contact surface: x, y, and radii of their discs [m]."""
        if patch.pressure == "surface":
            cells = patch.model.patch
            patch.model._bearing(cells.areas)  # knows loads of cells
            self.surface = np.array([*cells.positions.T, np.sqrt(cells.areas / np.pi)])
        self.centre = CENTRES.index(patch.centre)
        """Origin of the patch, one of those of `placing`."""
        self.round = not faces
        self.cylinders = [
            (
                body.body_frame(),
                inspector.GetPoseInFrame(side[0]).rotation().matrix()[:, 2],
            )
            for body, side, shape in zip(bodies, sides, shapes, strict=True)
            if isinstance(shape, Cylinder)
        ]
        """Frames of bodies that are single cylinders, and the axes of these in them."""

        smaller = min((own, 1 - own), key=lambda side: _size(inspector, sides[side]))
        self.goes = smaller == own
        """True if the patch goes along with the own side over the other, which is larger."""
        self.carrier = bodies[smaller].body_frame()
        self.middle = np.mean(
            [inspector.GetPoseInFrame(each).translation() for each in sides[smaller]],
            axis=0,
        )
        """Middle of the smaller side in this frame [m]."""

    def misplaced_line(self, fault: int) -> str:
        """Return a line about a patch that does not lie in its contact."""
        return placing.fault_line(
            "frame", self.patch.frame, self.patch.geometries, fault
        )

    def _check_friction(self, inspector: Any, sides: list[list[GeometryId]]) -> None:
        """Refuse pairs with friction of their own, and those that never touch."""
        pairs = list(itertools.product(*sides))
        between = " and ".join(self.patch.geometries)
        if all(inspector.CollisionFiltered(*pair) for pair in pairs):
            raise InvalidValueError(
                "geometries",
                "be able to collide (a collision filter keeps them apart)",
                between,
            )
        least = max(min(_friction(inspector, one) for one in pair) for pair in pairs)
        if least > 0.0:
            raise InvalidValueError(
                "friction",
                f"be 0 on {between}, on one of the two (prepare does that)",
                least,
            )


def prepare(plant: Any, scene_graph: Any, patches: Iterable[PatchContact]) -> None:
    """Remove Drake's own friction from the first of the two `geometries` of each patch.

    In Drake, friction belongs to geometries, not to pairs of them: the first then has only that of its patch.

    Raises `InvalidValueError` for geometries that are not in the plant.
    """
    inspector = scene_graph.model_inspector()
    for patch in checked(patches):
        for geometry in _geometries(plant, scene_graph, patch.geometries[0]):
            properties = ProximityProperties(inspector.GetProximityProperties(geometry))
            properties.UpdateProperty(*_MATERIAL, CoulombFriction(0.0, 0.0))
            scene_graph.AssignRole(
                plant.get_source_id(), geometry, properties, RoleAssign.kReplace
            )


def checked(patches: Iterable[PatchContact]) -> list[PatchContact]:
    """Raise for what is no patch."""
    if isinstance(patches, PatchContact) or not isinstance(patches, Iterable):
        raise InvalidValueError("patches", "be a list of patches", patches)
    return [
        validation.instance("patches", patch, PatchContact, "patches")
        for patch in patches
    ]


def found(
    plant: Any, scene_graph: Any, patches: Iterable[PatchContact]
) -> list[Placed]:
    """Find the patches in a plant; raise for the same pair of geometries twice."""
    placed = [Placed(plant, scene_graph, patch) for patch in checked(patches)]
    if not placed:
        raise InvalidValueError("patches", "hold at least one", "none")
    for one, other in itertools.combinations(placed, 2):
        if one.pairs & ({*other.pairs} | {(b, a) for a, b in other.pairs}):
            raise InvalidValueError(
                "patches",
                "have each pair of geometries once",
                " and ".join(one.patch.geometries),
            )
    return placed


# ---------------------------------------------------------------------- names


def _frame(plant: Any, name: str) -> Any:
    frames = [plant.get_frame(FrameIndex(i)) for i in range(plant.num_frames())]
    return _one(
        "frame",
        "frame",
        {frame.scoped_name().get_full(): frame for frame in frames},
        name,
    )


def _geometries(plant: Any, scene_graph: Any, name: str) -> list[GeometryId]:
    """Return the collision geometries that a name stands for: one, or all of a body."""
    inspector = scene_graph.model_inspector()
    named = {
        f"{_body_of(plant, scene_graph, each).scoped_name().get_full()}::{inspector.GetName(each)}": each
        for each in inspector.GetAllGeometryIds(Role.kProximity)
    }
    own = _ending(named, name)
    if own:
        return [_one("geometries", "geometry", named, name)]
    bodies = [plant.get_body(BodyIndex(i)) for i in range(plant.num_bodies())]
    body = _one(
        "geometries",
        "collision geometry or body",
        {b.scoped_name().get_full(): b for b in bodies},
        name,
    )
    geometries = plant.GetCollisionGeometriesForBody(body)
    if not geometries:
        raise InvalidValueError(
            "geometries", "be a body with collision geometries", name
        )
    return geometries


def _one(what: str, kind: str, named: dict[str, Any], name: str) -> Any:
    keys = _ending(named, name)
    if not keys:
        raise InvalidValueError(what, f"be a {kind} of the plant", name)
    if len(keys) > 1:
        raise InvalidValueError(what, f"be one {kind} ({' or '.join(keys)})", name)
    return named[keys[0]]


def _ending(named: dict[str, Any], name: str) -> list[str]:
    """Return the full names, with that of the model before, that a name may mean."""
    return [full for full in named if full == name or full.endswith(f"::{name}")]


def _size(inspector: Any, side: list[GeometryId]) -> float:
    """Return the size of a side: half the diagonal of the box around its largest geometry [m]."""
    boxes = [inspector.GetObbInGeometryFrame(each) for each in side]
    return max(
        np.inf if box is None else float(np.linalg.norm(box.half_width()))
        for box in boxes
    )


def _body_of(plant: Any, scene_graph: Any, geometry: GeometryId) -> Any:
    return plant.GetBodyFromFrameId(scene_graph.model_inspector().GetFrameId(geometry))


def _friction(inspector: Any, geometry: GeometryId) -> float:
    properties = inspector.GetProximityProperties(geometry)
    if not properties.HasProperty(*_MATERIAL):
        return np.inf  # the scene graph's own default, which is above zero
    return properties.GetProperty(*_MATERIAL).dynamic_friction()
