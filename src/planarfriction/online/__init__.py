"""Friction while a gripper holds: an observer of its sensors, and controllers of its force."""

from planarfriction.online.controllers import Hinge, Hold, SlideBy, TurnBy
from planarfriction.online.observer import (
    Estimate,
    FrictionObserver,
    Measurement,
    Sensors,
)

__all__ = [
    "Estimate",
    "FrictionObserver",
    "Hinge",
    "Hold",
    "Measurement",
    "Sensors",
    "SlideBy",
    "TurnBy",
]
__dir__ = __all__.copy
