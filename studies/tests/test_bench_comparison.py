"""`planarfriction bench --compare`: changes of ratios with their spread, on a machine that nobody else uses."""

import dataclasses
import json
import subprocess
import sys

import pytest

from planarfriction.cli import main
from planarfriction.errors import FileError
from planarfriction_studies import bench
from planarfriction_studies.bench import comparison, running
from planarfriction_studies.bench.measurement import Measurement
from tests.support.refusals import refused


def measured(name, *ratios):
    """A benchmark of 2 s, with the ratios of its rounds, in order."""
    middle = ratios[len(ratios) // 2]
    return Measurement(
        name,
        2.0,
        "s",
        "theirs",
        2.0 * middle,
        middle,
        ratios if len(ratios) > 1 else (),
    )


def test_a_change_counts_where_its_whole_spread_is_on_one_side():
    then = {
        each.name: each
        for each in (
            measured("a", 2.0),
            measured("b", 2.0, 3.0, 4.0),
            measured("c", 5.0),
        )
    }
    now = [
        measured("a", 3.0, 4.0, 6.0),
        measured("b", 3.0, 4.5, 5.0),
        measured("c", 1.0),
        measured("new", 1.0),
    ]
    found = comparison.changes(
        [*now, Measurement("c", None, "", "left out", None, None)], then
    )
    assert [each[2:] for each in found] == [
        (2.0, 1.5, 3.0),
        (1.5, 0.75, 2.5),
        (0.2, 0.2, 0.2),
    ]
    assert [row[-1] for row in comparison.rows(found)] == ["faster", "", "slower"]


def test_several_rounds_give_the_one_in_the_middle(monkeypatch):
    values = iter((1.0, 4.0, 2.0))
    monkeypatch.setitem(
        running.BENCHMARKS, "import", lambda full: measured("", next(values))
    )
    (found,) = bench.run(["import"], rounds=3)
    assert found == dataclasses.replace(measured("import", 2.0), ratios=(1.0, 2.0, 4.0))


@pytest.fixture
def old(tmp_path, monkeypatch):
    """A stored run of two benchmarks; the next one is twice as fast."""
    monkeypatch.setattr(comparison, "free_share", lambda: 1.0)
    monkeypatch.setitem(running.BENCHMARKS, "import", lambda full: measured("", 4.0))
    monkeypatch.setitem(
        running.BENCHMARKS, "sweep", lambda full: pytest.fail("is not in the file")
    )
    path = tmp_path / "old.json"
    path.write_text(
        json.dumps([dataclasses.asdict(measured("import", 2.0))]), encoding="utf-8"
    )
    return path


def test_two_runs_are_compared_in_a_table(old, capsys):
    assert main(["bench", "--compare", str(old)]) == 0
    (row,) = [line for line in capsys.readouterr().out.splitlines() if "import" in line]
    assert [cell.strip() for cell in row.strip("│").split("│")][5:] == [
        "2.000",
        "2.000 to 2.000",
        "faster",
    ]


def test_a_busy_machine_is_refused_unless_forced(old, capsys, monkeypatch):
    monkeypatch.setattr(comparison, "free_share", lambda: 0.5)
    assert main(["bench", "--compare", str(old)]) == 2
    assert (
        "machine must be idle for a comparison (or give --force), got 50%"
        in capsys.readouterr().err
    )
    assert main(["bench", "--compare", str(old), "--force"]) == 0


def test_busy_loops_say_what_they_got(monkeypatch):
    monkeypatch.setattr(comparison, "processors", lambda: 2)
    monkeypatch.setattr(
        comparison, "_LOOP", "import os; print(1 / (1 + os.getpid() % 2))"
    )
    assert comparison.free_share() in (0.5, 1.0)


@pytest.mark.parametrize("text", ["{", "[1]", '[{"name": "import"}]', '{"name": 1}'])
def test_another_file_is_refused_in_one_line(tmp_path, text):
    (tmp_path / "old.json").write_text(text, encoding="utf-8")
    with refused("is not what planarfriction bench --json prints", FileError):
        comparison.read_run(tmp_path / "old.json")


def test_the_command_line_loads_numpy_after_threads_are_pinned():
    code = "import sys; from planarfriction.cli.app import app; app.add_installed(); print('numpy' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "False"
