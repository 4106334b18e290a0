"""State of the explorer's screen, as a value: every change makes another one."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any

from planarfriction import validation
from planarfriction.laws import LAWS, FrictionLaw, LuGre
from planarfriction.planning import holding_load
from planarfriction.planning.holding import GRAVITY
from planarfriction_explorer.drawing import Drawing

FIRST_PATCH = "NonConvex1"
"""Patch of a new page: two pads, whose limit surface is far from an ellipsoid."""


@dataclass(frozen=True, eq=False)
class State:
    """A pressure map, a law, a load and a twist; raises `InvalidValueError` for what breaks a rule."""

    drawing: Drawing = field(default_factory=lambda: Drawing.published(FIRST_PATCH))
    """Pressure map."""
    law: FrictionLaw = field(default_factory=lambda: LuGre(mu_s=1.2, elasto_plastic=0.9))
    """Friction law."""
    normal_force: float = 1.0
    """Load [N], which presses the patch."""
    twist: tuple[float, float, float] = (0.002, -0.008, 1.0)
    """Twist `(vx, vy, omega)` of the body at the origin of the contact frame [m/s, m/s, rad/s]."""
    mass: float = 0.05
    """Mass of a part that two such contacts hold against gravity [kg]."""
    lever: float = 0.01
    """Distance of its centre of mass from the origin, across gravity [m]."""

    def __post_init__(self) -> None:
        load = validation.positive_load("normal_force", self.normal_force)
        object.__setattr__(self, "normal_force", load)
        object.__setattr__(self, "mass", validation.positive("mass", self.mass))
        object.__setattr__(self, "lever", validation.number("lever", self.lever))
        object.__setattr__(self, "twist", tuple(validation.vector("twist", self.twist, 3).tolist()))

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
        return holding_load((0.0, -weight, -weight * self.lever), self.drawing.patch, self.law.numbers.mu_s)

    @property
    def centre_of_rotation(self) -> tuple[float, float] | None:
        """The point (x, y) [m] that does not move: `(-vy/omega, vx/omega)`; None without a spin."""
        vx, vy, omega = self.twist
        if omega == 0.0:
            return None
        x, y = 0.0 - vy / omega, vx / omega
        return (x, y) if math.isfinite(1e3 * x) and math.isfinite(1e3 * y) else None  # in mm too


def law_parameters(law: Any) -> dict[str, float | None]:
    """Return parameters of a law by name, as numbers; None where the default of the law depends on others."""
    given = {each.name: getattr(law, each.name) for each in dataclasses.fields(law) if each.init}
    return {name: getattr(value, "breakaway_ratio", value) for name, value in given.items()}
