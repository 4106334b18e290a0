"""Identification: parameters of the friction models from measurements, with their uncertainty.

`identify_lugre` reads logs of motion and wrench, `identify_motion` slides without a force sensor; `plan_motion`
suggests which motion to measure next.
"""

from planarfriction.identify.candidates import candidate_motions
from planarfriction.identify.logs import Log, differentiated
from planarfriction.identify.motion import identify_motion
from planarfriction.identify.planning import MotionPlan, known_so_far, plan_motion
from planarfriction.identify.result import Identification, Verdict
from planarfriction.identify.slides import Slide, SlidingBody, fit_start, predict_slide
from planarfriction.identify.wrenches import identify_lugre

__all__ = [
    "Identification",
    "Log",
    "MotionPlan",
    "Slide",
    "SlidingBody",
    "Verdict",
    "candidate_motions",
    "differentiated",
    "fit_start",
    "identify_lugre",
    "identify_motion",
    "known_so_far",
    "plan_motion",
    "predict_slide",
]


def __dir__() -> list[str]:
    return sorted(__all__)
