"""A gripper in MuJoCo loosens its grip until a plate swings down between its fingers, grips again, and turns the plate.

Two soft pads hold the plate off its centre of mass. As the grip loosens, the pads reach the limit of the force and
torque that they can transmit together, which is given by the limit surface of their patch. The plate turns, and slides
down a little, until the horizontal distance of its centre of mass from the pads is small enough. With the weight m g
and two pads of radius R, each pressed with N, this distance is

    l = 2 mu N R t(f) / (m g),   f = m g / (2 mu N)

where `t(f)` is the torque that a disc can transmit in addition to the force f (relative to `mu N R` and to `mu N`).
MuJoCo's own contacts have separate limits for force and torque, and the objects they hold creep. Run it:

    python examples/mujoco_gripper.py --out out/

The picture needs OpenGL; without a screen set MUJOCO_GL=egl or MUJOCO_GL=osmesa.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import mujoco
import numpy as np
from matplotlib.lines import Line2D

import planarfriction as pf
from planarfriction.adapters.mujoco import Friction, PatchContact, prepare
from planarfriction.adapters.mujoco.draw import CENTRE, FRICTION, OUTLINE
from planarfriction.plots.style import new_figure

MU, RADIUS, MASS, ARM = (
    1.0,
    0.012,
    0.1,
    0.04,
)  # [-], pads [m], plate [kg], from the pads to its centre of mass [m]
SIDE = (
    RADIUS / np.sqrt(2.0)
)  # half the width of boxes with their corners on the rim [m]: boxes meet in several points
FIRM, LOOSE = 6.0, 1.4  # forces of each finger [N]
GRIPS = (
    (0.3, FIRM),
    (0.5, 2.6),
    (2.3, LOOSE),
    (2.7, LOOSE),
    (2.8, FIRM),
)  # at times [s], and between them in proportion
TURNS, END = 2.9, 4.2  # the hand turns; all is over [s]
SHOWN = 0.2, 1.6, 2.6, 4.2  # times of the pictures [s]

FINGERS = "".join(
    f"""<body pos="{sign * 0.007} 0 0"><joint name="{side}" type="slide" axis="{-sign} 0 0" damping="20"/>
    <geom name="{side}" type="box" size="0.005 {SIDE} {SIDE}" mass="0.05" rgba=".3 .35 .4 .2"/>
    <site name="{side}" pos="{-sign * 0.005} 0 0" zaxis="{sign} 0 0" size="1e-4"/></body>"""
    for side, sign in (("near", 1), ("far", -1))
)
HAND = f"""<mujoco><option timestep="0.002" integrator="implicitfast"/>
<default><geom solref="0.004 1" solimp="0.99 0.99 0.001"/></default>
<visual><headlight ambient=".5 .5 .5" diffuse=".3 .3 .3" specular="0 0 0"/><map force="0.035" znear="0.01"/></visual>
<asset><texture name="sky" type="skybox" builtin="flat" rgb1="1 1 1" width="8" height="8"/></asset>
<worldbody>
  <body name="hand"><joint name="turn" axis="1 0 0" damping="1"/>
    <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>{FINGERS}</body>
  <body name="plate"><freejoint/>
    <geom name="plate" type="box" size="0.002 0.055 0.02" pos="0 {ARM} 0" mass="{MASS}" rgba=".8 .75 .65 1"/></body>
</worldbody>
<actuator><motor joint="near"/><motor joint="far"/><position joint="turn" kp="200" dampratio="1"/></actuator>
</mujoco>"""


def controls(t: float) -> tuple[float, float, float]:
    """Controls at time t: forces of the two fingers [N] and the angle of the hand [rad]."""
    force = float(np.interp(t, *np.transpose(GRIPS)))
    s = np.clip((t - TURNS) / 0.8, 0.0, 1.0)
    return force, force, 1.2 * float(s * s * (3.0 - 2.0 * s))


def soft_pad() -> pf.ReducedModel:
    """Build the friction of a pad."""
    law = pf.LuGre(
        mu_c=MU, mu_s=MU, sigma_0=1e5, sigma_1=300.0, sigma_2=10.0, elasto_plastic=0.9
    )
    return pf.ReducedModel(pf.ContactPatch.disc(radius=RADIUS, cells=21), law)


def hand(
    pad: pf.models.FrictionModel,
) -> tuple[mujoco.MjModel, mujoco.MjData, Friction]:
    """Build the model, its data, and the friction of its pads."""
    patches = [
        PatchContact(pad, site=side, geoms=(side, "plate")) for side in ("near", "far")
    ]
    spec = mujoco.MjSpec.from_string(HAND)
    spec.geom("near").contype = spec.geom("far").contype = (
        0  # they touch the plate through its pairs alone
    )
    prepare(spec, patches)
    m = spec.compile()
    return m, mujoco.MjData(m), Friction(m, patches)


def reach() -> float:
    """Horizontal distance [m] of the centre of mass from the pads while the grip is loose, in theory."""
    spins = np.geomspace(1e-2, 1e5, 4001)  # of a disc that moves with 1 m/s
    twists = np.stack([np.zeros_like(spins), np.ones_like(spins), spins], axis=1)
    wrench = abs(
        pf.LimitSurfaceExact(pf.ContactPatch.disc(radius=RADIUS)).wrench(twists)
    )
    share = MASS * 9.81 / (2.0 * MU * LOOSE)
    return float(np.interp(share, wrench[::-1, 1], wrench[::-1, 2])) / share


def run(draw: bool = True) -> tuple[np.ndarray, list[np.ndarray]]:
    """Simulate; returns rows `[steps, 4]` of time, angle in the hand, and offset of the plate's centre, and pictures.

    The offset of the centre of mass is measured to the side of the pads and downwards.
    """
    m, d, friction = hand(soft_pad())
    renderer = mujoco.Renderer(m, 400, 440) if draw else None
    camera = mujoco.MjvCamera()
    camera.lookat[:], camera.distance, camera.azimuth, camera.elevation = (
        (0.0, 0.034, -0.02),
        0.17,
        187.0,
        -8.0,
    )
    gravity, m.opt.gravity[:] = m.opt.gravity.copy(), 0.0
    rows, pictures = [], []
    for k in range(-100, round(END / m.opt.timestep)):
        t = k * m.opt.timestep
        if k == 0:  # the fingers hold it now
            m.opt.gravity[:] = gravity
        d.ctrl[:] = controls(t)
        friction.step(d)
        turned, plate = d.body("hand").xmat.reshape(3, 3), d.body("plate")
        held, at = turned.T @ plate.xmat.reshape(3, 3), turned.T @ plate.xipos
        rows.append([t, -np.arctan2(held[2, 1], held[1, 1]), at[1], -at[2]])
        if renderer is not None and any(
            abs(t - shown + m.opt.timestep) < 1e-9 for shown in SHOWN
        ):
            renderer.update_scene(d, camera)
            first = renderer.scene.ngeom
            friction.draw(renderer.scene, d)
            for geom in renderer.scene.geoms[first : renderer.scene.ngeom]:
                if (
                    geom.type == mujoco.mjtGeom.mjGEOM_ARROW
                ):  # on the pads; on the plate it is opposite
                    geom.mat[:] = geom.mat @ np.diag([1.0, -1.0, -1.0])
            pictures.append(renderer.render())
    return np.array(rows), pictures


def main() -> None:
    """Simulate, print the results, and draw."""
    parser = argparse.ArgumentParser(
        description="A plate that swings in a gripper, in MuJoCo."
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out"), help="folder for the picture"
    )
    folder = parser.parse_args().out
    rows, pictures = run()
    time, angle, beside, below = rows.T
    loose, last = np.searchsorted(time, GRIPS[3][0]) - 1, time > END - 0.2
    print(
        f"loose grip: the plate has turned by {np.degrees(angle[loose]):.1f} degrees, with its centre of mass"
        f" {1e3 * beside[loose]:.1f} mm to the side of the pads (theory: {1e3 * reach():.1f} mm)"
    )
    turned = np.degrees(np.ptp(angle[time > TURNS]))
    print(
        f"firm grip: it turns by {turned:.3f} degrees relative to the hand while the hand turns by 69 degrees"
    )
    creep = np.hypot(np.ptp(beside[last]), np.ptp(below[last])) / 0.2
    print(f"at rest: it creeps at {1e6 * creep:.4f} um/s")
    folder.mkdir(parents=True, exist_ok=True)
    figure = new_figure(9.0, 3.1)
    for axes, shown, picture in zip(
        figure.subplots(1, len(SHOWN)), SHOWN, pictures, strict=True
    ):
        axes.imshow(picture)
        axes.set_title(
            f"{shown} s, grip {controls(shown)[0]:.1f} N", fontsize="x-large"
        )
        axes.axis("off")
    marks = {"patch of a pad": ("o", OUTLINE, "none"), "friction on the plate": ("^", FRICTION, "full"),
             "centre of rotation": (".", CENTRE, "full")}  # fmt: skip
    handles = [
        Line2D(
            [],
            [],
            linestyle="",
            marker=marker,
            color=colour,
            fillstyle=fill,
            markersize=11,
            label=name,
        )
        for name, (marker, colour, fill) in marks.items()
    ]
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=3,
        frameon=False,
        fontsize="x-large",
    )
    figure.savefig(folder / "mujoco-gripper.png")
    print(f"wrote {folder / 'mujoco-gripper.png'}")


if __name__ == "__main__":
    main()
