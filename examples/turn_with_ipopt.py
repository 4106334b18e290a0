"""Plan the turn of a held plate in CasADi: the step of the contact in C, the optimisation by IPOPT.

    python examples/turn_with_ipopt.py

The problem is that of `plan_grip`: the grip at ten knots lets the plate turn by -30 degrees, then holds it. Needs gcc
and the extra `casadi`.
"""

from __future__ import annotations

import dataclasses
import math
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import casadi
import numpy as np

import planarfriction as pf
from planarfriction.planning import GripPlan, holding_load, plan_grip
from planarfriction.planning.grip import ROUGH, Aim

LAW = pf.LuGre(mu_c=0.6, mu_s=0.7, sigma_0=1e5, sigma_1=100.0, elasto_plastic=0.9)
PARAMS = [1e5, 100.0, 0.2, 0.6, 0.7, 1e-3, 0.9]  # in the order of friction_params
PATCH = pf.ContactPatch.disc(radius=0.01)
KNOTS = np.linspace(0.0, 0.225, 10)  # [s]
GOAL, DT, STEPS = math.radians(-30.0), 1e-3, 300


def scene() -> pf.Scene:
    """Return a plate that hangs 25 mm beside its grip."""
    surface = pf.LimitSurfaceEllipsoid(PATCH)
    model = pf.ReducedModelPublished(PATCH, LAW, surface=surface)  # three states
    return pf.scenes.in_hand(
        model, centre_of_mass=(0.025, 0.0), normal_force=8.0, t_end=DT * STEPS
    )


def compiled(model: pf.ReducedModelPublished, folder: Path) -> Any:
    """Write the model's step in C, compile it, and load it as a CasADi function."""
    pf.export_c(model, folder, casadi=True)
    command = [
        "gcc",
        "-O2",
        "-shared",
        "-fPIC",
        "friction.c",
        "friction_casadi.c",
        "-o",
        "friction.so",
        "-lm",
    ]
    subprocess.run(command, cwd=folder, check=True)
    return casadi.external("friction_casadi", str(folder / "friction.so"))


def advance(step: Any, plate: pf.Scene) -> Any:
    """Return a step of plate and bristles by the trapezoidal rule: friction at both ends, each with its velocity.

    The velocity at the end is the root of an equation that contains friction; CasADi differentiates such roots.
    """
    body, h = plate.body, DT
    grip = plate.contacts[0].position - np.array(body.position)
    z, v, q, a, f, after = (casadi.MX.sym("x", n) for n in (3, 3, 3, 3, 1, 3))

    def half_step(z: Any, v: Any, q: Any) -> tuple[Any, Any]:
        """Return bristles and acceleration after half a step at a velocity v and a displacement q."""
        x, y = grip[0] - q[0], grip[1] - q[1]
        z, wrench = step(
            z, casadi.vertcat(v[0] - v[2] * y, v[1] + v[2] * x, v[2]), f, h / 2, PARAMS
        )
        fx, fy, tau = casadi.vertsplit(2 * wrench)  # of two fingers
        return z, casadi.vertcat(
            fx / body.mass,
            fy / body.mass - 9.81,
            (tau + x * fy - y * fx) / body.inertia,
        )

    half, _ = half_step(z, v, q)
    held, known = casadi.MX.sym("z", 3), casadi.vertcat(v, q, a, f)
    miss = after - v - h / 2 * (a + half_step(held, after, q + h / 2 * (v + after))[1])
    root = casadi.rootfinder(
        "root", "newton", {"x": after, "p": casadi.vertcat(held, known), "g": miss}
    )
    new = root(v, casadi.vertcat(half, known))
    moved = q + h / 2 * (v + new)
    end = half_step(half, new, moved)
    return casadi.Function(
        "advance",
        [casadi.vertcat(z, v, q, a), f],
        [casadi.vertcat(end[0], new, moved, end[1])],
    )


def optimised(step: Any, plate: pf.Scene, holding: float) -> pf.Signal:
    """Return the grip that IPOPT finds, at the cost of `plan_grip`: misses of the goal and bends of the profile.

    The angle is a constraint with a slack: its weight in the cost would hide everything else.
    """
    grip = plate.contacts[0].position - np.array(plate.body.position)
    least = holding_load([0.0, -0.981, -0.981 * 0.025], PATCH, LAW.mu_c)
    aim = Aim(GOAL, np.zeros(2), PATCH.contact_radius())
    values, slack = casadi.MX.sym("values", 10), casadi.MX.sym("slack")
    times = np.linspace(DT, DT * STEPS, STEPS)
    profile = np.array([np.interp(times, KNOTS, unit) for unit in np.eye(10)]) * least
    first = [*np.zeros(9), 0.0, -9.81, 0.0]
    last = advance(step, plate).mapaccum(STEPS)(first, values.T @ casadi.DM(profile))[
        :, -1
    ]
    c, s = casadi.cos(last[8]), casadi.sin(last[8])
    slide = (
        last[6:8]
        + casadi.vertcat(c * grip[0] - s * grip[1], s * grip[0] + c * grip[1])
        - grip
    )
    misses = (casadi.vertcat(last[3:6], slide, last[8]) - aim.end) / aim.scales()
    bends = ROUGH * np.diff(np.eye(10), 2, axis=0) @ values
    cost = casadi.sumsqr(misses[:5]) + slack**2 + casadi.sumsqr(bends)

    problem = {
        "x": casadi.vertcat(values, slack),
        "f": cost / 2,
        "g": misses[5] - slack,
    }
    quiet = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False}
    options = {
        "ipopt.hessian_approximation": "limited-memory",
        "ipopt.mu_strategy": "adaptive",
        "ipopt.tol": 1e-3,
    }
    solver = casadi.nlpsol("solver", "ipopt", problem, options | quiet)
    start = np.where(KNOTS < 0.1, 0.7, 2.0)
    low = np.where(KNOTS < 0.225, 0.1, 1.5 * holding) / least
    most = 30.0 / least * np.ones(10)
    found = solver(
        x0=[*start, 0.0], lbx=[*low, -1e6], ubx=[*most, 1e6], lbg=0.0, ubg=0.0
    )
    return pf.Signal.sampled(KNOTS, found["x"].full()[:10, 0] * least, "linear")


def main() -> tuple[GripPlan, pf.Scene]:
    """Plan with `plan_grip` and with IPOPT, and print where both plates end."""
    plate = scene()
    plan = plan_grip(plate, goal={"angle": GOAL}, knots=KNOTS, bounds=(0.1, 30.0))
    with tempfile.TemporaryDirectory() as folder:
        step = compiled(plate.contacts[0].model, Path(folder))
        signal = optimised(step, plate, plan.report.holding)
    turned = dataclasses.replace(
        plate, contacts=[dataclasses.replace(plate.contacts[0], normal_force=signal)]
    )
    for name, each in (("plan_grip", plan.scene), ("IPOPT", turned)):
        end = pf.simulate(each).data.isel(time=-1)
        print(
            f"{name}: {math.degrees(float(end.theta)):.1f} degrees, at {1e3 * end.x:.1f}, {1e3 * end.y:.1f} mm"
        )
    return plan, turned


if __name__ == "__main__":
    main()
