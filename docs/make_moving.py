"""Make the moving pictures of README and docs, and the picture of slip: `python docs/make_moving.py [FOLDER]`.

They go to `docs/images` unless a folder is named.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.plots import style

LARGEST = 1_000_000
"""Largest size [bytes]."""


def loosening() -> pf.Scene:
    """Return a plate, held beside its centre of mass by soft fingertips, whose grip falls."""
    radius = 0.01
    patch = pf.ContactPatch.disc(
        radius,
        pressure=lambda x, y: np.maximum(1.0 - (x * x + y * y) / radius**2, 0.0) ** 0.5,
    )
    law = pf.LuGre(mu_c=0.8, elasto_plastic=0.9)
    layer = pf.Pad.layer(shear_modulus=0.2e6, thickness=3e-3)
    model = pf.ReducedModel(patch, law, pad=layer)
    grip = pf.Signal.sampled([0.0, 0.05, 0.35], [4.0, 4.0, 1.0], "linear")
    plate = {"size": (0.09, 0.05), "centre_of_mass": (0.01, 0.0)}
    scene = pf.scenes.in_hand(model, normal_force=grip, t_end=0.35, **plate)
    return replace(scene, start="equilibrium", save_every=1e-3)


def main(folder: Path) -> None:
    """Write the pictures and say how large they are."""
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
    solution = pf.simulate(loosening())
    check_size(solution.animate(folder / "slip.gif", slow=10.0, fps=20.0, dpi=66.0))
    with style.paper():
        figure = pf.plots.plot_slip(solution)
    figure.savefig(folder / "slip.png", dpi=160, metadata={"Software": None})
    check_size(folder / "slip.png")


def check_size(path: Path) -> None:
    """Say how large a picture is, and end with an error if it is too large for a page."""
    size = path.stat().st_size
    print(f"{path.name}: {size / 1000:.0f} kB")
    if size > LARGEST:
        sys.exit(f"{path.name} is larger than {LARGEST / 1000:.0f} kB")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "images")
