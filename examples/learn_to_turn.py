"""A gripper learns to turn a plate between its fingers by a given angle: it lets the plate slip, and grips in time.

64 worlds step side by side as a vector environment of Gymnasium. Each has friction of its own, which the policy does
not know. Every 20 ms it chooses the force of the fingers from the angle that is left, the speed of the plate, and the
last force:

    force = w_0 + w_1 angle left + w_2 speed + w_3 last force

A random search (the cross-entropy method) finds the four numbers: with patches, and with MuJoCo's own friction, where
the pads touch in their four corners. Every policy is then tried on the patches. Run it; it takes about a minute:

    python examples/learn_to_turn.py --out out/
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import io
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, ClassVar

import gymnasium
import mujoco
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg

import planarfriction as pf
from planarfriction.adapters.mujoco import Friction, PatchContact, prepare
from planarfriction.plots.film_files import write_frames
from planarfriction.plots.style import REDUCED, new_figure

WORLDS, CANDIDATES, ELITE, ROUNDS = (
    64,
    16,
    4,
    12,
)  # each candidate is tried in several worlds
START, SPREAD = (
    (3.0, -1.0, 0.0, 0.0),
    (1.5, 3.0, 1.0, 0.5),
)  # policy where the search begins, and its first width
DT, HELD, STEPS = (
    0.002,
    10,
    75,
)  # time step [s], steps for which a force is held, decisions of an episode
LIGHT, FIRM, DROPPED = (
    0.5,
    6.0,
    0.02,
)  # forces of each finger [N]; how far a plate that is held may slide down [m]
SHOWN = 3, 4  # rows and columns of plates in the film
RADIUS, MASS, ARM = (
    0.012,
    0.1,
    0.04,
)  # pads [m], plate [kg], from the pads to its centre of mass [m]
SIDE = RADIUS / np.sqrt(
    2.0
)  # half the width of boxes with their corners on the rim [m]
LAW = pf.LuGre(
    mu_c=1.0, mu_s=1.0, sigma_0=1e5, sigma_1=300.0, sigma_2=10.0, elasto_plastic=0.9
)
FRICTION = {
    "mu_c": (0.8, 1.2),
    "scale": (0.9, 1.1),
}  # of each world: coefficient, and size of the pads
TARGETS = 20.0, 45.0  # angles to turn by [degrees]
POINTS = {
    "patches": None,
    "points at the rim": 1.0,
    "points at the lever arm of a disc": 2.0 / 3.0,
}

SIDES = "near", "far"
FINGERS = "".join(
    f"""<body pos="{sign * 0.007} 0 0"><joint name="{side}" type="slide" axis="{-sign} 0 0" damping="20"/>
    <geom name="{side}" type="box" size="0.005 {SIDE} {SIDE}" mass="0.05"/>
    <site name="{side}" pos="{-sign * 0.005} 0 0" zaxis="{sign} 0 0"/></body>"""
    for side, sign in zip(SIDES, (1, -1), strict=True)
)
HAND = f"""<mujoco><option timestep="{DT}" integrator="implicitfast" cone="elliptic" impratio="10"/>
<default><geom solref="0.004 1" solimp="0.99 0.99 0.001" contype="0"/></default>
<worldbody>{FINGERS}<body name="plate"><freejoint/>
<geom name="plate" type="box" size="0.002 0.055 0.02" pos="0 {ARM} 0" mass="{MASS}"/></body></worldbody>
<actuator><motor joint="near"/><motor joint="far"/></actuator></mujoco>"""


class TurnInHand(gymnasium.vector.VectorEnv):
    """Worlds in which two fingers turn a plate, with patches or, at the distance `points`, with MuJoCo's own friction.

    Actions are forces [N] of the fingers. Observations are the angle that is left [rad], the speed [rad/s] and the
    force [N]. The last decision is rewarded with minus the angle that is left, less 1 for a plate that was dropped.
    """

    metadata: ClassVar[dict[str, Any]] = {
        "autoreset_mode": gymnasium.vector.AutoresetMode.DISABLED
    }

    def __init__(
        self, worlds: int = WORLDS, *, points: float | None = None, threads: int = 2
    ) -> None:
        low, high = (
            np.array([-np.inf, -np.inf, LIGHT], np.float32),
            np.array([np.inf, np.inf, FIRM], np.float32),
        )
        self.num_envs, self.points = worlds, points
        self.single_action_space = gymnasium.spaces.Box(LIGHT, FIRM, (1,))
        self.single_observation_space = gymnasium.spaces.Box(low, high)
        self.action_space = gymnasium.vector.utils.batch_space(
            self.single_action_space, worlds
        )
        self.observation_space = gymnasium.vector.utils.batch_space(
            self.single_observation_space, worlds
        )
        pad = pf.ReducedModel(pf.ContactPatch.disc(radius=RADIUS, cells=21), LAW)
        patches = [
            PatchContact(pad, site=side, geoms=(side, "plate")) for side in SIDES
        ]
        spec = mujoco.MjSpec.from_string(HAND)
        prepare(spec, patches)
        m = spec.compile()
        self._open = contextlib.ExitStack()
        if points is None:
            self.friction = Friction(m, patches)
            self.models = self.friction.copies({"mu_c": np.ones(worlds)})
            self._open.enter_context(self.friction.install())
        else:
            self.models = [copy.copy(m) for _ in range(worlds)]
        self.data = [mujoco.MjData(m) for m in self.models]
        self.targets, self.decisions = np.zeros(worlds), 0
        self._threads = self._open.enter_context(ThreadPoolExecutor(threads))

    def close_extras(self, **_: Any) -> None:
        """Take the friction out of MuJoCo."""
        self._open.close()

    def reset(
        self, *, seed: int | None = None, options: Any = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Hold the plates firmly, with new friction and new angles to turn by."""
        super().reset(seed=seed)
        drawn = pf.randomise(
            LAW, FRICTION, self.num_envs, seed=int(self.np_random.integers(2**31))
        )
        self.targets = np.radians(self.np_random.uniform(*TARGETS, self.num_envs))
        for e, (m, d) in enumerate(zip(self.models, self.data, strict=True)):
            if self.points is None:
                for name, values in drawn.items():
                    self.friction.parameters(m)[name][:] = values[e]
            else:
                m.pair_dim[:], m.pair_friction[:, :2] = 3, drawn["mu_c"][e]
                m.geom_size[:2, 1:] = drawn["scale"][e] * SIDE * self.points
            mujoco.mj_resetData(m, d)
            d.ctrl[:], m.opt.gravity[:] = FIRM, 0.0
            mujoco.mj_step(m, d, 50)
            m.opt.gravity[2] = -9.81
        self.decisions = 0
        return self._seen(), {}

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Hold the forces `[worlds, 1]` for 20 ms."""

        def one(e: int) -> None:
            self.data[e].ctrl[:] = np.clip(actions[e, 0], LIGHT, FIRM)
            mujoco.mj_step(self.models[e], self.data[e], HELD)

        list(self._threads.map(one, range(self.num_envs)))
        self.decisions += 1
        ended, (angle, _, descent) = self.decisions >= STEPS, self.plates()
        lost = abs(self.targets - angle) + (descent > DROPPED)
        reward = -lost if ended else np.zeros(self.num_envs)
        return (
            self._seen(),
            reward,
            np.zeros(self.num_envs, bool),
            np.full(self.num_envs, ended),
            {},
        )

    def plates(self) -> np.ndarray:
        """Return angle [rad], speed [rad/s] and descent [m] of each plate, `[3, worlds]`."""
        return np.array(
            [
                (2.0 * np.arctan2(-d.qpos[6], d.qpos[5]), -d.qvel[5], -d.qpos[4])
                for d in self.data
            ]
        ).T

    def _seen(self) -> np.ndarray:
        angle, speed, _ = self.plates()
        return np.stack(
            [self.targets - angle, speed, [d.ctrl[0] for d in self.data]], axis=1
        ).astype(np.float32)


def episode(
    worlds: TurnInHand, policies: np.ndarray, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Run an episode with a policy `[4]` in each world; return rewards, and observations `[STEPS + 1, worlds, 3]`."""
    seen, _ = worlds.reset(seed=seed)
    history, reward = [seen], np.zeros(len(seen))
    for _ in range(STEPS):
        seen, reward, *_ = worlds.step(
            policies[:, :1] + (policies[:, 1:] * seen).sum(axis=1, keepdims=True)
        )
        history.append(seen)
    return reward, np.array(history)


def learn(worlds: TurnInHand, rounds: int = ROUNDS) -> tuple[np.ndarray, list[float]]:
    """Search around the best candidates of each round; return the policy, and the mean reward of each round."""
    generator, rewards = np.random.default_rng(0), []
    mean, spread = np.array(START), np.array(SPREAD)
    for k in range(rounds):
        drawn = mean + spread * generator.standard_normal((CANDIDATES, len(mean)))
        reward, _ = episode(
            worlds, np.repeat(drawn, worlds.num_envs // CANDIDATES, axis=0), seed=k
        )
        each = reward.reshape(CANDIDATES, -1).mean(axis=1)
        best = drawn[np.argsort(each)[-ELITE:]]
        mean, spread = best.mean(axis=0), 0.5 * (spread + best.std(axis=0))
        rewards.append(float(each.mean()))
    return mean, rewards


def draw(
    rewards: dict[str, list[float]], history: np.ndarray, missed: dict[str, np.ndarray]
) -> Any:
    """Draw the search, the angles that the policy for patches leaves, and how far each policy misses on patches."""
    figure = new_figure(9.0, 2.8)
    search, left, misses = figure.subplots(1, 3)
    for name, each in rewards.items():
        search.plot(np.arange(1, len(each) + 1), -np.degrees(each), label=name)
    search.set(
        xlabel="round", ylabel="mean loss (degrees)", title="Learning", ylim=(0.0, None)
    )
    left.plot(
        np.arange(STEPS + 1) * HELD * DT,
        np.degrees(history[:, :, 0]),
        color=REDUCED,
        linewidth=0.5,
    )
    left.set(
        xlabel="time (s)", ylabel="angle left (degrees)", title="Learned with patches"
    )
    for k, each in enumerate(missed.values()):
        misses.plot(np.sort(each), np.linspace(0.0, 100.0, len(each)), color=f"C{k}")
    misses.set(
        xlabel="missed by (degrees)", ylabel="worlds (%)", title="Tried on patches"
    )
    figure.legend(
        *search.get_legend_handles_labels(), loc="outside lower center", ncols=3
    )
    return figure


def film(angles: np.ndarray, targets: np.ndarray, path: Path) -> None:
    """Write an animation of the first plates at `angles` `[T, worlds]` [rad] at half speed, with the angles wanted."""
    figure = new_figure(7.0, 4.9)
    axes = figure.subplots()
    rows, columns = SHOWN
    axes.set(xlim=(-0.3, columns), ylim=(-0.85, rows - 0.7), aspect="equal")
    axes.axis("off")
    y, x = np.divmod(np.arange(rows * columns), columns)
    look = {"solid_capstyle": "butt", "alpha": 0.6, "color": REDUCED, "linewidth": 16.0}
    plates = [axes.plot([], [], **look)[0] for _ in x]
    for e in range(len(x)):
        goal = _line(x[e], y[e], targets[e], 0.0, 0.85)
        axes.plot(*goal, "--", color="black", linewidth=1.8, zorder=3)
    pads = axes.plot(x, y, "o", color="0.45", markersize=11.0, zorder=4)[0]
    shown = {"plate": plates[0], "angle wanted": axes.lines[len(x)], "fingers": pads}
    figure.legend(
        shown.values(),
        shown.keys(),
        loc="outside lower center",
        ncols=3,
        fontsize=14,
        frameon=False,
        handlelength=2.5,
    )
    canvas, file = FigureCanvasAgg(figure), io.BytesIO()
    error = np.degrees(abs(angles - targets)).mean(axis=1)

    def frame(k: int) -> np.ndarray:
        for e, plate in enumerate(plates):
            plate.set_data(*_line(x[e], y[e], angles[k, e]))
        words = f"{k * HELD * DT:.2f} s: mean error {error[k]:.0f}°"
        axes.set_title(f"{words} in {len(targets)} worlds", fontsize=16)
        canvas.draw()
        return np.array(canvas.buffer_rgba())[:, :, :3]

    write_frames(path, file, frame, len(angles), fps=25.0)
    path.write_bytes(file.getvalue())


def _line(
    x: float, y: float, angle: float, begin: float = -0.14, end: float = 0.75
) -> np.ndarray:
    """Return the ends of a line that has turned downwards about a point, `[2, 2]`."""
    reach = np.array([begin, end])
    return np.array([x + reach * np.cos(angle), y - reach * np.sin(angle)])


def main(arguments: Sequence[str] | None = None) -> None:
    """Learn, try what was learned on patches, print the results, and draw."""
    parser = argparse.ArgumentParser(
        description="A gripper learns to turn a plate by letting it slip."
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("out"),
        help="folder for the picture and the film",
    )
    parser.add_argument(
        "--rounds", type=int, default=ROUNDS, help="rounds of the search"
    )
    parser.add_argument(
        "--worlds", type=int, default=WORLDS, help="number of worlds, a multiple of 16"
    )
    given = parser.parse_args(arguments)
    policies, rewards, histories, missed = {}, {}, {}, {}
    for name, points in POINTS.items():
        with contextlib.closing(TurnInHand(given.worlds, points=points)) as worlds:
            policies[name], rewards[name] = learn(worlds, given.rounds)
            print(
                f"learned with {name}: mean loss {-np.degrees(rewards[name][-1]):.1f} degrees in the last round"
            )
    with contextlib.closing(TurnInHand(given.worlds)) as worlds:
        for name, policy in policies.items():
            _, histories[name] = episode(
                worlds, np.tile(policy, (given.worlds, 1)), seed=1000
            )
            missed[name] = np.degrees(abs(histories[name][-1, :, 0]))
            within = f"{np.sum(missed[name] < 3.0)} of {given.worlds} within 3 degrees"
            print(
                f"on patches, learned with {name}: missed by {np.median(missed[name]):.1f} degrees (median), {within}"
            )
    given.out.mkdir(parents=True, exist_ok=True)
    draw(rewards, histories["patches"], missed).savefig(given.out / "learn-to-turn.png")
    left = histories["patches"][:, :, 0]
    film(worlds.targets - left, worlds.targets, given.out / "learn-to-turn.gif")
    print(f"wrote learn-to-turn.png and learn-to-turn.gif into {given.out}")


if __name__ == "__main__":
    main()
