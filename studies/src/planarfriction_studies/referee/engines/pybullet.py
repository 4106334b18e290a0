# pyright: reportMissingImports=false
"""PyBullet with its own friction."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction_studies.referee.case import Body, Case, Shape
from planarfriction_studies.referee.engines import lacks, uniform


@dataclass(frozen=True)
class Bullet:
    """PyBullet with parameters of `setPhysicsEngineParameter`."""

    name: str
    settings: str
    parameters: tuple[tuple[str, Any], ...] = ()
    package: str = "pybullet"

    def cannot(self, case: Case) -> str | None:
        """Return what PyBullet has no words for."""
        return lacks(case)

    def build(self, case: Case, dt: float) -> BulletWorld:
        """Build the bodies of a case in a server of its own."""
        return BulletWorld(case, dt, dict(self.parameters))


class Client:
    """Physics server of its own: the functions of PyBullet that act on it."""

    def __init__(self) -> None:
        import pybullet

        self._module = pybullet
        self._number = pybullet.connect(pybullet.DIRECT)  # pyright: ignore[reportAttributeAccessIssue]

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._module, name)
        return (
            functools.partial(found, physicsClientId=self._number)
            if callable(found)
            else found
        )

    def __del__(self) -> None:
        self.disconnect()


class BulletWorld:
    """A case in PyBullet; its poses are those of centres of mass."""

    def __init__(self, case: Case, dt: float, parameters: dict[str, Any]) -> None:
        self.case = case
        self.client = Client()
        client = self.client
        client.setGravity(*case.gravity)
        client.setTimeStep(dt)
        client.setPhysicsEngineParameter(**parameters)
        self.shapes = {
            shape.name: self._add(body)
            for body in case.bodies
            for shape in body.shapes[:1]
        }
        of = {body.name: self.shapes[body.shapes[0].name] for body in case.bodies}
        self.bodies = [of[body.name] for body in case.moving]
        own = {name: of[body.name][0] for name, (body, _) in case.shapes.items()}
        touching = {
            frozenset(own[name] for name in contact.pair) for contact in case.contacts
        }
        places = [(body, link) for body, link in of.values()]
        for i, (one, link) in enumerate(places):
            for other, other_link in places[i + 1 :]:
                if frozenset((one, other)) not in touching:
                    client.setCollisionFilterPair(one, other, link, other_link, 0)

    def _add(self, body: Body) -> tuple[int, int]:
        """Add a body; return its number and that of its link, which is on a slide or the base itself."""
        client = self.client
        mass = body.mass
        kinds = {
            "plane": client.GEOM_PLANE,
            "box": client.GEOM_BOX,
            "cylinder": client.GEOM_CYLINDER,
        }
        kinds |= {"capsule": client.GEOM_CAPSULE, "sphere": client.GEOM_SPHERE}
        if body.shapes[0].kind == "plane":
            found = client.createCollisionShape(client.GEOM_PLANE)
        else:
            numbers = [_numbers(shape) for shape in body.shapes]
            found = client.createCollisionShapeArray(
                shapeTypes=[kinds[shape.kind] for shape in body.shapes],
                **{key: [each[key] for each in numbers] for key in numbers[0]},
                collisionFramePositions=[list(shape.position) for shape in body.shapes],
                collisionFrameOrientations=[_turned(shape) for shape in body.shapes],
            )
        inertial = list(body.centre_of_mass)
        if body.joint == "slide":
            number = client.createMultiBody(
                0.0, -1, basePosition=list(body.position), linkMasses=[mass], linkCollisionShapeIndices=[found],
                linkVisualShapeIndices=[-1], linkPositions=[[0, 0, 0]], linkOrientations=[[0, 0, 0, 1]],
                linkInertialFramePositions=[inertial], linkInertialFrameOrientations=[[0, 0, 0, 1]],
                linkParentIndices=[0], linkJointTypes=[client.JOINT_PRISMATIC], linkJointAxis=[[0, 0, 1]],
            )  # fmt: skip
            client.setJointMotorControl2(number, 0, client.VELOCITY_CONTROL, force=0.0)
            link = 0
        else:
            middle = (np.array(body.position) + inertial).tolist()
            number = client.createMultiBody(
                mass, found, basePosition=middle, baseInertialFramePosition=inertial
            )
            link = -1
        moments = (
            {}
            if body.joint == "fixed"
            else {"localInertiaDiagonal": body.moments.tolist()}
        )
        client.changeDynamics(
            number,
            link,
            lateralFriction=self._friction(body),
            linearDamping=0.0,
            angularDamping=0.0,
            **moments,
        )
        return number, link

    def _friction(self, body: Body) -> float:
        """Return a coefficient of a body: PyBullet multiplies those of two."""
        own = {shape.name for shape in body.shapes}
        mu = next(each.mu[0] for each in self.case.contacts if own & set(each.pair))
        return mu**0.5 if uniform(self.case) else 1.0 if body.joint == "fixed" else mu

    def step(self, wrenches: np.ndarray) -> None:
        """Make a step; forces are forgotten after it."""
        for (body, link), wrench, (place, _) in zip(
            self.bodies, wrenches, self._centres(), strict=True
        ):
            self.client.applyExternalForce(
                body, link, wrench[:3].tolist(), list(place), self.client.WORLD_FRAME
            )
            self.client.applyExternalTorque(
                body, link, wrench[3:].tolist(), self.client.WORLD_FRAME
            )
        self.client.stepSimulation()

    def _centres(self) -> list[tuple[Any, Any]]:
        return [
            self.client.getBasePositionAndOrientation(body)
            if link < 0
            else self.client.getLinkState(body, link)[:2]
            for body, link in self.bodies
        ]

    def poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions of the bodies' origins, and rotations."""
        centres = self._centres()
        rotations = [
            np.reshape(self.client.getMatrixFromQuaternion(turn), (3, 3))
            for _, turn in centres
        ]
        levers = [
            turn @ np.array(body.centre_of_mass)
            for turn, body in zip(rotations, self.case.moving, strict=True)
        ]
        return np.array([place for place, _ in centres]) - np.array(levers), np.array(
            rotations
        )

    def throw(self, body: int, velocity: np.ndarray) -> None:
        """Set the velocity of the centre of mass."""
        self.client.resetBaseVelocity(
            self.bodies[body][0], velocity[:3].tolist(), velocity[3:].tolist()
        )


def _numbers(shape: Shape) -> dict[str, Any]:
    """Return sizes of a shape as arrays of shapes want them."""
    if shape.kind == "box":
        return {"halfExtents": shape.half.tolist(), "radii": 0.0, "lengths": 0.0}
    return {"halfExtents": [0, 0, 0], "radii": shape.size[0], "lengths": shape.size[-1]}


def _turned(shape: Shape) -> list[float]:
    """Return the quaternion (x, y, z, w) that turns z to the axis of the shape, which is x or z."""
    return [0.0, 0.5**0.5, 0.0, 0.5**0.5] if shape.axis[0] else [0.0, 0.0, 0.0, 1.0]


ENGINES = [
    Bullet("PyBullet", "as it comes: 50 iterations; damping of motion off"),
    Bullet(
        "PyBullet, cone", "cone friction, 200 iterations; damping of motion off",
        (("enableConeFriction", 1), ("numSolverIterations", 200)),
    ),
]  # fmt: skip
