"""`planarfriction bench` and what the pages show of it: names, ratios, and tables that are made from its lines."""

import json
from pathlib import Path

import pytest

from planarfriction.cli import main
from planarfriction_studies import bench
from planarfriction_studies.bench.measurement import line
from tests.support.refusals import refused
from tests.support.repository import script

DOCS = Path(__file__).parents[2] / "docs"
LINE = {"name": "in_hand.distributed", "value": 0.0931, "unit": "s", "baseline": "LSODA over the first 0.1 s",
        "baseline_value": 0.668, "ratio": 129.4}  # fmt: skip


@pytest.fixture(scope="module")
def pages():
    """The script that writes numbers into pages, as a dictionary of its functions."""
    return vars(script("docs/make_tables.py"))


def test_a_benchmark_is_run_by_its_name():
    (found,) = bench.run(["table.build"])
    assert found.name == "table.build" and found.value is not None and found.value > 0.0
    assert found.ratio == pytest.approx(found.baseline_value / found.value)
    with refused("name must be one of"):
        bench.run(["nothing"])


def test_a_ratio_is_that_of_the_values_unless_it_is_given():
    assert line(2.0, "s", "theirs", 6.0).ratio == 3.0
    assert line(2.0, "s", "theirs", 6.0, 5.0).ratio == 5.0


def test_the_page_of_costs_names_benchmarks_that_there_are(pages):
    assert set(pages["COST"]) <= set(bench.BENCHMARKS)


def test_costs_become_a_table(pages):
    missing = {
        "name": "import",
        "value": None,
        "unit": "",
        "baseline": "left out",
        "baseline_value": None,
    }
    page = pages["with_tables"](
        "<!-- table: Cost -->\n\n| old |\n\nNext.\n", pages["costs"]([LINE, missing])
    )
    assert (
        "| 93 ms | 0.67 s: LSODA over the first 0.1 s | 130 | `in_hand.distributed` |\n\nNext."
        in page
    )
    assert "old" not in page and "import" not in page


def test_a_selection_of_a_table_keeps_its_rows_and_columns(pages):
    table = {
        "headings": ["run", "a", "b"],
        "rows": [["one", 1.0, 2.0], ["two", 3.0, 4.0]],
    }
    page = "<!-- table: T; selection -->\n\n| run | b |\n| --- | --- |\n| two | 0 |\n\nNext.\n"
    assert pages["with_tables"](page, {"T": table}) == page.replace("| 0 |", "| 4 |")


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (0.668, "s", "0.67 s"),
        (0.0931, "s", "93 ms"),
        (0.16, "us", "0.16 µs"),
        (3.7e3, "ns", "3700 ns"),
    ],
)
def test_times_as_one_reads_them(pages, value, unit, words):
    assert pages["shown"](value, unit) == words


def test_what_an_experiment_found_is_put_below_its_mark(pages):
    page = "<!-- verdict: drift -->\n\nOld\nwords.\n\n![a picture](b.png)\n\n<!-- verdict: other -->\n\nKept.\n"
    found = pages["with_verdicts"](page, {"drift": "It drifts."})
    assert found == page.replace("Old\nwords.", "It drifts.")
    assert pages["with_verdicts"](found, {"drift": "It drifts."}) == found


def test_the_table_fits_100_columns_with_its_units(monkeypatch, capsys):
    names = {name: bench.Measurement(name, 6.1234e-4, "ns per loaded cell and step", "", 6.8e-3, 11.1) for name in
             sorted(bench.BENCHMARKS, key=len)[-3:]}  # fmt: skip
    words = "SciPy LSODA over the first 0.1 s (the ratio is to the 31 ms of that window here)"
    lines = [*names.values(), line(93.1, "million contact-steps/s", words, 668.0)]
    lines.append(
        bench.Measurement(
            "absent", None, "", "left out: the package cannot be found " * 3, None, None
        )
    )
    monkeypatch.setattr(bench, "run", lambda *_, **__: lines)
    monkeypatch.delenv("COLUMNS", raising=False)
    assert main(["bench"]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert max(map(len, shown)) <= 100
    text = " ".join(" ".join(shown).split())
    assert (
        all(name in text for name in names) and "0.0006123" in text and "93.1" in text
    )


@pytest.mark.warp
def test_warp_prints_nothing_beside_the_json(capsys):
    warp = pytest.importorskip("warp", reason="needs the extra [warp]")
    warp.config.log_level = (
        0  # as a user's process has it; Warp says what it loads on stdout
    )
    assert main(["bench", "--only", "warp.step.reduced", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["name"] == "warp.step.reduced"
