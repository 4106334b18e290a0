"""Every benchmark runs once, in its shortest form: none raises at once because the library has moved on."""

from __future__ import annotations

import math

import pytest

from planarfriction_studies import bench
from planarfriction_studies.bench import exported, gradients, measurement, simulator_costs, steps, whole_runs, workflows

SHORT = {
    exported: {"STEPS": 2, "SAMPLES": 1000},
    gradients: {"STEPS": 20},
    simulator_costs: {"ROUNDS": 1, "STEPS": 2, "ENVIRONMENTS": 2, "MJX_STEPS": 2, "MJX_ROUNDS": 1, "WORLDS": 2},
    steps: {},
    whole_runs: {},
    workflows: {"POWER_STEPS": 2, "DURATION": 0.2, "_MASSES": (0.1,), "_OFFSETS": (0.0,), "_GRIPS": (1.0,)},
}
"""Numbers of benchmarks that make them long, by module."""

LONG = ("export.step.reduced", "identify.", "mjx.", "mujoco_warp.", "sensitivities.", "warp.")
"""Those that compile for long; of exported steps those of one model show what both share."""


def named(name: str):
    return pytest.param(name, marks=pytest.mark.slow if name.startswith(LONG) else ())


@pytest.mark.parametrize("name", [named(each) for each in bench.BENCHMARKS])
def test_a_benchmark_runs(name, monkeypatch):
    for module, numbers in SHORT.items():
        for constant, value in numbers.items():
            monkeypatch.setattr(module, constant, value)
        if hasattr(module, "median"):
            monkeypatch.setattr(module, "median", lambda action, repeats, inner=1: measurement.once(action))
    (found,) = bench.run([name])
    if found.value is None:
        pytest.skip(found.baseline)
    assert found.name == name and found.unit and found.baseline
    assert all(0.0 < each < math.inf for each in (found.value, found.baseline_value, found.ratio))
