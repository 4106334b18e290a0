"""`planarfriction doctor`: what it says of the installation, and that it notices what is wrong."""

import math
from types import SimpleNamespace

import pytest
from numba.core import config
from packaging.requirements import Requirement

from planarfriction._engine.compiler import SOURCES, machine_code
from planarfriction.cli import doctor, main
from tests.support.repository import ROOT


def lines(capsys):
    """The lines that were printed, by what stands before the first colon and space; the last one is the verdict."""
    *rows, verdict = capsys.readouterr().out.splitlines()
    return {"verdict": verdict} | dict(row.split(": ", 1) for row in rows)


@pytest.fixture
def quick(monkeypatch):
    """A doctor that simulates nothing, in a sound installation."""
    monkeypatch.setattr(
        doctor, "checks", lambda: [doctor.Check("one", lambda: 1.0, 1.0, 0.0)]
    )
    monkeypatch.setattr(
        doctor, "requirements", lambda: iter([("", [Requirement("numpy")])])
    )
    monkeypatch.setattr(doctor, "step_times", lambda: [])


def test_this_installation_is_sound(capsys):
    assert main(["doctor"]) == 0
    said = lines(capsys)
    assert said["verdict"] == "everything is as it should be"
    assert said["packages"].startswith("numpy ") and "step, reduced" in said
    outcomes = [words for name, words in said.items() if name.startswith("self-test, ")]
    assert len(outcomes) >= 5 and all(words.startswith("holds, ") for words in outcomes)
    assert any(
        name.startswith("machine code in ") and ", 0 damaged" in words
        for name, words in said.items()
    )


def fails():
    raise RuntimeError("no\ncompiler")


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (lambda: 1.1, "FAILS, 1.1 (expected 1 to 0.05)"),
        (lambda: math.nan, "FAILS, nan"),
        (fails, "FAILS, RuntimeError"),
    ],
)
def test_a_number_that_misses_is_said(quick, monkeypatch, capsys, found, words):
    monkeypatch.setattr(
        doctor, "checks", lambda: [doctor.Check("one", found, 1.0, 0.05)]
    )
    assert main(["doctor"]) == 1
    said = lines(capsys)
    assert said["self-test, one"].startswith(words) and said["verdict"].startswith(
        "something is wrong"
    )


@pytest.mark.parametrize(
    ("needs", "words"),
    [("numpy>=99", "(needs >=99)"), ("no-such-package", "no-such-package is missing")],
)
def test_a_package_that_is_missing_or_too_old_is_said(
    quick, monkeypatch, capsys, needs, words
):
    monkeypatch.setattr(
        doctor, "requirements", lambda: iter([("", [Requirement(needs)])])
    )
    assert main(["doctor"]) == 1
    assert words in lines(capsys)["packages"]
    monkeypatch.setattr(
        doctor, "requirements", lambda: iter([("", []), ("some", [Requirement(needs)])])
    )
    assert main(["doctor"]) == 0  # an extra may be missing
    assert words in lines(capsys)["extra some"]


def test_a_release_candidate_is_a_version_as_others(monkeypatch):
    monkeypatch.setattr(doctor.metadata, "version", lambda name: "3.1rc1")
    assert doctor.state_of(Requirement("numpy>=3")) == ("numpy 3.1rc1", True)


def test_packages_are_those_that_an_installation_names():
    named = {
        extra: [each.name for each in those] for extra, those in doctor.requirements()
    }
    assert "numpy" in named[""] and "torch" not in named[""]
    assert named["torch"] == ["torch"]


def test_damaged_machine_code_is_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    (folder,) = machine_code.folders(SOURCES)
    assert doctor.machine_code() == [(f"machine code in {folder}", "none")]
    folder.mkdir()
    content = bytes(150_000)
    sound = machine_code._seal(b"origin", content) + content
    (folder / "a.machine").write_bytes(sound)
    (folder / "b.machine").write_bytes(sound[:-1])
    assert doctor.machine_code() == [
        (f"machine code in {folder}", "2 functions, 0.3 MB, 1 damaged")
    ]


def test_the_time_of_a_step_is_the_median_in_microseconds(monkeypatch):
    model = SimpleNamespace(step=None, rest=lambda: None)
    monkeypatch.setattr(doctor, "_model", lambda name: model)
    monkeypatch.setattr(doctor, "partial", lambda *call: call)
    monkeypatch.setattr(
        doctor.timeit,
        "repeat",
        lambda call, number, repeat: [9e-6 * number, 4e-6 * number, 0.0],
    )
    assert doctor.step_times()[0] == ("step, reduced", "4.00 us")


def test_bug_reports_ask_for_the_output():
    assert "`planarfriction doctor`" in (
        ROOT / ".github" / "ISSUE_TEMPLATE" / "bug.yml"
    ).read_text(encoding="utf-8")
