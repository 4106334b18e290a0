"""Friction of a joint from its logs: the one function of this folder that fits."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.joints import balance, goal_fit, problem, torque_fit
from planarfriction.joints.log import JointLog, Plant, as_joint_logs
from planarfriction.joints.problem import JointFit

Progress = Callable[[str], None]
"""Function that is told each step of a fit in words."""


def identify_joint(
    logs: JointLog | Sequence[JointLog],
    plant: Plant,
    *,
    torque_gain: float | None = None,
    terms: Sequence[str] | str = "auto",
    progress: Progress | None = None,
) -> JointFit:
    """Estimate the friction of a joint, and of plant and drive what is not known, from logs of its motion.

    Logs with a torque are fitted to the torque that the measured motion takes; others to the position that a run from
    goal or voltage gives. `torque_gain` is a known kt/R [N m/V]. `terms` are some of "gravity", "stribeck", "load",
    "bristles" and "asymmetry" for torques, of "load", "stribeck", "bristles" and "directional" for goals and voltages,
    beside Coulomb and viscous friction.

    "auto" tries all sets of terms on torques: the smallest set is kept whose errors, as if each second had been left
    out, exceed the least by less than their standard error, and whose terms are clear of zero. On goals, a term is kept
    only if the errors of logs that were left out fall by more than their scatter (t-test of their logarithms, 95 %,
    one-sided), and by 14 % at least; by that much also in either half of the logs if the other half is fitted. Fewer
    than four logs are cut into parts that are left out in turn. `progress` is told each step; what it raises, and
    Ctrl-C, end the fit.

    Raises InvalidValueError for unknown terms, logs of both kinds, in ms or degrees, of dead sensors, with a sign that
    makes friction drive, or that no model of friction explains; for a joint that stands or goes one way only; and for a
    plant and drive that leave the scale of the torques open.
    """
    if progress is not None and not callable(progress):
        raise InvalidValueError("progress", "be a function of words, or None", progress)
    plant = validation.instance("plant", plant, Plant, "a Plant")
    logs = as_joint_logs(logs, plant)
    progress = progress or (lambda words: None)
    gain = (
        None if torque_gain is None else validation.positive("torque_gain", torque_gain)
    )
    by_torque = logs[0].torque is not None
    auto = isinstance(terms, str) and terms == "auto"
    chosen = () if auto else _chosen(terms, by_torque)
    if by_torque:
        return torque_fit.fit_torques(logs, plant, chosen, auto, progress)
    if gain is None and not plant.mass and not plant.inertia:
        raise InvalidValueError(
            "plant", "have a mass or an inertia, or torque_gain be given", plant
        )
    base = problem.JointFitProblem(
        logs, plant, gain, (), -(-goal_fit.GROUPS // len(logs))
    )
    return goal_fit.fit_goals(base, chosen, auto, progress)


def _chosen(terms: Sequence[str] | str, by_torque: bool) -> tuple[str, ...]:
    """Return the terms that were asked for, or raise InvalidValueError."""
    known = balance.TERMS if by_torque else problem.TERMS
    chosen = tuple(validation.choices("terms", terms, [*balance.TERMS, *problem.TERMS]))
    for term in chosen:
        if term not in known:
            kind = "logs of a torque" if by_torque else "logs of a goal or voltage"
            raise InvalidValueError(
                "terms", f"be some of {', '.join(known)} for {kind}", term
            )
    for term, other in problem.NEEDS.items():
        if term in chosen and other not in chosen:
            raise InvalidValueError("terms", f"have {other} with {term}", chosen)
    return tuple(each for each in known if each in chosen)
