"""Loads of logs: their means, and what fits ask of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planarfriction.errors import InvalidValueError
from planarfriction.identify.logs import Log
from planarfriction.patch import ContactPatch, SoftFinger

CONSTANT = 0.1
"""Share by which the load of a log may stray from its mean if the patch changes with the load."""


TWO_LOADS = 1.2
"""Ratio of loads above which logs show if the stiffness grows with the load."""


def load_ratio(logs: Sequence[Log]) -> float:
    """Return the largest load over the least, of which no log has 5 % of its samples beyond."""
    spans = np.array([np.quantile(log.normal_force[log.normal_force > 0.0], (0.05, 0.95)) for log in logs])
    return float(spans[:, 1].max() / spans[:, 0].min())


def mean_load(log: Log) -> float:
    """Return the mean of the loads > 0 of a log [N], or raise InvalidValueError."""
    loaded = log.normal_force[log.normal_force > 0.0]
    if not len(loaded):
        raise InvalidValueError(f"normal_force of {log.name}", "be > 0 somewhere", "0 everywhere")
    return float(loaded.mean())


def check_loads(logs: Sequence[Log], loads: Sequence[float], patch: ContactPatch, names: Sequence[str]) -> None:
    """Check that a fit can take the logs and their mean loads on a patch, and estimate `names` of a soft finger."""
    if names and not isinstance(patch.pressure, SoftFinger):
        raise InvalidValueError("patch", f"have a SoftFinger pressure to estimate {', '.join(names)}", patch.name)
    for name in ("k", "k_per_newton"):
        if name in names and getattr(patch.pressure, name) is None:
            raise InvalidValueError("parameters", f"contain {name} only if the SoftFinger has it", name)
    for log in logs:
        if not log.wrench.any():
            raise InvalidValueError(f"wrench of {log.name}", "not be 0 throughout", "0 in every sample")
    for log, load in zip(logs, loads, strict=True):
        if patch.depends_on_load and np.abs(log.normal_force / load - 1.0).max() > CONSTANT:
            rule = "stay within 10 % of its mean if the patch changes with the load (make one log for each load)"
            found = f"{log.normal_force.min():g} .. {log.normal_force.max():g} N"
            raise InvalidValueError(f"normal_force of {log.name}", rule, found)
