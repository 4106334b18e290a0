"""Measured pushes of a triangle on three known feet, against the limit surface of those feet.

The files hold the mean wrench of a pusher and the way that the object went, 50 pushes in each of 10 layouts of feet
(Zhou, Paolini, Bagnell, Mason, ICRA 2016). The twist of a push is normal to the limit surface where the wrench is: it
is predicted from the places of the feet and their loads, with nothing fitted, and then with two parameters
fitted on 30 pushes:

    python examples/measured_pushes.py FOLDER --out out/

The convex quartic needs an extra, `pip install 'planarfriction[quartic]'`; without it the rest runs.
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from measured_pushes_report import draw, show_fits, show_predictions, write_errors
from rich.console import Console
from rich.progress import Progress
from scipy.optimize import minimize

import planarfriction as pf
from planarfriction import validation
from planarfriction.errors import FileError
from planarfriction.writing import check_writable

LENGTH = 0.05  # rho of the metric: angles are between (vx, vy, rho omega) [m]
TO_FIT, TO_TEST = 30, 10  # pushes of a split, as the authors did
PREFIX = "zhou_icra16_"

# 31 cells across the flat triangle: 61 move its mean errors by less than 0.02 deg.
FLAT_CELLS = 31


@dataclass(frozen=True)
class Layout:
    """The pushes of an object on one layout of feet."""

    name: str
    surface: str
    """Board: hardboard or plywood."""
    feet: np.ndarray | None
    """Places of the feet `[3, 2]` [m]; None where the whole triangle touches the board."""
    corners: np.ndarray
    """The same of the triangle that touches, or that the feet span."""
    shares: np.ndarray
    """Shares of the load on the feet `[3]`."""
    friction: float
    """`mu f_N` as the authors measured it [N]: only a fit of a whole surface needs it."""
    wrenches: np.ndarray
    """Wrenches of the pusher on the object, about the centre, object axes `[M, 3]` [N, N, N m]: friction is minus."""
    twists: np.ndarray
    """Measured `(vx, vy, rho omega)` of length 1 `[M, 3]`."""
    headings: np.ndarray
    """Angle of the object on the board, halfway `[M]` [rad]."""

    def patch(self) -> pf.ContactPatch:
        """Feet as points with their loads, or the triangle under uniform pressure."""
        if self.feet is None:
            return pf.ContactPatch.polygon(self.corners, cells=FLAT_CELLS, name=self.name)
        return pf.ContactPatch.points(self.feet, self.shares, name=self.name)


# ------------------------------------------------------------------------------------------------ measured


def table(path: Path, columns: Sequence[str], words: Sequence[str] = ()) -> pd.DataFrame:
    """The columns of a CSV file, all but `words` as finite numbers; raises FileError in one line."""
    try:
        found = pd.read_csv(path)
    except FileNotFoundError:
        raise FileError(f"{path}: no such file") from None
    except (OSError, ValueError) as error:  # a folder, no text, no table
        raise FileError(f"{path}: cannot be read as a table: {' '.join(str(error).split())}") from None
    missing = [name for name in [*words, *columns] if name not in found]
    if missing:
        raise FileError(f"{path}: has no column {', '.join(missing)}; needed are {', '.join([*words, *columns])}")
    found = found[[*words, *columns]].copy()
    found[columns] = found[columns].apply(pd.to_numeric, errors="coerce")
    return found


def check_finite(path: Path, found: pd.DataFrame, columns: Sequence[str]) -> None:
    """Raise FileError that names the first entry that is no number."""
    bad = np.argwhere(~np.isfinite(found[list(columns)].to_numpy(dtype=float)))
    if len(bad):
        raise FileError(f"{path}: column {columns[bad[0, 1]]}, row {found.index[bad[0, 0]] + 1}: not a number")


def read_layouts(folder: Path) -> list[Layout]:
    """All layouts of the pushes and the feet in a folder; raises FileError in one line that says what is wrong."""
    motion = ["fx_N", "fy_N", "tau_Nm", "dx_m", "dy_m", "dtheta_rad", "world_theta0_rad"]
    places = ["x_m", "y_m", "load_fraction", "muN_authors_N"]
    path, beside = folder / f"{PREFIX}pushes.csv", folder / f"{PREFIX}supports.csv"
    pushes, feet = table(path, motion, ["config", "surface"]), table(beside, places, ["config", "kind"])
    check_finite(path, pushes, motion)
    check_finite(beside, feet, [name for name in places if name != "load_fraction"])
    layouts = []
    for name, rows in pushes.groupby("config", sort=False):
        here = feet[feet.config == name]
        if len(here) != 3:
            raise FileError(f"{beside}: needs three rows for {name}, has {len(here)}")
        wrenches, twists = rows[motion[:3]].to_numpy(), rows[motion[3:6]].to_numpy() * [1.0, 1.0, LENGTH]
        size = np.linalg.norm(twists, axis=1)
        if len(rows) < TO_FIT + TO_TEST or not ((size > 0.0) & (np.abs(wrenches).max(axis=1) > 0.0)).all():
            raise FileError(f"{path}: {name} needs {TO_FIT + TO_TEST} pushes or more, none without force or motion")
        corners, flat = here[["x_m", "y_m"]].to_numpy(), here["kind"].iloc[0] != "point"
        if not flat:
            check_finite(beside, here, ["load_fraction"])
        layouts.append(
            Layout(
                name=str(name),
                surface=str(rows["surface"].iloc[0]),
                feet=None if flat else corners,
                corners=corners,
                shares=np.full(3, 1 / 3) if flat else here["load_fraction"].to_numpy() / here["load_fraction"].sum(),
                friction=float(here["muN_authors_N"].iloc[0]),
                wrenches=wrenches,
                twists=twists / size[:, None],
                headings=(rows["world_theta0_rad"] + 0.5 * rows["dtheta_rad"]).to_numpy(),
            )
        )
    if not layouts:
        raise FileError(f"{path}: holds no pushes")
    return layouts


def read_published(folder: Path) -> pd.DataFrame:
    """The authors' errors on held-out pushes after a fit on TO_FIT, one row a layout, run and method."""
    path = folder / f"{PREFIX}published_errors.csv"
    numbers = ["n_train", "mean_deg", "sd_over_splits_deg", "n_splits"]
    found = table(path, numbers, ["config", "tested_on", "method"])
    return found[(found["tested_on"] == "measured_holdout") & (found["n_train"] == TO_FIT)]


# ------------------------------------------------------------------------------------------------ predicted


def unit(twists: np.ndarray) -> np.ndarray:
    """`(vx, vy, rho omega)` of length 1 of twists `[M, 3]`."""
    scaled = twists * [1.0, 1.0, LENGTH]
    return scaled / np.linalg.norm(scaled, axis=1)[:, None]


def error(predicted: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Angles between unit vectors `[M, 3]` [deg]."""
    across = np.linalg.norm(np.cross(predicted, measured), axis=1)
    return np.degrees(np.arctan2(across, np.einsum("mi,mi->m", predicted, measured)))


SURFACES: dict[str, Callable[[pf.ContactPatch], pf.limit_surface.LimitSurface]] = {
    "patch": pf.LimitSurfaceCells,
    "quartic": pf.LimitSurfaceQuartic,
    "ellipsoid": pf.LimitSurfaceEllipsoid,
}
"""The patch itself, and what is often put in its place: both made of the patch, not of pushes."""


def has_quartic() -> bool:
    """Whether the package that fits the quartic is installed."""
    return importlib.util.find_spec("cvxpy") is not None


def predictions(layout: Layout) -> dict[str, np.ndarray]:
    """Unit twists of all pushes by each of SURFACES, with nothing fitted; friction is minus the pusher's wrench."""
    kinds = {name: kind for name, kind in SURFACES.items() if name != "quartic" or has_quartic()}
    return {name: unit(kind(layout.patch()).twist(-layout.wrenches)) for name, kind in kinds.items()}


def feet_twists(feet: np.ndarray, shares: np.ndarray, wrenches: np.ndarray) -> np.ndarray:
    """Twists of pushes `[M, 3]` of an object on feet `[3, 2]`."""
    return pf.LimitSurfaceCells(pf.ContactPatch.points(feet, shares)).twist(-wrenches)


def with_shares(layout: Layout, which: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Shares of friction on the first two feet are `values`."""
    shares = np.maximum([values[0], values[1], 1.0 - values[0] - values[1]], 1e-3)
    return unit(feet_twists(layout.feet, shares, layout.wrenches[which]))


def with_grain(layout: Layout, which: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Friction of a foot is `sqrt(v' M v)`, `M = L L`, `L = exp [[a, b], [b, -a]]` along the board's axes.

    Feet at `rho' = -J L J rho` (J turns by 90 degrees) that move by `L v` feel the same friction without the grain,
    under the force `L^-1 f`.
    """
    (a, b), size = values, np.hypot(*values)
    ratio = np.sinh(size) / size if size > 0.0 else 1.0
    board = np.cosh(size) * np.eye(2) + ratio * np.array([[a, b], [b, -a]])
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
    found = []
    for push in which:
        cos, sin = np.cos(layout.headings[push]), np.sin(layout.headings[push])
        turn = np.array([[cos, -sin], [sin, cos]])
        stretch = turn.T @ board @ turn  # in the object's axes
        wrench = layout.wrenches[push].copy()
        wrench[:2] = np.linalg.solve(stretch, wrench[:2])
        twist = feet_twists(layout.feet @ (-quarter @ stretch @ quarter).T, layout.shares, wrench[None])[0]
        twist[:2] = np.linalg.solve(stretch, twist[:2])
        found.append(twist)
    return unit(np.array(found))


# ------------------------------------------------------------------------------------------------ fitted

Predict = Callable[[Layout, np.ndarray, np.ndarray], np.ndarray]
"""Unit twists of the pushes `which` for values of the parameters."""

FITS: dict[str, tuple[Predict, Callable[[Layout], list[float]], tuple[float, ...]]] = {
    "load fractions (2)": (with_shares, lambda layout: [*layout.shares[:2]], (0.05, 0.05)),
    "grain (2)": (with_grain, lambda layout: [0.0, 0.0], (0.15, 0.15)),
}
"""What is fitted -> its prediction, where the search starts, and its first steps."""


def splits(count: int, pushes: int, seed: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Random sets of TO_FIT pushes and TO_TEST others, `count` times."""
    random = np.random.default_rng(seed)
    drawn = [random.permutation(pushes) for _ in range(count)]
    return [(order[:TO_FIT], order[TO_FIT : TO_FIT + TO_TEST]) for order in drawn]


def fit(predict: Predict, start: Sequence[float], steps: Sequence[float], layout: Layout, which: np.ndarray):
    """The parameters with the least mean angle on the pushes `which`, by the simplex method."""
    simplex = np.array(start) + np.vstack([np.zeros(len(start)), np.diag(steps)])
    # angles of a degree or so are kinked functions of the parameters: 0.01 deg is far below their noise
    options = {"initial_simplex": simplex, "maxfev": 50, "xatol": 2e-3, "fatol": 1e-2}
    misfit = lambda values: float(error(predict(layout, which, values), layout.twists[which]).mean())  # noqa: E731
    return minimize(misfit, start, method="Nelder-Mead", options=options).x


def refitted_quartic(layout: Layout, which: np.ndarray) -> pf.LimitSurfaceQuartic:
    """The authors' own best method, a convex quartic fitted to pushes, by this library."""
    return pf.LimitSurfaceQuartic.fit(
        -layout.wrenches[which] / layout.friction, layout.twists[which] / [1, 1, LENGTH], patch=layout.patch()
    )


@dataclass(frozen=True)
class Fitted:
    """Errors of a method on held-out pushes."""

    tested: np.ndarray
    """Numbers of the pushes, `[splits, TO_TEST]`."""
    errors: np.ndarray
    """Their angles [deg], the same shape."""
    values: np.ndarray
    """Parameters of each split, `[splits, P]`."""


def fits_of(layout: Layout) -> list[str]:
    """What can be fitted to a layout: FITS of feet, and the refitted quartic."""
    return [*(FITS if layout.feet is not None else ()), *(["quartic (15)"] if has_quartic() else ())]


def fit_all(layout: Layout, plain: np.ndarray, sets: Sequence, tell: Callable[[], None]) -> dict[str, Fitted]:
    """Each of `fits_of` in each split, after the errors without any fit on the same pushes."""
    tested = np.array([test for _, test in sets])
    results = {"nothing": Fitted(tested, plain[tested], np.zeros((len(sets), 0)))}
    for name in fits_of(layout):
        errors, values = [], []
        for chosen, test in sets:
            if name in FITS:
                predict, start, steps = FITS[name]
                values.append(fit(predict, start(layout), steps, layout, chosen))
                found = predict(layout, test, values[-1])
            else:
                surface = refitted_quartic(layout, chosen)
                values.append(surface.quartic)
                found = unit(surface.twist(-layout.wrenches[test]))
            errors.append(error(found, layout.twists[test]))
            tell()
        results[name] = Fitted(tested, np.array(errors), np.array(values))
    return results


def run(layouts: Sequence[Layout], count: int, seed: int, errors: dict, fits: dict) -> None:
    """Predict and fit layout after layout, into `errors` and `fits`: what is done stays when it is interrupted."""
    for layout in layouts:
        errors[layout.name] = {name: error(found, layout.twists) for name, found in predictions(layout).items()}
    with progress(count * sum(len(fits_of(layout)) for layout in layouts)) as tell:
        for layout in layouts if count else []:
            sets = splits(count, len(layout.twists), seed)
            fits[layout.name] = fit_all(layout, errors[layout.name]["patch"], sets, lambda at=layout: tell(at.name))


@contextmanager
def progress(total: int) -> Iterator[Callable[[str], None]]:
    """Progress bar on stderr, gone when done."""
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("fit", total=total)
        yield lambda name: bar.update(task, advance=1, description=f"fit: {name}")


# ------------------------------------------------------------------------------------------------ files


def prepare_folder(folder: Path) -> list[Path]:
    """The files to write, asked for before the work and not after it; raises FileError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise FileError(f"{folder}: cannot be made a folder: {failure.strerror or failure}") from None
    return [check_writable(folder / name) for name in ("measured_pushes.csv", "measured_pushes.png")]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the comparison; returns the exit code. What the user got wrong is one line on stderr, exit code 2."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.error = lambda message: parser.exit(2, f"error: {message}\n")  # without the usage: one line
    parser.add_argument("path", type=Path, help=f"the folder with {PREFIX}pushes.csv and the two files beside it")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for the figure and the error of each push")
    parser.add_argument("--splits", type=int, default=15, metavar="N", help="random splits of the fits (default: 15)")
    parser.add_argument("--seed", type=int, default=0, help="of the splits and of the intervals (default: 0)")
    options = parser.parse_args(arguments)
    try:
        count, seed = validation.count("--splits", options.splits, 0), validation.count("--seed", options.seed, 0)
        return compare(options.path, options.out, count, seed)
    except pf.FrictionError as failure:
        parser.error(str(failure))


def compare(path: Path, out: Path | None, count: int, seed: int) -> int:
    """Read, predict, fit, show and write; returns the exit code."""
    folder = path.parent if path.name == f"{PREFIX}pushes.csv" else path
    layouts, published = read_layouts(folder), read_published(folder)
    files = [] if out is None else prepare_folder(out)
    errors: dict[str, Mapping[str, np.ndarray]] = {}
    fits: dict[str, Mapping[str, Fitted]] = {}
    code = 0
    try:
        run(layouts, count, seed, errors, fits)
    except KeyboardInterrupt:
        print(f"interrupted: {len(fits)} of {len(layouts)} layouts are fitted", file=sys.stderr)
        code = 130
    done = [layout for layout in layouts if layout.name in errors]
    if not has_quartic():
        print("Left out: the quartic, and its fit. It needs cvxpy: pip install 'planarfriction[quartic]'\n")
    if done:
        show_predictions(done, errors, published, seed)
        show_fits([layout for layout in done if layout.name in fits], fits, seed)
    if done and files:
        write_errors(files[0], done, errors)
        draw(done, errors, published, predictions(done[min(2, len(done) - 1)])["patch"], seed).savefig(files[1])
        print(f"wrote {files[0]} and {files[1]}")
    return code


if __name__ == "__main__":
    sys.exit(main())
