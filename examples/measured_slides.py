"""Measured slides of a cube on a table, against five ways to compute friction.

The file holds motion capture of a cube that was tossed, landed flat, and slid and spun until it stopped (ContactNets:
Pfrommer, Halm, Posa, CoRL 2020). Each model gets one friction coefficient, fitted on half of the tosses, and predicts
the other half from nothing but the measured start:

    python examples/measured_slides.py contactnets_slides.csv.gz --out out/
"""

from __future__ import annotations

import argparse
import sys
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
import pandas as pd
from measured_slides_report import draw, rms, show, write_errors
from rich.console import Console
from rich.progress import Progress
from scipy.optimize import minimize_scalar

import planarfriction as pf
from planarfriction import validation
from planarfriction.errors import FileError
from planarfriction.scenes.ready import GRAVITY
from planarfriction.writing import check_writable

MASS, INERTIA, SIDE = 0.37, 8.10e-4, 0.1048  # of the cube [kg, kg m^2, m]
OUTLINE = 0.5 * SIDE * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])

# 11 x 11 cells: finer ones move no final yaw by more than 0.12 deg, and their RMS error by 0.02 deg.
SQUARE = pf.ContactPatch.rectangle(SIDE, cells=11, name="square")
CORNERS = pf.ContactPatch.points(OUTLINE, name="four corners")
RADIUS = float(SQUARE.contact_radius())  # 40 mm: the lever arm of friction in a pure spin

Predict = Callable[[float, "Toss"], np.ndarray]
"""Poses (x, y, yaw) `[T, 3]` at the measured times of a toss, for a friction coefficient."""

MU_RANGE = (0.05, 1.0)


@dataclass(frozen=True)
class Toss:
    """One measured slide."""

    number: int
    unique_id: int
    """Tosses with the same id are rotated copies of one another: they stay on one side of the split."""
    time: np.ndarray
    """Sample times, from 0 [s], `[T]`."""
    pose: np.ndarray
    """x, y, yaw [m, m, rad], `[T, 3]`."""
    twist: np.ndarray
    """Measured velocity at the start, world axes [m/s, m/s, rad/s], `[3]`."""
    stopped: bool
    """The cube stood still at the last sample."""


# ------------------------------------------------------------------------------------------------ measured


def read_tosses(path: Path) -> list[Toss]:
    """All tosses of the file; raises FileError in one line that says what is wrong with it."""
    pose, twist = ["x_m", "y_m", "yaw_rad"], ["vx_mps", "vy_mps", "wz_radps"]
    columns = ["toss", "unique_id", "t_s", *pose, *twist, "sliding"]
    try:
        table = pd.read_csv(path)
    except FileNotFoundError:
        raise FileError(f"{path}: no such file") from None
    except (OSError, EOFError, ValueError, zlib.error) as error:  # a folder, a broken archive, no text, no table
        raise FileError(f"{path}: cannot be read as a table: {' '.join(str(error).split())}") from None
    missing = [name for name in columns if name not in table]
    if missing:
        raise FileError(f"{path}: has no column {', '.join(missing)}; needed are {', '.join(columns)}")
    numbers = table[columns].apply(pd.to_numeric, errors="coerce")
    bad = np.argwhere(~np.isfinite(numbers.to_numpy(dtype=float)))
    if len(bad):
        raise FileError(f"{path}: column {columns[bad[0, 1]]}, row {bad[0, 0] + 1} below the heading: not a number")
    tosses = []
    for number, rows in numbers.groupby("toss"):
        time = rows["t_s"].to_numpy() - rows["t_s"].iloc[0]
        if len(time) < 2 or (np.diff(time) <= 0.0).any():
            raise FileError(f"{path}: toss {number:g} needs two samples or more, at increasing times")
        first, stopped = rows.iloc[0], rows["sliding"].iloc[-1] == 0
        start = first[twist].to_numpy(dtype=float)
        tosses.append(Toss(int(number), int(first["unique_id"]), time, rows[pose].to_numpy(), start, bool(stopped)))
    if len({toss.unique_id for toss in tosses}) < 2:
        raise FileError(f"{path}: needs at least two tosses with different unique_id")
    return tosses


def split(tosses: Sequence[Toss], seed: int, most: int | None = None) -> tuple[list[Toss], list[Toss]]:
    """Two halves of (at most `most` different) tosses, one to fit and one to test; no unique_id is in both."""
    ids = np.random.default_rng(seed).permutation(sorted({toss.unique_id for toss in tosses}))[:most]
    halves = ids[: len(ids) // 2], ids[len(ids) // 2 :]
    fit, test = ([toss for toss in tosses if toss.unique_id in half] for half in halves)
    return fit, test


# ------------------------------------------------------------------------------------------------ simulated


def bristles(build: Callable[[pf.LuGre], object]) -> Predict:
    """Prediction by one of the library's models, `build(law)`."""

    @lru_cache(maxsize=1)
    def model(mu: float) -> object:
        # Dry friction without Stribeck or viscous terms. Bristles so stiff that only mu counts: they deflect by mu um,
        # and as they start relaxed, loading them takes mu g sigma_1/sigma_0 = 0.04 mm/s of speed. Ten times stiffer
        # ones, and a solver 100 times more exact, move no final pose by 0.03 mm or 0.02 deg. v_s is only the scale of
        # the solver's tolerance.
        law = pf.LuGre(mu_c=mu, mu_s=mu, v_s=1e-3, sigma_0=1e6, sigma_1=20.0, sigma_2=0.0, elasto_plastic=0.9)
        return build(law)

    def predict(mu: float, toss: Toss) -> np.ndarray:
        scene = pf.scenes.free_slide(model(mu), mass=MASS, inertia=INERTIA, twist=toss.twist)
        x, y, yaw = toss.pose[0]
        scene = replace(scene, body=replace(scene.body, position=(x, y), angle=yaw))
        data = pf.simulate(scene, t_end=toss.time[-1], rtol=1e-4, atol=0.1, save_every=2e-3).data
        # A cube that stopped early stays where it is; between samples 2 ms apart lines are exact to 5 um.
        time = data["time"].to_numpy()
        return np.stack([np.interp(toss.time, time, data[name].to_numpy()) for name in ("x", "y", "theta")], axis=1)

    return predict


def uncoupled(mu: float, toss: Toss) -> np.ndarray:
    """Force mu m g against the velocity and torque mu m g r against the spin, each as if the other were not there."""
    speed, spin = np.hypot(*toss.twist[:2]), toss.twist[2]
    direction = toss.twist[:2] / speed if speed > 0.0 else np.zeros(2)
    path = braked(speed, mu * GRAVITY, toss.time)
    turn = np.sign(spin) * braked(abs(spin), mu * MASS * GRAVITY * RADIUS / INERTIA, toss.time)
    return toss.pose[0] + np.column_stack([path[:, None] * direction, turn])


def braked(speed: float, deceleration: float, time: np.ndarray) -> np.ndarray:
    """Way covered by `time` under a constant deceleration that ends at rest."""
    until = np.minimum(time, speed / deceleration)
    return speed * until - 0.5 * deceleration * until**2


MODELS: dict[str, Predict] = {
    "uncoupled Coulomb": uncoupled,
    "distributed square": bristles(lambda law: pf.DistributedModel(SQUARE, law)),
    "four corners": bristles(lambda law: pf.DistributedModel(CORNERS, law)),
    "reduced, table": bristles(lambda law: pf.ReducedModelPublished(SQUARE, law)),
    "reduced, ellipsoid": bristles(
        lambda law: pf.ReducedModelPublished(SQUARE, law, surface=pf.LimitSurfaceEllipsoid(SQUARE))
    ),
}


# ------------------------------------------------------------------------------------------------ compared


def errors(predicted: np.ndarray, toss: Toss) -> list[float]:
    """Position [mm] and yaw error [deg] at the last sample, then their RMS over all samples."""
    off = predicted - toss.pose
    position, yaw = 1e3 * np.hypot(off[:, 0], off[:, 1]), np.degrees(np.abs(off[:, 2]))
    return [position[-1], yaw[-1], rms(position), rms(yaw)]


Say = Callable[[Sequence[Toss], str], Iterator[Toss]]
"""Goes through tosses while a progress bar shows how far it is."""


def fit_mu(predict: Predict, tosses: Sequence[Toss], say: Say) -> float:
    """The mu with the least mean square of final position error and `RADIUS` times final yaw error."""

    def misfit(inverse: float) -> float:
        mu = 1.0 / inverse
        off = [(predict(mu, toss) - toss.pose)[-1] for toss in say(tosses, f"fit, try mu = {mu:.4f}")]
        return float(np.mean(np.square(off) @ [1.0, 1.0, RADIUS**2]))

    # Sliding distances are proportional to 1/mu: the misfit is almost a parabola in it, found in a few tries.
    low, high = MU_RANGE
    best = minimize_scalar(misfit, bounds=(1.0 / high, 1.0 / low), method="bounded", options={"xatol": 5e-3})
    mu = 1.0 / float(best.x)
    if not 1.02 * low < mu < 0.98 * high:
        print(f"mu = {mu:.4f} is at the edge of {low} to {high}: is the file in SI units?", file=sys.stderr)
    return mu


@dataclass(frozen=True)
class Result:
    """What one model reached."""

    mu: float
    errors: np.ndarray
    """One row a test toss, columns as in `errors`."""


def run(fit: Sequence[Toss], test: Sequence[Toss], results: dict[str, Result]) -> None:
    """Fit and test model after model, into `results`: what is done stays when it is interrupted."""
    for name, predict in MODELS.items():
        with progress(name) as say:
            mu = fit_mu(predict, fit, say)
            rows = [errors(predict(mu, toss), toss) for toss in say(test, f"test, mu = {mu:.4f}")]
        results[name] = Result(mu, np.array(rows))


@contextmanager
def progress(name: str) -> Iterator[Say]:
    """Progress bar on stderr, gone when done."""
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(name)

        def say(tosses: Sequence[Toss], what: str) -> Iterator[Toss]:
            bar.reset(task, total=len(tosses), description=f"{name}: {what}")
            for toss in tosses:
                yield toss
                bar.advance(task)

        yield say


# ------------------------------------------------------------------------------------------------ files


def prepare_folder(folder: Path) -> list[Path]:
    """The two files to write, asked for before the work and not after it; raises FileError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{folder}: cannot be made a folder: {error.strerror or error}") from None
    return [check_writable(folder / name) for name in ("measured_slides.csv", "measured_slides.png")]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the comparison; returns the exit code. What the user got wrong is one line on stderr, exit code 2."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.error = lambda message: parser.exit(2, f"error: {message}\n")  # without the usage: one line
    parser.add_argument("path", type=Path, help="the measured tosses, contactnets_slides.csv.gz")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for the figure and the errors of each toss")
    parser.add_argument("--seed", type=int, default=0, help="which half is fitted (default: 0)")
    parser.add_argument("--tosses", type=int, metavar="N", help="use only N tosses, with their copies")
    options = parser.parse_args(arguments)
    try:
        return compare(options.path, options.out, validation.count("--seed", options.seed, 0), options.tosses)
    except pf.FrictionError as error:
        parser.error(str(error))


def compare(path: Path, out: Path | None, seed: int, most: int | None) -> int:
    """Read, split, fit, test, show and write; returns the exit code."""
    if most is not None:
        validation.count("--tosses", most, 2)
    tosses = read_tosses(path)
    fit, test = split(tosses, seed, most)
    files = [] if out is None else prepare_folder(out)
    stopped = sum(toss.stopped for toss in [*fit, *test])
    print(f"{len(fit)} tosses to fit, {len(test)} to test; {stopped} of them measured until they stopped")
    results: dict[str, Result] = {}
    code = 0
    try:
        run(fit, test, results)
    except KeyboardInterrupt:
        print(f"interrupted: {len(results)} of {len(MODELS)} models are done", file=sys.stderr)
        code = 130
    if results:
        show(test, results, seed)
    if results and files:
        write_errors(files[0], test, results)
        draw(test, {name: partial(MODELS[name], done.mu) for name, done in results.items()}, OUTLINE).savefig(files[1])
        print(f"wrote {files[0]} and {files[1]}")
    return code


if __name__ == "__main__":
    sys.exit(main())
