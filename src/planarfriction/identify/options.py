"""Options of a fit of logs, and their checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction._support.equality import Checked, checked
from planarfriction.errors import InvalidValueError
from planarfriction.identify.sensor_errors import GROUPS, check_groups
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import LimitSurface, LimitSurfaceTablePublished


def check_noise(name: str, noise: Any) -> np.ndarray:
    """Return the noise `[3]`, all of it > 0, or raise InvalidValueError."""
    values = validation.vector(name, noise, 3)
    if not (values > 0.0).all():
        raise InvalidValueError(name, "be > 0", values.tolist())
    return values


def _noise(name: str, noise: Any) -> tuple[float, ...]:
    return tuple(check_noise(name, noise).tolist())


def _surface(name: str, value: Any) -> type[LimitSurface]:
    if not (isinstance(value, type) and issubclass(value, LimitSurface)):
        raise InvalidValueError(name, "be a class of limit surfaces", value)
    return value


def _bristles(_: str, value: Any) -> ElastoPlastic | float | str | None:
    if isinstance(value, str) and value == "auto":
        return value
    return LuGre(elasto_plastic=value).elasto_plastic  # pyright: ignore[reportArgumentType]


@dataclass(frozen=True)
class FitOptions(Checked):
    """Options of `identify_lugre` that few fits change.

    Raises InvalidValueError for an option that breaks its rule.
    """

    nuisance: Sequence[str] = checked(check_groups, default=GROUPS)
    """Disturbances that the rig may add: "delay" between motion and wrench, "bias" (zeros of the wrench and their
    drift), "load" (scale and drift of the load cell), "twist" (noise of the twist). All by default."""
    noise: Sequence[float] | None = checked(_noise, default=None)
    """Standard deviation of the measured fx, fy [N] and tau [N m]; None estimates each from its jitter."""
    begins: str = checked(validation.choice, ("rest", "steady"), default="rest")
    """Bristles at the begin of every log: relaxed ("rest"), or as in steady sliding at the first twist ("steady")."""
    refine: int | None = checked(validation.count, default=None)
    """Steps between two samples; None doubles them until no estimate changes by more than a fifth of its error."""
    starts: int = checked(validation.count, default=4)
    """Number of starting points."""
    seed: int = checked(validation.count, 0, default=0)
    """Random seed that scatters the starting points."""
    samples: int = checked(validation.count, 1000, default=20_000)
    """Most samples that a fit takes of all logs together: of longer logs, the windows that differ most are taken, and
    the result says so."""
    elasto_plastic: ElastoPlastic | float | str | None = checked(
        _bristles, default="auto"
    )
    """Kind of bristles, None for plain ones, unless a whole law is given as start. "auto" takes what fits better: plain
    ones or a breakaway ratio of 0.9; and for loads that clearly differ, a stiffness that grows with the load or one
    that does not (`Pad.at_load`)."""
    loss: str = checked(validation.choice, ("linear", "soft_l1"), default="linear")
    """Loss of a residual: its square, or "soft_l1" as SciPy has it. A fit with the latter ends without samples off by
    more than six times the noise, if these are fewer than a tenth."""
    surface: type[LimitSurface] = checked(_surface, default=LimitSurfaceTablePublished)
    """Class of the limit surface of the model "reduced-published"."""
