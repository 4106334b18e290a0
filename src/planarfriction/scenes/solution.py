"""Solutions: the results of simulations, and how they are stored and loaded with their scenes."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import io
import json
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from urllib.parse import quote, unquote

import numpy as np

from planarfriction._support import validation
from planarfriction._support.described import described
from planarfriction._support.equality import by_parts
from planarfriction._support.pictures import picture
from planarfriction._support.reading import read_bytes
from planarfriction._support.writing import replacing
from planarfriction.errors import FileError, FrictionError, InvalidValueError
from planarfriction.geometry import rotate, twist_at
from planarfriction.scenes.contact import contact_poses
from planarfriction.scenes.scene import Scene
from planarfriction.solvers.statistics import Statistics

if TYPE_CHECKING:
    import xarray as xr

    from planarfriction.scenes.slip import SlipEvent

_SAFE = "".join(chr(i) for i in range(32, 127) if chr(i) != "%")
"""Characters of names that files keep as they are."""

_META = ("scene", "statistics", "status", "message")

_CHECKSUM = "planarfriction_checksum"

_MARK = b"\0\0\0\x17" + _CHECKSUM.encode() + b"\0\0\0\0\x02\0\0\0\x47sha256:"
"""Bytes before the checksum in a NetCDF 3 file: its name, its type (text) and its length, with theirs."""

_DIGITS = 64
"""Length of the checksum after the mark."""

_OTHERWISE = "xarray.load_dataset reads any NetCDF file as it is"
"""Remedy for a file that is not as it was saved."""

_LEFT_OUT = "scene_left_out"
"""Attribute that says why the scene is not in the data."""


@by_parts
class History(NamedTuple):
    """One quantity over time, ready for a dataset."""

    dims: tuple[str, ...]
    """Names of the dimensions of `values`."""
    values: np.ndarray
    """Numbers (names, for `contact`)."""
    attrs: dict[str, str]
    """Attributes: the unit in "units", a description in "long_name"."""


@described
@dataclass(frozen=True, eq=False)
class Solution:
    """Result of a simulation: histories, statistics, and the scene they belong to."""

    histories: Mapping[Any, History | xr.DataArray] = field(repr=False)
    """Contents of `data` by name, including coordinates: plain arrays, or an existing dataset."""
    statistics: Statistics
    """Number of steps and computing time."""
    status: str
    """"success", "at rest", "left its contacts", or the reason for an early end: "interrupted", "step too small",
    "step limit"."""
    message: str
    """Message in one sentence, with a remedy if the solver failed."""
    scene: Scene
    """The scene that was simulated; None in a solution that was loaded from a file without it."""

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Solution):
            return NotImplemented
        return self is other or (
            self.statistics == other.statistics
            and self.status == other.status
            and self.message == other.message
            and self.scene == other.scene
            and self.data.identical(other.data)
        )

    def __hash__(self) -> int:
        return hash((self.statistics, self.status, self.message))

    def __repr__(self) -> str:
        name = "no scene" if self.scene is None else repr(self.scene.name)
        time = self.histories["time"].values
        end = (
            f"{each}={float(self.histories[each].values[-1]):.4g}"
            for each in ("x", "y", "theta")
            if len(time)
        )
        cost = (
            f"{self.statistics.steps} steps in {1e3 * self.statistics.wall_time:.3g} ms"
        )
        until = (
            f"{len(time)} samples to t={float(time[-1]):g} s"
            if len(time)
            else "no samples"
        )
        return f"Solution({name}, {self.status}: {until}, {', '.join([*end, *self._ends(), cost])})"

    def _ends(self) -> list[str]:
        """Return in words when contacts with an edge have ended."""
        if "ended" not in self.histories:
            return []
        names = self.histories["contact"].values
        times = self.histories["ended"].values
        return [
            f"{str(name)!r} ended at t={t:.4g} s"
            for name, t in zip(names, times, strict=True)
            if t == t
        ]

    def _repr_html_(self) -> str:
        return picture("solution in a notebook", self)

    @functools.cached_property
    def data(self) -> xr.Dataset:
        """Histories over `time` [s] and `contact`, each with its unit in `attrs["units"]`; made on first use.

        Body (world axes, centre of mass): x, y [m], theta [rad], vx, vy [m/s], omega [rad/s]. Each contact: fx, fy [N],
        tau [N m], the friction wrench on the body about the contact frame's origin in its axes, of **one** of `count`
        identical contacts, and normal_force [N]; at a jump the left limit. `attrs["scene"]` is the scene as JSON; it is
        empty if the scene cannot be written, for example with a model of your own that is not registered, and
        `attrs["scene_left_out"]` says why.
        """
        import xarray as xr

        return xr.Dataset(dict(self.histories), attrs=_scene_attributes(self.scene))

    def contact_twist(self, contact: str | None = None) -> np.ndarray:
        """Return the twist `[T, 3]` [m/s, m/s, rad/s] of the body relative to one contact, at the times of `data`.

        `(vx, vy, omega)` at the origin of the contact frame, in its axes. `contact` is a name; None takes the only one.

        Raises InvalidValueError for a contact that does not exist, FileError for a solution without its scene.
        """
        chosen = scene_of(self, "a twist").contacts[self.contact_index(contact)]
        poses = columns_of(self, "x", "y", "theta")
        twist = columns_of(self, "vx", "vy", "omega")
        if self.scene.velocity is not None:  # in axes of the body
            return rotate(twist_at(twist, chosen.position), -chosen.angle)
        time = self.histories["time"].values
        at = contact_poses(chosen, time, poses)
        twist = twist_at(twist, at[:, :2] - poses[:, :2])
        if chosen.support_velocity is not None:
            moves = chosen.support_velocity.left(time)
            # Of a pad at its frame, of the ground at the world's origin.
            if chosen.mounted_on == "body":
                moves = twist_at(moves, at[:, :2])
            twist = twist - moves
        return rotate(twist, -at[:, 2])

    def contact_index(self, contact: str | None = None) -> int:
        """Return the index of a contact, given by its name, along the axis `contact`; None takes the only one.

        Raises InvalidValueError for a name that does not exist, and for None if there are several.
        """
        names = [str(name) for name in self.histories["contact"].values]
        if contact is None and len(names) == 1:
            return 0
        if contact is None:
            rule = f"be given if there are several ({', '.join(names)})"
            raise InvalidValueError("contact", rule, contact)
        return names.index(validation.choice("contact", contact, names))

    def slip_events(self) -> tuple[SlipEvent, ...]:
        """Find when each contact slips: onset, end, path, angle and incipient slip of each `SlipEvent`.

        A contact slips while its bristles take up less than half of its motion, `|u - zdot| > |u|/2`, and if it moves
        further than a full deflection mu_c/sigma_0; there is no threshold on the speed. On a pad, it slips while this
        holds cell by cell for cells with more than nine tenths of the load. Incipient slip begins with a tenth of the
        load. Times are interpolated linearly between samples. Bristles have to be recorded:
        `simulate(scene, bristles="all")`.

        Raises InvalidValueError if they are not, FileError for a solution without its scene.
        """
        from planarfriction.scenes.slip import slip_events

        scene_of(self, "a slip event")
        return slip_events(self)

    def plot(self) -> Any:
        """Draw the motion of the body and the time histories; returns a matplotlib Figure.

        `.show()` opens a window, or shows it in a notebook.

        Raises FileError for a solution that was loaded from a file without its scene.
        """
        scene_of(self, "the plot")
        return picture("solution", self)

    def animate(
        self,
        path: str | Path,
        *,
        slow: float | None = None,
        fps: float = 30.0,
        follow: bool = True,
        dpi: float = 100.0,
        progress: Callable[[float], None] | None = None,
    ) -> Path:
        """Write an animation to `path` (`.gif`, `.mp4`, `.html`): body, slip of the cells, wrench in its limit surface.

        `slow` is how many times slower than real time it runs (by default chosen to give 75 to 300 frames), `fps` the
        frames per second, `follow` whether the view follows a body that moves far; see `plots.animate_solution`.

        Raises FileError if the file cannot be written or the solution has no scene, InvalidValueError for a parameter
        that breaks its rule.
        """
        return picture(
            "animation",
            self,
            path,
            slow=slow,
            fps=fps,
            follow=follow,
            dpi=dpi,
            progress=progress,
        )

    def save(self, path: str | Path) -> Path:
        """Write everything, including the scene, to the NetCDF file `path`; `Solution.load` reads it.

        A scene that cannot be written is left out; the attribute `scene_left_out` of the data says why.

        Raises FileError if the file cannot be written.
        """
        attributes = {
            **_scene_attributes(self.scene),
            "statistics": json.dumps(self.statistics.as_dict()),
            "status": self.status,
            "message": self.message,
        }
        return write_dataset(self.data.assign_attrs(attributes), path)

    @staticmethod
    def load(path: str | Path) -> Solution:
        """Read a solution that `Solution.save` wrote, with its scene and the models in it.

        What is loaded is identical to what was saved, bit by bit: the file has a checksum of all its bytes. A file that
        another program has changed, on purpose or not, is refused; change the `data` of a solution and save that
        instead.

        Raises FileError for a missing file, for a damaged or a changed one, and for one with any other content.
        """
        return _read(path)


def columns_of(solution: Solution, *names: str) -> np.ndarray:
    """Return histories of a solution by their names, `[T, ..., n]`."""
    return np.stack([solution.histories[name].values for name in names], -1)


def scene_of(solution: Solution, what: str) -> Scene:
    """Return the scene of a solution, which `what` needs; raises FileError where it was loaded without one."""
    if solution.scene is None:
        raise FileError(
            f"the file has no scene, which {what} needs: {solution.data.attrs.get(_LEFT_OUT, 'it was left out')}"
        )
    return solution.scene


def _scene_attributes(scene: Scene | None) -> dict[str, str]:
    if scene is None:
        return {"scene": ""}
    try:
        return {"scene": scene.to_json()}
    except FrictionError as reason:
        return {"scene": "", _LEFT_OUT: str(reason)}


def write_dataset(data: xr.Dataset, path: str | Path) -> Path:
    """Write a dataset to the NetCDF file `path`, whole or not at all; raises FileError where it cannot be written."""
    with replacing(path) as file:
        try:
            with _quiet():
                data = _renamed(data, functools.partial(quote, safe=_SAFE))
                data = data.assign_attrs({_CHECKSUM: "sha256:" + _DIGITS * "0"})
                content = bytes(data.to_netcdf(engine="scipy"))
        # Of what someone added to the data.
        except (TypeError, RecursionError) as error:
            raise FileError(f"{path}: cannot be written: {_one_line(error)}") from None
        before, _, after, checksum = _parted(content)
        for part in (before, checksum, after):
            file.write(part)
    return Path(path)


def _renamed(data: xr.Dataset, change: Callable[[str], str]) -> xr.Dataset:
    """Return the data under changed names: in a file, other letters than ASCII are "%CF%86", as SciPy needs."""
    names = {
        name: change(name)
        for name in {*data.variables, *data.dims}
        if isinstance(name, str)
    }
    return data.rename({name: new for name, new in names.items() if name != new})


def _parted(content: bytes) -> tuple[memoryview, bytes, memoryview, bytes]:
    """Return the bytes before the checksum of a file, the checksum, the bytes after it, and the checksum of both parts.

    It is the SHA-256 in hexadecimal; raises ValueError for a file without one.
    """
    begin = content.index(_MARK) + len(_MARK)
    view = memoryview(content)
    before = view[:begin]
    after = view[begin + _DIGITS :]
    digest = hashlib.sha256(before)
    digest.update(after)
    return (
        before,
        bytes(view[begin : begin + _DIGITS]),
        after,
        digest.hexdigest().encode(),
    )


def _read(path: str | Path) -> Solution:
    """Read and check a file that `Solution.save` wrote."""
    import xarray as xr

    what = "a saved solution"
    content = read_bytes(path, what)
    if not content.startswith(b"CDF"):
        raise FileError(f"{path}: not {what} (not a NetCDF 3 file)")
    try:
        _, written, _, checksum = _parted(content)
    except ValueError:
        raise FileError(
            f"{path}: not {what}: it has no checksum ({_OTHERWISE})"
        ) from None
    if written != checksum:
        raise FileError(
            f"{path}: damaged, or changed by another program: its checksum differs ({_OTHERWISE})"
        )
    try:
        with _quiet():
            data = xr.load_dataset(io.BytesIO(content), engine="scipy")
    except Exception as error:  # SciPy's reader can fail anywhere, with any exception
        raise FileError(f"{path}: not {what} ({_one_line(error)})") from None
    data = _renamed(data, unquote)
    missing = [name for name in _META if name not in data.attrs]
    if missing:
        raise FileError(
            f"{path}: not {what} of planarfriction (no attribute {missing[0]!r})"
        )
    meta = {name: str(data.attrs[name]) for name in _META}
    for name in ("statistics", "status", "message", _CHECKSUM):
        del data.attrs[name]
    try:
        scene: Any = None
        if meta["scene"]:
            scene = Scene.from_dict(json.loads(meta["scene"]))
        statistics = Statistics(**json.loads(meta["statistics"]))
    except (ValueError, TypeError, FrictionError) as error:
        raise FileError(
            f"{path}: the scene in this file cannot be read: {_one_line(error)}"
        ) from None
    solution = Solution(data, statistics, meta["status"], meta["message"], scene)
    # As they were, with notes that someone added before it was saved.
    solution.data.attrs.update(data.attrs)
    return solution


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep the notices of xarray and SciPy about their own future to themselves; errors pass."""
    with warnings.catch_warnings():
        for category in (FutureWarning, DeprecationWarning, RuntimeWarning):
            warnings.simplefilter("ignore", category)
        yield
