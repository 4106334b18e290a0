"""Identification: parameters of the friction models from measurements, with their errors and with what stays unknown.

`identify_lugre` reads logs of motion and wrench, `identify_motion` slides without a force sensor.
"""

from planarfriction.identify.logs import Log, differentiated
from planarfriction.identify.result import Identification, Verdict
from planarfriction.identify.wrenches import identify_lugre

__all__ = ["Identification", "Log", "Verdict", "differentiated", "identify_lugre"]
