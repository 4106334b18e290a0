"""Parameters of patches that may differ from one environment of a simulator to another, and draws of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import PARAMETERS
from planarfriction.laws.base import FrictionLaw

RULES: dict[str, tuple[str, Callable[[np.ndarray], np.ndarray]]] = {
    "sigma_0": ("be > 0", lambda x: x > 0.0),
    "sigma_1": ("be >= 0", lambda x: x >= 0.0),
    "sigma_2": ("be >= 0", lambda x: x >= 0.0),
    "mu_c": ("be > 0", lambda x: x > 0.0),
    "mu_s": ("be > 0", lambda x: x > 0.0),
    "v_s": ("be > 0", lambda x: x > 0.0),
    "breakaway_ratio": ("be >= 0 and < 1", lambda x: (x >= 0.0) & (x < 1.0)),
    "scale": ("be > 0", lambda x: x > 0.0),
    "centre_x": ("be finite", np.isfinite),
    "centre_y": ("be finite", np.isfinite),
}
"""Rules of `PARAMETERS`."""

SHAPE = {"scale": 1.0, "centre_x": 0.0, "centre_y": 0.0}
"""Size and displacement of a patch as its model has it."""


def defaults(law: FrictionLaw) -> list[float]:
    """Return the parameters of a patch with this law, in the order of `PARAMETERS`."""
    given = {**law.numbers._asdict(), **SHAPE}
    return [float(given[name]) for name in PARAMETERS]


def check(parameters: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Return parameters by name as arrays.

    Raises InvalidValueError for an unknown name, and values that are not finite or break their rule.
    """
    validation.keys("parameters", parameters, (), PARAMETERS)
    found = {
        name: validation.finite_numbers(name, value)
        for name, value in parameters.items()
    }
    for name, values in found.items():
        rule, holds = RULES[name]
        if not (good := holds(values)).all():
            raise InvalidValueError(name, rule, float(values[~good].flat[0]))
    if {"mu_c", "mu_s"} <= found.keys():
        low, high = np.broadcast_arrays(found["mu_c"], found["mu_s"])
        if (wrong := high < low).any():
            raise InvalidValueError(
                "mu_s", "be >= mu_c", f"mu_s={high[wrong][0]:g}, mu_c={low[wrong][0]:g}"
            )
    return found


def randomise(
    law: FrictionLaw, ranges: Mapping[str, Any], count: int, *, seed: int = 0
) -> dict[str, np.ndarray]:
    """Draw parameters for `count` environments, by name, `[count]` each.

    `ranges` gives, by name, the two ends between which values are drawn uniformly, or a distribution of `scipy.stats`.
    Names are those of the law's numbers (`sigma_0`, `sigma_1`, `sigma_2`, `mu_c`, `mu_s`, `v_s`, `breakaway_ratio`),
    `scale` (size of the patch, as a multiple of the model's), and `centre_x`, `centre_y` (displacement of the patch in
    its frame [m]). Where `mu_c` has a range and `mu_s` has none, `mu_s` keeps the ratio that it has to `mu_c` in `law`;
    otherwise it is raised to `mu_c` where it would be less.

    Raises InvalidValueError for unknown names, ends in the wrong order, and draws that break the rule of a parameter.
    """
    validation.instance("law", law, FrictionLaw, "a friction law")
    validation.keys("ranges", ranges, (), PARAMETERS)
    count = validation.count("count", count, at_most=validation.MOST_DRAWS)
    generator = np.random.default_rng(validation.count("seed", seed, 0))
    drawn: dict[str, Any] = {
        name: _drawn(name, given, count, generator) for name, given in ranges.items()
    }
    own = law.numbers
    if "mu_c" in drawn and "mu_s" not in drawn:
        drawn["mu_s"] = drawn["mu_c"] * (own.mu_s / own.mu_c)
    if "mu_s" in drawn:
        drawn["mu_s"] = np.maximum(drawn["mu_s"], drawn.get("mu_c", own.mu_c))
    return check(drawn)


def _drawn(
    name: str, given: Any, count: int, generator: np.random.Generator
) -> np.ndarray:
    if hasattr(given, "rvs"):
        return np.asarray(given.rvs(size=count, random_state=generator), float)
    low, high = validation.array(name, given, (2,))
    if not low <= high:
        raise InvalidValueError(
            name, "have the lower end of its range first", f"{low:g}, {high:g}"
        )
    return generator.uniform(low, high, count)
