"""Commands of the studies refuse what they cannot do in one line that says what to give."""

from pathlib import Path

import pytest

from planarfriction.cli import main

REFUSED = {
    "measured --seed -1": "--seed must be an integer >= 0, got -1",
    "measured --task onsets --only none": "mu(v) and radius, toss by toss, MuJoCo box, got 'none'",
    "measured --own nothing.py:f": "nothing.py: no such file",
    "measured --own own.py:predict --task pushes": "must have shape [25, 3], got shape [3]",
    "reproduce --quick --full": "--quick must not be given together with --full, got both",
    "reproduce --only timimg": "got 'timimg' (did you mean 'timing'?)",
    "bench --only nothing": "sweep, import, got 'nothing'",
    "bench --only in_hand.reduced --rounds 0": "rounds must be an integer >= 1, got 0",
    "bench --compare nothing.json": "nothing.json: no such file (expected a run of planarfriction bench)",
    "bench --compare own.py --force": "own.py: is not what planarfriction bench --json prints",
    "online trials --parts 1": "--parts must be an integer >= 4, got 1",
    "online demo --out a.txt": "cannot write a.txt: animations are .gif, .mp4 or .html files",
    "online demo --seed -1": "--seed must be an integer >= 0, got -1",
    "simulator-benchmark --case none": "time_step, torsion, tower, got 'none'",
    "referee --case stop --step 0": "--step must be > 0, got 0.0",
}


@pytest.mark.parametrize("call", REFUSED)
def test_a_mistake_is_one_line(call, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("own.py").write_text(
        "def predict(question):\n    return [0.0, 0.0, 0.0]\n", encoding="utf-8"
    )
    assert main(call.split()) == 2
    printed = capsys.readouterr()
    assert printed.err.startswith("error: ") and printed.err.endswith(
        f"{REFUSED[call]}\n"
    ), printed.err
    assert printed.err.count("\n") == 1 and printed.out == ""
