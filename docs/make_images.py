"""Make the pictures of README and docs from the library itself: `python docs/make_images.py [FOLDER]`.

They go to `docs/images` unless a folder is named. Each stays below 200 kB. Those of the
reproduction come from `make_tables.py`.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.patches import Circle, Rectangle

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
    pressure = np.clip(1.0 - (x / 11.0) ** 2 - (y / 7.0) ** 2, 0.0, None) ** 0.5 * (
        1.0 + 0.045 * x - 0.04 * y
    )
    return pf.ContactPatch.from_pressure(pressure, cell_size=1e-3, name="fingertip")


def figures() -> dict[str, plots.style.PlotFigure]:
    """The figures by the names of their files."""
    circle = PUBLISHED_PATCHES["Circle"]()
    pads = replace(PUBLISHED_PATCHES["NonConvex1"](), name="two pads")
    models = {
        "distributed": pf.DistributedModel(circle, LAW),
        "reduced": pf.ReducedModel(circle, LAW),
    }
    in_hand = {
        name: pf.simulate(pf.scenes.in_hand(model)) for name, model in models.items()
    }
    return {
        "in-hand-motion": plots.plot_motion(in_hand["distributed"]),
        "in-hand-histories": plots.plot_histories(in_hand),
        "limit-surface": plots.plot_limit_surface(pf.LimitSurfaceExact(pads)),
        "pre-sliding-cycles": pre_sliding_cycles(),
        "grip-plan": grip_plan(),
        "hold": hold(),
        "discs": discs(),
        "pressure-map": plots.plot_patch(fingertip(), normal_force=5.0),
        "concept-motions": motions(),
        "concept-bristle": bristle(),
        "over-an-edge": over_an_edge(),
    }


def discs() -> plots.style.PlotFigure:
    """Draw the discs that stand for three patches, the darker the more load they carry, over the cells."""
    figure = plots.style.new_figure(9.0, 3.3)
    circle, tee = (PUBLISHED_PATCHES[name]() for name in ("Circle", "NonConvex2"))
    patches = {"a disc": circle, "a T": tee, "a fingertip": fingertip()}
    for axes, (words, patch) in zip(
        figure.subplots(1, 3), patches.items(), strict=True
    ):
        few = patch.discs(pf.ReducedModel.cells)
        axes.plot(*1e3 * patch.positions.T, ".", color="0.6", ms=1.5)
        shares = few.weights() / few.weights().max()
        for centre, radius, share in zip(
            1e3 * few.positions, 1e3 * few.radii, shares, strict=True
        ):
            axes.add_patch(
                Circle(
                    centre,
                    radius,
                    color=plots.style.OF_MODEL["reduced"],
                    alpha=0.6 * share,
                    lw=0.0,
                )
            )
            axes.add_patch(Circle(centre, radius, fill=False, color="0.3", lw=0.6))
        axes.set_title(
            f"{words}: {few.cells} discs for {patch.cells} cells", fontsize="medium"
        )
        axes.set(aspect="equal", xticks=(), yticks=(), xlim=(-12, 12), ylim=(-12, 12))
        axes.spines[:].set_visible(False)
    return figure


def motions() -> plots.style.PlotFigure:
    """A pad that slides, turns about a point inside and spins: friction of each cell, and all of it together."""
    pad = pf.ContactPatch.rectangle(0.03, 0.02, cells=12)
    figure = plots.style.new_figure(9.0, 2.7)
    twists = {
        "it slides": (1.0, 0.0, 0.0),
        "it turns about the cross": (0.008, 0.0, 1.0),
        "it spins": (0.0, 0.0, 1.0),
    }
    for axes, (words, (vx, _, omega)) in zip(
        figure.subplots(1, 3), twists.items(), strict=True
    ):
        x, y = 1e3 * pad.positions.T
        velocity = np.stack([vx - 1e-3 * omega * y, 1e-3 * omega * x])
        away = -velocity / np.linalg.norm(velocity, axis=0)
        axes.quiver(
            x,
            y,
            *away,
            color=plots.style.DISTRIBUTED,
            scale=17,
            width=0.006,
            pivot="mid",
        )
        fx, _, tau = pf.LimitSurfaceExact(pad).wrench((vx, 0.0, omega))
        axes.set_title(
            f"{words}\nforce {abs(fx):.0%}, torque {abs(tau) / pad.contact_radius():.0%}",
            fontsize="medium",
        )
        if omega:
            axes.plot(
                0.0, 1e3 * vx / omega, "x", color=plots.style.PUBLISHED, ms=9, mew=2.5
            )
        axes.set(aspect="equal", xticks=(), yticks=(), xlim=(-18, 18), ylim=(-11, 11))
        axes.add_patch(Rectangle((-15, -10), 30, 20, fill=False, color="0.6"))
        axes.spines[:].set_visible(False)
    return figure


def bristle() -> plots.style.PlotFigure:
    """Friction of a pad that is pushed from rest until it slides, over its displacement."""
    law = pf.LuGre(
        mu_c=0.6,
        mu_s=0.75,
        sigma_0=2e4,
        v_s=5e-3,
        sigma_1=5.0,
        sigma_2=0.0,
        elasto_plastic=0.9,
    )
    model = pf.ReducedModel(pf.ContactPatch.disc(0.01), law)
    speeds = 2e-2 * np.linspace(0.0, 1.0, 800) ** 2
    twists = np.stack([speeds, 0.0 * speeds, 0.0 * speeds], axis=-1)
    force = -pf.derivatives.rollout(model, None, twists, 1.0, 1e-4).wrenches[:, 0]
    moved = 1e6 * np.cumsum(speeds) * 1e-4
    figure = plots.style.new_figure(7.2, 3.2)
    axes = figure.subplots()
    axes.plot(moved, force, color=plots.style.DISTRIBUTED)
    for words, at, text in (
        ("sticks: a spring", (18.0, 0.36), (30.0, 0.25)),
        ("breakaway", (38.0, 0.69), (45.0, 0.77)),
        ("slides: less friction, the faster it is", (120.0, 0.63), (75.0, 0.5)),
    ):
        axes.annotate(words, at, text, arrowprops={"arrowstyle": "->"})
    axes.set(
        xlabel="displacement [µm]",
        ylabel="friction / load",
        xlim=(0.0, 200.0),
        ylim=(0.0, 0.85),
    )
    plots.style.tidy(axes)
    return figure


def over_an_edge() -> plots.style.PlotFigure:
    """A layer under a box over the edge of a table, pulled with 0.6 of its friction and turned: pressure, and slip."""
    side = 0.02
    square = pf.ContactPatch.rectangle(side, cells=40)
    law = pf.LuGre(mu_c=0.8, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9)
    layer = pf.Pad.layer(shear_modulus=0.2e6, thickness=3e-3)
    model = pf.DistributedModel(square, law, pad=layer)
    stiffness = layer.pieces(square, law)
    load = 2.0
    fig, axes = plt.subplots(2, 3, figsize=(7.5, 5.0), layout="constrained")
    for column, off in zip(axes.T, (0.0, 5e-3, 8e-3), strict=True):
        ends = 0.5 * side - off - square.positions[:, 0]
        cover = np.clip(ends * 40 / side + 0.5, 0.0, 1.0)
        borne = cover > 0.0
        pressed = pf.ContactPatch.points(square.positions[borne], cover[borne])
        loads = np.zeros(square.cells)
        loads[borne] = load * pressed.weights(load, moments=(0.0, 0.0))
        state = model.rest()
        force = 0.0
        while force < 0.6 * law.mu_c * load:
            state, wrench = model.step(
                state, [1e-3, 0.0, 0.08], None, 2e-4, loads=(loads, loads), cover=cover
            )
            force = -wrench[0]
        limit = law.mu_c * np.maximum(loads, 1e-9)
        used = stiffness * cover * np.hypot(*state[:2]) / limit
        pressure = 1e-3 * loads / square.areas
        maps = [
            (pressure, "viridis", 30.0),
            (np.where(loads > 0.0, used, 0.0), "magma", 1.0),
        ]
        drawn = []
        for ax, (values, colours, most) in zip(column, maps, strict=True):
            shown = np.where(borne, values, np.nan).reshape(40, 40)
            extent = np.array([-1.0, 1.0, -1.0, 1.0]) * 500.0 * side
            drawn.append(
                ax.imshow(
                    shown,
                    origin="lower",
                    extent=extent,
                    cmap=colours,
                    vmin=0.0,
                    vmax=most,
                )
            )
            ax.axvline(1e3 * (0.5 * side - off), color="0.4", linewidth=1.0)
            ax.set_xlabel("x [mm]")
        column[0].set_title(f"{1e3 * off:.0f} mm over the edge")
    for row, image, label in zip(
        axes, drawn, ("pressure [kPa]", "traction over limit"), strict=True
    ):
        row[0].set_ylabel("y [mm]")
        fig.colorbar(image, ax=row, label=label, shrink=0.85)
    return fig


def small_cycles(
    model: pf.ReducedModel | pf.ReducedModelPublished, cycles: int = 20
) -> tuple[np.ndarray, np.ndarray]:
    """Force `fx` [N] before each cycle and energy that friction has taken by then [J].

    A cycle is a push by 0.1 um, a turn by as much at the contact radius, and the straight way back, at 1 N.
    """
    leg = 1e-7
    steps = 50
    dt = 1e-3
    push = np.array([leg, 0.0, 0.0])
    turn = np.array([0.0, 0.0, leg / model.patch.contact_radius()])
    twists = np.tile(
        np.repeat(np.array([push, turn, -(push + turn)]) / (steps * dt), steps, axis=0),
        (cycles, 1),
    )
    wrenches = np.concatenate(
        [
            np.zeros((1, 3)),
            pf.derivatives.rollout(model, None, twists, 1.0, dt).wrenches,
        ]
    )
    work = -0.5 * np.einsum("ti,ti->t", wrenches[1:] + wrenches[:-1], twists) * dt
    taken = np.concatenate([[0.0], work.cumsum()])
    return wrenches[:: 3 * steps, 0], taken[:: 3 * steps]


def pre_sliding_cycles() -> plots.style.PlotFigure:
    """Small closed motions: the published reduced model ratchets and gives energy, discs do not."""
    law = pf.LuGre(mu_s=1.2, elasto_plastic=0.9, sigma_1=0.0, sigma_2=0.0)
    figure = plots.style.new_figure(8.0, 3.2)
    force, energy = figure.subplots(1, 2)
    for kind, mark in ((pf.ReducedModelPublished, ".-"), (pf.ReducedModel, "x-")):
        model = kind(PUBLISHED_PATCHES["Circle"](), law)
        fx, taken = small_cycles(model)
        look = {
            "color": plots.style.model_colour(model),
            "label": kind.__name__,
            "markersize": 5,
        }
        force.plot(fx, mark, **look)
        energy.plot(1e9 * taken, mark, **look)
    force.set(xlabel="cycles", ylabel="force left over, fx [N]")
    energy.set(xlabel="cycles", ylabel="energy that friction took [nJ]")
    for axes in (force, energy):
        plots.style.tidy(axes)
        axes.legend()
    return figure


def grip_plan() -> plots.style.PlotFigure:
    """The plan of docs/grip-planning.md."""
    model = pf.ReducedModel(pf.ContactPatch.disc(radius=0.01), LAW)
    plate = pf.scenes.in_hand(
        model, centre_of_mass=(0.025, 0.0), normal_force=4.0, t_end=1.0
    )
    return pf.planning.plan_grip(plate, {"angle": np.radians(-30.0)}).plot()


def hold() -> plots.style.PlotFigure:
    """The grip in motion of docs/grip-planning.md."""
    pad = pf.ContactPatch.rectangle(0.012, 0.020)
    part = {"mass": 0.3, "centre_of_mass": (0.06, 0.0), "acceleration": 3.0}
    return pf.planning.plan_hold(pad, 0.8, **part, grip=30.0, margin=0.2).plot()


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
