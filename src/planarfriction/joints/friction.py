"""Friction of one joint: a law in N m and rad whose level may grow with the torque through the gears."""

from __future__ import annotations

from dataclasses import dataclass

from planarfriction import validation
from planarfriction.equality import Checked, checked
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.joints.loops.runs import JointNumbers
from planarfriction.laws import LuGre

RIGID = 1e-3
"""Angle [rad] that a rigid joint bends before it slips, where a step needs bristles: the resolution of encoders."""


@dataclass(frozen=True)
class JointFriction(Checked):
    """Friction torque of a joint: `g(v) + |b_m tau_m - b_e tau_e|` in steady sliding, and `sigma_2 v`.

    `g(v) = mu_c + (mu_s - mu_c) exp(-(v/v_s)^2)`; bristles of stiffness `sigma_0` bend before it slips.

    Raises InvalidValueError for negative numbers and for `mu_s` below `mu_c`.
    """

    mu_c: float = checked(validation.positive)
    """Coulomb friction [N m]."""
    sigma_2: float = checked(validation.non_negative, default=0.0)
    """Viscous friction [N m s/rad]."""
    load_motor: float = checked(validation.non_negative, default=0.0)
    """Growth of the level with the torque of the motor, b_m [-]."""
    load_external: float = checked(validation.non_negative, default=0.0)
    """Growth of the level with the torque of all else, b_e [-]."""
    mu_s: float = checked(validation.positive, default=None)
    """Static friction [N m]; equal to `mu_c` by default."""
    v_s: float = checked(validation.positive, default=1.0)
    """Stribeck speed [rad/s]."""
    sigma_0: float | None = checked(validation.positive, default=None)
    """Stiffness before slip [N m/rad]; None for rigid friction."""
    sigma_1: float = checked(validation.non_negative, default=0.0)
    """Damping of the bristles [N m s/rad]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.mu_s is None:
            self._set(mu_s=self.mu_c)
        if self.mu_s < self.mu_c:
            raise InvalidValueError("mu_s", f"be >= mu_c = {self.mu_c:g}", self.mu_s)

    @property
    def law(self) -> LuGre:
        """The law as LuGre under the load 1, in N m and rad; a rigid joint bends by `RIGID`.

        Raises InvalidValueError for a rigid joint above 1e47 N m, whose stiffness no law takes.
        """
        return LuGre(self.mu_c, self.mu_s, self.v_s, self.sigma_0 or self.mu_s / RIGID, self.sigma_1, self.sigma_2)

    def load(self, tau_motor: float, tau_external: float) -> float:
        """Compute the growth of the level [N m] at torques of the motor and of all else [N m].

        Raises InvalidValueError for torques that are not finite.
        """
        motor, outside = validation.number("tau_motor", tau_motor), validation.number("tau_external", tau_external)
        return abs(self.load_motor * motor - self.load_external * outside)

    @property
    def numbers(self) -> JointNumbers:
        """Numbers with bristles, as a step reads them."""
        return JointNumbers(self.law.numbers, self.load_motor, self.load_external)

    @property
    def rigid_numbers(self) -> JointNumbers:
        """Numbers as a simulated run reads them: rigid friction without bristles."""
        law = self.law.numbers
        return self.numbers._replace(law=LawNumbers(*law)._replace(sigma_0=self.sigma_0 or 0.0))
