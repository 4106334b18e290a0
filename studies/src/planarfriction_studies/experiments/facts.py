"""Numbers to compare with: those of the paper's figures and tables, and converged solutions of the same equations.

`data/published.json` restates the vertices of the paper's vector figures, exact to `reading`, and its tables.
`data/converged.npz` holds solutions of the same equations that were computed independently: fine-step Runge-Kutta for
the distributed model, tight tolerances for the reduced one, good to about 1e-6 of span. Its box rows of the ellipsoid
are an exception: they carry the solver error of the figure.

Source: Waltersson and Karayiannidis 2024 (IEEE T-RO, arXiv 2308.01123).
"""

from __future__ import annotations

import functools
import json
from dataclasses import dataclass
from importlib import resources
from typing import Any

import numpy as np

from planarfriction._support import validation

CONVERGED_SHARE = 1e-6
"""Accuracy of the converged solutions as a share of the span of a curve [-]."""


@dataclass(frozen=True)
class PublishedCurve:
    """One curve of a figure."""

    figure: str
    """Content of the figure, in words."""
    unit: str
    time: np.ndarray
    """Times of the values [s]; other abscissae (number of cells or segments) as they are."""
    values: np.ndarray
    deviation: float | None
    """Largest distance of the curve from a converged solution, the error of the figure's solver; None: not known."""
    reading: float
    """Error of reading the figure."""


def published_curve(name: str) -> PublishedCurve:
    """Return a published curve, `in_hand/Circle/d1/x`; its times are those of the state, not the (late) labels."""
    curves = _published()["curves"]
    entry = curves[validation.choice("curve", name, curves)]
    time = np.array(entry["at"]) + entry["late"]
    deviation = entry["deviation"]
    reading = entry["reading"]
    return PublishedCurve(
        entry["figure"],
        entry["unit"],
        time,
        np.array(entry["values"]),
        deviation,
        reading,
    )


def published_table(name: str) -> dict[str, dict[str, float]]:
    """Return a published table (`patches`, `box` or `timing`): row -> column -> number."""
    tables = _published()
    columns, *rows = tables[
        validation.choice("table", name, ("patches", "box", "timing"))
    ].items()
    return {row: dict(zip(columns[1], values, strict=True)) for row, values in rows}


def converged(name: str) -> dict[str, np.ndarray]:
    """Return a converged solution, `in_hand/Circle/d1`: `time` [s], and its columns of x, y, theta, fx, fy, tau."""
    columns = {
        key.rpartition("/")[2]: values
        for key, values in _converged().items()
        if key.startswith(f"{name}/")
    }
    if not columns:
        validation.choice(
            "solution", name, sorted({key.rpartition("/")[0] for key in _converged()})
        )
    return columns


def _data() -> Any:
    return resources.files("planarfriction_studies.experiments") / "data"


@functools.cache
def _published() -> dict[str, Any]:
    return json.loads((_data() / "published.json").read_text(encoding="utf-8"))


@functools.cache
def _converged() -> dict[str, np.ndarray]:
    with (_data() / "converged.npz").open("rb") as file, np.load(file) as arrays:
        return {name: arrays[name].astype(float) for name in arrays.files}
