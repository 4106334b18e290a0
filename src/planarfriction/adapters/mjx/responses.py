# pyright: reportAttributeAccessIssue=false, reportPrivateImportUsage=false
# (MJX keeps what its constraints are in `_impl`.)
"""Response of MJX's step to wrenches on patches, for a fixed set of active constraints, and the places of patches.

As `planarfriction.adapters.mujoco.responses`, with the accelerations themselves: `H qacc = f + Jp' W + Jc' (D a + c)`
over the rows in their quadratic range and those at their largest force c. It is what MJX's solver goes towards, exact,
and it has derivatives where the solver's loop has none.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from mujoco import mjx

from planarfriction._engine.coupled import placing
from planarfriction.adapters.mjx.newton import HostResponse
from planarfriction.adapters.mujoco.loops.centres import FOLLOWS
from planarfriction.formulas import turning_mean
from planarfriction.jax.namespace import xp
from planarfriction.tensors.pressure import centre_of

_x_axis = placing.x_axis_with(jnp.where)


class Active(NamedTuple):
    """Constraint rows that are active."""

    quadratic: jax.Array
    """Rows whose force follows the acceleration, bool `[nefc]`."""
    pull: jax.Array
    """Sign of the force of rows at their friction loss, else 0, `[nefc]`."""


class WrenchResponse(NamedTuple):
    """Accelerations, forces of constraints, twists and loads as they follow from wrenches w `[3k]`."""

    free: jax.Array
    """Acceleration without wrenches, `[nv]`."""
    moved: jax.Array
    """Acceleration by wrenches, `[nv, 3k]`."""
    stiffness: jax.Array
    """D of the quadratic rows, `[nefc]`."""
    limit: jax.Array
    """Force of the others, `[nefc]`."""
    host: HostResponse

    def acceleration(self, w: jax.Array) -> jax.Array:
        """Return the acceleration `[nv]`."""
        return self.free + self.moved @ w

    def forces(self, d: Any, w: jax.Array) -> jax.Array:
        """Return the forces of the constraints, `[nefc]`."""
        return self.limit - self.stiffness * _gap(d, self.acceleration(w))


def active_rows(d: Any) -> Active:
    """Return the active rows by the forces that MJX's solver has found."""
    return _active(d, d._impl.efc_force > 0.0, d._impl.efc_force)


def active_at(d: Any, acceleration: jax.Array) -> Active:
    """Return the active rows at an acceleration."""
    gap = _gap(d, acceleration)
    return _active(d, gap < 0.0, -d._impl.efc_D * gap)


def _active(d: Any, pressed: jax.Array, force: jax.Array) -> Active:
    """Return the active rows: equalities always, friction below its loss, all others where they are `pressed`."""
    row = jnp.arange(len(force))
    loss = (row >= d._impl.ne) & (row < d._impl.ne + d._impl.nf)
    at_loss = loss & (abs(force) >= d._impl.efc_frictionloss)
    quadratic = jnp.where(loss, ~at_loss, pressed | (row < d._impl.ne))
    return Active(quadratic, jnp.where(at_loss, jnp.sign(force), 0.0))


def slack(
    d: Any, before: Active, after: Active, acceleration: jax.Array, dt: jax.Array
) -> jax.Array:
    """Return the largest speed [m/s] at which a row is on the wrong side of its range."""
    wrong = (before.quadratic != after.quadratic) | (before.pull != after.pull)
    loss = d._impl.efc_frictionloss / d._impl.efc_D
    return (jnp.where(wrong, abs(abs(_gap(d, acceleration)) - loss), 0.0) * dt).max(
        initial=0.0
    )


def answer(m: Any, d: Any, where: Geometry, active: Active) -> WrenchResponse:
    """Return the response to wrenches on patches; `qfrc_smooth` in the data is without these."""
    jacobian = where.jacobian
    rows = where.rows
    constraints = d._impl.efc_J
    inertia = mjx.full_m(m, d)
    stiffness = jnp.where(active.quadratic, d._impl.efc_D, 0.0)
    limit = active.pull * d._impl.efc_frictionloss
    stiff = inertia + constraints.T @ (stiffness[:, None] * constraints)
    pushed = d.qfrc_smooth + constraints.T @ (stiffness * d._impl.efc_aref + limit)
    factor = jax.scipy.linalg.cho_factor(0.5 * (stiff + stiff.T))
    found = jax.scipy.linalg.cho_solve(
        factor, jnp.concatenate([pushed[:, None], jacobian.T], axis=1)
    )
    free = found[:, 0]
    moved = found[:, 1:]
    gains = jax.vmap(
        lambda acceleration: _gained(m, d, inertia, acceleration), in_axes=1, out_axes=1
    )(found)
    weights = rows * stiffness
    host = HostResponse(
        twist=jacobian @ (d.qvel + gains[:, 0]) + where.drift.ravel(),
        load=-weights @ _gap(d, free),
        response=jacobian @ gains[:, 1:],
        load_response=-weights @ (constraints @ moved),
    )
    return WrenchResponse(free, moved, stiffness, limit, host)


def integrate(m: Any, d: Any) -> Any:
    """Run the integrator of the model on known accelerations."""
    return (
        mjx.euler(m, d)
        if m.opt.integrator == mjx.IntegratorType.EULER
        else mjx.implicit(m, d)
    )


def _gained(m: Any, d: Any, inertia: jax.Array, acceleration: jax.Array) -> jax.Array:
    """Return the velocity that the integrator gains in a step from an acceleration, which is linear in it."""
    force = inertia @ acceleration
    d = d.replace(
        qacc=acceleration, qfrc_smooth=force, qfrc_constraint=jnp.zeros_like(force)
    )
    return integrate(m, d).qvel - d.qvel


def _gap(d: Any, acceleration: jax.Array) -> jax.Array:
    """Return the excess of the acceleration of each row over the one at which it has no force."""
    return d._impl.efc_J @ acceleration - d._impl.efc_aref


# ---------------------------------------------------------------------- places


class PatchPlaces(NamedTuple):
    """Numbers of the sites, geoms and bodies of k patches, `[k]` each."""

    site: Any
    own: Any
    """The geom on the body that owns the patch, and the other."""
    other: Any
    owner: Any
    support: Any
    carrier: Any
    """The geom along with which the patch goes over the other."""
    centre: Any
    """Origins, as those of `placing`."""
    curved: Any
    """Bits of their curved sides, as those of `placing`."""
    reach: Any
    """Reaches of the patches (see `placing`), `[k, 4]` [m]."""
    radius: Any
    """Lever arms of the patches [m]."""
    surface: Any
    """Velocities of the surfaces of both geoms in their frames (`surfacevel`), `[k, 2, 6]`."""


class Geometry(NamedTuple):
    """Contacts of k patches."""

    jacobian: jax.Array
    """Jacobian of the twists `[3k, nv]`."""
    rows: jax.Array
    """1 for the contacts of a patch, `[k, nefc]`."""
    levers: jax.Array
    """Moments (m_x, m_y) of unit forces of these about the origin of the patch, `[k, 2, nefc]` [m]."""
    touching: jax.Array
    """True for patches in contact, `[k]`."""
    origin: jax.Array
    """Origins in the frames of the sites, `[k, 3]` [m]."""
    axes: jax.Array
    """Axes of the patches in the frames of the sites, as rows, `[k, 3, 3]`."""
    share: jax.Array
    """Share of the displacement to the centre of the contact forces that the origin takes in the step, `[k]`."""
    carried: jax.Array
    """Cosine and sine of the angles from the x axes of the last step, carried along, to these, `[k, 2]`."""
    drift: jax.Array
    """Part of the twists that no wrench changes: of the surfaces and of what turns, own less other, `[k, 3]`."""
    at_contact: jax.Array
    """True for patches whose origin follows the contact forces, `[k]`."""
    upright: jax.Array
    """True for patches on no curved side whose sites have their x axis along the normal, `[k]`."""

    def carry(self, p: int, vectors: jax.Array) -> jax.Array:
        """Return vectors of patch p, x and y in front, in its axes of this step instead of the last ones."""
        (c, s) = self.carried[p]
        (x, y) = vectors[:2]
        return vectors.at[:2].set(jnp.stack([c * x + s * y, c * y - s * x]))

    def centres(self, force: jax.Array) -> jax.Array:
        """Return the centres of pressure `[k, 2]` [m] of forces of constraints `[nefc]`."""
        return centre_of(xp, self.levers @ force, self.rows @ force)

    def moved(self, shift: jax.Array) -> jax.Array:
        """Return origins `[k, 3]` that move by `[k, 2]` [m] in the patches, in the frames of the sites."""
        held = self.origin + jnp.einsum("pi,pij->pj", shift, self.axes[:, :2])
        return jnp.where(self.touching[:, None], held, 0.0)

    def misplaced(
        self, load: jax.Array, centre: jax.Array, scale: jax.Array, reach: jax.Array
    ) -> jax.Array:
        """Return the fault of the last patch that has one (see `placing`), with contact forces at these centres."""
        beyond = (
            jnp.maximum(
                *jax.vmap(placing.excess)(centre[:, 0], centre[:, 1], scale, reach)
            )
            > 0.0
        )
        upright = jnp.where(self.upright, placing.ALONG_X, 0)
        fault = jnp.where(beyond & ~self.at_contact, placing.BEYOND, upright)
        noted = placing.FAULTS * jnp.arange(len(fault)) + fault
        return jnp.where((load > 0.0) & (fault > 0), noted, 0).max()


def geometry(
    m: Any, d: Any, where: PatchPlaces, held: jax.Array, before: jax.Array
) -> Geometry:
    """Return the geometry of the contacts of patches with their last origins and x axes `[k, 3]`, in the sites' frames.

    See `planarfriction.adapters.mujoco.loops.centres`.
    """
    contact = d._impl.contact
    single = jnp.asarray(contact.dim == 1) & (contact.dist < contact.includemargin)
    frames = contact.frame.reshape(-1, 3, 3)

    def one(place: PatchPlaces, held: jax.Array, before: jax.Array):
        forward = (contact.geom[:, 0] == place.other) & (
            contact.geom[:, 1] == place.own
        )
        backward = (contact.geom[:, 0] == place.own) & (
            contact.geom[:, 1] == place.other
        )
        chosen = (forward | backward) & single
        touching = chosen.any()
        normal = (
            jnp.where(chosen, jnp.where(forward, 1.0, -1.0), 0.0)[:, None]
            * frames[:, 0]
        ).sum(0)
        normal = _unit(normal, touching)
        turned = d.site_xmat[place.site].reshape(3, 3)
        site = d.site_xpos[place.site]
        across = turned - jnp.outer(normal, normal @ turned)
        *x, cosine, sine = _x_axis(across[:, 0], across[:, 1], across @ before, normal)
        x = jnp.stack(x)
        middle = jnp.where(chosen[:, None], contact.pos, 0.0).sum(0) / jnp.maximum(
            chosen.sum(), 1
        )
        curved = place.curved & placing.ROUND > 0
        for geom, side in ((place.own, placing.OWN), (place.other, placing.OTHER)):
            axis = d.geom_xmat[geom].reshape(3, 3)[:, 2]
            curved |= (place.curved & side > 0) & (
                placing.across(axis, normal) > placing.CURVED
            )
        at_contact = (place.centre == placing.AT_CONTACT) | (
            (place.centre == placing.AUTO) & curved
        )
        new = (held == 0.0).all()
        last = jnp.where(new, middle, site + turned @ held)
        centre = jnp.stack(
            placing.onto_plane(jnp.where(at_contact, last, site), middle, normal)
        )
        y = jnp.cross(normal, x)
        carried = jnp.where(touching, jnp.stack([cosine, sine]), jnp.array([1.0, 0.0]))
        sides = zip(
            (place.owner, place.support),
            (place.own, place.other),
            place.surface,
            strict=True,
        )
        own, other = (_side(m, d, centre, *side) for side in sides)
        moves, turns, drift, drift_spin, past, spin, _ = jax.tree.map(
            jnp.subtract, own, other
        )
        across = jnp.where(touching, jnp.stack([x, y]), 0.0)
        over = jnp.where(place.carrier == place.own, own.over, other.over)
        both = own.spin + other.spin
        dt = m.opt.timestep
        drift += jnp.stack(
            placing.bend(over, spin, both, normal, normal @ past, -1.0, dt)
        )
        drift = jnp.append(
            across @ drift, jnp.where(touching, normal @ drift_spin, 0.0)
        )
        jacobian = jnp.stack([moves @ x, moves @ y, turns @ normal])
        away = contact.pos - centre
        own = jnp.where(
            chosen, jnp.stack([jnp.ones(len(away)), away @ y, -away @ x]), 0.0
        )
        rolled = xp.norm(across @ spin, -1)[0]
        slid = xp.norm(jacobian[:2] @ d.qvel + drift[:2], -1)[0]
        rolled += jnp.where(place.radius > 0.0, slid / place.radius, 0.0)
        share = jnp.where(new, 1.0, jnp.minimum(1.0, m.opt.timestep * rolled / FOLLOWS))
        share = jnp.where(touching & at_contact, share, 0.0)
        upright = ~curved & (placing.across(turned[:, 0], normal) < placing.MARGIN**2)
        axes = jnp.where(touching, jnp.stack([x, y, normal]) @ turned, before)
        place_of = turned.T @ (centre - site)
        jacobian = jnp.where(touching, jacobian, 0.0)
        return (
            jacobian,
            own,
            touching,
            place_of,
            axes,
            share,
            carried,
            drift,
            at_contact,
            upright,
        )

    jacobian, own, *others = jax.vmap(one)(
        jax.tree.map(jnp.asarray, where), held, before
    )
    rows = (
        jnp.zeros((len(where.site), 3, d._impl.efc_J.shape[0]))
        .at[:, :, contact.efc_address]
        .set(own)
    )
    return Geometry(jacobian.reshape(-1, m.nv), rows[:, 0], rows[:, 1:], *others)


class _Side(NamedTuple):
    """Motion of the surface of a body at a point."""

    moves: jax.Array
    """Jacobians of the point and of the body `[nv, 3]`."""
    turns: jax.Array
    drift: jax.Array
    """Velocity and spin `[3]` that no wrench changes: of the surface on the body, and half of what both gain."""
    drift_spin: jax.Array
    past: jax.Array
    """Mean velocity of the surface in the last step `[3]`."""
    spin: jax.Array
    """Spin of the surface `[3]`."""
    over: jax.Array
    """Velocity of the surface less that of the centre of the geom `[3]`."""


def _side(
    m: Any, d: Any, point: jax.Array, body: Any, geom: Any, surface: jax.Array
) -> _Side:
    """Return the motion of the surface of a geom, which has a velocity [6] of its own (see `loops.geometry`)."""
    dt = m.opt.timestep
    frame = d.geom_xmat[geom].reshape(3, 3)
    away = point - d.geom_xpos[geom]
    moves, turns = mjx.jac(m, d, point, body)
    # by changes of the axes in place of the axes: spatial accelerations of joints that keep their speeds
    gains = mjx.jac(m, d.replace(cdof=d.cdof_dot), point, body)
    velocity, spin, gain, gained = (d.qvel @ each for each in (moves, turns, *gains))
    turn = frame @ surface[3:]
    move = frame @ surface[:3] + jnp.cross(turn, away)
    first, second = turning_mean(jnp, dt * xp.norm(surface[3:], -1)[0])
    across = jnp.cross(turn, move)
    mean = (
        move
        + dt * first * across
        + dt**2 * second * jnp.cross(turn, across)
        + dt * jnp.cross(spin, move)
    )
    gain += jnp.cross(spin, velocity)
    drift = mean + 0.5 * dt * gain
    past = velocity + move - 0.5 * dt * (gain + jnp.cross(2.0 * spin + turn, move))
    drift_spin = turn + 0.5 * dt * (gained + jnp.cross(spin, turn))
    return _Side(
        moves, turns, drift, drift_spin, past, spin + turn, move + jnp.cross(spin, away)
    )


def _unit(vector: jax.Array, given: jax.Array) -> jax.Array:
    """Return a vector of length 1 in the same direction; zero for zero."""
    safe = jnp.where(given, vector, 1.0)
    return safe / jnp.sqrt(safe @ safe)
