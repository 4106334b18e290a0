"""What an identification found: estimates with their errors, what the data cannot tell, residuals, the fitted model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from planarfriction.equality import ByValue
from planarfriction.identify.parameters import ALL
from planarfriction.laws import LuGre

TWO_SIDED = 1.96
"""Standard errors on either side of the estimate that hold 95 % of a normal distribution."""


@dataclass(frozen=True)
class Verdict:
    """What the data say about one parameter, or about the fit (`parameter` is then "fit")."""

    parameter: str
    identifiable: bool
    """Whether the data tell it; for the fit: whether nothing is wrong."""
    reason: str
    """Why not, or what to mind."""

    def __str__(self) -> str:
        if self.parameter == "fit":
            return f"fit: {self.reason}"
        return f"{self.parameter}: {'' if self.identifiable else 'not identifiable, '}{self.reason}"


def verdicts_on_turns(measured: Sequence[Any]) -> list[Verdict]:
    """What was done to the angles of logs or slides."""
    turned = {each.name: each.turns for each in measured if each.turns}
    if not turned:
        return []
    count = f"{sum(turned.values())} jumps of theta by a whole turn were taken out"
    return [Verdict("fit", True, f"{count}, in {', '.join(list(turned)[:3])}{' ...' if len(turned) > 3 else ''}")]


@dataclass(frozen=True, eq=False)
class Identification(ByValue):
    """Parameters that were estimated, in the order asked for; F of them."""

    names: tuple[str, ...]
    """Names of the parameters."""
    values: np.ndarray
    """Estimates [SI], `[F]`."""
    standard_errors: np.ndarray
    """Their standard errors [SI], `[F]`; infinite where the data say nothing, zero for one on its bound."""
    correlations: np.ndarray
    """Correlations of the estimates [-], `[F, F]`."""
    verdicts: tuple[Verdict, ...]
    """What the data cannot tell, and what to mind."""
    noise: np.ndarray
    """Spread of each measured channel that the residuals are scaled by, `[C]` (units of the channels)."""
    channels: tuple[tuple[str, str], ...]
    """Name and unit of the measured channels, such as ("fx", "N"), `[C]`."""
    histories: tuple[Mapping[str, Any], ...] = field(repr=False)
    """Of each log or slide: "name", "time" `[T]`, "measured" (NaN for what was not) and "predicted" `[T, C]`, and for
    logs with wrenches "speed" `[T]` [m/s], the sliding speed `|V_S|`, and "coefficient" `[T]` [-], friction by load."""
    law: LuGre
    """The fitted law; parameters that were not asked for are as given."""
    model: Any = field(repr=False)
    """The fitted friction model."""
    starts: tuple[int, int]
    """How many starts ended in this minimum, and how many there were."""

    @property
    def residuals(self) -> list[np.ndarray]:
        """Measured minus predicted over the noise, `[T, C]` for each log or slide; NaN where nothing was measured."""
        return [(each["measured"] - each["predicted"]) / self.noise for each in self.histories]

    @property
    def estimates(self) -> dict[str, float]:
        """The estimates by name [SI]."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    @property
    def errors(self) -> dict[str, float]:
        """The standard errors by name [SI]."""
        return dict(zip(self.names, self.standard_errors.tolist(), strict=True))

    def intervals(self) -> dict[str, tuple[float, float]]:
        """95 % intervals [SI]: symmetric as factors for parameters that are > 0, else as differences."""
        result = {}
        for name, value, error in zip(self.names, self.values, self.standard_errors, strict=True):
            if ALL[name].logarithmic and value > 0.0:
                with np.errstate(over="ignore"):
                    factor = float(np.exp(TWO_SIDED * error / value))
                result[name] = (float(value / factor), float(value * factor))
            else:
                low = float(value - TWO_SIDED * error)
                result[name] = (max(low, ALL[name].low), float(value + TWO_SIDED * error))
        return result

    def identifiable(self, name: str) -> bool:
        """Whether the data tell this parameter."""
        return not any(each.parameter == name and not each.identifiable for each in self.verdicts)

    def rows(self) -> list[list[str]]:
        """Table of text: name, estimate, standard error, 95 % interval, unit, verdict; one row for each parameter."""
        rows = []
        intervals = self.intervals()
        for name, value, error in zip(self.names, self.values, self.standard_errors, strict=True):
            low, high = intervals[name]
            told = self.identifiable(name)
            remark = "; ".join(each.reason for each in self.verdicts if each.parameter == name)
            rows.append(
                [
                    name,
                    f"{value:.5g}",
                    f"{error:.2g}" if np.isfinite(error) and error < 1e3 * max(abs(value), 1e-12) else "unknown",
                    f"{low:.4g} .. {high:.4g}" if told else "",
                    ALL[name].unit,
                    remark if told else f"not identifiable, {remark}",
                ]
            )
        return rows

    def table(self) -> str:
        """The rows as text, with a heading, then the verdicts on the fit."""
        heading = ["parameter", "estimate", "std. error", "95 % interval", "unit", "verdict"]
        rows = [heading, *self.rows()]
        widths = [max(len(row[i]) for row in rows) for i in range(len(heading))]
        lines = [
            "  ".join(entry.ljust(width) for entry, width in zip(row, widths, strict=True)).rstrip() for row in rows
        ]
        return "\n".join([*lines, *(str(each) for each in self.verdicts if each.parameter == "fit")])

    def to_dict(self) -> dict[str, Any]:
        """Everything but the histories as plain data, ready for JSON (None for what is infinite)."""

        def plain(value: float) -> float | None:
            return float(value) if np.isfinite(value) else None

        intervals = self.intervals()
        parameters = {
            name: {
                "estimate": float(value),
                "standard_error": plain(error),
                "interval_95": [plain(edge) for edge in intervals[name]],
                "unit": ALL[name].unit,
                "identifiable": self.identifiable(name),
            }
            for name, value, error in zip(self.names, self.values, self.standard_errors, strict=True)
        }
        return {
            "parameters": parameters,
            "correlations": {name: row.tolist() for name, row in zip(self.names, self.correlations, strict=True)},
            "verdicts": [str(each) for each in self.verdicts],
            "noise": {name: plain(value) for (name, _), value in zip(self.channels, self.noise, strict=True)},
            "starts": {"agreeing": self.starts[0], "total": self.starts[1]},
        }

    def plot(self) -> Any:
        """Draw measured and fitted channels with their residuals; returns a matplotlib Figure."""
        from planarfriction.plots.identification import plot_identification

        return plot_identification(self)
