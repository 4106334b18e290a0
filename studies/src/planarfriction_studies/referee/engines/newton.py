# pyright: reportMissingImports=false
"""Newton with its own friction in several of its solvers, in single precision on Warp's CPU device."""

from __future__ import annotations

import itertools
import logging
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from planarfriction_studies.referee.case import Body, Case, Shape
from planarfriction_studies.referee.engines import lacks, uniform
from planarfriction_studies.referee.engines.mujoco_warp import ROOM


@dataclass(frozen=True)
class Newton:
    """Newton with a solver and its options."""

    name: str
    settings: str
    solver: str
    """Name of its class."""
    mixing: tuple[float, float, float]
    """Numbers a, b, c: a pair has the coefficient mu if that of a fixed body is a, and that of the other b mu^c."""
    options: dict[str, Any] = field(default_factory=dict)
    package: str = "newton"

    def cannot(self, case: Case) -> str | None:
        """Return what Newton has no words for."""
        return lacks(case)

    def build(self, case: Case, dt: float) -> NewtonWorld:
        """Build the bodies of a case."""
        import newton
        import warp

        warp.config.log_level = logging.ERROR  # it reports what it compiles
        model, numbers = self._model(case)
        return NewtonWorld(
            case,
            model,
            numbers,
            getattr(newton.solvers, self.solver)(model, **self.options),
            dt,
        )

    def _friction(self, case: Case, body: Body) -> float:
        own = {shape.name for shape in body.shapes}
        mu = next(each.mu[0] for each in case.contacts if own & set(each.pair))
        fixed, factor, power = self.mixing
        return (
            mu
            if uniform(case)
            else fixed
            if body.joint == "fixed"
            else factor * mu**power
        )

    def _model(self, case: Case) -> tuple[Any, list[int]]:
        """Return a model in which listed pairs alone collide, and the numbers of the bodies that move."""
        import newton

        builder = newton.ModelBuilder()
        shapes = {}
        numbers = []
        newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
        for body in case.bodies:
            material = newton.ModelBuilder.ShapeConfig(
                mu=self._friction(case, body), density=0.0
            )
            number = _add(builder, body)
            numbers += [number] if number >= 0 else []
            for shape in body.shapes:
                place = np.array(shape.position) + (
                    0.0 if number >= 0 else np.array(body.position)
                )
                options = {
                    "body": number,
                    "xform": (tuple(place.tolist()), _turned(shape)),
                    "cfg": material,
                }
                add = getattr(builder, f"add_shape_{shape.kind}")
                shapes[shape.name] = add(**options, **_sizes(shape))
        touching = {frozenset(contact.pair) for contact in case.contacts}
        for one, other in itertools.combinations(shapes, 2):
            if frozenset((one, other)) not in touching:
                builder.add_shape_collision_filter_pair(shapes[one], shapes[other])
        builder.color()
        model = builder.finalize(device="cpu")
        model.set_gravity(np.array(case.gravity))
        return model, numbers


def _add(builder: Any, body: Body) -> int:
    """Add a body; return its number, -1 of a fixed one."""
    if body.joint == "fixed":
        return -1
    options = {
        "xform": (tuple(body.position), (0.0, 0.0, 0.0, 1.0)), "com": tuple(body.centre_of_mass), "mass": body.mass,
        "inertia": tuple(np.diag(body.moments).ravel().tolist()), "lock_inertia": True, "label": body.name,
    }  # fmt: skip
    if body.joint == "free":
        return builder.add_body(**options)
    number = builder.add_link(**options)
    joint = builder.add_joint_prismatic(
        -1, number, parent_xform=options["xform"], axis=(0.0, 0.0, 1.0)
    )
    builder.add_articulation([joint])
    return number


def _sizes(shape: Shape) -> dict[str, Any]:
    """Return sizes of a shape as its function of the builder takes them."""
    if shape.kind == "plane":
        return {"plane": None, "width": 0.0, "length": 0.0}
    if shape.kind == "box":
        return dict(zip(("hx", "hy", "hz"), shape.half.tolist(), strict=True))
    return {"radius": shape.size[0]} | (
        {"half_height": 0.5 * shape.size[1]} if len(shape.size) > 1 else {}
    )


def _turned(shape: Shape) -> tuple[float, ...]:
    """Return the quaternion (x, y, z, w) that turns z to the axis of the shape, which is x or z."""
    return (0.0, 0.5**0.5, 0.0, 0.5**0.5) if shape.axis[0] else (0.0, 0.0, 0.0, 1.0)


class NewtonWorld:
    """A case in Newton."""

    def __init__(
        self, case: Case, model: Any, bodies: list[int], solver: Any, dt: float
    ) -> None:
        import newton

        self.case = case
        self.bodies = bodies
        self._model = model
        self._solver = solver
        self._dt = dt
        self._now = model.state()
        self._next = model.state()
        self._control = model.control()
        self._collisions = newton.CollisionPipeline(model)
        self._contacts = self._collisions.contacts()

    def step(self, wrenches: np.ndarray) -> None:
        """Make a step; forces are forgotten after it."""
        forces = np.zeros((self._model.body_count, 6), np.float32)
        forces[self.bodies] = wrenches
        self._now.body_f.assign(forces)
        self._collisions.collide(self._now, self._contacts)
        self._solver.step(
            self._now, self._next, self._control, self._contacts, self._dt
        )
        self._now, self._next = self._next, self._now

    def poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions of the bodies' origins, and rotations."""
        found = self._now.body_q.numpy()[self.bodies].astype(float)
        (x, y, z, w) = found[:, 3:].T
        one = np.eye(3)
        cross = np.array(
            [[0.0 * x, -z, y], [z, 0.0 * x, -x], [-y, x, 0.0 * x]]
        ).transpose(2, 0, 1)
        return found[:, :3], one + 2.0 * w[:, None, None] * cross + 2.0 * cross @ cross

    def throw(self, body: int, velocity: np.ndarray) -> None:
        """Set the velocity of the centre of mass, of the body and of the joint that leaves it free."""
        import newton

        speeds = self._now.body_qd.numpy()
        speeds[self.bodies[body]] = velocity
        self._now.body_qd.assign(speeds)
        newton.eval_ik(self._model, self._now, self._now.joint_q, self._now.joint_qd)


_MEAN, _GEOMETRIC, _LARGEST = (0.0, 2.0, 1.0), (1.0, 1.0, 2.0), (0.0, 1.0, 1.0)
_CPU = "single precision, Warp's CPU device"

ENGINES = [
    Newton("Newton, XPBD", f"as it comes: 2 iterations; {_CPU}", "SolverXPBD", _MEAN),
    Newton("Newton, XPBD 20", f"20 iterations; {_CPU}", "SolverXPBD", _MEAN, {"iterations": 20}),
    Newton("Newton, VBD", f"as it comes; {_CPU}", "SolverVBD", _GEOMETRIC),
    Newton("Newton, MuJoCo", f"as it comes: MuJoCo Warp with its contacts; {_CPU}", "SolverMuJoCo", _LARGEST,
           {"njmax": ROOM, "nconmax": ROOM}),
]  # fmt: skip
