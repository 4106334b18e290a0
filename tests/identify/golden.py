"""Numbers and texts of fits.

The values at which they are taken are fixed, without a search, so that rounding does not grow.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

import planarfriction as pf
from planarfriction.geometry import rotate
from planarfriction.identify import (
    FitOptions,
    Log,
    MassProperties,
    candidate_motions,
    current_estimate,
    design_experiment,
    differentiated,
    fit_start,
    predict_slide,
)
from planarfriction.identify.checks import (
    check_logs,
    check_sampling,
    size_of,
    with_findings,
)
from planarfriction.identify.decimation import decimated, redrawn, samples_of
from planarfriction.identify.motion import SlideProblem
from planarfriction.identify.motion import _identification as result_of_slides
from planarfriction.identify.parameters import USUAL
from planarfriction.identify.problem import LogProblem
from planarfriction.identify.rig import wrench_noise
from planarfriction.identify.search import guess_starts, misfit
from planarfriction.identify.slides import start_of, start_slopes
from planarfriction.identify.uncertainty import Fit, uncertainty
from planarfriction.identify.verdicts import Candidate
from planarfriction.identify.wrenches import _identification, _start_laws
from planarfriction.scenes import driven
from tests.identify.test_motion import BODY, ellipsoid, slides
from tests.identify.test_motion import LAW as SLIDING
from tests.identify.test_motion import PATCH as STANDING
from tests.support.identification_logs import LAW, PATCH, clean_log, excitation, noisy

FINGER = pf.ContactPatch.disc(
    0.012, cells=9, pressure=pf.SoftFinger(c=0.006, n=0.3, k=2.5)
)
WIDE = pf.LuGre(
    mu_c=0.52,
    mu_s=0.66,
    v_s=2.2e-3,
    gamma=1.5,
    sigma_0=1.9e4,
    sigma_1=25.0,
    sigma_2=0.7,
)


def log(
    seed: int, load: float = 2.0, duration: float = 0.5, drift: float = 0.02
) -> Log:
    """Return a log with 1 % of noise whose zeros drift."""
    time, twist = excitation(duration=duration)
    clean = clean_log(time, twist, load=load, name=f"log {seed}")
    drifts = (
        drift * clean.wrench.std(axis=0) * np.linspace(-1.0, 1.0, len(time))[:, None]
    )
    return noisy(dataclasses.replace(clean, wrench=clean.wrench + drifts), seed)


def spoiled(given: Log) -> Log:
    """Return the log with three values far off, without a torque, and with an angle beside its twist."""
    wrench = given.wrench.copy()
    wrench[[50, 120, 333], [0, 1, 0]] += 3.0
    wrench[:, 2] = 0.0
    return dataclasses.replace(given, wrench=wrench)


def axis(given: Log) -> Log:
    """Return the log of the slide along x alone."""
    twist = given.twist * [1.0, 0.0, 0.0]
    return noisy(clean_log(given.time, twist, name="axis"), 5)


TWO, STILL = (log(1), log(2, 3.0)), (log(1, drift=0.0), log(2, 3.0, drift=0.0))
ELASTO = dataclasses.replace(WIDE, elasto_plastic=pf.ElastoPlastic(0.88))
ASIDE = pf.ContactPatch.disc(
    0.01, cells=11, pressure=lambda x, y: 1.0 + 40.0 * x - 20.0 * y
)
"""A patch whose centre of pressure is no zero, which would be rounding."""
NEAR = dataclasses.replace(LAW, mu_c=0.5003, sigma_0=20030.0)
PROBLEMS: dict[str, tuple] = {
    "near": (STILL, PATCH, USUAL, NEAR, FitOptions(refine=1), "reduced-published"),
    "held": (STILL, PATCH, ("mu_s", "gamma", "sigma_0"),
             dataclasses.replace(NEAR, sigma_1=31.0), FitOptions(refine=1), "reduced-published"),
    "one axis": ((axis(TWO[0]),), PATCH, USUAL[:-1], NEAR, FitOptions(refine=1), "reduced-published"),
    "published": (TWO, PATCH, USUAL, ELASTO, FitOptions(), "reduced-published"),
    "distributed": (TWO[:1], ASIDE, ("mu_c", "mu_s", "v_s", "sigma_0", "contact_radius", "centre_x", "centre_y"),
                    WIDE, FitOptions(refine=2), "distributed"),
    "fixed stiffness": (TWO, PATCH, USUAL,
                        dataclasses.replace(WIDE, reference_load=2.5), FitOptions(refine=1), "reduced"),
    "breakaway": (TWO[1:], PATCH, (*USUAL, "breakaway_ratio"), ELASTO,
                  FitOptions(refine=2, begins="steady", nuisance=("delay", "bias")), "reduced-published"),
    "robust": ((spoiled(TWO[0]),), PATCH, ("mu_c", "sigma_0", "sigma_2"), ELASTO,
               FitOptions(loss="soft_l1", refine=2, nuisance=("bias", "load")), "reduced-published"),
    "soft finger": (TWO, FINGER, ("mu_c", "mu_s", "sigma_0", "c", "n", "k"), ELASTO,
                    FitOptions(refine=2, nuisance=("twist",)), "reduced-published"),
    "windows": (
        decimated((log(3, duration=2.5),), 0.0067, 1000), PATCH, USUAL, ELASTO,
        FitOptions(refine=1), "reduced-published",
    ),
}  # fmt: skip


def fit_at(problem: LogProblem) -> Fit:
    """Return a fit that ends at the starts of the contact, with disturbances of the rig."""
    start = problem.start_values()
    rig = (
        (0.1 if problem.law.mu_c > 0.51 else 0.0)
        * problem.rig.widths
        * np.sin(1.0 + np.arange(len(problem.rig.columns)))
    )
    values = np.concatenate([start, rig])
    coordinates = problem.coordinates(start)
    noise, sigma = problem.estimate_noise(values, wrench_noise(problem.logs))
    x = coordinates.of(values)
    free = np.zeros(len(values), dtype=bool)
    cost = 0.5 * float((problem.residual(values, sigma) ** 2).sum())
    return Fit(problem, coordinates, x, values, free, noise, sigma, (1, 2), cost)


def numbers_of_problem(given: tuple) -> dict[str, Any]:
    """Compute starts, residuals, derivatives, noise and steps of a problem, and the result at its starts."""
    problem = LogProblem(*given)
    fit = fit_at(problem)
    residual, jacobian = problem.linearised(fit.values, fit.sigma)
    found = {
        "starts": guess_starts(problem, {}, starts=3, seed=1, noise=fit.noise),
        "whole law": guess_starts(problem, None, starts=2, seed=1, noise=fit.noise),
        "misfit": misfit(problem, fit.values, fit.noise), "noise": fit.noise, "sigma": list(fit.sigma),
        "residual": residual, "jacobian": list(jacobian.T),
        "work": problem.work, "sizes": problem.sizes(), "numbers": problem.numbers,
        "prior": list(fit.coordinates.prior(fit.x + 0.1)), "slopes": fit.coordinates.slopes(fit.x + 0.1),
        "bounds": list(fit.coordinates.bounds()), "shown": problem.shown(fit.values),
        "more steps": problem.refine_steps(fit.values, fit.sigma), "steps": problem.steps,
    }  # fmt: skip
    u = uncertainty(fit)
    names = (
        "covariance",
        "pull",
        "reduced_chi2",
        "limit",
        "neighbours",
        "held_out",
        "unseen",
    )
    found |= {name: getattr(u, name) for name in names} | {
        "strains": [list(each) for each in u.strains]
    }
    best = Candidate(fit, u)
    return found | result(_identification(best, [best], ["distributed"], (2, 3)))


def result(found: Any) -> dict[str, Any]:
    """Return all that a result says."""
    histories = {
        name: [each[name] for each in found.histories]
        for name in found.histories[0]
        if name != "time"
    }
    return {
        "table": found.table(), "data": found.to_dict(), "draws": found.sample(5, seed=3), "histories": histories,
        "law": vars(found.law) | {"elasto_plastic": str(found.law.elasto_plastic)},
        "model": [type(found.model).__name__, found.model.patch.positions, found.model.patch.contact_radius(2.0)],
        "residuals": found.residuals,
    }  # fmt: skip


def numbers_of_plan() -> dict[str, Any]:
    """Compute motions to choose from, their ranks, and what a result says to plan with."""
    motions = candidate_motions(
        PATCH, LAW, normal_force=[1.0, 2.0], duration=0.3, speed=0.04
    )
    fit = fit_at(LogProblem(*PROBLEMS["breakaway"]))
    best = Candidate(fit, uncertainty(fit))
    patch, law = current_estimate(
        _identification(best, [best], [], (1, 1)),
        PATCH,
        dataclasses.replace(LAW, v_s=1.0),
    )
    plans = {
        "first": design_experiment(ASIDE, LAW, motions=motions[:6]),
        "next": design_experiment(ASIDE, LAW, logs=TWO[0], motions=motions[6:], wanted=("sigma_0", "v_s"),
                                  parameters=(*USUAL, "centre_x"), nuisance=("delay", "load")),
    }  # fmt: skip
    told = {
        name: [
            each.table(),
            each.gains,
            list(each.errors),
            each.errors_so_far,
            each.values,
            each.best.wrench,
        ]
        for name, each in plans.items()
    }
    return told | {
        "motions": [[each.name, each.twist, each.normal_force] for each in motions],
        "patch": patch.contact_radius(), "law": [getattr(law, name) for name in USUAL[:-1]],
    }  # fmt: skip


def numbers_of_windows() -> dict[str, Any]:
    """Compute windows of a long log and the motion between them, and slopes of a measured motion."""
    (cut,) = PROBLEMS["windows"][0]
    again = redrawn(cut, np.array([1e-3, 1e-3, 0.1]), np.random.default_rng(0))
    t = np.cumsum(np.r_[0.0, 1e-2 + 1e-3 * np.cos(np.arange(40))])
    part = cut.gaps[0].until(0.5 * cut.gaps[0].dt[-1], cut.twist[0])
    return {
        "samples": list(samples_of([cut])), "inner": cut.inner, "time": cut.time,
        "parts": [each.time for each in cut.parts],
        "gaps": [list(each) for each in cut.gaps], "redrawn": [each.twist for each in again.gaps], "until": list(part),
        "slopes": differentiated(t, np.stack([t**2, np.sin(9.0 * t), t], -1)),
    }  # fmt: skip


def findings(given: Log) -> list[str]:
    """Return what is odd about a log on the patch."""
    try:
        return [str(each) for each in check_logs([given], PATCH)]
    except pf.FrictionError as error:
        return [str(error)]


def numbers_of_logs() -> dict[str, Any]:
    """Compute logs from other measurements, what is odd about logs that were misread, and laws to start from."""
    given = STILL[0]
    size = float(PATCH.contact_radius())
    time = given.time
    twist = given.twist
    wrench = given.wrench
    load = given.normal_force
    pose = np.cumsum(twist, axis=0) * given.interval * [1.0, 1.0, 3.0]
    turned = np.column_stack([pose[:, :2], np.mod(pose[:, 2], 2.0 * np.pi)])
    scene = driven(pf.ReducedModelPublished(PATCH, LAW), normal_force=2.0, t_end=0.7)
    solution = pf.simulate(scene, save_every=0.05)
    made = {
        "motion": Log.from_motion(time, turned, wrench, load, name="turned"),
        "axis": Log.from_axis(
            time, wrench[:, 1], load, position=pose[:, 1], axis="y", window=5
        ),
        "joint": Log.from_axis(
            time, wrench[:, 2], load, velocity=twist[:, 2], axis="theta"
        ),
        "solution": Log.from_solution(solution),
    }
    misread = {
        "as it is": given,
        "pushes": (twist, -wrench, load),
        "turned": (twist, rotate(wrench, np.full(len(time), 1.0)), load),
        "down": (twist, wrench * [1.0, -1.0, -1.0], load),
        "torque turned": (twist, wrench * [1.0, 1.0, -1.0], load),
        "wide": (twist, wrench * [1.0, 1.0, 10.0], load),
        "mm": (1e3 * twist, wrench, load),
        "kN": (twist, wrench, 1e-3 * load),
        "N mm": (twist, wrench * [1e-3, 1e-3, 1e3], load),
        "offset": (twist, wrench, np.where(np.arange(len(time)) % 2 < 1, 0.0, load)),
    }
    logs = {
        name: each if isinstance(each, Log) else Log(time, *each, name)
        for name, each in misread.items()
    }
    fit = fit_at(LogProblem(*PROBLEMS["near"]))
    best = Candidate(fit, uncertainty(fit))
    base = _identification(best, [best], [], (1, 1))
    few = Log(time[::25], twist[::25], wrench[::25], load[::25], "few")
    starts = [
        _start_laws(*each)
        for each in [(None, "auto", ()), ({"mu_s": 0.4, "sigma_0": 1e3}, None, ()), (LAW, "auto", ()),
                     ({"breakaway_ratio": 0.7}, "auto", ()), ({"mu_c": 2.0}, "auto", ("breakaway_ratio",))]
    ]  # fmt: skip
    return {
        **{f"log, {name}": [each.name, each.time, each.twist, each.wrench, each.normal_force, each.turns, each.held]
           for name, each in made.items()},
        "findings": {name: findings(each) for name, each in logs.items()},
        "ms": findings(Log(1e3 * time, 10.0 * twist, wrench, load, "slow")),
        "sampling": str(check_sampling(few, 2e4, 30.0)), "enough": check_sampling(given, 2e4, 30.0) is None,
        "verdicts": [str(each) for each in with_findings(base, [few], check_logs([logs["down"]], PATCH)).verdicts],
        "size": [size, size_of(given, PATCH)], "starts": [[list(map(str, laws)), fields] for laws, fields in starts],
    }  # fmt: skip


def numbers_of_slides() -> dict[str, Any]:
    """Compute the result of slides near the values that made them, and the prediction of one."""
    some = slides(4)
    law = dataclasses.replace(SLIDING, mu_c=0.31, mu_s=0.31)
    problem = SlideProblem(
        some, STANDING, BODY, ("mu_c", "contact_radius"), law, ellipsoid, None, True
    )
    values = problem.start_values()
    coordinates = problem.coordinates(values)
    first = np.array([1e-3, 1e-3, 2e-2])
    problem.linearised(values, problem.even_sigma(first))
    noise, sigma = problem.estimate_noise(values, first)
    residual, jacobian = problem.linearised(values, sigma)
    at = coordinates.of(values), values, np.zeros(2, dtype=bool)
    found = _told(
        result_of_slides(
            Fit(problem, coordinates, *at, noise, sigma, (1, 1), 1.0), problem, []
        )
    )
    poses, slopes = start_slopes(
        ellipsoid(STANDING, law), MassProperties(0.4, 8e-4), some[0], start_of(some[0])
    )
    more = {
        "poses": poses,
        "slopes": slopes,
        "noise of each": noise,
        "residual": residual,
        "jacobian": jacobian,
    }
    model = ellipsoid(STANDING, SLIDING)
    more["predicted"] = predict_slide(model, BODY, some[1], samples=12)
    return (
        found
        | more
        | {
            "start": fit_start(
                model, BODY, some[2], samples=20, noise=(1e-3, 1e-3, 0.1)
            )
        }
    )


def _told(found: Any) -> dict[str, Any]:
    told = result(found)
    return {name: told[name] for name in ("table", "data", "draws", "law")}


SOURCES: dict[str, Any] = {
    **{
        f"problem, {name}": (lambda given=given: numbers_of_problem(given))
        for name, given in PROBLEMS.items()
    },
    "plan": numbers_of_plan,
    "windows": numbers_of_windows,
    "logs": numbers_of_logs,
    "slides": numbers_of_slides,
}
"""What is computed, by name."""
