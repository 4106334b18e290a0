"""`planarfriction reproduce`: what is kept, what is done again, what the report holds.

The experiments here are made up; the real ones have tests of their own.
"""

from __future__ import annotations

import base64
import dataclasses
import json
import re
import threading

import numpy as np
import pytest
from jinja2 import UndefinedError
from PIL import Image

from planarfriction.cli import main
from planarfriction_studies import experiments
from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.experiment import (
    Picture,
    Result,
    Table,
    Work,
    compare,
    compare_converged,
    compare_curve,
    dataset,
    table,
)
from planarfriction_studies.experiments.report import (
    WIDEST,
    _image,
    name_to_html,
    to_html,
    write_report,
)
from planarfriction_studies.experiments.reproduction import Reproduction
from planarfriction_studies.experiments.wording import (
    environment,
    fmt,
    number,
    power,
    report,
    short,
    span,
)
from tests.support.refusals import refused


class Made:
    """An experiment that counts what it does, can be interrupted once, and can miss its reference."""

    def __init__(self, name, *, interrupt_at="", theirs=2.0):
        self.name = name
        self.title = f"About <{name}>"
        self.interrupt_at = interrupt_at
        self.theirs = theirs
        self.done: list[str] = []

    def run(self, work):
        import xarray as xr

        from planarfriction.plots.style import new_figure

        values = work.pieces(
            {
                f"{self.name} {letter}": lambda letter=letter: self.compute(letter)
                for letter in "ab"
            }
        )
        figure = new_figure(3.0, 2.0)
        figure.subplots().plot([0.0, 1.0], [0.0, 1.0])
        ours = float(values[f"{self.name} b"]["value"])
        row = compare("one", ours, self.theirs, "published", 1e-3, "m", "none & all")
        table = Table(
            "Some",
            ["name", "value"],
            [["first", np.float64(0.123456)], ["second", 3]],
            note="a note",
        )
        data = {"curves": xr.Dataset({"x": ("time", np.arange(3.0))})}
        exact = compare("two, fx", ours, 2.0, "closed form", 1e-3, "m^2", "rounding")
        stored = dataclasses.replace(
            row,
            quantity="three",
            theirs=2.0,
            difference=0.0,
            cause="the figure",
            paper=1e-4,
        )
        picture = Picture("line", "A line.", figure)
        return Result(
            ["Found $x^2$."],
            [picture],
            [row, exact, stored],
            {"value": np.float64(ours)},
            [table],
            data,
            asked="Why?",
            verdict=f"The verdict of {self.name}.",
            left_out="the red curve" if self.name == "second" else "",
        )

    def compute(self, letter):
        if letter == self.interrupt_at:
            self.interrupt_at = ""
            raise KeyboardInterrupt
        self.done.append(letter)
        return {"value": 2.0}


@pytest.fixture
def made(monkeypatch):
    """Two made-up experiments instead of the real ones."""
    # Put back in their order, the last one first.
    for name in reversed(list(experiments.EXPERIMENTS)):
        monkeypatch.delitem(experiments.EXPERIMENTS, name)
    pair = Made("first"), Made("second")
    for each in pair:
        monkeypatch.setitem(experiments.EXPERIMENTS, each.name, each)
    return pair


def test_results_are_stored_and_not_done_again(made, tmp_path):
    reproduction = Reproduction(tmp_path)
    assert [record["name"] for record in reproduction.run()] == ["first", "second"]
    assert sorted(made[0].done) == ["a", "b"]
    files = {path.name for path in (tmp_path / "first").iterdir()}
    # Pieces are gone.
    assert files == {
        "line.png",
        "line.svg",
        "curves.nc",
        "result.json",
    }
    assert len(list(reproduction.run())) == 2
    assert sorted(made[0].done) == ["a", "b"]
    list(reproduction.run(["first"], again=True))
    assert sorted(made[0].done) == ["a", "a", "b", "b"]


def test_other_options_and_broken_files_are_not_reused(made, tmp_path):
    list(Reproduction(tmp_path).run(["first"]))
    assert Reproduction(tmp_path, quick=True).kept("first") is None
    (tmp_path / "first" / "result.json").write_text("{")
    assert Reproduction(tmp_path).kept("first") is None


def test_an_interrupted_run_goes_on_where_it_was(made, tmp_path, capsys):
    made[0].interrupt_at = "b"
    assert main(["reproduce", "--out", str(tmp_path)]) == 130
    assert "continues from there" in capsys.readouterr().err
    assert made[0].done == ["a"] and not made[1].done
    assert main(["reproduce", "--out", str(tmp_path)]) == 0
    assert made[0].done == ["a", "b"]  # a was read from its piece
    assert main(["reproduce", "--out", str(tmp_path)]) == 0
    assert made[0].done == ["a", "b"]
    assert "kept from an earlier run" in capsys.readouterr().err


def test_a_piece_that_was_cut_off_or_is_of_other_code_is_computed_again(tmp_path):
    calls = []
    work = Work(folder=tmp_path, fingerprint="one")

    def compute():
        calls.append(1)
        return {"x": np.arange(3)}

    for _ in range(2):
        np.testing.assert_array_equal(work.piece("a piece", compute)["x"], np.arange(3))
    assert len(calls) == 1
    (path,) = tmp_path.iterdir()
    path.write_bytes(path.read_bytes()[:40])
    work.piece("a piece", compute)
    Work(folder=tmp_path, fingerprint="two").piece("a piece", compute)
    assert len(calls) == 3
    Work().piece("a piece", compute)  # kept nowhere
    assert len(calls) == 4


def test_a_piece_keeps_what_is_nested(tmp_path):
    values = {
        "run": {"one": {"x": np.arange(3.0), "count": 3}, "two": {"x": np.zeros(1)}},
        "seconds": 0.5,
    }
    work = Work(folder=tmp_path, fingerprint="one")
    work.piece("nested", lambda: values)
    for found in (work.piece("nested", dict), Work().piece("nested", lambda: values)):
        np.testing.assert_equal(found, values)
        assert isinstance(found["seconds"], float) and isinstance(
            found["run"]["one"]["count"], int
        )


def test_pieces_by_key_have_labels(tmp_path):
    told = []
    found = Work(progress=told.append).pieces(
        {("a", 1): lambda: {"x": 1.0}, ("b", 2): lambda: {"x": 2.0}}, "{0[0]}".format
    )
    assert found == {("a", 1): {"x": 1.0}, ("b", 2): {"x": 2.0}} and sorted(told) == [
        "a",
        "b",
    ]


def test_pieces_that_have_not_begun_are_left_out_after_an_interrupt():
    begun = []
    goes_on = threading.Event()

    def waits(number):
        begun.append(number)
        if number == 0:
            raise KeyboardInterrupt
        goes_on.wait(5.0)
        return {"x": float(number)}

    timer = threading.Timer(0.5, goes_on.set)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        Work().pieces(
            {number: lambda number=number: waits(number) for number in range(20)}
        )
    timer.join()
    assert len(begun) <= 4  # two at a time


def test_curves_by_their_labels():
    time = np.linspace(0.0, 1.0, 3)
    runs = {
        (a, b): {"x": time * n, "left out": time}
        for n, (a, b) in enumerate(("ps", "pt", "qs", "qt"))
    }
    data = dataset(runs, {"x": "m"}, ("one", "two"), ("time", time, "s"))
    assert dict(data.sizes) == {"one": 2, "two": 2, "time": 3} and set(
        data.data_vars
    ) == {"x"}
    np.testing.assert_array_equal(data.x.sel(one="q", two="s"), 2.0 * time)
    assert data.x.attrs["units"] == "m" and data.time.attrs["units"] == "s"


def test_a_table_has_a_row_for_each_item():
    made = table(
        "Some",
        {"a": 2.0, "b": 3.0},
        {"x": lambda value: value, "square": lambda value: value**2},
        "name",
    )
    assert made.headings == ["name", "x", "square"] and made.rows == [
        ["a", 2.0, 4.0],
        ["b", 3.0, 9.0],
    ]


def test_numbers_and_arrays_are_compared():
    one = compare("one", 1.0, 3.0, "published", 1.0, "m", "")
    assert (one.ours, one.theirs, one.difference, one.samples, one.holds) == (
        1.0,
        3.0,
        2.0,
        1,
        False,
    )
    many = compare("many", np.array([1.0, -2.0]), 0.0, "closed form", 2.0, "m", "")
    assert (many.ours, many.theirs, many.difference, many.samples, many.holds) == (
        None,
        None,
        2.0,
        2,
        True,
    )


def test_the_command_writes_a_report_and_all_numbers(made, tmp_path, capsys):
    assert main(["reproduce", "--out", str(tmp_path)]) == 0
    out, err = capsys.readouterr()
    assert "first" in out and "report.html" in err
    numbers = json.loads((tmp_path / "numbers.json").read_text())
    assert numbers["experiments"]["first"]["numbers"] == {"value": 2.0}
    assert numbers["experiments"]["second"]["comparisons"][0]["holds"] is True
    page = (tmp_path / "report.html").read_text()
    assert (
        "About &lt;first&gt;" in page
        and "none &amp; all" in page
        and "0.1235" in page
        and "a note" in page
    )
    # self-contained: each figure and each formula is inside, nothing is loaded from elsewhere
    sources = re.findall(r'(?:src|href)="([^"]*)"', page)
    assert sum(source.startswith("data:image/png;base64,") for source in sources) == 2
    assert (
        sum(source.startswith("data:image/svg+xml;base64,") for source in sources) == 2
    )
    assert all(source.startswith(("data:image/", "#")) for source in sources)


def test_the_report_begins_with_its_verdict_and_separates_the_papers(made, tmp_path):
    main(["reproduce", "--out", str(tmp_path)])
    head, first, _ = re.split("<section", (tmp_path / "report.html").read_text())
    assert "All 6 comparisons hold." in head
    # what is left out is said where the count stands, and its section named
    assert "that of the red curve (section 2)." in head
    assert "The verdict of first." in head and "The verdict of second." in head
    titles = (
        "Converged solutions and",
        "The paper, with",
        "s curves, stored comparisons",
    )
    places = [
        first.index(each) for each in ("Why?", "<figure>", "Found ", "Some", *titles)
    ]
    assert places == sorted(places)
    ours, papers, stored = (
        first[begin:end]
        for begin, end in zip(places[-3:], [*places[-2:], None], strict=True)
    )
    assert (
        "<i>f<sub>x</sub></i>" in ours and "m²" in ours and "none &amp; all" not in ours
    )
    assert (
        "none &amp; all" in papers
        and "<th>tolerance</th>" in papers
        and "three" not in papers
    )
    # the distance of a published curve from the converged solution limits a comparison, but is no tolerance
    assert (
        "three" in stored and "<th>limit</th>" in stored and "tolerance" not in stored
    )
    assert "The limit is no tolerance" in head


def test_a_number_out_of_tolerance_is_shown_and_sets_the_exit_code(
    made, tmp_path, capsys
):
    made[1].theirs = 2.1
    assert main(["reproduce", "--out", str(tmp_path)]) == 1
    assert "out of tolerance: one" in capsys.readouterr().err
    summary, good, bad = re.split("<section", (tmp_path / "report.html").read_text())
    assert '<tr class="missed"><td><a href="#second">' in summary
    assert 'class="missed"' in bad and "<details open>" in bad
    assert 'class="missed"' not in good and "<details>" in good


def test_a_report_survives_a_removed_picture(made, tmp_path):
    reproduction = Reproduction(tmp_path)
    list(reproduction.run(["first"]))
    (tmp_path / "first" / "line.png").unlink()
    assert "A line." in write_report(reproduction).read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--only", "nothing"], "experiment must be one of"),
        (["--quick", "--full"], "--quick must not be given together with --full"),
        (["--out", "{file}"], "cannot write to folder"),
    ],
)
def test_wrong_input_is_one_line(arguments, words, tmp_path, capsys):
    file = tmp_path / "taken"
    file.write_text("")
    assert main(["reproduce", *(each.format(file=file) for each in arguments)]) == 2
    err = capsys.readouterr().err
    assert words in err and err.count("\n") == 1 and err.startswith("error: ")
    assert file.read_text() == ""


def test_the_list_names_every_experiment_and_each_has_its_module(capsys):
    assert main(["reproduce", "--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(experiments.EXPERIMENTS)
    for name in experiments.EXPERIMENTS:
        assert callable(experiments.find_experiment(name).run)


def test_numbers_as_text():
    assert [number(value) for value in (None, 3, 0.123456, "x", True)] == [
        "",
        "3",
        "0.1235",
        "x",
        "True",
    ]
    assert [fmt(value, "+.2f") for value in (-1e-9, 0.0, 0.2, -0.2)] == [
        "0.00",
        "0.00",
        "+0.20",
        "-0.20",
    ]
    assert [short(value) for value in (1043.7, 0.0012345)] == ["1040", "0.00123"]
    assert [power(1e-8), power(3.14e-5, 1), power(0.0)] == [
        "$10^{-8}$",
        r"$3.1 \times 10^{-5}$",
        "0",
    ]
    assert [span([2.0, 1.0], ".1f"), span([3, 3], "d")] == ["1.0 to 2.0", "3"]


def test_markdown_with_formulas():
    page = to_html("A *word*, `code`, <b>, $\\sigma_0 < 1$ and 5 $.")
    assert (
        "<em>word</em>" in page
        and "<code>code</code>" in page
        and "&lt;b&gt;" in page
        and "and 5 $." in page
    )
    (picture,) = re.findall(r'<img[^>]*alt="([^"]*)"', page)
    assert picture == r"\sigma_0 &lt; 1"


def test_markdown_with_a_table():
    page = to_html("| | $x$ |\n| --- | --- |\n| disc | 0.5 |")
    assert "<td>disc</td>" in page and page.count("<th>") == 2 and 'alt="x"' in page


def test_symbols_in_names():
    assert name_to_html("r, <rho^2> [mm^2], fx & exact") == (
        "<i>r</i>, ⟨<i>ρ</i>²⟩ [mm²], <i>f<sub>x</sub></i> &amp; exact"
    )
    assert name_to_html("\\theta [deg]") == "<i>θ</i> [deg]"
    assert name_to_html("reduced, 21 x 21, extra") == "reduced, 21 × 21, extra"


def test_every_experiment_has_a_template_that_is_complete():
    """Each can be read; what a template names and a run does not give is an error in the run."""
    for name in experiments.EXPERIMENTS:
        source, *_ = environment().loader.get_source(
            environment(), f"{name.replace('-', '_')}/findings.md.j2"
        )
        assert [f"## {part}\n" in source for part in ("verdict", "asked", "found")] == [
            True
        ] * 3, name
        assert "aimed" not in source and "promise" not in source
    with pytest.raises(UndefinedError):
        report("drift", {}, {})


# ---------------------------------------------------------------------- comparisons and facts


def test_a_curve_is_compared_at_the_vertices_of_the_figure_only():
    curve = facts.published_curve("in_hand/Circle/d1/x")
    time = np.round(np.arange(201) * 0.01, 6)
    values = np.full_like(time, 7.0)
    values[np.rint(curve.time / 0.01).astype(int)] = curve.values
    row = compare_curve(
        "x", time, values, "in_hand/Circle/d1/x", allowance=1e-9, cause=""
    )
    assert row.difference == 0.0 and row.samples == len(curve.time) and row.holds
    assert row.tolerance == pytest.approx(curve.deviation + curve.reading + 1e-9)
    values[np.rint(curve.time[3] / 0.01).astype(int)] += 1e-3
    assert not compare_curve(
        "x", time, values, "in_hand/Circle/d1/x", allowance=1e-9, cause=""
    ).holds


def test_a_converged_solution_is_compared_at_all_its_times():
    reference = facts.converged("in_hand/Circle/d1")
    row = compare_converged(
        "y",
        reference["time"],
        reference["y"] + 1e-4,
        "in_hand/Circle/d1/y",
        allowance=1e-6,
        cause="",
    )
    assert (
        row.difference == pytest.approx(1e-4) and not row.holds and row.samples == 200
    )


def test_unknown_facts_are_named():
    for call in (facts.published_curve, facts.published_table, facts.converged):
        with refused("nothing"):
            call("nothing")


def test_published_and_converged_agree_to_the_stated_deviation():
    """The two files hold what they say: each published curve is within its deviation of the converged one."""
    checked = 0
    for name in facts._published()["curves"]:
        solution, _, column = name.rpartition("/")
        curve = facts.published_curve(name)
        if curve.deviation is None or "," in solution:
            continue
        reference = facts.converged(solution)
        index = np.rint(curve.time / 0.01).astype(int) - 1
        inside = index < len(reference["time"])
        difference = np.abs(
            reference[column][index[inside]] - curve.values[inside]
        ).max()
        assert (
            difference
            <= 1.02 * curve.deviation
            + 2.0 * curve.reading
            + 1e-7 * np.ptp(curve.values)
        ), name
        checked += 1
    assert checked > 60


def test_a_full_disk_ends_in_one_line_and_keeps_what_was_there(tmp_path, monkeypatch):
    """The pieces of an experiment and its results are written as everything is: whole, or not at all."""
    from planarfriction._support import writing
    from planarfriction.errors import FileError
    from planarfriction_studies.experiments.experiment import Work

    kept = Work(folder=tmp_path, fingerprint="one").piece(
        "a piece", lambda: {"x": np.arange(3.0)}
    )

    def full(number):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(writing.os, "fsync", full)
    with refused(r"cannot be written: No space left on device", FileError):
        Work(folder=tmp_path, fingerprint="two").piece(
            "a piece", lambda: {"x": np.zeros(3)}
        )
    assert len(list(tmp_path.iterdir())) == 1
    again = Work(folder=tmp_path, fingerprint="one").piece("a piece", dict)
    assert np.array_equal(again["x"], kept["x"])


@pytest.mark.parametrize(
    ("pixels", "share"), [(WIDEST // 2, 50), (WIDEST // 3, 33), (2000, 100)]
)
def test_pictures_of_the_report_have_letters_of_one_size(pixels, share, tmp_path):
    Image.new("1", (pixels, 10)).save(tmp_path / "picture.png")
    shown = _image(tmp_path / "picture.png")
    assert shown["width"] == share
    assert (
        base64.b64decode(shown["source"].partition(",")[2])
        == (tmp_path / "picture.png").read_bytes()
    )
