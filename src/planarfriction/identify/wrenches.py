"""`identify_lugre`: the friction law and the shape of a contact from logs of its motion and its wrench."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.identify.checks import check_logs, load_of, size_at, with_findings
from planarfriction.identify.decimation import decimated, samples_of
from planarfriction.identify.logs import (
    TWIST,
    TWO_LOADS,
    Log,
    as_tuple,
    load_ratio,
    mean_load,
)
from planarfriction.identify.parameters import (
    LAW,
    RADIUS,
    SHAPE,
    SOFT_FINGER,
    USUAL,
    check_names,
    check_patch,
    fitted_law,
    scaled_patch,
)
from planarfriction.identify.problem import SPOILED, FitOptions, LogProblem
from planarfriction.identify.result import Identification
from planarfriction.identify.search import (
    guess_starts,
    interruptible,
    multistart,
    refine,
    stretches,
    warm_start,
)
from planarfriction.identify.sensor_errors import CHANNELS, Nuisance, wrench_noise
from planarfriction.identify.simulators import SIMULATORS
from planarfriction.identify.uncertainty import (
    Fit,
    correlations,
    pulls_of_held,
    uncertainty,
)
from planarfriction.identify.verdicts import (
    Candidate,
    Evidence,
    judge,
    verdicts_on_samples,
    verdicts_on_turns,
)
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.pads import AtLoad
from planarfriction.patch import ContactPatch

START_MU_S = 1.2
"""Static coefficient that a search starts with by default: above `mu_c`, free to move."""

USUAL_EVALUATIONS = 60
"""Number of evaluations of a search."""

PATIENCE = 120.0
"""Time [s] that "auto" has for one of its models."""

SOON = 20.0
"""Time [s] from which on a model that was chosen takes windows of its logs."""

LEAD = next(iter(SIMULATORS))
"""Name of the quickest model, which finds where the others begin."""

WORSE = 2.0
"""Ratio of the costs of two kinds of bristles above which the worse kind is not fitted with other models."""

EXPLAINED = 1.2
"""Reduced chi-square of the better kind of bristles above which the worse kind is left out only if its fit is near the
data: the quickest model may be wrong."""

BEATEN = 1.1
"""Ratio of the costs of a model of cells and of the best fit above which the next such model is not fitted with the
same bristles, if the best fit leaves hardly more than noise."""

USUAL_BRISTLES = ElastoPlastic(0.9)
"""Bristles that "auto" compares with plain ones."""

NO_SLIP = 50.0
"""Factor on the friction coefficients that keeps any contact from slipping."""


def identify_lugre(
    log: Log | Sequence[Log],
    patch: ContactPatch,
    *,
    parameters: Sequence[str] = USUAL,
    model: str = "auto",
    start: LuGre | Mapping[str, float] | None = None,
    options: FitOptions = FitOptions(),  # noqa: B008 (frozen)
    progress: Callable[[str], None] | None = None,
) -> Identification:
    """Estimate parameters of a LuGre contact from logs of twist and wrench, and find which model explains them.

    Bounded nonlinear least squares for the wrenches of a fixed-step rollout; residuals are divided by the noise, and
    parameters that must be > 0 are fitted as logarithms. Sensor errors (delay, zeros, drift) are fitted too.

    Parameters
    ----------
    log
        One log or several of the same contact.
    patch
        The contact. Its shape and centre of pressure are assumed known; its size is only an initial guess if
        `contact_radius` is estimated. To estimate soft-finger constants its pressure must be a `SoftFinger`, and the
        load of each log must be constant.
    parameters
        Names of what to estimate: fields of `LuGre`, `breakaway_ratio`, `contact_radius`, `centre_x`, `centre_y`, and
        `c`, `n`, `k` or `k_per_newton` of a `SoftFinger`. All others keep the values of `start`. Of the usual ones,
        logs of one coordinate leave out the contact radius, which they do not show.
    model
        "reduced-published", "reduced", "distributed", or "auto": the one of them that predicts held-out parts best;
        models whose fit would take minutes are left out.
    start
        Initial guess, and the values of parameters that are not estimated: a law, or values by name. Missing values are
        guessed.
    options
        Noise, sensor errors, starting points and the like.
    progress
        Called with a text from time to time.

    Raises
    ------
    InvalidValueError
        A parameter breaks its rule.
    IdentificationInterrupted
        Ctrl-C, with the best values so far.
    """
    logs = as_tuple("log", log, Log)
    names = check_names(parameters)
    measured, moving = np.any(
        [(log.channels, log.twist.any(axis=0)) for log in logs], axis=0
    )
    # of one coordinate: one wrench channel only, and motion along it only
    if names == USUAL and measured.sum() == 1 and not (moving & ~measured).any():
        names = tuple(name for name in names if name != "contact_radius")
    check_patch(patch, "identify_lugre")
    models = _models_to_fit(
        validation.choice("model", model, ("auto", *SIMULATORS)), patch, names
    )
    validation.instance("options", options, FitOptions, "a FitOptions record")
    laws, given = _start_laws(start, options.elasto_plastic, names)
    kinds: list[tuple[LuGre, AtLoad | None]] = [(law, None) for law in laws]
    findings = check_logs(logs, patch)
    whole = logs
    size = size_at(load_of(logs[0]), patch)
    logs = decimated(logs, size, options.samples)
    noise = wrench_noise(logs) if options.noise is None else np.array(options.noise)
    if (
        given is not None
        and not patch.depends_on_load
        and models != (LEAD,)
        and load_ratio(logs) >= TWO_LOADS
    ):
        usual = np.median([mean_load(log) for log in logs])
        kinds += [(law, AtLoad(usual)) for law in laws]
    problems: list[LogProblem] = []
    guesses = []
    leads = []
    candidates = []
    skipped = []
    with interruptible(problems):
        for name in dict.fromkeys((LEAD, *models)):
            lead = min(leads, key=lambda fit: fit.cost, default=None)
            if lead is not None:
                sure = 2.0 * lead.cost < EXPLAINED * lead.problem.numbers
                kinds = [
                    (fit.problem.law, fit.problem.pad)
                    for fit in leads
                    if fit.cost < WORSE * lead.cost or not (sure or fit.near)
                ]
            for law, pad in kinds:
                more = patch, names, law, options, name, progress, pad
                problem = LogProblem(logs, *more)
                late = problem.work * USUAL_EVALUATIONS
                if model == "auto" and name != LEAD and late > PATIENCE:
                    skipped.append(name)
                    continue
                like, beaten = _like(problem, candidates)
                if beaten:
                    continue
                if late > SOON and model != "auto":
                    few = decimated(whole, size, int(samples_of(logs)[0] * SOON / late))
                    problem = LogProblem(few, *more)
                problems.append(problem)
                if not leads:
                    problem.report("looking for starts")
                    guesses = guess_starts(problem, given, noise)
                    fit = multistart(problem, guesses, noise)
                    _report_first(fit)
                elif like is not None:
                    fit = multistart(problem, [like.values], noise)
                else:
                    fit = warm_start(problem, lead or leads[0], guesses, noise)
                if name == LEAD:
                    leads.append(fit)
                if name in models and (name != LEAD or pad is None):
                    fit = refine(fit)
                    candidates.append(Candidate(fit, uncertainty(fit)))
        best = min(candidates, key=lambda each: each.uncertainty.score)
        sigma = best.fit.sigma
        best = min(
            (each for each in candidates if each.score.model == best.score.model),
            key=lambda each: (each.uncertainty.rejected, each.cost(sigma)),
        )
        found = _identification(
            *_finished(best, candidates), [*dict.fromkeys(skipped)], leads[0].starts
        )
    return with_findings(found, whole, findings)


def _finished(
    best: Candidate, candidates: list[Candidate]
) -> tuple[Candidate, list[Candidate]]:
    """Return the best candidate at the end of its search, which ended early far from the data, and all candidates."""
    if best.fit.near:
        return best, candidates
    best.fit.problem.far = np.inf
    fit = refine(best.fit)
    last = Candidate(fit, uncertainty(fit))
    return last, [last if each is best else each for each in candidates]


def _report_first(fit: Fit) -> None:
    """Report the values of the first fit, long before the last one is done."""
    values = fit.problem.by_name(fit.values).items()
    text = ", ".join(f"{name} {value:.3g}" for name, value in values)
    fit.problem.report(f"a first answer: {text}")


def _like(
    problem: LogProblem, candidates: Sequence[Candidate]
) -> tuple[Fit | None, bool]:
    """Return the fit of another model of cells or discs with the bristles of a problem, and True if a fit beats it.

    Such models differ by a few hundredths of the friction: their fits end beside each other.
    """
    fits = [each.fit for each in candidates if not each.fit.problem.kind.own_radius]
    bristles = problem.law, problem.pad
    for fit in fits:
        if (fit.problem.law, fit.problem.pad) == bristles:
            best = min((each.fit for each in candidates), key=lambda each: each.cost)
            return fit, best.near and fit.cost > BEATEN * best.cost
    return None, False


def _models_to_fit(
    model: str, patch: ContactPatch, names: Sequence[str]
) -> tuple[str, ...]:
    """Return the names of the models to fit; only some take a patch that changes with its load."""
    able = tuple(SIMULATORS)
    if patch.depends_on_load or any(name in SOFT_FINGER for name in names):
        able = (LEAD,)
    if model not in ("auto", *able):
        raise InvalidValueError(
            "model", f"be {LEAD!r} if the patch changes with the load", model
        )
    return able if model == "auto" else (model,)


def guessed_law(values: Mapping[str, float]) -> LuGre:
    """Return the law with which a search without data would begin: the `values` by name, usual ones for the others."""
    return _start_laws(values, USUAL_BRISTLES, ())[0][0]


def _start_laws(
    start: Any, bristles: Any, names: Sequence[str]
) -> tuple[list[LuGre], dict[str, float] | None]:
    """Return laws that hold the parameters that are not estimated, one for each kind of bristles, and values by name.

    The values are None if a whole law was given.
    """
    if type(start) is LuGre:
        return [start], None
    if not isinstance(start, Mapping | None):
        raise InvalidValueError(
            "start", "be a LuGre law or a table of its parameters", start
        )
    given = dict(start or {})
    for name, value in given.items():
        validation.choice("start", name, LAW)
        given[name] = validation.number(f"start[{name!r}]", value)
    kinds = [USUAL_BRISTLES, None] if bristles == "auto" else [bristles]
    fields = dict(given)
    ratio = fields.pop("breakaway_ratio", None)
    if ratio is not None:
        kinds = [ElastoPlastic(ratio)]
    elif "breakaway_ratio" in names:
        kinds = [kinds[0] or USUAL_BRISTLES]
    fields.setdefault("mu_s", max(START_MU_S, fields.get("mu_c", LuGre.mu_c)))
    fields.setdefault("mu_c", min(LuGre.mu_c, fields["mu_s"]))
    return [LuGre(**fields, elasto_plastic=kind) for kind in kinds], given


# ---------------------------------------------------------------------- from the best fit to the result


def _identification(
    best: Candidate,
    candidates: Sequence[Candidate],
    skipped: Sequence[str],
    starts: tuple[int, int],
) -> Identification:
    """Make the result from the best of several models: errors, verdicts, histories, the fitted law and model."""
    fit = best.fit
    u = best.uncertainty
    problem = fit.problem
    count = len(problem.names)
    logs = problem.logs
    values, rig = problem.split(fit.values)
    errors = np.sqrt(np.diag(u.covariance))
    if not u.rejected:
        errors[:count] *= stretches(fit, u)
    histories = _histories(best)
    still = fit.values.copy()
    still[:count][np.isin(problem.names, ("mu_c", "mu_s"))] *= NO_SLIP
    slips, sticks = (
        0.5 * (problem.residual(each, fit.sigma) ** 2).sum()
        for each in (fit.values, still)
    )
    speeds, spins = problem.sliding(fit.values)
    spoiled = (np.abs(problem.distances(fit.values, fit.sigma)) > SPOILED).sum()
    spoiled += np.isinf(fit.sigma[problem.channels]).sum()
    evidence = Evidence(
        names=problem.names,
        values=values,
        errors=errors[:count],
        correlations=correlations(u.covariance)[:count, :count],
        at_bound=fit.at_bound[:count],
        jacobian=u.jacobian[:, :count],
        speeds=speeds,
        spins=spins,
        held_mu_c=problem.law.numbers.mu_c,
        loads=np.array([mean_load(log) for log in logs]),
        load_ratio=load_ratio(logs),
        measured=problem.channels.any(axis=0),
        spoiled=spoiled,
        robust=problem.options.loss != "linear",
        without_slip=sticks - slips,
        largest_coefficient=max(
            np.nanquantile(each["coefficient"], 0.99) for each in histories
        ),
    )
    law = fitted_law(problem.law, problem.by_name(values))
    return Identification(
        names=problem.names,
        values=values,
        standard_errors=errors[:count],
        correlations=evidence.correlations,
        verdicts=(
            *judge(evidence, best, candidates, skipped, pulls_of_held(fit, u)),
            *verdicts_on_samples(logs),
            *verdicts_on_turns(logs),
        ),
        noise=fit.noise,
        channels=CHANNELS,
        histories=tuple(histories),
        law=law,
        model=_fitted_model(problem, values, law),
        starts=starts,
        rig=(*problem.rig.found(rig, errors[count:]), *_noise_of_twists(problem)),
        scores=(best.score, *(each.score for each in candidates if each is not best)),
        chosen=problem.model,
        samples=samples_of(logs),
    )


def _histories(best: Candidate) -> list[dict[str, Any]]:
    """Return measured and predicted wrenches of each log, held-out predictions, and sliding speeds."""
    fit = best.fit
    problem = fit.problem
    known = problem.channels & np.isfinite(fit.sigma)
    held_out = np.full_like(problem.measured, np.nan)
    held_out[problem.used] = best.uncertainty.unseen.reshape(-1, 3)
    held_out = problem.measured + held_out * np.where(known, fit.sigma, np.nan)
    columns = {
        "measured": np.where(problem.channels, problem.measured, np.nan),
        "predicted": problem.shown(fit.values),
        "speed": problem.sliding(fit.values)[0],
        "held_out": held_out,
        "coefficient": problem.coefficients(fit.values),
    }
    rows = zip(*map(problem.split_logs, columns.values()), strict=True)
    return [
        {"name": log.name, "time": log.time, "twist": log.twist}
        | dict(zip(columns, row, strict=True))
        for log, row in zip(problem.logs, rows, strict=True)
    ]


def _noise_of_twists(problem: LogProblem) -> list[Nuisance]:
    """Return the noise of the twists of each log as quantities of the rig, if it is estimated."""
    result = []
    for log, twist in zip(problem.logs, problem.twists, strict=True):
        name = log.name if len(problem.logs) > 1 else ""
        for k, unit in enumerate(("m/s", "m/s", "rad/s")):
            noise = float(twist.noise[k])
            error = noise / np.sqrt(0.3 * len(log.time))
            result.append(Nuisance(f"noise_{TWIST[k]}", unit, noise, error, name))
    return result if "twist" in problem.rig.groups else []


def _fitted_model(problem: LogProblem, values: np.ndarray, law: LuGre) -> Any:
    """Make the fitted model, with the patch scaled about its centre of pressure or fitted soft-finger constants."""
    given = problem.by_name(values)
    patch = problem.fixed_patch
    surface: Any = problem.options.surface
    if problem.fingers:
        finger = {name: given[name] for name in problem.fingers}
        pressure = dataclasses.replace(problem.patch.pressure, **finger)
        patch = dataclasses.replace(problem.patch, pressure=pressure)
        surface = functools.partial(surface, normal_force=problem.reference_load)
    elif any(name in SHAPE for name in given):
        x, y = patch.centre_of_pressure()
        radius = problem.maps[0].base[RADIUS]
        centre = np.array([given.get("centre_x", x), given.get("centre_y", y)])
        scale = given.get("contact_radius", radius) / radius
        patch = scaled_patch(patch, scale, centre)
    return problem.kind.model(patch, law, surface, problem.pad)
