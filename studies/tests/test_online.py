"""`planarfriction online`: the table and its file."""

from __future__ import annotations

import json

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


def test_too_few_parts_are_refused(capsys):
    assert main(["online", "trials", "--parts", "2"]) != 0
    assert "--parts must be" in capsys.readouterr().err


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
