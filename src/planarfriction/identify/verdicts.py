"""Verdicts on a fit and on its parameters: which ones the data do not determine, and why.

Each rule names the parameter and what is missing in the data.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from planarfriction._support.described import described
from planarfriction.identify.decimation import samples_of
from planarfriction.identify.logs import TWO_LOADS, Log
from planarfriction.identify.parameters import ALL, SOFT_FINGER, bristles_of
from planarfriction.identify.problem import SPOILED
from planarfriction.identify.sensor_errors import CHANNELS
from planarfriction.identify.uncertainty import HELD_OUT, STRAIN, Fit, Pull, Uncertainty

TWO_SIDED = 1.96
"""Standard errors on either side of the estimate that hold 95 % of a normal distribution."""

VAGUE = 0.3
"""Standard error, as a share of the estimate, above which a parameter that must be > 0
counts as unknown."""

WELL = 0.02
"""Standard error, as a share of the estimate, below which its correlations do not
matter."""

TOGETHER = 0.98
"""Correlation above which two parameters cannot be separated."""

UNSEEN = 1.0
"""Change of a sample, over the noise, that the whole size of a parameter must make in order to be seen."""

OF_TORQUE = ("contact_radius", "centre_x", "centre_y", *SOFT_FINGER)
"""Parameters that change the force only if the contact spins while it slides."""

GAP = 3.0
"""Ratio of sliding speeds without a sample between them that counts as a gap."""

NARROW = 10.0
"""Ratio of the fastest to the slowest sliding, but for 2 % at either end, below which
no Stribeck curve shows."""

NO_SPIN = 0.02
"""Share of the sliding speed that comes from spin below which there is none."""

ONE_LOAD = 1.05
"""Ratio of the largest to the smallest load below which there is one load only."""

SLIPPED = 12.0
"""Growth of the cost (half the sum of squares) without slip below which the data hold none: 5 standard errors."""

LEANING = 2.0
"""Standard deviations a priori of a disturbance above which a fit leans on it."""

MOVED = 2.0
"""Standard errors by which a held parameter that the residuals deny may move an
estimate."""

SAME = 1.001
"""Ratio of mu_s to mu_c below which they are the same."""

CORRELATED = 0.3
"""Correlation of neighbouring residuals above which they are no noise."""


@described
@dataclass(frozen=True)
class Verdict:
    """Finding about one parameter, or about the fit as a whole (`parameter` is then "fit")."""

    parameter: str
    """Name of the parameter, or "fit"."""
    identifiable: bool
    """True if the data determine the parameter; for the fit, if nothing is wrong."""
    reason: str
    """Reason why the data do not, or a caution."""

    def __str__(self) -> str:
        if self.parameter == "fit":
            return f"fit: {self.reason}"
        return f"{self.parameter}: {'' if self.identifiable else 'not identifiable, '}{self.reason}"


def caution(text: str) -> Verdict:
    """Return a verdict on the fit as a whole that is no reason to doubt it."""
    return Verdict("fit", True, text)


def verdicts_on_samples(logs: Sequence[Log]) -> list[Verdict]:
    """Return a verdict that says how many samples were used, if some were not."""
    used, total = samples_of(logs)
    if used == total:
        return []
    windows = sum(len(log.parts) for log in logs)
    text = f"of {total:,} samples, {used:,} were used: {windows} windows in which motion, load and friction differ most"
    steps = "between them the model follows the motion in longer steps"
    return [caution(f"{text}; {steps}")]


def verdicts_on_turns(measured: Sequence[Any]) -> list[Verdict]:
    """Return a verdict that counts the jumps by full rotations which were removed from the angles of logs or slides."""
    turned = {each.name: each.turns for each in measured if each.turns}
    if not turned:
        return []
    count = f"{sum(turned.values())} jumps of theta by a full rotation were removed"
    return [caution(f"{count}, in {few_of([*turned], 3)}")]


def few_of(names: Sequence[str], most: int) -> str:
    """Return names in one line, with dots after `most` of them."""
    return f"{', '.join(names[:most])}{' ...' if len(names) > most else ''}"


def interval(name: str, value: float, error: float) -> tuple[float, float]:
    """Compute the 95 % interval [SI]: symmetric as factors for parameters that are > 0, else as differences."""
    if ALL[name].logarithmic and value > 0.0:
        with np.errstate(over="ignore"):
            factor = np.exp(TWO_SIDED * error / value)
        return float(value / factor), float(value * factor)
    half = TWO_SIDED * error
    return max(float(value - half), ALL[name].low), float(value + half)


# ---------------------------------------------------------------------- choice of the model


class ModelScore(NamedTuple):
    """Measures of how well one model explains the data."""

    model: str
    """Name of the model, as `identify_lugre` takes it."""
    bristles: str
    """Its kind of bristles, in words."""
    held_out: float
    """Errors on held-out parts over those that the noise explains [-]; 1 is noise alone."""
    reduced_chi2: float
    """Mean square of the residuals over that of the noise [-]."""
    rejected: bool
    """True if the fit leaves more than noise."""
    estimates: dict[str, float]
    """Estimates of the parameters by name [SI]."""

    def __str__(self) -> str:
        return f"{self.model} with {self.bristles}"


class Candidate(NamedTuple):
    """Model that was fitted, with its uncertainty."""

    fit: Fit
    uncertainty: Uncertainty

    @property
    def score(self) -> ModelScore:
        """Measures of how well the model explains the data."""
        problem = self.fit.problem
        u = self.uncertainty
        return ModelScore(
            problem.model,
            bristles_of(problem.law, problem.pad, problem.names),
            u.score,
            u.reduced_chi2,
            u.rejected,
            problem.by_name(self.fit.values),
        )

    def cost(self, sigma: np.ndarray) -> float:
        """Compute half the sum of the squared residuals over `sigma` `[T, 3]`, and of the pulls."""
        fit = self.fit
        pull = fit.coordinates.prior(fit.x)[0]
        return 0.5 * (
            (fit.problem.residual(fit.values, sigma) ** 2).sum() + (pull**2).sum()
        )


def rivals(best: Candidate, candidates: Sequence[Candidate]) -> list[ModelScore]:
    """Return the other candidates that fit: none is rejected, and over the noise of the best one they fit as well."""
    sigma = best.fit.sigma
    most = best.cost(sigma) + SLIPPED
    return [
        each.score
        for each in candidates
        if each is not best
        and not each.uncertainty.rejected
        and each.cost(sigma) < most
    ]


# ---------------------------------------------------------------------- rules


@dataclass(frozen=True)
class Evidence:
    """Estimates and measurements on which the rules decide."""

    names: tuple[str, ...]
    """Names of the parameters, `[F]`."""
    values: np.ndarray
    """Estimates [SI], `[F]`."""
    errors: np.ndarray
    """Standard errors [SI], `[F]`."""
    correlations: np.ndarray
    """Correlations of the estimates, `[F, F]`."""
    at_bound: np.ndarray
    """Mask of the estimates that lie on a bound, `[F]`."""
    jacobian: np.ndarray
    """Derivatives of the scaled residuals, `[M, F]`."""
    speeds: np.ndarray
    """Sliding speeds `|V_S|` of all samples [m/s]."""
    spins: np.ndarray
    """Part of the sliding speeds that comes from spin, `r |omega|` [m/s]."""
    loads: np.ndarray
    """Normal force of each log [N]."""
    load_ratio: float = 1.0
    """Largest load over the least, also within logs [-]."""
    measured: np.ndarray = field(default_factory=lambda: np.full(3, True))
    """Mask of the measured ones of fx, fy, tau, `[3]`."""
    spoiled: int = 0
    """Number of samples that no noise explains."""
    robust: bool = False
    """True if these count little."""
    without_slip: float = np.inf
    """Growth of the cost if the contact may not slip at all."""
    largest_coefficient: float = np.inf
    """Largest friction over load that was fitted [-]."""
    held_mu_c: float = np.inf
    """The mu_c that was not estimated [-]."""

    def value(self, name: str, otherwise: float) -> float:
        """Return the estimate of a parameter, or `otherwise` if it was not estimated."""
        if name not in self.names:
            return otherwise
        return self.values[self.names.index(name)]

    @property
    def gap(self) -> str:
        """Text on the speeds about v_s of which there is no sample, or nothing."""
        return speed_gap(self.speeds, self.value("v_s", 1e-3))

    @property
    def spinning(self) -> bool:
        """True if spin is a part of the sliding."""
        speed = max(np.sqrt(np.mean(self.speeds**2)), 1e-300)
        return bool(np.sqrt(np.mean(self.spins**2)) >= NO_SPIN * speed)


def judge(
    evidence: Evidence,
    best: Candidate,
    candidates: Sequence[Candidate],
    skipped: Sequence[str],
    held: Sequence[Pull],
) -> tuple[Verdict, ...]:
    """Return the verdicts on the fit, then on all parameters: if it is rejected, none of them is identifiable."""
    u = best.uncertainty
    chosen = best.score
    verdicts = [Verdict("fit", not u.rejected, _on_fit(u, chosen))]
    if len(candidates) > 1:
        scores = [each.score for each in candidates if each is not best]
        scores.sort(key=lambda each: each.held_out)
        rest = ", ".join(f"{each}: {each.held_out:.3g}" for each in scores)
        text = f"the prediction error on held-out samples is {chosen.held_out:.3g} times the noise ({rest})"
        verdicts.append(caution(text))
    verdicts += map(caution, _on_data(evidence, u))
    verdicts += (Verdict("fit", each.agrees, str(each)) for each in held)
    if skipped:
        text = f'{" and ".join(skipped)} would take minutes and was not tried: choose it by model="{skipped[0]}"'
        verdicts.append(caution(text))
    others = rivals(best, candidates)
    for i, name in enumerate(evidence.names):
        verdict = judge_parameter(evidence, i)
        if verdict is None or verdict.identifiable:
            error = evidence.errors[i]
            low, high = interval(name, evidence.values[i], error)
            reasons = [
                f"it changes by {each.moves[i]:+.2g} if {each.name} is not fixed"
                for each in held
                if not each.agrees and abs(each.moves[i]) > MOVED * error
            ]
            reasons += [
                f"depends on the model: {each}, which also fits, gives {each.estimates[name]:.3g}"
                for each in others
                if not low <= each.estimates[name] <= high
            ]
            if u.rejected:
                reasons = [
                    f"{chosen.model} does not explain the data, so this value has no meaning"
                ]
            if reasons:
                verdict = Verdict(name, False, reasons[0])
        if verdict is not None:
            verdicts.append(verdict)
    return tuple(verdicts)


def _on_fit(u: Uncertainty, chosen: ModelScore) -> str:
    """Put the test of the fit into words."""
    size = np.sqrt(u.reduced_chi2)
    if not u.rejected:
        return f"{chosen} explains the data: its residuals are {size:.2f} times the noise of the sensors"
    text = []
    if u.reduced_chi2 > u.limit:
        most = f"at most {np.sqrt(u.limit):.2f} times can be chance"
        text.append(
            f"its residuals are {size:.2f} times the noise of the sensors ({most})"
        )
    if u.score > HELD_OUT:
        text.append(
            f"its prediction error on held-out samples is {u.score:.1f} times the noise"
        )
    if u.strain > STRAIN:
        text.append(
            f"it needs {u.strains[0][1]}, {u.strain:.1f} times the usual error of such sensors"
        )
    if u.neighbours > CORRELATED:
        text.append(f"neighbouring residuals are correlated ({u.neighbours:.2f})")
    cause = "The patch, the kind of bristles or the measurement is wrong"
    return f"{chosen} is rejected: {'; '.join(text)}. {cause}, and the intervals are only a rough guide"


def _on_data(evidence: Evidence, u: Uncertainty) -> list[str]:
    """Return cautions: disturbances that a fit leans on, channels that were not measured, spoiled samples, one load."""
    found = []
    if leaning := [
        f"{words} ({size:.1f} times the usual)"
        for size, words in u.strains
        if size > LEANING
    ]:
        found.append(f"the fit needs large sensor errors: {', '.join(leaning)}")
    if not evidence.measured.all():
        both = zip(CHANNELS, evidence.measured, strict=True)
        missing = [name for (name, _), seen in both if not seen]
        text = f"{' and '.join(missing)} {'are' if len(missing) > 1 else 'is'} 0 throughout"
        found.append(
            f"{text}, as without a sensor: the estimates use the other channels alone"
        )
    if evidence.spoiled:
        text = f"{evidence.spoiled} values are off by more than {SPOILED:g} times the noise"
        end = 'the loss "soft_l1" would leave them out'
        found.append(f"{text}: {'they were left out' if evidence.robust else end}")
    if "sigma_0" in evidence.names and evidence.load_ratio < TWO_LOADS:
        stiffness = evidence.value("sigma_0", 0.0) * np.median(evidence.loads)
        text = f"one load only: sigma_0 f_N = {stiffness:.3g} N/m is known"
        found.append(f"{text}, not if the stiffness grows with the load")
    return found


def judge_parameter(evidence: Evidence, i: int) -> Verdict | None:
    """Return the verdict on parameter i, or None if there is nothing to say."""
    name = evidence.names[i]
    value = evidence.values[i]
    error = evidence.errors[i]
    kind = ALL[name]
    doubt = functools.partial(Verdict, name, False)
    if name in ("mu_c", "mu_s", "v_s", "gamma") and evidence.without_slip < SLIPPED:
        return doubt(
            f"the contact never slips, friction reaches {evidence.largest_coefficient:.2g} of the load"
        )
    if name == "mu_s" and "mu_c" in evidence.names:
        c = evidence.names.index("mu_c")
        known = evidence.errors[c] < VAGUE * evidence.values[c]
        if not known and not evidence.at_bound[c]:
            return doubt(
                "mu_c is unknown, as no sample is much faster than v_s, so that this may be mu_c"
            )
    rests_on_zero = kind.low == 0.0 and value <= 1e-6 and not kind.logarithmic
    if evidence.at_bound[i] and not rests_on_zero:
        mu_c = evidence.value("mu_c", evidence.held_mu_c)
        if name == "mu_s" and value <= SAME * mu_c:
            return doubt(
                f"{evidence.gap or 'no friction above mu_c was seen'}: equal to mu_c"
            )
        return doubt(f"the fit ran into the bound {value:.3g} {kind.unit}")
    if name in ("v_s", "gamma") and (reason := _no_stribeck(evidence)):
        return doubt(reason)
    size = abs(value)
    if not (error < VAGUE * size if kind.logarithmic else np.isfinite(error)):
        return doubt(_why(evidence, i))
    half = TWO_SIDED * error
    if name == "sigma_1" and value <= half:
        return doubt(
            "cannot be distinguished from 0, so the corner frequency of the bristles may be above all samples"
        )
    if kind.low == 0.0 and value < half:
        return Verdict(
            name,
            True,
            f"cannot be distinguished from 0, at most {value + half:.3g} {kind.unit}",
        )
    other, correlation = _partner(evidence, i)
    if not other:
        return None
    if not evidence.measured[2] and not {name, other}.isdisjoint(OF_TORQUE):
        text = f"cannot be separated from {other} (correlation {correlation:.2f}) without the torque"
        return doubt(f"{text}, and tau is 0 throughout")
    if error <= WELL * size:
        return None
    return Verdict(name, True, f"strongly correlated with {other} ({correlation:.2f})")


def _why(evidence: Evidence, i: int) -> str:
    """Return the reason why a parameter is vague: a gap in the data, else another parameter, else the noise."""
    name = evidence.names[i]
    if name in ("v_s", "gamma", "mu_s") and (gap := evidence.gap):
        return gap
    if name in ("contact_radius", *SOFT_FINGER) and not evidence.spinning:
        return "no spin"
    one_load = evidence.loads.max() < ONE_LOAD * evidence.loads.min()
    if name in SOFT_FINGER and name != "c" and one_load:
        return "one load only"
    if name in OF_TORQUE and not evidence.measured[2]:
        return "only the torque depends on it, and tau is 0 throughout"
    size = abs(evidence.values[i])
    seen = np.abs(evidence.jacobian[:, i]).max() * size
    if seen < UNSEEN:
        return f"changes no sample by more than {seen:.2g} times the noise"
    other, correlation = _partner(evidence, i)
    if other:
        return f"cannot be separated from {other} (correlation {correlation:.2f})"
    return f"standard error {100 * evidence.errors[i] / size:.0f} % of the estimate"


def _no_stribeck(evidence: Evidence) -> str:
    """Return the reason why the Stribeck curve has no shape, if mu_s may be mu_c, or nothing."""
    if "mu_s" not in evidence.names or "mu_c" not in evidence.names:
        return ""
    s = evidence.names.index("mu_s")
    c = evidence.names.index("mu_c")
    difference = evidence.values[s] - evidence.values[c]
    error = np.inf
    if np.isfinite(evidence.errors[[s, c]]).all():
        both = evidence.correlations[s, c] * evidence.errors[s] * evidence.errors[c]
        error = np.sqrt(
            max(evidence.errors[s] ** 2 + evidence.errors[c] ** 2 - 2.0 * both, 0.0)
        )
    if evidence.at_bound[s] or not difference > TWO_SIDED * error:
        return evidence.gap or "mu_s cannot be distinguished from mu_c"
    return ""


def _partner(evidence: Evidence, i: int) -> tuple[str, float]:
    """Return the parameter from which another one cannot be separated, and their correlation; or nothing, and zero."""
    row = evidence.correlations[i].copy()
    row[i] = 0.0
    j = np.argmax(np.abs(row))
    return (evidence.names[j], row[j]) if abs(row[j]) > TOGETHER else ("", 0.0)


def speed_gap(speeds: np.ndarray, around: float) -> str:
    """Return a text on the range of sliding speeds about `around` [m/s] that has no sample, or nothing."""
    moving = speeds[speeds > 0.0]
    if not len(moving):
        return "nothing moves"
    slow, fast = np.quantile(moving, [0.02, 0.98])
    if fast < NARROW * slow:
        return f"no sample below {1e3 * slow:.2g} and above {1e3 * fast:.2g} mm/s"
    low = moving[moving <= around].max(initial=0.0)
    high = moving[moving > around].min(initial=np.inf)
    if high < GAP * low:
        return ""
    if not np.isfinite(high):
        return f"no sample above {1e3 * low:.2g} mm/s"
    return f"no sample between {1e3 * low:.2g} and {1e3 * high:.2g} mm/s"
