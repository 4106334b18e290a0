"""Friction of one joint: a law in N m and rad whose level may grow with the torque through the gears; in MuJoCo too."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

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


WEAK = 1e-6
"""Resistance [Ohm] of a dcmotor whose back-EMF is to be nothing."""


def motor_lugre(friction: JointFriction, load: float = 0.0) -> list[float]:
    """Return the numbers `lugre` of MuJoCo's dcmotor: sigma_0, sigma_1, and mu_c, mu_s, v_s at a load [N m]."""
    law = friction.law
    return [law.sigma_0, law.sigma_1, friction.mu_c + load, friction.mu_s + load, friction.v_s]


def to_mjcf(
    friction: JointFriction,
    joint: str,
    *,
    armature: float = 0.0,
    torque_gain: float | None = None,
    back_emf: float = 0.0,
) -> str:
    """Return MJCF of a joint and its dcmotor, which takes volts, as text; levels are those without load.

    `torque_gain` is kt/R [N m/V], `back_emf` kt^2/R [N m s/rad]. Friction with bristles is the motor's `lugre`, rigid
    friction the joint's `frictionloss`. A motor whose wires are open has no back-EMF: set its gain and bias to 0 then.

    Raises InvalidValueError for a name that is no text, and numbers below zero.
    """
    friction = validation.instance("friction", friction, JointFriction, "a JointFriction")
    joint = escape(validation.text("joint", joint), {'"': "&quot;"})
    armature, back_emf = validation.non_negative("armature", armature), validation.non_negative("back_emf", back_emf)
    torque_gain = None if torque_gain is None else validation.positive("torque_gain", torque_gain)
    loss = 0.0 if friction.sigma_0 else friction.mu_c
    values = {"damping": friction.sigma_2, "frictionloss": loss, "armature": armature}
    words = " ".join(f'{name}="{value:.6g}"' for name, value in values.items())
    lines = [f'<joint name="{joint}" {words}/>']
    if friction.sigma_0 or torque_gain:
        gain = torque_gain or 1.0
        resistance = back_emf / gain**2 or WEAK
        numbers = " ".join(f"{each:.6g}" for each in motor_lugre(friction))
        motor = f'motorconst="{gain * resistance:.6g}" resistance="{resistance:.6g}"'
        motor += f' lugre="{numbers}"' if friction.sigma_0 else ""
        lines.append(f'<dcmotor name="{joint}" joint="{joint}" {motor}/>')
    return "\n".join(lines)


def apply_to_spec(friction: JointFriction, spec: Any, joint: str, *, armature: float | None = None) -> None:
    """Set the friction of a joint of a `mujoco.MjSpec`: damping and frictionloss, or the `lugre` of its dcmotor.

    Raises InvalidValueError for a joint that is not there, and for bristles without a dcmotor on the joint.
    """
    found = spec.joint(joint)
    if found is None:
        raise InvalidValueError("joint", "be the name of a joint of the model", joint)
    found.damping = np.array([friction.sigma_2, 0.0, 0.0]) if np.ndim(found.damping) else friction.sigma_2
    found.frictionloss = 0.0 if friction.sigma_0 else friction.mu_c
    if armature is not None:
        found.armature = armature
    if not friction.sigma_0:
        return
    motors = [each for each in spec.actuators if each.target == joint and each.dyntype.name == "mjDYN_DCMOTOR"]
    if not motors:
        raise InvalidValueError("joint", "have a dcmotor, which holds bristles", joint)
    motor, lugre = motors[0], motor_lugre(friction)
    motor.actdim += int(motor.dynprm[5] == 0.0)  # the state of the bristles
    motor.dynprm[5:7], motor.biasprm[3:6] = lugre[:2], lugre[2:]


def set_level(friction: JointFriction, model: Any, data: Any, dof: int, motor: int | None = None) -> None:
    """Set the level of a MuJoCo model to the load of the step before; call it in front of each `mj_step`.

    `dof` is that of the joint, `motor` the number of its dcmotor, of gear 1, if the friction has bristles.
    """
    outside = data.qfrc_applied[dof] - data.qfrc_bias[dof]
    if motor is None:
        model.dof_frictionloss[dof] = friction.mu_c + friction.load(data.qfrc_actuator[dof], outside)
    else:  # the force of a dcmotor is what its friction leaves
        resistance, kt = model.actuator_gainprm[motor, :2]
        load = friction.load(kt * (data.ctrl[motor] - kt * data.qvel[dof]) / resistance, outside)
        model.actuator_biasprm[motor, 3:5] = motor_lugre(friction, load)[2:4]
