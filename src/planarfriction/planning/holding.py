"""The smallest normal force with which a contact holds a load: as it falls slowly, and as it falls quickly."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.geometry import twist_at
from planarfriction.limit_surface import (
    LimitSurface,
    LimitSurfaceCells,
    LimitSurfaceExact,
)
from planarfriction.models.base import softening
from planarfriction.patch import ContactPatch
from planarfriction.scenes import Body, Contact, Scene, Signal, simulate
from planarfriction.scenes.contact import checked_model

_STEP = 1.25
"""Factor between the loads that are tried on a patch that follows its load."""

_STEPS = 120
"""Number of such loads."""

GRAVITY = 9.81
"""Gravity [m/s^2] by which a load becomes the mass that is assumed to hang on it."""

FALL = 1.5
"""Normal force before a fall, over the `holding_load` [-]."""

SLIP = 1e-5
"""Displacement [m] beyond that of bristles bent to their end from which on a contact has slipped."""

BEFORE = 0.02
"""Time before a fall [s]."""

AFTER = 0.5
"""Time after a fall [s]: a load that exceeds friction by 0.1 % moves its own mass by 1
mm in it."""

FIRST_STEP = 0.02
"""First step of the search, as a share of the `holding_load` [-]."""

CLOSE = 1e-3
"""Last interval of the search, as a share of the `holding_load` [-]."""

WIDEST = 4.0
"""Factor by which the result may differ from the `holding_load` either way; the search gives up there [-]."""


def holding_load(
    wrench: ArrayLike, patch: ContactPatch, mu: float, margin: float = 0.0
) -> float:
    """Return the normal force [N] down to which a contact holds a load `wrench` `(fx, fy, tau)` [N, N, N m].

    Quasi-static: exact for the continuous patch and a grip that falls slowly. As it falls faster, the cells that break
    first weaken before the others have taken over (mu_s > mu_c), and up to 9 % more is needed: `dynamic_holding_load`.

    The load acts on the body, about the origin of the contact frame. Friction can be anything inside the limit surface:
    `f_N = max_V (wrench . V) / (mu Phi(V))`, which is attained by the twist V normal to the surface. For a patch that
    depends on the load, it is the smallest root of `f_N = f_N(shape at f_N)`. The result is increased by the share
    `margin`; it is 0 without a load.

    Use mu_s for a body that is held as the grip falls slowly, and mu_c for one that must also be stopped. Raises
    `InvalidValueError` if the patch cannot hold the load at any normal force (a torque on a single point).

    Source: Goyal, Ruina, Papadopoulos 1991.
    """
    load = validation.array("wrench", wrench, (3,))
    validation.instance("patch", patch, ContactPatch, "a ContactPatch")
    mu = validation.positive("mu", mu)
    margin = validation.non_negative("margin", margin)
    return (1.0 + margin) * smallest_force(load[None], patch, mu)


def smallest_force(
    loads: np.ndarray, patch: ContactPatch, mu: float, lost: np.ndarray | float = 0.0
) -> float:
    """Return the smallest normal force [N] that holds each of the loads `[n, 3]`.

    While a load acts, the normal force is smaller by `lost` `[n]` [N].
    """
    if not loads.any():
        return float(np.max(lost))
    if not patch.depends_on_load:
        return float((forces_needed(loads, surface_at(patch), mu) + lost).max())
    needed = lambda each: float(
        (forces_needed(loads, surface_at(patch, each), mu) + lost).max()
    )
    reach = np.hypot(*patch.positions.T).max()
    metric = 1.0
    if patch.root is not None:
        metric = np.linalg.norm(patch.root, ord=2, axis=(-2, -1)).max()
    # Bounds friction over mu.
    strongest = metric * (1.0 + np.hypot(*patch.asymmetries().T).max())
    fx, fy, tau = loads.T
    force = max(np.hypot(fx, fy).max(), np.abs(tau).max() / reach)
    low = force / (mu * strongest)
    tried = low * (1.0 - 1e-9)
    for _ in range(_STEPS):
        if needed(tried) <= tried:
            break
        tried, low = _STEP * tried, tried
    else:
        raise InvalidValueError(
            "wrench",
            "be a load that this patch holds at some normal force",
            loads[0].tolist(),
        )
    if tried > low:
        from scipy.optimize import brentq

        tried: Any = brentq(
            lambda each: each - needed(each), low, tried, xtol=1e-12 * low
        )
    return tried


def forces_needed(loads: np.ndarray, surface: LimitSurface, mu: float) -> np.ndarray:
    """Return the normal forces `[n]` [N] that hold the loads `[n, 3]` on a limit surface; 0 without a load."""
    forces = np.zeros(len(loads))
    some = loads.any(axis=1)
    if not some.any():
        return forces
    twists = surface.twist(-loads[some])
    power = np.einsum("...i,...i", loads[some], twists)
    forces[some] = power / (mu * surface.dissipation(twists))
    return forces


@functools.lru_cache(maxsize=8)
def surface_at(patch: ContactPatch, normal_force: float | None = None) -> LimitSurface:
    """Return the limit surface of a patch, whose table for twists is dear: a plan asks several times."""
    # These pull as they do in models.
    few = patch.has_discs and not patch.cell_extents().any()
    cells = few or (patch.root is not None and patch.root.ndim == 3)
    kind: type[LimitSurface] = LimitSurfaceCells if cells else LimitSurfaceExact
    return kind(patch, normal_force=normal_force)


def dynamic_holding_load(
    wrench: ArrayLike,
    model: Any,
    *,
    ramp: float = 0.0,
    fall: float = FALL,
    mass: float | None = None,
    inertia: float | None = None,
    margin: float = 0.0,
) -> float:
    """Return the normal force [N] down to which a grip can fall within the time `ramp` [s] without a slip.

    The grip holds the load `wrench` `(fx, fy, tau)` [N, N, N m] about the origin of the contact frame with `fall` times
    its `holding_load` (of mu_s), falls linearly (with `ramp` 0 in one step), and stays for half a second. The contact
    has slipped if its place moves by 10 um more than bristles can bend, `|d_CoP| + r |theta| > mu_s/sigma_0 + 10 um`.
    A bisection over about ten simulations of `model` brackets the result within 0.1 % of the `holding_load`: the number
    returned held. It is that of the cells of the model; the `DistributedModel` of `patch.refined(n)` is the reference.

    The load has a `mass` [kg] and an `inertia` [kg m^2] about the origin; light bodies need most. The default is what
    weighs as much as the load, `|(fx, fy, tau/r)|/g`, and `mass r^2`. The result is increased by the share `margin`.

    Raises InvalidValueError for a law that creeps, for what `holding_load` refuses, and if the model holds the load at
    no grip, or at any, within a factor of 4 of it.
    """
    load = validation.array("wrench", wrench, (3,))
    checked_model("model", model)
    ramp = validation.non_negative("ramp", ramp)
    margin = validation.non_negative("margin", margin)
    law = model.law
    if not law.holds_at_rest:
        raise InvalidValueError(
            "model", "have a law that holds at rest", type(law).__name__
        )
    fall = validation.number("fall", fall)
    if fall < 1.0 + CLOSE:
        raise InvalidValueError("fall", f"be at least {1.0 + CLOSE:g}", fall)
    slow = holding_load(load, model.patch, law.numbers.mu_s)
    if slow == 0.0:
        return 0.0
    # Soft fingers shrink to a point.
    radius = max(model.patch.contact_radius(slow), SLIP)
    if mass is None:
        mass = float(np.linalg.norm(load / [1.0, 1.0, radius])) / GRAVITY
    mass = validation.positive("mass", mass)
    if inertia is None:
        inertia = mass * radius**2
    inertia = validation.positive("inertia", inertia)
    body = Body(mass, inertia, gravity=(0.0, 0.0))

    def slips(share: float) -> bool:
        """Return True if the body slips as the grip falls to a share of the slow load."""
        high = max(fall, share) * slow
        low = share * slow
        grip = Signal.sampled([0.0, BEFORE], [high, low])
        if BEFORE + ramp > BEFORE:  # else it is nothing, or less than times tell apart
            times = [0.0, BEFORE, BEFORE + ramp]
            grip = Signal.sampled(times, [high, high, low], "linear")
        end = grip.times[-1] + AFTER
        contact = Contact(model, grip)
        scene = Scene(
            body, contact, end, force=load, save_every=end, start="equilibrium"
        )
        histories = simulate(scene).histories
        moved = np.array([histories[name].values[-1] for name in ("x", "y", "theta")])
        dx, dy, theta = twist_at(moved, model.patch.centre_of_pressure(low))
        way = np.hypot(dx, dy) + model.patch.contact_radius(low) * abs(theta)
        stiffer = softening(model, np.array(low)).min()
        bends = law.numbers.mu_s / (law.numbers.sigma_0 * stiffer)
        return way > bends + SLIP

    return (1.0 + margin) * slow * _least_share(slips)


def _least_share(slips: Any) -> float:
    """Return a share of a load at which `slips` is false, within `CLOSE` of one at which it is true."""
    share = 1.0
    at_first = slips(share)
    factor = (1.0 + FIRST_STEP) ** (1 if at_first else -1)
    while slips(share * factor) == at_first:
        share = share * factor
        factor = factor**2
        if share > WIDEST:
            raise InvalidValueError(
                "wrench", f"be held within {WIDEST:g} times the holding_load", "a slip"
            )
        if share < 1.0 / WIDEST:
            raise InvalidValueError(
                "model", f"slip below 1/{WIDEST:g} of the holding_load", "no slip"
            )
    low, high = sorted((share, share * factor))
    while high - low > CLOSE:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if slips(middle) else (low, middle)
    return high
