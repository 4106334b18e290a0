"""Every script that makes pictures and tables of the pages runs, on less than it is given for them."""

import shutil
from pathlib import Path

import pytest

import planarfriction as pf
from planarfriction_studies.measured import TASKS, replayed_pushes
from tests.support.repository import script

DOCS = Path(__file__).parents[2] / "docs"
ELSEWHERE = {
    "make_breakaway",
    "make_cycles",
    "make_lines",
    "make_referee",
    "make_tables",
    "make_wasm",
}
"""Scripts whose own tests run them (test_breakaway, test_docs, test_referee, test_bench, test_browser_module), or that
need emulators."""


def beside(made, folder, monkeypatch):
    pytest.importorskip("mujoco", reason="needs the extra [mujoco]")
    # The exact motion between its ends takes long.
    monkeypatch.setattr(made, "KNOTS", 3)

    def last(path, file, frame, count, fps):
        assert count > 20 and fps == 15.0
        file.write(frame(count - 1).tobytes()[:100])

    monkeypatch.setattr(made, "write_frames", last)
    made.main(folder)


def coverage(made, folder, monkeypatch):
    monkeypatch.setattr(made, "DURATION", 0.5)
    log = made.observed(made.ROWS["delay"], made.truth(made.ROWS["delay"]), 0)
    assert log.time[-1] == pytest.approx(0.495)
    assert "| 7 of 8 | 1 of 6 |" in made.table(
        {"exact": made.Count(6, 1, told={"mu_c": 8}, inside_told={"mu_c": 7})}
    )


def explorer(made, folder, monkeypatch):
    if shutil.which("chromium") is None:
        pytest.skip("needs Chromium")
    (folder / "images").mkdir()
    monkeypatch.setattr(made, "DOCS", folder)
    made.pictures()


def images(made, folder, monkeypatch):
    simulate = pf.simulate
    # Tests of grips make that plan.
    monkeypatch.setattr(made, "grip_plan", made.bristle)
    monkeypatch.setattr(pf, "simulate", lambda scene: simulate(scene, t_end=0.05))
    for name, figure in made.figures().items():
        figure.savefig(folder / f"{name}.png", dpi=20)


def measured(made, folder, monkeypatch):
    task = next(iter(TASKS))
    key = TASKS[task].measures[0].key
    stored = {
        "models": {
            "mine": {"scores": {key: {"value": 1.234, "interval_95": [1.0, 1.5]}}}
        }
    }
    stored |= {
        "minus": {"models": {"mine": {key: [0.2, 0.1, 0.3]}}},
        "published": {"theirs": {key: 2.0}},
    }
    page = made.with_tables(
        f"<!-- measured: {task} -->\n\n| old |\n\nNext.\n", {task: stored}
    )
    assert (
        "| mine | 1.23* [1.00, 1.50] |" in page
        and "| theirs | 2.00 |" in page
        and page.endswith("|\n\nNext.\n")
    )
    assert "old" not in page


def moving(made, folder, monkeypatch):
    animate = pf.Solution.animate
    few = {"fps": 2.0, "dpi": 30.0}
    monkeypatch.setattr(
        pf.Solution,
        "animate",
        lambda run, path, **given: animate(run, path, **given | few),
    )
    made.main(folder)


def pushing(made, folder, monkeypatch):
    single = replayed_pushes.single_pushes()
    in_time = replayed_pushes.pushes_in_time()
    one = next(each for each in in_time if each.name.endswith("3out_2 108"))
    few = [
        next(each for each in [*single, *in_time] if each.board == board)
        for board in made.BOARDS
    ]
    (folder / "images").mkdir()
    monkeypatch.setattr(made, "__file__", str(folder / "make_pushing.py"))
    monkeypatch.setattr(made, "PAGE", folder / "pushing.md")
    made.PAGE.write_text("<!-- followed pushes -->\n\n| old |\n\nNext.\n")
    monkeypatch.setattr(replayed_pushes, "single_pushes", lambda: few)
    monkeypatch.setattr(replayed_pushes, "pushes_in_time", lambda: [one])
    made.main()
    assert made.PAGE.read_text().count("\n| ") == 1 + len(made.BOARDS)


def incipient(made, folder, monkeypatch):
    monkeypatch.setattr(made, "PAGE", folder / "online-trials.md")
    monkeypatch.setattr(made, "PARTS", 16)
    monkeypatch.setattr(made, "RESERVES", (1.4,))
    monkeypatch.setattr(made.incipient, "least_reserve", lambda *_: 1.5)
    made.PAGE.write_text("<!-- incipient slip -->\n\n| old |\n\nNext.\n")
    made.main()
    text = made.PAGE.read_text()
    assert text.count("| 1.50 |") == 3 and text.endswith("|\n\nNext.\n")


def joint(made, folder, monkeypatch):
    monkeypatch.setattr(made, "T_END", 1.0)
    # The other picture is that of a fit, which test_joints makes.
    made.holds().savefig(folder / "joint-holds.png")


MAKERS = {
    f"make_{make.__name__}": make
    for make in (beside, coverage, images, incipient, joint, measured, moving, pushing)
}
SLOW = {"make_explorer": explorer}


@pytest.mark.parametrize(
    "name",
    [
        *MAKERS,
        pytest.param("make_explorer", marks=[pytest.mark.explore, pytest.mark.slow]),
    ],
)
def test_a_maker_of_pages_makes_them(name, tmp_path, monkeypatch):
    if name == "make_explorer":
        pytest.importorskip("playwright", reason="needs the extra [browser]")
    if name == "make_joint":
        pytest.importorskip("mujoco", reason="needs the extra [mujoco]")
    if not DOCS.is_dir():
        pytest.skip("no docs beside these tests")
    monkeypatch.syspath_prepend(DOCS)
    made = script(f"docs/{name}.py")
    {**MAKERS, **SLOW}[name](made, tmp_path, monkeypatch)
    for picture in [
        *tmp_path.glob("*.png"),
        *tmp_path.glob("images/*.png"),
        *tmp_path.glob("*.gif"),
    ]:
        assert picture.stat().st_size >= 100


def test_no_maker_of_pages_is_left_out():
    assert {each.stem for each in DOCS.glob("make_*.py")} <= {
        *MAKERS,
        *SLOW,
        *ELSEWHERE,
    }
