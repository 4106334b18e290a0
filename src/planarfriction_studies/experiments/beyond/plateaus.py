"""Plateaus: the angle by which each model turns a disc under a torque that friction holds."""

from __future__ import annotations

from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.scenes import simulate
from planarfriction.scenes.ready import GRAVITY, drift
from planarfriction_studies.experiments.drift.runs import TORQUE, WIDTH
from planarfriction_studies.experiments.experiment import Comparison, compare
from planarfriction_studies.experiments.runs import LAW, columns

MODELS = {"distributed": DistributedModel, "published reduced": ReducedModelPublished, "ReducedModel": ReducedModel}

SHARE = 1e-3
"""Tolerance of the plateau of `ReducedModel` against the distributed model's, as a share of it."""


def plateaus() -> dict[str, float]:
    """Return the angle [rad] of the published disc under a torque that friction holds, by model, and in closed form."""
    patch = PUBLISHED_PATCHES["Circle"](width=WIDTH)
    result = {}
    for name, model in MODELS.items():
        scene = drift(model(patch, LAW), load="normal", t_end=1.0)
        result[name] = float(columns(simulate(scene, rtol=1e-7, atol=3e-7))["theta"][-1])
    return result | {"closed form": TORQUE / (LAW.sigma_0 * GRAVITY * float(patch.second_moment()))}


def comparisons(angles: dict[str, float]) -> list[Comparison]:
    """Compare plateaus with the distributed model and the closed form."""
    stiff = (
        r"The same torsional stiffness, $\sigma_0 \langle\rho^2\rangle$; what is left is that bristles near the "
        "threshold give way."
    )
    settled = "Bristles that are not yet at rest, and the tolerance of the solver."
    ours, whole, exact = (angles[name] for name in ("ReducedModel", "distributed", "closed form"))
    words = "torsional plateau, ReducedModel"
    return [
        compare(f"{words} beside distributed", ours, whole, "converged", SHARE * whole, "rad", stiff),
        compare(words, ours, exact, "closed form", SHARE * exact, "rad", settled),
    ]
