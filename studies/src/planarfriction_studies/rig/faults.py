"""Faults of a gripper's sensors, how each must end, and trials of all on random parts.

A fault begins at one of three moments of a task and stays. `EXPECTED` is what is asked of the controllers; `run_faults`
tells what they do.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from planarfriction.online.controllers import Hinge, Hold, SlideBy, TurnBy
from planarfriction.online.observer import FrictionObserver, Measurement
from planarfriction_studies.rig.gripper import DT, Gripper
from planarfriction_studies.rig.trials import KINDS, known_model, random_parts

EXPECTED = """
channel       0     nan   frozen  sign  1e-3   1e3   late   jitter  dropped
force         kept  kept  kept    kept  kept   kept  -      -       -
torque        kept  kept  kept    kept  kept   kept  -      -       -
wrench        kept  kept  kept    kept  kept   kept  kept   kept    S
load          kept  kept  kept    kept  kept   kept  kept   kept    kept
slip_x        kept  kept  kept    kept  kept   kept  -      -       -
slip_y        S     kept  S       S     S      kept  -      -       -
spin          TR    kept  TR      TR    TR     kept  -      -       -
slip          STR   kept  STR     STR   STR    kept  T      R       STR
time          kept  kept  kept    kept  kept   kept  kept   kept    kept
"""
"""End of each fault of a channel, at any moment.

Kept: no part slips more than 5 mm (or turns 5 degrees, where that is the task) further than it shall, and none falls.
Letters are tasks (S slide, T turn, R hinge) which cannot be kept, as the way on which they shall stop, or the speed by
which they brake, is that of the sensor that is wrong: the part may go further, but it stops, and a flag says so.
Slip velocities that are late, shift by chance or are lost are among them: a part that breaks loose jumps before a
sample shows it, in one run of a hundred by more than 5 mm or 5 degrees (late: turns alone; jitter: swings alone).
Where half of the wrenches are lost, the grip that balances a slide is found late: one slide of a hundred went 8 mm far.
Samples of a sensor are late, early or lost together: so are force and torque, or the three slip velocities, and the
clock is that of all samples."""

CHANNELS = {
    "force": (1, 2),
    "torque": (3,),
    "wrench": (1, 2, 3),
    "load": (4,),
    "slip_x": (5,),
    "slip_y": (6,),
    "spin": (7,),
    "slip": (5, 6, 7),
    "time": (0,),
}
"""Columns of a sample: time, wrench, load, slip velocity."""

FACTORS = {"0": 0.0, "nan": np.nan, "sign": -1.0, "1e-3": 1e-3, "1e3": 1e3}
"""Factors of what sensors with a wrong value say."""

LATE = 20
"""Steps by which samples come late."""

JITTER = 8
"""Largest number of steps by which samples come late by chance."""

STAMP = 1.5e-3
"""Largest error of a time that jitters [s]."""

WINDOW = 16
"""Steps of a span whose samples are lost, by chance every other one."""

MOMENTS = ("search", "slip", "end")
"""Moments at which faults begin: while the grip falls, while the part slips, and once it is held or nearly there."""

TASKS = {"hold": "H", "slide": "S", "turn": "T", "hinge": "R"}
"""Tasks, and their letters in the table."""

PAST = 5e-3
"""Slip beyond the goal that is still kept [m]."""

TURNED = np.radians(5.0)
"""Turn beyond the goal that is still kept [rad]."""

RIM = 8e-3
"""Radius at which a turn of a held part is a slip [m]."""

FALLEN = {"turn": 0.01, "hinge": 0.03}
"""Slide of a part that is to turn or to hang, which is not kept [m]: with healthy sensors 5 mm, and 20 mm at most."""

ENDS = {"hold": 3.3, "slide": 4.0, "turn": 4.0, "hinge": 4.0}
"""Durations of the tasks [s]."""

REST = 300
"""Steps after which a part that did not move, and whose grip did not fall, is at its end."""


class Fault(NamedTuple):
    """A fault and its end."""

    channel: str
    """Channel, of `CHANNELS`."""
    kind: str
    """Kind: a heading of `EXPECTED`."""
    end: str
    """`kept`, or the letters of tasks that stop with a flag."""


def expected() -> list[Fault]:
    """Return the faults of the table."""
    head, *rows = (line.split() for line in EXPECTED.strip().splitlines())
    return [
        Fault(row[0], kind, end)
        for row in rows
        for kind, end in zip(head[1:], row[1:], strict=True)
        if end != "-"
    ]


class Batch:
    """A task of parts with faults, whose rows are copied and left out as faults begin and end."""

    def __init__(self, task: str, count: int, seed: int, kind: int) -> None:
        parts, goal = task_of(task, count, seed, kind)
        self.task = task
        self.goal = np.asarray(goal)
        self.random = np.random.default_rng([seed, kind, 7])
        self.gripper = Gripper(parts, 30.0, seed=seed + kind, cells=5)
        observer = FrictionObserver(known_model(), batch=count)
        makes: dict[str, Any] = {
            "hold": lambda: Hold(observer),
            "hinge": lambda: Hinge(observer),
            "slide": lambda: SlideBy(observer, goal, duration=1.0),
            "turn": lambda: TurnBy(observer, goal, duration=1.0),
        }
        self.controller = makes[task]()
        for sample in self.gripper.empty_hand():
            self.controller.update(sample)
        past = np.full((LATE + 1, count, 8), np.nan)
        self.rows = {
            "part": np.arange(count),
            "fault": np.full(count, -1),
            "moment": np.full(count, -1),
            "since": np.zeros(count, int),
            "flags": np.zeros(count, int),
            "frozen": np.zeros((count, 8)),
            "factor": np.ones((count, 8)),
            "past": np.moveaxis(past, 0, 1).copy(),
            "seen": np.zeros((count, 4)),
            "quiet": np.zeros(count, int),
        }

    def take(self, index: np.ndarray) -> None:
        """Let rows be those of an index: copies where it names one twice, none of those it leaves out."""
        gripper = self.gripper
        controller = self.controller
        for name in (
            "_bristles",
            "_lag",
            "_rate",
            "_velocity",
            "_scaled_wrench",
            "_counted",
            "_late",
        ):
            setattr(gripper, name, getattr(gripper, name)[index])
        for name in ("normal_force", "centre", "angle", "slip"):
            setattr(gripper, name, getattr(gripper, name)[index])
        gripper._past = gripper._past[:, index]
        arrays = ["mass", "inertia", "centre", "mu_c", "radius", "delay", "bias"]
        arrays += ["tap", "tap_time", "tilt", "tilt_time"]
        gripper.parts = dataclasses.replace(
            gripper.parts, **{n: getattr(gripper.parts, n)[index] for n in arrays}
        )
        controller.state = controller.state[index]
        controller.observer.state = controller.observer.state[index]
        self.rows = {name: each[index] for name, each in self.rows.items()}
        self.goal = self.goal[index]

    def sense(self, sample: Measurement, faults: list[Fault]) -> Measurement:
        """Return what is left of a sample of the rows whose fault began."""
        rows = self.rows
        step = self.gripper.steps
        right = np.column_stack(
            [sample.time, sample.wrench, sample.normal_force, sample.slip_velocity]
        )
        past = rows["past"]
        past[:, step % (LATE + 1)] = right
        healthy = (rows["fault"] < 0)[:, None] & np.isfinite(right)
        rows["frozen"] = np.where(healthy, right, rows["frozen"])
        wrong = right * rows["factor"]
        for number, fault in enumerate(faults):
            own = (
                np.flatnonzero(rows["fault"] == number)
                if fault.kind not in FACTORS
                else ()
            )
            if len(own) == 0:
                continue
            at = np.ix_(own, CHANNELS[fault.channel])
            wrong[at] = self._wrong(fault, own, at, right[at])
        return Measurement(
            wrong[:, 0].copy(),
            wrong[:, 1:4].copy(),
            wrong[:, 4].copy(),
            wrong[:, 5:].copy(),
        )

    def _wrong(
        self, fault: Fault, own: np.ndarray, at: Any, right: np.ndarray
    ) -> np.ndarray:
        """Return wrong values of a fault's columns."""
        step = self.gripper.steps
        columns = CHANNELS[fault.channel]
        if fault.kind in ("late", "jitter"):
            if fault.channel == "time" and fault.kind == "jitter":
                return right + self.random.uniform(-STAMP, STAMP, right.shape)
            back = (
                LATE
                if fault.kind == "late"
                else self.random.integers(0, JITTER, len(own))
            )
            return self.rows["past"][own, (step - back) % (LATE + 1)][:, columns]
        if fault.kind == "dropped":
            lost = (step // WINDOW * 7919 + own * 104729) % 97 % 2 == 0
            return np.where(lost[:, None], np.nan, right)
        # As long as samples come.
        return np.where(np.isnan(right), np.nan, self.rows["frozen"][at])

    def reached(self, moment: int) -> np.ndarray:
        """Return which rows have come to a moment of their task."""
        gripper = self.gripper
        state = self.controller.state
        now = self.gripper.time
        turn = np.abs(gripper.slip[:, 2])
        slid = np.hypot(*gripper.slip[:, :2].T)
        if moment == 0:
            return np.full(len(turn), now >= 0.5)
        if self.task == "hold":
            path = slid + RIM * turn
            return (
                path > 1.5e-4 if moment == 1 else (state["found"] > 0.0) & (now >= 2.2)
            )
        axis = 1 if self.task == "slide" else 2
        return gripper.slip[:, axis] / self.goal > (0.4 if moment == 1 else 0.85)

    def watch(self) -> np.ndarray:
        """Note flags and rest of rows; return which have come to their end."""
        gripper = self.gripper
        rows = self.rows
        rows["flags"] |= self.controller.estimate.flags | 1024 * self.controller.blind
        rows["since"] += rows["fault"] >= 0
        place = np.column_stack(
            [
                gripper.slip[:, :2],
                RIM * gripper.slip[:, 2],
                self.controller.state["grip"],
            ]
        )
        still = (np.abs(place - rows["seen"])[:, :3] < 5e-5).all(axis=1) & (
            place[:, 3] > rows["seen"][:, 3] - 0.02
        )
        rows["quiet"] = np.where(still, rows["quiet"] + 1, 0)
        rows["seen"] = np.where(still[:, None], rows["seen"], place)
        gone = np.hypot(*gripper.slip[:, :2].T) > 0.08
        still = (
            (rows["quiet"] > REST)
            & (rows["since"] > REST)
            & ((rows["moment"] < 2) | (self.task != "hold"))
        )
        return (rows["fault"] >= 0) & (gone | still)

    def results(self, which: np.ndarray) -> np.ndarray:
        """Return part, fault, moment, flags, slip (3), goal, grip and its command, speed of rows."""
        rows = self.rows
        gripper = self.gripper
        speed = np.hypot(*gripper.twist[:, :2].T) + RIM * np.abs(gripper.twist[:, 2])
        columns = [
            rows["part"],
            rows["fault"],
            rows["moment"],
            rows["flags"],
            gripper.slip,
            self.goal,
        ]
        return np.column_stack(
            [*columns, gripper.normal_force, self.controller.state["grip"], speed]
        )[which]


def task_of(task: str, count: int, seed: int, kind: int) -> tuple[Any, Any]:
    """Return parts and goals of a task; a held part is tapped at 2.4 s and tilted at 2.5 s."""
    base = random_parts(count, seed, kind)
    random = np.random.default_rng([seed, kind, 1])
    still = dataclasses.replace(base, tap=(0.0, 0.0, 0.0), tilt=0.0)
    if task == "hold":
        return dataclasses.replace(
            base, tap_time=2.4, tilt_time=2.5, tilt_duration=0.3
        ), np.zeros(count)
    if task == "slide":
        centre = random.uniform((-1e-3, -0.02), (1e-3, 0.0), (count, 2))
        return dataclasses.replace(still, centre=centre), -random.choice(
            [0.02, 0.04], count
        )
    if task == "turn":
        centre = random.uniform((0.02, -3e-3), (0.03, 3e-3), (count, 2))
        return dataclasses.replace(still, centre=centre), -np.radians(
            random.choice([45.0, 60.0], count)
        )
    angle = np.radians(random.uniform(60.0, 120.0, count))
    centre = random.uniform((0.0, -0.06), (0.0, -0.03), (count, 2))
    return dataclasses.replace(
        still, centre=centre, tilt=angle, tilt_time=0.5, tilt_duration=1.5
    ), -angle


def run_faults(
    task: str,
    count: int = 16,
    seed: int = 0,
    kinds: Iterable[int] = range(len(KINDS)),
    faults: Any = None,
) -> np.ndarray:
    """Run a task with every fault on `count` parts of each kind; return rows of `Batch.results`, kind in front.

    Rows whose fault is -1 are those of healthy sensors; their grip is the mean over the run.
    """
    faults = expected() if faults is None else faults
    return np.concatenate(
        [
            np.insert(_run(Batch(task, count, seed, kind), faults), 0, kind, axis=1)
            for kind in kinds
        ]
    )


def _run(batch: Batch, faults: list[Fault]) -> np.ndarray:
    count = len(batch.gripper.parts)
    done = []
    came = np.zeros((len(MOMENTS), count), bool)
    grips = []
    sample = batch.gripper.measurement
    for _ in range(round(ENDS[batch.task] / DT)):
        index = [np.arange(len(batch.goal))]
        marks = []
        for moment in range(len(MOMENTS)):
            new = np.flatnonzero(batch.reached(moment)[:count] & ~came[moment])
            came[moment, new] = True
            index.append(np.repeat(new, len(faults)))
            marks += [(moment, fault) for _ in new for fault in range(len(faults))]
        if marks:
            first = len(batch.goal)
            batch.take(np.concatenate(index))
            batch.rows["moment"][first:], batch.rows["fault"][first:] = np.array(
                marks
            ).T
            batch.rows["flags"][first:] = 0
            for row, (_, fault) in enumerate(marks, first):
                batch.rows["factor"][row, list(CHANNELS[faults[fault].channel])] = (
                    FACTORS.get(faults[fault].kind, 1.0)
                )
        sample = batch.sense(batch.gripper.measurement, faults)
        batch.gripper.step(np.minimum(batch.controller.update(sample), 60.0))
        grips.append(batch.gripper.normal_force[:count])
        over = batch.watch()
        if over.any() and (over.sum() > 50 or over.mean() > 0.05):
            done.append(batch.results(over))
            batch.take(np.flatnonzero(~over))
    done.append(batch.results(np.ones(len(batch.goal), bool)))
    found = np.concatenate(done)
    healthy = found[:, 1] < 0
    found[healthy, 8] = np.mean(grips, axis=0)[found[healthy, 0].astype(int)]
    return found


class Ends(NamedTuple):
    """Runs that were kept, that had a flag, and that were not kept and moved on at the end, bool `[N]` each."""

    kept: np.ndarray
    flagged: np.ndarray
    moves: np.ndarray


def ends(task: str, found: np.ndarray) -> Ends:
    """Return how runs ended: rows of `run_faults`."""
    slip = found[:, 5:8]
    goal = np.abs(found[:, 8])
    slid = np.hypot(slip[:, 0], slip[:, 1])
    turn = np.abs(slip[:, 2])
    if task == "hold":
        kept = (slid <= PAST) & (RIM * turn <= PAST)
    elif task == "slide":
        kept = -slip[:, 1] <= goal + PAST
    else:
        kept = (turn <= goal + TURNED) & (slid <= FALLEN[task])
    return Ends(kept, found[:, 4] >= 1, ~kept & (found[:, 11] > 5e-3))
