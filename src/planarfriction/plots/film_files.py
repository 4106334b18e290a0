"""Files of moving pictures: GIF by Pillow, MP4 by ffmpeg, HTML with matplotlib's player."""

from __future__ import annotations

import contextlib
import io
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from planarfriction.errors import FileError
from planarfriction.plots.style import evenly

if TYPE_CHECKING:
    from PIL import Image

KINDS = (".gif", ".mp4", ".html")
"""Kinds of moving pictures."""

LAST = 1.0
"""Time [s] for which a GIF rests on its last frame before it begins again."""

PALETTE_FRAMES = 6
"""Frames from which the 256 colours of a GIF or HTML are chosen."""

WHITE = 248
"""Least red, green and blue of a colour of a palette that stands for white."""

SIGNS = {
    "minus": "&minus;",
    "fast-backward": "|&lt;&lt;",
    "step-backward": "|&lt;",
    "play fa-flip-horizontal": "&lt;",
    "pause": "||",
    "play": "&gt;",
    "step-forward": "&gt;|",
    "fast-forward": "&gt;&gt;|",
    "plus": "+",
}
"""Icon of a button of the player -> what stands on it."""

PIXELS = 64.0
"""Dots per inch of the figures that writers see: sizes over it are exact numbers."""


def write_frames(
    path: Path,
    file: io.BytesIO,
    frame: Callable[[int], np.ndarray],
    count: int,
    fps: float,
) -> None:
    """Write `count` pictures `[height, width, 3]` (bytes) to a file of the kind that `path` says, `fps` a second."""
    kind = path.suffix.lower()
    if kind == ".gif":
        _write_gif(file, frame, count, fps)
        return
    with tempfile.TemporaryDirectory() as folder:
        drawn = Path(folder) / f"film{kind}"  # these writers take no buffers
        figure = _Shown(frame(0), _palette(frame, count) if kind == ".html" else None)
        with _writing(path, drawn, figure, fps) as writer:
            for number in range(count):
                figure.picture = frame(number)
                writer.grab_frame()
        content = drawn.read_bytes()
        file.write(_self_contained(content) if kind == ".html" else content)


def check_kind(path: Path) -> None:
    """Raise FileError unless `path` is a moving picture of a kind that can be written here."""
    if path.suffix.lower() not in KINDS:
        raise FileError(
            f"cannot write {path}: animations are {', '.join(KINDS[:-1])} or {KINDS[-1]} files"
        )
    if path.suffix.lower() == ".mp4":
        _ffmpeg(path)


def _self_contained(page: bytes) -> bytes:
    """Return the page of a player that starts by itself, with signs on its buttons and no font from the network."""
    page = re.sub(rb"<link\b[^>]*>", b"", page)
    page = re.sub(
        rb"(\w+) = new Animation\([^;]*;", rb"\g<0> \1.play_animation();", page
    )
    return re.sub(
        rb'<i class="fa fa-([\w -]+)"></i>',
        lambda found: SIGNS.get(found[1].decode(), "?").encode(),
        page,
    )


def _palette(frame: Callable[[int], np.ndarray], count: int) -> Image.Image:
    """Return the 256 colours of all frames: with one choice they do not flicker, and what is still costs little."""
    from PIL import Image

    chosen = evenly(count, PALETTE_FRAMES).tolist()
    pixels = np.concatenate([frame(each).reshape(-1, 3) for each in chosen])
    colours, counts = np.unique(
        pixels @ np.array([1 << 16, 1 << 8, 1]), return_counts=True
    )
    # What is rare has its colours too.
    often = np.repeat(colours, np.ceil(np.sqrt(counts)).astype(int))
    sheet = Image.fromarray(_colours(often)[None])
    found = sheet.quantize(
        256, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE
    )
    table = np.array(found.getpalette(), dtype=np.uint8).reshape(-1, 3)
    order = np.argsort(counts)
    each = _colours(colours[order])
    nearest = Image.fromarray(each[None]).quantize(
        palette=found, dither=Image.Dither.NONE
    )
    # The most frequent of those that it stands for comes last: means are colours of nothing.
    table[np.asarray(nearest)[0]] = each
    table[table.min(axis=1) >= WHITE] = 255  # Pillow looks for the nearest coarsely
    found.putpalette(table.tobytes())
    return found


def _colours(packed: np.ndarray) -> np.ndarray:
    """Return the red, green and blue `[N, 3]`, each a byte, of colours in one number `[N]`."""
    return np.stack([packed >> 16, packed >> 8 & 255, packed & 255], -1).astype(
        np.uint8
    )


def _write_gif(
    file: io.BytesIO, frame: Callable[[int], np.ndarray], count: int, fps: float
) -> None:
    from PIL import Image

    palette = _palette(frame, count)
    # GIF counts hundredths of a second.
    ends = np.round(100.0 * np.arange(1, count + 1) / fps)
    durations = 10.0 * np.diff(ends, prepend=0.0)
    durations[-1] += 1e3 * LAST
    first, *others = (
        Image.fromarray(frame(number)).quantize(
            palette=palette, dither=Image.Dither.NONE
        )
        for number in range(count)
    )
    options: Any = {"save_all": True, "append_images": others, "loop": 0}
    first.save(file, format="GIF", duration=durations.tolist(), **options)


class _Shown(Figure):
    """A figure that is a picture already: for writers that save a figure frame by frame."""

    def __init__(self, picture: np.ndarray, palette: Image.Image | None):
        height = picture.shape[0] // 2 * 2
        width = picture.shape[1] // 2 * 2  # ffmpeg takes even sizes alone
        super().__init__(figsize=(width / PIXELS, height / PIXELS), dpi=PIXELS)
        self.picture = picture
        self.palette = palette
        self.size = (height, width)

    def savefig(self, fname: Any, *, format: str, **options: Any) -> None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Write the picture: as a PNG in the colours of the palette, or as the bytes that ffmpeg reads."""
        from PIL import Image

        image = Image.fromarray(self.picture[: self.size[0], : self.size[1]])
        if format == "png":
            image.quantize(palette=self.palette, dither=Image.Dither.NONE).save(
                fname, format="PNG"
            )
        else:
            fname.write(image.convert("RGBA").tobytes())


@contextlib.contextmanager
def _writing(path: Path, drawn: Path, figure: Any, fps: Any) -> Iterator[Any]:
    from matplotlib.animation import FFMpegWriter, HTMLWriter

    # [MB]: all frames, for whoever asks for them.
    settings: Any = {"animation.embed_limit": 4096.0}
    if drawn.suffix == ".mp4":
        settings["animation.ffmpeg_path"] = _ffmpeg(path)
        writer: Any = FFMpegWriter(
            fps=fps, codec="h264", extra_args=["-crf", "20", "-pix_fmt", "yuv420p"]
        )
    else:
        writer = HTMLWriter(fps=fps, embed_frames=True)
    stopped = False
    with matplotlib.rc_context(settings):
        try:
            with writer.saving(figure, str(drawn), PIXELS):
                try:
                    yield writer
                except KeyboardInterrupt:
                    stopped = True
                    raise
        except (subprocess.CalledProcessError, BrokenPipeError):
            if stopped:  # ffmpeg was stopped too, and says so
                raise KeyboardInterrupt from None
            raise FileError(
                f"cannot write {path}: ffmpeg failed; write a .gif or .html file instead"
            ) from None


def _ffmpeg(path: Path) -> str:
    """Return the program, of the system or of imageio-ffmpeg."""
    found = shutil.which("ffmpeg")
    if found is None:
        try:
            from imageio_ffmpeg import get_ffmpeg_exe

            found = get_ffmpeg_exe()
        except (ImportError, RuntimeError):
            what = "ffmpeg is not installed: run pip install 'planarfriction[ffmpeg]', or write a .gif or an .html"
            raise FileError(f"cannot write {path}: {what}") from None
        # The variable IMAGEIO_FFMPEG_EXE is not checked by imageio-ffmpeg.
        if not Path(found).is_file():
            what = f"there is no ffmpeg at {found}, which imageio-ffmpeg names"
            raise FileError(f"cannot write {path}: {what}")
    return found
