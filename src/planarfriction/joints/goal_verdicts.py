"""Verdicts on the fit of a joint from goals or voltages: its terms, its drive, and what its logs contradict."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from planarfriction.identify.verdicts import Verdict
from planarfriction.joints.log import JointLog, runs
from planarfriction.joints.problem import friction_of

if TYPE_CHECKING:
    from planarfriction.joints.goal_fit import Trial

LAGS = np.arange(-20, 61) * 1e-3
"""Delays of a reported speed that are tried [s]."""

LATE = 3e-3
"""Delay of a reported speed above which it is named [s]."""

FULL = 0.999
"""Duty that counts as full."""

STANDING = 0.02
"""Share of the largest speed below which a joint stands."""

LONG = 0.1
"""Time [s] for which a joint stands."""

WORDS = {
    "load": (
        "the level grows with the torque through the gears",
        "not load-dependent as far as these logs tell",
    ),
    "stribeck": (
        "friction falls with speed from rest on",
        "no fall of friction with speed was seen",
    ),
    "bristles": (
        "the joint bends before it slips",
        "give rigid friction, or measure slow reversals",
    ),
    "directional": (
        "torque of the motor and of the load raise the level by different shares",
        "no difference between motor and load driving was seen",
    ),
}
"""Meaning of a term that was kept, and of one that was not."""


def judge(kept: Trial, pairs: Mapping[str, tuple[Trial, Trial]]) -> tuple[Verdict, ...]:
    """Return the verdicts on a trial that was kept, and on the `pairs` of trials with and without a term."""
    logs = kept.problem.logs
    stuck = (
        _on_standing(kept, i, mask)
        for i, log in enumerate(logs)
        if (mask := standing(log)).any()
    )
    return (
        *_on_terms(kept, pairs),
        *_on_drive(kept),
        *lags(logs),
        *itertools.chain(*stuck),
    )


def _on_terms(
    kept: Trial, pairs: Mapping[str, tuple[Trial, Trial]]
) -> Iterator[Verdict]:
    for term, (trial, without) in pairs.items():
        gain, scatter, halves = trial.gains(without)
        ratio, low, high, *both = np.exp(
            [-gain, -gain - scatter, -gain + scatter, *np.negative(halves)]
        )
        numbers = f"errors of left-out logs are {ratio:.2f} ({low:.2f} to {high:.2f}) of those without it"
        numbers += f", {both[0]:.2f} and {both[1]:.2f} if half of the logs are fitted"
        good = term in kept.terms
        if term == "load":
            numbers += f", b = {trial.values['load']:.2g}"
        yield Verdict(term, good, f"{WORDS[term][0 if good else 1]} ({numbers})")


def _on_drive(kept: Trial) -> Iterator[Verdict]:
    problem = kept.problem
    values = kept.values
    gain = values.get("torque_gain", problem.torque_gain or 0.0)
    if "back_emf" in values:
        emf = values["back_emf"]
        kt = emf / gain
        resistance = emf / gain**2
        text = f"kt/R = {gain:.3g} N m/V; with the drive off: kt = {kt:.3g} N m/A, R = {resistance:.3g} Ohm"
        yield Verdict("torque_gain", True, text)
    else:
        yield Verdict(
            "torque_gain",
            True,
            f"only kt/R = {gain:.3g} N m/V is known, neither kt nor R",
        )
        text = "no log with the drive off: viscous friction and back-EMF cannot be told apart"
        yield Verdict(
            "sigma_2", False, f"{text}, {values['sigma_2']:.3g} N m s/rad is both"
        )
    if (
        problem.plant.mass
        and problem.plant.arm_mass is None
        and problem.torque_gain is None
    ):
        share = 0.5 / problem.plant.mass  # half the mass of an arm counts, in %
        text = f"an arm without mass is assumed: all torques grow by {share:.2g} % for each 10 g of an arm"
        yield Verdict("arm_mass", False, text)


def speed_lag(log: JointLog) -> float:
    """Estimate by how much the reported speed lags the slope of q [s]."""
    inner = (
        slice(len(LAGS), -len(LAGS)) if len(log.time) > 4 * len(LAGS) else slice(None)
    )
    misses = [
        float(
            np.abs(np.interp(log.time - lag, log.time, log.speed) - log.dq)[
                inner
            ].mean()
        )
        for lag in LAGS
    ]
    return float(LAGS[int(np.argmin(misses))])


def standing(log: JointLog) -> np.ndarray:
    """Return the mask of samples that stand at full duty for `LONG`, `[T]`."""
    if log.goal is None or log.drive is None:
        return np.zeros(len(log.time), dtype=bool)
    speed = np.abs(log.speed)
    full = (np.abs(log.drive.duty(log.goal - log.q)) >= FULL) & (log.on > 0.0)
    mask = full & (speed < STANDING * speed.max())
    for first, last in runs(mask):
        if log.time[last - 1] - log.time[first] < LONG:
            mask[first:last] = False
    return mask


def lags(logs: Sequence[JointLog]) -> Iterator[Verdict]:
    """Yield a verdict on a reported speed that lags."""
    late = [speed_lag(log) for log in logs if log.dq is not None]
    if late and abs(lag := float(np.median(late))) > LATE:
        text = f"the reported speed lags by {1e3 * lag:.0f} ms ({1e3 * min(late):.0f} to {1e3 * max(late):.0f})"
        yield Verdict("dq", False, f"{text}: the slope of q was used")


def _on_standing(kept: Trial, i: int, mask: np.ndarray) -> Iterator[Verdict]:
    """Compare a log that stands at full duty with what the others say: it must lie within the level of friction."""
    log = kept.problem.logs[i]
    values = kept.folds[i * kept.problem.parts]
    plant = kept.problem.plant_numbers(values, log)
    joint = friction_of(values)
    driven = plant.torque_gain * log.volts[mask]
    outside = (log.outside - plant.moment * np.sin(log.q - plant.offset))[mask]
    most = joint.mu_s + np.abs(
        joint.load_motor * driven - joint.load_external * outside
    )
    over = float(np.median(np.abs(driven + outside) - most))
    if over > 0.0:
        seconds = float(mask.sum() * np.median(np.diff(log.time)))
        text = f"{log.name}: saturated and standing for {seconds:.2g} s at {np.median(log.q[mask]):.2f} rad"
        text += f": this log contradicts the others, by which {over:.2g} N m are left over to move it"
        yield Verdict("fit", False, f"{text}; look for a current limit, heat or a stop")
