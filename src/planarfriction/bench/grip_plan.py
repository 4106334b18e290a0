"""A grip plan beside one simulation of its scene: what planning costs."""

from __future__ import annotations

import math

from planarfriction.bench.measurement import Measurement, line, median
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.models import ReducedModel
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.planning import plan_grip
from planarfriction.scenes import in_hand, simulate


def measure(name: str, full: bool) -> Measurement:
    """The benchmark `planning.grip`: thirty degrees with 20 knots, and the run of the plan."""
    model = ReducedModel(PUBLISHED_PATCHES["Circle"](cells=21), LuGre(mu_s=1.2, elasto_plastic=ElastoPlastic(0.9)))
    scene = in_hand(model, centre_of_mass=(0.025, 0.0), normal_force=4.0, t_end=1.0)
    goal = {"angle": math.radians(-30.0)}
    plan = plan_grip(scene, goal)
    value = median(lambda: plan_grip(scene, goal), 3)
    alone = median(lambda: simulate(plan.scene), 9)
    report = plan.report
    miss = abs(math.degrees(report.angle - goal["angle"]))
    words = (
        f"one simulation of the plan (misses {miss:.2g} degrees, {report.simulations} simulations, "
        f"{report.jacobians} Jacobians)"
    )
    return line(name, value, "s", words, alone)
