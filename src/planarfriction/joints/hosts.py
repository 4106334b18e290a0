"""Friction of a joint in MuJoCo: attributes as text and in a model, and levels that follow the load."""

from __future__ import annotations

from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.joints.friction import JointFriction

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
