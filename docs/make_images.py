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
from matplotlib.collections import PolyCollection
from matplotlib.patches import Circle, PathPatch, Rectangle

import planarfriction as pf
from planarfriction import plots
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.plots import style, symbols
from planarfriction.plots.motion import outline_of
from planarfriction.plots.patch import cell_boxes

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
    in_hand = {
        model.__name__: pf.simulate(pf.scenes.in_hand(model(circle, LAW)))
        for model in (pf.DistributedModel, pf.ReducedModel)
    }
    beside = ["ellipsoid", pf.LimitSurfaceTablePublished(pads)]
    motion = plots.plot_motion(in_hand["DistributedModel"], size=(5.5, 3.5))
    return {
        "in-hand-motion": motion,
        "in-hand-histories": plots.plot_histories(
            in_hand, panels=("theta", "normal_force"), size=(5.5, 3.4)
        ),
        "limit-surface": plots.plot_sections(pf.LimitSurfaceExact(pads), beside=beside),
        "pre-sliding-cycles": pre_sliding_cycles(),
        "grip-plan": grip_plan(),
        "hold": hold(),
        "discs": discs(),
        "pressure-map": plots.plot_patch(
            fingertip(), normal_force=5.0, size=(4.5, 3.0)
        ),
        "concept-motions": motions(),
        "concept-bristle": bristle(),
        "over-an-edge": over_an_edge(),
    }


def discs() -> plots.style.PlotFigure:
    """Draw the discs that stand for three patches, the darker the more load they carry, over outline or pressure."""
    figure = plots.style.new_figure(style.PAGE, 2.6)
    circle, tee = (PUBLISHED_PATCHES[name]() for name in ("Circle", "NonConvex2"))
    patches = {"disc": circle, "T": tee, "fingertip": fingertip()}
    panels = figure.subplots(1, 3)
    for axes, (words, patch) in zip(panels, patches.items(), strict=True):
        few = patch.discs(pf.ReducedModel.cells)
        boxes = 1e3 * cell_boxes(patch, patch.grid)
        if words == "fingertip":
            cells = PolyCollection(list(boxes), cmap=style.PRESSURE_MAP, alpha=0.55)
            cells.set_array(patch.tile_weights(None) / patch.areas)
            cells.set_clim(0.0, None)
            axes.add_collection(cells)
        else:
            axes.add_patch(PathPatch(outline_of(boxes), fc=style.BODY, ec="none"))
        shares = few.weights() / few.weights().max()
        for centre, radius, share in zip(
            1e3 * few.positions, 1e3 * few.radii, shares, strict=True
        ):
            look = {"color": style.REDUCED, "alpha": 0.6 * share, "lw": 0.0}
            axes.add_patch(Circle(centre, radius, **look))
            axes.add_patch(Circle(centre, radius, fill=False, ec=style.REDUCED, lw=0.7))
        axes.set_title(f"{words}: {few.cells} discs for {patch.cells} cells")
        axes.set(aspect="equal", xlim=(-12, 12), ylim=(-12.5, 11.5))
        axes.axis("off")
    symbols.scale_bar(panels[0], (-11.5, -12.0), 5.0, "5 mm")
    return figure


def motions() -> plots.style.PlotFigure:
    """A pad that slides, turns about a point inside and spins: friction of each cell, and all of it together."""
    pad = pf.ContactPatch.rectangle(0.03, 0.02, cells=8)
    surface = pf.LimitSurfaceExact(pad)
    figure = plots.style.new_figure(style.PAGE, 2.75)
    grid = figure.add_gridspec(2, 3, height_ratios=(3.0, 1.0))
    twists = {
        "translates": (1.0, 0.0, 0.0),
        "rotates about the ring": (0.008, 0.0, 1.0),
        "rotates about its centre": (0.0, 0.0, 1.0),
    }
    corner = int(np.argmax(pad.positions @ [1.0, 1.0]))
    for column, (words, (vx, _, omega)) in enumerate(twists.items()):
        axes = figure.add_subplot(grid[0, column])
        outline = {"fc": style.BODY, "ec": "0.6", "lw": 0.6}
        axes.add_patch(Rectangle((-15.0, -10.0), 30.0, 20.0, **outline))
        x, y = 1e3 * pad.positions.T
        velocity = np.stack([vx - 1e-3 * omega * y, 1e-3 * omega * x])
        way = velocity / np.linalg.norm(velocity, axis=0)
        for place, direction in zip(1e3 * pad.positions, -2.7 * way.T, strict=True):
            symbols.friction(axes, place, direction, size=0.5)
        symbols.velocity(axes, (x[corner], y[corner]), 6.0 * way[:, corner], size=1.2)
        if omega:
            symbols.centre_of_rotation(axes, (0.0, 1e3 * vx / omega))
        axes.set_title(words)
        axes.set(aspect="equal", xlim=(-19, 21), ylim=(-11.5, 15.0))
        axes.axis("off")
        fx, _, tau = surface.wrench((vx, 0.0, omega))
        shares = 100.0 * np.array([abs(tau) / surface.contact_radius, abs(fx)])
        below = figure.add_subplot(grid[1, column])
        below.barh([0, 1], shares, color=style.REDUCED, height=0.6)
        below.set_yticks([0, 1], ["torque", "force"] if not column else ["", ""])
        for place, share in enumerate(shares):
            below.text(share + 2.0, place, f"{share:.0f} %", va="center", fontsize=7)
        below.set(xlim=(0.0, 118.0), xticks=(), ylim=(-0.6, 1.6))
        below.grid(False)
        below.spines[["bottom"]].set_visible(False)
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
    figure = plots.style.new_figure(5.5, 2.7)
    axes = figure.subplots()
    axes.plot(moved, force, color=style.REDUCED, linewidth=1.6)
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
            (pressure, 30.0),
            (used, 1.0),
        ]
        drawn = []
        for ax, (values, most) in zip(column, maps, strict=True):
            shown = np.where(loads > 0.0, values, np.nan).reshape(40, 40)
            extent = np.array([-1.0, 1.0, -1.0, 1.0]) * 500.0 * side
            drawn.append(
                ax.imshow(
                    shown,
                    origin="lower",
                    extent=extent,
                    cmap=plots.style.PRESSURE_MAP,
                    vmin=0.0,
                    vmax=most,
                )
            )
            ax.grid(False)
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
    figure = plots.style.new_figure(style.PAGE, 2.7)
    force, energy = figure.subplots(1, 2)
    words = {pf.ReducedModelPublished: "published", pf.ReducedModel: "ReducedModel"}
    for kind, name in words.items():
        model = kind(PUBLISHED_PATCHES["Circle"](), law)
        fx, taken = small_cycles(model)
        colour = style.model_colour(model)
        look = {"color": colour, "marker": style.MARKERS[colour], "markersize": 3.5}
        letters = {"color": style.LETTERS.get(colour, colour), "ha": "right"}
        for axes, values in ((force, fx), (energy, 1e9 * taken)):
            axes.plot(values, **look)
            ours = kind is pf.ReducedModel
            place = {
                "xytext": (0, 5) if ours else (-12, -3),
                "textcoords": "offset points",
            }
            axes.annotate(name, (len(values) - 1, values[-1]), **place, **letters)
    force.set(xlabel="cycles", ylabel="force left over, fx [N]")
    energy.set(xlabel="cycles", ylabel="energy that friction took [nJ]")
    for axes in (force, energy):
        plots.style.tidy(axes)
        axes.margins(y=0.14)
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
    with style.paper():
        drawn = figures()
    for name, figure in drawn.items():
        path = folder / f"{name}.png"
        figure.savefig(path, dpi=160, facecolor="white", metadata={"Software": None})
        size = path.stat().st_size
        print(f"{name}.png: {size / 1000:.0f} kB")
        if size > LARGEST:
            sys.exit(f"{name}.png is larger than {LARGEST / 1000:.0f} kB")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "images")
