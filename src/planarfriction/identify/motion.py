"""`identify_motion`: friction from motion alone, using slides that come to rest."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.identify.least_squares import correlations, covariance, minimise
from planarfriction.identify.outliers import contradictions, verdicts_on_slides, weights
from planarfriction.identify.parameters import Coordinates, check_names
from planarfriction.identify.result import Identification, Verdict, verdicts_on_turns
from planarfriction.identify.slides import (
    Slide,
    SlidingBody,
    as_slides,
    improve_start,
    slide_poses,
    start_of,
    start_slopes,
)
from planarfriction.identify.verdicts import NO_SPIN, TOGETHER, VAGUE
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.models import ReducedModelPublished
from planarfriction.patch import ContactPatch
from planarfriction.patch.metric import refuse_anisotropy

MOTION_PARAMETERS = ("mu_c", "mu_s", "v_s", "gamma", "sigma_2", "contact_radius")
"""What slides can determine; `mu_s` follows `mu_c` where it is not asked for."""

DRY = LuGre(mu_c=0.3, mu_s=0.3, v_s=1e-3, sigma_0=1e6, sigma_1=20.0, sigma_2=0.0, elasto_plastic=ElastoPlastic(0.9))
"""Dry friction with bristles so stiff that only the coefficient counts."""

CHANNELS = (("x", "m"), ("y", "m"), ("theta", "rad"))

FIRST_NOISE = 1e-3
"""Spread of the positions in the first fit [m]; of the angles this over the contact radius."""

NOISE_ROUNDS, MOST_ROUNDS = 2, 8
"""Times that noise and weights are estimated from the residuals, each with a fit after it: more until they settle."""

SETTLED = 0.02
"""Change of a weight that asks for no other round."""

TOLERANCE = 1e-4
"""The search ends when coordinates or cost change by less than this share: far below the standard errors."""

CHANGE = 0.01
"""Share of a parameter that derivatives are taken over (at least of its start).

Differences, not `scene_sensitivities`: for slides this short and tolerances this loose those take four times as long
through a table and as long through an ellipsoid, and they know neither v_s nor sigma_2.
"""

Build = Callable[..., Any]
"""Makes a friction model from a patch and a law."""


def identify_motion(
    slides: Slide | Sequence[Slide],
    patch: ContactPatch,
    body: SlidingBody,
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
        A parameter breaks its rule.
    """
    slides = as_slides(slides)
    names = check_names(parameters, MOTION_PARAMETERS)
    if not isinstance(body, SlidingBody):
        raise InvalidValueError("body", "be a SlidingBody", body)
    if type(start) is not LuGre:  # a subclass may compute something else from the parameters that are fitted
        raise InvalidValueError("start", "be a LuGre law", start)
    validation.instance("patch", patch, ContactPatch, "a ContactPatch")
    refuse_anisotropy(patch, "identify_motion")
    if samples is not None:
        samples = validation.count("samples", samples, at_least=5)
    robust = validation.choice("loss", loss, ("robust", "squares")) == "robust"
    strange = contradictions(slides, body) if robust else {}
    if 2 * len(strange) >= len(slides):
        strange = {}  # where most are strange, none is: the fit itself will be poor
    left_out = {slides[i].name: why for i, why in strange.items()}
    slides = tuple(slide for i, slide in enumerate(slides) if i not in strange)
    fit = _Fit(slides, patch, body, names, start, model, samples, progress)
    values = fit.start_values()
    coordinates = Coordinates(names, values, start.mu_c)
    x, noise = coordinates.of(values), np.array([FIRST_NOISE, FIRST_NOISE, FIRST_NOISE / patch.contact_radius()])
    for turn in range(MOST_ROUNDS + 1):
        known = fit.weights
        if turn > 0:
            offs = fit.offs(coordinates.values(x))
            if robust:
                fit.weights = weights(np.array([np.sqrt(np.mean((off / noise) ** 2)) for off in offs]))
            noise = fit.spread(offs)
        minimum = minimise(fit.residuals(coordinates, noise), [x], coordinates.bounds(), tolerance=TOLERANCE)
        x = minimum.x
        if turn >= NOISE_ROUNDS and np.abs(fit.weights - known).max() < SETTLED:
            break
    return fit.result(coordinates, minimum, noise, left_out)


class _Fit:
    """Slides with their starts, which are estimated along with the parameters."""

    def __init__(self, slides, patch, body, names, law, build, samples, progress):
        self.slides, self.patch, self.body, self.names = slides, patch, body, names
        self.law, self.build, self.samples = law, build, samples
        self.say = (lambda text: None) if progress is None else progress
        self.starts: list[np.ndarray] = [start_of(slide) for slide in slides]
        self.weights = np.ones(len(slides))
        self._turns = 3  # of the first evaluation; later ones begin where the last one ended

    def start_values(self) -> np.ndarray:
        """Values `[F]` of the names in the start."""
        radius = float(self.patch.contact_radius())
        return np.array([radius if name == "contact_radius" else getattr(self.law, name) for name in self.names])

    def fitted_law(self, values: np.ndarray) -> LuGre:
        """The law with the values."""
        given = dict(zip(self.names, values.tolist(), strict=True))
        given.pop("contact_radius", None)
        mu_c = given.get("mu_c", self.law.mu_c)
        given["mu_s"] = max(given.get("mu_s", mu_c if "mu_c" in given else self.law.mu_s), mu_c)
        return dataclasses.replace(self.law, **given)

    def fitted_model(self, values: np.ndarray) -> Any:
        """The friction model with the values."""
        patch = self.patch
        if "contact_radius" in self.names:
            centre = patch.centre_of_pressure()
            scale = values[self.names.index("contact_radius")] / patch.contact_radius()
            positions = centre + scale * (patch.positions - centre)
            patch = ContactPatch(positions, scale**2 * patch.areas, patch.weights() / patch.areas, None, patch.name)
        return self.build(patch, self.fitted_law(values))

    def spread(self, offs: Sequence[np.ndarray]) -> np.ndarray:
        """Spread of the residuals of each channel `[3]`; that of x and y is the same."""
        counts = np.array([len(slide.time) for slide in self.slides])
        total = 3 * float(self.weights @ counts)
        free = total / max(total - len(self.names) - 6 * float(self.weights.sum()), 1.0)
        each = np.array([np.sum(off**2, axis=0) for off in offs])
        squares = free * (self.weights @ each) / (self.weights @ counts)
        across = np.sqrt(0.5 * (squares[0] + squares[1]))
        return np.maximum([across, across, np.sqrt(squares[2])], 1e-9)

    def offs(self, values: np.ndarray) -> list[np.ndarray]:
        """Measured minus simulated poses of each slide `[T, 3]`."""
        model, both = self.fitted_model(values), zip(self.slides, self.starts, strict=True)
        return [slide.pose - slide_poses(model, self.body, slide.time, s[:3], s[3:]) for slide, s in both]

    def residuals(self, coordinates: Coordinates, noise: np.ndarray):
        """Function of the coordinates: residuals at the best starts and their derivatives with the starts free."""

        def evaluate(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            offs, slopes = self.weighted(*self.linearised(coordinates.values(x), noise))
            pull, per_pull = coordinates.prior(x)
            return np.concatenate([*offs, pull]), np.concatenate(
                [np.concatenate(slopes) @ coordinates.slopes(x), per_pull]
            )

        return evaluate

    def weighted(self, offs: list[np.ndarray], slopes: list[np.ndarray]) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Residuals and derivatives of each slide with the root of its weight."""
        roots = np.sqrt(self.weights)
        pairs = zip(roots, offs, slopes, strict=True)
        both = [(root * off, root * slope) for root, off, slope in pairs]
        return [off for off, _ in both], [slope for _, slope in both]

    def linearised(self, values: np.ndarray, noise: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Scaled residuals `[3 T]` of each slide and derivatives `[3 T, F]`, the start of each following."""
        model = self.fitted_model(values)
        changes = CHANGE * np.maximum(np.abs(values), np.abs(self.start_values()) + 1e-2 * (values == 0.0))
        changed = [
            self.fitted_model(values + change * row) for change, row in zip(changes, np.eye(len(values)), strict=True)
        ]
        offs, slopes = [], []
        for i, slide in enumerate(self.slides):
            if i % 20 == 0:
                self.say(f"slide {i + 1} of {len(self.slides)}, " + ", ".join(f"{v:.4g}" for v in values))
            if self._turns > 0:
                part = slide if self.samples is None else slide.first(self.samples)
                self.starts[i] = improve_start(model, self.body, part, self.starts[i], noise, self._turns)
            start = self.starts[i]
            poses, of_start = start_slopes(model, self.body, slide, start)
            of_values = [
                (slide_poses(each, self.body, slide.time, start[:3], start[3:]) - poses) / change
                for each, change in zip(changed, changes, strict=True)
            ]
            off = ((poses - slide.pose) / noise).ravel()
            slope = (np.stack(of_values, -1) / noise[:, None]).reshape(len(off), -1)
            # The start answers to every change: q' = -B+ (off, slope) with B of the poses it is estimated from.
            basis = (of_start / noise[:, None]).reshape(len(off), 6)
            known = None if self.samples is None else 3 * self.samples
            answer = np.linalg.lstsq(basis[:known], np.column_stack([off, slope])[:known], rcond=None)[0]
            self.starts[i] = start - answer[:, 0]
            offs.append(off - basis @ answer[:, 0])
            slopes.append(slope - basis @ answer[:, 1:])
        self._turns = 0
        return offs, slopes

    def result(self, coordinates: Coordinates, minimum, noise: np.ndarray, left_out: dict[str, str]) -> Identification:
        values = coordinates.values(minimum.x)
        offs, slopes = self.linearised(values, noise)
        plain = np.array([np.sqrt(np.mean(off**2)) for off in offs])
        offs, slopes = self.weighted(offs, slopes)
        spread = self._covariance(offs, slopes, ~minimum.at_bound)
        votes = np.stack([slope.T @ off for off, slope in zip(offs, slopes, strict=True)])
        alone = covariance(np.concatenate(slopes), ~minimum.at_bound)
        moved = votes @ alone if np.isfinite(alone).all() else np.zeros_like(votes)
        errors, together = np.sqrt(np.diag(spread)), correlations(spread)
        model = self.fitted_model(values)
        histories = []
        for slide, start in zip(self.slides, self.starts, strict=True):
            poses = slide_poses(model, self.body, slide.time, start[:3], start[3:])
            histories.append(
                {"name": slide.name, "time": slide.time, "measured": slide.pose, "predicted": poses, "start": start}
            )
        return Identification(
            names=self.names,
            values=values,
            standard_errors=errors,
            correlations=together,
            verdicts=(
                *self._verdicts(values, errors, together, minimum.at_bound),
                *verdicts_on_slides(
                    left_out, plain / np.median(plain), self.weights, self.slides, moved, self.names, errors
                ),
            ),
            noise=noise,
            channels=CHANNELS,
            histories=tuple(histories),
            law=self.fitted_law(values),
            model=model,
            starts=(minimum.agreeing, 1),
        )

    def _covariance(self, offs, slopes, free) -> np.ndarray:
        """Covariance `[F, F]` in which each slide votes as one: `H^-1 (sum g g') H^-1 n/(n - 1)`, vote `g = J' r`."""
        plain = covariance(np.concatenate(slopes), free)
        if np.count_nonzero(self.weights) < 2 or not np.isfinite(plain).all():
            return plain
        votes = np.stack([slope.T @ off for off, slope in zip(offs, slopes, strict=True)])
        return plain @ (votes.T @ votes) @ plain * len(votes) / (len(votes) - 1)

    def _verdicts(self, values, errors, together, at_bound) -> tuple[Verdict, ...]:
        verdicts = []
        starts = np.stack(self.starts)
        speed = np.hypot(starts[:, 3], starts[:, 4])
        spin = float(self.patch.contact_radius()) * np.abs(starts[:, 5])
        for i, name in enumerate(self.names):
            vague = not errors[i] < VAGUE * abs(values[i])
            row = np.abs(together[i]) * (np.arange(len(values)) != i)
            other = int(np.argmax(row))
            if at_bound[i]:
                verdicts.append(Verdict(name, False, f"the fit ran into the bound {values[i]:.3g}"))
            elif name == "contact_radius" and np.sqrt(np.mean(spin**2)) < NO_SPIN * np.sqrt(np.mean(speed**2)):
                verdicts.append(Verdict(name, False, "no spin"))
            elif row[other] > TOGETHER:
                text = f"cannot be separated from {self.names[other]} (correlation {together[i, other]:.2f})"
                verdicts.append(Verdict(name, not vague or name == "sigma_2", text))
            elif name == "sigma_2" and values[i] < 1.96 * errors[i]:
                verdicts.append(
                    Verdict(
                        name, True, f"cannot be distinguished from 0, at most {values[i] + 1.96 * errors[i]:.3g} s/m"
                    )
                )
            elif vague and name != "sigma_2":
                verdicts.append(
                    Verdict(name, False, f"standard error {100 * errors[i] / abs(values[i]):.0f} % of the estimate")
                )
        count = int((self.weights > 0.0).sum())
        if count < 10:
            verdicts.append(Verdict("fit", False, f"the errors come from only {count} slides"))
        return (*verdicts, *verdicts_on_turns(self.slides))
