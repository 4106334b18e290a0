"""Workflows call commands that run here too: each step is a target of the Makefile, with names that there are."""

import re

import pytest

from planarfriction_studies.bench import BENCHMARKS
from tests.support.repository import ROOT

WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
MAKEFILE = ROOT / "Makefile"

pytestmark = pytest.mark.skipif(
    not WORKFLOWS or not MAKEFILE.exists(), reason="no workflows beside these tests"
)


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_each_step_calls_a_target(path):
    text = path.read_text(encoding="utf-8")
    made = MAKEFILE.read_text(encoding="utf-8")
    steps = re.findall(r"^ *(?:- )?run: *(.*)$", text, re.MULTILINE)
    steps = [step for step in steps if step]  # `defaults` has a table of that name
    assert steps
    for step in steps:
        found = re.fullmatch(r"make ([\w-]+)( [A-Z]+=(\"[^\"]*\"|[\w.-]+))*", step)
        assert found and re.search(rf"^{found[1]}:", made, re.MULTILINE), step
    assert "permissions:\n  contents: read\n" in text


def test_compared_benchmarks_exist():
    (names,) = re.findall(
        r"^COMPARED \?= (.*)$", MAKEFILE.read_text(encoding="utf-8"), re.MULTILINE
    )
    assert set(names.split()) <= set(BENCHMARKS)


def test_maintainers_read_about_every_workflow():
    page = (ROOT / "docs" / "maintaining.md").read_text(encoding="utf-8")
    assert all(f"| `{path.stem}` |" in page for path in WORKFLOWS)
