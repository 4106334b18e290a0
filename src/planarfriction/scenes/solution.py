"""Solutions: what a simulation returns, how it is stored, and how it comes back with its scene."""

from __future__ import annotations

import contextlib
import functools
import json
import os
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planarfriction.errors import FileError, FrictionError
from planarfriction.scenes.scene import Scene
from planarfriction.solvers.statistics import Statistics

if TYPE_CHECKING:
    import xarray as xr

_META = ("scene", "statistics", "status", "message")

_LEFT_OUT = "scene_left_out"
"""Attribute that says why the scene is not in the data."""


class History(NamedTuple):
    """One quantity over time, ready for a dataset."""

    dims: tuple[str, ...]
    """Names of the dimensions of `values`."""
    values: np.ndarray
    """Numbers (names, for `contact`)."""
    attrs: dict[str, str]
    """Its unit in "units", what it is in "long_name"."""


@dataclass(frozen=True, eq=False)
class Solution:
    """Result of a simulation: histories, statistics, and the scene they belong to."""

    histories: Mapping[Any, History | xr.DataArray] = field(repr=False)
    """What `data` is made of, by name, coordinates included: plain arrays, or a dataset that is there already."""
    statistics: Statistics
    """What the simulation took."""
    status: str
    """"success", "at rest", or what ended the simulation early: "interrupted", "step too small"."""
    message: str
    """What happened, in one sentence; the remedy where the solver gave up."""
    scene: Scene
    """The scene that was simulated; None in a solution that was loaded from a file without it."""

    @functools.cached_property
    def data(self) -> xr.Dataset:
        """Histories over `time` [s] and `contact`, each with its unit in `attrs["units"]`; made on first use.

        Body (world axes, centre of mass): x, y [m], theta [rad], vx, vy [m/s], omega [rad/s]. Each contact: fx, fy [N],
        tau [N m], the friction wrench on the body about the contact frame's origin in its axes, of **one** of `count`
        identical contacts, and normal_force [N]; at a jump the left limit. `attrs["scene"]` is the scene as JSON; empty
        where it cannot be written, as with a model of your own that is not registered: `attrs["scene_left_out"]` says
        why.
        """
        import xarray as xr

        return xr.Dataset(dict(self.histories), attrs=_scene_attributes(self.scene))

    def plot(self) -> Any:
        """Draw the motion of the body and the time histories; returns a matplotlib Figure.

        Raises FileError for a solution that was loaded from a file without its scene.
        """
        if self.scene is None:
            raise FileError(f"the file has no scene, which the plot needs: {self.data.attrs[_LEFT_OUT]}")
        from planarfriction.plots import plot_solution

        return plot_solution(self)

    def save(self, path: str | Path) -> Path:
        """Write everything, scene included, to the NetCDF file `path`; `load` brings it back.

        A scene that cannot be written is left out; the attribute `scene_left_out` of the data says why.

        Raises FileError where the file cannot be written.
        """
        attributes = {
            **({} if self.scene is None else _scene_attributes(self.scene)),
            "statistics": json.dumps(self.statistics.as_dict()),
            "status": self.status,
            "message": self.message,
        }
        return write_dataset(self.data.assign_attrs(attributes), path)


def _scene_attributes(scene: Scene | None) -> dict[str, str]:
    if scene is None:
        return {"scene": ""}
    try:
        return {"scene": scene.to_json()}
    except FrictionError as reason:
        return {"scene": "", _LEFT_OUT: str(reason)}


def write_dataset(data: xr.Dataset, path: str | Path) -> Path:
    """Write a dataset to the NetCDF file `path`, all or nothing; raises FileError where it cannot be written."""
    path = check_writable(path)
    target = Path(os.path.realpath(path))  # a link stays one
    # Written beside the target first: a crash half-way leaves an older result as it was.
    part = _part(target)
    try:
        with _quiet():
            data.to_netcdf(part, engine="scipy")
        os.replace(part, target)
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        part.unlink(missing_ok=True)
    return path


def load(path: str | Path) -> Solution:
    """Read a solution that `Solution.save` wrote, with its scene and the models in it.

    Raises FileError for a missing file and for a file that holds anything else.
    """
    import xarray as xr

    path = Path(path)
    if not os.path.exists(path):
        raise FileError(f"{path}: no such file (expected a saved solution)")
    if path.is_dir():
        raise FileError(f"{path}: is a folder, not a saved solution")
    try:
        with path.open("rb") as file, _quiet():
            if file.read(3) != b"CDF":
                raise FileError(f"{path}: not a saved solution (not a NetCDF 3 file)")
            data = xr.load_dataset(path, engine="scipy")
    except FrictionError:
        raise
    except Exception as error:  # a broken file can fail anywhere in the reader, with any exception
        reason = " ".join(str(error).split()) or type(error).__name__
        raise FileError(f"{path}: not a saved solution ({reason})") from None
    missing = [name for name in _META if name not in data.attrs]
    if missing:
        raise FileError(f"{path}: not a saved solution of planarfriction (no attribute {missing[0]!r})")
    meta = {name: str(data.attrs[name]) for name in _META}
    for name in ("statistics", "status", "message"):
        del data.attrs[name]
    try:
        scene: Any = Scene.from_dict(json.loads(meta["scene"])) if meta["scene"] else None
        statistics = Statistics(**json.loads(meta["statistics"]))
    except (ValueError, TypeError, FrictionError) as error:
        reason = " ".join(str(error).split())
        raise FileError(f"{path}: the scene in this file cannot be read: {reason}") from None
    solution = Solution(data, statistics, meta["status"], meta["message"], scene)
    solution.data.attrs.update(data.attrs)  # as they were, with notes that someone added before it was saved
    return solution


def check_writable(path: str | Path) -> Path:
    """Return `path` if a file can be written there, or raise FileError: ask before a long run, not after it.

    A file is really opened there, since permissions alone do not tell; what `path` holds stays as it is.
    """
    path = Path(path)
    target = Path(os.path.realpath(path))
    if os.path.isdir(target):
        raise FileError(f"{path}: cannot be written: it is a folder, give the name of a file in it")
    if not os.path.isdir(target.parent):
        raise FileError(f"{path}: cannot be written: there is no folder {target.parent}")
    existing = os.path.exists(target)
    if existing and not os.path.isfile(target):
        raise FileError(f"{path}: cannot be written: it is a device, not a file")
    try:
        if existing:
            target.open("ab").close()
        _part(target).open("ab").close()
        _part(target).unlink()
    except (OSError, ValueError) as error:
        raise FileError(f"{path}: cannot be written: {getattr(error, 'strerror', None) or error}") from None
    return path


def _part(target: Path) -> Path:
    """Where a file is written before it takes the place of `target`."""
    return target.with_name(f"{target.name}.part")


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep the notices of xarray and SciPy about their own future to themselves; errors pass."""
    with warnings.catch_warnings():
        for category in (FutureWarning, DeprecationWarning, RuntimeWarning):
            warnings.simplefilter("ignore", category)
        yield
