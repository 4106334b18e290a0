"""A copy of a plant that predicts what its next step would be with other forces.

Discrete plants sample their forces before a step and their contacts at its end: what depends on both is needed earlier.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.framework import DiagramBuilder

from planarfriction._engine.cells.moment_pressure import NARROW
from planarfriction._engine.cells.surface_cells import press
from planarfriction._engine.coupled import placing
from planarfriction.adapters.drake.patches import Placed
from planarfriction.errors import InvalidValueError


class Shadow:
    """The copy, with three contexts: where a step begins, what it comes to, and where it would come to backwards."""

    def __init__(self, plant: Any, scene_graph: Any, placed: Sequence[Placed]) -> None:
        from scipy.linalg.lapack import dposv  # pyright: ignore[reportAttributeAccessIssue]

        self.plant = _copy("plant", plant)
        geometry = _copy("scene_graph", scene_graph)
        builder = DiagramBuilder()
        builder.AddSystem(self.plant)
        builder.AddSystem(geometry)
        builder.Connect(
            geometry.get_query_output_port(), self.plant.get_geometry_query_input_port()
        )
        poses = geometry.get_source_pose_port(plant.get_source_id())
        builder.Connect(self.plant.get_geometry_pose_output_port(), poses)
        self._diagram = builder.Build()
        self._roots = [self._diagram.CreateDefaultContext() for _ in range(3)]
        contexts = [
            self.plant.GetMyMutableContextFromRoot(root) for root in self._roots
        ]
        self._begin, self._end, self._backwards = contexts
        self._sampled = plant.has_sampled_output_ports()
        self.dt = plant.time_step()
        self._results = self.plant.get_contact_results_output_port()
        force = self.plant.get_applied_generalized_force_input_port()
        self._force = force.FixValue(self._begin, np.zeros(plant.num_velocities()))
        self._damping = self.dt * _damping(self.plant)
        self._frames = [self.plant.get_frame(each.frame.index()) for each in placed]
        self._others = [self.plant.get_frame(each.other.index()) for each in placed]
        self._carriers = [self.plant.get_frame(each.carrier.index()) for each in placed]
        self._placed = placed
        self.follows = [each.follows for each in placed]
        sizes = [
            0 if each.surface is None else each.surface.shape[1] for each in placed
        ]
        ends = np.cumsum([0, *sizes])
        self.covers = [slice(*ends[p : p + 2].tolist()) for p in range(len(placed))]
        """Places of the cells of each patch under contact surfaces among all of these."""
        self._reaches = [placing.reach_of(each.patch.model.patch) for each in placed]
        self._cylinders = [
            [
                (self.plant.get_frame(frame.index()), axis)
                for frame, axis in each.cylinders
            ]
            for each in placed
        ]
        self.faults = [0] * len(placed)
        """Faults of the places of the patches in the step, as those of `placing`."""
        self._pairs = {}
        for p, each in enumerate(placed):
            for own, other in each.pairs:
                self._pairs[other, own] = (p, 1.0)
                self._pairs[own, other] = (p, -1.0)
        self._solve = dposv  # the one of NumPy takes as long as a contact
        self._world = self.plant.world_frame()
        self._seen: list[Any] = [None] * len(placed)
        """Maps `[3, 6]` of motions to twists, and places of the patches on both bodies, as `rows` finds them."""
        self._axes: list[Any] = [None] * len(placed)
        """Origins and axes x and y of the patches in the world `[3, 3]`, as `rows` finds them."""
        self._points: list[tuple[int, int, float]] = []
        self._surfaces: list[tuple[int, int, float]] = []
        self._pressed: list[list[tuple[float, list[float]]]] = []

    def begin(self, state: np.ndarray, driven: dict[str, Any]) -> None:
        """Go to the beginning of a step, with what drives the plant besides generalized forces."""
        self.plant.SetPositionsAndVelocities(self._begin, state)
        for name, value in driven.items():
            self.plant.GetInputPort(name).FixValue(self._begin, value)

    def step(self, force: np.ndarray) -> np.ndarray:
        """Return the velocities at the end of a step with generalized forces `[nv]`."""
        self._force.GetMutableData().get_mutable_value().SetFromVector(force)
        if self._sampled:
            self.plant.CalcForcedUnrestrictedUpdate(
                self._begin, self._end.get_mutable_state()
            )
        else:
            self.plant.CalcForcedDiscreteVariableUpdate(
                self._begin, self._end.get_mutable_discrete_state()
            )
        return self.plant.GetVelocities(self._end)

    def pushes(self, *, first: bool) -> np.ndarray:
        """Return the normal forces in the step taken last on the bodies that own the patches, in the world `[k, 6]`.

        With their moments about the origin of the world behind. Which contacts are the patches' depends on where the
        step begins alone: found in its `first`.
        """
        results = self._contacts()
        if first:
            self._find(results)
        self._pressed = [[] for _ in self._frames]
        forces = [[0.0] * 6 for _ in self._frames]
        for i, p, sign in self._points:
            info = results.point_pair_contact_info(i)
            force = info.contact_force().tolist()
            place = info.contact_point().tolist()
            self._pressed[p].append((math.hypot(*force), place))
            _add(forces[p], sign, force, _cross(place, force))
        for i, p, sign in self._surfaces:
            info = results.hydroelastic_contact_info(i)
            spatial = info.F_Ac_W()
            place = info.contact_surface().centroid().tolist()
            force = spatial.translational().tolist()
            moment = spatial.rotational().tolist()
            self._pressed[p].append((math.hypot(*force), place))
            _add(
                forces[p], -sign, force, map(operator.add, moment, _cross(place, force))
            )
        return np.array(forces)

    def rows(self, p: int, force: np.ndarray, before: np.ndarray) -> tuple[Any, ...]:
        """Return the Jacobian of the twist of a patch `[3, nv]`, the normal, moments, the x axis, and how it turned.

        Moments are the maps `[2, 6]` of what `pushes` returns to (m_x, m_y) about the origin of the patch. The x axis
        `[3]` is in the frame of the patch, as that `before`; the last is the map `[2, 2]` from vectors in the axes of
        the last step, carried along, to these.
        """
        pose = self._frames[p].CalcPoseInWorld(self._begin)
        turned = pose.rotation().matrix()
        site = pose.translation()
        middle = self._centre(p)
        normal = _unit(force.tolist())
        centre = self._placed[p].centre
        curved = self._placed[p].round or any(
            placing.across(
                frame.CalcRotationMatrixInWorld(self._begin).matrix() @ axis, normal
            )
            > placing.CURVED
            for frame, axis in self._cylinders[p]
        )
        at_contact = centre == placing.AT_CONTACT or (centre == placing.AUTO and curved)
        place = (
            middle
            if at_contact
            else list(placing.onto_plane(site.tolist(), middle, normal))
        )
        origin = turned.T @ (place - site)
        first, second, third = (
            _across(each.tolist(), normal)
            for each in (turned[:, 0], turned[:, 1], turned @ before)
        )
        *x, c, s = placing.x_axis(first, second, third, normal)
        y = _cross(normal, x)
        self._axes[p] = np.array([place, x, y])
        away = list(map(operator.sub, middle, place))
        beyond = (
            max(placing.excess(_dot(x, away), _dot(y, away), 1.0, self._reaches[p]))
            > 0.0
        )
        upright = (
            not curved and placing.across(turned[:, 0], normal) < placing.MARGIN**2
        )
        self.faults[p] = (
            placing.BEYOND
            if beyond and not at_contact
            else placing.ALONG_X
            if upright
            else 0
        )
        measured = (
            JacobianWrtVariable.kV,
            self._frames[p],
            origin,
            self._others[p],
            self._world,
        )
        spatial = self.plant.CalcJacobianSpatialVelocity(
            self._begin,
            *measured,  # pyright: ignore[reportCallIssue]
        )
        seen = np.array(
            [[0.0, 0.0, 0.0, *x], [0.0, 0.0, 0.0, *y], [*normal, 0.0, 0.0, 0.0]]
        )
        self._seen[p] = (
            seen,
            [self._place(each[p], place) for each in (self._frames, self._others)],
        )
        return (
            seen @ spatial,
            normal,
            [[*_cross(place, x), *x], [*_cross(place, y), *y]],
            x @ turned,
            ((c, -s), (s, c)),
        )

    def pressed(self, p: int) -> np.ndarray:
        """Return loads and pressed shares of the cells of a patch `[2, N]` under its contact surfaces in this step."""
        place, *axes = self._axes[p]
        cells = self._placed[p].surface
        assert cells is not None
        found = np.zeros((2, cells.shape[1]))
        results = self._contacts()
        for i, owner, _ in self._surfaces:
            if owner == p:
                surface = results.hydroelastic_contact_info(i).contact_surface()
                corners, pressures, counts = _polygons(surface)
                # Counter-clockwise in the axes x and y, or in x and -y.
                side = 1.0 if surface.face_normal(0) @ np.cross(*axes) > 0.0 else -1.0
                flat = (corners - place) @ np.transpose(axes) * [1.0, side]
                begins = np.append(0, np.cumsum(counts))
                planes = _planes(flat, pressures, begins)
                x, y, radii = cells
                press(flat, begins, planes, x, side * y, radii, *found)
        return found

    def bends(self, patches: Iterable[int]) -> list[np.ndarray]:
        """Return what patches have moved in the step taken last, per dt, beyond their twists at its velocities `[3]`.

        Positions go straight, `q_1 = q_0 + dt N(q_0) v`, and points of what turns along arcs: to second order,

            x_1 - x_0 = dt J v + (x(q_0 + dt N v) + x(q_0 - dt N v) - 2 x(q_0)) / 2

        The contact moves on, and its normal turns (see `placing.bend`).
        """
        now = self.plant.GetPositions(self._begin)
        self.plant.SetPositions(
            self._backwards, 2.0 * now - self.plant.GetPositions(self._end)
        )
        return [self._bend(p) for p in patches]

    def _bend(self, p: int) -> np.ndarray:
        seen, places = self._seen[p]
        (own, own_back), (other, other_back) = map(self._moves, places)
        away = own - other
        normal = seen[2, :3]
        placed = self._placed[p]
        ends, begins = (
            self._carriers[p].CalcPoseInWorld(each) @ placed.middle
            for each in (self._end, self._begin)
        )
        over = (own if placed.goes else other)[3:] - (ends - begins)
        bend = 0.5 * (away + own_back - other_back)
        both = (own + other)[:3]
        apart = float(normal @ away[3:])
        bend[3:] += placing.bend(
            over.tolist(),
            away[:3].tolist(),
            both.tolist(),
            normal.tolist(),
            apart,
            1.0,
            1.0,
        )
        return seen @ bend / self.dt

    def _place(self, frame: Any, place: Sequence[float]) -> Any:
        """Return a frame that moves, a place of the world, the same in the frame, and how the world lies in this."""
        if frame.body().index() == self._world.body().index():
            return None
        pose = frame.CalcPoseInWorld(self._begin).inverse()
        return frame, np.array(place), pose @ np.array(place), pose.rotation().matrix()

    def _moves(self, at: Any) -> list[np.ndarray]:
        """Return how a frame turns and moves at its place in the step, and in one backwards `[6]`."""
        if at is None:
            return [np.zeros(6), np.zeros(6)]
        frame, place, point, turned = at
        poses = [
            frame.CalcPoseInWorld(context) for context in (self._end, self._backwards)
        ]
        return [
            np.array(
                [*_vector(pose.rotation().matrix() @ turned), *(pose @ point - place)]
            )
            for pose in poses
        ]

    def moved(self, jacobian: np.ndarray) -> tuple[np.ndarray, float]:
        """Return the velocities that wrenches cause in a step without contact `[nv, 3k]`: `dt (M + dt D)^-1 J'`.

        With the size of the momentum as Drake's solver weighs it, `sqrt(v'Mv)` [sqrt(J)].
        """
        metric = self.plant.CalcMassMatrix(self._begin)
        velocity = self.plant.GetVelocities(self._begin)
        momentum = math.sqrt(velocity @ metric @ velocity)
        metric.flat[:: len(metric) + 1] += self._damping
        _, found, _ = self._solve(metric, jacobian.T)
        return self.dt * found, momentum

    # ------------------------------------------------------------------ contacts

    def _contacts(self) -> Any:
        return self._results.Eval(self._end if self._sampled else self._begin)

    def _find(self, results: Any) -> None:
        """Return the contacts of the patches, and their signs: 1 where the owner is Drake's second body."""
        self._points = []
        self._surfaces = []
        for i in range(results.num_point_pair_contacts()):
            pair = results.point_pair_contact_info(i).point_pair()
            key = self._pairs.get((pair.id_A.get_value(), pair.id_B.get_value()))
            if key is not None:
                self._points.append((i, *key))
        for i in range(results.num_hydroelastic_contacts()):
            surface = results.hydroelastic_contact_info(i).contact_surface()
            key = self._pairs.get(
                (surface.id_M().get_value(), surface.id_N().get_value())
            )
            if key is not None:
                self._surfaces.append((i, *key))

    def _centre(self, p: int) -> list[float]:
        """Return the centre of the contacts of a patch, weighted by their forces."""
        total = sum(force for force, _ in self._pressed[p])
        return [
            sum(force * place[i] for force, place in self._pressed[p]) / total
            for i in range(3)
        ]


def _planes(corners: np.ndarray, values: np.ndarray, begins: np.ndarray) -> np.ndarray:
    """Return the planes `a + b x + c y` `[F, 3]` through values at the corners `[V, 2]` of polygons."""
    numbers = np.column_stack([corners, values])
    counts = np.diff(begins)[:, None]
    means = np.add.reduceat(numbers, begins[:-1]) / counts
    x, y, p = (numbers - np.repeat(means, counts[:, 0], axis=0)).T
    squares = np.column_stack([x * x, x * y, y * y, x * p, y * p])
    xx, xy, yy, xp, yp = np.add.reduceat(squares, begins[:-1]).T
    area = xx * yy - xy * xy
    flat = area > NARROW * (xx + yy) ** 2
    per = np.where(flat, 1.0 / np.where(flat, area, 1.0), 0.0)
    along_x = per * (yy * xp - xy * yp)
    along_y = per * (xx * yp - xy * xp)
    level = means[:, 2] - along_x * means[:, 0] - along_y * means[:, 1]
    return np.column_stack([level, along_x, along_y])


def _polygons(surface: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the corners `[V, 3]` of all faces of a contact surface, the pressures there, and how many each has."""
    if surface.is_triangle():
        mesh = surface.tri_mesh_W()
        field = surface.tri_e_MN()
        counts = np.full(mesh.num_triangles(), 3)
        corners = [each.vertex(i) for each in mesh.triangles() for i in range(3)]
    else:
        mesh = surface.poly_mesh_W()
        field = surface.poly_e_MN()
        counts = np.array(
            [mesh.element(f).num_vertices() for f in range(mesh.num_elements())]
        )
        faces = np.array(mesh.face_data())
        heads = np.cumsum([0, *(counts[:-1] + 1)])
        corners = np.delete(faces, heads)
    each = range(mesh.num_vertices())
    places = np.array([mesh.vertex(v) for v in each])
    pressures = np.array([field.EvaluateAtVertex(v) for v in each])
    return places[corners], pressures[corners], counts


# NumPy's own functions of three numbers take as long as a contact.


def _cross(one: Sequence[float], other: Sequence[float]) -> list[float]:
    (a, b, c) = one
    (d, e, f) = other
    return [b * f - c * e, c * d - a * f, a * e - b * d]


def _vector(matrix: np.ndarray) -> tuple[float, float, float]:
    """Return the vector of the antisymmetric part of a matrix."""
    (_, xy, xz), (yx, _, yz), (zx, zy, _) = matrix.tolist()
    return 0.5 * (zy - yz), 0.5 * (xz - zx), 0.5 * (yx - xy)


def _dot(one: Sequence[float], other: Sequence[float]) -> float:
    return sum(map(operator.mul, one, other))


def _across(vector: Sequence[float], normal: Sequence[float]) -> list[float]:
    along = _dot(vector, normal)
    return [a - along * b for a, b in zip(vector, normal, strict=True)]


def _unit(vector: Sequence[float]) -> list[float]:
    size = math.hypot(*vector)
    return [each / size for each in vector]


def _add(
    total: list[float], sign: float, force: Sequence[float], moment: Iterable[float]
) -> None:
    """Add a force and its moment to a total of six numbers, in place."""
    for i, each in enumerate((*force, *moment)):
        total[i] += sign * each


def _damping(plant: Any) -> np.ndarray:
    """Return the damping of the joints, which a discrete plant takes implicitly `[nv]`."""
    damping = np.zeros(plant.num_velocities())
    for index in plant.GetJointIndices():
        joint = plant.get_joint(index)
        if joint.num_velocities():
            first = joint.velocity_start()
            damping[first : first + joint.num_velocities()] = (
                joint.default_damping_vector()
            )
    return damping


def _copy(name: str, system: Any) -> Any:
    try:
        return system.Clone()
    except RuntimeError as error:
        raise InvalidValueError(
            name, "be one that Drake can clone", str(error).splitlines()[0]
        ) from None
