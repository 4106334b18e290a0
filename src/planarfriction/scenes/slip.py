"""Slip of contacts: the share of their motion that their bristles do not take up, as events and cell by cell."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction.errors import InvalidValueError
from planarfriction.families import MODELS
from planarfriction.geometry import twist_at
from planarfriction.models.base import softening
from planarfriction.pads import HalfSpace

if TYPE_CHECKING:
    from planarfriction.models import DistributedModel
    from planarfriction.scenes.solution import Solution

SLIPS = 0.5
"""Share of the motion, left over by the bristles, above which a contact or a cell counts as slipping [-]."""

INCIPIENT = 0.1
"""Share of the load on cells that slip above which a contact slips partly [-]."""

INCIPIENT_HALF_SPACE = 0.06
"""The same of the pieces of a half-space [-]: without forces that concentrate where they stick, they slip later."""

AT_REST = 1e-3
"""Share of the largest deflection: a cell that moves less than that between two frames counts as resting [-]."""


class SlipEvent(NamedTuple):
    """An interval of time during which a contact slips."""

    contact: str
    """Name of the contact."""
    onset: float
    """Time at which it begins to slip [s]; 0 if it slips from the start."""
    end: float
    """Time at which it sticks again [s]; the end of the run if it does not."""
    path: float
    """Distance by which its centre of pressure slides [m]."""
    angle: float
    """Angle by which it turns, counter-clockwise [rad]."""
    incipient: float
    """Time at which cells with a tenth of the load begin to slip, at most `onset` [s]."""


class SlipField(NamedTuple):
    """Deflection and slip of the cells of a contact at F frames."""

    bent: np.ndarray
    """Deflection of each bristle over its largest, `[F, N]` [-]."""
    slips: np.ndarray
    """True where a cell slips, bool `[F, N]`."""


def slip_events(solution: Solution) -> tuple[SlipEvent, ...]:
    """Return the slips of all contacts of a solution, contact by contact, each in the order of time."""
    contacts = solution.scene.contacts
    return tuple(event for each in contacts for event in _events(solution, each))


def _events(solution: Solution, contact: Any) -> list[SlipEvent]:
    from scipy.integrate import cumulative_trapezoid

    recorded = solution.histories.get(f"bristles_{contact.name}")
    if recorded is None:
        rule = "be recorded for slip events: simulate(scene, bristles='all')"
        raise InvalidValueError("bristles", rule, "none")
    time = solution.histories["time"].values
    index = solution.contact_index(contact.name)
    loads = solution.histories["normal_force"].values[:, index]
    twists = solution.contact_twist(contact.name)
    share, slipping = slip_shares(contact.model, recorded.values, twists, loads)
    above = share - SLIPS
    if getattr(contact.model, "pad", None) is not None:
        above = slipping - (1.0 - INCIPIENT)
    sliding = twist_at(twists, centres(contact.model.patch, loads))
    speed = np.hypot(sliding[:, 0], sliding[:, 1])
    distance, turn = (
        cumulative_trapezoid(each, time, initial=0.0) for each in (speed, twists[:, 2])
    )
    radius = reach(contact.model.patch)
    least = contact.model.law.largest_deflection
    thick = isinstance(getattr(contact.model, "pad", None), HalfSpace)
    partly = _stretches(time, slipping - (INCIPIENT_HALF_SPACE if thick else INCIPIENT))
    events = []
    for onset, end in _stretches(time, above):
        path, angle = (
            float(np.diff(np.interp([onset, end], time, each))[0])
            for each in (distance, turn)
        )
        if path + radius * abs(angle) > least:  # less than bristles give way by is none
            first = [begin for begin, last in partly if begin <= onset <= last]
            events.append(
                SlipEvent(contact.name, onset, end, path, angle, *(first or [onset]))
            )
    return events


def slip_shares(
    model: Any, states: np.ndarray, twists: np.ndarray, loads: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Compute the shares of the motion of a contact that its bristles do not take up, and of the load that slips `[T]`.

    The first is `|u - zdot|/|u|` with root mean squares over the bristles; it lies in [0, 1]: 0 without motion, 1
    without load. The second is the load on the cells of which this holds, cell by cell, for more than `SLIPS`; zeros
    for a model without cells.
    """
    loaded = loads > 0.0
    share = np.where(loaded, 0.0, 1.0)
    slipping = np.where(loaded, 0.0, 1.0)
    if not loaded.any():
        return share, slipping
    args = twists[loaded], loads[loaded]
    motion = model.rate(np.zeros_like(states[loaded]), *args)
    rate = model.rate(states[loaded], *args)
    few: Any = getattr(model, "reduction", None)
    of_cells = isinstance(few, MODELS["distributed"])
    if of_cells:
        motion, _ = parted(few, motion)
        rate, face = parted(few, rate)
        # Cells see the face of a pad, which stays behind.
        motion = motion - np.einsum("nda,...a->...dn", few.patch.levers(), face)
    left = motion - rate
    weights = _weights(model, loads[loaded])
    size, slipped = (
        np.sqrt((weights * each**2).reshape(len(each), -1).sum(axis=1))
        for each in (motion, left)
    )
    share[loaded] = np.minimum(
        np.where(size > 0.0, slipped / np.where(size > 0.0, size, 1.0), 0.0), 1.0
    )
    if of_cells:
        shares = few.patch.weights(loads[loaded])
        slips = np.linalg.norm(left, axis=1) > SLIPS * np.linalg.norm(motion, axis=1)
        slipping[loaded] = (shares * slips).sum(axis=-1)
    return share, slipping


def _weights(model: Any, loads: np.ndarray) -> np.ndarray:
    """Return the weight of each state in the mean square: that of its cell, or one over the square of its scale."""
    shape = tuple(model.state_shape)
    patch = getattr(model, "reduction", model).patch
    if shape == (2, patch.cells):
        weights = (
            np.array([patch.weights(load) for load in loads])
            if patch.depends_on_load
            else patch.weights()[None]
        )
        return weights[:, None, :]
    if "m^2" in getattr(model, "state_units", "m"):
        radius = np.array([float(model.patch.contact_radius(load)) for load in loads])
        radius = np.where(radius > 0.0, radius, 1.0)
        return np.stack(
            [np.ones_like(radius), np.ones_like(radius), radius**-2], axis=1
        )
    return np.ones(())


def centres(patch: Any, loads: np.ndarray) -> np.ndarray:
    """Return the centre of pressure at each load `[T, 2]` [m]; without load, that at the largest load."""
    if not patch.depends_on_load:
        return np.broadcast_to(patch.centre_of_pressure(), (len(loads), 2))
    known = {
        load: patch.centre_of_pressure(load)
        for load in np.unique(loads[loads > 0.0]).tolist()
    }
    last = known[max(known)] if known else np.zeros(2)
    return np.array([known.get(load, last) for load in loads.tolist()])


def reach(patch: Any) -> float:
    """Return the largest distance of a cell from the middle of the patch [m]."""
    return float(np.hypot(*(patch.positions - patch.positions.mean(axis=0)).T).max())


def _stretches(time: np.ndarray, above: np.ndarray) -> list[tuple[float, float]]:
    """Return onset and end of each stretch of time in which samples, joined by straight lines, are above zero."""
    on = above > 0.0
    changes = np.flatnonzero(on[1:] != on[:-1])
    share = above[changes] / (above[changes] - above[changes + 1])
    at = (time[changes] + share * (time[changes + 1] - time[changes])).tolist()
    at = time[:1][on[:1]].tolist() + at + time[-1:][on[-1:]].tolist()
    return list(zip(at[::2], at[1::2], strict=True))


def bristles_of(model: Any) -> DistributedModel | None:
    """Return the distributed model of a contact's patch, law and pad; None where they have no bristles."""
    pad = getattr(model, "pad", None)
    try:
        return MODELS["distributed"](model.patch, model.law, pad=pad)
    except InvalidValueError:
        return None


def parted(
    bristles: DistributedModel, state: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the deflections of bristles `[..., d, N]` and the displacement of their face `[..., 3]`."""
    shape = bristles.patch.bristles, bristles.patch.cells
    batch = state.shape[: state.ndim - len(bristles.state_shape)]
    if bristles.state_shape == shape:
        return state, np.zeros((*batch, 3))
    return state[..., :-3].reshape(*batch, *shape), state[..., -3:]


def slip_field(
    bristles: DistributedModel,
    state: np.ndarray,
    times: np.ndarray,
    displacements: np.ndarray,
    loads: np.ndarray,
    frames: np.ndarray,
    first: np.ndarray,
) -> SlipField:
    """Compute the slip field of a contact at `frames` (indices into `times`) from the first state of its bristles.

    `displacements` `[T - 1, 3]` [m, m, rad] are those of the body on the contact from one of `times` `[T]` [s] to the
    next, in the frame of the contact; `loads` are `[T]` [N]; `first` `[3]` is the first twist [m/s, m/s, rad/s]. A
    cell displaced by `u` while its bristle goes from z_0 to z_1 slips by `u - (z_1 - z_0)`; the face of a pad with a
    common compliance moves less than the body.
    """
    law = bristles.law.numbers
    count = len(bristles.patch.positions)
    largest = bristles.law.largest_deflection
    levers = bristles.patch.levers()
    z, face = parted(bristles, state)
    lean = np.zeros(z.shape)
    lean[:2] = bristles.patch.asymmetries().T
    bent = np.zeros((len(frames), count))
    slips = np.zeros((len(frames), count), dtype=bool)
    distance = np.zeros(count)
    slip = np.zeros(count)
    frame = 1
    factor = softening(bristles, np.maximum(loads, 0.0))
    bent[0] = _bent(factor[0] * z, levers @ first, lean, law)
    for k, (step, dt) in enumerate(zip(displacements, np.diff(times), strict=True)):
        if not dt > 0.0:
            continue
        before = z
        behind = face
        state, _ = bristles.step(
            state, step / dt, max(0.5 * (loads[k] + loads[k + 1]), 0.0), dt
        )
        z, face = parted(bristles, state)
        moved = (levers @ (step - (face - behind))).T
        distance += np.linalg.norm(moved, axis=0)
        slip += np.linalg.norm(moved - (z - before), axis=0)
        if frame < len(frames) and k + 1 == frames[frame]:
            bent[frame] = _bent(factor[k + 1] * z, moved.T / dt, lean, law)
            slips[frame] = (slip > SLIPS * distance) & (distance > AT_REST * largest)
            distance[:] = 0.0
            slip[:] = 0.0
            frame += 1
    if len(frames) > 1:  # at first no distance is known: as right after it
        span = times[frames[1]] - times[frames[0]]
        slips[0] = slips[1] & (
            np.linalg.norm(levers @ first, axis=1) * span > AT_REST * largest
        )
    return SlipField(bent, slips)


def _bent(
    state: np.ndarray, velocity: np.ndarray, lean: np.ndarray, law: Any
) -> np.ndarray:
    """Return the deflections of bristles `[d, N]` over their largest at the velocities `[N, d]` of the cells, `[N]`.

    The largest of a disc that spins is up to 6 % smaller.
    """
    steady = formulas.stribeck(np, np.linalg.norm(velocity, axis=1), law) / law.sigma_0
    return np.linalg.norm(state - lean * steady, axis=0) / steady
