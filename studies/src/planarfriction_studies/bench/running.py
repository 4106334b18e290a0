"""The benchmarks by name, and what runs them.

Machines are shared and noisy: what runs on one thread is measured by its least processor time, in turns with its
baseline, all else by medians; `ratio` (baseline over value) says more than either.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial

from planarfriction._support import validation
from planarfriction.errors import MissingExtraError
from planarfriction.limit_surface import LimitSurfaceExact, LimitSurfaceTable
from planarfriction.models import ReducedModel, ReducedModelPublished
from planarfriction_studies.bench import (
    exported,
    gradients,
    mujoco_scenes,
    simulator_costs,
    steps,
    whole_runs,
    workflows,
)
from planarfriction_studies.bench.measurement import Measurement

BENCHMARKS: dict[str, Callable[[bool], Measurement]] = {
    "in_hand.distributed": whole_runs.distributed,
    "in_hand.distributed.101": whole_runs.distributed_101,
    "in_hand.published": whole_runs.published,
    "in_hand.published.load_2": partial(whole_runs.published, load=2),
    "in_hand.published.load_dependent": whole_runs.load_dependent,
    "in_hand.reduced": whole_runs.reduced,
    "in_hand.reduced.load_dependent": whole_runs.reduced_load_dependent,
    "table.build": steps.table_build,
    "twist.table.call": partial(steps.twist, kind=LimitSurfaceTable),
    "twist.table.batch": partial(steps.twist, kind=LimitSurfaceTable, count=1000),
    "twist.exact.call": partial(steps.twist, kind=LimitSurfaceExact),
    "twist.exact.batch": partial(steps.twist, kind=LimitSurfaceExact, count=1000),
    "step.published.loop": steps.published_loop,
    "step.distributed.loop": steps.distributed_loop,
    "step.published.call": steps.published_call,
    "step.reduced.loop": steps.reduced_loop,
    "step.reduced.loop.16": partial(steps.reduced_loop, cells=16),
    "step.reduced.call": steps.reduced_call,
    "step.reduced.slopes": steps.reduced_slopes,
    "step.reduced.four": steps.reduced_four,
    "warp.step.reduced": partial(steps.warp_step, kind=ReducedModel),
    "warp.step.published": partial(steps.warp_step, kind=ReducedModelPublished),
    "warp.coupled": steps.warp_coupled,
    **{
        f"export.step.{kind}": partial(exported.step, kind=kind)
        for kind in exported.MODELS
    },
    "export.step.reduced.vector": partial(exported.step, kind="reduced", vector=True),
    **{
        f"export.step.{kind}.instructions": partial(exported.instructions, kind=kind)
        for kind in exported.MODELS
    },
    **{
        f"export.step.{kind}.999": partial(exported.percentile, kind=kind)
        for kind in exported.MODELS
    },
    "body.call": steps.body,
    "body.call.sliding": partial(steps.body, slides=True),
    "body.call.overhead": steps.body_overhead,
    "body.call.4": partial(steps.body_feet, feet=4),
    "body.call.16": partial(steps.body_feet, feet=16),
    "export.body": exported.body,
    "coupled.four_feet.call": steps.coupled,
    "coupled.four_feet.batch": partial(steps.coupled, environments=1000),
    "mujoco.tray.1": partial(simulator_costs.mujoco_tray, blocks=1),
    "mujoco.tray.2": partial(simulator_costs.mujoco_tray, blocks=2),
    "mujoco.tray.8": partial(simulator_costs.mujoco_tray, blocks=8),
    "mujoco.grip": simulator_costs.mujoco_grip,
    "mujoco.rollout": simulator_costs.mujoco_rollout,
    "mjx.discs": simulator_costs.mjx_discs,
    "mujoco_warp.disc": partial(
        simulator_costs.mujoco_warp, scene=mujoco_scenes.disc(1.0, 10.0)
    ),
    "mujoco_warp.grip": partial(
        simulator_costs.mujoco_warp, scene=mujoco_scenes.grip()
    ),
    "batch.reduced": gradients.reduced_batch_alone,
    "rollout.reduced.20": steps.short_rollout,
    "gradient.reduced.20": gradients.short,
    "gradient.published": gradients.published,
    "gradient.published.batch": gradients.published_batch,
    "gradient.reduced": gradients.reduced,
    "gradient.reduced.batch": gradients.reduced_batch,
    "sensitivities.reduced": gradients.scene_to_friction,
    "sensitivities.knots": gradients.scene_to_knots,
    "sensitivities.gradient": gradients.cost_to_knots,
    "planning.grip": workflows.plan_grip,
    "planning.push": workflows.plan_push,
    "identify.log": workflows.identification,
    "identify.log.distributed": partial(workflows.identification, model="distributed"),
    "sweep": workflows.sweep,
    "import": whole_runs.importing,
}
"""Benchmarks by name: functions of whether the baselines that take minutes run in full, too."""


def run(
    names: Sequence[str] | None = None,
    *,
    full: bool = False,
    rounds: int = 1,
    progress: Callable[[str], None] | None = None,
) -> list[Measurement]:
    """Measure the benchmarks `names` (all by default); `full` also runs the baselines that take minutes.

    With several `rounds` each benchmark gives the round whose ratio is in the middle, and the ratios of all.

    Raises `InvalidValueError` for an unknown name.
    """
    rounds = validation.count("rounds", rounds)
    chosen = (
        list(BENCHMARKS)
        if names is None
        else [validation.choice("name", name, BENCHMARKS) for name in names]
    )
    results = []
    for name in chosen:
        if progress is not None:
            progress(name)
        try:
            found = sorted(
                (BENCHMARKS[name](full) for _ in range(rounds)),
                key=lambda each: each.ratio or 0.0,
            )
            ratios = (
                tuple(each.ratio for each in found if each.ratio is not None)
                if rounds > 1
                else ()
            )
            results.append(
                dataclasses.replace(found[len(found) // 2], name=name, ratios=ratios)
            )
        except MissingExtraError as missing:
            results.append(
                Measurement(name, None, "", f"left out: {missing}", None, None)
            )
    return results
