"""A comparison on measured data: three tasks with fixed splits, the library's models, and any model of one's own.

The tables of others that it stands on come with the package; `data/NOTICE` names their sources and licences.
"""

from planarfriction.measured.benchmark import Benchmark, Result, Score
from planarfriction.measured.questions import Case, PushQuestion, SeriesQuestion, SlideQuestion
from planarfriction.measured.tasks import TASKS

__all__ = ["TASKS", "Benchmark", "Case", "PushQuestion", "Result", "Score", "SeriesQuestion", "SlideQuestion"]
