"""A comparison of models on measured data: four tasks with fixed splits, the library's models, and models of your own.

The published tables that it uses come with the package; `data/NOTICE` names their sources and licences.
"""

from planarfriction_studies.measured.benchmark import Benchmark, Result, Score
from planarfriction_studies.measured.questions import (
    Case,
    OnsetQuestion,
    PushQuestion,
    SeriesQuestion,
    SlideQuestion,
)
from planarfriction_studies.measured.tasks import TASKS

__all__ = [
    "TASKS",
    "Benchmark",
    "Case",
    "OnsetQuestion",
    "PushQuestion",
    "Result",
    "Score",
    "SeriesQuestion",
    "SlideQuestion",
]
