"""Make the pictures of the page on joints: `python docs/make_joint.py [FOLDER]`, by default in `docs/images`.

`joint-torque.png` is the fit of the page's first example, `joint.png` that of the servo's logs. `joint-holds.png` is a
joint that should hold at half its Coulomb level, under a load that swings at 5 Hz: MuJoCo's `frictionloss` and the
bristles of its dcmotor, and elasto-plastic bristles. Angles are taken once in each swing, so that what bends back does
not count.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import mujoco
import numpy as np
from make_moving import check_size

import planarfriction as pf
from planarfriction.joints import (
    JointFit,
    JointFriction,
    JointLog,
    Plant,
    identify_joint,
)
from planarfriction.plots import style

INERTIA, COULOMB, LOAD, SWING, FREQUENCY = 0.01, 0.8, 0.4, 0.1, 5.0
"""kg m^2, N m, and the load and its swing [N m], [Hz]."""

DT, RAMP, T_END = 1e-3, 1.0, 10.0
"""Step of all three, time in which the load comes, and duration [s]."""

LUGRE = "400 2 0.8 1.2 0.05"
"""Stiffness, damping, Coulomb and static friction, and Stribeck speed of the dcmotor's bristles."""

MODEL = """<mujoco><option timestep="{dt}" gravity="0 0 0" integrator="implicitfast"/><worldbody><body>
<inertial pos="0 0 0" mass="1" diaginertia="{inertia} {inertia} {inertia}"/><joint name="j" axis="0 0 1" {joint}/>
</body></worldbody><actuator>{motor}<motor name="load" joint="j"/></actuator></mujoco>"""

WAYS = {
    "MuJoCo, frictionloss": (f'frictionloss="{COULOMB}"', ""),
    "MuJoCo, dcmotor lugre": (
        "",
        f'<dcmotor joint="j" motorconst="1" resistance="1e9" lugre="{LUGRE}"/>',
    ),
}
"""Attributes of the joint, and its motor."""

OURS = "elasto-plastic bristles"

TOP = 60.0
"""Largest angle that is drawn [mrad]."""


def load(t: float) -> float:
    """Return the torque [N m] on the joint."""
    return min(t / RAMP, 1.0) * LOAD + SWING * math.sin(2.0 * math.pi * FREQUENCY * t)


def in_mujoco(joint: str, motor: str) -> np.ndarray:
    """Return the angle [rad] after each step in MuJoCo."""
    model = mujoco.MjModel.from_xml_string(
        MODEL.format(dt=DT, inertia=INERTIA, joint=joint, motor=motor)
    )
    data = mujoco.MjData(model)
    angle = np.empty(round(T_END / DT))
    for i in range(len(angle)):
        data.ctrl[-1] = load(data.time)
        mujoco.mj_step(model, data)
        angle[i] = data.qpos[0]
    return angle


def elasto_plastic() -> np.ndarray:
    """Return the angle [rad] after each step of one elasto-plastic bristle in N m and rad, under the load 1."""
    stiffness, damping, mu_c, mu_s, v_s = map(float, LUGRE.split())
    law = pf.LuGre(mu_c, mu_s, v_s, stiffness, damping, 0.0, elasto_plastic=0.9)
    body = pf.SlidingBody(
        INERTIA, 1.0, pf.DistributedModel(pf.ContactPatch.points([[0.0, 0.0]]), law)
    )
    state = body.rest()
    twist = np.zeros(3)
    angle = np.zeros(round(T_END / DT) + 1)
    for i in range(len(angle) - 1):
        state, twist, _ = body.step(state, twist, 1.0, DT, (load(i * DT), 0.0, 0.0))
        angle[i + 1] = angle[i] + DT * twist[0]
    return angle[1:]


def holds() -> style.PlotFigure:
    """Draw the three angles over time, and print their rates."""
    runs = {name: in_mujoco(*way) for name, way in WAYS.items()} | {
        OURS: elasto_plastic()
    }
    each = round(1.0 / (FREQUENCY * DT))
    figure = style.new_figure(5.5, 3.0)
    axes = figure.subplots()
    colours = dict(
        zip(runs, (style.BUILT_IN, style.BUILT_IN, style.REDUCED), strict=True)
    )
    for (name, run), line in zip(runs.items(), ("-", "--", "-"), strict=True):
        swings = run[each - 1 :: each]
        rate = (swings[-1] - swings[len(swings) // 2]) / (T_END / 2.0)
        words = (
            f"{1e3 * rate:.1f} mrad/s"
            if rate > 1e-5
            else f"below {1e6 * max(abs(rate), 1e-6):.0f} µrad/s"
        )
        print(f"{name}: {rate:.3g} rad/s")
        time = DT * each * np.arange(1, len(swings) + 1)
        axes.plot(time, 1e3 * swings, ls=line, color=colours[name], lw=1.8)
        # Beside the curve, where it leaves the picture or ends.
        last = int(np.argmax(1e3 * swings > TOP)) or len(swings) - 1
        at = (time[last], min(1e3 * swings[last], TOP))
        leaves = 1e3 * swings[last] > TOP
        place = {"xytext": (8, -8) if leaves else (0, 5), "textcoords": "offset points"}
        place |= {
            "ha": "left" if leaves else "right",
            "va": "top" if leaves else "bottom",
        }
        axes.annotate(f"{name}: {words}", at, color=colours[name], **place)
    axes.set(xlim=(0.0, T_END), ylim=(-3.0, TOP))
    axes.set(xlabel="time [s]", ylabel="angle [mrad]")
    style.tidy(axes)
    return figure


def from_torque() -> JointFit:
    """Return the fit of a noisy torque with six numbers of LuGre, the example of the page."""
    t = 1e-3 * np.arange(12_000)
    fast = np.clip((t - 8.0) / 2.0, 0.0, 1.0)
    q = (
        0.08 * np.sin(1.57 * t)
        + 0.006 * np.sin(14.5 * t)
        + 0.8 * fast * np.sin(3.14 * t)
    )
    true = JointFriction(
        mu_c=0.8, mu_s=1.2, v_s=0.05, sigma_0=400.0, sigma_1=2.0, sigma_2=0.3
    )
    speed = np.gradient(q, t)
    torque = 0.05 * np.gradient(speed, t) + true.along(t, speed)
    torque += np.random.default_rng(0).normal(0.0, 0.01, len(t))
    return identify_joint(
        JointLog(t, q, torque=torque, name="ripples"), Plant(inertia=0.05)
    )


def main(folder: Path) -> None:
    """Write the pictures and say how large they are."""
    from planarfriction_studies.measured.joints import fit_joints

    folder.mkdir(parents=True, exist_ok=True)
    fits = {"joint-torque": from_torque(), "joint": fit_joints(progress=print)}
    with style.paper():
        figures = {name: fit.plot() for name, fit in fits.items()}
        figures["joint-holds"] = holds()
    for name, figure in figures.items():
        figure.savefig(path := folder / f"{name}.png", dpi=160)
        check_size(path)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "images")
