"""Few discs that stand for a pad: chosen by its stiffness, and fitted to the model of all its pieces.

The discs of a cluster of pieces have its load, with the centre and the second moment of that, and its stiffness. Under
a shift or a spin that grows from rest, all that a disc stands for slips at once, while its pieces slip one after the
other; so the logarithms of the stiffnesses (one for discs that are images of each other) and of the common compliance
are fitted, by least squares, to the wrenches of all pieces at the ends of some paths. A fit is kept on disk.
"""

from __future__ import annotations

import functools
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.compiler import SOURCES, kept_numbers
from planarfriction._engine.compiler.messages import show, watched
from planarfriction._engine.compiler.sources import digest_of
from planarfriction.laws import FrictionLaw, LuGre
from planarfriction.models.distributed import DistributedModel
from planarfriction.pads import Pad, Pieces
from planarfriction.patch import ContactPatch
from planarfriction.patch.discs import clusters_of
from planarfriction.patch.pressure import PerCell

SHIFTS = 0.05, 0.2, 0.35, 0.5, 0.75, 1.0
"""Lengths of paths along an axis, as shares of about that at which a patch slips as a whole."""

SPINS = 0.05, 0.15, 0.3, 0.5, 0.8, 1.5
"""Angles of paths of rotation, alike."""

TOGETHER = (0.3, 0.0, 0.3), (0.5, 0.3, 0.5), (0.3, 0.0, 0.8)
"""Straight paths along which a patch is shifted and turned."""

BENT = ((0.0, 0.0, 1.0), (0.8, 0.0, 0.0)), ((0.0, 0.0, 1.0), (0.0, 0.8, 0.0))
"""Paths along which it is turned first, then shifted: without them, what a turn leaves behind is up to a half off."""

STEPS = 20
"""Steps of each half of a path."""

FULL = 1.5
"""Displacement at which a Hertz contact slips as a whole, over that of the stuck one under the same force."""

HELD = 1e-3
"""Weight of a change of a logarithm beside an error of a wrench, of its limit."""

FARTHEST = 2.5
"""Largest change of a logarithm."""

EVALUATIONS = 12
"""Steps of the fit at most."""

_LINE = "planarfriction fits the discs of a pad, once"

ALIKE = 1e-6
"""Relative difference of sizes, loads, stiffnesses and distances from the middle of discs that are images."""


def discs_of(
    patch: ContactPatch, law: FrictionLaw, pad: Pad, n: int
) -> tuple[ContactPatch, Pad]:
    """Return up to n discs that stand for a patch on a pad, and the pad of the discs."""
    if patch.cells <= n or patch.depends_on_load or pad.springs_of_law:
        return patch.discs(n), pad
    return _fitted(patch, pad, n)


@functools.lru_cache(8)
def _fitted(patch: ContactPatch, pad: Pad, n: int) -> tuple[ContactPatch, Pad]:
    law = LuGre(mu_c=1.0, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9)
    all_pieces = DistributedModel(patch, law, pad=pad)
    few, stiffness = _gathered(patch, pad.pieces(patch, law), pad.shares(patch), n)
    return few, _fit(all_pieces, few, stiffness)


def _gathered(
    patch: ContactPatch, stiffness: np.ndarray, shares: np.ndarray, n: int
) -> tuple[ContactPatch, np.ndarray]:
    """Return discs of clusters of cells by their `shares`, and their stiffness."""
    members = clusters_of(patch, shares, n)
    weights = patch.weights()
    squares = (patch.cell_extents() ** 2).sum(axis=1) / 12.0
    middle = patch.positions.mean(axis=0)
    x, y = (patch.positions - middle).T
    moments = members.sums(
        weights * np.array([np.ones_like(x), x, y, x * x + y * y + squares])
    )
    x, y, second = moments[1:] / moments[0]
    radii = np.sqrt(2.0 * np.maximum(second - x * x - y * y, 0.0))
    areas = members.sums(patch.areas)
    law = PerCell(members.sums(weights) / areas)
    with warnings.catch_warnings(action="ignore"):  # of the size, said before
        few = type(patch)(
            np.stack([x, y], -1) + middle, areas, law, None, patch.name, radii=radii
        )
    return few, members.sums(stiffness)


class _Frame(NamedTuple):
    """Principal axes of a pad, about its middle."""

    turn: np.ndarray
    """Twist in these axes by the twist about the origin, `[3, 3]`."""
    common: np.ndarray | None
    """Common compliances in shift along the axes and in rotation `[3]`, or None."""

    def twists(self, seen: np.ndarray) -> np.ndarray:
        """Return the twists about the origin `[..., 3]` of those in these axes."""
        return np.ascontiguousarray(seen @ np.linalg.inv(self.turn).T)

    def wrenches(self, given: np.ndarray) -> np.ndarray:
        """Return the wrenches in these axes `[..., 3]` of those about the origin."""
        return given @ np.linalg.inv(self.turn)


def _frame(pad: Pad, patch: ContactPatch) -> _Frame:
    middle = patch.areas @ patch.positions / patch.areas.sum()
    turn = np.eye(3)
    turn[:2, 2] = -middle[1], middle[0]
    compliance = pad.compliance(patch)
    if compliance is None:
        return _Frame(turn, None)
    about_middle = turn @ compliance @ turn.T
    # Axes of a square or a disc are not determined: rounding must not choose them.
    if abs(about_middle[0, 1]) > ALIKE * about_middle[:2, :2].trace():
        turn[:2] = np.linalg.eigh(about_middle[:2, :2])[1].T @ turn[:2]
    return _Frame(turn, np.diag(turn @ compliance @ turn.T))


def _fit(whole: DistributedModel, few: ContactPatch, stiffness: np.ndarray) -> Pad:
    """Return the pad of the discs whose wrenches are nearest to those of all pieces."""
    from scipy.optimize import least_squares

    frame = _frame(whole.pad, whole.patch)  # pyright: ignore[reportArgumentType]
    patch = whole.patch
    middle = patch.centre_of_pressure()
    arm = float(patch.weights() @ np.hypot(*(patch.positions - middle).T))
    unit = np.array([1.0, 1.0, arm])
    kinds = _kinds(few, stiffness, middle)
    count = kinds.max() + 1

    def pieces(x: np.ndarray) -> Pieces:
        each = stiffness * np.exp(x[:count])[kinds]
        if frame.common is None:
            return Pieces(each)
        back = np.linalg.inv(frame.turn)
        common = frame.common * np.exp(x[count:])
        return Pieces(each, back * common @ back.T, whole.pad.lag)  # pyright: ignore

    def logarithms() -> np.ndarray:
        paths = _paths(whole, frame, unit)
        start = np.zeros(count + (0 if frame.common is None else 3))
        most = EVALUATIONS * (len(start) + 1) + 1
        tried = 0

        def ends(model: DistributedModel) -> np.ndarray:
            nonlocal tried
            tried += 1
            if watched():
                show(f"{_LINE}: {100 * tried // most} % at most")
            return _ends(model, frame, paths)

        wanted = ends(whole)

        def misfit(x: np.ndarray) -> np.ndarray:
            model = DistributedModel(few, whole.law, pad=pieces(x))
            return np.concatenate([((ends(model) - wanted) / unit).ravel(), HELD * x])

        bounds = (-FARTHEST, FARTHEST)
        fit = least_squares(
            misfit, start, diff_step=1e-2, max_nfev=EVALUATIONS, bounds=bounds
        )
        if watched():
            show("")
        return fit.x

    return pieces(
        kept_numbers("discs", _origin(whole, few, stiffness), logarithms, SOURCES)
    )


def _origin(whole: DistributedModel, few: ContactPatch, stiffness: np.ndarray) -> bytes:
    """Return all that a fit is made from, this file and the pieces and the discs of a pad."""
    patch = whole.patch
    pad: Any = whole.pad
    arrays = (
        patch.positions, patch.weights(), patch.levers(), pad.pieces(patch, whole.law), pad.compliance(patch),
        few.positions, few.radii, few.weights(), stiffness,
    )  # fmt: skip
    parts = [b"" if each is None else each.tobytes() for each in arrays]
    return repr((digest_of(Path(__file__)), pad.lag, parts)).encode()


def _paths(whole: DistributedModel, frame: _Frame, unit: np.ndarray) -> np.ndarray:
    """Return the two parts of paths `[2, P, 3]` in principal axes, under a load of 1 N."""
    patch = whole.patch
    pieces = whole.pad.pieces(patch, whole.law)  # pyright: ignore
    seen = patch.levers() @ np.linalg.inv(frame.turn)
    soft = 1.0 / np.einsum("n,nij,nij->j", pieces, seen, seen)
    if frame.common is not None:
        soft = soft + frame.common
    single = [SHIFTS, SHIFTS, SPINS]
    along = [length * row for row, all_of in zip(np.eye(3), single, strict=True) for length in all_of]  # fmt: skip
    straight = 0.5 * np.array([*along, *TOGETHER])
    parts = np.array([*zip(straight, straight, strict=True), *BENT])
    return FULL * unit * soft * parts.swapaxes(0, 1)


def _ends(model: DistributedModel, frame: _Frame, paths: np.ndarray) -> np.ndarray:
    """Return the wrenches `[P, 3]` of friction at the ends of paths `[2, P, 3]` from rest, in principal axes."""
    state = model.rest(paths.shape[1])
    for twists in frame.twists(paths):
        for _ in range(STEPS):
            state, wrench = model.step(state, twists, 1.0, 1.0 / STEPS)
    return frame.wrenches(wrench)


def _kinds(few: ContactPatch, stiffness: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Return the number `[n]` of the kind of each disc: images of each other are of one kind."""
    distances = np.hypot(*(few.positions - middle).T)
    told = np.stack([distances, few.radii, few.weights(), stiffness], -1)
    apart = np.abs(told[:, None] - told) / told.max(axis=0)
    first = (apart <= ALIKE).all(axis=-1).argmax(axis=1)
    return np.unique(first, return_inverse=True)[1].reshape(-1)
