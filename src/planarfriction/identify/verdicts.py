"""Which parameters the data do not determine, and why: each rule names the parameter and what is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planarfriction.identify.choice import Candidate, ModelScore, dependence
from planarfriction.identify.parameters import ALL, SOFT_FINGER
from planarfriction.identify.result import Verdict, interval
from planarfriction.identify.uncertainty import Uncertainty

VAGUE = 0.3
"""Standard error, as a share of the estimate, above which a parameter that must be > 0 counts as unknown."""

TOGETHER = 0.98
"""Correlation above which two parameters cannot be separated."""

WELL = 0.02
"""Standard error, as a share of the estimate, below which it does not matter what an estimate is correlated with."""

UNSEEN = 1.0
"""A parameter whose whole size moves no sample by this many spreads of the noise is not seen."""

OF_TORQUE = ("contact_radius", "centre_x", "centre_y", *SOFT_FINGER)
"""What the force depends on only where the contact spins while it slides."""

GAP = 3.0
"""Sliding speeds with this ratio and no sample between leave a gap."""

NARROW = 10.0
"""Ratio of the fastest to the slowest sliding (but for 2 % at either end) below which no Stribeck curve shows."""

NO_SPIN = 0.02
"""Share of the sliding speed that comes from spin below which there is none."""

ONE_LOAD = 1.05
"""Ratio of the largest and the smallest load below which there is one load only."""

SLIPPED = 12.0
"""Growth of the cost (half the sum of squares) without slip below which the data hold none: 5 standard errors."""

CORRELATED = 0.3
"""Correlation of neighbouring residuals above which they are no noise."""


@dataclass(frozen=True)
class Evidence:
    """What the rules look at."""

    names: tuple[str, ...]
    values: np.ndarray
    errors: np.ndarray
    """Standard errors, `[F]`."""
    correlations: np.ndarray
    """`[F, F]`."""
    at_bound: np.ndarray
    """`[F]` of bool."""
    jacobian: np.ndarray
    """Derivatives of the scaled residuals, `[M, F]`."""
    speeds: np.ndarray
    """Sliding speeds `|V_S|` of all samples [m/s]."""
    spins: np.ndarray
    """Their part from spin, `r |omega|` [m/s]."""
    loads: np.ndarray
    """Normal force of each log [N]."""
    torque: bool
    """Whether any log has measured torques."""
    without_slip: float
    """How much the cost grows if the contact may not slip at all."""
    largest_coefficient: float
    """Largest friction over load that was fitted [-]."""

    def value(self, name: str, otherwise: float) -> float:
        """The estimate of a parameter, or `otherwise` if it was not estimated."""
        return float(self.values[self.names.index(name)]) if name in self.names else otherwise


def judge(
    evidence: Evidence, best: Candidate, candidates: Sequence[Candidate], skipped: Sequence[str]
) -> tuple[Verdict, ...]:
    """The verdicts on the fit, then on all parameters: where it is rejected, none of them is identifiable."""
    u, chosen, scores = best.uncertainty, best.score, [each.score for each in candidates]
    verdicts = [Verdict("fit", not u.rejected, _on_fit(u, chosen))]
    if len(scores) > 1:
        others = sorted((each for each in scores if each.model != chosen.model), key=lambda each: each.held_out)
        rest = ", ".join(
            f"{each.model} {each.held_out:.3g} ({each.held_out - chosen.held_out:+.2g})" for each in others
        )
        text = f"{chosen.model} predicts held-out parts best, to {chosen.held_out:.3g} times the noise; {rest}"
        verdicts.append(Verdict("fit", True, text))
    if skipped:
        verdicts.append(
            Verdict(
                "fit",
                True,
                f"{', '.join(skipped)}: not tried, would take minutes (choose it as model)",
            )
        )
    if not evidence.torque:
        text = "tau is 0 throughout, as without a torque sensor: the estimates use the force alone"
        verdicts.append(Verdict("fit", True, text))
    for i, name in enumerate(evidence.names):
        verdict = _parameter(evidence, i)
        if verdict is None or verdict.identifiable:
            low, high = interval(name, evidence.values[i], evidence.errors[i])
            if u.rejected:
                verdict = Verdict(
                    name, False, f"{chosen.model} does not explain the data, so this value has no meaning"
                )
            elif reason := dependence(name, (low, high), chosen, scores):
                verdict = Verdict(name, False, reason)
        if verdict is not None:
            verdicts.append(verdict)
    return tuple(verdicts)


def _on_fit(u: Uncertainty, chosen: ModelScore) -> str:
    """The test of the fit in words."""
    size = np.sqrt(u.excess)
    if not u.rejected:
        return f"{chosen.model} explains the data: its residuals are {size:.2f} times the noise of the sensors"
    if u.excess > u.limit:
        text = f"{chosen.model} is rejected: its residuals are {size:.2f} times the noise of the sensors, and "
        text += f"chance explains at most {np.sqrt(u.limit):.2f}"
    else:
        usual = f"off by {u.strain:.0f} times the usual error"
        text = f"{chosen.model} is rejected: it fits only with a load cell that is {usual}"
    if u.neighbours > CORRELATED:
        text += f", and neighbouring residuals are correlated ({u.neighbours:.2f})"
    return (
        f"{text}; the patch, the kind of bristles or the measurement is wrong, and the intervals are only a rough guide"
    )


def _parameter(evidence: Evidence, i: int) -> Verdict | None:
    name, value, error = evidence.names[i], float(evidence.values[i]), float(evidence.errors[i])
    kind = ALL[name]
    if name in ("mu_c", "mu_s", "v_s", "gamma") and evidence.without_slip < SLIPPED:
        return Verdict(
            name, False, f"the contact never slips, friction reaches {evidence.largest_coefficient:.2g} of the load"
        )
    rests_on_zero = kind.low == 0.0 and value <= 1e-6 and not kind.logarithmic
    if evidence.at_bound[i] and not rests_on_zero:
        return _on_bound(evidence, i)
    size = abs(value)
    seen = np.abs(evidence.jacobian[:, i]).max() * size
    if name in ("v_s", "gamma") and (reason := _no_stribeck(evidence)):
        return Verdict(name, False, reason)
    if kind.logarithmic and not error < VAGUE * size:
        return Verdict(name, False, _why(evidence, i, seen))
    if not kind.logarithmic and not np.isfinite(error):
        return Verdict(name, False, _why(evidence, i, seen))
    if kind.low == 0.0 and value < 1.96 * error:
        return Verdict(name, True, f"cannot be distinguished from 0, at most {value + 1.96 * error:.3g} {kind.unit}")
    if (partner := _partner(evidence, i)) is not None:
        other, correlation = partner
        if not evidence.torque and not {name, other}.isdisjoint(OF_TORQUE):
            text = f"cannot be separated from {other} (correlation {correlation:.2f}) without the torque"
            return Verdict(name, False, f"{text}, and tau is 0 throughout")
        if error > WELL * size:
            return Verdict(name, True, f"strongly correlated with {other} ({correlation:.2f})")
    return None


def _why(evidence: Evidence, i: int, seen: float) -> str:
    """The reason why a parameter is vague: what the data do not cover, else another parameter, else the noise."""
    name = evidence.names[i]
    if name in ("v_s", "gamma", "mu_s") and (gap := speed_gap(evidence.speeds, evidence.value("v_s", 1e-3))):
        return gap
    spin = np.sqrt(np.mean(evidence.spins**2)) / max(np.sqrt(np.mean(evidence.speeds**2)), 1e-300)
    if name in ("contact_radius", *SOFT_FINGER) and spin < NO_SPIN:
        return "no spin"
    if name in SOFT_FINGER and name != "c" and evidence.loads.max() < ONE_LOAD * evidence.loads.min():
        return "one load only"
    if name in OF_TORQUE and not evidence.torque:
        return "only the torque depends on it, and tau is 0 throughout"
    if seen < UNSEEN:
        return f"changes no sample by more than {seen:.2g} times the noise"
    if (partner := _partner(evidence, i)) is not None:
        return f"cannot be separated from {partner[0]} (correlation {partner[1]:.2f})"
    return f"standard error {100 * evidence.errors[i] / abs(evidence.values[i]):.0f} % of the estimate"


def _no_stribeck(evidence: Evidence) -> str:
    """Why the Stribeck curve has no shape: mu_s may be mu_c."""
    if "mu_s" not in evidence.names or "mu_c" not in evidence.names:
        return ""
    s, c = evidence.names.index("mu_s"), evidence.names.index("mu_c")
    excess = evidence.values[s] - evidence.values[c]
    spread = np.inf
    if np.isfinite(evidence.errors[[s, c]]).all():
        both = evidence.correlations[s, c] * evidence.errors[s] * evidence.errors[c]
        spread = np.sqrt(max(evidence.errors[s] ** 2 + evidence.errors[c] ** 2 - 2.0 * both, 0.0))
    if evidence.at_bound[s] or not excess > 1.96 * spread:
        gap = speed_gap(evidence.speeds, evidence.value("v_s", 1e-3))
        return gap or "mu_s cannot be distinguished from mu_c"
    return ""


def _on_bound(evidence: Evidence, i: int) -> Verdict:
    name = evidence.names[i]
    if name == "mu_s":
        reason = speed_gap(evidence.speeds, evidence.value("v_s", 1e-3)) or "no friction above mu_c was seen"
        return Verdict(name, False, f"{reason}: equal to mu_c")
    return Verdict(name, False, f"the fit ran into the bound {evidence.values[i]:.3g} {ALL[name].unit}")


def _partner(evidence: Evidence, i: int) -> tuple[str, float] | None:
    row = evidence.correlations[i].copy()
    row[i] = 0.0
    j = int(np.argmax(np.abs(row)))
    return (evidence.names[j], float(row[j])) if abs(row[j]) > TOGETHER else None


def speed_gap(speeds: np.ndarray, around: float) -> str:
    """Text that names the range of sliding speeds about `around` [m/s] without a sample, or nothing."""
    moving = speeds[speeds > 0.0]
    if not len(moving):
        return "nothing moves"
    slow, fast = np.quantile(moving, [0.02, 0.98])
    if fast < NARROW * slow:
        return f"no sample below {1e3 * slow:.2g} and above {1e3 * fast:.2g} mm/s"
    below, above = moving[moving <= around], moving[moving > around]
    low = float(below.max()) if len(below) else 0.0
    high = float(above.min()) if len(above) else np.inf
    if high < GAP * low:
        return ""
    if not np.isfinite(high):
        return f"no sample above {1e3 * low:.2g} mm/s"
    return f"no sample between {1e3 * low:.2g} and {1e3 * high:.2g} mm/s"
