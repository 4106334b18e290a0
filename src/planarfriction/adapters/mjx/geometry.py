# pyright: reportAttributeAccessIssue=false, reportPrivateImportUsage=false
# (MJX keeps what its contacts are in `_impl`.)
"""The positions of the patches: their frames and the Jacobians of their twists."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from mujoco import mjx

from planarfriction.adapters.mujoco.patches import Placed


class PatchPlaces(NamedTuple):
    """Numbers of the sites, geoms and bodies of k patches, `[k]` each."""

    site: Any
    own: Any
    """The geom on the body that owns the patch, and the other."""
    other: Any
    owner: Any
    support: Any
    at_site: Any
    """True where the origin is at the site."""


def places(placed: Sequence[Placed]) -> PatchPlaces:
    """Return the places of patches found in a model."""
    numbers = [(p.site, p.own, p.other, p.bodies[1], p.bodies[0], p.patch.centre == "site") for p in placed]
    return PatchPlaces(*map(np.array, zip(*numbers, strict=True)))


def geometry(m: Any, d: Any, where: PatchPlaces) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Return the Jacobian of the twists `[3k, nv]`; 1 for contacts of a patch `[k, nefc]`; 1 for patches in contact."""
    contact = d._impl.contact
    single = jnp.asarray(contact.dim == 1) & (contact.dist < contact.includemargin)
    frames = contact.frame.reshape(-1, 3, 3)

    def one(place: PatchPlaces):
        forward = (contact.geom[:, 0] == place.other) & (contact.geom[:, 1] == place.own)
        backward = (contact.geom[:, 0] == place.own) & (contact.geom[:, 1] == place.other)
        chosen = (forward | backward) & single
        touching = chosen.any()
        normal = (jnp.where(chosen, jnp.where(forward, 1.0, -1.0), 0.0)[:, None] * frames[:, 0]).sum(0)
        normal = _unit(normal, touching)
        x = d.site_xmat[place.site].reshape(3, 3)[:, 0]
        x = _unit(x - normal * (x @ normal), touching)
        middle = jnp.where(chosen[:, None], contact.pos, 0.0).sum(0) / jnp.maximum(chosen.sum(), 1)
        centre = jnp.where(place.at_site, d.site_xpos[place.site], middle)
        moves, turns = (
            own - other
            for own, other in zip(mjx.jac(m, d, centre, place.owner), mjx.jac(m, d, centre, place.support), strict=True)
        )
        jacobian = jnp.stack([moves @ x, moves @ jnp.cross(normal, x), turns @ normal])
        return jnp.where(touching, jacobian, 0.0), jnp.where(chosen, 1.0, 0.0), touching

    jacobian, chosen, touching = jax.vmap(one)(jax.tree.map(jnp.asarray, where))
    rows = jnp.zeros((len(where.site), d._impl.efc_J.shape[0])).at[:, contact.efc_address].set(chosen)
    return jacobian.reshape(-1, m.nv), rows, touching


def _unit(vector: jax.Array, given: jax.Array) -> jax.Array:
    """Return a vector of length 1 in the same direction; zero for zero."""
    safe = jnp.where(given, vector, 1.0)
    return safe / jnp.sqrt(safe @ safe)
