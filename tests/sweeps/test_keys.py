"""Keys of runs: other equations make other runs."""

from pathlib import Path

from planarfriction.sweeps.keys import library_version


def test_a_change_of_any_source_makes_another_version(monkeypatch):
    """Every source counts, also those outside of `sweeps`."""
    read = Path.read_bytes
    kept = library_version.__wrapped__()
    assert kept == library_version.__wrapped__()
    for changed in ("formulas.py", "_engine/coupled/steps.py", "sweeps/keys.py"):
        more = lambda file, changed=changed: (
            read(file) + b"#" * file.as_posix().endswith(f"planarfriction/{changed}")
        )
        monkeypatch.setattr(Path, "read_bytes", more)
        assert library_version.__wrapped__() != kept
