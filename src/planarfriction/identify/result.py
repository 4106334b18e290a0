"""The result of an identification: estimates with their errors, verdicts, residuals, and the fitted model."""

from __future__ import annotations

import html
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction._support.equality import ByValue
from planarfriction._support.pictures import picture
from planarfriction.formulas import PARAMETERS
from planarfriction.identify.parameters import ALL, LAW, PRIOR, SHAPE
from planarfriction.identify.sensor_errors import Nuisance
from planarfriction.identify.uncertainty import finite
from planarfriction.identify.verdicts import ModelScore, Verdict, interval
from planarfriction.laws import LuGre

NUMBERS = tuple(name for name in PARAMETERS if name in LAW)
"""Numbers of the law that may differ between environments."""

WIDTH = 80
"""Columns of a table."""

CORRELATED = 0.5
"""Correlation from which on a pair of estimates is printed."""

PAIRS = 5
"""Largest number of pairs that are printed."""


@dataclass(frozen=True, eq=False, repr=False)
class Identification(ByValue):
    """Result of an identification: F estimated parameters, in the order in which they were requested."""

    names: tuple[str, ...]
    """Names of the parameters."""
    values: np.ndarray
    """Estimates [SI], `[F]`."""
    standard_errors: np.ndarray
    """Standard errors [SI], `[F]`; infinite if the data do not determine a value, zero for one at its bound."""
    correlations: np.ndarray
    """Correlations of the estimates [-], `[F, F]`."""
    verdicts: tuple[Verdict, ...]
    """Parameters that the data do not determine, and cautions."""
    noise: np.ndarray
    """Standard deviation of each measured channel, by which the residuals are scaled, `[C]` (units of the channels)."""
    channels: tuple[tuple[str, str], ...]
    """Name and unit of the measured channels, such as ("fx", "N"), `[C]`."""
    histories: tuple[Mapping[str, Any], ...] = field(repr=False)
    """History of each log or slide: "name", "time" `[T]`, "measured" (NaN for what was not) and "predicted" `[T, C]`.
    For logs with wrenches also "held_out" `[T, C]`, as fits predict it that saw neither the sample nor its block (NaN
    at a start from rest), "speed" `|V_S|` `[T]` [m/s], and "coefficient" `[T]` [-], friction by load."""
    law: LuGre
    """The fitted law; parameters that were not estimated are as given."""
    model: Any = field(repr=False)
    """The fitted friction model."""
    starts: tuple[int, int]
    """Number of starting points that ended in this minimum, and number of all."""
    rig: tuple[Nuisance, ...] = ()
    """Estimated sensor errors: delay, zeros, drift of the load cell, noise of the twist."""
    scores: tuple[ModelScore, ...] = ()
    """The models and kinds of bristles that were fitted; the chosen one first."""
    chosen: str = ""
    """Name of the model that explains the data best."""
    samples: tuple[int, int] = (0, 0)
    """Number of samples that were fitted, and number of all, as a long log is decimated (`FitOptions.samples`)."""

    @property
    def residuals(self) -> list[np.ndarray]:
        """Residuals (measured - predicted) / noise, `[T, C]` for each log or slide; NaN where nothing was measured."""
        return [
            (each["measured"] - each["predicted"]) / self.noise
            for each in self.histories
        ]

    @property
    def estimates(self) -> dict[str, float]:
        """Estimates by name [SI]."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    @property
    def errors(self) -> dict[str, float]:
        """Standard errors by name [SI]."""
        return dict(zip(self.names, self.standard_errors.tolist(), strict=True))

    def intervals(self) -> dict[str, tuple[float, float]]:
        """Compute the 95 % intervals [SI]: symmetric as factors for parameters that are > 0, else as differences."""
        both = zip(self.names, self.values, self.standard_errors, strict=True)
        return {name: interval(name, value, error) for name, value, error in both}

    def sample(self, count: int, *, seed: int = 0) -> dict[str, np.ndarray]:
        """Draw parameters of `count` environments from the estimates and their covariance, by name, `[count]` each.

        Names and meaning are those of `pf.randomise`, for patches with the fitted `model`: size and place become
        `scale`, `centre_x` and `centre_y` relative to it. Draws of values > 0 are symmetric as factors, within the
        bounds of the fit; one that the data cannot determine varies by a factor of 20 (one standard deviation). `gamma`
        and the constants of soft fingers, on which stored maps depend, stay as estimated.

        Raises InvalidValueError unless `count` is a count.
        """
        generator = np.random.default_rng(validation.count("seed", seed, 0))
        count = validation.count("count", count, at_most=validation.MOST_DRAWS)
        normal = generator.standard_normal((count, len(self.names)))
        strengths, axes = np.linalg.eigh(self.correlations)
        unit = normal @ (axes * np.sqrt(np.maximum(strengths, 0.0))) @ axes.T
        found = {}
        for i, (name, value) in enumerate(self.estimates.items()):
            own = ALL[name]
            error = self.standard_errors[i]
            # an unknown error is that of the prior of a factor, and none of a difference
            if own.logarithmic and value > 0.0:
                drawn = value * np.exp(np.fmin(error / value, PRIOR) * unit[:, i])
            else:
                drawn = value + finite(error) * unit[:, i]
            found[name] = np.clip(drawn, own.low, own.high)
        result = {name: values for name, values in found.items() if name in NUMBERS}
        if "mu_c" in found or "mu_s" in found:
            mu_s = found.get("mu_s", self.law.mu_s)
            result["mu_s"] = np.maximum(mu_s, found.get("mu_c", self.law.mu_c))
        if not self.model.depends_on_load and not SHAPE.keys().isdisjoint(found):
            radius = self.estimates.get("contact_radius", 1.0)
            scale = found.get("contact_radius", np.full(count, radius)) / radius
            x, y = self.model.patch.centre_of_pressure()
            result["scale"] = scale
            result["centre_x"] = found.get("centre_x", x) - scale * x
            result["centre_y"] = found.get("centre_y", y) - scale * y
        return result

    def identifiable(self, name: str) -> bool:
        """Return True if the data determine this parameter."""
        return not any(
            each.parameter == name and not each.identifiable for each in self.verdicts
        )

    def residual_correlations(self, lags: int = 50) -> np.ndarray:
        """Compute the autocorrelations of the residuals at 0 to `lags` samples, `[lags + 1, C]`.

        Those of pure noise are 0 from a lag of one sample on.

        Raises InvalidValueError unless `lags` is a count.
        """
        lags = validation.count("lags", lags)
        lags = min(lags, *(len(each["time"]) - 2 for each in self.histories))
        sums = np.zeros((lags + 1, len(self.channels)))
        for each in self.residuals:
            left = np.nan_to_num(each[1:])
            for lag in range(lags + 1):
                sums[lag] += (left[lag:] * left[: len(left) - lag]).sum(axis=0)
        return sums / np.where(sums[0] > 0.0, sums[0], 1.0)

    def summary(self) -> str:
        """Return the verdict in plain words: the parameters that the data determine, and the trust in the fit."""
        known = [name for name in self.names if self.identifiable(name)]
        others = [name for name in self.names if name not in known]
        first = "None of the parameters is identifiable."
        if known:
            first = f"Identified: {', '.join(known)}."
            if others:
                first += f" Not identifiable: {', '.join(others)}."
        reasons = [each.reason for each in self.verdicts if each.parameter == "fit"]
        lines = [first, *(f"{reason[0].upper()}{reason[1:]}." for reason in reasons)]
        return "\n".join(textwrap.fill(line, WIDTH) for line in lines)

    def table(self) -> str:
        """Return text in 80 columns: estimates, goodness of fit, correlations, verdicts, sensor errors."""
        heading = f"{'parameter':<15}{'value':>12}{'std. error':>12}  {'95 % interval':<25}unit"
        lines = [heading]
        remarks = []
        intervals = self.intervals()
        for name, value in self.estimates.items():
            error = self.errors[name]
            spread = "unknown"
            if error < 1e3 * max(abs(value), 1e-12):
                spread = _digits(error, 2)
            between = "not identifiable"
            if self.identifiable(name):
                between = " to ".join(_digits(end, 4) for end in intervals[name])
            lines.append(
                f"{name:<15}{_digits(value, 5):>12}{spread:>12}  {between:<25}{ALL[name].unit}".rstrip()
            )
            reasons = [each.reason for each in self.verdicts if each.parameter == name]
            if reasons:
                remarks.append(
                    textwrap.fill(
                        f"{name}: {'; '.join(reasons)}", WIDTH, subsequent_indent="  "
                    )
                )
        if self.scores:
            samples = f"{self.samples[0]:,} samples, {len(self.names)} parameters"
            chi2 = _digits(self.scores[0].reduced_chi2, 4)
            lines.append(f"reduced chi-square {chi2} ({samples})")
        rig = [
            f"{_short(each):<27}{each.value:>11.3g}  {' to '.join(f'{end:.3g}' for end in each.interval)} {each.unit}"
            for each in self.rig
        ]
        if rig:
            rig.insert(0, f"{'sensor error':<27}{'value':>11}  95 % interval, unit")
        blocks = [lines, self._pairs(), [self.summary()], remarks, rig]
        return "\n\n".join("\n".join(block) for block in blocks if block)

    def _pairs(self) -> list[str]:
        """Return lines on the most strongly correlated pairs of estimates, the strongest first."""
        rows, columns = np.tril_indices(len(self.names), -1)
        values = self.correlations[rows, columns]
        lines = [f"correlations of {CORRELATED} and more"]
        for k in np.argsort(-np.abs(values), kind="stable")[:PAIRS]:
            if abs(values[k]) >= CORRELATED:
                pair = f"{self.names[columns[k]]}, {self.names[rows[k]]}"
                lines.append(f"{pair:<27}{values[k]:+.3f}")
        return lines if len(lines) > 1 else []

    def __repr__(self) -> str:
        return self.table()

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.table())}</pre>"

    def to_dict(self) -> dict[str, Any]:
        """Return everything except the histories as plain data for JSON (None for infinite values)."""

        def plain(value: float) -> float | None:
            return float(value) if np.isfinite(value) else None

        def estimate(value: float, error: float, interval: Any, unit: str) -> dict:
            return {
                "estimate": float(value),
                "standard_error": plain(error),
                "interval_95": [plain(edge) for edge in interval],
                "unit": unit,
            }

        intervals = self.intervals()
        errors = self.errors
        channels = [name for name, _ in self.channels]
        lagged = self.residual_correlations().T.tolist()
        return {
            "parameters": {
                name: {
                    **estimate(value, errors[name], intervals[name], ALL[name].unit),
                    "identifiable": self.identifiable(name),
                }
                for name, value in self.estimates.items()
            },
            "correlations": dict(
                zip(self.names, self.correlations.tolist(), strict=True)
            ),
            "verdicts": [str(each) for each in self.verdicts],
            "noise": dict(zip(channels, map(plain, self.noise), strict=True)),
            "rig": [
                {
                    "name": each.name,
                    "log": each.log,
                    **estimate(each.value, each.error, each.interval, each.unit),
                }
                for each in self.rig
            ],
            "model": self.chosen,
            "models": [each._asdict() for each in self.scores],
            "residual_correlations": dict(zip(channels, lagged, strict=True)),
            "samples": {"used": self.samples[0], "total": self.samples[1]},
            "starts": {"agreeing": self.starts[0], "total": self.starts[1]},
        }

    def plot(self) -> Any:
        """Draw measured and fitted channels with their residuals; returns a matplotlib Figure."""
        return picture("identification", self)


def _digits(value: float, count: int) -> str:
    """Return a number with `count` significant digits, without an exponent where it has few zeros."""
    text = f"{value:.{count}g}"
    if 1e-3 <= abs(value) < 1e6:
        return np.format_float_positional(float(text), trim="-")
    return text


def _short(each: Nuisance) -> str:
    """Return the name of a quantity of the rig, with its log, in 27 letters."""
    room = 24 - len(each.name)
    log = each.log if len(each.log) <= room else f"{each.log[: max(room - 2, 0)]}.."
    return f"{each.name} ({log})" if log else each.name
