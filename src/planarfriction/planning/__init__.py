"""Plans: what to do with a grip so that a part ends where it should."""

from planarfriction.planning.grip import GripPlan, plan_grip
from planarfriction.planning.holding import holding_load
from planarfriction.planning.report import GripReport

__all__ = ["GripPlan", "GripReport", "holding_load", "plan_grip"]
