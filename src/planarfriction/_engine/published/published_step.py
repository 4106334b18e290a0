"""The step of the published reduced model with its derivatives.

In scaled coordinates, `V_S = S V` at the centre of pressure with `S = diag(1, 1, r)`, the bristle `S^-1 z` steps as in
`bristle_step`, driven by `u = h(V) |V_S|` with `h = |u|/|V_S|` (docs/physics.md, "The 3-state model").
`derivatives` writes the derivatives, and the limit surface gives `du/dV_S`; its numbers are held fixed: r acts through
`V_S` alone.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction._engine.bristles import bristle_step
from planarfriction._engine.bristles.law import PARAMETERS, inverse_deflection
from planarfriction._engine.codegen.derivatives import derive
from planarfriction._engine.codegen.vectors import (
    Vector,
    applied_back,
    norm,
    plus,
    put,
    three,
    times,
)
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles, Place, at, reader
from planarfriction._engine.protocol import step_functions
from planarfriction._engine.published import published_contact
from planarfriction._engine.published.published_contact import (
    PublishedContact,
    PublishedPatch,
    per_h,
    through,
)
from planarfriction._engine.published.surfaces import sliding, sliding_jacobian
from planarfriction.formulas import LawNumbers

NAMES = (*LawNumbers._fields, *PublishedPatch._fields)
"""Numbers of a contact, in the order of its row."""

STILL = 1e-100
"""Scaled speed [m/s] up to which a patch is at rest: its square is a number."""

shape_of = reader(PublishedPatch)


class PublishedContactData(NamedTuple):
    """A contact as the functions of a model see it."""

    law: tuple
    shape: tuple
    surface: tuple
    """Kind, offset and size of the limit surface: three integers."""
    data: np.ndarray
    """Numbers of the limit surfaces, flat."""


class Cotangents(NamedTuple):
    """Cotangents of all inputs of a step."""

    state: tuple
    twist: tuple
    law: tuple
    shape: tuple


class HeldTwist(NamedTuple):
    """Twist of a step, and numbers that follow from the twist alone."""

    twist: tuple
    """V_S"""
    omega: float
    v: float
    """Norm of V_S."""
    u: tuple


class PublishedStep(NamedTuple):
    """A step and the tape of its derivatives."""

    drive: HeldTwist
    tape: tuple
    new: tuple
    """State after the step."""
    wrench: tuple
    """Wrench about the origin, per unit load."""


@kernel
def scaled_twist(shape: PublishedPatch, twist: Vector) -> Vector:
    """Return `V_S`; rest up to `STILL`, below which the squares in its norm leave the range of numbers."""
    vx, vy, omega = twist
    scaled = (
        vx - omega * shape.centre_y,
        vy + omega * shape.centre_x,
        shape.contact_radius * omega,
    )
    return times(xp.where(norm(scaled) > STILL, 1.0, 0.0), scaled)


@kernel
def hold(contact: PublishedContactData, twist: Vector) -> HeldTwist:
    """Return `HeldTwist` at a twist."""
    surface = contact.surface
    scaled = scaled_twist(contact.shape, twist)
    v = norm(scaled)
    u = sliding(
        surface[0],
        contact.data,
        surface[1],
        surface[2],
        scaled[0],
        scaled[1],
        scaled[2],
        v,
    )
    return HeldTwist(scaled, twist[2], v, u)


@kernel
def hold_slopes(
    contact: PublishedContactData, twist: Vector, work: Doubles
) -> tuple[HeldTwist, Vector]:
    """Return `HeldTwist`, and `du/dV_S` row by row."""
    drive = hold(contact, twist)
    surface = contact.surface
    j = work
    x, y, s = drive.twist
    sliding_jacobian(
        surface[0], contact.data, surface[1], surface[2], x, y, s, drive.v, j
    )
    return drive, (j[0], j[1], j[2], j[3], j[4], j[5], j[6], j[7], j[8])


@kernel
def _step(
    law: LawNumbers,
    shape: PublishedPatch,
    twist: Vector,
    omega: float,
    u: Vector,
    z: Vector,
    dt: float,
) -> tuple[Vector, Vector]:
    """Return the new state and the wrench at V_S = `twist`, where the limit surface gives u."""
    r = shape.contact_radius
    v = norm(twist)
    scaled = z[0], z[1], z[2] / r
    new, k = bristle_step.step(
        law, scaled, u, v, per_h(u, v), inverse_deflection(law, v), dt
    )
    rate = plus(u, -k, new)
    fx = formulas.traction(new[0], rate[0], twist[0], law)
    fy = formulas.traction(new[1], rate[1], twist[1], law)
    fs = formulas.traction(new[2], rate[2], 0.0, law)
    tau = r * fs + formulas.traction(0.0, 0.0, shape.second_moment * omega, law)
    after = new[0], new[1], r * new[2]
    wrench = fx, fy, tau + shape.centre_x * fy - shape.centre_y * fx
    return after, wrench


_BY = (
    "z",
    "u",
    "twist",
    "omega",
    *(f"law.{n}" for n in PARAMETERS),
    *(f"shape.{n}" for n in PublishedPatch._fields),
)
DERIVATIVE = derive(_step, _BY, {"z": 3, "u": 3, "twist": 3})
_forth = DERIVATIVE.forth
_back = DERIVATIVE.back


@kernel
def taped_step(
    contact: PublishedContactData, drive: HeldTwist, z: Vector, dt: float
) -> PublishedStep:
    """Return `PublishedStep` from the raw state z."""
    (new, wrench), tape = _forth(
        contact.law, contact.shape, drive.twist, drive.omega, drive.u, z, dt
    )
    return PublishedStep(drive, tape, new, wrench)


@kernel
def pull_back(
    contact: PublishedContactData,
    step: PublishedStep,
    slopes: Vector,
    new: Vector,
    wrench: Vector,
) -> Cotangents:
    """Return `Cotangents` from the cotangents of the new state and of the wrench."""
    shape = contact.shape
    omega = step.drive.omega
    bars = _back(step.tape, (new, wrench))
    z, u, twist, turn = bars[:4]
    x, y, s = plus(twist, 1.0, applied_back(slopes, u))
    by_shape = PublishedPatch(*bars[12:])
    return Cotangents(
        z,
        (
            x,
            y,
            turn + shape.contact_radius * s + shape.centre_x * y - shape.centre_y * x,
        ),
        LawNumbers(*bars[4:11], 0.0, bars[11], 0.0),
        plus(by_shape, omega, (y, -x, s, 0.0)),  # through V_S
    )


# ---------------------------------------------------------------------- steps of a contact in axes of its own


@kernel
def _spins(record: PublishedContact) -> float:
    """Return 1; 0 of a point, whose third state has no effect and keeps its value."""
    return xp.where(record.shape.contact_radius > 0.0, 1.0, 0.0)


@kernel
def read(contact: Place) -> tuple[PublishedContact, PublishedContactData]:
    """Return the record of a contact, and the contact about its centre of pressure, in the axes of its metric.

    A point slides as a patch of any size does that does not spin.
    """
    record = published_contact.read(contact)
    spins = _spins(record)
    radius = record.shape.contact_radius
    shape = PublishedPatch(
        0.0, 0.0, xp.where(spins > 0.0, radius, 1.0), spins * record.shape.second_moment
    )
    return record, PublishedContactData(
        record.law, shape, (record.kind, 0, record.size), record.data
    )


@kernel
def seen(record: PublishedContact, v: Vector) -> Vector:
    """Return a twist in these axes."""
    x, y = through(record.root, v[0], v[1])
    return (
        x - record.shape.centre_y * v[2],
        y + record.shape.centre_x * v[2],
        _spins(record) * v[2],
    )


@kernel
def wrench_of(record: PublishedContact, w: Vector) -> Vector:
    """Return a wrench in these axes about the origin; a point has no torque."""
    x, y = through(record.root, w[0], w[1])
    return (
        x,
        y,
        record.shape.centre_x * w[1]
        - record.shape.centre_y * w[0]
        + _spins(record) * w[2],
    )


def step(
    contact: Place, z: Doubles, v: Doubles, dt: float, new: Doubles, out: Doubles
) -> None:
    """Step a contact (see `protocol.StepFunctions`)."""
    (record, framed) = read(contact)
    z = three(z)
    spins = _spins(record)
    done = taped_step(
        framed, hold(framed, seen(record, three(v))), (z[0], z[1], spins * z[2]), dt
    )
    put(new, (done.new[0], done.new[1], spins * done.new[2] + (1.0 - spins) * z[2]))
    put(out, wrench_of(record, done.wrench))


def slopes(
    contact: Place,
    z: Doubles,
    v: Doubles,
    dt: float,
    new: Doubles,
    out: Doubles,
    *,
    pull_back: Any,
    whole: bool,
) -> None:
    """Step a contact with the slopes of the wrench, or with all derivatives, the rows of the wrench first."""
    (record, framed) = read(contact)
    z = three(z)
    spins = _spins(record)
    drive, known = hold_slopes(framed, seen(record, three(v)), out)
    done = taped_step(framed, drive, (z[0], z[1], spins * z[2]), dt)
    put(new, (done.new[0], done.new[1], spins * done.new[2] + (1.0 - spins) * z[2]))
    put(out, wrench_of(record, done.wrench))
    for i in range(6 if whole else 3):
        unit = (
            (1.0 if i % 3 == 0 else 0.0),
            (1.0 if i % 3 == 1 else 0.0),
            (1.0 if i % 3 == 2 else 0.0),
        )
        of_wrench = times(0.0 if i > 2 else 1.0, unit)
        (x, y, s) = times(1.0 if i > 2 else 0.0, unit)
        bar = pull_back(framed, done, known, (x, y, spins * s), seen(record, of_wrench))
        put(at(out, 3 + 3 * i), wrench_of(record, bar.twist))
        if whole:
            x, y, s = plus(
                (bar.state[0], bar.state[1], spins * bar.state[2]),
                (1.0 - spins) * s,
                (0.0, 0.0, 1.0),
            )
            put(at(out, 21 + 3 * i), (x, y, s))


STEPS = step_functions("published", (step, slopes), pull_back=pull_back)
