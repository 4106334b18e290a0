"""Fit friction, stiffness and radius of a rubber pad, from a script that uses the paper's model.

A pad of 40 x 20 mm rubs on a plane, with movements from too small to slide up to millimetres. A fine model of the pad,
with bristles in two directions in each cell, provides the "measured" wrenches. The reduced model, built from plain
numbers, is fitted to them twice by gradient descent: with the ellipsoid, and with the limit surface of the pad. Both
fits then predict a movement that they have not seen, and are compared with the library's `ReducedModel`. Run it:

    python examples/from_a_script.py --out out/
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch

import planarfriction as pf
from planarfriction.plots.style import DISTRIBUTED, ELLIPSOID, EXACT, PlotFigure, new_figure, tidy
from planarfriction.torch.reduced_planar import ReducedPlanarLuGre, simulate, tracking_loss

PAD = pf.ContactPatch.rectangle(0.04, 0.02, cells=14)
KNOWN = {"v_s": 2e-3, "gamma": 2.0, "sigma_1": 5.0, "sigma_2": 0.1}
LAW = pf.LuGre(mu_c=0.8, mu_s=0.8, sigma_0=1e5, **KNOWN)
GUESS = {"mu_c": 0.5, "mu_s": 0.5, "sigma_0": 4e4, "radius": 0.02}
FITTED = ("mu_c", "sigma_0", "contact_radius")  # mu_s stays at mu_c
LOAD, DT, STEPS = 2.0, 1e-3, 2000  # [N], [s]
SPEED = 4e-3  # of a point of the pad at the end of the movement [m/s]


class Fitted(NamedTuple):
    """Result of the fit with one limit surface."""

    mu_c: float
    sigma_0: float
    """[1/m]"""
    radius: float
    """[m]"""
    wrenches: np.ndarray
    """Predicted wrenches of the unseen movement, `[STEPS, 3]`."""


def movement(seed: int) -> np.ndarray:
    """Twists `[STEPS, 3]`: six sines in each component; the amplitude grows 200-fold, from sticking to SPEED."""
    random, t = np.random.default_rng(seed), np.arange(STEPS) * DT
    sizes, phases = random.normal(size=(6, 3)), random.uniform(0.0, 2.0 * np.pi, (6, 3))
    frequencies = np.array([0.5, 0.8, 1.1, 1.7, 2.3, 3.1])[:, None]
    sines = (sizes * np.sin(2.0 * np.pi * frequencies * t[:, None, None] + phases)).sum(axis=1)
    return sines / sines.std(axis=0) * 200.0 ** (t / t[-1] - 1.0)[:, None] * SPEED / [1.0, 1.0, PAD.contact_radius()]


def fit(surface: pf.limit_surface.LimitSurface | None, seen: np.ndarray, unseen: np.ndarray, steps: int) -> Fitted:
    """Fit FITTED to the wrenches of the movement `seen`, and predict those of `unseen`."""
    measured = torch.tensor(pf.rollout(pf.DistributedModel(PAD, LAW), None, seen, LOAD, DT).wrenches)
    v_profile = torch.tensor(seen)
    model = ReducedPlanarLuGre(**KNOWN, **GUESS, surface=surface, dtype=torch.float64)
    optimiser = torch.optim.Adam([model.physical.raw[name] for name in FITTED], lr=0.1)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    for _ in range(steps):
        optimiser.zero_grad()
        tracking_loss(model, v_profile, measured, LOAD, DT).backward()
        optimiser.step()
        schedule.step()
    wrenches = simulate(model, torch.tensor(unseen), LOAD, DT).detach().numpy()
    return Fitted(model.mu_c.item(), model.sigma_0.item(), model.radius.item(), wrenches)


def misfit(wrenches: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """RMS error of fx, fy and tau as a share of load, load, and load times contact radius, `[3]` [-]."""
    return np.sqrt(((wrenches - truth) ** 2).mean(axis=0)) / LOAD / [1.0, 1.0, PAD.contact_radius()]


class Comparison(NamedTuple):
    """All wrenches of the unseen movement, and the fits."""

    truth: np.ndarray
    """Wrenches of the distributed model, `[STEPS, 3]`."""
    fits: dict[str, Fitted]
    reduced: np.ndarray
    """Wrenches of `ReducedModel`, with nothing fitted, `[STEPS, 3]`."""


def run(steps: int = 200) -> Comparison:
    """Fit with both surfaces and compare on a movement that neither has seen."""
    seen, unseen = movement(0), movement(1)
    surfaces = {"ellipsoid": None, "exact surface": pf.LimitSurfaceTable(PAD)}
    return Comparison(
        pf.rollout(pf.DistributedModel(PAD, LAW), None, unseen, LOAD, DT).wrenches,
        {name: fit(surface, seen, unseen, steps) for name, surface in surfaces.items()},
        pf.rollout(pf.ReducedModel(PAD, LAW), None, unseen, LOAD, DT).wrenches,
    )


def draw(compared: Comparison) -> PlotFigure:
    """Plot the torque of the unseen movement, and why the ellipsoid gets it wrong: the torque of steady sliding."""
    figure = new_figure(9.2, 3.4)
    left, right = figure.subplots(1, 2, width_ratios=[1.9, 1.0])
    t, scale = np.arange(STEPS) * DT, 1e3
    left.plot(t, scale * compared.truth[:, 2], color=DISTRIBUTED, linewidth=2.6, label="distributed, the truth")
    for (name, fitted), colour in zip(compared.fits.items(), (ELLIPSOID, EXACT), strict=True):
        left.plot(t, scale * fitted.wrenches[:, 2], color=colour, linewidth=1.0, label=f"fitted, {name}")
    left.set(xlabel="time [s]", ylabel="torque [N mm]", xlim=(0.5 * t[-1], t[-1]))
    left.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False, fontsize="small")
    surface, angle = pf.LimitSurfaceTable(PAD), np.radians(np.linspace(0.0, 90.0, 181))
    r = surface.contact_radius
    for axis, style in (("x", "-"), ("y", "--")):
        twist = np.zeros((len(angle), 3))
        twist[:, "xy".index(axis)], twist[:, 2] = np.cos(angle), np.sin(angle) / r
        torque = -surface.wrench(twist)[:, 2] / r
        right.plot(np.degrees(angle), torque, color=EXACT, linestyle=style, label=f"exact surface, slide along {axis}")
    right.plot(np.degrees(angle), np.sin(angle), color=ELLIPSOID, label="ellipsoid")
    right.set(xlabel="from slide (0) to spin (90) [deg]", ylabel="torque / (mu f_N r)", xticks=[0, 30, 60, 90])
    right.legend(loc="lower right", frameon=False, fontsize="small")
    tidy(left)
    tidy(right)
    return figure


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Fit the paper's reduced model to a rubbing pad, with two surfaces.")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder of the picture")
    parser.add_argument("--steps", type=int, default=200, help="steps of the optimiser")
    options = parser.parse_args(arguments)
    compared = run(options.steps)
    print(f"truth: mu_c {LAW.mu_c:.3f}, sigma_0 {LAW.sigma_0:.3g} 1/m, radius {1e3 * PAD.contact_radius():.2f} mm")
    rows = {f"fitted, {name}": (fitted, fitted.wrenches) for name, fitted in compared.fits.items()}
    for name, (fitted, wrenches) in {**rows, "ReducedModel, nothing fitted": (None, compared.reduced)}.items():
        numbers = ""
        if fitted is not None:
            numbers = f" mu_c {fitted.mu_c:.3f}, sigma_0 {fitted.sigma_0:.3g} 1/m, radius {1e3 * fitted.radius:.2f} mm;"
        fx, fy, tau = 100.0 * misfit(wrenches, compared.truth)
        print(f"{name}:{numbers} errors on the unseen movement: {fx:.1f}, {fy:.1f} and {tau:.1f} % (fx, fy, torque)")
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / "from_a_script.png"
    draw(compared).savefig(path)
    print(path)


if __name__ == "__main__":
    main()
