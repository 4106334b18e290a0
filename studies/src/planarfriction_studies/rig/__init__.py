"""Simulated rig on which observers and controllers of a gripper are tried, and published rules beside them."""

from planarfriction_studies.rig.gripper import Gripper, Parts

__all__ = ["Gripper", "Parts"]
