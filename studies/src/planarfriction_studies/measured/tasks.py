"""The four tasks: what is asked, which cases are there to fit to, and how answers are scored."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from planarfriction_studies.measured import onsets, push_series, pushes, slides
from planarfriction_studies.measured.questions import Case
from planarfriction_studies.measured.scores import Measure


class Task(NamedTuple):
    """A task of the comparison."""

    name: str
    title: str
    read: Callable[[Path | None], list[Case]]
    """All cases, from the tables of the package or of a folder."""
    errors: Callable[[Case, np.ndarray], np.ndarray]
    """Errors `[rows, columns]` of an answer to a case."""
    measures: tuple[Measure, ...]
    refused: Callable[[Sequence[Case]], dict[int, str]] = lambda cases: {}
    """Cases that no model is asked about, by index, with the reason."""


TASKS = {
    name: Task(name, title, module.read, module.errors, module.MEASURES, *refused)
    for name, title, module, *refused in (
        (
            "slides",
            "Free slides of a cube: path and end from the first 8 poses",
            slides,
            slides.refused,
        ),
        ("pushes", "Slow pushes on known feet: angle to the measured twist", pushes),
        (
            "series",
            "Pushes over time: angles to the measured twist and wrench",
            push_series,
        ),
        (
            "onsets",
            "Pushes from touch: final pose, and peak of the force at breakaway",
            onsets,
        ),
    )
}
"""Task by name."""
