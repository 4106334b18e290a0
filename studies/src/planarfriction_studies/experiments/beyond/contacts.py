"""Single contacts beyond the paper: a grooved sole, a disc that friction holds, a finger that the load flattens."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction import scenes
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import LimitSurfaceTable
from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch, friction_metric
from planarfriction.scenes import Body, Contact, Scene
from planarfriction.scenes.ready import GRAVITY, drift
from planarfriction_studies.experiments.drift.run import TORQUE, WIDTH
from planarfriction_studies.experiments.experiment import Comparison, compare_all
from planarfriction_studies.experiments.in_hand.runs import end_distance
from planarfriction_studies.experiments.load_dependent.run import soft_patch
from planarfriction_studies.experiments.runs import LAW, simulated

GRAIN = {"angle": np.radians(-50.0), "along": 0.6, "across": 1.0}
"""Direction of the grooves from the x axis [rad], friction along and across them relative to `GROOVED`."""

GROOVED = LuGre(
    mu_c=0.5,
    mu_s=0.5,
    sigma_0=1e5,
    sigma_1=200.0,
    sigma_2=0.0,
    elasto_plastic=ElastoPlastic(0.9),
)
"""Law of the grooved sole."""

GROOVED_MODELS = ("distributed", "ReducedModel", "published reduced, LimitSurfaceTable")

SLOPES = (22.0, 25.0, 30.0, 40.0, 50.0, 60.0)
"""Slopes of the incline [deg]."""

MASS, BLOCK, SLIDE = 0.4, (0.06, 0.04), 0.55
"""Mass [kg] and sides [m] of the block, and for how long it slides [s]."""

HELD_MODELS = {
    "distributed": DistributedModel,
    "published reduced": ReducedModelPublished,
    "ReducedModel": ReducedModel,
}

SHARE = 1e-3
"""Tolerance of a plateau against its closed form, as a share of it."""

TIME, QUICK_TIME = 2.0, 0.05
"""End of the in-hand run with the soft finger [s]: the load changes every 0.01 s."""

LOADS = (0.83, 1.37)
"""Loads at which steady wrenches of few discs are compared with those of all cells [N]."""


def metric() -> np.ndarray:
    """Return the friction metric `[2, 2]` of the grooved sole."""
    return friction_metric(GRAIN["angle"], GRAIN["along"], GRAIN["across"])


def closed_drift(slope: float) -> float:
    """Return the angle [rad] from the fall line in which a block slides from rest down an incline of `slope` [rad].

    With M the metric, d the fall line and e the direction: `e x (tan(slope) d - mu M e/sqrt(e'Me)) = 0`.
    """
    from scipy.optimize import brentq

    m = metric()
    down = np.array([0.0, -1.0])

    def turning(angle: float) -> float:
        e = np.array([np.sin(angle), -np.cos(angle)])
        pull = np.tan(slope) * down - GROOVED.mu_c * m @ e / np.sqrt(e @ m @ e)
        return float(e[0] * pull[1] - e[1] * pull[0])

    first = np.linalg.solve(m, down)
    far = 1.2 * np.arctan2(first[0], -first[1])
    return float(brentq(turning, 0.0, far, xtol=1e-14))  # pyright: ignore[reportArgumentType]


def _slid(slope: float, model: Any) -> float:
    """Return the angle [rad] from the fall line to where the block went, simulated with bristles."""
    body = Body(
        MASS,
        MASS / 12.0 * (BLOCK[0] ** 2 + BLOCK[1] ** 2),
        gravity=(0.0, -GRAVITY * np.sin(slope)),
    )
    sole = Contact(
        model, MASS * GRAVITY * np.cos(slope), mounted_on="body", name="sole"
    )
    end = simulated(Scene(body, [sole], SLIDE, name="grooves"), rtol=1e-7, atol=1e-5)
    return float(np.arctan2(end["x"][-1], -end["y"][-1]))


def grooves(quick: bool) -> dict[str, Any]:
    """Return the drift [rad] over the slope [rad], simulated with every model and in closed form."""
    slopes = np.radians(SLOPES[1:4:2] if quick else SLOPES)
    patch = ContactPatch.rectangle(*BLOCK, 15).with_friction_metric(metric())
    table = ReducedModelPublished(patch, GROOVED, surface=LimitSurfaceTable(patch))
    every = (DistributedModel(patch, GROOVED), ReducedModel(patch, GROOVED), table)
    drifts = {
        kind: [_slid(s, model) for s in slopes]
        for kind, model in zip(GROOVED_MODELS, every, strict=True)
    }
    return {
        "slope": slopes,
        "closed form": [closed_drift(slope) for slope in slopes],
        **drifts,
    }


def grooves_comparisons(found: dict[str, Any]) -> list[Comparison]:
    """Compare directions of drift with the closed form."""
    cause = "The bristles bend before they slide: a way of micrometres, in the direction of the pull."
    closed = np.asarray(found["closed form"])
    return compare_all(
        "closed form",
        (
            (
                f"drift on grooves, {kind}, all slopes",
                found[kind],
                closed,
                2e-4,
                "rad",
                cause,
            )
            for kind in GROOVED_MODELS
        ),
    )


def plateaus() -> dict[str, float]:
    """Return the angle [rad] of the published disc under a torque that friction holds, by model, and in closed form."""
    patch = PUBLISHED_PATCHES["Circle"](width=WIDTH)
    result = {}
    for name, model in HELD_MODELS.items():
        scene = drift(model(patch, LAW), load="normal", t_end=1.0)
        result[name] = float(simulated(scene, rtol=1e-7, atol=3e-7)["theta"][-1])
    moments = {
        "closed form": patch.second_moment(),
        "closed form, discs": patch.discs().second_moment(),
    }
    return result | {
        name: TORQUE / (LAW.sigma_0 * GRAVITY * float(moment))
        for name, moment in moments.items()
    }


def plateau_comparisons(angles: dict[str, float]) -> list[Comparison]:
    """Compare plateaus with the closed forms: of cells as points, and of cells that have an extent."""
    cause = (
        r"The same torsional stiffness, $\sigma_0 \langle\rho^2\rangle$; what is left is that bristles near the "
        "threshold give way, and the tolerance of the solver."
    )
    rows = (("distributed", "closed form"), ("ReducedModel", "closed form, discs"))
    return compare_all(
        "closed form",
        (
            (
                f"torsional plateau, {name}",
                angles[name],
                angles[exact],
                SHARE * angles[exact],
                "rad",
                cause,
            )
            for name, exact in rows
        ),
    )


def soft_finger(quick: bool) -> dict[str, float]:
    """Compare discs with all cells of a finger whose pressure flattens with the load (k = 2 f_N).

    Returned are the end of an in-hand run [s], distances of ends from the distributed model's there [m], and the
    largest difference of steady wrenches at 1 N [N, N m].
    """
    patch = soft_patch(2)
    t_end = QUICK_TIME if quick else TIME
    whole = DistributedModel(patch, LAW)
    few = ReducedModel(patch, LAW)
    models = {
        "distributed": whole,
        "reduced": few,
        "published": ReducedModelPublished(patch, LAW),
    }
    ended = {
        name: simulated(scenes.in_hand(model), t_end=t_end)
        for name, model in models.items()
    }
    apart = np.array([_steady_apart(few, whole, load) for load in LOADS]).max(axis=0)
    return {
        "end [s]": t_end,
        "reduced [m]": end_distance(ended["reduced"], ended["distributed"]),
        "published [m]": end_distance(ended["published"], ended["distributed"]),
        "steady force [N]": float(apart[:2].max()),
        "steady torque [N m]": float(apart[2]),
    }


def _steady_apart(model: Any, rebuilt: Any, load: float) -> np.ndarray:
    """Return the largest difference `[3]` of steady wrenches at 1 N between two models at a load [N]."""
    generator = np.random.default_rng(3)
    twists = (
        generator.normal(size=(200, 3))
        * [1.0, 1.0, 150.0]
        * 10.0 ** generator.uniform(-4.0, -1.5, (200, 1))
    )
    wrenches = [
        each.step(np.zeros((200, *each.state_shape)), twists, load, 10.0)[1]
        for each in (model, rebuilt)
    ]
    return np.abs(wrenches[0] - wrenches[1]).max(axis=0) / load
