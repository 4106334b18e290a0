"""Friction while a gripper holds: an observer, controllers, a rig to try them on, and published rules beside them."""

from planarfriction.online.controllers import Hinge, Hold, SlideBy, TurnBy
from planarfriction.online.gripper import Gripper, Measurement, Parts, Sensors
from planarfriction.online.observer import Estimate, FrictionObserver

__all__ = [
    "Estimate",
    "FrictionObserver",
    "Gripper",
    "Hinge",
    "Hold",
    "Measurement",
    "Parts",
    "Sensors",
    "SlideBy",
    "TurnBy",
]


def __dir__() -> list[str]:
    return sorted(__all__)
