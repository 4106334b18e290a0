"""Which of several models explains the data best, and which estimates depend on that choice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planarfriction.identify.search import Fit
from planarfriction.identify.uncertainty import Uncertainty


@dataclass(frozen=True)
class ModelScore:
    """How well one model explains the data."""

    model: str
    """Its name, as `identify_lugre` takes it."""
    held_out: float
    """Root mean square of what it leaves of held-out parts, over the noise [-]; 1 is noise alone."""
    held_out_error: float
    """Standard error of that, from part to part [-]."""
    excess: float
    """Mean square of what the fit leaves, over that of the noise [-]."""
    rejected: bool
    """Whether it leaves more than noise."""
    estimates: dict[str, float]
    """Its estimates [SI]."""


@dataclass(frozen=True)
class Candidate:
    """A model that was fitted."""

    fit: Fit
    uncertainty: Uncertainty

    @property
    def score(self) -> ModelScore:
        """How well it explains the data."""
        held_out, problem = self.uncertainty.held_out, self.fit.problem
        error = float(np.std(held_out) / np.sqrt(max(len(held_out) - 1, 1)))
        estimates = dict(zip(problem.names, self.fit.values.tolist(), strict=False))
        u = self.uncertainty
        return ModelScore(problem.kind, u.score, error, u.excess, u.rejected, estimates)


def best_of(candidates: Sequence[Candidate]) -> Candidate:
    """The candidate that predicts what was held out best."""
    return min(candidates, key=lambda each: each.uncertainty.score)


def dependence(name: str, interval: tuple[float, float], chosen: ModelScore, others: Sequence[ModelScore]) -> str:
    """Why an estimate depends on the model: another that the data do not reject has it outside the interval."""
    low, high = interval
    for other in others:
        if other.model != chosen.model and not other.rejected and not low <= other.estimates[name] <= high:
            return f"depends on the model: {other.model}, which also fits, gives {other.estimates[name]:.3g}"
    return ""
