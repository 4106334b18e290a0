"""Friction of one joint: a law in N m and rad whose level may grow with the torque through the gears; in MuJoCo too."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction._support.equality import Checked, checked
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.identify.logs import increasing
from planarfriction.joints.loops.runs import JointNumbers, run_measured
from planarfriction.laws import LuGre

RIGID = 1e-3
"""Angle [rad] that a rigid joint bends before it slips, where a step needs bristles: the resolution of encoders."""


@dataclass(frozen=True)
class JointFriction(Checked):
    """Friction torque of a joint: `g(v) + |b_m tau_m - b_e tau_e|` in steady sliding, and `sigma_2 v`.

    `g(v) = mu_c + (mu_s - mu_c) exp(-(v/v_s)^2) + asymmetry sign(v)`; bristles of stiffness `sigma_0` bend before it
    slips.

    Raises InvalidValueError for negative numbers, for `mu_s` below `mu_c`, and for an asymmetry that reaches `mu_c`, or
    `sigma_2`.
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
    asymmetry: float = checked(validation.number, default=0.0)
    """Half the excess of the level at positive speeds over that at negative ones [N m]."""
    viscous_asymmetry: float = checked(validation.number, default=0.0)
    """Half the excess of viscous friction at positive speeds [N m s/rad]: it is `sigma_2 v + viscous_asymmetry |v|`."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.mu_s is None:
            self._set(mu_s=self.mu_c)
        if self.mu_s < self.mu_c:
            raise InvalidValueError("mu_s", f"be >= mu_c = {self.mu_c:g}", self.mu_s)
        if abs(self.asymmetry) >= self.mu_c:
            raise InvalidValueError(
                "asymmetry",
                f"be within mu_c = {self.mu_c:g}, or friction drives",
                self.asymmetry,
            )
        if abs(self.viscous_asymmetry) > self.sigma_2:
            raise InvalidValueError(
                "viscous_asymmetry",
                f"be within sigma_2 = {self.sigma_2:g}, or friction drives",
                self.viscous_asymmetry,
            )

    @property
    def law(self) -> LuGre:
        """The law as LuGre under the load 1, in N m and rad; a rigid joint bends by `RIGID`.

        Raises InvalidValueError for a rigid joint above 1e47 N m, whose stiffness no law takes.
        """
        return LuGre(
            self.mu_c,
            self.mu_s,
            self.v_s,
            self.sigma_0 or self.mu_s / RIGID,
            self.sigma_1,
            self.sigma_2,
        )

    def load(self, tau_motor: float, tau_external: float) -> float:
        """Compute the growth of the level [N m] at torques of the motor and of all else [N m].

        Raises InvalidValueError for torques that are not finite.
        """
        motor = validation.number("tau_motor", tau_motor)
        outside = validation.number("tau_external", tau_external)
        return abs(self.load_motor * motor - self.load_external * outside)

    def along(
        self,
        time: ArrayLike,
        speed: ArrayLike,
        tau_motor: ArrayLike = 0.0,
        tau_external: ArrayLike = 0.0,
    ) -> np.ndarray:
        """Compute the torque that friction takes along a motion, positive along the speed, `[T]` [N m].

        Bristles begin straight; between two of the times `[T]` [s] the speed `[T]` [rad/s] is the mean of both.
        `tau_motor` and `tau_external` [N m] are the torques of the motor and of all else, `[T]` or one number.

        Raises InvalidValueError for times that do not increase, wrong shapes, and numbers that are not finite.
        """
        time = increasing(time)
        given = {"speed": speed, "tau_motor": tau_motor, "tau_external": tau_external}
        columns = [
            validation.filled(name, value, (len(time),))
            for name, value in given.items()
        ]
        taken = np.empty(len(time))
        run_measured(self.numbers, time, *columns, taken)
        return taken

    @property
    def numbers(self) -> JointNumbers:
        """Numbers with bristles, as a step reads them."""
        return JointNumbers(
            self.law.numbers,
            self.load_motor,
            self.load_external,
            self.asymmetry,
            self.viscous_asymmetry,
        )

    @property
    def rigid_numbers(self) -> JointNumbers:
        """Numbers as a simulated run reads them: rigid friction without bristles."""
        law = self.law.numbers
        return self.numbers._replace(
            law=LawNumbers(*law)._replace(sigma_0=self.sigma_0 or 0.0)
        )


def _representable(friction: JointFriction) -> JointFriction:
    """Return a friction that MuJoCo's joint or dcmotor can hold, or raise InvalidValueError."""
    friction = validation.instance(
        "friction", friction, JointFriction, "a JointFriction"
    )
    if friction.mu_s > friction.mu_c and not friction.sigma_0:
        rule = "be mu_c for rigid friction, as frictionloss has one level: set mu_s=None, or give sigma_0 for a dcmotor"
        raise InvalidValueError("mu_s", rule, friction.mu_s)
    if friction.asymmetry or friction.viscous_asymmetry:
        found = friction.asymmetry or friction.viscous_asymmetry
        raise InvalidValueError(
            "asymmetry",
            "be 0: friction in MuJoCo is the same in both directions; apply the difference as a torque of your own",
            found,
        )
    return friction


WEAK = 1e-6
"""Resistance [Ohm] of a dcmotor whose back-EMF is to be nothing."""


def motor_lugre(friction: JointFriction, load: float = 0.0) -> list[float]:
    """Return the numbers `lugre` of MuJoCo's dcmotor: sigma_0, sigma_1, and mu_c, mu_s, v_s at a load [N m]."""
    law = friction.law
    return [
        law.sigma_0,
        law.sigma_1,
        friction.mu_c + load,
        friction.mu_s + load,
        friction.v_s,
    ]


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

    Raises InvalidValueError for a name that is no text, numbers below zero, and friction that MuJoCo cannot hold: rigid
    friction with `mu_s` above `mu_c`, and an asymmetry.
    """
    friction = _representable(friction)
    joint = escape(validation.text("joint", joint), {'"': "&quot;"})
    armature = validation.non_negative("armature", armature)
    back_emf = validation.non_negative("back_emf", back_emf)
    torque_gain = (
        None if torque_gain is None else validation.positive("torque_gain", torque_gain)
    )
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


def apply_to_spec(
    friction: JointFriction, spec: Any, joint: str, *, armature: float | None = None
) -> None:
    """Set the friction of a joint of a `mujoco.MjSpec`: damping and frictionloss, or the `lugre` of its dcmotor.

    Raises InvalidValueError for a joint that is not there, for bristles without a dcmotor on the joint, and for
    friction that MuJoCo cannot hold, as `to_mjcf`.
    """
    friction = _representable(friction)
    found = spec.joint(validation.text("joint", joint))
    if found is None:
        raise InvalidValueError("joint", "be the name of a joint of the model", joint)
    found.damping = (
        np.array([friction.sigma_2, 0.0, 0.0])
        if np.ndim(found.damping)
        else friction.sigma_2
    )
    found.frictionloss = 0.0 if friction.sigma_0 else friction.mu_c
    if armature is not None:
        found.armature = armature
    if not friction.sigma_0:
        return
    motors = [
        each
        for each in spec.actuators
        if each.target == joint and each.dyntype.name == "mjDYN_DCMOTOR"
    ]
    if not motors:
        raise InvalidValueError("joint", "have a dcmotor, which holds bristles", joint)
    motor = motors[0]
    lugre = motor_lugre(friction)
    motor.actdim += int(motor.dynprm[5] == 0.0)  # the state of the bristles
    motor.dynprm[5:7] = lugre[:2]
    motor.biasprm[3:6] = lugre[2:]


def set_level(
    friction: JointFriction, model: Any, data: Any, dof: int, motor: int | None = None
) -> None:
    """Set the level of a MuJoCo model to the load of the step before; call it in front of each `mj_step`.

    `dof` is that of the joint, `motor` the number of its dcmotor, of gear 1, if the friction has bristles. Bristles
    that a falling level has left beyond their limit, `mu_s/sigma_0`, come back onto it.
    """
    outside = data.qfrc_applied[dof] - data.qfrc_bias[dof]
    if motor is None:
        model.dof_frictionloss[dof] = friction.mu_c + friction.load(
            data.qfrc_actuator[dof], outside
        )
    else:  # the force of a dcmotor is what its friction leaves
        resistance, kt = model.actuator_gainprm[motor, :2]
        load = friction.load(
            kt * (data.ctrl[motor] - kt * data.qvel[dof]) / resistance, outside
        )
        level = motor_lugre(friction, load)[2:4]
        model.actuator_biasprm[motor, 3:5] = level
        bristles = model.actuator_actadr[motor] + model.actuator_actnum[motor] - 1
        limit = level[1] / friction.law.sigma_0
        data.act[bristles] = np.clip(data.act[bristles], -limit, limit)
