"""Make the moving picture of README and docs: `python docs/make_moving.py [FOLDER]`, by default in `docs/images`."""

from __future__ import annotations

import sys
from pathlib import Path

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES

LARGEST = 1_000_000
"""Largest size [bytes]."""


def main(folder: Path) -> None:
    """Write the picture and say how large it is."""
    law = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
    model = pf.ReducedModel(PUBLISHED_PATCHES["Circle"](), law)
    # Large pads, and it turns far.
    scene = pf.scenes.in_hand(model, size=(0.09, 0.05), centre_of_mass=(0.006, 0.0))
    folder.mkdir(parents=True, exist_ok=True)
    check_size(
        pf.simulate(scene, save_every=2e-3).animate(
            folder / "in-hand.gif", slow=2.0, fps=25.0, dpi=88.0
        )
    )


def check_size(path: Path) -> None:
    """Say how large a picture is, and end with an error if it is too large for a page."""
    size = path.stat().st_size
    print(f"{path.name}: {size / 1000:.0f} kB")
    if size > LARGEST:
        sys.exit(f"{path.name} is larger than {LARGEST / 1000:.0f} kB")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "images")
