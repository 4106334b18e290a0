"""Planning of grip forces and pushes that bring an object to a goal."""

from planarfriction.planning.grip import GripPlan, GripReport, plan_grip
from planarfriction.planning.holding import dynamic_holding_load, holding_load
from planarfriction.planning.in_motion import HoldPlan, plan_hold
from planarfriction.planning.push_plans import PushPlan, PushReport, plan_push
from planarfriction.planning.pushing import Push, Pusher, Slider, motion_cone, push

__all__ = [
    "GripPlan",
    "GripReport",
    "HoldPlan",
    "Push",
    "PushPlan",
    "PushReport",
    "Pusher",
    "Slider",
    "dynamic_holding_load",
    "holding_load",
    "motion_cone",
    "plan_grip",
    "plan_hold",
    "plan_push",
    "push",
]
__dir__ = __all__.copy
