"""`identify_lugre`: the friction law and the shape of a contact from logs of its motion and its wrench."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.identify import parameters as known
from planarfriction.identify.checks import check_logs, with_findings
from planarfriction.identify.fitted import assemble
from planarfriction.identify.guess import guess_starts
from planarfriction.identify.least_squares import Minimum, minimise
from planarfriction.identify.logs import Log, as_logs
from planarfriction.identify.parameters import Coordinates
from planarfriction.identify.problem import Problem, first_noise, given_noise
from planarfriction.identify.result import Identification
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import LimitSurface, LimitSurfaceTablePublished
from planarfriction.patch import ContactPatch
from planarfriction.patch.metric import refuse_anisotropy

BEGINS = ("rest", "steady")

START_MU_S = 1.2
"""Static coefficient that a search starts with unless it is told otherwise: above `mu_c`, free to move."""

NOISE_ROUNDS = 2
"""Times that the noise is estimated from the residuals, each with a fit after it."""


def identify_lugre(
    log: Log | Sequence[Log],
    patch: ContactPatch,
    *,
    parameters: Sequence[str] = known.USUAL,
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
    """Estimate parameters of the reduced LuGre model from logs of twist and wrench.

    Bounded nonlinear least squares over the wrenches of the fixed-step roll-out, with exact derivatives of that
    roll-out; residuals over the noise, parameters as logarithms where they must be > 0.

    Parameters
    ----------
    log
        One log or several of the same contact.
    patch
        The contact. Its shape and centre of pressure are taken as known, its size only as a start where
        `contact_radius` is asked for. For soft-finger constants its pressure is a `SoftFinger` and the load of each
        log is constant.
    parameters
        Names of what to estimate: fields of `LuGre`, `breakaway_ratio`, `contact_radius`, `centre_x`, `centre_y`, and
        `c`, `n`, `k` or `k_per_newton` of a `SoftFinger`. What is not named keeps the value of `start`.
    start
        Where to begin, and the values of what is held: a law, or values by name. What is missing is guessed.
    elasto_plastic
        Kind of bristles (of a `start` that is a law: its own).
    surface
        Class of the limit surface.
    noise
        Spread of the measured fx, fy [N] and tau [N m]; None estimates each from the residuals.
    begins
        "rest": every log begins with relaxed bristles. "steady": with those of long sliding at its first twist.
    refine
        Steps between two samples; None doubles them until more move no estimate by a fifth of its error.
    starts, seed
        Number of starts, and the seed that scatters them.
    progress
        Called with a text now and then.

    Raises
    ------
    InvalidValueError
        A parameter breaks its rule.
    """
    logs, names = as_logs(log), known.check_names(parameters)
    if not isinstance(patch, ContactPatch):
        raise InvalidValueError("patch", "be a ContactPatch", type(patch).__name__)
    refuse_anisotropy(patch, "identify_lugre")
    validation.choice("begins", begins, BEGINS)
    starts = validation.count("starts", starts)
    findings = check_logs(logs, patch, names)
    law, given = _start_law(start, elasto_plastic)
    problem = Problem(
        logs, patch, names, law, surface, begins, 1 if refine is None else validation.count("refine", refine)
    )
    say = (lambda text: None) if progress is None else progress
    say("looking for starts")
    spread = first_noise(logs) if noise is None else given_noise(noise)
    candidates = guess_starts(problem, given, starts=starts, seed=validation.count("seed", seed, 0), noise=spread)
    coordinates = Coordinates(names, candidates[0], law.mu_c)
    points = [coordinates.of(each) for each in candidates]
    minimum = minimise(problem.residuals(coordinates, spread), points, coordinates.bounds(), progress=progress)
    agreement = (minimum.agreeing, len(points))
    minimum, spread = _settled(problem, coordinates, minimum, spread, noise is None)
    while refine is None and problem.coarse(coordinates.values(minimum.x), spread):
        problem.refine_twice()
        say(f"{problem.refine} steps between two samples")
        minimum, spread = _settled(problem, coordinates, minimum, spread, noise is None)
    return with_findings(assemble(problem, coordinates, minimum, spread, agreement), logs, findings)


def _settled(problem, coordinates, minimum, noise, unknown: bool) -> tuple[Minimum, np.ndarray]:
    """The minimum from a minimum, with the noise that its residuals have if that is `unknown`."""
    for _ in range(NOISE_ROUNDS if unknown else 1):
        if unknown:
            noise = problem.noise(coordinates.values(minimum.x))
        minimum = minimise(problem.residuals(coordinates, noise), [minimum.x], coordinates.bounds())
    return minimum, noise


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
