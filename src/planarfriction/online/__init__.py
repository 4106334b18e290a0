"""Friction while a gripper holds: a rig with sensors and delays, and published rules to compare with."""

from planarfriction.online.gripper import Gripper, Measurement, Parts, Sensors

__all__ = ["Gripper", "Measurement", "Parts", "Sensors"]


def __dir__() -> list[str]:
    return sorted(__all__)
