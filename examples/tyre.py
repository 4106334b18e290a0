"""A rolling tyre: bristles move through the contact patch; the result is compared with the closed-form brush model.

The patch of a tyre is a grid of cells with the bristles of the distributed model. Each time the tyre rolls forward by
one column of cells, every bristle moves one column towards the rear, and new bristles enter at the front without
deflection. Where the pressure becomes too low for the deflection of a bristle, the bristle slides back at once. As in
the brush model, the stiffness of the bristles does not depend on the pressure. With `s = theta tan(alpha)`,
`theta = 2 c a^2/(3 mu f_N)` and `l = 1 - s` (0 in full sliding), for a parabolic pressure (Pacejka 2012, section 3.2):

    F = mu f_N (1 - l^3),    T = mu f_N a l^3 (1 - l)

Run it:

    python examples/tyre.py --out out/

It draws a picture and prints the largest differences over 25 slip angles up to 12 degrees, as shares of the largest
force and torque:

    largest difference from the brush model: force 0.10 %, torque 0.52 %
    if bristles above their limit relax as in LuGre: force 15 %, torque 102 %
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np

import planarfriction as pf
from planarfriction import formulas
from planarfriction.formulas import LawNumbers
from planarfriction.plots.style import DISTRIBUTED, SHADES, PlotFigure, new_figure, tidy

LOAD, MU = 4000.0, 0.9  # [N], [-]
HALF_LENGTH, WIDTH = 0.06, 0.14  # a and the width of the patch [m]
STIFFNESS = 1e7  # c: force per deflection and length of the patch [N/m^2]
COLUMNS, ROWS, PARTS = (
    120,
    2,
    4,
)  # cells along and across, steps while a bristle moves on by one column
BREAKAWAY = (
    0.99  # the brush model has 1: bristles that do not give at all until they slide
)


class Rolling(NamedTuple):
    """Results of rolling, for each slip."""

    wrenches: np.ndarray
    """`(fx, fy, tau)` about the middle of the patch after each column, `[steps, slips, 3]` [N, N, N m]."""
    field: np.ndarray
    """Bristles at the end, from rear to front, `[slips, 2, ROWS, COLUMNS]` [m]."""


def patch_of_a_tyre() -> pf.ContactPatch:
    """A rectangle whose pressure is a parabola along x, the rolling direction."""
    return pf.ContactPatch.rectangle(
        2.0 * HALF_LENGTH,
        WIDTH,
        (COLUMNS, ROWS),
        pressure=lambda x, y: 1.0 - (x / HALF_LENGTH) ** 2,
    )


def bristles(patch: pf.ContactPatch) -> LawNumbers:
    """Law of each cell, with a sharp breakaway; its stiffness per unit load makes all bristles equally stiff."""
    stiffness = STIFFNESS * 2.0 * HALF_LENGTH / patch.cells / LOAD
    plain = pf.LuGre(
        mu_c=MU, sigma_1=0.0, sigma_2=0.0, elasto_plastic=BREAKAWAY
    ).numbers
    return LawNumbers(*plain)._replace(sigma_0=stiffness / patch.weights())


def bend(
    z: np.ndarray, velocity: np.ndarray, dt: np.ndarray, law: LawNumbers
) -> np.ndarray:
    """Bristles `[..., 2, N]` [m] after `dt` at constant velocity: the step of `DistributedModel`, a law per cell."""
    speed = np.linalg.norm(velocity, axis=-2, keepdims=True)
    grip = law.sigma_0 / formulas.stribeck(np, speed, law)

    def decay(z: np.ndarray, size: np.ndarray) -> np.ndarray:
        along = np.sum(z * velocity, axis=-2, keepdims=True) / np.where(
            size > 0.0, size, 1.0
        )
        return formulas.bristle_decay(np, size * grip, along, speed, grip, law)

    size = np.linalg.norm(z, axis=-2, keepdims=True)
    start, ahead = decay(z, size), z + velocity * dt
    ahead = ahead / (1.0 + start * dt)
    end = decay(ahead, np.linalg.norm(ahead, axis=-2, keepdims=True))
    left, mean = formulas.relaxation(np, formulas.mean_decay(start, end, dt) * dt)
    z = z * left + velocity * dt * mean
    return z * formulas.cap(
        np,
        np.linalg.norm(z, axis=-2, keepdims=True) * grip,
        np.maximum(size * grip, 1.0),
    )


def roll(
    slips: np.ndarray, steps: int = COLUMNS, *, slide_back: bool = True
) -> Rolling:
    """Roll by `steps` columns from relaxed bristles, with each of `slips` `(vx, vy, omega)` per unit rolling speed.

    `slips` `[slips, 3]` [1, 1, 1/m] is the twist of the patch relative to the ground, without the rolling motion. With
    `slide_back=False`, bristles above their largest deflection relax according to the LuGre law instead.
    """
    patch = patch_of_a_tyre()
    law, load = bristles(patch), LOAD * patch.weights()
    x, y = patch.positions.T
    lever = np.array([[1.0 + 0.0 * x, 0.0 * x], [0.0 * x, 1.0 + 0.0 * x], [-y, x]])
    velocity = np.einsum("sd,dan->san", slips, lever)
    way = 2.0 * HALF_LENGTH / COLUMNS  # from the middle of a column to that of the next
    ways = np.where(
        x > HALF_LENGTH - way, 0.5 * way, way
    )  # those at the front come from its edge
    z, wrenches = np.zeros_like(velocity), np.zeros((steps, len(slips), 3))
    for step in range(steps):
        field = z.reshape(
            len(slips), 2, ROWS, COLUMNS
        )  # row by row, each from the rear to the front
        field[..., :-1], field[..., -1] = field[..., 1:].copy(), 0.0
        if slide_back:
            z *= formulas.cap(
                np, np.linalg.norm(z, axis=1, keepdims=True) * law.sigma_0 / MU, 1.0
            )
        for _ in range(PARTS):
            z = bend(z, velocity, ways / PARTS, law)
        wrenches[step] = -np.einsum("n,dan,san->sd", load * law.sigma_0, lever, z)
    return Rolling(wrenches, z.reshape(len(slips), 2, ROWS, COLUMNS))


def brush(slope: np.ndarray) -> np.ndarray:
    """Side force `[N]` and aligning torque `[N m]` of the brush model at `tan(alpha)` = `slope` >= 0, `[2, ...]`."""
    left = np.maximum(
        1.0 - 2.0 * STIFFNESS * HALF_LENGTH**2 / (3.0 * MU * LOAD) * slope, 0.0
    )
    return MU * LOAD * np.array([1.0 - left**3, HALF_LENGTH * left**3 * (1.0 - left)])


def sideways(angles: np.ndarray) -> np.ndarray:
    """Slips `[..., 3]` of a wheel that moves at `angles` [rad] to its plane: velocity divided by rolling velocity."""
    return np.stack([0.0 * angles, np.tan(angles), 0.0 * angles], axis=-1)


def errors(angles: np.ndarray, wrenches: np.ndarray) -> np.ndarray:
    """Largest difference of force and torque from the brush model, relative to its largest value, `[2]` [-]."""
    expected = brush(np.tan(angles))
    found = np.stack([-wrenches[:, 1], wrenches[:, 2]])
    return np.abs(found - expected).max(axis=1) / np.abs(expected).max(axis=1)


def draw(angles: np.ndarray, rolling: Rolling) -> PlotFigure:
    """Plot force and torque against slip angle, the bent bristles at three angles, and how the force builds up."""
    figure = new_figure(10.0, 5.6)
    (force, torque), (bent, built) = figure.subplots(2, 2)
    degrees, fine = (
        np.degrees(angles),
        np.radians(np.linspace(0.0, np.degrees(angles[-1]), 200)),
    )
    expected = brush(np.tan(fine))
    for axes, found, closed, label in (
        (force, -rolling.wrenches[-1, :, 1], expected[0], "side force [N]"),
        (torque, rolling.wrenches[-1, :, 2], expected[1], "aligning torque [N m]"),
    ):
        axes.plot(
            np.degrees(fine), closed, color="0.3", label="brush model, closed form"
        )
        axes.plot(
            degrees,
            found,
            "o",
            color=DISTRIBUTED,
            markersize=4,
            label="cells, convected",
        )
        axes.set(xlabel="slip angle [deg]", ylabel=label)
        axes.legend()
    x = 1e3 * HALF_LENGTH * ((2.0 * np.arange(COLUMNS) + 1.0) / COLUMNS - 1.0)
    limit = (
        1.5
        * MU
        * LOAD
        / (2.0 * HALF_LENGTH * STIFFNESS)
        * (1.0 - (x / 1e3 / HALF_LENGTH) ** 2)
    )
    bent.plot(x, 1e3 * limit, color="0.6", linestyle="--", label="largest deflection")
    for colour, angle in zip(SHADES[1:], (1.0, 3.0, 6.0), strict=True):
        k = int(np.abs(degrees - angle).argmin())
        bent.plot(
            x,
            1e3 * rolling.field[k, 1].mean(axis=0),
            color=colour,
            label=f"{degrees[k]:.0f} deg",
        )
        way = 1e3 * (np.arange(len(rolling.wrenches)) + 1) * 2.0 * HALF_LENGTH / COLUMNS
        built.plot(
            way, -rolling.wrenches[:, k, 1], color=colour, label=f"{degrees[k]:.0f} deg"
        )
    bent.set(
        xlabel="position in the patch [mm], rolling to the right",
        ylabel="deflection [mm]",
    )
    built.set(
        xlabel="distance rolled after the wheel was turned [mm]",
        ylabel="side force [N]",
    )
    for axes in (force, torque, bent, built):
        tidy(axes)
    bent.set_ylim(top=1.35e3 * float(limit.max()))
    bent.legend(ncols=2, loc="upper center")
    built.legend()
    return figure


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        description="A rolling tyre against the brush model."
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out"), help="folder of the picture"
    )
    options = parser.parse_args(arguments)
    angles = np.radians(np.linspace(0.0, 12.0, 25))
    rolling = roll(sideways(angles))
    force, torque = 100.0 * errors(angles, rolling.wrenches[-1])
    print(
        f"largest difference from the brush model: force {force:.2f} %, torque {torque:.2f} %"
    )
    relaxed = roll(sideways(angles), slide_back=False)
    force, torque = 100.0 * errors(angles, relaxed.wrenches[-1])
    print(
        f"if bristles above their limit relax as in LuGre: force {force:.0f} %, torque {torque:.0f} %"
    )
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / "tyre.png"
    draw(angles, rolling).savefig(path)
    print(path)


if __name__ == "__main__":
    main()
