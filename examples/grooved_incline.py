"""A block with a grooved sole drifts sideways down an incline: in which direction, and at which slope does it start?

The friction coefficient is `mu along` along the grooves and `mu across` across them, and the grooves are at 40 degrees
to the fall line. Friction, `-mu N M e/|e|_M` with `|e|_M = sqrt(e' M e)`, is not opposite to the motion `e`: it
deviates away from the grooves, so the block drifts towards them. A block that starts from rest slides in a constant
direction `e`, the one in which friction and gravity together accelerate it along `e` alone:

    e x (g sin(slope) d - mu g cos(slope) M e/|e|_M) = 0,   d the fall line

It starts to slide where `tan(slope) = mu/sqrt(d' M^-1 d)`, in the direction `M^-1 d`; the steeper the incline, the
smaller the drift. The script compares a simulation with bristles with this closed form. Run it:

    python examples/grooved_incline.py --out out/
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

import planarfriction as pf
from planarfriction.plots.style import (
    DISTRIBUTED,
    PAGE,
    REDUCED,
    REFERENCE,
    new_figure,
    paper,
    tidy,
)

G = 9.81  # [m/s^2]
ANGLE, ALONG, ACROSS = (
    np.radians(-50.0),
    0.6,
    1.0,
)  # grooves from the x axis; coefficients relative to MU
MU, MASS, WIDTH, HEIGHT = 0.5, 0.4, 0.06, 0.04  # [-], [kg], [m], [m]
LAW = pf.LuGre(
    mu_c=MU, mu_s=MU, sigma_0=1e5, sigma_1=200.0, sigma_2=0.0, elasto_plastic=0.9
)
METRIC = pf.friction_metric(ANGLE, ALONG, ACROSS)
DOWN = np.array([0.0, -1.0])  # the fall line in the plane


def steepest_at_rest() -> float:
    """Slope [rad] above which the block slides."""
    return float(np.arctan(MU / np.sqrt(DOWN @ np.linalg.solve(METRIC, DOWN))))


def drift(slope: float) -> float:
    """Angle [rad] from the fall line to the direction in which a block that starts from rest slides, in closed form."""

    def turning(angle: float) -> float:
        e = np.array([np.sin(angle), -np.cos(angle)])
        pull = np.sin(slope) * DOWN - MU * np.cos(slope) * METRIC @ e / np.sqrt(
            e @ METRIC @ e
        )
        return float(e[0] * pull[1] - e[1] * pull[0])

    first = np.linalg.solve(METRIC, DOWN)
    return brentq(turning, 0.0, 1.2 * np.arctan2(first[0], -first[1]), xtol=1e-14)  # pyright: ignore


def slide(slope: float, kind: str = "distributed", t_end: float = 0.55) -> pf.Solution:
    """Simulate the block from rest on an incline of `slope` [rad]; the plane of motion is the incline."""
    patch = pf.ContactPatch.rectangle(WIDTH, HEIGHT, 15).with_friction_metric(METRIC)
    model = {"distributed": pf.DistributedModel, "reduced": pf.ReducedModel}[kind](
        patch, LAW
    )
    half = 0.5 * np.array([WIDTH, HEIGHT])
    outline = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * half
    inertia = MASS / 12.0 * (WIDTH**2 + HEIGHT**2)
    body = pf.Body(MASS, inertia, gravity=(0.0, -G * np.sin(slope)), outline=outline)
    sole = pf.Contact(model, MASS * G * np.cos(slope), mounted_on="body", name="sole")
    return pf.simulate(
        pf.Scene(body, [sole], t_end, name="grooved incline"), rtol=1e-7, atol=1e-5
    )


def drift_of(solution: pf.Solution) -> float:
    """Angle [rad] between the fall line and the simulated displacement."""
    return float(np.arctan2(solution.data.x[-1], -solution.data.y[-1]))


def draw(
    slopes: np.ndarray, found: dict[str, list[float]], path: pf.Solution, slope: float
):
    figure = new_figure(PAGE, 3.1)
    axes = figure.subplots(1, 2, width_ratios=[1.1, 1.25])
    x, y = 1e3 * path.data.x.values, 1e3 * path.data.y.values
    outline = 1e3 * np.vstack([path.scene.body.outline, path.scene.body.outline[:1]])
    along = np.array([np.cos(ANGLE), np.sin(ANGLE)])
    across = np.array([-along[1], along[0]])
    for at in (0, len(x) * 7 // 10, len(x) - 1):
        axes[0].plot(
            x[at] + outline[:, 0],
            y[at] + outline[:, 1],
            color="0.2",
            linewidth=1.0,
        )
        for offset in np.arange(-30.0, 31.0, 7.5):
            ends = _inside(offset * across, along, 500.0 * WIDTH, 500.0 * HEIGHT)
            if ends is not None:
                axes[0].plot(
                    x[at] + ends[:, 0],
                    y[at] + ends[:, 1],
                    color="0.2",
                    linewidth=0.5,
                    alpha=0.5,
                )
    axes[0].plot(x, y, color=DISTRIBUTED, label="centre of the block")
    far = 1.15 * np.hypot(x[-1], y[-1])
    axes[0].plot([0.0, 0.0], [0.0, -far], color="0.2", linestyle=":", label="fall line")
    angle = drift(slope)
    axes[0].plot(
        [0.0, far * np.sin(angle)],
        [0.0, -far * np.cos(angle)],
        "--",
        color=REFERENCE,
        label="closed form",
        zorder=3,
    )
    axes[0].set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", xlim=(-40.0, 130.0))
    axes[0].set_ylim(top=85.0)
    axes[0].set_title(f"slope {np.degrees(slope):.0f}°, {path.data.time[-1]:.2f} s")
    axes[0].legend(loc="upper right", frameon=False)
    fine = np.linspace(steepest_at_rest() + 1e-6, np.radians(62.0), 200)
    axes[1].plot(
        np.degrees(fine),
        np.degrees([drift(s) for s in fine]),
        color=REFERENCE,
        label="closed form",
    )
    for (kind, values), mark, colour in zip(
        found.items(), "ox", (DISTRIBUTED, REDUCED), strict=True
    ):
        axes[1].plot(
            np.degrees(slopes),
            np.degrees(values),
            mark,
            color=colour,
            label=kind,
            fillstyle="none",
        )
    axes[1].axvspan(
        10.0, np.degrees(steepest_at_rest()), color="0.9", label="stays at rest"
    )
    axes[1].set(
        xlabel="slope [°]",
        ylabel="drift from the fall line [°]",
        xlim=(10.0, 62.0),
        ylim=(0.0, None),
    )
    axes[1].legend(frameon=False)
    for ax in axes:
        tidy(ax)
    return figure


def _inside(
    point: np.ndarray, along: np.ndarray, half_width: float, half_height: float
) -> np.ndarray | None:
    """Ends `[2, 2]` of the part of a line inside a rectangle about the origin, or None."""
    low, high = -np.inf, np.inf
    for p, d, half in zip(point, along, (half_width, half_height), strict=True):
        a, b = sorted(((-half - p) / d, (half - p) / d))
        low, high = max(low, a), min(high, b)
    return (
        None if low >= high else np.stack([point + low * along, point + high * along])
    )


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        description="A block with a grooved sole drifts sideways down an incline."
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out"), help="folder of the picture"
    )
    options = parser.parse_args(arguments)
    slopes = np.radians([22.0, 25.0, 30.0, 35.0, 40.0, 50.0, 60.0])
    print(f"the block slides on slopes above {np.degrees(steepest_at_rest()):.2f} deg")
    found: dict[str, list[float]] = {"distributed": [], "reduced": []}
    for slope in slopes:
        for kind, drifts in found.items():
            drifts.append(drift_of(slide(slope, kind)))
        shown = ", ".join(
            f"{kind} {np.degrees(drifts[-1]):.3f}" for kind, drifts in found.items()
        )
        print(
            f"slope {np.degrees(slope):.0f} deg: drift {np.degrees(drift(slope)):.3f} deg in closed form, {shown}"
        )
    options.out.mkdir(parents=True, exist_ok=True)
    path, slope = options.out / "grooved_incline.png", np.radians(25.0)
    with paper():
        draw(slopes, found, slide(slope), slope).savefig(path, dpi=160)
    print(path)


if __name__ == "__main__":
    main()
