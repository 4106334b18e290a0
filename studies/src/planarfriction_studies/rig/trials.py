"""Trials of estimators and controllers on random parts, beside the published rules."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction.laws import LuGre
from planarfriction.models import ReducedModel
from planarfriction.online.controllers import Hinge, Hold, SlideBy, TurnBy
from planarfriction.online.loops import grips
from planarfriction.online.observer import GRAVITY, FrictionObserver, Measurement
from planarfriction.patch import ContactPatch, SoftFinger
from planarfriction_studies.rig.baselines import (
    LINEAR_RULE,
    ROTATION_RULE,
    ellipsoid_load,
    hinge_rule,
    hold_rule,
)
from planarfriction_studies.rig.gripper import DT, UNIT, Gripper, Parts

NOMINAL_MU, FACTOR = 0.52, 3.0
"""Middle of the friction coefficients of the trials, and largest over least [-]."""

RADIUS, GROWTH, EXPONENT = 6e-3, 0.25, 4.0
"""Radius of the fingertips at 1 N [m], its growth with the load, and the exponent of the pressure [-], as known."""

KINDS = ((2.5, 1.0), (4.0, 1.1), (8.0, 1.05), (4.0, 1.15))
"""Exponents of the pressure and `mu_s/mu_c` of the groups into which the parts are divided [-]."""


HOLD_STEPS, EXPLORED_STEPS, AFTER_STEPS = 4500, 2500, 3000
"""Steps of a hold, those after which its grip is compared, and steps after the duration of another task."""

MOST_GRIP = 60.0
"""Largest grip force [N]."""


def random_parts(count: int, seed: int, kind: int = 0) -> Parts:
    """Return parts of random mass, friction (within a factor of 3), radius, delay, bias, tap and tilt.

    The pressure and `mu_s/mu_c` are those of a group `kind` of `KINDS`.
    """
    random = np.random.default_rng([seed, kind])
    mass = random.uniform(0.1, 0.4, count)
    mu = NOMINAL_MU * FACTOR ** random.uniform(-0.5, 0.5, count)
    tap = (
        mass[:, None]
        * GRAVITY
        * random.uniform(-0.5, 0.5, (count, 3))
        * (1.0, 1.0, 0.01)
    )
    return Parts(
        mass,
        mass * random.uniform(0.025, 0.05, count) ** 2,
        random.uniform((0.0, -0.01), (0.03, 0.01), (count, 2)),
        mu,
        mu_ratio=KINDS[kind][1],
        exponent=KINDS[kind][0],
        radius=RADIUS * np.exp(0.1 * random.normal(size=count)),
        growth=GROWTH,
        delay=random.uniform(0.005, 0.04, count),
        bias=random.normal(size=(count, 3)) * (0.03, 0.03, 3e-4),
        tap=tap,
        tap_time=3.0,
        tilt=np.radians(random.uniform(-30.0, 30.0, count)),
        tilt_time=3.5,
    )


def known_model() -> ReducedModel:
    """Return the model that the observer is given: fingertips as known, friction in the middle of what it may be."""
    finger = SoftFinger(c=RADIUS, n=GROWTH, k=EXPONENT)
    law = LuGre(mu_c=NOMINAL_MU, mu_s=1.07 * NOMINAL_MU, v_s=2e-3, sigma_2=0.1)
    return ReducedModel(ContactPatch.disc(0.02, pressure=finger), law)


class Rule:
    """Published rule for a task, which is given the true friction and radius: `hold`, `slide`, `turn` or `hinge`."""

    def __init__(
        self,
        task: str,
        parts: Parts,
        unit: float,
        goal: Any,
        duration: float,
        bias: np.ndarray,
    ) -> None:
        self.task = task
        self.parts = parts
        self.goal = np.abs(goal)
        self.duration = duration
        self._unit = unit
        self._bias = bias
        count = len(parts)
        self._velocity, self._slid = np.zeros((2, count, 3))
        self._before, self._holding, self._total = np.zeros((3, count))
        self._ticked = 0.0
        self._there = np.zeros(count, bool)

    def update(self, sample: Measurement) -> np.ndarray:
        """Return the grip force `[P]` [N] of a sample."""
        parts = self.parts
        load = np.maximum(sample.normal_force, 0.1)
        wrench = sample.wrench - self._bias
        came = np.isfinite(sample.slip_velocity)
        self._velocity = np.where(came, sample.slip_velocity, self._velocity)
        # As the sample is held between two of them.
        self._slid = self._slid + DT * self._velocity
        radius = self._unit * parts.radius * load**parts.growth
        speed = np.hypot(*self._velocity[:, :2].T)
        force = np.hypot(*wrench[:, :2].T)
        self._before = hold_rule(wrench, speed, radius, parts.mu_c, self._before)
        if self.task == "hold":
            return self._before
        if self.task == "hinge":
            return hinge_rule(force, speed, parts.mu_c)
        turns = self.task == "turn"
        rule, axis = (ROTATION_RULE, 2) if turns else (LINEAR_RULE, 1)
        holds = (
            ellipsoid_load(wrench, radius, parts.mu_c) if turns else force / parts.mu_c
        )
        self._holding = self._holding + (holds - self._holding) * DT / 0.05
        place = np.abs(self._slid[:, axis])
        v = np.abs(self._velocity[:, axis])
        wanted, wanted_speed, push = grips.trapezoid.py_func(
            np, sample.time - 0.2, self.goal, self.duration
        )
        commanded = rule.commanded(place, wanted, wanted_speed)
        self._total = np.where(
            sample.time > 0.2, self._total + DT * (commanded - v), 0.0
        )
        self._there = self._there | (place >= self.goal)
        return np.where(
            self._there,
            self._before,
            rule.grip(self._holding, v, commanded, push, self._total),
        )


def trial(
    task: str, parts: Parts, goal: Any, duration: float, *, ours: bool, seed: int
) -> dict[str, np.ndarray]:
    """Run a task on all parts with the library's controller or the published rule; return what happened, by part.

    `slip` is that of the whole run `[P, 3]` and `later` that after the exploration, `grip` the mean grip force then
    [N]; of a hold by this library also the estimate at the end of the first slip (see `_first_slip`).
    """
    gripper = Gripper(parts, 30.0, seed=seed)
    count = len(parts)
    steps = round(duration / DT)
    observer = FrictionObserver(known_model(), batch=count)
    unit = gripper.model.patch.contact_radius() / UNIT
    makes = {
        "hold": lambda: Hold(observer),
        "hinge": lambda: Hinge(observer),
        "slide": lambda: SlideBy(observer, goal, duration=duration),
        "turn": lambda: TurnBy(observer, goal, duration=duration),
    }
    empty = list(gripper.empty_hand())
    for sample in empty:
        observer.update(sample)
    bias = np.mean([sample.wrench for sample in empty], axis=0)
    controller: Any = (
        makes[task]() if ours else Rule(task, parts, unit, goal, duration, bias)
    )
    steps = HOLD_STEPS if task == "hold" else steps + AFTER_STEPS
    first = _FirstSlip(parts, unit) if ours and task == "hold" else None
    sample = gripper.measurement
    grip = np.zeros(count)
    start = np.zeros((count, 3))
    for k in range(steps):
        sample = gripper.step(np.minimum(controller.update(sample), MOST_GRIP))
        if first is not None:
            first.look(gripper, sample.time, controller.estimate)
        if k == EXPLORED_STEPS:
            start = gripper.slip.copy()
        grip += (
            gripper.normal_force
            * (k > EXPLORED_STEPS)
            / max(steps - EXPLORED_STEPS - 1, 1)
        )
    found = {
        "slip": gripper.slip.copy(),
        "later": gripper.slip - start,
        "grip": grip,
        "spin": gripper.twist[:, 2],
    }
    return found if first is None else found | first.found()


class _FirstSlip:
    """Notes of the first slip of each part: the estimate after 2 mm or 2 degrees, or at its end, and the delays."""

    def __init__(self, parts: Parts, unit: float) -> None:
        count = len(parts)
        self.parts = parts
        self.unit = unit
        self.numbers = np.full((count, 3, 3), np.nan)
        self.done = np.zeros(count, bool)
        self.crossed, self.began, self.seen = np.full((3, count), np.nan)
        self.alarms = np.zeros(count)
        self._slips = np.zeros(count, bool)
        self._path = np.zeros(count)
        self.rest = 0.0

    def look(self, gripper: Gripper, arrived: np.ndarray, e: Any) -> None:
        """Note what happens in a step."""
        far = np.hypot(*gripper.slip[:, :2].T)
        turn = np.abs(gripper.slip[:, 2])
        path = far + self.unit * gripper.radius * turn
        slips = e.slip > 0.5
        self.crossed = _first(
            self.crossed, (far > 2e-3) | (turn > np.radians(2.0)), gripper.time
        )
        self.began = _first(self.began, path > 1e-4, gripper.time)
        self.seen = _first(self.seen, slips, gripper.time)
        over = (arrived >= self.crossed) | (~np.isnan(self.seen) & ~slips)
        now = over & ~self.done
        radius = self.unit * self.parts.radius * 5.0**self.parts.growth
        mu_c = self.parts.mu_c
        error = np.log(
            [e.mu_c / mu_c, e.mu_s / (mu_c * self.parts.mu_ratio), e.radius / radius]
        ).T
        sd = np.sqrt(np.diagonal(e.covariance, axis1=-2, axis2=-1))
        self.numbers[now] = np.stack([error, sd, e.determined], axis=-1)[now]
        self.done |= over
        # an alarm is false if the part has moved by less than 20 um since it was last seen to stick
        self.alarms += slips & ~self._slips & (np.abs(path - self._path) < 2e-5)
        self._path = np.where(slips, self._path, 0.999 * self._path + 0.001 * path)
        self._slips = slips

    def found(self) -> dict[str, np.ndarray]:
        """Return errors of the logs of mu_c, mu_s, radius, deviations, determined ones `[P, 3, 3]`; delays, alarms."""
        late = self.seen - self.began - self.parts.delay
        return {"first": self.numbers, "late": late, "alarms": self.alarms}


def _first(times: np.ndarray, happens: np.ndarray, now: float) -> np.ndarray:
    return np.where(np.isnan(times) & happens, now, times)


def run_trials(
    count: int = 1000, seed: int = 0, *, progress: Callable[[str], None] | None = None
) -> dict[str, Any]:
    """Run all tasks on `count` random parts, by this library and by the published rules; return the shares by name.

    Slides of 20 or 40 mm and turns of 45 or 60 degrees take 2 or 5 s; the hand tilts by 60 to 120 degrees in 2 s round
    a hinge. The rules know the true friction and radius; the library's controllers do not.

    Raises InvalidValueError unless `count` is an integer >= 4 and `seed` one >= 0.
    """
    count = validation.count("count", count, len(KINDS))
    seed = validation.count("seed", seed, 0)
    runs: dict[tuple[str, bool], list[dict[str, np.ndarray]]] = {}
    for kind in range(len(KINDS)):
        base = random_parts(len(range(kind, count, len(KINDS))), seed, kind)
        for task in ("hold", "slide", "turn", "hinge"):
            parts, goal, duration = _task(task, base, seed, kind)
            for ours in (True, False):
                if progress is not None:
                    progress(
                        f"{task}, {'observer' if ours else 'rule'}, group {kind + 1} of {len(KINDS)}"
                    )
                found = trial(task, parts, goal, duration, ours=ours, seed=seed + kind)
                runs.setdefault((task, ours), []).append(
                    found | {"goal": np.broadcast_to(goal, len(parts))}
                )
    joined = {
        key: {name: np.concatenate([r[name] for r in each]) for name in each[0]}
        for key, each in runs.items()
    }
    return {"parts": count, "seed": seed} | _shares(joined)


def _task(task: str, base: Parts, seed: int, kind: int) -> tuple[Parts, Any, float]:
    """Return the parts of a task, with its goal and duration."""
    random = np.random.default_rng([seed, kind, 1])
    count = len(base)
    duration = (2.0, 5.0)[kind % 2]
    still = dataclasses.replace(base, tap=(0.0, 0.0, 0.0), tilt=0.0)
    if task == "hold":
        return base, 0.0, duration
    if task == "slide":
        centre = random.uniform((-1e-3, -0.02), (1e-3, 0.0), (count, 2))
        return (
            dataclasses.replace(still, centre=centre),
            -random.choice([0.02, 0.04], count),
            duration,
        )
    if task == "turn":
        centre = random.uniform((0.02, -3e-3), (0.03, 3e-3), (count, 2))
        return (
            dataclasses.replace(still, centre=centre),
            -np.radians(random.choice([45.0, 60.0], count)),
            duration,
        )
    angle = np.radians(random.uniform(60.0, 120.0, count))
    centre = random.uniform((0.0, -0.06), (0.0, -0.03), (count, 2))
    return (
        dataclasses.replace(
            still, centre=centre, tilt=angle, tilt_time=0.5, tilt_duration=2.0
        ),
        -angle,
        2.5,
    )


def _shares(runs: dict[tuple[str, bool], dict[str, np.ndarray]]) -> dict[str, Any]:
    """Return the numbers of the table."""
    hold = runs["hold", True]
    rule = runs["hold", False]
    seen = np.isfinite(hold["first"][:, 0, 0])
    table: dict[str, Any] = {"slipped": seen.mean()}
    for name, (error, sd, sure) in zip(
        ("mu_c", "mu_s", "radius"), hold["first"][seen].transpose(1, 2, 0), strict=True
    ):
        prefix = "" if name == "mu_c" else f"{name}_"
        right = np.abs(error) <= np.log(1.05)
        table |= {
            f"{prefix}coverage_95": _share(np.abs(error) <= 1.96 * sd),
            f"{name}_within_5_percent": _share(right | (sure == 0.0)),
            f"{name}_determined": _share(sure),
            f"{name}_median_error": np.median(np.abs(error)) if len(error) else 0.0,
        }
    table |= {
        "detected_within_20_ms": _share(hold["late"][seen] <= 0.02),
        "false_alarms_per_minute": hold["alarms"].sum()
        / (len(seen) * HOLD_STEPS * DT / 60.0),
        "drops": int(_dropped(hold).sum()),
        "rule_drops": int(_dropped(rule).sum()),
        "grip_saved": 1.0 - hold["grip"].sum() / rule["grip"].sum(),
        "slips_over_1_mm": int((np.hypot(*hold["later"][:, :2].T) > 1e-3).sum()),
        "rule_slips_over_1_mm": int((np.hypot(*rule["later"][:, :2].T) > 1e-3).sum()),
    }
    for task in ("slide", "turn", "hinge"):
        for ours, name in ((True, ""), (False, "rule_")):
            table[f"{name}{task}_within"] = _within(task, runs[task, ours]).mean()
    for ours, name in ((True, ""), (False, "rule_")):
        table[f"{name}hinge_slide_mm"] = 1e3 * np.median(
            np.hypot(*runs["hinge", ours]["slip"][:, :2].T)
        )
    return {
        name: value if isinstance(value, int) else round(float(value), 4)
        for name, value in table.items()
    }


def _share(true: np.ndarray) -> float:
    """Return the share of an array that is true; 0 of none."""
    return float(true.mean()) if len(true) else 0.0


def _dropped(run: dict[str, np.ndarray]) -> np.ndarray:
    return (np.hypot(*run["slip"][:, :2].T) > 0.02) | (
        np.abs(run["slip"][:, 2]) > np.radians(45.0)
    )


def _within(task: str, run: dict[str, np.ndarray]) -> np.ndarray:
    """Return which parts ended within 1 mm (a slide) or 2 degrees (a turn, a hinge) of the goal."""
    slip = run["slip"]
    goal = run["goal"]
    angle = np.radians(2.0)
    if task == "slide":
        return np.abs(slip[:, 1] - goal) <= 1e-3
    return np.abs(slip[:, 2] - goal) <= angle
