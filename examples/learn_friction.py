"""Learn the friction coefficient from the skin of a soft fingertip before it slips.

A plate is held between two soft fingertips whose grip falls until it slips out. 16 markers on the skin are displaced by
the elastic field of the contact, as a camera in the fingertip would see them. 1,000 such slips with random friction,
mass, centre of mass and grip are simulated by `pf.sweep`, with labels: twist, wrench, normal force, markers, onset of
incipient slip and of the slip of the whole contact. A small network learns the friction coefficient from one frame of
markers and the normal force at a random time before the contact slips. Run it, with PyTorch
(`pip install torch --index-url https://download.pytorch.org/whl/cpu`):

    python examples/learn_friction.py --slips 1000 --out out/

Friction shows before slip because the rim of the contact slips first: markers there stay behind, the more so the nearer
the force is to the limit. In a contact that sticks all over, displacements tell the force, and nothing of the friction.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch

import planarfriction as pf

RADIUS, MODULUS, RATIO = 8e-3, 0.2e6, 0.49  # of the contact [m], shear [Pa], Poisson's
FRAME, END = 0.01, 0.6  # time between frames, of the end [s]
SETTLED = (
    0.15  # the plate has come to rest on the pads, and the grip begins to fall [s]
)
BEFORE = 0.01  # least time between the frame that is learnt from and the slip [s]
NOISE = 2e-6  # of the place of a marker [m]
EACH, BATCH = 10, 256  # frames of a slip that are learnt from, and of a step
SIDE = 4  # markers along a side of the square around the contact


def pressure(x: Any, y: Any) -> Any:
    return np.maximum(1.0 - (x * x + y * y) / RADIUS**2, 0.0) ** 0.5


PATCH = pf.ContactPatch.disc(RADIUS, cells=15, pressure=pressure)
LAW = pf.LuGre(mu_c=1.0, sigma_1=0.0, elasto_plastic=0.9)
_AT = np.linspace(-0.9, 0.9, SIDE) * RADIUS
PLACES = np.stack(np.meshgrid(_AT, _AT), axis=-1).reshape(-1, 2)


class Fingertip(NamedTuple):
    """A fingertip at a friction coefficient of 1, and the markers on its skin."""

    model: pf.ReducedModel
    markers: pf.tactile.Markers


def fingertip() -> Fingertip:
    """Fit the discs of the pad, once."""
    pad = pf.Pad.half_space(MODULUS, RATIO)
    model = pf.ReducedModel(PATCH, LAW, pad=pad)
    return Fingertip(model, pf.tactile.markers(model, PLACES))


# ---------------------------------------------------------------------------------------- simulated


class Slips:
    """Random slips by their number, and their labels."""

    def __init__(self, tip: Fingertip, seed: int = 0):
        self.tip = tip
        self.seed = seed

    def friction(self, case: int) -> float:
        return float(np.random.default_rng((self.seed, case)).uniform(0.3, 1.2))

    def scene(self, case: int) -> pf.Scene:
        """Hold a plate with 2 to 3 times the grip that it needs, and let go."""
        mu = self.friction(case)
        rng = np.random.default_rng((self.seed, case, 1))
        mass = rng.uniform(0.1, 0.3)
        across, up = rng.uniform(-4e-3, 4e-3, 2)
        most = rng.uniform(2.0, 3.0) * 0.5 * 9.81 * mass / mu
        times = [0.0, SETTLED, rng.uniform(0.45, 0.55), END]
        grip = pf.Signal(times, [most, most, 0.2 * most, 0.2 * most], "linear")
        law = pf.LuGre(mu_c=mu, sigma_1=0.0, elasto_plastic=0.9)
        scene = pf.scenes.in_hand(
            self.tip.model.with_law(law), normal_force=grip, mass=mass,
            centre_of_mass=(across, up), t_end=END,
        )  # fmt: skip
        return dataclasses.replace(scene, save_every=FRAME)

    def labels(self, solution: pf.Solution) -> dict[str, Any]:
        """Return what a camera, a force sensor and an oracle would tell of a slip."""
        data = solution.data
        events = solution.slip_events()
        slid = [event for event in events if event.onset > SETTLED]
        moved = pf.tactile.displacement(
            self.tip.model, data.bristles_fingers.values, self.tip.markers
        )
        wrench = np.stack([data[name].values[:, 0] for name in ("fx", "fy", "tau")], 1)
        return {
            "markers": moved.astype(np.float32),
            "twist": solution.contact_twist().astype(np.float32),
            "wrench": wrench.astype(np.float32),
            "normal_force": data.normal_force.values[:, 0].astype(np.float32),
            "incipient": slid[0].incipient if slid else np.nan,
            "onset": slid[0].onset if slid else np.nan,
        }


def simulated(tip: Fingertip, count: int) -> tuple[Any, np.ndarray]:
    """Return the labels of slips as a dataset, and their friction coefficients."""
    slips = Slips(tip)
    cases = list(range(count))
    data = pf.sweep(slips.scene, {"case": cases}, bristles="all", measure=slips.labels)
    return data, np.array([slips.friction(case) for case in cases])


# ---------------------------------------------------------------------------------------- learnt


class Frames(NamedTuple):
    """A frame of each slip before it begins."""

    markers: np.ndarray
    """`[B, P, 2]` [m]"""
    wrench: np.ndarray
    """`[B, 3]`"""
    normal_force: np.ndarray
    """`[B]` [N]"""
    used: np.ndarray
    """Friction force over its limit `[B]` [-]."""


def frames(
    data: Any, mu: np.ndarray, each: int, seed: int
) -> tuple[Frames, np.ndarray]:
    """Choose frames of each slip at random, and return them with their friction coefficients."""
    rng = np.random.default_rng(seed)
    clock = FRAME * np.arange(data.normal_force.shape[1])
    onset = data.onset.values
    last = np.searchsorted(clock, onset - BEFORE, side="right") - 1
    first = np.searchsorted(clock, SETTLED)
    chosen = np.flatnonzero(np.isfinite(onset) & (last >= first))
    chosen = np.repeat(chosen, each)
    at = rng.integers(first, last[chosen] + 1)
    load = data.normal_force.values[chosen, at]
    wrench = data.wrench.values[chosen, at]
    used = np.hypot(*wrench[:, :2].T) / (mu[chosen] * load)
    moved = data.markers.values[chosen, at]
    moved = moved + NOISE * rng.normal(size=moved.shape)
    return Frames(moved, wrench, load, used), mu[chosen]


def learned(
    known: Frames, mu: np.ndarray, steps: int, seed: int = 0
) -> torch.nn.Module:
    """Fit the logarithm of friction to markers per normal force."""
    torch.manual_seed(seed)
    inputs = _inputs(known)
    middle, width = inputs.mean(dim=0), inputs.std(dim=0) + 1e-9
    count = inputs.shape[1]
    net = torch.nn.Sequential(
        _Scaled(middle, width),
        torch.nn.Linear(count, 64),
        torch.nn.Tanh(),
        torch.nn.Linear(64, 64),
        torch.nn.Tanh(),
        torch.nn.Linear(64, 1),
    )
    wanted = torch.tensor(np.log(mu), dtype=torch.float32)[:, None]
    optimiser = torch.optim.AdamW(net.parameters(), lr=3e-3, weight_decay=1e-2)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    for _ in range(steps):
        some = torch.randint(len(inputs), (BATCH,))
        optimiser.zero_grad()
        loss = torch.nn.functional.mse_loss(net(inputs[some]), wanted[some])
        loss.backward()
        optimiser.step()
        schedule.step()
    return net


class _Scaled(torch.nn.Module):
    """Inputs of mean 0 and width 1."""

    def __init__(self, middle: torch.Tensor, width: torch.Tensor):
        super().__init__()
        self.register_buffer("middle", middle)
        self.register_buffer("width", width)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return (x - self.middle) / self.width


def _inputs(seen: Frames) -> torch.Tensor:
    """Return displacements per normal force, and the logarithm of that."""
    load = seen.normal_force[:, None]
    flat = seen.markers.reshape(len(load), -1)
    numbers = np.hstack([flat / load * 1e3, flat * 1e3, np.log(load)])
    return torch.tensor(numbers, dtype=torch.float32)


def predicted(net: torch.nn.Module, seen: Frames) -> np.ndarray:
    with torch.no_grad():
        return np.exp(net(_inputs(seen)).numpy()[:, 0])


def error(found: np.ndarray, mu: np.ndarray) -> float:
    """Root mean square of relative errors."""
    return float(np.sqrt(np.mean((found / mu - 1.0) ** 2)))


def _needed(seen: Frames) -> np.ndarray:
    """Return the friction coefficient that the force needs at least."""
    return np.hypot(*seen.wrench[:, :2].T) / seen.normal_force


class Result(NamedTuple):
    """Errors on slips that were not learnt from."""

    slips: int
    """Number of slips that were simulated."""
    size: int
    """Bytes of their labels."""
    seconds: float
    """Time of the simulations [s]."""
    net: float
    """Error of the network [-]."""
    late: float
    """Its error where more than 0.7 of the friction limit is used [-]."""
    mean: float
    """Error of the mean friction [-]."""
    force: float
    """Error of the friction that the measured force needs, a lower bound, scaled to be right on average [-]."""


def run(count: int = 1000, steps: int = 4000, out: Path | None = None) -> Result:
    """Simulate slips, learn from four fifths of them, and judge by the others."""
    tip = fingertip()
    begin = time.perf_counter()
    data, mu = simulated(tip, count)
    seconds = time.perf_counter() - begin
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        data.to_netcdf(out / "slips.nc")
    known = np.arange(count) < 0.8 * count
    some, mu_of_some = frames(data.isel(case=known), mu[known], EACH, 1)
    others, truth = frames(data.isel(case=~known), mu[~known], 1, 2)
    net = learned(some, mu_of_some, steps)
    found = predicted(net, others)
    late = others.used > 0.7
    scale = np.mean(mu_of_some) / np.mean(_needed(some))
    return Result(
        count, int(data.nbytes), seconds, error(found, truth),
        error(found[late], truth[late]), error(np.full(len(truth), mu[known].mean()), truth),
        error(scale * _needed(others), truth),
    )  # fmt: skip


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        description="Learn the friction coefficient from markers before slip."
    )
    parser.add_argument("--slips", type=int, default=1000, help="number of slips")
    parser.add_argument("--steps", type=int, default=4000, help="of the optimiser")
    parser.add_argument("--out", type=Path, help="folder of slips.nc")
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    found = run(options.slips, options.steps, options.out)
    print(f"{found.slips} slips in {found.seconds:.0f} s, {found.size / 1e6:.1f} MB")
    print(f"friction from markers: {100 * found.net:.1f} % off (root mean square)")
    print(f"  beyond 0.7 of the limit: {100 * found.late:.1f} %")
    print(f"from the force alone: {100 * found.force:.0f} %")
    print(f"from the mean: {100 * found.mean:.0f} %")


if __name__ == "__main__":
    main()
