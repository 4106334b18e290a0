"""Published parameters, models by their letters in the paper, and runs as arrays, which the experiments share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from planarfriction.geometry import wrench_at
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import (
    LimitSurfaceEllipsoid,
    LimitSurfaceTablePublished,
)
from planarfriction.models import DistributedModel, ReducedModelPublished
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch
from planarfriction.scenes import Scene, simulate
from planarfriction_studies.experiments.experiment import POSE, TWIST, WRENCH, Arrays

WIDTH, CELLS = 0.02, 21
"""Width of the published patches [m], and cells along it."""

LAW = LuGre(mu_s=1.2, elasto_plastic=ElastoPlastic(0.9))
"""The published friction parameters with elasto-plastic bristles."""

PLAIN = LuGre(mu_s=1.2)
"""The same with plain bristles."""

Kind = Literal["d", "r", "e"]

NAMES: dict[str, str] = {"d": "distributed", "r": "reduced", "e": "ellipsoid"}
"""Letter of a model in the names of curves -> the model in words."""

SIX_SHAPES = ("Circle", "Square", "Line", "LineGrad", "NonConvex1", "NonConvex2")
"""The shapes of the velocity-driven experiment."""

IN_WORDS = {
    "Circle": "disc",
    "Square": "square",
    "Line": "line",
    "LineGrad": "line, linear pressure",
    "LineGradX": "line along x, linear pressure",
    "NonConvex1": "two pads",
    "NonConvex2": "T",
}
"""Published patch -> how figures call it."""


@dataclass(frozen=True, eq=False)
class PublishedEllipsoid(LimitSurfaceEllipsoid):
    """The ellipsoid with the contact radius of the published table, which is a smoothed sum."""

    def _radius(self) -> float:
        return LimitSurfaceTablePublished(self.patch).contact_radius


def published_model(
    kind: Kind, shape: str | ContactPatch, law: LuGre = LAW, *, width: float = 0.02
) -> Any:
    """Return the distributed model ("d"), the published reduced one ("r"), or that on the ellipsoid ("e")."""
    patch = PUBLISHED_PATCHES[shape](width=width) if isinstance(shape, str) else shape
    if kind == "d":
        return DistributedModel(patch, law)
    if kind == "r":
        return ReducedModelPublished(patch, law)
    return ReducedModelPublished(patch, law, surface=PublishedEllipsoid(patch))


def simulated(scene: Scene, **options: Any) -> Arrays:
    """Simulate a scene; returns time, motion and the wrench of the first contact about its frame's origin [SI]."""
    values = {
        name: history.values
        for name, history in simulate(scene, **options).histories.items()
    }
    body = {name: values[name] for name in ("time", *POSE, *TWIST)}
    return body | {name: values[name][:, 0] for name in (*WRENCH, "normal_force")}


def at_centre_of_pressure(run: Arrays, patch: ContactPatch) -> np.ndarray:
    """Return the friction wrench `[T, 3]` of a run about the centre of pressure of the patch."""
    return wrench_at(
        np.stack([run[name] for name in WRENCH], axis=-1), patch.centre_of_pressure()
    )
