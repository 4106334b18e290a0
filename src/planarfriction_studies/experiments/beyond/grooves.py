"""A block with a grooved sole on inclines: friction with a grain lets it drift sideways."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import LimitSurfaceTable
from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.patch import ContactPatch, friction_metric
from planarfriction.scenes import Body, Contact, Scene, simulate
from planarfriction.scenes.ready import GRAVITY
from planarfriction_studies.experiments.experiment import Comparison, compare
from planarfriction_studies.experiments.runs import columns

GRAIN = {"angle": np.radians(-50.0), "along": 0.6, "across": 1.0}
"""Direction of the grooves from the x axis [rad], friction along and across them relative to `LAW`."""

LAW = LuGre(mu_c=0.5, mu_s=0.5, sigma_0=1e5, sigma_1=200.0, sigma_2=0.0, elasto_plastic=ElastoPlastic(0.9))

MODELS = ("distributed", "ReducedModel", "published reduced, LimitSurfaceTable")

SLOPES = (22.0, 25.0, 30.0, 40.0, 50.0, 60.0)
"""Slopes of the incline [deg]."""

MASS, BLOCK, SLIDE = 0.4, (0.06, 0.04), 0.55
"""Mass [kg] and sides [m] of the block, and for how long it slides [s]."""


def metric() -> np.ndarray:
    """Return the friction metric `[2, 2]` of the grooved sole."""
    return friction_metric(GRAIN["angle"], GRAIN["along"], GRAIN["across"])


def closed_drift(slope: float) -> float:
    """Return the angle [rad] from the fall line in which a block slides from rest down an incline of `slope` [rad].

    With M the metric, d the fall line and e the direction: `e x (tan(slope) d - mu M e/sqrt(e'Me)) = 0`.
    """
    from scipy.optimize import brentq

    m, down = metric(), np.array([0.0, -1.0])

    def turning(angle: float) -> float:
        e = np.array([np.sin(angle), -np.cos(angle)])
        pull = np.tan(slope) * down - LAW.mu_c * m @ e / np.sqrt(e @ m @ e)
        return float(e[0] * pull[1] - e[1] * pull[0])

    first = np.linalg.solve(m, down)
    return float(brentq(turning, 0.0, 1.2 * np.arctan2(first[0], -first[1]), xtol=1e-14))  # pyright: ignore[reportArgumentType]


def slid(slope: float, model: Any) -> float:
    """Return the angle [rad] from the fall line to where the block went, simulated with bristles."""
    body = Body(MASS, MASS / 12.0 * (BLOCK[0] ** 2 + BLOCK[1] ** 2), gravity=(0.0, -GRAVITY * np.sin(slope)))
    sole = Contact(model, MASS * GRAVITY * np.cos(slope), mounted_on="body", name="sole")
    end = columns(simulate(Scene(body, [sole], SLIDE, name="grooves"), rtol=1e-7, atol=1e-5))
    return float(np.arctan2(end["x"][-1], -end["y"][-1]))


def grooves(quick: bool) -> dict[str, Any]:
    """Return the drift [rad] over the slope [rad], simulated with every model of `MODELS` and in closed form."""
    slopes = np.radians(SLOPES[1:4:2] if quick else SLOPES)
    patch = ContactPatch.rectangle(*BLOCK, 15).with_friction_metric(metric())
    table = ReducedModelPublished(patch, LAW, surface=LimitSurfaceTable(patch))
    every = (DistributedModel(patch, LAW), ReducedModel(patch, LAW), table)
    models = dict(zip(MODELS, every, strict=True))
    return {
        "slope": slopes,
        "closed form": [closed_drift(slope) for slope in slopes],
        **{kind: [slid(slope, model) for slope in slopes] for kind, model in models.items()},
    }


def comparisons(found: dict[str, Any]) -> list[Comparison]:
    """Compare directions of drift with the closed form."""
    cause = "The bristles bend before they slide: a way of micrometres, in the direction of the pull."
    return [
        compare(
            f"drift on grooves, {kind}, all slopes",
            np.asarray(found[kind]),
            np.asarray(found["closed form"]),
            "closed form",
            2e-4,
            "rad",
            cause,
        )
        for kind in MODELS
    ]
