"""`planarfriction online`: the table and its file."""

import json

import numpy as np
import pytest

from planarfriction.cli import main
from planarfriction_studies.commands.online import WORDS
from planarfriction_studies.rig import trials


def test_the_table_of_the_trials_is_written(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(trials, "HOLD_STEPS", 60)
    monkeypatch.setattr(trials, "EXPLORED_STEPS", 30)
    monkeypatch.setattr(
        trials, "_task", lambda task, base, seed, kind: (base, -0.02, 0.05)
    )
    monkeypatch.setattr(trials, "AFTER_STEPS", 10)
    file = tmp_path / "trials.json"
    assert (
        main(["online", "trials", "--parts", "4", "--seed", "1", "--json", str(file)])
        == 0
    )
    found = json.loads(file.read_text())
    assert set(found) == {"parts", "seed", *WORDS}
    assert found["parts"] == 4
    assert isinstance(found["drops"], int)
    assert "grip saved by the observer" in capsys.readouterr().out


def test_the_table_counts_drops_slips_and_goals():
    """Four parts: one slides by 3 mm, one falls; goals are missed by half and by twice what is allowed."""
    slip = np.zeros((4, 3))
    slip[1:3, 1] = -0.003, -0.03
    first = np.full((4, 3, 3), np.nan)
    first[0] = [[0.04, 0.03, 1.0], [0.2, 0.3, 0.0], [0.06, 0.01, 1.0]]
    hold = {
        "slip": slip,
        "later": slip,
        "grip": np.full(4, 3.0),
        "first": first,
        "alarms": np.ones(4),
    }
    hold["late"] = np.full(4, 0.01)
    runs = {
        ("hold", True): hold,
        ("hold", False): hold | {"slip": 0.0 * slip, "grip": np.full(4, 4.0)},
    }
    for task, allowed in (
        ("slide", 1e-3),
        ("turn", np.radians(2.0)),
        ("hinge", np.radians(2.0)),
    ):
        goal = np.full(4, 0.04)
        ends = np.stack([goal, goal, goal], 1)
        runs[task, True] = {"slip": ends + 0.5 * allowed, "goal": goal}
        runs[task, False] = {
            "slip": ends + np.array([[0.5], [-0.5], [2.0], [-2.0]]) * allowed,
            "goal": goal,
        }
    table = trials._shares(runs)
    assert (
        table["slipped"],
        table["drops"],
        table["rule_drops"],
        table["slips_over_1_mm"],
    ) == (0.25, 1, 0, 2)
    assert (table["grip_saved"], table["detected_within_20_ms"]) == (0.25, 1.0)
    assert table["false_alarms_per_minute"] == pytest.approx(
        4 / (4 * trials.HOLD_STEPS * 1e-3 / 60), rel=1e-3
    )
    found = [(table[f"{name}coverage_95"]) for name in ("", "mu_s_", "radius_")]
    assert found == [1.0, 1.0, 0.0]  # 0.04 of 0.059, 0.2 of 0.59, 0.06 of 0.02
    assert [
        table[f"{name}_within_5_percent"] for name in ("mu_c", "mu_s", "radius")
    ] == [1.0, 1.0, 0.0]
    assert [table[f"{name}_within"] for name in ("slide", "turn", "hinge")] == [1.0] * 3
    assert [table[f"rule_{name}_within"] for name in ("slide", "turn", "hinge")] == [
        0.5
    ] * 3


def test_a_film_is_written(tmp_path, monkeypatch, capsys):
    from planarfriction_studies.rig import demo, pictures

    monkeypatch.setattr(demo, "record_hold", lambda seed: seed)
    monkeypatch.setattr(
        pictures, "write_grip_film", lambda path, record: path.write_text(str(record))
    )
    assert (
        main(["online", "demo", "--out", str(tmp_path / "hold.gif"), "--seed", "3"])
        == 0
    )
    assert (tmp_path / "hold.gif").read_text() == "3"
    assert main(["online", "demo", "--out", str(tmp_path / "hold.bmp")]) != 0
    assert "animations are" in capsys.readouterr().err
