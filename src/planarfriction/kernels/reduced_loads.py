"""Derivatives of roll-outs of the reduced model by all numbers, those of the shape among them, contact by contact.

So they know patches whose shape follows the load, of which `reduced_rollout` knows nothing. With `u = F V` and
`W = F' g` the cotangent of F is that of u times V and g times that of W; the blend of two maps moves z_ss and, through
the fourth moments, the evenness of the states.
"""

from __future__ import annotations

from typing import NamedTuple

from planarfriction.compiler import jit, kernel
from planarfriction.kernels import reduced_step, rollouts
from planarfriction.kernels.bind import bind
from planarfriction.kernels.derive import derive
from planarfriction.kernels.reduced import Quartic, to_origin
from planarfriction.kernels.reduced_contact import ReducedPatch
from planarfriction.kernels.reduced_step import (
    ReducedStep,
    SteadyTwist,
    cotangents,
    through_steady,
)
from planarfriction.kernels.steady import FAR, STILL, blended, fourth_change, fourth_moments, scaled_twist
from planarfriction.kernels.vectors import dot, norm


class BlendSlopes(NamedTuple):
    """BlendSlopes of the steady state, and what those by the shape take."""

    held: tuple
    """`reduced_step.SteadySlopes`"""
    q_blend: tuple
    twist: tuple


@kernel
def hold_slopes(contact, twist, work):
    """Return `SteadyTwist` and `BlendSlopes` at a twist; none at rest, where they have no effect."""
    law, shape = contact.law, contact.shape
    u, none = scaled_twist(shape, twist[0], twist[1], twist[2]), (0.0, 0.0, 0.0)
    v = norm(u)
    if v > STILL:
        found, q_blend = blended(law, shape, contact.surface, contact.data, u, v)
        slopes = reduced_step.SteadySlopes(found.by_u, found.by_mu_c, found.by_mu_s, found.by_v_s)
        return SteadyTwist(u, v, found.q), BlendSlopes(slopes, q_blend, twist)
    still = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return SteadyTwist(none, 0.0, (FAR, 0.0, 0.0)), BlendSlopes(
        reduced_step.SteadySlopes(still, none, none, none), none, twist
    )


_DERIVATIVE = derive(reduced_step.advance_alone, (*reduced_step.BY, "quartic.blend"), ("z", "u", "q"))
_forth, _back = _DERIVATIVE.forth, _DERIVATIVE.back


@kernel
def taped_step(contact, held, z, dt):
    """Return `reduced_step.ReducedStep` from the state z."""
    shape, surface, data = contact.shape, contact.surface, contact.data
    quartic = Quartic(fourth_moments(shape, surface, data), fourth_change(surface, data), shape[6])
    (new, traction), tape = _forth(contact.law, quartic, held.u, held.q, z, dt)
    return ReducedStep(held, tape, new, traction, to_origin(shape, *traction))


@kernel
def pull_back(contact, step, slopes, new, wrench):
    """Return `Cotangents` from those of the new state and of the wrench."""
    bars = _back(step.tape, (new, scaled_twist(contact.shape, *wrench)))
    known, blend = through_steady(contact, step, slopes.held, bars[:7]), bars[7]
    (vx, vy, omega), (wx, wy, wt), (gx, gy, gs) = slopes.twist, wrench, step.traction
    ux, uy, us = known[1]
    by_shape = ReducedPatch(
        ux * vx + gx * wx, ux * vy + gx * wy, ux * omega + gx * wt,
        uy * vy + gy * wy, uy * omega + gy * wt, us * omega + gs * wt,
        blend + dot(slopes.q_blend, known[2]),
    )  # fmt: skip
    return cotangents(contact, slopes.held, known, by_shape)


# ---------------------------------------------------------------------- bound to this model

_MODEL = reduced_step.MODEL._replace(hold_slopes=hold_slopes, taped_step=taped_step, pull_back=pull_back)
rollout = bind(rollouts.rollout, _MODEL, "reduced_rollout", jit)
gradient = bind(rollouts.gradient, _MODEL, "reduced_gradient", jit)
sensitivities = bind(rollouts.sensitivities, _MODEL, "reduced_sensitivities", jit)
tangent = bind(rollouts.tangent, _MODEL, "reduced_tangent", jit)
