"""Plan a push that moves a square across a table to a given pose.

    python examples/push_to_a_pose.py [push.png]

The pusher sticks to the middle of an edge. The plan has three arcs, each with a constant force in the friction cone.
"""

from __future__ import annotations

import sys

import numpy as np

import planarfriction as pf
from planarfriction.planning import Pusher, PushPlan, Slider, plan_push

GOAL = (0.25, 0.08, 0.6)  # [m, m, rad]
SQUARE = 0.045 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])  # [m]


def plan() -> PushPlan:
    """Plan a push at the left edge."""
    slider = Slider(pf.LimitSurfaceExact(pf.ContactPatch.rectangle(0.09)), SQUARE)
    return plan_push(slider, Pusher(mu=0.4), GOAL, edges=[3])


def main() -> None:
    """Print the plan, and draw it if a file is named."""
    found = plan()
    print(found)
    if len(sys.argv) > 1:
        found.plot().savefig(sys.argv[1])


if __name__ == "__main__":
    main()
