"""A spring drags a block across a table, solved with diffrax: it sticks, slips, and turns until the spring is in line.

The bristles of the contact are part of the ODE: their rate is one line of its right-hand side. The spring is attached
off the middle of the block, and its far end moves at a constant speed:

    python examples/diffrax_contact.py --out out/

Needs planarfriction[jax,examples].
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

import planarfriction as pf
import planarfriction.jax as pj
from planarfriction.plots.style import SERIES, new_figure, tidy

MASS, SIDE, GRAVITY = 0.5, 0.06, 9.81  # of the block [kg, m], [m/s^2]
INERTIA = MASS * SIDE**2 / 6.0
LOAD = MASS * GRAVITY
STIFFNESS, SPEED = 150.0, 0.01  # of the spring [N/m], of its far end [m/s]
HOOK = jnp.array([0.5 * SIDE, 0.25 * SIDE])  # where the spring is fixed, block axes [m]
LAW = pf.LuGre(
    mu_c=0.3,
    mu_s=0.45,
    v_s=5e-3,
    sigma_0=1e5,
    sigma_1=300.0,
    sigma_2=0.4,
    elasto_plastic=0.9,
)
DEFLECTION = 1e-6
"""Unit [m] in which bristles are about as large as the other states: one tolerance suits all."""


class State(NamedTuple):
    """State of the block (table axes) and of the bristles (block axes)."""

    pose: jax.Array
    """x, y, theta [m, m, rad]"""
    twist: jax.Array
    """[m/s, m/s, rad/s]"""
    bristles: jax.Array
    """`[3, discs]`, in units of DEFLECTION."""


def turn(theta) -> jax.Array:
    """Rotation `[3, 3]` of a twist or a wrench from block axes to table axes."""
    c, s = jnp.cos(theta), jnp.sin(theta)
    return jnp.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def pull(time, pose) -> jax.Array:
    """Wrench of the spring on the block, `[3]` [N, N, N m]."""
    arm = turn(pose[2])[:2, :2] @ HOOK
    far_end = HOOK + jnp.array([SPEED * time, 0.0])
    force = STIFFNESS * (far_end - pose[:2] - arm)
    return jnp.array([force[0], force[1], arm[0] * force[1] - arm[1] * force[0]])


def slope(time, state: State, model: pj.ReducedModel) -> State:
    """Right-hand side: the block and its bristles."""
    to_table = turn(state.pose[2])
    twist, z = to_table.T @ state.twist, state.bristles * DEFLECTION
    friction = to_table @ pj.wrench(model, z, twist, LOAD)
    acceleration = (pull(time, state.pose) + friction) / jnp.array(
        [MASS, MASS, INERTIA]
    )
    return State(state.twist, acceleration, pj.rate(model, z, twist, LOAD) / DEFLECTION)


@jax.jit
def drag(model: pj.ReducedModel, times) -> State:
    """States at `times` [s], starting at rest with a relaxed spring."""
    rest = State(jnp.zeros(3), jnp.zeros(3), model.rest())
    return diffrax.diffeqsolve(
        diffrax.ODETerm(slope),
        diffrax.Kvaerno5(),
        t0=0.0,
        t1=times[-1],
        dt0=1e-5,
        y0=rest,
        args=model,
        saveat=diffrax.SaveAt(ts=times),
        stepsize_controller=diffrax.PIDController(rtol=1e-6, atol=1e-8, dtmax=0.02),
        max_steps=200_000,
    ).ys


def draw(times, states: State, forces: np.ndarray, file: Path) -> None:
    """Plot speed, spring force and yaw against time."""
    figure = new_figure(6.4, 5.4)
    rows = (
        ("block [mm/s]", 1e3 * states.twist[:, 0]),
        ("spring [N]", np.hypot(forces[:, 0], forces[:, 1])),
        ("yaw [deg]", np.degrees(states.pose[:, 2])),
    )
    for i, (label, values) in enumerate(rows):
        axes = figure.add_subplot(3, 1, i + 1)
        axes.plot(times, values, color=SERIES[i])
        axes.set_ylabel(label)
        axes.set_xlim(0.0, times[-1])
        tidy(axes)
        if i == 1:
            axes.axhline(LAW.mu_s * LOAD, color="0.4", linestyle=":", linewidth=1.0)
            axes.annotate(
                "breakaway, mu_s f_N",
                (0.02 * times[-1], LAW.mu_s * LOAD),
                va="bottom",
                color="0.4",
                fontsize=8,
            )
        if i < 2:
            axes.tick_params(labelbottom=False)
    axes.set_xlabel("time [s]")
    figure.suptitle("A block dragged by a spring sticks and slips")
    figure.savefig(file)


def run(duration: float = 8.0) -> tuple[np.ndarray, State, np.ndarray]:
    """Simulate; returns times `[T]`, states, and wrenches of the spring `[T, 3]`."""
    patch = pf.ContactPatch.rectangle(SIDE, cells=11)
    model = pj.ReducedModel(patch, LAW, cells=8)  # implicit stages of 27 states, not 78
    times = jnp.linspace(0.0, duration, round(400 * duration) + 1)
    states = drag(model, times)
    return np.asarray(times), states, np.asarray(jax.vmap(pull)(times, states.pose))


def main() -> None:
    """Simulate, print the largest force of the spring, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--out", type=Path, default=Path("out"), help="folder for the picture"
    )
    folder = parser.parse_args().out
    jax.config.update(
        "jax_enable_x64", True
    )  # deflections of 1e-6 m beside distances of 0.1 m
    times, states, forces = run()
    folder.mkdir(parents=True, exist_ok=True)
    draw(times, states, forces, folder / "diffrax_contact.png")
    largest = np.hypot(forces[:, 0], forces[:, 1]).max()
    print(
        f"largest force of the spring: {largest:.3f} N, {largest / (LAW.mu_s * LOAD):.1%} of mu_s f_N"
    )
    print(
        f"yaw at the end: {np.degrees(states.pose[-1, 2]):.1f} deg; picture: {folder / 'diffrax_contact.png'}"
    )


if __name__ == "__main__":
    main()
