"""The step of the published reduced model with its derivatives, and what is bound to it (see `rollouts`).

In scaled coordinates, `V_S = S V` at the centre of pressure with `S = diag(1, 1, r)`, the bristle `S^-1 z` steps as in
`bristle_step`, driven by `u = h(V) |V_S|` with `h = |u|/|V_S|` (docs/physics.md, "The published reduced model"). With
cotangents W' of the wrench and z' of the new state, one step backwards is

    t = -((sigma_0 - sigma_1 k) n + sigma_1 u),   n' = -(sigma_0 - sigma_1 k) F + S z',   k' = sigma_1 F . n

with F the cotangent of the scaled traction t, then `bristle_step.pull_back`, and `V_S' = (du/dV_S)' u' + v' V_S/v`. The
numbers of the limit surface are held fixed: r acts through `V_S` alone.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import entry, jit, kernel
from planarfriction.compiler.calls import address_of
from planarfriction.compiler.memory import doubles, reader
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import bristle_step, rollouts
from planarfriction.kernels.bristle_step import Bristle, BristleStep
from planarfriction.kernels.published_contact import Shape
from planarfriction.kernels.rollouts import Cotangents
from planarfriction.kernels.surfaces import sliding, sliding_jacobian
from planarfriction.kernels.vectors import applied_back, dot, norm, plus

NAMES = (*LawNumbers._fields, *Shape._fields)
"""Numbers of a contact, in the order of its row."""

shape_of = reader(Shape)


class Held(NamedTuple):
    """What a step holds."""

    twist: tuple
    """V_S"""
    omega: float
    v: float
    u: tuple


class Step(NamedTuple):
    """A step with all that its cotangents need."""

    held: Held
    h: float
    stribeck: tuple
    """Friction coefficient and its partial derivatives."""
    bristle: BristleStep
    traction: tuple
    """Scaled, about the centre of pressure; its third component without the viscous term."""
    new: tuple
    """State."""
    wrench: tuple
    """About the origin, per unit load."""


@kernel
def scaled_twist(shape, twist):
    """`V_S`"""
    vx, vy, omega = twist
    return vx - omega * shape.centre_y, vy + omega * shape.centre_x, shape.contact_radius * omega


@kernel
def hold(contact, twist):
    """`Held` at a twist."""
    surface, scaled = contact.surface, scaled_twist(contact.shape, twist)
    v = norm(scaled)
    u = sliding(surface[0], contact.data, surface[1], surface[2], scaled[0], scaled[1], scaled[2], v)
    return Held(scaled, twist[2], v, u)


@kernel
def hold_slopes(contact, twist, work):
    """`Held`, and `du/dV_S` row by row."""
    held, surface, j = hold(contact, twist), contact.surface, work
    x, y, s = held.twist
    sliding_jacobian(surface[0], contact.data, surface[1], surface[2], x, y, s, held.v, j)
    return held, (j[0], j[1], j[2], j[3], j[4], j[5], j[6], j[7], j[8])


@kernel
def linearise(contact, held, z, dt):
    """`Step` from the raw state z."""
    law, shape = contact.law, contact.shape
    r, v = shape.contact_radius, held.v
    moves = v > 0.0
    h = xp.where(moves, norm(held.u) / xp.where(moves, v, 1.0), 1.0)
    stribeck = formulas.stribeck_partials(xp, v, law)
    bristle = Bristle((z[0], z[1], z[2] / r), held.u, v, 1.0 / h, law.sigma_0 / stribeck[0])
    step = bristle_step.linearise(law, bristle, dt)
    new = step.end.new
    rate = plus(held.u, -step.end.stage.k, new)
    fx = formulas.traction(new[0], rate[0], held.twist[0], law)
    fy = formulas.traction(new[1], rate[1], held.twist[1], law)
    fs = formulas.traction(new[2], rate[2], 0.0, law)
    tau = r * fs + formulas.traction(0.0, 0.0, shape.second_moment * held.omega, law)
    wrench = fx, fy, tau + shape.centre_x * fy - shape.centre_y * fx
    return Step(held, h, stribeck, step, (fx, fy, fs), (new[0], new[1], r * new[2]), wrench)


@kernel
def pull_back(contact, step, slopes, new, wrench):
    """`Cotangents` from those of the new state and of the wrench."""
    law, shape, held, b = contact.law, contact.shape, step.held, step.bristle
    n, k, z_s, q = b.end.new, b.end.stage.k, b.bristle.z[2], b.bristle.q
    cx, cy, r = shape.centre_x, shape.centre_y, shape.contact_radius
    wx, wy, wt = wrench
    g = wx - cy * wt, wy + cx * wt, r * wt
    g_n, g_u = dot(g, n), dot(g, held.u)
    bars = bristle_step.pull_back(
        b, plus((new[0], new[1], r * new[2]), law.sigma_1 * k - law.sigma_0, g), law.sigma_1 * g_n
    )
    # h = |u|/v, and the grip q = sigma_0/g(v)
    per_v = 1.0 / xp.where(held.v > 0.0, held.v, math.inf)
    u_bar = plus(plus(bars.u, -law.sigma_1, g), bars.h * per_v * per_v / step.h, held.u)
    mu, by_speed, by_mu_c, by_mu_s, by_v_s, by_gamma = step.stribeck
    mu_bar = -bars.q * q / mu
    along = (bars.v + mu_bar * by_speed - bars.h * per_v * step.h) * per_v
    x_bar, y_bar, s_bar = plus(plus(applied_back(slopes, u_bar), along, held.twist), -law.sigma_2, (g[0], g[1], 0.0))
    turn = law.sigma_2 * wt
    x, y, _ = held.twist
    return Cotangents(
        (bars.z[0], bars.z[1], bars.z[2] / r),
        (x_bar, y_bar, r * s_bar + cx * y_bar - cy * x_bar - turn * shape.second_moment),
        LawNumbers(
            bars.q / mu - g_n, k * g_n - g_u, -(g[0] * x + g[1] * y + wt * shape.second_moment * held.omega),
            mu_bar * by_mu_c, mu_bar * by_mu_s, mu_bar * by_v_s, mu_bar * by_gamma, 0.0, bars.breakaway, 0.0,
        ),
        Shape(
            wt * step.traction[1] + held.omega * y_bar, -wt * step.traction[0] - held.omega * x_bar,
            wt * step.traction[2] + new[2] * n[2] - bars.z[2] * z_s / r + held.omega * s_bar,
            -turn * held.omega,
        ),
    )  # fmt: skip


# ---------------------------------------------------------------------- bound to this model


@entry
def step(row, data, inputs, out):
    """See `rollouts.step`."""
    rollouts.step(shape_of, doubles, hold, linearise, row, data, inputs, out)


@functools.cache
def step_address() -> int:
    """Where `step` is in this process."""
    return address_of(step, "pppp")


@jit
def sensitivities(inputs, span, z, columns, wrenches, slopes):
    """See `rollouts.sensitivities`."""
    work = np.empty(rollouts.SCRATCH), np.empty((6, 7 + len(NAMES))), np.empty((6, columns.shape[0]))
    results = wrenches, slopes
    rollouts.sensitivities(shape_of, hold_slopes, linearise, pull_back, inputs, span, z, columns, results, work)


@jit
def tangent(inputs, span, z, changes, wrenches, slopes):
    """See `rollouts.tangent`."""
    work = np.empty(rollouts.SCRATCH), np.empty((6, 7 + len(NAMES)))
    rollouts.tangent(shape_of, hold_slopes, linearise, pull_back, inputs, span, z, changes, (wrenches, slopes), work)
