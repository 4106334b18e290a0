"""Derivatives of roll-outs of the reduced model by all numbers, those of the shape among them, contact by contact.

So they know patches whose shape follows the load, of which `reduced_rollout` knows nothing. With `u = F V` and
`W = F' g` the cotangent of F is that of u times V and g times that of W; the blend of two maps moves z_ss and, through
the fourth moments, the evenness of the states.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction.compiler import jit, kernel
from planarfriction.kernels import reduced_step, rollouts
from planarfriction.kernels.reduced_contact import Shape
from planarfriction.kernels.reduced_step import NAMES, Held, cotangents, hold, linearise, pulled, shape_of
from planarfriction.kernels.steady import FAR, STILL, blended, fourth_change, fourth_moments, scaled_twist, uneven
from planarfriction.kernels.vectors import dot, norm


class Slopes(NamedTuple):
    """Slopes of the steady state, and what those by the shape take."""

    held: tuple
    """`reduced_step.Slopes`"""
    q_blend: tuple
    twist: tuple


@kernel
def hold_slopes(contact, twist, work):
    """`Held` and `Slopes` at a twist; none at rest, where they have no effect."""
    law, shape = contact.law, contact.shape
    u, none = scaled_twist(shape, twist[0], twist[1], twist[2]), (0.0, 0.0, 0.0)
    v = norm(u)
    if v > STILL:
        found, q_blend = blended(law, shape, contact.surface, contact.data, u, v)
        slopes = reduced_step.Slopes(found.by_u, found.by_mu_c, found.by_mu_s, found.by_v_s)
        return Held(u, v, found.q), Slopes(slopes, q_blend, twist)
    still = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return Held(none, 0.0, (FAR, 0.0, 0.0)), Slopes(reduced_step.Slopes(still, none, none, none), none, twist)


@kernel
def _through_evenness(contact, step, ratio):
    """Cotangent of the blend through the evenness, a share of which moves the breakaway as that share of the ratio."""
    law, shape, surface, data = contact.law, contact.shape, contact.surface, contact.data
    fourth, change = fourth_moments(shape, surface, data), fourth_change(surface, data)
    at_start, ahead = uneven(law, fourth, change, step.start.z), uneven(law, fourth, change, step.predicted.z)
    at_end = uneven(law, fourth, change, step.free)
    return law.breakaway_ratio * dot(ratio, (at_start, ahead, at_end))


@kernel
def pull_back(contact, step, slopes, new, wrench):
    """`Cotangents` from those of the new state and of the wrench."""
    law, u = contact.law, step.held.u
    pull, bar = pulled(contact, step, slopes.held, new, wrench)
    (vx, vy, omega), (wx, wy, wt), (ux, uy, us) = slopes.twist, wrench, bar.u
    gx = formulas.traction(step.new[0], step.rate[0], u[0], law)
    gy = formulas.traction(step.new[1], step.rate[1], u[1], law)
    gs = formulas.traction(step.new[2], step.rate[2], u[2], law)
    blend = dot(slopes.q_blend, bar.q)
    if contact.surface[1] != contact.surface[0]:
        blend += _through_evenness(contact, step, bar.ratio)
    by_shape = Shape(
        ux * vx + gx * wx, ux * vy + gx * wy, ux * omega + gx * wt,
        uy * vy + gy * wy, uy * omega + gy * wt, us * omega + gs * wt,
        blend,
    )  # fmt: skip
    return cotangents(contact, step, slopes.held, pull, bar, by_shape)


# ---------------------------------------------------------------------- bound to this model


@jit
def rollout(inputs, span, z, wrench, states):
    """See `rollouts.roll`."""
    rollouts.roll(shape_of, hold, linearise, inputs, span, z, wrench, states)


@jit
def gradient(inputs, states, wrench_bar, span, bars):
    """See `rollouts.gradient`."""
    work = np.empty(rollouts.SCRATCH)
    rollouts.gradient(shape_of, hold_slopes, linearise, pull_back, inputs, states, wrench_bar, span, bars, work)


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
