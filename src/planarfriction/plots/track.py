"""Motion at the instants of a moving picture: poses, forces and slip of a solution, between its samples too."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

import planarfriction as pf
from planarfriction import geometry
from planarfriction.plots.histories import KICK
from planarfriction.plots.style import evenly
from planarfriction.scenes.contact import contact_poses, support_displacement
from planarfriction.scenes.slip import SlipField, bristles_of, slip_field
from planarfriction.scenes.solution import columns_of

MOST_STEPS = 5000
"""Most steps in which bristles follow a motion; of more samples, evenly chosen ones."""


@dataclass(frozen=True, eq=False)
class ContactTrack:
    """A contact at F frames."""

    contact: pf.Contact
    index: int
    """Index among the contacts of the scene."""
    poses: np.ndarray
    """Pose (x, y, angle) of its frame in the world `[F, 3]` [m, m, rad]."""
    twists: np.ndarray
    """Twist of the body on it, in its frame `[F, 3]` [m/s, m/s, rad/s]."""
    wrenches: np.ndarray
    """Friction wrench of one of the identical contacts, in its frame `[F, 3]` [N, N, N m]."""
    loads: np.ndarray
    """Normal force of one of them `[F]` [N]."""
    slip: SlipField | None
    """Slip of the cells; None where the model has no bristles that are known."""

    @functools.cached_property
    def forces(self) -> np.ndarray:
        """Friction force of all identical contacts on the body, world axes `[F, 2]` [N]."""
        return self.contact.count * geometry.rotate(
            self.wrenches[:, :2], self.poses[:, 2]
        )

    def shape(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the share of the load on each cell `[N]` [-], and the centre of pressure `[2]` [m], at a frame."""
        patch = self.contact.model.patch
        load = float(self.loads[frame])
        if patch.depends_on_load and not load > 0.0:
            return np.zeros(len(patch.positions)), np.zeros(2)
        at = load if patch.depends_on_load else None
        return patch.weights(at), patch.centre_of_pressure(at)


class Track(NamedTuple):
    """A solution at F frames."""

    times: np.ndarray
    """`[F]` [s]."""
    poses: np.ndarray
    """Pose (x, y, theta) of the body `[F, 3]` [m, m, rad]."""
    twists: np.ndarray
    """Twist (vx, vy, omega) there, world axes `[F, 3]` [m/s, m/s, rad/s]."""
    contacts: list[ContactTrack]


def track_of(solution: pf.Solution, times: np.ndarray) -> Track:
    """Return the solution at `times` `[F]` [s]: poses without overshoot, all else along straight lines."""
    sampled = solution.histories["time"].values
    every = evenly(len(sampled), MOST_STEPS)
    steps = np.unique(np.concatenate([sampled[every], times]))
    frames = np.searchsorted(steps, times)
    poses = _poses(solution, sampled, steps)
    twists = _between(times, sampled, columns_of(solution, "vx", "vy", "omega"))
    if solution.scene.velocity is not None:  # in axes of the body
        twists = geometry.rotate(twists, poses[frames, 2])
    contacts = []
    for index, (contact, first) in enumerate(
        zip(solution.scene.contacts, _first(solution), strict=True)
    ):
        at = contact_poses(contact, steps, poses)
        load = solution.histories["normal_force"].values[:, index]
        loads = np.interp(steps, sampled, load)
        against = _between(times, sampled, solution.contact_twist(contact.name))
        slip = first and slip_field(
            *first,
            steps,
            _displacements(contact, steps, poses, at),
            loads,
            frames,
            against[0],
        )
        wrenches = _between(times, sampled, _without_kick(solution, index))
        contacts.append(
            ContactTrack(
                contact, index, at[frames], against, wrenches, loads[frames], slip
            )
        )
    return Track(times, poses[frames], twists, contacts)


def _first(
    solution: pf.Solution,
) -> list[tuple[pf.DistributedModel, np.ndarray] | None]:
    """Return the distributed model of each contact and its first state; None for one without bristles."""
    from planarfriction.scenes.start import first_states

    scene = solution.scene
    models = [bristles_of(each.model) for each in scene.contacts]
    known = [each for each in models if each is not None]
    if scene.start == "rest" or len(known) < len(models):
        return [each and (each, each.rest()) for each in models]
    contacts = [
        replace(each, model=model)
        for each, model in zip(scene.contacts, known, strict=True)
    ]
    loads = solution.histories["normal_force"].values[0]
    states = first_states(replace(scene, contacts=contacts), loads)
    return list(zip(known, states, strict=True))


def _displacements(
    contact: pf.Contact, times: np.ndarray, poses: np.ndarray, at: np.ndarray
) -> np.ndarray:
    """Return the displacement of the body on a contact between instants, in the frame of the contact `[T - 1, 3]`.

    That of the material of the body at the origin of the frame, half-way: of second order in the turn of a step.
    """
    body = np.diff(poses, axis=0)
    middle = 0.5 * (at[1:] + at[:-1])
    moved = geometry.twist_at(
        body, middle[:, :2] - 0.5 * (poses[1:, :2] + poses[:-1, :2])
    )
    # Of a pad at its frame, of the ground at the world's origin.
    ground = np.diff(support_displacement(contact, times), axis=0)
    if contact.mounted_on == "body":
        ground = geometry.twist_at(ground, middle[:, :2])
    return geometry.rotate(moved - ground, -middle[:, 2])


def body_poses(solution: pf.Solution) -> np.ndarray:
    """Return the pose (x, y, theta) of the body at all samples, `[T, 3]` [m, m, rad]."""
    return columns_of(solution, "x", "y", "theta")


def _poses(solution: pf.Solution, sampled: np.ndarray, times: np.ndarray) -> np.ndarray:
    from scipy.interpolate import PchipInterpolator

    poses = body_poses(solution)
    if len(sampled) == 1:
        return np.broadcast_to(poses, (len(times), 3))
    return PchipInterpolator(sampled, poses, axis=0)(
        np.clip(times, sampled[0], sampled[-1])
    )


def _without_kick(solution: pf.Solution, contact: int) -> np.ndarray:
    """Return the wrenches of a contact `[T, 3]`; a first one that dwarfs the others gives way to the next.

    Bristles that start at rest under a moving body kick once (`sigma_1 v f_N`).
    """
    wrenches = columns_of(solution, "fx", "fy", "tau")[:, contact]
    for column in wrenches.T:
        if len(column) > 1 and abs(column[0]) > KICK * np.abs(column[1:]).max():
            column[0] = column[1]
    return wrenches


def _between(times: np.ndarray, sampled: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.stack([np.interp(times, sampled, column) for column in values.T], -1)
