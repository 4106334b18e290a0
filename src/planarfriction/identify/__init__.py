"""Identification: parameters of the friction models from measurements, with their errors and with what stays unknown.

`identify_lugre` reads logs of motion and wrench, `identify_motion` slides without a force sensor.
"""

from planarfriction.identify.logs import Log, differentiated
from planarfriction.identify.motion import identify_motion
from planarfriction.identify.result import Identification, Verdict
from planarfriction.identify.slides import Slide, SlidingBody, fit_start, predict_slide
from planarfriction.identify.wrenches import identify_lugre

__all__ = [
    "Identification",
    "Log",
    "Slide",
    "SlidingBody",
    "Verdict",
    "differentiated",
    "fit_start",
    "identify_lugre",
    "identify_motion",
    "predict_slide",
]
