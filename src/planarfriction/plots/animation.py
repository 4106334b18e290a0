"""Animations of solutions."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

import planarfriction as pf
from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.plots.film import Film
from planarfriction.plots.film_files import check_kind, write_frames
from planarfriction.plots.track import track_of
from planarfriction.writing import replacing

LEAST_FRAMES, USUAL_FRAMES, MOST_FRAMES = 75, 300, 3000
"""Frames that a picture has at least, and at most, where nothing is asked for; most that it can have."""

FASTEST = 50.0
"""Most frames a second: browsers show faster GIFs ten times too slow."""

SLOWEST = 0.01
"""Fewest frames a second: a GIF shows no frame for more than 655 s."""


def animate_solution(
    solution: pf.Solution,
    path: str | Path,
    *,
    slow: float | None = None,
    fps: float = 30.0,
    follow: bool = True,
    dpi: float = 100.0,
    progress: Callable[[float], None] | None = None,
) -> Path:
    """Write an animation of a solution to `path`, a `.gif`, `.mp4` or `.html` file; returns the path.

    On the left, the body in the world: outline, contact patches, the path of its centre, the friction force on it at
    each contact (world axes, all identical contacts) and its centre of rotation. On the right, for each contact (the
    three that are pressed hardest): its cells, from pale to blue as their bristles bend and orange where they slip, and
    its wrench inside its limit surface, for mu_c f_N = 1. Which cells slip is computed by a distributed model with the
    contact's law on the recorded path, whatever the model of the contact, less accurately from samples far apart.

    `.mp4` needs ffmpeg or the extra `[ffmpeg]`. `slow` is how many times slower than real time it runs [-], below 1
    faster; None takes real time if that makes 75 to 300 frames, else the next of 1, 2, 5, 10, ... that does. `fps` are
    the frames per second, from 0.01 to 50. With `follow` the view follows a body that moves much farther than its size,
    instead of showing the whole path. `dpi` is the resolution of pictures of 9.6 x 5.4 inches; `progress` is called
    with the time of each frame [s].

    Raises FileError for a file of another kind, one that cannot be written, a missing ffmpeg, and a solution without
    its scene; InvalidValueError for a parameter that breaks its rule.
    """
    from planarfriction.scenes.solution import scene_of

    scene_of(validation.instance("solution", solution, pf.Solution, "a Solution"), "the animation")
    path = validation.path("path", path)
    check_kind(path)
    times, pace = frame_times(np.asarray(solution.histories["time"].values, dtype=float), slow, fps)
    validation.instance("follow", follow, bool, "True or False")
    dpi = validation.positive("dpi", dpi)
    if not 20.0 <= dpi <= 400.0:
        raise InvalidValueError("dpi", "be from 20 to 400", dpi)
    if not (progress is None or callable(progress)):
        raise InvalidValueError("progress", "be a function of the time of a frame, or None", progress)
    with replacing(path) as file:
        film = Film(solution, track_of(solution, times), follow=follow, pace=pace, dpi=dpi)

        def frame(number: int) -> np.ndarray:
            if progress is not None:
                progress(float(times[number]))
            return film.picture(number)

        write_frames(path, file, frame, len(times), fps)
    return path


def frame_times(sampled: np.ndarray, slow: float | None, fps: float) -> tuple[np.ndarray, str]:
    """Return the times of the frames [s] of a solution with samples at `sampled` [s], and their pace in words."""
    fps = validation.positive("fps", fps)
    if fps > FASTEST:
        raise InvalidValueError("fps", f"be at most {FASTEST:g}", fps)
    if fps < SLOWEST:
        raise InvalidValueError("fps", f"be at least {SLOWEST:g}", fps)
    span = float(sampled[-1] - sampled[0])
    frames = span * fps
    if slow is not None:
        slow = validation.positive("slow", slow)
    elif frames > USUAL_FRAMES:
        slow = 1.0 / _round_up(frames / USUAL_FRAMES)
    else:
        slow = _round_up(LEAST_FRAMES / frames) if 0.0 < frames < LEAST_FRAMES else 1.0
    wanted = slow * span * fps
    if wanted > MOST_FRAMES:
        rule = f"be at most {MOST_FRAMES / frames:.3g} here, for at most {MOST_FRAMES} frames"
        raise InvalidValueError("slow", rule, slow)
    count = max(round(wanted) + 1, 2) if span > 0.0 else LEAST_FRAMES
    if slow == 1.0 or span == 0.0:
        words = ""
    else:
        words = f"   ({slow:g} x slower)" if slow > 1.0 else f"   ({1.0 / slow:g} x faster)"
    return np.linspace(sampled[0], sampled[-1], count), words


def _round_up(value: float) -> float:
    """Return the next of 1, 2, 5, 10, 20, ..."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(each * power for each in (1.0, 2.0, 5.0, 10.0) if each * power >= value * (1.0 - 1e-12))
