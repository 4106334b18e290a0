"""When contacts slip: the share of their motion that their bristles do not take up."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planarfriction.errors import FileError, InvalidValueError

if TYPE_CHECKING:
    from planarfriction.scenes.solution import Solution

SLIPS = 0.5
"""Share of the motion above which a contact counts as slipping [-]."""


class SlipEvent(NamedTuple):
    """An interval of time during which a contact slips."""

    contact: str
    """Name of the contact."""
    onset: float
    """When it begins to slip [s]; 0 if it slips from the start."""
    end: float
    """When it sticks again [s]; the end of the run if it does not."""
    path: float
    """Distance by which its centre of pressure slides [m]."""
    angle: float
    """Angle by which it turns, counter-clockwise [rad]."""


def slip_events(solution: Solution) -> tuple[SlipEvent, ...]:
    """Slips of all contacts of a solution, one contact after another, each in the order of time."""
    if solution.scene is None:
        raise FileError("the file has no scene, which slip events need")
    found = []
    for contact in solution.scene.contacts:
        found += _events(solution, contact)
    return tuple(found)


def _events(solution: Solution, contact: Any) -> list[SlipEvent]:
    recorded = solution.histories.get(f"bristles_{contact.name}")
    if recorded is None:
        raise InvalidValueError("bristles", "be recorded for slip events: simulate(scene, bristles='all')", "none")
    time = np.asarray(solution.histories["time"].values)
    loads = np.asarray(solution.histories["normal_force"].values)[:, solution.contact_index(contact.name)]
    twists, states = solution.contact_twist(contact.name), np.asarray(recorded.values)
    share = slip_fraction(contact.model, states, twists, loads)
    points = centres(contact.model.patch, loads)
    speed = np.hypot(twists[:, 0] - twists[:, 2] * points[:, 1], twists[:, 1] + twists[:, 2] * points[:, 0])
    way, turn = _integral(time, speed), _integral(time, twists[:, 2])
    radius, least = reach(contact.model.patch), contact.model.law.largest_deflection
    events = []
    for onset, end in _stretches(time, share - SLIPS):
        path, angle = (float(np.diff(np.interp([onset, end], time, each))[0]) for each in (way, turn))
        if path + radius * abs(angle) > least:  # less than bristles give way by is none
            events.append(SlipEvent(contact.name, onset, end, path, angle))
    return events


def slip_fraction(model: Any, states: np.ndarray, twists: np.ndarray, loads: np.ndarray) -> np.ndarray:
    """Share `|u - zdot|/|u|` of the motion u of a contact that its bristles do not take up `[T]`, in [0, 1].

    In the mean square over the bristles. 0 where it does not move; 1 without load.
    """
    loaded = loads > 0.0
    share = np.where(loaded, 0.0, 1.0)
    if not loaded.any():
        return share
    args = twists[loaded], loads[loaded]
    motion = model.rate(np.zeros_like(states[loaded]), *args)
    left = motion - model.rate(states[loaded], *args)
    weights = _weights(model, loads[loaded])
    size, slipped = (np.sqrt((weights * each**2).reshape(len(each), -1).sum(axis=1)) for each in (motion, left))
    share[loaded] = np.minimum(np.where(size > 0.0, slipped / np.where(size > 0.0, size, 1.0), 0.0), 1.0)
    return share


def _weights(model: Any, loads: np.ndarray) -> np.ndarray:
    """What each state counts: cells by their load, others over their natural scale."""
    shape, cells = tuple(model.state_shape), len(model.patch.positions)
    if shape == (2, cells):
        weights = np.array([model.patch.weights(load) for load in loads]) if model.patch.depends_on_load else (
            model.patch.weights()[None]
        )  # fmt: skip
        return weights[:, None, :]
    if "m^2" in getattr(model, "state_units", "m"):
        radius = np.array([float(model.patch.contact_radius(load)) for load in loads])
        radius = np.where(radius > 0.0, radius, 1.0)
        return np.stack([np.ones_like(radius), np.ones_like(radius), radius**-2], axis=1)
    return np.ones((1, *shape))


def centres(patch: Any, loads: np.ndarray) -> np.ndarray:
    """Centre of pressure at each load `[T, 2]` [m]; that at the largest where there is none."""
    if not patch.depends_on_load:
        return np.broadcast_to(patch.centre_of_pressure(), (len(loads), 2))
    known = {load: patch.centre_of_pressure(load) for load in np.unique(loads[loads > 0.0]).tolist()}
    last = known[max(known)] if known else np.zeros(2)
    return np.array([known.get(load, last) for load in loads.tolist()])


def reach(patch: Any) -> float:
    """Largest distance of a cell from the middle of the patch [m]."""
    return float(np.hypot(*(patch.positions - patch.positions.mean(axis=0)).T).max())


def _integral(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * (values[1:] + values[:-1]))])


def _stretches(time: np.ndarray, above: np.ndarray) -> list[tuple[float, float]]:
    """Where samples joined by straight lines are above zero, [onset, end] of each stretch."""
    on = above > 0.0
    changes = np.flatnonzero(on[1:] != on[:-1])
    share = above[changes] / (above[changes] - above[changes + 1])
    at = (time[changes] + share * (time[changes + 1] - time[changes])).tolist()
    at = ([float(time[0])] if on[0] else []) + at + ([float(time[-1])] if on[-1] else [])
    return list(zip(at[::2], at[1::2], strict=True))
