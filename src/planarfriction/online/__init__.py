"""Friction while a gripper holds: an observer, a rig with sensors and delays, and published rules to compare with."""

from planarfriction.online.gripper import Gripper, Measurement, Parts, Sensors
from planarfriction.online.observer import Estimate, FrictionObserver

__all__ = ["Estimate", "FrictionObserver", "Gripper", "Measurement", "Parts", "Sensors"]


def __dir__() -> list[str]:
    return sorted(__all__)
