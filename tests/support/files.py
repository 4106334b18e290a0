"""Files of scenes."""

from __future__ import annotations

from pathlib import Path

import planarfriction as pf


def again(scene: pf.Scene, folder: Path) -> pf.Scene:
    """Return a scene that was written to TOML and JSON, and came back from both to the last bit."""
    for suffix in ("toml", "json"):
        scene.to_file(folder / f"scene.{suffix}")
        read = pf.Scene.from_file(folder / f"scene.{suffix}")
        assert read == scene
        assert read.digest() == scene.digest()
    return read
