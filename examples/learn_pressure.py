"""Learn a pressure distribution from measured wrenches, by gradient descent through the friction of every cell.

A pad of 24 x 24 mm slides and spins on a plane; a sensor measures force and torque, with noise. How the load is
distributed over the pad is unknown: the weights of its 8 x 8 cells start out equal and follow the gradient of the
misfit. Run it, with PyTorch (`pip install torch --index-url https://download.pytorch.org/whl/cpu`):

    python examples/learn_pressure.py --out out/

What can be learned from wrenches: in steady sliding about a centre of rotation c, the torque about c is
`mu f_N sum w_i |rho_i - c|`, which is an image of the pressure blurred by the kernel |rho - c|. With centres of
rotation all over the pad, as here, the blur can be undone, but detail is damped with the cube of its wave number, so
the noise limits the resolution of the map. The low moments (centre of pressure, contact radius, second moment) are far
more accurate than single cells. Less varied motions determine less, however small the noise:

- straight slides: only the centre of pressure;
- pushing without slip: the centre of pressure and the second moment;
- one spin about a fixed point: three numbers, the mean distance of the load from that point and the mean of its
  directions. The example fits this case too, and gets a wrong map with a perfect fit;
- only a torque sensor, and centres of rotation on one line: the map or its mirror image about that line.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch

import planarfriction as pf
from planarfriction.plots.style import (
    PAGE,
    PRESSURE_MAP,
    REDUCED,
    REFERENCE,
    SHADES,
    new_figure,
    paper,
    tidy,
)
from planarfriction.torch import DistributedModel, rollout, tracking_loss

CELLS, CELL = 8, 3e-3  # cells of a side, side of a cell [m]
LAW = pf.LuGre(mu_c=0.7, mu_s=0.7, sigma_0=1e5, sigma_1=10.0, sigma_2=0.0)
LOAD, DT, STEPS = (
    5.0,
    5e-3,
    2,
)  # [N], [s], steps of one motion: long enough to slide steadily
NOISE = 2e-3  # of the friction force, and of the friction torque: that of a good sensor


class Learnt(NamedTuple):
    """Result of a fit."""

    weights: np.ndarray
    """Share of the load on each cell, `[N]` [-]."""
    losses: list[float]


# ---------------------------------------------------------------------------------------- measured


def true_patch() -> pf.ContactPatch:
    """A heavy spot at the upper left and a lighter one at the lower right, on a light background."""
    x, y = np.meshgrid(*[(np.arange(CELLS) - 0.5 * (CELLS - 1)) * CELL] * 2)
    heavy = np.exp(-((x + 5e-3) ** 2 + (y - 4e-3) ** 2) / (2 * 4e-3**2))
    light = 0.5 * np.exp(-((x - 6e-3) ** 2 + (y + 6e-3) ** 2) / (2 * 3e-3**2))
    return pf.ContactPatch.from_pressure(
        (0.05 + heavy + light)[::-1], CELL
    )  # row 0 is the top


def slides_about_points(count: int, rng: np.random.Generator) -> torch.Tensor:
    """Twists `[count, STEPS, 3]` about centres of rotation all over the pad and around it, in both directions."""
    reach = 0.75 * CELLS * CELL
    cx, cy = rng.uniform(-reach, reach, (2, count))
    omega = rng.choice([-1.0, 1.0], count) * 3.0
    return held(np.stack([omega * cy, -omega * cx, omega], -1))


def spins_about_the_middle(count: int) -> torch.Tensor:
    """Twists of the same spin, `count` times."""
    return held(np.tile([0.0, 0.0, 3.0], (count, 1)))


def held(twists: np.ndarray) -> torch.Tensor:
    return torch.tensor(twists)[:, None].expand(-1, STEPS, -1).contiguous()


def measure(
    patch: pf.ContactPatch, twists: torch.Tensor, rng: np.random.Generator
) -> torch.Tensor:
    """Wrenches of the true patch, with noise."""
    model = DistributedModel(patch, LAW, trainable=(), dtype=torch.float64)
    wrenches = rollout(model, None, twists, LOAD, DT).wrenches
    size = NOISE * LAW.mu_c * LOAD * np.array([1.0, 1.0, float(patch.contact_radius())])
    return wrenches + torch.tensor(rng.normal(size=wrenches.shape) * size)


# ---------------------------------------------------------------------------------------- learnt


def learn(twists: torch.Tensor, wrenches: torch.Tensor, steps: int) -> Learnt:
    """Fit the weights of the cells to all wrenches with Adam, starting from equal weights."""
    flat = pf.ContactPatch.from_pressure(np.ones((CELLS, CELLS)), CELL)
    model = DistributedModel(flat, LAW, trainable=("weights",), dtype=torch.float64)
    optimiser = torch.optim.Adam(model.parameters(), lr=0.1)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    losses = []
    for _ in range(steps):
        optimiser.zero_grad()
        loss = tracking_loss(model, None, twists, LOAD, DT, wrenches)
        loss.backward()
        optimiser.step()
        schedule.step()
        losses.append(loss.item())
    return Learnt(model.weights.detach().numpy(), losses)


def moved_load(truth: pf.ContactPatch, weights: np.ndarray) -> float:
    """Share of the load that is on the wrong cell."""
    return 0.5 * float(np.abs(weights - truth.weights()).sum())


def summary(truth: pf.ContactPatch, weights: np.ndarray) -> dict[str, float]:
    """Errors of a learnt map: centre of pressure [m], contact radius, second moment and cells [shares]."""
    patch = pf.ContactPatch.points(truth.positions, weights)
    shift = patch.centre_of_pressure() - truth.centre_of_pressure()
    return {
        "centre": float(np.hypot(*shift)),
        "radius": abs(float(patch.contact_radius() / truth.contact_radius()) - 1.0),
        "second moment": abs(
            float(patch.second_moment() / truth.second_moment()) - 1.0
        ),
        "moved load": moved_load(truth, weights),
    }


# ---------------------------------------------------------------------------------------- shown


def draw(truth: pf.ContactPatch, rich: Learnt, poor: Learnt):
    """Plot three maps on one scale, and the misfits during the fit."""
    figure = new_figure(PAGE, 2.3)
    axes = figure.subplots(1, 4, width_ratios=[1, 1, 1, 1.25])
    half = 0.5e3 * CELLS * CELL
    maps = {
        "true": truth.weights(),
        "learnt, many points": rich.weights,
        "learnt, one spin": poor.weights,
    }
    top = 100 * max(weights.max() for weights in (truth.weights(), rich.weights))
    for ax, (title, weights) in zip(axes, maps.items(), strict=False):
        image = ax.imshow(
            100 * weights.reshape(CELLS, CELLS),
            cmap=PRESSURE_MAP,
            vmin=0,
            vmax=top,
            extent=(-half, half, -half, half),
        )
        ax.set_title(title)
        ax.set_xlabel("x [mm]")
        ax.grid(False)
    axes[0].set_ylabel("y [mm]")
    figure.colorbar(
        image, ax=axes[:3].tolist(), label="load on a cell [%]", shrink=0.85
    )
    for learnt, label, colour in (
        (rich, "many points", REDUCED),
        (poor, "one spin", SHADES[0]),
    ):
        axes[3].semilogy(np.sqrt(learnt.losses), color=colour, label=label)
    axes[3].axhline(
        np.sqrt(3) * NOISE * LAW.mu_c,
        color=REFERENCE,
        linewidth=0.8,
        linestyle="--",
        label="noise",
    )
    axes[3].set_xlabel("step of the optimiser")
    axes[3].set_ylabel("RMS misfit / load")
    axes[3].legend(frameon=False)
    tidy(axes[3])
    return figure


def run(
    steps: int = 300, motions: int = 200, seed: int = 0
) -> tuple[pf.ContactPatch, Learnt, Learnt]:
    """Measure and learn twice: from turns about many points, and from one spin only."""
    rng = np.random.default_rng(seed)
    truth = true_patch()
    fits = [
        learn(twists, measure(truth, twists, rng), steps)
        for twists in (
            slides_about_points(motions, rng),
            spins_about_the_middle(motions // 10),
        )
    ]
    return truth, fits[0], fits[1]


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        description="Learn a pressure distribution from wrenches."
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out"), help="folder of the picture"
    )
    parser.add_argument("--steps", type=int, default=300, help="steps of the optimiser")
    options = parser.parse_args(arguments)
    truth, rich, poor = run(options.steps)
    for name, learnt in (("turns about many points", rich), ("one spin only", poor)):
        errors = summary(truth, learnt.weights)
        print(
            f"{name}: misfit {np.sqrt(learnt.losses[-1]):.4f} of the load, centre of pressure off by"
            f" {1e3 * errors['centre']:.3f} mm, contact radius by {100 * errors['radius']:.2f} %, second moment by"
            f" {100 * errors['second moment']:.1f} %; {100 * errors['moved load']:.0f} % of the load on wrong cells"
        )
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / "learn_pressure.png"
    with paper():
        draw(truth, rich, poor).savefig(path, dpi=160)
    print(path)


if __name__ == "__main__":
    main()
