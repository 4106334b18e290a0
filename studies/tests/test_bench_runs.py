"""Every benchmark runs in its shortest form, and what it times returns what was recorded."""

from __future__ import annotations

import json

import pytest

from planarfriction_studies.bench import BENCHMARKS
from tests.support import recorded
from tests.support.studied import FOLDER, LONG, benchmark


def named(name: str):
    return pytest.param(name, marks=pytest.mark.slow if name.startswith(LONG) else ())


@pytest.mark.parametrize("name", [named(each) for each in BENCHMARKS])
def test_a_benchmark_measures_what_was_recorded(name):
    """Times are the numbers of the calls, so that values and ratios are known; those of a long one are not recorded."""
    found = benchmark(name)
    if found is None:
        pytest.skip("needs a package or a compiler that is not there")
    line, _ = found
    assert line["name"] == name and line["unit"] and line["baseline"]
    assert all(line[each] > 0.0 for each in ("value", "baseline_value", "ratio"))
    if not name.startswith(LONG):
        kept = json.loads((FOLDER / "benchmarks.json").read_text(encoding="utf-8"))
        assert [*recorded.differences(json.loads(json.dumps(found)), kept[name])] == []
