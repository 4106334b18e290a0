"""Plateaus of a torque that friction holds, a contact that grows with the load, and friction with a grain."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from planarfriction import scenes
from planarfriction.experiments.drift.runs import TORQUE, WIDTH
from planarfriction.experiments.experiment import Comparison, compare_number
from planarfriction.experiments.load_dependent.models import soft_patch
from planarfriction.experiments.runs import LAW, columns
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.limit_surface import LimitSurfaceTable
from planarfriction.models import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch, grain
from planarfriction.scenes import Body, Contact, Scene, simulate
from planarfriction.scenes.ready import GRAVITY, drift

MODELS = {"distributed": DistributedModel, "published reduced": ReducedModelPublished, "ReducedModel": ReducedModel}

PLATEAU_SHARE = 1e-3
"""How near the plateau of `ReducedModel` shall be to the distributed model's, as a share of it."""

PLATEAU: dict[str, Any] = {"t_end": 1.0, "tolerances": {"rtol": 1e-7, "atol": 3e-7}}

FINGER_TIME = {False: 2.0, True: 0.05}
"""Quick or not -> end of the in-hand run with the soft finger [s]: the load changes every 0.01 s."""

FINGER_LOADS = (0.83, 1.37)
"""Loads at which steady wrenches from blended maps are compared with those of maps built at the load [N]."""

GROOVES = {"angle": np.radians(-50.0), "along": 0.6, "across": 1.0}
"""Direction of the grooves from the x axis [rad], friction along and across them relative to `GROOVED_LAW`."""

GROOVED_LAW = LuGre(mu_c=0.5, mu_s=0.5, sigma_0=1e5, sigma_1=200.0, sigma_2=0.0, elasto_plastic=ElastoPlastic(0.9))

GROOVED_MODELS = ("distributed", "ReducedModel", "published reduced, LimitSurfaceTable")

SLOPES = (22.0, 25.0, 30.0, 40.0, 50.0, 60.0)
"""Of the incline [deg]."""

MASS, BLOCK, SLIDE = 0.4, (0.06, 0.04), 0.55
"""Mass [kg] and sides [m] of the block, and for how long it slides [s]."""


# ------------------------------------------------------------------ plateaus


def plateaus() -> dict[str, float]:
    """Angle [rad] of the published disc under a torque that friction holds, by model, and in closed form."""
    patch = PUBLISHED_PATCHES["Circle"](width=WIDTH)
    result = {}
    for name, model in MODELS.items():
        scene = drift(model(patch, LAW), load="normal", t_end=PLATEAU["t_end"])
        result[name] = float(columns(simulate(scene, **PLATEAU["tolerances"]))["theta"][-1])
    stiffness = LAW.sigma_0 * GRAVITY * float(patch.second_moment())
    return result | {"closed form": TORQUE / stiffness}


# ------------------------------------------------------------------ load families


def load_family(quick: bool) -> dict[str, float]:
    """`ReducedModel` on a soft finger whose pressure flattens with the load (k = 2 f_N).

    The wall time of the in-hand run [s] (all of `simulate`) with a new model, which builds its maps on the way, and
    again with the same one; the same for the published model; that of a square whose shape is fixed. From a model that
    builds a map at every load (at few loads, for it is slow): largest distance of steady wrenches at 1 N [N, N m].
    """
    t_end, patch = FINGER_TIME[quick], soft_patch(2)
    model, published = ReducedModel(patch, LAW), ReducedModelPublished(patch, LAW)
    square = ReducedModel(PUBLISHED_PATCHES["Square"](), LAW)
    rebuilt = ReducedModel(patch, LAW, load_error=0.0)
    times = {
        "first time [s]": _time_of(model, t_end),
        "time [s]": _time_of(model, t_end),
        "published, first time [s]": _time_of(published, t_end),
        "published, time [s]": _time_of(published, t_end),
        "fixed shape, time [s]": min(_time_of(square, t_end) for _ in range(3)),
        "maps": len(model.load_rungs),
    }
    apart = np.array([_steady_apart(model, rebuilt, load) for load in FINGER_LOADS]).max(axis=0)
    return times | {
        "end [s]": t_end,
        "force from rebuilding [N]": float(apart[:2].max()),
        "torque from rebuilding [N m]": float(apart[2]),
    }


def _steady_apart(model: Any, rebuilt: Any, load: float) -> np.ndarray:
    """Largest difference `[3]` of steady wrenches at 1 N between two models at a load [N]."""
    generator = np.random.default_rng(3)
    twists = generator.normal(size=(200, 3)) * [1.0, 1.0, 150.0] * 10.0 ** generator.uniform(-4.0, -1.5, (200, 1))
    wrenches = [each.step(np.zeros((200, 3)), twists, load, 10.0)[1] for each in (model, rebuilt)]
    return np.abs(wrenches[0] - wrenches[1]).max(axis=0) / load


def _time_of(model: Any, t_end: float) -> float:
    """Wall time of the in-hand run [s]."""
    scene = scenes.in_hand(model)
    begin = time.perf_counter()
    simulate(scene, t_end=t_end)
    return time.perf_counter() - begin


# ------------------------------------------------------------------ grooves


def metric() -> np.ndarray:
    """Friction metric `[2, 2]` of the grooved sole."""
    return grain(GROOVES["angle"], GROOVES["along"], GROOVES["across"])


def closed_drift(slope: float) -> float:
    """Angle [rad] from the fall line in which a block slides from rest down an incline of `slope` [rad].

    With M the metric, d the fall line and e the direction: `e x (tan(slope) d - mu M e/sqrt(e'Me)) = 0`.
    """
    from scipy.optimize import brentq

    m, down = metric(), np.array([0.0, -1.0])

    def turning(angle: float) -> float:
        e = np.array([np.sin(angle), -np.cos(angle)])
        pull = np.tan(slope) * down - GROOVED_LAW.mu_c * m @ e / np.sqrt(e @ m @ e)
        return float(e[0] * pull[1] - e[1] * pull[0])

    first = np.linalg.solve(m, down)
    return float(brentq(turning, 0.0, 1.2 * np.arctan2(first[0], -first[1]), xtol=1e-14))  # pyright: ignore[reportArgumentType]


def slid(slope: float, model: Any) -> float:
    """Angle [rad] from the fall line to where the block went, simulated with bristles."""
    body = Body(MASS, MASS / 12.0 * (BLOCK[0] ** 2 + BLOCK[1] ** 2), gravity=(0.0, -GRAVITY * np.sin(slope)))
    sole = Contact(model, MASS * GRAVITY * np.cos(slope), mounted_on="body", name="sole")
    end = columns(simulate(Scene(body, [sole], SLIDE, name="grooves"), rtol=1e-7, atol=1e-5))
    return float(np.arctan2(end["x"][-1], -end["y"][-1]))


def grooves(quick: bool) -> dict[str, Any]:
    """Drift [rad] over the slope [rad], simulated with every model of `GROOVED_MODELS` and in closed form."""
    slopes = np.radians(SLOPES[1:4:2] if quick else SLOPES)
    patch = ContactPatch.rectangle(*BLOCK, 15).with_friction_metric(metric())
    table = ReducedModelPublished(patch, GROOVED_LAW, surface=LimitSurfaceTable(patch))
    every = (DistributedModel(patch, GROOVED_LAW), ReducedModel(patch, GROOVED_LAW), table)
    models = dict(zip(GROOVED_MODELS, every, strict=True))
    return {
        "slope": slopes,
        "closed form": [closed_drift(slope) for slope in slopes],
        **{kind: [slid(slope, model) for slope in slopes] for kind, model in models.items()},
    }


# ------------------------------------------------------------------ comparisons


def comparisons(angles: dict[str, float], grooved: dict[str, Any]) -> list[Comparison]:
    """Plateaus beside the distributed model and the closed form; directions of drift beside theirs."""
    stiff = (
        r"The same torsional stiffness, $\sigma_0 \langle\rho^2\rangle$; what is left is that bristles near the "
        "threshold give way."
    )
    settled = "Bristles that are not yet at rest, and the tolerance of the solver."
    rows = [
        compare_number(
            "torsional plateau, ReducedModel beside distributed", angles["ReducedModel"], angles["distributed"],
            reference="converged", tolerance=PLATEAU_SHARE * angles["distributed"], unit="rad", cause=stiff,
        ),
        compare_number(
            "torsional plateau, ReducedModel", angles["ReducedModel"], angles["closed form"],
            reference="closed form", tolerance=PLATEAU_SHARE * angles["closed form"], unit="rad", cause=settled,
        ),
    ]  # fmt: skip
    for kind in GROOVED_MODELS:
        miss = float(np.abs(np.asarray(grooved[kind]) - np.asarray(grooved["closed form"])).max())
        words = "The bristles bend before they slide: a way of micrometres, in the direction of the pull."
        quantity = f"drift on grooves, {kind}, all slopes"
        rows.append(Comparison(quantity, "closed form", miss, 2e-4, "rad", len(grooved["slope"]), words))
    return rows
