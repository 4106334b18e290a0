"""The models that the comparison begins with, and which of them are installed."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import Any, NamedTuple

from planarfriction.limit_surface import (
    LimitSurfaceEllipsoid,
    LimitSurfaceExact,
    LimitSurfaceQuartic,
)
from planarfriction.models import DistributedModel, ReducedModel
from planarfriction_studies.measured.contactnets import SpeedModel, TossModel
from planarfriction_studies.measured.models import (
    BristleModel,
    PushedQuartic,
    SurfaceModel,
    UncoupledModel,
)
from planarfriction_studies.measured.mujoco_box import MujocoBox


class Entry(NamedTuple):
    """A model of the comparison."""

    make: Callable[[], Any]
    words: str
    """Description in one line."""
    needs: str = ""
    """Package of an extra that it needs, and the extra."""
    extra: str = ""

    @property
    def installed(self) -> bool:
        """True if the package that the model needs is installed."""
        return not self.needs or importlib.util.find_spec(self.needs) is not None


LIBRARY = {
    "uncoupled": Entry(
        lambda: UncoupledModel(False), "separate limits of force and torque"
    ),
    "independent torsion": Entry(
        lambda: UncoupledModel(True), "the same with a fitted lever arm of the torque"
    ),
    "ellipsoid": Entry(
        lambda: SurfaceModel(LimitSurfaceEllipsoid), "an ellipsoid as limit surface"
    ),
    "quartic": Entry(
        lambda: SurfaceModel(LimitSurfaceQuartic),
        "a convex quartic of the patch",
        "cvxpy",
        "quartic",
    ),
    "quartic of pushes": Entry(
        PushedQuartic,
        "a convex quartic fitted to the training pushes",
        "cvxpy",
        "quartic",
    ),
    "exact surface": Entry(
        lambda: SurfaceModel(LimitSurfaceExact), "the limit surface of the patch itself"
    ),
    "reduced": Entry(
        lambda: BristleModel(ReducedModel), "ReducedModel, stiff bristles"
    ),
    "distributed": Entry(
        lambda: BristleModel(DistributedModel), "DistributedModel, stiff bristles"
    ),
    "mu(v) and radius": Entry(
        SpeedModel,
        "exact surface, friction that grows with speed, fitted radius (slides only)",
    ),
    "toss by toss": Entry(
        TossModel,
        "the same with the friction, radius and centre of each toss (slides only)",
    ),
    "MuJoCo box": Entry(
        MujocoBox,
        "MuJoCo's own contact of a box, elliptic cone, condim 3 (slides only)",
        "mujoco",
        "mujoco",
    ),
}
"""Models by name, from the simplest on."""


def library(left_out: list[str] | None = None) -> dict[str, Any]:
    """Return the library's models that are installed, by name; what is missing is added to `left_out`."""
    for name, entry in LIBRARY.items():
        if not entry.installed and left_out is not None:
            left_out.append(
                f"{name}: needs {entry.needs}, pip install 'planarfriction[{entry.extra}]'"
            )
    return {name: entry.make() for name, entry in LIBRARY.items() if entry.installed}
