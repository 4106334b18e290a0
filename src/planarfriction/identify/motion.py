"""`identify_motion`: friction from motion alone, using slides that come to rest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.identify.checks import check_slides
from planarfriction.identify.logs import Arrays, Linear, as_tuple
from planarfriction.identify.parameters import (
    check_names,
    check_patch,
    fitted_law,
    scaled_patch,
)
from planarfriction.identify.problem import LeastSquaresProblem
from planarfriction.identify.result import Identification
from planarfriction.identify.search import interruptible, multistart, refine
from planarfriction.identify.slides import (
    MassProperties,
    Slide,
    contradictions,
    improve_start,
    slide_poses,
    start_of,
    start_slopes,
    verdicts_on_influence,
    verdicts_on_weights,
    weights,
)
from planarfriction.identify.uncertainty import (
    Fit,
    correlations,
    uncertainty_over_slides,
)
from planarfriction.identify.verdicts import (
    Evidence,
    Verdict,
    caution,
    judge_parameter,
    verdicts_on_turns,
)
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.models import ReducedModelPublished
from planarfriction.patch import ContactPatch

MOTION_PARAMETERS = ("mu_c", "mu_s", "v_s", "gamma", "sigma_2", "contact_radius")
"""Parameters that slides can determine; `mu_s` equals `mu_c` if only the latter is estimated."""

DRY = LuGre(
    mu_c=0.3,
    mu_s=0.3,
    v_s=1e-3,
    sigma_0=1e6,
    sigma_1=20.0,
    sigma_2=0.0,
    elasto_plastic=ElastoPlastic(0.9),
)
"""Dry friction with bristles so stiff that only the coefficient counts."""

CHANNELS = (("x", "m"), ("y", "m"), ("theta", "rad"))
"""Names and units of the measured channels of a slide."""

FIRST_NOISE = 1e-3
"""Noise of positions in the first fit [m], of angles over the contact radius."""

LEAST_NOISE = 1e-9
"""Least noise of a channel [m, rad]."""

CHANGE = 0.01
"""Step of difference quotients as a share of a parameter (at least of its start).

Differences, not `scene_sensitivities`: for slides this short and tolerances this loose those take four times as long
through a table and as long through an ellipsoid, and they know neither v_s nor sigma_2.
"""

FEW = 10
"""Number of slides below which their spread gives only a rough error."""

FADING = np.linspace(1.0, 0.0, 50)
"""Speeds of a slide until it rests, over its first speed."""

Build = Callable[..., Any]
"""Function that makes a friction model from a patch and a law."""


def identify_motion(
    slides: Slide | Sequence[Slide],
    patch: ContactPatch,
    body: MassProperties,
    *,
    parameters: Sequence[str] = ("mu_c", "contact_radius"),
    start: LuGre = DRY,
    model: Build = ReducedModelPublished,
    samples: int | None = None,
    loss: Literal["robust", "squares"] = "robust",
    progress: Callable[[str], None] | None = None,
) -> Identification:
    """Estimate friction from slides that come to rest, without a force sensor.

    Every slide is simulated with the structured solver. Its initial state (pose and twist, six numbers) is estimated
    together with the parameters, so that a noisy first velocity does no harm: from all of its poses, or from the first
    `samples` of them, which makes the rest of the slide a prediction. Friction is observed through accelerations: mu as
    `mu g`, the contact radius as `mu m g r/inertia`.

    Standard errors come from the spread over the slides, each of which counts as one observation. They are therefore
    valid although the residuals within a slide are correlated and friction differs from slide to slide. Ten slides or
    more are needed for meaningful errors.

    Parameters
    ----------
    slides
        The measured slides.
    patch
        The contact, with the origin of its frame at the centre of mass. If `contact_radius` is estimated, its size is
        the initial guess, and the patch is scaled about its centre of pressure.
    body
        Mass, inertia and gravity.
    parameters
        Some of mu_c, mu_s, v_s, gamma, sigma_2, contact_radius.
    start
        Initial guess, and the values of parameters that are not estimated. Its bristles should be stiff.
    model
        Makes the friction model from a patch and a law, as `ReducedModelPublished` and `DistributedModel` do.
    samples
        Number of poses from which the initial state of a slide is estimated, at least five; None takes all.
    loss
        "robust" leaves out slides that friction alone cannot explain (they speed up, or keep their speed) and those
        whose residuals exceed 6 times those of the median slide, and gives less weight to those above 2.5 times;
        "squares" treats all slides alike. The verdicts name the slides left out, and the slide that changes an estimate
        most.
    progress
        Called with a text from time to time.

    Raises
    ------
    InvalidValueError
        A parameter breaks its rule; times in ms, places in mm or angles in deg; a tracker that froze.
    IdentificationInterrupted
        Ctrl-C, with the best values so far.
    """
    slides = as_tuple("slides", slides, Slide)
    names = check_names(parameters, MOTION_PARAMETERS)
    validation.instance("body", body, MassProperties, "MassProperties")
    # A subclass may compute something else from the parameters that are fitted.
    if type(start) is not LuGre:
        raise InvalidValueError("start", "be a LuGre law", start)
    check_patch(patch, "identify_motion")
    if samples is not None:
        samples = validation.count("samples", samples, at_least=5)
    robust = validation.choice("loss", loss, ("robust", "squares")) == "robust"
    findings = check_slides(slides, patch, body)
    found = [Verdict("fit", False, str(finding)) for finding in findings]
    found += [Verdict(name, False, "a unit is doubtful") for name in names if findings]
    strange = contradictions(slides, body) if robust else {}
    for i, why in strange.items():
        found.append(caution(f"{slides[i].name} is left out: {why}"))
    slides = tuple(slide for i, slide in enumerate(slides) if i not in strange)
    problem = SlideProblem(slides, patch, body, names, start, model, samples, robust)
    problem.progress = progress
    noise = FIRST_NOISE / np.array([1.0, 1.0, patch.contact_radius()])
    with interruptible([problem]):
        fit = refine(multistart(problem, [problem.start_values()], noise))
        return _identification(fit, found)


@dataclass(eq=False)
class SlideProblem(LeastSquaresProblem):
    """Slides and a model that predicts their poses; the start of each slide follows the values.

    Noise is that of the channels of each slide, `[S, 3]`: slides with large residuals count as noisier.
    """

    slides: Sequence[Slide]
    patch: ContactPatch
    body: MassProperties
    names: tuple[str, ...]
    law: LuGre
    build: Build
    samples: int | None
    robust: bool

    least_change = 1e-4
    """Cost change far below the standard errors, and above the errors of the solver."""

    def __post_init__(self) -> None:
        self.starts = [start_of(slide) for slide in self.slides]
        lengths = [len(slide.time) for slide in self.slides]
        self.owner = np.repeat(np.arange(len(lengths)), lengths)
        # Of the first evaluation; later ones begin where the last one ended.
        self._turns = 3

    @property
    def numbers(self) -> int:
        return 3 * len(self.owner)

    def start_values(self) -> np.ndarray:
        """Return the values `[F]` of the names in the start."""
        start = vars(self.law) | {"contact_radius": self.patch.contact_radius()}
        return np.array([start[name] for name in self.names], dtype=float)

    def fitted_law(self, values: np.ndarray) -> LuGre:
        """Return the law with values `[F]`; `mu_s` equals `mu_c` if only the latter is estimated."""
        given = self.by_name(values)
        if "mu_c" in given:
            given.setdefault("mu_s", given["mu_c"])
        return fitted_law(self.law, given)

    def fitted_model(self, values: np.ndarray) -> Any:
        """Make the friction model with values `[F]`."""
        patch = self.patch
        radius = self.by_name(values).get("contact_radius")
        if radius is not None:
            patch = scaled_patch(patch, radius / patch.contact_radius())
        return self.build(patch, self.fitted_law(values))

    def poses(self, values: np.ndarray) -> Arrays:
        """Simulate the poses `[T, 3]` of each slide from its best start so far."""
        model = self.fitted_model(values)
        both = zip(self.slides, self.starts, strict=True)
        return [
            slide_poses(model, self.body, slide.time, start) for slide, start in both
        ]

    def even_sigma(self, noise: np.ndarray) -> np.ndarray:
        return np.broadcast_to(noise, (len(self.slides), 3))[self.owner]

    def estimate_noise(self, values: np.ndarray, noise: np.ndarray) -> Linear:
        """Estimate the noise `[S, 3]`, equal for x and y, from the residuals at `values`, and sigma of each sample."""
        both = zip(self.slides, self.poses(values), strict=True)
        residuals = [slide.pose - poses for slide, poses in both]
        weighed = np.ones(len(self.slides))
        if self.robust:
            before = np.atleast_2d(noise).min(axis=0)
            sizes = [np.sqrt(np.mean((each / before) ** 2)) for each in residuals]
            weighed = weights(np.array(sizes))
        numbers = 3.0 * weighed @ [len(slide.time) for slide in self.slides]
        unknown = len(self.names) + 6.0 * weighed.sum()
        squares = weighed @ [np.sum(each**2, axis=0) for each in residuals]
        squares = 3.0 * squares / max(numbers - unknown, 1.0)
        across = 0.5 * (squares[0] + squares[1])
        channels = np.sqrt([across, across, squares[2]])
        with np.errstate(divide="ignore"):
            noise = np.maximum(channels, LEAST_NOISE) / np.sqrt(weighed)[:, None]
        return noise, self.even_sigma(noise)

    def linearised(self, values: np.ndarray, sigma: np.ndarray) -> Linear:
        """Compute the residuals over `sigma`, `[M]`, at the best starts, and derivatives `[M, F]` with the starts free.

        The start answers every change: `q' = -B^+ (r, J)` with B of the poses from which it is estimated.
        """
        noise = sigma.min(axis=0)
        model = self.fitted_model(values)
        least = np.abs(self.start_values()) + 1e-2 * (values == 0.0)
        changes = CHANGE * np.maximum(np.abs(values), least)
        changed = [self.fitted_model(values + row) for row in np.diag(changes)]
        rows = []
        for i, slide in enumerate(self.slides):
            if i % 20 == 0:
                self.report(
                    f"slide {i + 1} of {len(self.slides)}, "
                    + ", ".join(f"{v:.4g}" for v in values)
                )
            if self._turns:
                part = slide if self.samples is None else slide.first(self.samples)
                self.starts[i] = improve_start(
                    model, self.body, part, self.starts[i], noise, self._turns
                )
            start = self.starts[i]
            poses, of_start = start_slopes(model, self.body, slide, start)
            of_values = [
                slide_poses(each, self.body, slide.time, start) for each in changed
            ]
            slopes = (np.stack(of_values, -1) - poses[..., None]) / changes
            both = np.dstack([poses - slide.pose, slopes]) / noise[:, None]
            both = both.reshape(-1, both.shape[-1])
            basis = (of_start / noise[:, None]).reshape(-1, 6)
            known = None if self.samples is None else 3 * self.samples
            answer = np.linalg.lstsq(basis[:known], both[:known], rcond=None)[0]
            self.starts[i] = start - answer[:, 0]
            rows.append(both - basis @ answer)
        self._turns = 0
        whole = np.concatenate(rows) * (noise / sigma).reshape(-1, 1)
        return whole[:, 0], whole[:, 1:]


def _identification(fit: Fit, left_out: Sequence[Verdict]) -> Identification:
    """Make the result of a fit of slides."""
    problem = fit.problem
    names = problem.names
    slides = problem.slides
    noise = fit.noise.min(axis=0)
    covariance, moved, jacobian = uncertainty_over_slides(fit)
    errors = np.sqrt(np.diag(covariance))
    together = correlations(covariance)
    poses = problem.poses(fit.values)
    twists = np.abs(problem.starts)[:, 3:]
    evidence = Evidence(
        names=names,
        values=fit.values,
        errors=errors,
        correlations=together,
        at_bound=fit.at_bound,
        jacobian=jacobian,
        speeds=np.outer(np.hypot(twists[:, 0], twists[:, 1]), FADING).ravel(),
        spins=np.outer(problem.patch.contact_radius() * twists[:, 2], FADING).ravel(),
        loads=np.array([problem.body.mass * problem.body.gravity]),
    )
    weighed = np.min((noise / fit.noise) ** 2, axis=1)
    found = [judge_parameter(evidence, i) for i in range(len(names))]
    # Its spread over few slides may be small by chance.
    if "contact_radius" in names and not evidence.spinning:
        at = names.index("contact_radius")
        found[at] = Verdict("contact_radius", False, "no spin")
    if (count := np.count_nonzero(weighed)) < FEW:
        found.append(Verdict("fit", False, f"the errors come from only {count} slides"))
    histories = [
        {
            "name": slide.name,
            "time": slide.time,
            "measured": slide.pose,
            "predicted": predicted,
            "start": start,
        }
        for slide, start, predicted in zip(slides, problem.starts, poses, strict=True)
    ]
    left = [
        np.sqrt(np.mean(((each["measured"] - each["predicted"]) / noise) ** 2))
        for each in histories
    ]
    samples = sum(len(slide.time) for slide in slides)
    return Identification(
        names=names,
        values=fit.values,
        standard_errors=errors,
        correlations=together,
        verdicts=(
            *filter(None, found),
            *verdicts_on_turns(slides),
            *left_out,
            *verdicts_on_weights(slides, weighed, left / np.median(left)),
            *verdicts_on_influence(slides, moved, names, errors),
        ),
        noise=noise,
        channels=CHANNELS,
        histories=tuple(histories),
        law=problem.fitted_law(fit.values),
        model=problem.fitted_model(fit.values),
        starts=fit.starts,
        samples=(samples, samples),
    )
