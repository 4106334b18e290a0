"""Compile ahead what would otherwise be compiled on first use: after an installation, or when an image is built."""

from __future__ import annotations

import functools
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np

from planarfriction import coupling, derivatives, joints, limit_surface, models
from planarfriction._engine.compiler import parallel, threads
from planarfriction._engine.compiler.messages import expect_compilation, show, watched
from planarfriction.families import MODELS
from planarfriction.laws import LuGre
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch, friction_metric
from planarfriction.scenes import SolverOptions, in_hand, simulate
from planarfriction.sliding_body import SlidingBody

_INSTANT = SolverOptions(t_end=1e-3)
"""Options of runs: compiling does not depend on how far they go."""


def warm_up(*, progress: Callable[[str], None] | None = None) -> dict[str, float]:
    """Compile everything now and keep it on disk; returns the time that each part took [s].

    Each processor compiles other parts, in a separate process. Code that was compiled before is read from the
    cache. `progress` is called with the description of each part before it begins; without it, a line on the
    terminal or in the notebook names the part. Compiled functions are kept, so Ctrl-C loses only the current one.
    Machine code is stored beside the sources, or in the user's cache if that folder is not writable, or in the
    folder named by `NUMBA_CACHE_DIR`. If none is possible, each process compiles again, and a warning says so.
    """
    shown = progress is None and watched()
    expect_compilation()
    told = progress or (lambda words: show(f"compiling: {words}") if shown else None)
    parts = _parts()
    times = {}
    code = "from planarfriction import warm; warm.serve()"
    with parallel.Crew(
        code, range(len(parts)), processes=threads.processors() - 1
    ) as crew:
        for job, (words, work) in enumerate(parts.items()):
            told(words)
            begin = time.perf_counter()
            if crew.take(job):
                work()
            times[words] = crew.seconds.get(job, time.perf_counter() - begin)
    if shown:
        show(f"compiled {len(times)} parts in {sum(times.values()):.1f} s")
        print(file=sys.stderr)
    return times


def serve() -> None:
    """Compile parts for another process."""
    parts = list(_parts().values())
    parallel.serve(lambda job: parts[job]())


def _parts() -> dict[str, Callable[[], Any]]:
    """Return functions that use a part of the code, and thereby compile it or read it from the cache, by its words.

    Neighbours share functions, which one process then compiles once for them.
    """
    patch = ContactPatch.disc(radius=0.01, cells=5)
    law = LuGre(mu_s=1.2, elasto_plastic=0.9)
    cells, reduced, published = (
        MODELS[name](patch, law)
        for name in ("distributed", "reduced", "reduced-published")
    )
    grooved = models.DistributedModel(
        patch.with_friction_metric(friction_metric(0.0, along=1.0, across=0.8)), law
    )
    return {
        **_of(cells, "distributed", *_WORK),
        **_of(grooved, "anisotropic", "scenes", "rollouts"),
        **_of(reduced, "reduced", *_WORK),
        "coupled patches": functools.partial(
            _couple, [cells, reduced, published, grooved]
        ),
        **({"steps inside MuJoCo": _host} if find_spec("mujoco") else {}),
        "derivatives of scenes in reverse": functools.partial(_reverse, reduced),
        **_of(published, "reduced-published", *_WORK),
        "limit surfaces": functools.partial(_surfaces, patch),
        "joints": _joints,
    }


def _of(model: Any, name: str, *kinds: str) -> dict[str, Callable[[], Any]]:
    """Return parts of these kinds of work with a model."""
    return {f"{kind}, {name}": functools.partial(_WORK[kind], model) for kind in kinds}


def _reverse(model: Any) -> None:
    derivatives.scene_gradient(
        in_hand(model),
        lambda time, motion: np.ones_like(motion),
        ["mu"],
        options=_INSTANT,
    )


def _step(model: Any) -> None:
    state = model.rest()
    twist = (0.01, 0.0, 1.0)
    for method in (model.rate, model.wrench, model.jacobians):
        method(state, twist, 1.0)
    for method in (model.step, model.step_jacobians):
        method(state, twist, 1.0, 1e-4)
        method(state, np.tile(twist, (2, 1)), 1.0, 1e-4)
        method(state, twist, 1.0, 1e-4, moments=(0.0, 0.0))


def _couple(kinds: list[Any]) -> None:
    patches = coupling.CoupledPatches(kinds)
    k = len(kinds)
    host = coupling.HostStep(
        np.ones((k, 3)),
        np.ones(k),
        np.zeros((k, 3)),
        np.eye(3 * k),
        moments=np.zeros((k, 2)),
    )
    patches.step(patches.rest(), host, 1e-4)
    body = SlidingBody(1.0, 1.0, kinds)
    body.step(body.rest(), (0.0, 0.0, 0.0), np.ones(k), 1e-4)


def _host() -> None:
    from planarfriction.adapters.mujoco.loops import step

    step.compile_ahead()


def _roll(model: Any) -> None:
    arguments = None, np.tile((0.01, 0.0, 1.0), (2, 1)), 1.0, 1e-4
    derivatives.rollout(model, *arguments)
    derivatives.rollout_vjp(model, *arguments, np.ones((2, 3)))
    derivatives.rollout_jacobian(model, *arguments)
    derivatives.rollout_jvp(model, *arguments)


def _joints() -> None:
    time = np.linspace(0.0, 4.0, 400)
    plant = joints.Plant(inertia=0.1)
    q = np.sin(2.0 * time) + 0.3 * np.sin(5.0 * time)
    push = joints.JointFriction(1.0).along(time, np.gradient(q, time))
    for log in (
        joints.JointLog(time, q, torque=push),
        joints.JointLog(time, q, voltage=push),
    ):
        joints.identify_joint([log] * 4, plant, terms=())


def _surfaces(patch: ContactPatch) -> None:
    kinds = (
        limit_surface.LimitSurfaceExact,
        limit_surface.LimitSurfaceCells,
        limit_surface.LimitSurfaceTable,
    )
    for kind in (
        *kinds,
        limit_surface.LimitSurfaceTablePublished,
        limit_surface.LimitSurfaceEllipsoid,
    ):
        surface = kind(patch)
        surface.jacobian((0.01, 0.0, 1.0))
        surface.twist(surface.wrench((0.01, 0.0, 1.0)))
    for each in (
        ContactPatch.rectangle(0.01, cells=5),
        PUBLISHED_PATCHES["NonConvex1"](),
    ):
        each.grid_error()  # by the loops of polygons


_WORK: dict[str, Callable[[Any], Any]] = {
    "scenes": lambda model: simulate(in_hand(model), t_end=_INSTANT.t_end),
    "steps": _step,
    "rollouts": _roll,
    "derivatives of scenes": lambda model: derivatives.scene_sensitivities(
        in_hand(model), options=_INSTANT
    ),
}
"""Kinds of work with a model."""
