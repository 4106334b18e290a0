"""`identify_lugre`: the friction law and the shape of a contact from logs of its motion and its wrench."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.identify import parameters as known
from planarfriction.identify.checks import check_logs, with_findings
from planarfriction.identify.choice import Candidate, best_of
from planarfriction.identify.fitted import assemble
from planarfriction.identify.guess import guess_starts
from planarfriction.identify.logs import Log, as_logs
from planarfriction.identify.nuisance import GROUPS, check_groups
from planarfriction.identify.problem import Problem, given_noise
from planarfriction.identify.result import Identification
from planarfriction.identify.search import follow, look, refined
from planarfriction.identify.sensors import first_noise
from planarfriction.identify.simulators import MODELS
from planarfriction.identify.uncertainty import uncertainty
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import LimitSurface, LimitSurfaceTablePublished
from planarfriction.patch import ContactPatch
from planarfriction.patch.metric import refuse_anisotropy

BEGINS = ("rest", "steady")

START_MU_S = 1.2
"""Static coefficient that a search starts with by default: above `mu_c`, free to move."""

USUAL_EVALUATIONS, PATIENCE = 60, 120.0
"""Evaluations that a search takes, and the time [s] that "auto" has for one of its models."""


def identify_lugre(
    log: Log | Sequence[Log],
    patch: ContactPatch,
    *,
    parameters: Sequence[str] = known.USUAL,
    model: str = "auto",
    nuisance: Sequence[str] = GROUPS,
    start: LuGre | Mapping[str, float] | None = None,
    elasto_plastic: ElastoPlastic | float | None = ElastoPlastic(0.9),  # noqa: B008 (frozen)
    surface: type[LimitSurface] = LimitSurfaceTablePublished,
    noise: Sequence[float] | None = None,
    begins: str = "rest",
    refine: int | None = None,
    starts: int = 4,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> Identification:
    """Estimate parameters of a LuGre contact from logs of twist and wrench, and find which model explains them.

    Bounded nonlinear least squares for the wrenches of a fixed-step roll-out; residuals are divided by the noise, and
    parameters that must be > 0 are fitted as logarithms. Disturbances of the rig (delay, zeros, drift) are estimated
    too.

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
        `c`, `n`, `k` or `k_per_newton` of a `SoftFinger`. All others keep the values of `start`.
    model
        "reduced-published", "distributed", "reduced", or "auto": the one of them that predicts held-out parts best;
        models whose fit would take minutes are left out.
    nuisance
        Disturbances that the rig may add: "delay" between motion and wrench, "bias" (zeros of the wrench and their
        drift), "load" (scale and drift of the load cell), "twist" (noise of the twist). All by default.
    start
        Initial guess, and the values of parameters that are not estimated: a law, or values by name. Missing values are
        guessed.
    elasto_plastic
        Kind of bristles (if `start` is a law, that of the law).
    surface
        Class of the limit surface of "reduced-published".
    noise
        Standard deviation of the measured fx, fy [N] and tau [N m]; None estimates each from its jitter.
    begins
        "rest": every log begins with relaxed bristles. "steady": it begins with those of steady sliding at its first
        twist.
    refine
        Steps between two samples; None doubles them until no estimate changes by more than a fifth of its error.
    starts, seed
        Number of starting points, and the random seed that scatters them.
    progress
        Called with a text from time to time.

    Raises
    ------
    InvalidValueError
        A parameter breaks its rule.
    """
    logs, names = as_logs(log), known.check_names(parameters)
    validation.instance("patch", patch, ContactPatch, "a ContactPatch")
    refuse_anisotropy(patch, "identify_lugre")
    kinds = _kinds(validation.choice("model", model, ("auto", *MODELS)), patch, names)
    groups = check_groups(nuisance)
    validation.choice("begins", begins, BEGINS)
    starts = validation.count("starts", starts)
    law, given = _start_law(start, elasto_plastic)
    findings = check_logs(logs, patch, names)
    steps = 1 if refine is None else validation.count("refine", refine)
    say = (lambda text: None) if progress is None else progress
    spread = first_noise(logs) if noise is None else given_noise(noise)
    # The quickest model leads: it finds where the others begin.
    guesses, found, skipped, lead = [], [], [], None
    for kind in dict.fromkeys((MODELS[0], *kinds)):
        problem = Problem(logs, patch, names, law, surface, begins, steps, kind, groups)

        def tell(text: str, kind: str = kind) -> None:
            say(f"{kind}: {text}")

        if lead is None:
            tell("looking for starts")
            chance = validation.count("seed", seed, 0)
            guesses = guess_starts(problem, given, starts=starts, seed=chance, noise=spread)
            fit = look(problem, guesses, noise=spread, say=tell)
        elif model == "auto" and problem.work * USUAL_EVALUATIONS > PATIENCE:
            skipped.append(kind)
            continue
        else:
            fit = follow(problem, lead, guesses, noise=spread, say=tell)
        if kind in kinds:
            fit = refined(fit, known_noise=noise is not None, fixed_steps=refine is not None, say=tell)
            found.append(Candidate(fit, uncertainty(fit)))
        lead = fit if lead is None else lead
    assert lead is not None
    return with_findings(assemble(best_of(found), found, skipped, lead.starts), logs, findings)


def _kinds(model: str, patch: ContactPatch, names: Sequence[str]) -> tuple[str, ...]:
    """Names of the models to fit: of patches that follow their load only the published one knows how."""
    follows = patch.depends_on_load or any(name in known.SOFT_FINGER for name in names)
    if follows and model not in ("auto", MODELS[0]):
        rule = f"be {MODELS[0]!r} if the patch changes with the load"
        raise InvalidValueError("model", rule, model)
    if follows:
        return MODELS[:1]
    return MODELS if model == "auto" else (model,)


def guessed_law(values: Mapping[str, float]) -> LuGre:
    """The law that a search without data would begin with, for values by name; usual ones where there are none."""
    return _start_law(values, ElastoPlastic(0.9))[0]


def _start_law(start: Any, elasto_plastic: ElastoPlastic | float | None) -> tuple[LuGre, dict[str, float] | None]:
    """The law that holds what is not estimated, and the values given by name (None: a whole law was given)."""
    if type(start) is LuGre:
        return start, None
    if not isinstance(start, Mapping | None):
        raise InvalidValueError("start", "be a LuGre law or a table of its parameters", start)
    given = {} if start is None else dict(start)
    for name, value in given.items():
        validation.choice("start", name, known.LAW)
        given[name] = validation.number(f"start[{name!r}]", value)
    if "breakaway_ratio" in given:
        elasto_plastic = ElastoPlastic(given["breakaway_ratio"])
    fields = {name: value for name, value in given.items() if name != "breakaway_ratio"}
    if "mu_s" not in fields:
        fields["mu_s"] = max(START_MU_S, fields.get("mu_c", LuGre.mu_c))
    if "mu_s" in fields and "mu_c" not in fields:
        fields["mu_c"] = min(LuGre.mu_c, fields["mu_s"])
    return LuGre(**fields, elasto_plastic=elasto_plastic), given
