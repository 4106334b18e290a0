"""What a grip plan reaches, in numbers and as a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.equality import ByValue


@dataclass(frozen=True, eq=False, repr=False)
class GripReport(ByValue):
    """What a plan reaches as the scene is and with F other frictions, and what it took."""

    goal: dict[str, Any]
    """What was wanted, as given."""
    angle: float
    """How far the body turns [rad]."""
    slide: np.ndarray
    """How far the place under the grip moves away from it `[2]`, world axes [m]."""
    speed: float
    """Speed of that place at the end [m/s]."""
    grip: float
    """Normal force at the end [N]."""
    holding: float
    """Normal force that would just hold the body there [N]."""
    frictions: np.ndarray
    """Factors on mu_c and mu_s, ascending `[F]`."""
    angles: np.ndarray
    """How far the body turns with each `[F]` [rad]."""
    slides: np.ndarray
    """How far it slides with each `[F, 2]` [m]."""
    per_percent: float
    """By how much one percent of friction moves the goal's own quantity: angle [rad] or slide [m]."""
    simulations: int
    """Simulations that the plan took."""
    jacobians: int
    """Derivatives by all knots that it took."""
    wall_time: float
    """Time that it took [s]."""

    @property
    def spread(self) -> float:
        """Largest miss of the goal over all frictions: angle [rad] or slide [m]."""
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
        lines = [f"Grip plan: {wanted}", ""]
        lines += [f"{'friction':>9}{'turn [deg]':>13}{'slide x [mm]':>15}{'slide y [mm]':>15}"]
        for factor, angle, (x, y) in zip(self.frictions, self.angles, self.slides, strict=True):
            change = f"{100.0 * (factor - 1.0):+.3g} %" if factor != 1.0 else "as is"
            lines.append(f"{change:>9}{np.rad2deg(angle):>13.3f}{1e3 * x:>15.3f}{1e3 * y:>15.3f}")
        lines += ["", f"One percent of friction moves the end by {per}."]
        lines += [
            f"At the end the grip is {self.grip:.3g} N, {self.grip / self.holding:.2f} times what holds the body."
        ]
        lines += [f"{self.simulations} simulations, {self.jacobians} Jacobians, {self.wall_time:.2g} s."]
        return "\n".join(lines)

    __repr__ = __str__


def report_of(
    aim: Any, frictions: Sequence[float], outcomes: Sequence[Any], grip: float, holding: float, cost: Any
) -> GripReport:
    """Report of where a plan ends with each friction."""
    end = dict(zip(frictions, outcomes, strict=True))
    turns = aim.angle is not None
    size = abs(aim.angle) if turns else float(np.hypot(*aim.slide))
    moved = abs(aim.progress(end[1.01]) - aim.progress(end[0.99])) / 2.0 * size
    return GripReport(
        {"angle": aim.angle} if turns else {"slide": tuple(aim.slide.tolist())},
        end[1.0].angle,
        end[1.0].slide,
        float(np.linalg.norm(end[1.0].speed * [1.0, 1.0, aim.radius])),
        grip,
        holding,
        np.array(frictions),
        np.array([each.angle for each in outcomes]),
        np.array([each.slide for each in outcomes]),
        moved,
        *cost,
    )
