"""Joints: friction of one degree of freedom from logs of its torque, its voltage, or the goal of its servo.

`identify_joint` fits `JointLog`s of a `Plant` and says what they tell of the friction and what they leave open. All
numbers are in rad, N m, V and s.
"""

from planarfriction.joints.fit import identify_joint
from planarfriction.joints.friction import (
    JointFriction,
    apply_to_spec,
    set_level,
    to_mjcf,
)
from planarfriction.joints.log import Drive, JointLog, Plant
from planarfriction.joints.problem import JointFit

__all__ = [
    "Drive",
    "JointFit",
    "JointFriction",
    "JointLog",
    "Plant",
    "apply_to_spec",
    "identify_joint",
    "set_level",
    "to_mjcf",
]
__dir__ = __all__.copy
