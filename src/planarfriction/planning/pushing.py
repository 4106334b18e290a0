"""Quasi-static pushes: a convex slider, a point or flat face that pushes it, and its path with the contact modes.

A force `f` at a point of the slider has the wrench `F = (f, r x f)`. Friction balances it, so the twist is normal to
the limit surface at F. The velocity of that point turns monotonically with the force, since it is the normal to a
section of the convex surface: the forces of the pusher's friction cone correspond to the velocities of the **motion
cone**. The slider sticks to the pusher, or the pusher slides left or right along it.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction._support.equality import ByValue, Checked, Kept, checked
from planarfriction._support.pictures import picture
from planarfriction.errors import InvalidValueError
from planarfriction.limit_surface import LimitSurface
from planarfriction.scenes import Signal
from planarfriction.scenes.signal import as_signal

STICK = "stick"
"""Mode of a pusher that pushes without sliding."""

LEFT = "slide left"
"""Mode of a pusher that slides to the left, seen along its direction."""

RIGHT = "slide right"
"""Mode of a pusher that slides to the right, seen along its direction."""

_BEYOND = 0.1
"""Angle beyond the friction cone [rad] at which a sticking force is still sought: steps may pass the end of a mode."""

_EDGE = 1.0 - 1e-9
"""Share of its half width from which on a face is pressed at its end, as far as rounding can say."""


class TouchPoint(NamedTuple):
    """Point at which a slider is touched, in its own axes."""

    at: np.ndarray
    """`[2]` [m]"""
    normal: np.ndarray
    """Unit vector into the slider `[2]`."""
    half_width: float = 0.0
    """Width of a face that lies flush [m]; `at` is its middle."""


class SliderMotion(NamedTuple):
    """Motion of a slider."""

    twist: np.ndarray
    """Twist of the slider about its frame's origin, in its own axes `[3]`."""
    mode: str
    """`STICK`, `LEFT` or `RIGHT`."""
    slack: float
    """Distance of the mode from its end: an angle [rad], or a share of the face [-]."""
    leans: int = 0
    """A face that cannot stay flush: 1 where it turns about its left end, -1 about its right one."""


def motion_cone(
    surface: LimitSurface, at: ArrayLike, normal: ArrayLike, mu: float
) -> np.ndarray:
    """Return the edges of the motion cone `[2, 2]`: velocities of a point for both edges of the friction cone.

    If the velocity of the pusher is between the two, it sticks; otherwise it slides along the slider, which then moves
    as on the nearer edge. `at` `[2]` [m] is the point, `normal` `[2]` the direction into the slider, in the axes of the
    surface; the result are unit vectors.

    Raises `InvalidValueError` for arguments out of range.

    Source: Mason 1986; Lynch, Maekawa and Tanie 1992.
    """
    validation.instance("surface", surface, LimitSurface, "a limit surface")
    at = validation.vector("at", at, 2)
    normal = validation.vector("normal", normal, 2)
    length = validation.positive("length of normal", np.hypot(*normal))
    angle = math.atan(validation.non_negative("mu", mu))
    place = TouchPoint(at, normal / length)
    edges = np.array([pushed_by(surface, place, each)[1] for each in (-angle, angle)])
    return edges / np.hypot(*edges.T)[:, None]


def motion_at(
    surface: LimitSurface,
    place: TouchPoint,
    mu: float,
    velocity: np.ndarray,
    held: str = "",
) -> SliderMotion:
    """Compute the motion of a slider touched at a place by a pusher with a `velocity` `(vx, vy, omega)` there.

    All in the slider's axes; the pusher approaches, `velocity . normal > 0`. A mode that is `held` stays so beyond its
    end, where its slack is negative.
    """
    from scipy.optimize import brentq

    if place.half_width > 0.0:
        return _flush(surface, place, mu, velocity, held)
    angle = math.atan(mu)
    wanted = _angle(place, velocity)
    edges = [pushed_by(surface, place, each) for each in (-angle, angle)]
    right, left = (_angle(place, moved) for _, moved in edges)
    if angle == 0.0:  # left or right, the force is the same, and no mode has an end
        held = LEFT if wanted >= left else RIGHT
    mode = held or (LEFT if wanted >= left else RIGHT if wanted <= right else STICK)
    if mode == STICK:
        reach = angle + _BEYOND
        off = lambda at: _angle(place, pushed_by(surface, place, at)[1]) - wanted
        try:
            found: float = brentq(off, -reach, reach, xtol=1e-13)  # pyright: ignore
        except (
            ValueError
        ):  # far beyond the end of the mode: a step that will be taken back
            found = math.copysign(reach, -off(reach))
        twist, moved = pushed_by(surface, place, found)
        scale = math.hypot(*velocity[:2]) / math.hypot(*moved)
        return SliderMotion(scale * twist, mode, min(wanted - right, left - wanted))
    twist, moved = edges[mode == LEFT]
    scale = (velocity[:2] @ place.normal) / (moved @ place.normal)
    slack = wanted - left if mode == LEFT else right - wanted
    return SliderMotion(scale * twist, mode, math.inf if angle == 0.0 else slack)


def rotation(angle: float) -> np.ndarray:
    """Return the matrix `[2, 2]` that rotates by an angle [rad], counter-clockwise."""
    c = math.cos(angle)
    s = math.sin(angle)
    return np.array([[c, -s], [s, c]])


def _angle(place: TouchPoint, vector: Any) -> float:
    """Return the angle of a vector to the left of the normal [rad]."""
    x, y = place.normal.tolist()
    a = vector[0]
    b = vector[1]
    return math.atan2(x * b - y * a, x * a + y * b)


def pushed_by(
    surface: LimitSurface, place: TouchPoint, angle: float
) -> tuple[np.ndarray, tuple[float, float]]:
    """Return the twist of unit power under a force at an angle to the normal, and the velocity of the place."""
    nx, ny = place.normal.tolist()
    x, y = place.at.tolist()
    c = math.cos(angle)
    s = math.sin(angle)
    fx = c * nx - s * ny
    fy = s * nx + c * ny
    twist = surface.twist((-fx, -fy, y * fx - x * fy))
    vx, vy, omega = twist.tolist()
    return twist, (vx - omega * y, vy + omega * x)


# ---------------------------------------------------------------------- a face that lies flush


def _flush(
    surface: LimitSurface,
    place: TouchPoint,
    mu: float,
    velocity: np.ndarray,
    held: str,
) -> SliderMotion:
    """Compute the motion of a slider under a flush face with the `velocity` `(vx, vy, omega)` at its middle.

    The pressure of the face has a resultant that crosses it, at an angle within the friction cone.
    """
    from scipy.optimize import brentq

    x, y = place.at
    h = place.half_width
    angle = math.atan(mu)
    vx, vy, omega = velocity
    stuck = np.array([vx + omega * y, vy - omega * x, omega])
    speed = math.hypot(vx, vy) + abs(omega) * (h + math.hypot(x, y))
    # to the normal and to its left
    axes = np.stack([place.normal, rotation(0.5 * math.pi) @ place.normal])

    def of(slip: float) -> tuple[np.ndarray, float, float]:
        """Return twist, angle of the force, and its crossing of the face as a share of the half width."""
        twist = stuck - slip * np.append(axes[1], 0.0)
        fx, fy, tau = -surface.wrench(twist)
        pressed, along = axes @ [fx, fy]
        turn = tau - (x * fy - y * fx)  # about the middle, of the normal force alone
        share = math.copysign(math.inf, -turn)
        if pressed > 0.0:
            share = -turn / (pressed * h)
        return twist, math.atan2(along, pressed), share

    twist, lean, share = of(0.0)
    mode = STICK
    slack = angle - abs(lean)
    if angle == 0.0:
        held = LEFT if lean > 0.0 else RIGHT
    if held in (LEFT, RIGHT) or (not held and slack < 0.0):
        mode = held or (LEFT if lean > 0.0 else RIGHT)
        left = 1.0 if mode == LEFT else -1.0
        # the force turns from one side of the normal to the other between slips far to the right and far to the left
        slip_at = lambda u: speed * u / (1.0 - abs(u))
        off = lambda u: of(slip_at(u))[1] - left * angle
        slip = slip_at(brentq(off, -0.999999, 0.999999, xtol=1e-14))
        twist, _, share = of(slip)
        slack = math.inf if angle == 0.0 else left * slip / speed
    leans = int(math.copysign(1.0, share)) if abs(share) > _EDGE else 0
    return SliderMotion(twist, mode, min(slack, 1.0 - abs(share)), leans)


@dataclass(frozen=True, eq=False)
class Slider(ByValue):
    """An object that slides slowly on its support patch and is pushed at its outline.

    Raises `InvalidValueError` if the outline is not convex or the surface none.
    """

    surface: LimitSurface
    """Limit surface of the patch on which it stands; its frame is the slider's."""
    outline: Kept[ArrayLike, np.ndarray]
    """Corners of the convex outline `[M, 2]` in that frame [m], in either sense of rotation."""

    def __post_init__(self) -> None:
        validation.instance("surface", self.surface, LimitSurface, "a limit surface")
        corners = validation.array("outline", self.outline, (None, 2))
        if len(corners) < 3:
            raise InvalidValueError(
                "outline", "have at least 3 points", f"{len(corners)}"
            )
        edges = (np.roll(corners, -1, axis=0) - corners) @ [1.0, 1.0j]
        turns = np.imag(np.roll(edges, -1) * edges.conj())
        winding = np.angle(np.roll(edges, -1) / np.where(edges, edges, 1.0)).sum()
        convex = (turns > 0.0).all() or (turns < 0.0).all()
        if not convex or abs(winding) > 7.0:
            raise InvalidValueError(
                "outline",
                "be convex, without three corners on a line: use its convex hull, "
                "shapely.MultiPoint(outline).convex_hull.exterior.coords[:-1]",
                "another polygon",
            )
        if turns[0] < 0.0:
            corners = corners[::-1].copy()
        corners.setflags(write=False)
        self._set(outline=corners)

    @cached_property
    def _edges(self) -> np.ndarray:
        """Vectors along the edges, counter-clockwise `[M, 2]` [m]; edge j begins at corner j."""
        return np.roll(self.outline, -1, axis=0) - self.outline

    @cached_property
    def lengths(self) -> np.ndarray:
        """Lengths of the edges `[M]` [m]."""
        return np.hypot(*self._edges.T)

    @cached_property
    def along(self) -> np.ndarray:
        """Unit vectors along the edges, counter-clockwise `[M, 2]`; edge j begins at corner j."""
        return self._edges / self.lengths[:, None]

    @cached_property
    def inward(self) -> np.ndarray:
        """Unit normals of the edges, into the slider `[M, 2]`."""
        return np.stack([-self.along[:, 1], self.along[:, 0]], axis=1)

    @cached_property
    def size(self) -> float:
        """Largest distance of a corner from the frame's origin [m]."""
        return float(np.hypot(*self.outline.T).max())

    def gaps(self, point: np.ndarray) -> np.ndarray:
        """Return the distances of a point `[2]` from the lines of all edges `[M]` [m]; one that is outside has any > 0.

        Raises `InvalidValueError` unless it is a point.
        """
        away = self.outline - validation.vector("point", point, 2)
        return (away * self.inward).sum(axis=1)


@dataclass(frozen=True)
class Pusher(Checked):
    """The pusher: a point, or a flat face that faces along its own x axis.

    Raises `InvalidValueError` for numbers out of range.
    """

    mu: float = checked(validation.non_negative, default=0.0)
    """Coefficient of friction between pusher and slider [-]."""
    width: float = checked(validation.non_negative, default=0.0)
    """Width of the face along the pusher's y axis [m]; 0 is a point."""

    @cached_property
    def ends(self) -> np.ndarray:
        """Right and left end of the face, in the pusher's axes `[2, 2]` [m]; for a point that point `[1, 2]`."""
        half = 0.5 * self.width
        return np.array([[0.0, -half], [0.0, half]]) if half > 0.0 else np.zeros((1, 2))


END = "end"
"""Kind of touch: an end of the pusher at an edge of the slider."""

CORNER = "corner"
"""Kind of touch: a corner of the slider at the face of the pusher."""

FACE = "face"
"""Kind of touch: the face of the pusher flush with an edge of the slider."""

_LEAST = 1e-4
"""Least displacement between two looks at a free pusher, as a share of the slider's size: it may miss a graze."""

_NEAR = 1e-9
"""Distance that counts as touching, as a share of the slider's size."""

_FLUSH = 1e-4
"""Angle [rad] between a face and an edge that touch twice, beyond which they are not flush."""


class Touch(NamedTuple):
    """Feature that touches: an end of the pusher at an edge, a corner at the face, or the face at an edge."""

    kind: str
    edge: int
    """The edge, or the corner."""
    end: int = 0


@dataclass(eq=False)
class Scenery:
    """Slider, pusher and the path of the latter: all the geometry of a push."""

    slider: Slider
    pusher: Pusher
    times: np.ndarray
    """Times of the corners of the path `[K]` [s]."""
    poses: np.ndarray
    """Poses of the pusher there `[K, 3]` [m, m, rad]."""

    def __post_init__(self) -> None:
        self._rates = np.diff(self.poses, axis=0) / np.diff(self.times)[:, None]
        self.near = _NEAR * self.slider.size

    def pose(self, t: float) -> np.ndarray:
        """Return the pose of the pusher `[3]`."""
        i = self._piece(t)
        return self.poses[i] + (t - self.times[i]) * self._rates[i]

    def _piece(self, t: float, forward: bool = False) -> int:
        side = "right" if forward else "left"
        i = int(np.searchsorted(self.times, t, side)) - 1
        return min(max(i, 0), len(self._rates) - 1)

    def piece_end(self, t: float) -> float:
        """Return the time at which the line ends that the pusher follows from a time on."""
        return self.times[self._piece(t, forward=True) + 1]

    def end(self, i: int, t: float, q: np.ndarray) -> np.ndarray:
        """Return an end of the pusher in the slider's axes `[2]`."""
        pose = self.pose(t)
        world = pose[:2] + rotation(pose[2]) @ self.pusher.ends[i]
        return (world - q[:2]) @ rotation(q[2])

    def corners(self, t: float, q: np.ndarray) -> np.ndarray:
        """Return the corners of the slider in the pusher's axes `[M, 2]`."""
        pose = self.pose(t)
        world = q[:2] + self.slider.outline @ rotation(q[2]).T
        return (world - pose[:2]) @ rotation(pose[2])

    def features(self, t: float, q: np.ndarray) -> list[tuple[float, Touch]]:
        """Return everything that may touch, with its distance [m]."""
        found = []
        for i in range(len(self.pusher.ends)):
            gaps = self.slider.gaps(self.end(i, t, q))
            edge = int(gaps.argmax())
            found.append((gaps[edge], Touch(END, edge, i)))
        half = 0.5 * self.pusher.width
        # a corner behind the face's line by more than the face is wide is on its back
        for k, (ahead, aside) in enumerate(self.corners(t, q) if half > 0.0 else ()):
            if abs(aside) <= (1.0 + _NEAR) * half and ahead > -half:
                found.append((ahead, Touch(CORNER, k)))
        return found

    def gap(self, t: float, q: np.ndarray) -> float:
        """Return the distance of pusher and slider [m], negative where they overlap."""
        return min(each[0] for each in self.features(t, q))

    def not_before(self, t: float, q: np.ndarray) -> float:
        """Return a time up to which a free pusher cannot have gone further than it is away from a slider at rest."""
        import shapely

        ends = [self.end(i, t, q) for i in range(len(self.pusher.ends))]
        pusher = shapely.Point(ends[0]) if len(ends) == 1 else shapely.LineString(ends)
        away = shapely.distance(shapely.Polygon(self.slider.outline), pusher)
        away = max(away, _LEAST * self.slider.size)
        vx, vy, omega = self.rate(t, forward=True)
        speed = math.hypot(vx, vy) + abs(omega) * 0.5 * self.pusher.width
        end = self.piece_end(t)
        return min(end, t + away / speed) if speed * (end - t) > away else end

    def clear(self, contact: Touch, t: float, q: np.ndarray) -> float:
        """Return the distance of all that does not touch yet [m]."""
        features = self.features(t, q)
        return (
            min(gap for gap, each in features if not _same(contact, each)) + self.near
        )

    def flush(self, t: float, q: np.ndarray) -> Touch:
        """Return the face at the edge that it has closed with."""
        facing = self.slider.inward @ rotation(self.pose(t)[2] - q[2])[:, 0]
        edge = int(facing.argmax())
        if math.acos(min(facing[edge], 1.0)) > _FLUSH:
            raise InvalidValueError(
                "path",
                "not wedge the slider between two points of the face",
                f"t = {t:g} s",
            )
        return Touch(FACE, edge)

    def within(self, contact: Touch, t: float, q: np.ndarray) -> float:
        """Return the distance of what touches from the end of its edge, or of the face [m]."""
        if contact.kind == CORNER:
            return 0.5 * self.pusher.width - abs(self.corners(t, q)[contact.edge][1])
        if contact.kind == END:
            s = self.along(contact.edge, self.end(contact.end, t, q))
            return min(s, self.slider.lengths[contact.edge] - s)
        low, high = self.overlap(contact.edge, t, q)
        return high - low

    def along(self, edge: int, point: np.ndarray) -> float:
        """Return the position of a point along an edge [m]."""
        return (point - self.slider.outline[edge]) @ self.slider.along[edge]

    def overlap(self, edge: int, t: float, q: np.ndarray) -> tuple[float, float]:
        """Return the part of an edge that the face covers, from its left to its right end as it looks [m]."""
        right, left = (self.along(edge, self.end(i, t, q)) for i in range(2))
        return max(left, 0.0), min(right, self.slider.lengths[edge])

    def rate(self, t: float, forward: bool = False) -> np.ndarray:
        """Return the velocity of the pusher `[3]`."""
        return self._rates[self._piece(t, forward)]


def _same(contact: Touch, other: Touch) -> bool:
    """Return True if a feature is the one that touches: an end at any edge, or a corner."""
    if contact.kind == END == other.kind:
        return contact.end == other.end
    return contact[:2] == other[:2]


def place_of(
    scenery: Scenery, contact: Touch, t: float, q: np.ndarray, forward: bool = False
) -> tuple[TouchPoint, np.ndarray]:
    """Return the place at which a slider is touched, and the velocity of the pusher there, `[3]`, in its axes."""
    slider = scenery.slider
    edge = contact.edge
    pose = scenery.pose(t)
    half = 0.0
    at = slider.outline[edge]
    normal = slider.inward[edge]
    if contact.kind == END:
        at = scenery.end(contact.end, t, q)
    elif contact.kind == CORNER:
        normal = rotation(pose[2] - q[2])[:, 0]
    else:
        low, high = scenery.overlap(edge, t, q)
        half = 0.5 * max(high - low, 0.0)
        at = at + 0.5 * (low + high) * slider.along[edge]
    *rate, omega = scenery.rate(t, forward)
    axes = rotation(q[2])
    x, y = at - (pose[:2] - q[:2]) @ axes
    vx, vy = rate @ axes
    velocity = np.array([vx - omega * y, vy + omega * x, omega])
    return TouchPoint(at, normal, half), velocity


def flush_after(
    scenery: Scenery, contact: Touch, t: float, q: np.ndarray, leans: int
) -> Touch:
    """Return what still touches when a face turns about its left end (1) or its right one (-1)."""
    edge = contact.edge
    following = (edge + 1) % len(scenery.slider.outline)
    right, left = (scenery.along(edge, scenery.end(i, t, q)) for i in range(2))
    if leans > 0:
        return Touch(END, edge, 1) if left >= 0.0 else Touch(CORNER, edge)
    inside = right <= scenery.along(edge, scenery.slider.outline[following])
    return Touch(END, edge, 0) if inside else Touch(CORNER, following)


def touch_after(
    scenery: Scenery, t: float, q: np.ndarray
) -> tuple[float, Touch] | None:
    """Return time and place at which a pusher that does not touch a slider at rest begins to, or None."""
    from scipy.optimize import brentq

    off = lambda at: scenery.gap(at, q) + scenery.near
    before = off(t)
    while t < scenery.times[-1]:
        end = scenery.not_before(t, q)
        after = off(end)
        if after < 0.0 <= before:
            at: Any = brentq(off, t, end, xtol=1e-14 * max(abs(end), 1.0))
            found = sorted(scenery.features(at, q))
            if sum(gap < 100.0 * scenery.near for gap, _ in found) > 1:
                return at, scenery.flush(at, q)
            return at, found[0][1]
        t = end
        before = after
    return None


FREE = "free"
"""The mode of a pusher that does not touch, or that goes away."""

MOST_SAMPLES = 100_000
"""Largest number of instants that are recorded."""

MOST_PHASES = 2_000
"""Largest number of changes of mode that are followed."""

RESTLESS = 4
"""Quick changes of mode in a row after which events no longer separate the modes: on a
facet of a limit surface a push may stay at the edge of its motion cone."""

STILL = 1e-6
"""Share of the whole time within which a change of mode is quick."""


@dataclass(frozen=True, eq=False, repr=False)
class Push(ByValue):
    """The motion of a pushed slider, and its contact with the pusher."""

    slider: Slider
    """The slider."""
    pusher: Pusher
    """The pusher."""
    time: np.ndarray
    """Instants `[T]` [s]."""
    pose: np.ndarray
    """Pose `(x, y, theta)` of the slider's frame in the world `[T, 3]` [m, m, rad]."""
    pusher_pose: np.ndarray
    """Pose of the pusher `[T, 3]` [m, m, rad]."""
    mode: np.ndarray
    """"stick", "slide left", "slide right" (as seen from the pusher) or "free", `[T]`."""
    place: np.ndarray
    """Point of contact in the slider's axes `[T, 2]` [m], NaN without contact; the middle of a face that lies flush."""

    @property
    def end(self) -> np.ndarray:
        """The last pose of the slider `[3]` [m, m, rad]."""
        return self.pose[-1]

    def __repr__(self) -> str:
        x, y, theta = self.end
        modes = ", ".join(
            f"{name} {np.mean(self.mode == name):.0%}"
            for name in dict.fromkeys(self.mode.tolist())
        )
        return f"Push to ({1e3 * x:.4g} mm, {1e3 * y:.4g} mm, {np.degrees(theta):.4g} deg): {modes}"

    def plot(self) -> Any:
        """Draw the slider at instants of the push, with the path of the pusher; returns a matplotlib Figure."""
        return picture("push", self)


def push(
    slider: Slider,
    pusher: Pusher,
    path: Signal,
    *,
    start: ArrayLike = (0.0, 0.0, 0.0),
    samples: int = 101,
    rtol: float = 1e-7,
) -> Push:
    """Predict the motion of a slider that is pushed slowly: friction balances the pusher, without inertia.

    The twist is normal to the limit surface where the pusher's wrench meets it. The pusher sticks while its velocity is
    inside the motion cone, and slides along the slider otherwise. A face that lies flush sticks or slides too, or turns
    about the end that carries its pressure. A pusher that moves away leaves the slider where it is.

    Parameters
    ----------
    slider, pusher
        The object, and what pushes it.
    path
        Pose of the pusher over time, linear between its samples: `(x, y)` `[K, 2]` [m] of a point, `(x, y, angle)` `[K,
        3]` [m, m, rad] of a face, which faces along its own x axis. Only the path matters, not the speed.
    start
        First pose `(x, y, theta)` of the slider's frame [m, m, rad].
    samples
        Number of recorded instants, spread evenly over the path, including both ends.
    rtol
        Relative tolerance of each step of the integration.

    Raises `InvalidValueError` for arguments out of range and a pusher that begins inside the slider.

    Source: Mason 1986; Goyal, Ruina and Papadopoulos 1991; Lynch, Maekawa and Tanie 1992.
    """
    validation.instance("slider", slider, Slider, "a Slider")
    validation.instance("pusher", pusher, Pusher, "a Pusher")
    if not isinstance(path, Signal) or path.hold != "linear" or len(path.times) < 2:
        raise InvalidValueError(
            "path", 'be a Signal of two samples or more with hold="linear"', path
        )
    of_point = path.columns == 2 and pusher.width == 0.0
    path = as_signal("path", path, 2 if of_point else 3)
    start = validation.vector("start", start, 3)
    count = validation.count("samples", samples, 2, MOST_SAMPLES)
    rtol = validation.positive("rtol", rtol)
    poses = path.values if path.columns == 3 else np.pad(path.values, ((0, 0), (0, 1)))
    scenery = Scenery(slider, pusher, path.times, poses)
    time = np.linspace(path.times[0], path.times[-1], count)
    if scenery.gap(time[0], start) < -1e-6 * slider.size:
        raise InvalidValueError(
            "path", "begin outside the slider", scenery.pose(time[0]).tolist()
        )
    pose, modes, places = _follow(scenery, start, time, rtol)
    at = np.array([scenery.pose(t) for t in time])
    return Push(slider, pusher, time, pose, at, np.array(modes), places)


def _follow(
    scenery: Scenery, start: np.ndarray, time: np.ndarray, rtol: float
) -> tuple[np.ndarray, list[str], Any]:
    """Return poses, modes and places at given times, phase after phase."""
    from scipy.integrate import solve_ivp

    poses = np.tile(start, (len(time), 1))
    modes = [FREE] * len(time)
    places = np.full((len(time), 2), np.nan)
    slider = scenery.slider
    mu = scenery.pusher.mu
    now = time[0]
    q = start
    held = ""
    contact: Touch | None = None
    restless = 0
    for _ in range(MOST_PHASES):
        if now >= time[-1]:
            break
        if contact is None:
            poses[time > now] = q
            touched = touch_after(scenery, now, q)
            if touched is None:
                break
            now, contact = touched
            held = ""
        end = scenery.piece_end(now)
        place, velocity = place_of(scenery, contact, now, q, forward=True)
        if velocity[:2] @ place.normal <= 0.0:
            now = np.nextafter(now, np.inf)
            contact = None
            continue
        first = motion_at(slider.surface, place, mu, velocity)
        mode = first.mode
        # after a mode that has come to its end, rounding may still take its neighbour for it
        if mode == held == STICK:
            left, right = (
                motion_at(slider.surface, place, mu, velocity, each).slack
                for each in (LEFT, RIGHT)
            )
            mode = LEFT if left > right else RIGHT
        elif mode == held:
            mode = STICK
        held = ""
        if first.leans:
            contact = flush_after(scenery, contact, now, q, first.leans)
            continue
        mode = "" if restless >= RESTLESS and not place.half_width else mode
        rate, ends = _phase(scenery, contact, mode)
        run = solve_ivp(
            rate,
            (now, end),
            q,
            events=[*ends.values()],
            dense_output=True,
            rtol=rtol,
            atol=rtol * np.array([slider.size, slider.size, 1.0]),
            first_step=end - now,
        )
        here = (time > now) & (time <= run.t[-1]) | (time == now)
        for k in np.flatnonzero(here):
            poses[k] = run.sol(time[k])
            place, velocity = place_of(scenery, contact, time[k], poses[k])
            modes[k] = (
                mode
                if mode and mu > 0.0
                else motion_at(slider.surface, place, mu, velocity).mode
            )
            places[k] = place.at
        restless = restless + 1 if run.t[-1] - now < STILL * (time[-1] - time[0]) else 0
        q = run.y[:, -1].copy()
        now = run.t[-1]
        poses[time > now] = q
        if run.status == 0:
            continue
        what = next(
            name for name, each in zip(ends, run.t_events, strict=True) if len(each)
        )
        if what == "mode":
            held = mode
        elif what == "closes":
            contact = scenery.flush(now, q)
        else:
            contact = None
    else:
        raise InvalidValueError(
            "path",
            f"change the contact of the pusher at most {MOST_PHASES} times",
            f"t = {now:g} s",
        )
    return poses, modes, places


def _phase(scenery: Scenery, contact: Touch, mode: str) -> tuple[Any, dict[str, Any]]:
    """Return the rate of a slider whose contact keeps its mode, and by name the functions whose fall to 0 ends it."""

    @functools.lru_cache(maxsize=1)
    def motion(t: float, *q: float) -> tuple[Any, Any, np.ndarray]:
        place, velocity = place_of(scenery, contact, t, np.array(q))
        surface = scenery.slider.surface
        found = motion_at(surface, place, scenery.pusher.mu, velocity, mode)
        return found, place, velocity

    def rate(t: float, q: np.ndarray) -> np.ndarray:
        twist = motion(t, *q)[0].twist
        return np.append(rotation(q[2]) @ twist[:2], twist[2])

    def approach(t: float, q: np.ndarray) -> float:
        _, place, velocity = motion(t, *q)
        return velocity[:2] @ place.normal

    ends: dict[str, Any] = {"mode": lambda t, q: motion(t, *q)[0].slack} if mode else {}
    ends |= {"leaves": approach, "ends": functools.partial(scenery.within, contact)}
    # Something else may begin to touch.
    if scenery.pusher.width > 0.0 and contact.kind != FACE:
        ends["closes"] = functools.partial(scenery.clear, contact)
    for event in ends.values():
        event.terminal = True
        event.direction = -1
    return rate, ends
