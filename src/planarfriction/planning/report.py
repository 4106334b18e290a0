"""Report of a grip plan, in numbers and as a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.equality import ByValue


@dataclass(frozen=True, eq=False, repr=False)
class GripReport(ByValue):
    """Result of a plan with the scene's friction and with F other values, and the time that planning took."""

    goal: dict[str, Any]
    """The goal as given."""
    angle: float
    """Angle by which the body turns [rad]."""
    slide: np.ndarray
    """Displacement `[2]` of the point of the body under the grip, world axes [m]."""
    speed: float
    """Speed of that point at the end [m/s]."""
    grip: float
    """Normal force at the end [N]."""
    holding: float
    """Smallest normal force that would hold the body there [N]."""
    frictions: np.ndarray
    """Factors on mu_c and mu_s, ascending `[F]`."""
    angles: np.ndarray
    """Angle by which the body turns with each friction `[F]` [rad]."""
    slides: np.ndarray
    """Slide with each friction `[F, 2]` [m]."""
    per_percent: float
    """Change of the goal's quantity per percent of friction: angle [rad] or slide [m]."""
    simulations: int
    """Number of simulations."""
    jacobians: int
    """Number of Jacobians with respect to all knots."""
    wall_time: float
    """Computing time [s]."""

    @property
    def spread(self) -> float:
        """Largest error of the goal over all frictions: angle [rad] or slide [m]."""
        if "angle" in self.goal:
            return float(np.abs(self.angles - self.goal["angle"]).max())
        return float(np.hypot(*(self.slides - self.goal["slide"]).T).max())

    def __str__(self) -> str:
        turns = "angle" in self.goal
        if turns:
            wanted = f"turn by {np.rad2deg(self.goal['angle']):.4g} degrees"
            per = f"{np.rad2deg(self.per_percent):.2g} degrees"
        else:
            wanted = "slide by ({:.4g}, {:.4g}) mm".format(*(1e3 * np.array(self.goal["slide"])))
            per = f"{1e3 * self.per_percent:.2g} mm"
        lines = [f"Grip plan: {wanted}.", ""]
        lines += [f"{'friction':>9}{'turn [deg]':>13}{'slide x [mm]':>15}{'slide y [mm]':>15}"]
        for factor, angle, (x, y) in zip(self.frictions, self.angles, self.slides, strict=True):
            change = f"{100.0 * (factor - 1.0):+.3g} %" if factor != 1.0 else "nominal"
            lines.append(f"{change:>9}{np.rad2deg(angle):>13.3f}{1e3 * x:>15.3f}{1e3 * y:>15.3f}")
        lines += ["", f"An error of one percent in friction changes the result by {per}."]
        lines += [f"The final grip is {self.grip:.3g} N, {self.grip / self.holding:.2f} times the holding force."]
        lines += [f"{self.simulations} simulations, {self.jacobians} Jacobians, {self.wall_time:.2g} s."]
        return "\n".join(lines)

    __repr__ = __str__


def report_of(
    aim: Any, frictions: Sequence[float], ends: Sequence[np.ndarray], grip: float, holding: float, cost: Any
) -> GripReport:
    """Return the report on the ends `[6]` of a plan, one for each friction (see `motions.Aim`)."""
    less, end, more = (ends[frictions.index(each)] for each in (0.99, 1.0, 1.01))
    goal = {"slide": tuple(aim.slide.tolist())} if aim.angle is None else {"angle": aim.angle}
    per_percent = abs(aim.progress(more) - aim.progress(less)) / 2.0 * float(np.linalg.norm(aim.end))
    speed, every = float(np.linalg.norm(end[:3] * [1.0, 1.0, aim.radius])), np.array(ends)
    of_nominal = goal, float(end[5]), end[3:5], speed, grip, holding
    return GripReport(*of_nominal, np.array(frictions), every[:, 5], every[:, 3:5], per_percent, *cost)
