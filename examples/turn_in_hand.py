"""Turn a plate in the hand by loosening the grip, with a plan for nominal friction and one for uncertain friction.

Two finger pads hold a plate 25 mm from its centre of mass. When they press less than is needed to hold it, the plate
turns under its own weight; when they grip again, it stops. `plan_grip` finds when and how hard to press. Run it:

    python examples/turn_in_hand.py --out out/
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import planarfriction as pf
from planarfriction.planning import GripPlan, holding_load, plan_grip

LAW = pf.LuGre(mu_c=1.0, mu_s=1.2, elasto_plastic=0.9)
PAD = pf.ContactPatch.disc(radius=0.01)
OFFSET = 0.025  # [m]


def plan(degrees: float, aim: str) -> GripPlan:
    """Plan to turn the plate by this many degrees within a second."""
    model = pf.ReducedModel(PAD, LAW)
    scene = pf.scenes.in_hand(
        model, centre_of_mass=(OFFSET, 0.0), normal_force=4.0, t_end=1.0
    )
    return plan_grip(scene, {"angle": math.radians(degrees)}, aim=aim)


def main() -> None:
    parser = argparse.ArgumentParser(description="Turn a plate in the hand.")
    parser.add_argument("--degrees", type=float, default=-30.0)
    parser.add_argument("--out", type=Path, default=Path("out"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for aim in ("nominal", "worst"):
        found = plan(options.degrees, aim)
        if aim == "nominal":
            weight = 9.81 * found.scene.body.mass / 2  # of two fingers
            load = (0.0, -weight, -OFFSET * weight)
            print(
                f"To hold the plate, each finger must press with {holding_load(load, PAD, LAW.mu_s):.2f} N.\n"
            )
        print(f"{found}\n")
        found.plot().savefig(options.out / f"turn-{aim}.png")
        found.scene.to_file(options.out / f"turn-{aim}.toml")


if __name__ == "__main__":
    main()
