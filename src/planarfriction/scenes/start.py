"""Initial state of the bristles of a scene: relaxed, carrying the load, or as in steady sliding."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction.errors import InvalidValueError
from planarfriction.geometry import rotate, twist_at
from planarfriction.scenes.body import pull_on

_LONG = 1e6
"""Step [s] in which bristles reach the steady state of a held twist: all that move by more than 1e-12 m/s."""

_BALANCED = 1e-9
"""Share of the load that an equilibrium may leave unbalanced: far below what the solver sees at any tolerance."""

_CLOSE = 1e-13
"""Share of the load that Newton's method may leave unbalanced; else the energy is minimised."""

_NEAR = 1e-3
"""Share of the load that the search of the least energy leaves unbalanced where it has found it."""


def first_states(scene: Any, shaped: np.ndarray) -> list[np.ndarray]:
    """Return the first state of each contact `[*state_shape]` of a scene whose bristles do not start at rest.

    `shaped` `[C]` are the loads [N] whose shapes the contacts have at first.
    """
    for contact in scene.contacts:
        if not hasattr(contact.model, "state_of"):
            rule = f"be 'rest' for a {type(contact.model).__name__}, which has no state_of(deflections, normal_force)"
            raise InvalidValueError("start", rule, scene.start)
    loads = np.array([float(contact.normal_force(0.0)) for contact in scene.contacts])
    shaped = np.where(loads > 0.0, shaped, 0.0)
    if scene.start == "sliding":
        pads = [contact.model.reduction.pad is not None for contact in scene.contacts]
        return _sliding(scene, np.where(pads, loads, shaped))
    return _equilibrium(scene, loads, shaped)


def first_slopes(
    scene: Any, shaped: np.ndarray, d_loads: np.ndarray, d_pull: np.ndarray
) -> list[np.ndarray]:
    """Return the changes of the first states `[K, *state_shape]` of an equilibrium, per contact, by K changes of loads.

    `d_loads` `[K, C]` are those of the normal forces [N], `d_pull` `[K, 3]` those of the load on the body. Bristles
    follow the motion to which the body is pulled on, but for those bent as far as they can be, which only turn.
    """
    loads = np.array([float(contact.normal_force(0.0)) for contact in scene.contacts])
    cells, sizes, pull = _held_by(scene, loads, np.where(loads > 0.0, shaped, 0.0))
    motion = _least_energy(cells, pull)
    bent, slope = cells.bent(motion)
    share = np.repeat(d_loads / np.where(loads == 0.0, 1.0, loads), sizes, axis=1)
    # Limits of pads grow with loads.
    longer = bent - np.einsum("nij,nj->ni", slope, cells.levers @ motion)
    fixed = cells.fixed[:, None]
    held = np.einsum(
        "kn,n,nij,ni->kj",
        share,
        cells.stiffness,
        cells.levers,
        np.where(fixed, longer, bent),
    )
    motions = np.linalg.lstsq(cells.stiff(slope), (d_pull - held).T, rcond=None)[0]
    moved = np.einsum("nij,njb,bk->kni", slope, cells.levers, motions)
    moved = moved + share[:, :, None] * np.where(fixed, longer, 0.0)
    return _states(scene, shaped, moved, sizes)


def _states(
    scene: Any, shaped: np.ndarray, deflections: np.ndarray, sizes: list[int]
) -> list[np.ndarray]:
    """Return the states `[K, *state_shape]` of each contact with deflections `[K, n, 3]` of the cells of all."""
    found = []
    parts = np.split(deflections, np.cumsum(sizes), axis=1)[:-1]
    for contact, part, load in zip(scene.contacts, parts, shaped, strict=True):
        model = contact.model.reduction
        states = [
            model.state_of(row.T[: model.patch.bristles], load)
            if load > 0.0
            else model.rest()
            for row in part
        ]
        found.append(np.array(states).reshape(len(part), *model.state_shape))
    return found


def contact_map(scene: Any, contact: Any) -> np.ndarray:
    """Return `A` `[3, 3]` of `V = A u` at t = 0: the twist of a contact from the velocity of the body."""
    body = scene.body
    at = np.array(contact.position)
    angle = contact.angle
    if scene.velocity is None and contact.mounted_on == "world":
        at = at - body.position
    elif scene.velocity is None:
        at = rotate(at, body.angle)
        angle = angle + body.angle
    # Columns are the twists of the contact for unit velocities.
    return rotate(twist_at(np.eye(3), at), -angle).T


def _sliding(scene: Any, shaped: np.ndarray) -> list[np.ndarray]:
    velocity = scene.body.velocity if scene.velocity is None else scene.velocity(0.0)
    states = []
    for contact, load in zip(scene.contacts, shaped, strict=True):
        model = contact.model
        state = model.rest()
        if load > 0.0:
            relative = np.asarray(velocity) - _carried(scene.body, contact)
            twist = contact_map(scene, contact) @ relative
            state = model.step(state, twist, load, _LONG)[0]
        states.append(state)
    return states


def _carried(body: Any, contact: Any) -> np.ndarray:
    """Return the velocity `[3]` that the centre of mass would have at t = 0 on what the contact touches."""
    if contact.support_velocity is None:
        return np.zeros(3)
    origin = contact.position if contact.mounted_on == "world" else (0.0, 0.0)
    beside = np.subtract(body.position, origin)
    return twist_at(contact.support_velocity(0.0), beside)


# ---------------------------------------------------------------------- bristles that carry the load


class _BristleField(NamedTuple):
    """The cells of all contacts, and behind them the springs by which faces of pads hang.

    A motion `[m]` is that of the body `[3]`, then of the springs of each face.
    """

    levers: np.ndarray
    """Jacobian of the displacement of each cell by a small motion, `[n, 3, m]`."""
    stiffness: np.ndarray
    """`count f_N w_i sigma_0`, or that of the pieces of a pad, `[n]` [N/m]."""
    largest: np.ndarray
    """Largest deflection `[n]` [m]."""
    middle: np.ndarray
    """Deflection of each bristle that is as far from its largest in all directions `[n, 3]` [m]."""
    fixed: np.ndarray
    """True for pieces of a pad, whose stiffness does not grow with the load, bool `[n]`."""

    def bent(self, motion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the deflections `[n, 3]` after a small motion, and slopes `[n, 3, 3]` by the stretch."""
        shift = self.levers @ motion - self.middle
        length = _lengths(shift)
        over = length > self.largest
        share = np.where(over, self.largest, 1.0) / np.where(over, length, 1.0)
        along = shift / np.where(length > 0.0, length, 1.0)[:, None]
        slope = share[:, None, None] * (
            np.eye(3) - over[:, None, None] * along[:, :, None] * along[:, None, :]
        )
        return self.middle + share[:, None] * shift, slope

    def load(self, deflections: np.ndarray) -> np.ndarray:
        """Return the load `[m]` on body and springs that deflections `[n, 3]` hold."""
        return np.einsum("n,nij,ni->j", self.stiffness, self.levers, deflections)

    def stiff(self, slope: np.ndarray) -> np.ndarray:
        """Return the stiffness `[m, m]` against the motion if bristles bend by `slope` `[n, 3, 3]` of a stretch."""
        forces = self.stiffness[:, None, None] * (slope @ self.levers)
        return np.tensordot(self.levers, forces, axes=((0, 1), (0, 1)))


def _lengths(vectors: np.ndarray) -> np.ndarray:
    """Return the lengths of vectors `[n, 3]`, of any size."""
    x, y, s = vectors.T
    return np.hypot(np.hypot(x, y), s)


def _equilibrium(scene: Any, loads: np.ndarray, shaped: np.ndarray) -> list[np.ndarray]:
    """Return the bristles that one small rigid motion bends, from rest to where they carry the load of the body.

    None is bent further than it can be, and of all bristles that carry the load these store the least energy: with
    `zhat(d)` the nearest to `B_i d` that a bristle can be, the motion d makes `int sum k_i zhat_i dB_i d - P.d` least.
    That is the rule by which contacts share what statics leaves open. A face with the compliance `C = R R'` against its
    back is displaced by `B_i (d - R s)`, with the energy `s.s/2` of springs s.
    """
    cells, sizes, pull = _held_by(scene, loads, shaped)
    bent = cells.bent(_least_energy(cells, pull))[0]
    return [states[0] for states in _states(scene, shaped, bent[None], sizes)]


def _held_by(
    scene: Any, loads: np.ndarray, shaped: np.ndarray
) -> tuple[_BristleField, list[int], np.ndarray]:
    """Return the cells of all contacts, the number of each contact's, and the load that they hold."""
    for contact in scene.contacts:
        if not contact.model.law.holds_at_rest:
            raise InvalidValueError(
                "start", "be 'rest' or 'sliding' with a law that creeps", scene.start
            )
    soft = [each.model.compiled.compliance for each in scene.contacts]
    faces = sum(each is not None for each in soft)
    body, *springs = np.eye(3 + 3 * faces).reshape(1 + faces, 3, -1)
    springs = np.reshape(springs, (faces, 3, 3 + 3 * faces))
    free = iter(springs)
    fields = []
    counts = []
    every = zip(scene.contacts, loads, shaped, soft, strict=True)
    for contact, load, shape, common in every:
        moved = contact_map(scene, contact) @ body
        if common is not None:
            size, axes = np.linalg.eigh(common)
            moved -= axes * np.sqrt(np.maximum(size, 0.0)) @ next(free)
            counts.append(float(contact.count))
        fields.append(_cells_of(contact, load, shape, moved))
    hung = _BristleField(
        springs,
        np.array(counts),
        np.full(faces, np.finfo(float).max),
        np.zeros((faces, 3)),
        np.full(faces, True),
    )
    sizes = [len(each.stiffness) for each in fields]
    whole = _BristleField(*map(np.concatenate, zip(*fields, hung, strict=True)))
    pull = pull_on(scene, scene.body, 0.0)
    return whole, sizes, np.append(pull, np.zeros(3 * faces))


def _cells_of(
    contact: Any, load: float, shaped: float, moved: np.ndarray
) -> _BristleField:
    """Return the cells of a contact, whose face follows motions by `moved` `[3, m]`."""
    model = contact.model.reduction
    patch = model.patch
    law = model.law.numbers
    levers = patch.levers() @ moved
    # Points do not spin.
    levers = np.pad(levers, ((0, 0), (0, 3 - levers.shape[1]), (0, 0)))
    weights = patch.weights(shaped) if shaped > 0.0 else np.zeros(len(levers))
    holds = float(formulas.stribeck(np, np.zeros(()), law)) * load * weights
    stiffness = law.sigma_0 * load * weights
    pad = model.pad
    if pad is not None:
        stiffness = pad.pieces(patch, model.law)
    largest = np.full(len(levers), float(formulas.stribeck(np, np.zeros(()), law)))
    largest = largest / law.sigma_0
    middle = np.pad(largest[:, None] * patch.asymmetries(), ((0, 0), (0, 1)))
    pads = np.full(len(levers), pad is not None)
    if pad is not None:
        largest = holds / stiffness
    return _BristleField(levers, contact.count * stiffness, largest, middle, pads)


def _least_energy(cells: _BristleField, pull: np.ndarray) -> np.ndarray:
    """Return the motion `[m]` after which bristles carry a load `[m]`; raises where none does."""
    elastic = np.einsum("n,nia,nib->ab", cells.stiffness, cells.levers, cells.levers)
    # Stiffness of smaller loads has too few digits to divide by.
    carries = np.diagonal(elastic) > np.finfo(float).tiny
    scale = 1.0 / np.sqrt(np.where(carries, np.diagonal(elastic), 1.0))
    scaled = np.where(np.outer(carries, carries), elastic, 0.0) * np.outer(scale, scale)
    motion = scale * np.linalg.lstsq(scaled, scale * pull, rcond=1e-14)[0]
    if not np.array_equal(
        cells.bent(motion)[0], cells.middle + (cells.levers @ motion - cells.middle)
    ):
        motion = _bent_to_the_end(cells, pull, motion, scale)
    bent = cells.bent(motion)[0]
    size = max(np.abs(scale * pull).max(), np.finfo(float).tiny)
    if np.abs(scale * (cells.load(bent) - pull)).max() > _BALANCED * size:
        at_most = _held(cells, pull, motion)
        friction = ""
        if at_most is not None:
            friction = f" (they hold {100.0 * at_most:.3g} % of the load at most)"
        rule = f"be 'rest' or 'sliding' if the contacts do not hold the body{friction}"
        raise InvalidValueError("start", rule, "equilibrium")
    return motion


@np.errstate(over="ignore", invalid="ignore")  # of loads that nothing holds
def _bent_to_the_end(
    cells: _BristleField, pull: np.ndarray, motion: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """Return the motion of least energy where some bristles are bent as far as they can be."""
    from scipy.optimize import minimize, root

    unit = np.abs(motion / scale).max()  # motions of the search are of order one

    def energy(x: np.ndarray) -> float:
        d = unit * scale * x
        shift = cells.levers @ d
        out = shift - cells.bent(d)[0]
        stored = 0.5 * (cells.stiffness * (shift**2 - out**2).sum(axis=1)).sum()
        return (stored - pull @ d) / unit**2

    def slope(x: np.ndarray) -> np.ndarray:
        return scale * (cells.load(cells.bent(unit * scale * x)[0]) - pull) / unit

    def curvature(x: np.ndarray) -> np.ndarray:
        bend = cells.bent(unit * scale * x)[1]
        return cells.stiff(bend) * np.outer(scale, scale)

    start = motion / (unit * scale)
    load = np.abs(scale * pull).max() / unit
    # The energy is convex: where its slope vanishes, it is least.
    found = root(slope, start, jac=curvature, tol=_CLOSE)
    if np.abs(found.fun).max() < _CLOSE * load:
        return unit * scale * found.x
    options = {"gtol": 1e-13, "maxiter": 100, "max_trust_radius": 1e6}
    found = minimize(
        energy,
        start,
        method="trust-exact",
        jac=slope,
        hess=curvature,
        options=options,
    )
    close = np.abs(found.jac).max() < _NEAR * load
    x = found.x
    if close:  # the energy hides in its own rounding how close this is
        closer = root(slope, x, jac=curvature)
        if np.abs(closer.fun).max() < np.abs(found.jac).max():
            x = closer.x
    return unit * scale * x


def _held(cells: _BristleField, pull: np.ndarray, motion: np.ndarray) -> float | None:
    """Return a bound below 1 on the share of the load that friction holds, if a motion proves it, or None."""
    shift = cells.levers[..., :3] @ motion[:3]  # of faces like the body
    power = float(pull @ motion)
    most = (
        cells.stiffness
        * (cells.largest * _lengths(shift) + (cells.middle * shift).sum(axis=1))
    ).sum()
    return float(most / power) if 0.0 <= most < power else None
