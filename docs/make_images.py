"""Make the pictures of README and docs from the library itself: `python docs/make_images.py [FOLDER]`.

They go to `docs/images` unless a folder is named. Each stays below 200 kB. Those of the
reproduction come from `make_tables.py`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import planarfriction as pf
from planarfriction import plots
from planarfriction.patch import PUBLISHED_PATCHES

LARGEST = 200_000
"""Largest size of a picture [bytes]."""

LAW = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
"""The published law."""


def fingertip() -> pf.ContactPatch:
    """A made-up measured pressure map: a fingertip that presses harder with one side, 24 x 16 cells of 1 mm."""
    y, x = np.mgrid[0:16, 0:24] - np.array([7.5, 11.5])[:, None, None]
    pressure = np.clip(1.0 - (x / 11.0) ** 2 - (y / 7.0) ** 2, 0.0, None) ** 0.5 * (1.0 + 0.045 * x - 0.04 * y)
    return pf.ContactPatch.from_pressure(pressure, cell_size=1e-3, name="fingertip")


def figures() -> dict[str, plots.style.PlotFigure]:
    """The figures by the names of their files."""
    circle, pads = PUBLISHED_PATCHES["Circle"](), PUBLISHED_PATCHES["NonConvex1"]()
    models = {"distributed": pf.DistributedModel(circle, LAW), "reduced": pf.ReducedModel(circle, LAW)}
    in_hand = {name: pf.simulate(pf.scenes.in_hand(model)) for name, model in models.items()}
    return {
        "in-hand-motion": plots.plot_motion(in_hand["distributed"]),
        "in-hand-histories": plots.plot_histories(in_hand),
        "limit-surface": plots.plot_limit_surface(pf.LimitSurfaceExact(pads)),
        "pre-sliding-cycles": pre_sliding_cycles(),
        "grip-plan": grip_plan(),
        "pressure-map": plots.plot_patch(fingertip(), normal_force=5.0),
    }


def small_cycles(model: pf.ReducedModel | pf.ReducedModelPublished, cycles: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """Force `fx` [N] before each cycle and energy that friction has taken by then [J].

    A cycle is a push by 0.1 um, a turn by as much at the contact radius, and the straight way back, at 1 N.
    """
    leg, steps, dt = 1e-7, 50, 1e-3
    push, turn = np.array([leg, 0.0, 0.0]), np.array([0.0, 0.0, leg / model.patch.contact_radius()])
    twists = np.tile(np.repeat(np.array([push, turn, -(push + turn)]) / (steps * dt), steps, axis=0), (cycles, 1))
    wrenches = np.concatenate([np.zeros((1, 3)), pf.derivatives.rollout(model, None, twists, 1.0, dt).wrenches])
    work = -0.5 * np.einsum("ti,ti->t", wrenches[1:] + wrenches[:-1], twists) * dt
    taken = np.concatenate([[0.0], work.cumsum()])
    return wrenches[:: 3 * steps, 0], taken[:: 3 * steps]


def pre_sliding_cycles() -> plots.style.PlotFigure:
    """Small closed motions: the published reduced model ratchets and gives energy, that of moments does not."""
    law = pf.LuGre(mu_s=1.2, elasto_plastic=0.9, sigma_1=0.0, sigma_2=0.0)
    figure = plots.style.new_figure(8.0, 3.2)
    force, energy = figure.subplots(1, 2)
    for kind in (pf.ReducedModelPublished, pf.ReducedModel):
        model = kind(PUBLISHED_PATCHES["Circle"](), law)
        fx, taken = small_cycles(model)
        look = {"color": plots.style.model_colour(model), "label": kind.__name__}
        force.plot(fx, ".-", **look)
        energy.plot(1e9 * taken, ".-", **look)
    force.set(xlabel="cycles", ylabel="force left over, fx [N]")
    energy.set(xlabel="cycles", ylabel="energy that friction took [nJ]")
    for axes in (force, energy):
        plots.style.tidy(axes)
        axes.legend()
    return figure


def grip_plan() -> plots.style.PlotFigure:
    """The plan of docs/grip-planning.md."""
    model = pf.ReducedModel(pf.ContactPatch.disc(radius=0.01), LAW)
    plate = pf.scenes.in_hand(model, centre_of_mass=(0.025, 0.0), normal_force=4.0, t_end=1.0)
    return pf.planning.plan_grip(plate, {"angle": np.radians(-30.0)}).plot()


def main(folder: Path) -> None:
    """Write every picture and say how large it is."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, figure in figures().items():
        path = folder / f"{name}.png"
        figure.savefig(path, dpi=120, facecolor="white", metadata={"Software": None})
        size = path.stat().st_size
        print(f"{name}.png: {size / 1000:.0f} kB")
        if size > LARGEST:
            sys.exit(f"{name}.png is larger than {LARGEST / 1000:.0f} kB")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "images")
