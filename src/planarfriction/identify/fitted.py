"""From a minimum to an `Identification`: standard errors, verdicts, histories, the fitted law and model."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from planarfriction.derivatives import PARAMETERS
from planarfriction.identify import parameters as known
from planarfriction.identify.choice import Candidate
from planarfriction.identify.least_squares import correlations
from planarfriction.identify.nuisance import CHANNELS, Nuisance
from planarfriction.identify.problem import Problem, mean_load
from planarfriction.identify.result import Identification, verdicts_on_turns
from planarfriction.identify.simulators import model_of
from planarfriction.identify.verdicts import Evidence, judge
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.models import ReducedModelPublished
from planarfriction.patch import ContactPatch

NO_SLIP = 50.0
"""Factor on the friction coefficients that keeps any contact from slipping."""


def assemble(
    best: Candidate, candidates: Sequence[Candidate], skipped: Sequence[str], agreement: tuple[int, int]
) -> Identification:
    """The identification of the best of several models."""
    fit, u = best.fit, best.uncertainty
    problem, count = fit.problem, len(fit.problem.names)
    values, rig = problem.split(fit.values)
    errors = np.sqrt(np.diag(u.covariance))
    still = fit.values.copy()
    still[:count] *= np.where(np.isin(problem.names, ("mu_c", "mu_s")), NO_SLIP, 1.0)
    off = problem.off(fit.values, fit.spread)
    sliding = problem.sliding(values)
    shown = problem.shown(fit.values)
    unseen = _unseen(best)
    histories = [_history(problem, i, values, shown[i], unseen[i], speed) for i, (speed, _) in enumerate(sliding)]
    evidence = Evidence(
        names=problem.names,
        values=values,
        errors=errors[:count],
        correlations=correlations(u.covariance)[:count, :count],
        at_bound=fit.at_bound[:count],
        jacobian=u.jacobian[:, :count],
        speeds=np.concatenate([each[0] for each in sliding]),
        spins=np.concatenate([each[1] for each in sliding]),
        loads=np.array([mean_load(log) for log in problem.logs]),
        without_slip=0.5 * float((problem.off(still, fit.spread) ** 2).sum() - (off**2).sum()),
        torque=any(log.channels[2] for log in problem.logs),
        largest_coefficient=max(float(np.nanquantile(each["coefficient"], 0.99)) for each in histories),
    )
    law = _law(problem, values)
    noise_of_twist = [
        Nuisance(
            f"noise_{name}",
            unit,
            float(value),
            float(value / np.sqrt(0.3 * len(log.time))),
            log.name if several else "",
        )
        for log, twist in zip(problem.logs, problem.twists, strict=True)
        for name, unit, value in zip(("vx", "vy", "omega"), ("m/s", "m/s", "rad/s"), twist.noise, strict=True)
        for several in [len(problem.logs) > 1]
    ]
    return Identification(
        names=problem.names,
        values=values,
        standard_errors=errors[:count],
        correlations=evidence.correlations,
        verdicts=(*judge(evidence, best, candidates, skipped), *verdicts_on_turns(problem.logs)),
        noise=fit.noise,
        channels=CHANNELS,
        histories=tuple(histories),
        law=law,
        model=_model(problem, values, law),
        starts=agreement,
        rig=(*problem.rig.found(rig, errors[count:]), *(noise_of_twist if "twist" in problem.rig.groups else [])),
        scores=tuple(each.score for each in candidates),
        chosen=problem.kind,
    )


def _unseen(best: Candidate) -> list[np.ndarray]:
    """Wrenches `[T, 3]` of each log as fits predict them that saw neither the sample nor its block."""
    fit, result, at = best.fit, [], 0
    for log, used, spread in zip(fit.problem.logs, fit.problem.used, fit.spread, strict=True):
        wrench, size = np.full_like(log.wrench, np.nan), 3 * len(log.time[used])
        off = best.uncertainty.unseen[at : at + size].reshape(-1, 3)
        wrench[used] = log.wrench[used] + off * np.where(log.channels, spread[used], np.nan)
        result.append(wrench)
        at += size
    return result


def _history(
    problem: Problem, i: int, values: np.ndarray, shown: np.ndarray, unseen: np.ndarray, speed: np.ndarray
) -> dict[str, Any]:
    """What was measured and predicted of log i, with its sliding speeds."""
    log, vector = problem.logs[i], problem.shapes[i].vector(values)
    radius = vector[PARAMETERS.index("contact_radius")]
    force = np.linalg.norm(log.wrench / [1.0, 1.0, radius], axis=1)
    coefficient = force / np.where(log.normal_force > 0.0, log.normal_force, np.nan)
    history = {
        "name": log.name,
        "time": log.time,
        "measured": np.where(log.channels, log.wrench, np.nan),
        "predicted": shown,
        "held_out": unseen,
    }
    return {**history, "speed": speed, "coefficient": coefficient}


def _law(problem: Problem, values: np.ndarray) -> LuGre:
    given = dict(zip(problem.names, values.tolist(), strict=True))
    fields = {name: given[name] for name in known.LAW if name in given and name != "breakaway_ratio"}
    mu_c, mu_s = fields.get("mu_c", problem.law.mu_c), fields.get("mu_s", problem.law.mu_s)
    if mu_s < mu_c:  # mu_s was held, and mu_c grew past it
        fields["mu_s"] = mu_c
    if "breakaway_ratio" in given:
        fields["elasto_plastic"] = ElastoPlastic(given["breakaway_ratio"])
    return dataclasses.replace(problem.law, **fields)


def _model(problem: Problem, values: np.ndarray, law: LuGre) -> Any:
    """The fitted model: the patch scaled about its centre of pressure, or with the fitted soft-finger constants."""
    given = dict(zip(problem.names, values.tolist(), strict=True))
    patch, surface = problem.model.patch, type(problem.model.surface)
    finger = {name: given[name] for name in known.SOFT_FINGER if name in given}
    if finger:
        pressure = dataclasses.replace(problem.patch.pressure, **finger)
        fitted = ContactPatch(problem.patch.positions, problem.patch.areas, pressure, problem.patch.grid, patch.name)
        return ReducedModelPublished(fitted, law, surface=surface(fitted, normal_force=problem.reference))
    if any(name in known.SHAPE for name in given):
        centre, radius = patch.centre_of_pressure(), float(problem.shapes[0].base[PARAMETERS.index("contact_radius")])
        to = np.array([given.get("centre_x", centre[0]), given.get("centre_y", centre[1])])
        patch = moved_patch(patch, centre, to, given.get("contact_radius", radius) / radius)
    return model_of(problem.kind, patch, law, surface)


def moved_patch(patch: ContactPatch, centre: np.ndarray, to: np.ndarray, scale: float) -> ContactPatch:
    """The patch with its point `centre` moved to `to` and everything scaled about it, its grid too."""
    grid = patch.grid
    if grid is not None:
        x, y = to + scale * (np.array([grid.x_min, grid.y_min]) - centre)
        size = {"cell_width": scale * grid.cell_width, "cell_height": scale * grid.cell_height}
        grid = dataclasses.replace(grid, x_min=float(x), y_min=float(y), **size)
    positions = to + scale * (patch.positions - centre)
    return ContactPatch(positions, scale**2 * patch.areas, patch.weights() / patch.areas, grid, patch.name)
