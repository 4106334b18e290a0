"""Bodies on patches with random sizes, laws and pushes, for tests and measurements of `coupling`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import planarfriction as pf
from planarfriction.coupling import CoupledPatches, HostStep

SHAPES = (
    pf.ContactPatch.disc(radius=0.01, cells=15),
    pf.ContactPatch.rectangle(0.05, 0.01, cells=15),
    pf.ContactPatch.disc(radius=0.003, cells=15),
)


def random_law(generator: np.random.Generator) -> pf.LuGre:
    """Soft and stiff, damped and not, with and without Stribeck effect and breakaway."""
    sigma_0 = generator.choice([1e4, 1e5, 1e6])
    breakaway = generator.choice([0.0, 0.5, 0.9])
    return pf.LuGre(
        mu_c=1.0,
        mu_s=generator.choice([1.0, 1.2, 1.6]),
        v_s=generator.choice([1e-3, 5e-3]),
        sigma_0=sigma_0,
        sigma_1=generator.choice([0.0, 0.8 * np.sqrt(sigma_0)]),
        sigma_2=generator.choice([0.0, 0.2]),
        elasto_plastic=breakaway or None,
    )


def random_patches(
    generator: np.random.Generator, count: int, kinds=(pf.ReducedModel,)
) -> CoupledPatches:
    """Patches of random shapes, laws and kinds of models."""
    shapes = generator.choice(len(SHAPES), count)
    laws = [random_law(generator) for _ in range(count)]
    chosen = [kinds[i] for i in generator.choice(len(kinds), count)]
    return CoupledPatches(
        [
            kind(SHAPES[i], law)
            for kind, i, law in zip(chosen, shapes, laws, strict=True)
        ]
    )


class Bodies(NamedTuple):
    """E rigid bodies on k patches each."""

    jacobian: np.ndarray
    """Jacobian of the patches' twists, `[E, 3k, 3]`."""
    mass: np.ndarray
    """Masses of x and y [kg], moment of inertia of the angle [kg m^2], `[E, 3]`."""
    size: np.ndarray
    """`[E]` [m]"""
    response: np.ndarray
    """d twist / d wrench, `[E, 3k, 3k]`."""
    load_response: np.ndarray
    """`[E, k, 3k]`"""
    load: np.ndarray
    """`[E, k]`"""
    dt: np.ndarray
    """`[E]`"""


def random_bodies(
    generator: np.random.Generator, count: int, k: int, height: float = 0.0
) -> Bodies:
    """Bodies of 10 g to 10 kg, half of them with patches that give a little, with time steps from 0.1 to 10 ms.

    `height` of the centre of mass over the patches, in sizes: friction tilts the load from one patch to another.
    """
    dt = 10.0 ** generator.uniform(-4.0, -2.0, count)
    size = 10.0 ** generator.uniform(-2.0, -0.5, count)
    mass = 10.0 ** generator.uniform(-2.0, 1.0, (count, 1)) * np.ones(3)
    mass[:, 2] *= size**2 * generator.uniform(0.1, 1.0, count)
    places = generator.uniform(-1.0, 1.0, (count, k, 2)) * size[:, None, None]
    angle = generator.uniform(0.0, 2.0 * np.pi, (count, k))
    c = np.cos(angle)
    s = np.sin(angle)
    x, y = np.moveaxis(places, -1, 0)
    zero = np.zeros_like(c)
    one = np.ones_like(c)
    rows = [[c, s, x * s - y * c], [-s, c, x * c + y * s], [zero, zero, one]]
    jacobian = np.moveaxis(np.array(rows), (0, 1), (2, 3)).reshape(count, 3 * k, 3)
    response = np.einsum("eia,ea,eja->eij", jacobian, dt[:, None] / mass, jacobian)
    own = np.where(
        generator.uniform(size=count) < 0.5,
        10.0 ** generator.uniform(-3.0, 0.0, count),
        0.0,
    )
    response += (
        own[:, None, None] * np.eye(3 * k) * np.tile(dt[:, None] / mass, k)[:, None, :]
    )
    centred = places - places.mean(axis=1, keepdims=True)
    tilt = np.linalg.pinv(np.moveaxis(centred, 1, 2), rcond=0.1)
    load_response = np.zeros((count, k, 3 * k))
    for p in range(k):
        turn = np.moveaxis(jacobian[:, 3 * p : 3 * p + 2, :2], 1, 2)
        load_response[:, :, 3 * p : 3 * p + 2] = (
            -height * size[:, None, None] * (tilt @ turn)
        )
    load = 9.81 / k * mass[:, :1] * generator.uniform(0.3, 3.0, (count, k))
    return Bodies(jacobian, mass, size, response, load_response, load, dt)


def _host(bodies: Bodies, free, load, wrench) -> HostStep:
    """Return the step of a host that carries bodies."""
    count, k = load.shape
    places = count, k, 3
    return HostStep(
        free.reshape(places),
        load,
        wrench.reshape(places),
        bodies.response,
        bodies.load_response,
    )


def random_run(
    generator: np.random.Generator, patches: CoupledPatches, bodies: Bodies, steps: int
):
    """Slide, spin, stick, be pushed and lifted: yields `(state, host, dt, step)` of each step of all bodies."""
    count, k = bodies.load.shape
    state = np.zeros((count, *patches.state_shape))
    wrench = np.zeros((count, 3 * k))
    unit = np.stack([np.ones(count), np.ones(count), 1.0 / bodies.size], 1)
    fast = unit * 10.0 ** generator.uniform(-3.0, 0.5, (count, 1))

    def kick(share: float) -> np.ndarray:
        kicked = (
            fast
            * generator.normal(size=(count, 3))
            * (generator.uniform(size=(count, 1)) < share)
        )
        return np.einsum("eia,ea->ei", bodies.jacobian, kicked)

    twist = kick(0.5)
    force = np.zeros((count, 3))
    weight = bodies.load.sum(axis=1)[:, None] / unit
    for _ in range(steps):
        pushed = generator.uniform(size=(count, 1)) < 0.15
        pushes = (
            weight
            * generator.normal(size=(count, 3))
            * generator.choice([0.0, 0.3, 1.0, 2.0], (count, 1))
        )
        force = np.where(pushed, pushes, force)
        moved = np.einsum(
            "eia,ea->ei", bodies.jacobian, bodies.dt[:, None] * force / bodies.mass
        )
        free = (
            twist
            + kick(0.05)
            + moved
            + np.einsum("eij,ej->ei", bodies.response, wrench)
        )
        changes = np.where(
            generator.uniform(size=(count, 1)) < 0.9,
            1.0 + 0.1 * generator.normal(size=(count, k)),
            10.0 ** generator.uniform(-2.0, 0.5, (count, k)),
        )
        load = np.maximum(
            bodies.load * changes
            + np.einsum("epj,ej->ep", bodies.load_response, wrench),
            0.0,
        )
        host = _host(bodies, free, load, wrench)
        step = patches.step(state, host, bodies.dt)
        yield state, host, bodies.dt, step
        state = step.state
        wrench = step.wrench.reshape(count, -1)
        twist = step.twist.reshape(count, -1)


def abrupt_run(
    generator: np.random.Generator,
    patches: CoupledPatches,
    count: int,
    height: float,
    steps: int,
):
    """Yield as `random_run` does, with other bodies in each step: a host whose contacts jump."""
    k = len(patches.models)
    state = np.zeros((count, *patches.state_shape))
    wrench = np.zeros((count, 3 * k))
    for _ in range(steps):
        bodies = random_bodies(generator, count, k, height)
        unit = np.stack([np.ones(count), np.ones(count), 1.0 / bodies.size], 1)
        speed = (
            unit
            * 10.0 ** generator.uniform(-3.0, 0.5, (count, 1))
            * generator.normal(size=(count, 3))
        )
        free = np.einsum("eia,ea->ei", bodies.jacobian, speed) + np.einsum(
            "eij,ej->ei", bodies.response, wrench
        )
        tilted = np.einsum("epj,ej->ep", bodies.load_response, wrench)
        load = np.maximum(
            bodies.load * (1.0 + 0.1 * generator.normal(size=(count, k))) + tilted, 0.0
        )
        host = _host(bodies, free, load, wrench)
        step = patches.step(state, host, bodies.dt)
        yield state, host, bodies.dt, step
        state = step.state
        wrench = step.wrench.reshape(count, -1)
