"""Make the pictures of other-worlds.md: `python docs/make_worlds.py [FOLDER]`, `docs/images` unless it is named."""

from __future__ import annotations

import importlib.util
import math
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import planarfriction as pf
from planarfriction.plots.motion import draw_motion
from planarfriction.plots.style import ELLIPSOID, EXACT, PALETTE, PRESSURE_MAP, PlotFigure, new_figure, tidy

LARGEST = 200_000
"""Largest size of a picture [bytes]."""

DOCS = Path(__file__).parent
PAGE = DOCS / "other-worlds.md"
LAW = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
COULOMB = pf.LuGre(mu_c=0.2, sigma_0=1e5, sigma_1=10.0, sigma_2=0.0)
RADIUS = 0.04


def from_page(first: str) -> dict[str, Any]:
    """Names that the Python block of the page defines whose text holds `first`."""
    blocks = PAGE.read_text(encoding="utf-8").split("```python\n")[1:]
    names: dict[str, Any] = {"np": np, "pf": pf, "print": lambda *_: None}
    exec(next(block for block in blocks if first in block.split("```")[0]).split("```")[0], names)
    return names


def pivot() -> PlotFigure:
    """The part as it swings, and its angle for grips that are loosened for different times."""
    finger = pf.SoftFinger(c=0.006, n=1 / 3, k=2.0, radius_max=0.012)
    pads = pf.DistributedModel(pf.ContactPatch.disc(0.012, pressure=finger), LAW)
    figure = new_figure(8.6, 3.8)
    parts: Any = figure.subfigures(1, 2, width_ratios=(1.1, 1.0))
    left, right = parts
    draw_motion(left, pf.simulate(pf.scenes.pivot(pads, t_end=0.5)))
    grip, angle = right.subplots(2, 1, sharex=True, height_ratios=(1.0, 2.2))
    for colour, length in zip(PALETTE, (0.06, 0.09, 0.12, 0.15), strict=False):
        load = pf.Signal.sampled([0.0, 0.2, 0.2 + length], [4.0, 1.0, 6.0])
        data = pf.simulate(pf.scenes.pivot(pads, normal_force=load, t_end=0.5), save_every=2e-3).data
        grip.step(data.time, load(data.time), where="post", color=colour)
        angle.plot(data.time, np.degrees(data.theta), color=colour, label=f"{1e3 * length:.0f} ms")
    grip.set(ylabel="grip [N]", ylim=(0.0, 6.5))
    angle.set(xlabel="time [s]", ylabel="angle [deg]")
    angle.legend(title="loosened for", fontsize="small", title_fontsize="small")
    tidy(grip)
    tidy(angle)
    return figure


def foot() -> PlotFigure:
    """The sole, the torque that it holds beside a side force, and the foot that walks sideways."""
    page = from_page("sole =")
    sole, outline, rays, centre = (page[name] for name in ("sole", "outline", "rays", "centre"))
    figure = new_figure(8.6, 5.8)
    left, beside = figure.subfigures(1, 2, width_ratios=(0.62, 1.0))
    middle, right = beside.subfigures(2, 1, height_ratios=(0.85, 1.0))
    axes = left.subplots()
    shown = axes.scatter(*(1e3 * sole.positions[:, ::-1].T), c=sole.weights() / sole.areas, cmap=PRESSURE_MAP, s=30)
    shown.set_clim(0.0)
    closed = 1e3 * np.concatenate([outline, outline[:1]])
    axes.plot(closed[:, 1], closed[:, 0], color="0.3", linewidth=1.0)
    turn = pf.LimitSurfaceExact(sole).twist((0.0, 0.0, -1.0))
    mark: Any = {"markersize": 11, "markeredgecolor": "white", "markeredgewidth": 1.5}
    axes.plot(1e3 * centre[1], 1e3 * centre[0], "o", color=PALETTE[1], label="centre of pressure", **mark)
    axes.plot(1e3 * turn[0] / turn[2], -1e3 * turn[1] / turn[2], "^", color=PALETTE[3], label="turns about", **mark)
    axes.set(xlabel="to the left [mm]", ylabel="from the heel [mm]", aspect="equal", xlim=(55, -55))
    tidy(axes)
    left.legend(fontsize="small", loc="outside upper center", frameon=False)
    axes = middle.subplots()
    for kind, label, look in (
        (pf.LimitSurfaceExact, "exact", {"color": EXACT}),
        (pf.LimitSurfaceEllipsoid, "ellipsoid", {"color": ELLIPSOID, "linestyle": "--"}),
    ):
        surface = kind(sole)
        both = np.concatenate([rays[::-1] * [1.0, -1.0, 1.0], rays[1:]])
        beside = surface.wrench(surface.twist(pf.geometry.wrench_at(both, -centre)))
        _, side, torque = pf.geometry.wrench_at(beside, centre).T
        axes.plot(side, 1e3 * torque, label=label, **look)
    axes.set(xlabel="side force, to the left, over mu f_N", ylabel="torque over mu f_N [mm]", ylim=(0.0, None))
    axes.legend(fontsize="small")
    tidy(axes)
    draw_motion(right, pf.simulate(pf.scenes.foot(pf.DistributedModel(pf.ContactPatch.disc(0.03), LAW))))
    return figure


def terminal_ratio(gyration: float) -> float:
    """v/(omega R) [-] that a uniform disc keeps while it stops, for a radius of gyration over R in (1/2, sqrt(2/3))."""

    def ring(v: float, u: float) -> tuple[float, float]:
        m = 4.0 * v * u / (v + u) ** 2
        big, small = (v + u) * ellipe(m), (v - u) * ellipk(m)
        return (big + small) / (math.pi * v), (big - small) / (math.pi * u)

    def drift(ratio: float) -> float:
        at = [ratio] if ratio < 1.0 else None
        force = quad(lambda s: 2.0 * s * ring(ratio, s)[0], 0.0, 1.0, points=at)[0]
        torque = quad(lambda s: 2.0 * s * s * ring(ratio, s)[1], 0.0, 1.0, points=at)[0]
        return force / ratio - torque / gyration**2

    return brentq(drift, 0.01, 100.0)  # pyright: ignore


def slide(gyration: float, ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """Speed [m/s] and v/(omega R) of a disc that starts with 1 m/s."""
    model = pf.ReducedModel(pf.ContactPatch.disc(RADIUS), COULOMB, parts=1)
    inertia, twist = (gyration * RADIUS) ** 2, (1.0, 0.0, 1.0 / (ratio * RADIUS))
    scene = pf.scenes.free_slide(model, mass=1.0, inertia=inertia, twist=twist, save_every=1e-3)
    data = pf.simulate(scene).data
    kept = np.asarray(data.vx) > 5e-3
    return np.asarray(data.vx)[kept], np.asarray(data.vx / (RADIUS * data.omega))[kept]


def curling() -> PlotFigure:
    """Ratios over the speed, where they end over the radius of gyration, and the stone."""
    figure = new_figure(9.2, 3.2)
    speed, ends, stone = figure.subplots(1, 3)
    for ratio in (0.2, 0.4, 0.65, 1.0, 1.6, 3.0):
        v, found = slide(math.sqrt(0.5), ratio)
        speed.semilogx(v, found, color=PALETTE[0], linewidth=1.2)
    speed.axhline(0.653, color="0.3", linestyle="--", linewidth=1.0)
    speed.set(xlabel="speed v [m/s]", ylabel="v/(omega R), uniform disc", ylim=(0.0, 2.0), xlim=(1.0, 5e-3))
    lines = np.linspace(0.515, 0.808, 40)
    ends.semilogy(lines, [terminal_ratio(k) for k in lines], color="0.3", label="closed form")
    for label, marker, colour, least in (("at 0.3 m/s", "o", "0.7", 0.3), ("at 1 cm/s", "o", PALETTE[1], 0.01)):
        gyrations = np.linspace(0.3, 1.1, 17)
        ratios = [found[v > least][-1] for v, found in (slide(k, 1.0) for k in gyrations)]
        ends.semilogy(gyrations, ratios, marker, color=colour, markersize=4, label=label)
    for limit in (0.5, math.sqrt(2.0 / 3.0)):
        ends.axvline(limit, color="0.6", linewidth=0.8, linestyle=":")
    ends.set(xlabel="radius of gyration over R", ylabel="v/(omega R)", ylim=(1e-2, 1e3))
    ends.legend(fontsize="small")
    ice = pf.LuGre(mu_c=0.01, sigma_0=1e5, sigma_1=10.0, sigma_2=0.0)
    data = pf.simulate(pf.scenes.curling(pf.ReducedModel(pf.ContactPatch.ring(0.0585, 0.0645), ice, parts=1))).data
    stone.plot(data.time, data.vx, color=PALETTE[0], label="speed v")
    stone.plot(data.time, 0.0615 * data.omega, color=PALETTE[1], label="speed of the band, omega R")
    stone.set(xlabel="time [s]", ylabel="curling stone [m/s]", ylim=(0.0, 3.0))
    stone.legend(fontsize="small")
    for axes in (speed, ends, stone):
        tidy(axes)
    return figure


def tyre() -> PlotFigure:
    """The picture of the example."""
    example = module(DOCS.parent / "examples" / "tyre.py")
    angles = np.radians(np.linspace(0.0, 12.0, 25))
    return example.draw(angles, example.roll(example.sideways(angles)))


def module(path: Path) -> ModuleType:
    """A script as a module."""
    specification = importlib.util.spec_from_file_location(path.stem, path)
    assert specification is not None and specification.loader is not None
    loaded = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(loaded)
    return loaded


def main(folder: Path) -> None:
    """Write every picture and say how large it is."""
    folder.mkdir(parents=True, exist_ok=True)
    for make in (pivot, foot, curling, tyre):
        path = folder / f"worlds-{make.__name__}.png"
        make().savefig(path, dpi=110, facecolor="white", metadata={"Software": None})
        size = path.stat().st_size
        print(f"{path.name}: {size / 1000:.0f} kB")
        if size > LARGEST:
            sys.exit(f"{path.name} is larger than {LARGEST / 1000:.0f} kB")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS / "images")
