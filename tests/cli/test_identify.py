"""`planarfriction identify`: estimates on stdout, files in the folder, one line for what is wrong."""

import contextlib
import json
import re
import threading
import time

import pytest

from planarfriction._support.validation import number_in
from planarfriction.cli import console, main
from planarfriction.cli.output import write_csv
from planarfriction.errors import InvalidValueError
from planarfriction.identify.logs import columns_of
from tests.support.identification_logs import clean_log, excitation, noisy

FAST = [
    "--parameters",
    "mu_c,contact_radius",
    "--starts",
    "1",
    "--nuisance",
    "none",
    "--model",
    "reduced-published",
]
START = [f"--start={name}={value}" for name, value in {"mu_s": 0.65, "v_s": 2e-3, "gamma": 1.4, "sigma_0": 2e4, "sigma_1": 30, "sigma_2": 0.8}.items()]  # fmt: skip  # noqa: E501


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "slow run.csv"
    write_csv(path, columns_of(noisy(clean_log(*excitation(duration=0.5)), 1)))
    return path


def test_estimates_json_and_picture(path, tmp_path, capsys):
    out = tmp_path / "new" / "folder"
    assert (
        main(
            ["identify", str(path), "--patch", "disc", *FAST, *START, "--out", str(out)]
        )
        == 0
    )
    captured = capsys.readouterr()
    assert (
        "contact_radius" in captured.out
        and "slow run: 500 samples, disc" in captured.out
    )
    assert captured.err.count("wrote") == 2
    assert re.search(
        r"time: reading [\d.]+ s, reduced-published [\d.]+ s", captured.err
    )
    data = json.loads((out / "slow-run-identification.json").read_text())
    assert data["parameters"]["mu_c"]["estimate"] == pytest.approx(0.5, abs=0.01)
    assert (out / "slow-run-residuals.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (["vx", "vy"], "are vx and vy in mm/s"),
        (["tau"], "or tau in N mm"),
        (["t"], "is it in ms?"),
    ],
)
def test_wrong_units_are_doubted_before_the_fit(
    columns, words, tmp_path, capsys, monkeypatch
):
    """Names without a unit that hold mm/s, N mm or ms are doubted in lines, however long the fit takes."""

    def stop(*_, **__):
        raise InvalidValueError("fit", "not begin", "a fit")

    monkeypatch.setattr("planarfriction.identify.identify_lugre", stop)
    log = dict(columns_of(clean_log(*excitation(duration=0.5))))
    for name in columns:
        log[name] = 1e3 * log[name]
    write_csv(tmp_path / "log.csv", log)
    assert main(["identify", str(tmp_path / "log.csv"), "--patch", "disc"]) == 2
    *warnings, error = capsys.readouterr().err.splitlines()
    assert all(each.startswith("warning: ") for each in warnings)
    assert words in "\n".join(warnings), warnings
    assert "a fit" in error


def test_ctrl_c_prints_what_was_found_so_far(path, capsys, monkeypatch):
    after = iter(range(4))

    def shown(text):
        if "evaluation" in text and next(after, None) is None:
            raise KeyboardInterrupt

    monkeypatch.setattr(
        "planarfriction.cli.console.work_progress",
        lambda label: contextlib.nullcontext(shown),
    )
    assert main(["identify", str(path), "--patch", "disc", *FAST, *START]) == 130
    (line,) = capsys.readouterr().out.splitlines()
    words, _, found = line.partition("[SI]: ")
    assert "not finished" in words and "without intervals" in words
    assert float(found.split(", ")[0].removeprefix("mu_c = ")) == pytest.approx(
        0.5, abs=0.05
    )
    assert "contact_radius = " in found


def test_progress_is_a_line_now_and_then_without_a_terminal(monkeypatch, capsys):
    monkeypatch.setattr(console, "EVERY", 0.05)
    with console.work_progress("identifying") as progress:
        progress("start 1 of 4")
        time.sleep(0.2)
    first, *others = capsys.readouterr().err.splitlines()
    assert first == "identifying: start 1 of 4, 0 s"
    assert len(others) < 4
    time.sleep(0.1)
    assert capsys.readouterr().err == ""  # nothing after the end


def test_a_line_of_progress_that_is_being_written_ends_before_the_end(monkeypatch):
    begun = threading.Event()
    written = []

    def write_slowly(text):
        begun.set()
        time.sleep(0.1)
        written.append(text)

    monkeypatch.setattr(console, "EVERY", 0.01)
    monkeypatch.setattr(console, "note", write_slowly)
    with console.work_progress("identifying"):
        assert begun.wait(10.0)
    assert written


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "LOG"),
        (["LOG", "--patch", "disk"], "disc"),
        (["LOG", "--start", "mu_c=much"], "number"),
        (["LOG", "--starts", "0"], "starts"),
        (["LOG", "--out", "LOG"], "folder"),
    ],
)
def test_what_is_wrong_is_one_line(path, capsys, options, words):
    assert (
        main(
            [
                "identify",
                *(str(path) if option == "LOG" else option for option in options),
            ]
        )
        == 2
    )
    message = capsys.readouterr().err
    assert (
        message.startswith("error: ") and message.count("\n") == 1 and words in message
    ), message


def test_a_bad_line_is_named(path, tmp_path, capsys):
    lines = path.read_text().splitlines()
    lines[7] = lines[7].replace(",", ",x", 1)
    bad = tmp_path / "bad.csv"
    bad.write_text("\n".join(lines))
    assert main(["identify", str(bad)]) == 2
    message = capsys.readouterr().err
    assert "line 8, column 'vx'" in message and message.count("\n") == 1


@pytest.mark.parametrize("text", ["nan", "inf", "-1e999", "1,0", ""])
def test_numbers_on_the_command_line_are_finite(text, path, capsys):
    assert main(["identify", str(path), f"--start=mu_c={text}"]) == 2
    assert "error: --start mu_c must be " in capsys.readouterr().err
    assert number_in("--start", " 1e-3") == 1e-3
