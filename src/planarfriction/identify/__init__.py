"""Identification: parameters of the friction models from measurements, with their uncertainty.

`identify_lugre` reads logs of motion and wrench, `identify_pad` those of an elastic pad, `identify_motion` slides
without a force sensor; `design_experiment` suggests which motion to measure next.
"""

from planarfriction.identify.experiments import (
    MotionPlan,
    candidate_motions,
    current_estimate,
    design_experiment,
)
from planarfriction.identify.logs import Log, differentiated
from planarfriction.identify.motion import identify_motion
from planarfriction.identify.pads import PadFit, identify_pad
from planarfriction.identify.problem import FitOptions
from planarfriction.identify.result import Identification
from planarfriction.identify.slides import (
    MassProperties,
    Slide,
    fit_start,
    predict_slide,
)
from planarfriction.identify.verdicts import Verdict
from planarfriction.identify.wrenches import identify_lugre

__all__ = [
    "FitOptions",
    "Identification",
    "Log",
    "MassProperties",
    "MotionPlan",
    "PadFit",
    "Slide",
    "Verdict",
    "candidate_motions",
    "current_estimate",
    "design_experiment",
    "differentiated",
    "fit_start",
    "identify_lugre",
    "identify_motion",
    "identify_pad",
    "predict_slide",
]
__dir__ = __all__.copy
