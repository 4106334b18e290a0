"""Every benchmark runs in its shortest form."""

import itertools
from types import ModuleType

import pytest

from planarfriction_studies import bench
from planarfriction_studies.bench import running, whole_runs

SHORT = {
    "exported": {"STEPS": 2, "SAMPLES": 1000},
    "gradients": {"STEPS": 20},
    "simulator_costs": {
        "ROUNDS": 1,
        "STEPS": 2,
        "ENVIRONMENTS": 2,
        "MJX_STEPS": 2,
        "MJX_ROUNDS": 1,
        "WORLDS": 2,
    },
    "workflows": {
        "POWER_STEPS": 2,
        "DURATION": 0.2,
        "_MASSES": (0.1,),
        "_OFFSETS": (0.0,),
        "_GRIPS": (1.0,),
    },
}
"""Numbers of benchmarks that make them long, by module."""

LONG = (
    "export.step.reduced",
    "identify.",
    "mjx.",
    "mujoco_warp.",
    "sensitivities.",
    "warp.",
)
"""Benchmarks that compile for long; of exported steps those of one model show what both share."""


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(each, marks=[pytest.mark.slow] * each.startswith(LONG))
        for each in bench.BENCHMARKS
    ],
)
def test_a_benchmark_divides_the_time_of_its_baseline_by_its_own(name, monkeypatch):
    times = itertools.count(1)

    def timed(action, repeats=1, inner=1):
        action()
        return float(next(times))

    for module in {
        each for each in vars(running).values() if isinstance(each, ModuleType)
    }:
        for key, value in SHORT.get(module.__name__.rpartition(".")[2], {}).items():
            monkeypatch.setattr(module, key, value)
        for key in {"median", "once"} & set(vars(module)):
            monkeypatch.setattr(module, key, timed)
    monkeypatch.setattr(
        whole_runs, "lsoda_time", lambda scene, t_end: float(next(times))
    )
    (line,) = bench.run([name])
    if line.value is None:
        pytest.skip("needs a package or a compiler that is not there")
    assert line.name == name and line.unit and line.baseline
    assert line.value > 0.0 and line.baseline_value > 0.0 and line.ratio > 0.0
