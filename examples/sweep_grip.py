"""Grip of a plate off its centre of mass: a sweep over grip force and friction shows if it turns or slips.

The sweep has `N x N` runs. Finished runs are kept in the folder `--out`: if the script is stopped and started again, it
continues, and with a finer grid only the new points are simulated.

    python examples/sweep_grip.py [--out FOLDER] [--points N]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import planarfriction as pf
from planarfriction.plots import style

PAD = pf.ContactPatch.disc(0.01, cells=15)
OFFSET = 0.025
"""Distance from the fingers to the centre of mass [m]."""

MASS = 0.2
RATIO = 1.2
"""mu_s / mu_c."""

HELD = np.radians(0.5)
"""Angle below which a plate counts as held [rad]: elastic pads let it sag a little."""


def plate(grip: float, mu_c: float) -> pf.Scene:
    """The plate between two fingers with a constant grip force [N], for half a second."""
    law = pf.LuGre(mu_c=mu_c, mu_s=RATIO * mu_c, elasto_plastic=pf.ElastoPlastic(0.9))
    model = pf.ReducedModel(PAD, law)
    return pf.scenes.in_hand(
        model, normal_force=grip, centre_of_mass=(OFFSET, 0.0), mass=MASS, t_end=0.5
    )


def end(solution: pf.Solution) -> dict[str, float]:
    """Final angle [rad] and slip of the pads [m]."""
    x, y, theta = (solution.histories[name].values[-1] for name in ("x", "y", "theta"))
    start = OFFSET * np.array([np.cos(theta), np.sin(theta)])
    pad = (
        np.array([x, y]) - start
    )  # the point of the plate that was between the pads at the start
    return {"angle": float(theta), "slip": float(np.linalg.norm(pad))}


def run(points: int, folder: Path | None = None) -> xr.Dataset:
    """Run the sweep with `points` values of each quantity."""
    values = {
        "grip": np.linspace(1.5, 6.0, points),
        "mu_c": np.linspace(0.5, 1.5, points),
    }
    return pf.sweep(plate, values, out=folder, measure=end, progress=print)


SLIPS = (1.0, 5.0, 20.0)
"""Slips that are drawn as contour lines [mm]."""


def holding_grip(mu_s: np.ndarray) -> np.ndarray:
    """Smallest grip force of each of two fingers that holds the plate [N], from the limit surface of the pad."""
    weight = 9.81 * MASS
    wrench = np.array([0.0, weight, weight * OFFSET])
    surface = pf.LimitSurfaceExact(PAD)
    limit = surface.wrench(
        surface.twist(wrench)
    )  # largest wrench in this direction for mu f_N = 1
    return np.linalg.norm(wrench) / np.linalg.norm(limit) / (2.0 * mu_s)


def draw(data: xr.Dataset) -> Any:
    """Plot the angle against grip and friction, slip as contour lines, and the holding limit."""
    with style.paper():
        figure = style.new_figure(5.5, 3.4)
        axes = figure.subplots()
        mu = np.linspace(float(data.mu_c[0]), float(data.mu_c[-1]), 200)
        turned = np.degrees(-data.angle.transpose("mu_c", "grip")).clip(0.0, 90.0)
        look = {"cmap": style.PRESSURE_MAP, "shading": "nearest", "rasterized": True}
        mesh = axes.pcolormesh(data.grip, data.mu_c, turned, **look)
        words = "rotation in 0.5 s [°]"
        figure.colorbar(mesh, ax=axes, label=words, extend="max")  # what is more is cut
        slip = 1e3 * data.slip.transpose("mu_c", "grip")
        levels = axes.contour(
            data.grip, data.mu_c, slip, SLIPS, colors="white", linewidths=1.0
        )
        axes.clabel(levels, fmt="%g mm", fontsize=7)
        axes.plot(holding_grip(RATIO * mu), mu, color="black", linewidth=1.6)
        look = {"transform": axes.transAxes, "fontweight": "bold"}
        axes.text(0.97, 0.95, "holds", ha="right", va="top", **look)
        axes.text(0.03, 0.05, "slips", color="white", **look)
        axes.set(
            xlabel="grip of each finger [N]",
            ylabel="friction coefficient mu_c",
            xlim=(float(data.grip[0]), float(data.grip[-1])),
        )
        axes.grid(False)
    return figure


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out"))
    parser.add_argument("--points", type=int, default=24)
    options = parser.parse_args(arguments)
    data = run(options.points, options.out / "sweep-grip")
    agree = (abs(data.angle) < HELD) == (data.grip > holding_grip(RATIO * data.mu_c))
    print(
        f"held or not, as the limit surface predicts: {int(agree.sum())} of {agree.size} runs"
    )
    path = options.out / "sweep_grip.png"
    draw(data).savefig(path, dpi=160, facecolor="white", metadata={"Software": None})
    print(f"wrote {path}")


if __name__ == "__main__":
    sys.exit(main())
