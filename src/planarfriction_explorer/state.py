"""State of the explorer's screen, as a value and as a link: every change makes another one."""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import quote, unquote

import numpy as np

from planarfriction import geometry
from planarfriction._support import validation
from planarfriction._support.equality import Checked, checked
from planarfriction._support.reading import Section
from planarfriction.errors import InvalidValueError, shown
from planarfriction.laws import LAWS, FrictionLaw, LuGre
from planarfriction.limit_surface.comparison import angles
from planarfriction.planning import holding_load
from planarfriction.planning.holding import GRAVITY
from planarfriction.scenes.body import floats
from planarfriction.scenes.model_files import law_from_dict
from planarfriction_explorer.drawing import MOST_SIDE, Drawing

FIRST_PATCH = "NonConvex1"
"""Patch of a new page: two pads, whose limit surface is far from an ellipsoid."""


@dataclass(frozen=True, eq=False)
class State(Checked):
    """A pressure map, a law, a load and a twist; raises `InvalidValueError` for what breaks a rule."""

    drawing: Drawing = field(default_factory=lambda: Drawing.published(FIRST_PATCH))
    """Pressure map."""
    law: FrictionLaw = field(
        default_factory=lambda: LuGre(mu_s=1.2, elasto_plastic=0.9)
    )
    """Friction law."""
    normal_force: float = checked(validation.positive_load, default=1.0)
    """Load [N], which presses the patch."""
    twist: tuple[float, float, float] = checked(floats, 3, default=(0.002, -0.008, 1.0))
    """Twist `(vx, vy, omega)` of the body at the origin of the contact frame [m/s, m/s, rad/s]."""
    mass: float = checked(validation.positive, default=0.05)
    """Mass of a part that two such contacts hold against gravity [kg]."""
    lever: float = checked(validation.number, default=0.01)
    """Distance of its centre of mass from the origin, across gravity [m]."""

    def changed(self, **values: Any) -> State:
        """Return the state with other values of its fields."""
        return dataclasses.replace(self, **values)

    def sliding(self, vx: float, vy: float) -> State:
        """Return the state with another velocity of the origin [m/s]."""
        return self.changed(twist=(vx, vy, self.twist[2]))

    def turning_about(self, x: float, y: float) -> State:
        """Return the state with the centre of rotation (x, y) [m] at the same spin, or at 1 rad/s without one."""
        omega = self.twist[2] or 1.0
        return self.changed(twist=(omega * y, -omega * x, omega))

    def with_law(self, kind: str, **parameters: Any) -> State:
        """Return the state with the law `kind` of those `parameters`; what is left out or None has its default."""
        given = {name: value for name, value in parameters.items() if value is not None}
        return self.changed(law=LAWS.choose(kind)(**given))

    @property
    def needed_load(self) -> float:
        """Return the normal force [N] of each of two contacts below which the part slips, with `mu_s`."""
        weight = 0.5 * GRAVITY * self.mass
        return holding_load(
            (0.0, -weight, -weight * self.lever),
            self.drawing.patch,
            self.law.numbers.mu_s,
        )

    @property
    def centre_of_rotation(self) -> tuple[float, float] | None:
        """The point (x, y) [m] that does not move: `(-vy/omega, vx/omega)`; None without a spin."""
        vx, vy, omega = self.twist
        if omega == 0.0:
            return None
        x = 0.0 - vy / omega
        y = vx / omega
        # In mm too.
        return (x, y) if math.isfinite(1e3 * x) and math.isfinite(1e3 * y) else None


def law_parameters(law: Any) -> dict[str, float | None]:
    """Return parameters of a law by name, as numbers; None where the default of the law depends on others."""
    given = {
        each.name: getattr(law, each.name)
        for each in dataclasses.fields(law)
        if each.init
    }
    return {
        name: getattr(value, "breakaway_ratio", value) for name, value in given.items()
    }


def _finger() -> Drawing:
    """Return a soft fingertip 14 mm wide, whose pressure falls to the rim as that of Hertz."""
    x = (np.arange(28) + 0.5) / 14.0 - 1.0
    return Drawing(
        np.sqrt(np.clip(1.0 - x[:, None] ** 2 - x**2, 0.0, None)).round(3), 0.5e-3
    )


def _foot() -> Drawing:
    """Return an L of two bars, 60 mm long and 20 mm wide."""
    pressures = np.zeros((24, 24))
    pressures[:, :8] = pressures[16:, :] = 1.0
    return Drawing(pressures, 2.5e-3)


def _box() -> Drawing:
    """Return the bottom of a box, 150 mm x 100 mm, which a push on its upper part presses on the edge ahead."""
    return Drawing(np.tile(np.linspace(0.2, 1.0, 30).round(3), (20, 1)), 5e-3)


PRESETS = {
    "two pads of a gripper": State(),
    "disc of a soft fingertip": State(
        _finger(),
        LuGre(mu_c=0.8, mu_s=1.0, elasto_plastic=0.9),
        3.0,
        (0.004, 0.0, 1.0),
        0.1,
        0.015,
    ),
    "L-shaped foot": State(
        _foot(), LuGre(mu_c=0.6, mu_s=0.7), 20.0, (0.0, 0.02, 0.8), 0.5, 0.0
    ),
    "box pushed over a table": State(
        _box(), LuGre(mu_c=0.3, mu_s=0.4), 10.0, (0.05, 0.0, 0.5), 0.5, 0.0
    ),
}
"""States by name; the first is that of a new page."""


MOST_TEXT = 300_000
"""Most characters of a link: a map of the most cells, all with different pressures, fits twice."""

_PLAIN = ("normal_force", "twist", "mass", "lever")


def to_json(state: State) -> str:
    """Return the state as one line of JSON; a map that was painted or loaded is written out, without its name."""
    drawing = state.drawing
    law = {"kind": LAWS.name_of(state.law), **law_parameters(state.law)}
    cells = {"cell_size": drawing.cell_size, "pressures": drawing.pressures.tolist()}
    data = {
        "patch": drawing.name if drawing.origin == "published" else cells,
        "law": {name: value for name, value in law.items() if value is not None},
        **{name: getattr(state, name) for name in _PLAIN},
    }
    return json.dumps(data, separators=(",", ":"))


def from_link(link: str) -> State:
    """Return the state of what `to_link` wrote; what is left out has its default.

    Raises `FrictionError` in one line for all else, also for a link that is too long.
    """
    if len(link) > MOST_TEXT:
        raise InvalidValueError(
            "the link", f"have at most {MOST_TEXT} characters", len(link)
        )
    try:
        data = json.loads(unquote(link.removeprefix("#")))
    except (
        ValueError,
        RecursionError,
    ) as error:  # ValueError: also a number of more digits than Python converts
        raise InvalidValueError(
            "the link", "hold a state as JSON", shown(str(error).partition(";")[0])
        ) from None
    validation.keys("the link", data, (), ("patch", "law", *_PLAIN))
    given = {name: data[name] for name in _PLAIN if name in data}
    if "patch" in data:
        given["drawing"] = _drawing(data["patch"])
    if "law" in data:
        given["law"] = law_from_dict(Section(data["law"], "law", "the link"))
    return State(**given)


def _drawing(patch: Any) -> Drawing:
    if isinstance(patch, str):
        return Drawing.published(patch)
    validation.keys("patch", patch, ("cell_size", "pressures"))
    pressures = validation.non_negative_array(
        "pressures", patch["pressures"], (None, None)
    )
    if not 0 < min(pressures.shape) <= max(pressures.shape) <= MOST_SIDE:
        rule = f"have from 1 to {MOST_SIDE} rows and columns"
        raise InvalidValueError("pressures", rule, "{} x {}".format(*pressures.shape))
    drawing = Drawing(pressures, patch["cell_size"])
    if pressures.any():
        _ = drawing.patch  # refuses cells of no size in range now
    return drawing


def to_link(state: State) -> str:
    """Return what stands in the address of the page behind its path."""
    return "#" + quote(to_json(state), safe=",:")


@dataclass(frozen=True)
class Answer:
    """The friction of a state; wrenches `(fx, fy, tau)` [N, N, N m] on the body, about the contact frame's origin."""

    friction: np.ndarray
    """Wrench of steady sliding with the law, `[3]`."""
    surface: np.ndarray
    """Wrench of the exact limit surface at `mu_c f_N`, `[3]`: no Stribeck, no viscous friction."""
    ellipsoid: np.ndarray
    """Wrench of the ellipsoid at `mu_c f_N`, `[3]`."""
    points: np.ndarray
    """The three as points `(fx, fy, tau/r)/(mu_c f_N)` about the centre of pressure, `[3, 3]` [-]."""
    force_error: float
    """Distance of the ellipsoid's point from the surface's [-]."""
    angle_error: float
    """Angle [deg] between the twist and the one that the ellipsoid gives for the wrench of the surface."""
    power: float
    """Dissipated power [W]."""


def answer(state: State) -> Answer:
    """Return the friction of a state. Raises `InvalidValueError` where nothing presses, or a single point alone."""
    surface = state.drawing.surface
    ellipsoid = state.drawing.ellipsoid
    twist = np.array(state.twist)
    mu_c = state.law.numbers.mu_c
    scale = np.array([1.0, 1.0, surface.contact_radius])
    units = np.stack(
        [steady_wrench(state) / mu_c, surface.wrench(twist), ellipsoid.wrench(twist)]
    )
    points = geometry.wrench_at(units, surface.centre_of_pressure) / scale
    # Last: 0 under a load near 5e-324 N.
    friction, of_surface, of_ellipsoid = mu_c * state.normal_force * units
    angle = 0.0
    if units[1].any():
        both = np.stack([twist, ellipsoid.twist(units[1])])
        angle = float(
            angles(*(geometry.twist_at(both, surface.centre_of_pressure) * scale))
        )
    error = float(np.linalg.norm(points[2] - points[1]))
    return Answer(
        friction,
        of_surface,
        of_ellipsoid,
        points,
        error,
        angle,
        float(-friction @ twist),
    )


def steady_wrench(state: State) -> np.ndarray:
    """Return the wrench `[3]` of steady sliding per unit load, `-sum(w_i F(|v_i|) B_i' v_i/|v_i|)` of the law's F."""
    patch = state.drawing.patch
    x, y = patch.positions.T
    vx, vy, _ = geometry.twist_at(np.array(state.twist), patch.positions).T
    speed = np.hypot(vx, vy)
    friction = -patch.weights() * state.law.steady_friction(speed)
    speed = np.where(speed > 0.0, speed, 1.0)
    fx = friction * (vx / speed)
    fy = friction * (vy / speed)
    return np.array([fx.sum(), fy.sum(), (x * fy - y * fx).sum()])
