"""The friction of any contact as a WebAssembly module, and the pages that run it: `python docs/make_wasm.py [module]`.

Writes `docs/static/try.html` and `docs/static/lesson.html`, each one file with all that it needs, from `docs/browser`;
with `module` also `docs/static/planarfriction.wasm` before, for which clang, wasm-ld and the C library of WASI are
needed (Debian: clang, lld, wasi-libc).
"""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from matplotlib.colors import to_hex

import planarfriction as pf
from planarfriction._engine.bristles.discs import KAPPA
from planarfriction._engine.codegen.symbolic_functions import twin
from planarfriction._engine.codegen.trace import Mathematics, Number, Trace, traced
from planarfriction._engine.codegen.vectors import dot, norm, plus, times
from planarfriction._engine.compiler import compiled_math
from planarfriction.export.body import body_of
from planarfriction.export.c_source import Writer, of_compiled
from planarfriction.export.library import PARAMETERS, PRECISIONS
from planarfriction.export.pieces import pieces_of
from planarfriction.export.slip import LARGEST_ANGLE
from planarfriction.limit_surface.loops import cell_twists, twists
from planarfriction.plots import style

DOCS = Path(__file__).parent
BROWSER = DOCS / "browser"
LOOK = '<link rel="stylesheet" href="look.css">'
MODULE = DOCS / "static" / "planarfriction.wasm"
PAGES = "lesson.html", "try.html"
HERTZ = pf.patch.SoftFinger(c=1.0, n=0.0, k=2.0)
PADS = np.repeat([[1, 0, 1]], (3, 14, 3), axis=1).repeat(4, axis=0)
SHAPES = {
    "disc": lambda: pf.ContactPatch.disc(1.0),
    "fingertip": lambda: pf.ContactPatch.disc(1.0, pressure=HERTZ),
    "ring": lambda: pf.ContactPatch.ring(0.8, 1.0, cells=41),
    "square": lambda: pf.ContactPatch.rectangle(2.0),
    "bar": lambda: pf.ContactPatch.rectangle(2.0, 0.2, cells=(40, 4)),
    "pads": lambda: pf.ContactPatch.from_pressure(PADS, width=2.0),
}
"""Shapes of the pages, half as wide as 1 m."""

COLOURS = {
    "friction": style.REDUCED,
    "ellipsoid": style.ELLIPSOID,
    "velocity": "0.25",
    "load": "0.35",
    "holds": style.HOLDS,
    "beyond": style.BEYOND,
    "body": style.BODY,
    "pad": style.PAD,
    "spin": style.SERIES[2],
    "path": style.SERIES[5],
}
W = ["w[0]", "w[1]", "w[2]"]
TEMPLATES = jinja2.Environment(
    loader=jinja2.FileSystemLoader(BROWSER),
    undefined=jinja2.StrictUndefined,
    keep_trailing_newline=True,
)
MOST = 1024
"""Discs of a contact at most."""

ROOM = 8192
"""Numbers that the caller of the module writes and reads at most."""

COMPILERS = "clang", *(f"clang-{version}" for version in range(22, 12, -1))
FLAGS = (
    *("--target=wasm32-wasi", "-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror"),
    *("-nostdlib", "-lc", "-Wl,--no-entry", "-Wl,--strip-all", "-Wl,-z,stack-size=65536"),
)  # fmt: skip


# ---------------------------------------------------------------------- the module


def source() -> str:
    """The C of the module, traced from the functions that exported C is traced from."""
    writer = Writer(own=True)
    patch = pf.ContactPatch.rectangle(0.02).discs(4)
    kinds = {}
    for kind, elasto_plastic in (("plain", None), ("elasto_plastic", 0.5)):
        law = pf.LuGre(mu_c=1.0, elasto_plastic=elasto_plastic)
        model = pf.DistributedModel(patch, law)
        pieces = pieces_of(model, count=MOST)
        assert pieces.turns is not None
        turns = pieces.turns()
        outputs = [f"next[k + {MOST * i}]" for i in range(3)] + W
        kinds[kind] = {
            "step": lines(writer, pieces.step, outputs),
            "turns": lines(writer, turns, [f"w[{i}]" for i in range(12)]),
        }
    body = body_of(model, pieces, "double", 1)
    parameters = list(pieces.parameters)
    return TEMPLATES.get_template("kernels.c.j2").render(
        most=MOST,
        room=ROOM,
        largest=writer.constant(PRECISIONS["double"]),
        parameters=parameters,
        ranges=" && ".join(
            re.sub(
                r"p->(\w+)",
                lambda found: f"n[{parameters.index(found[1])}]",
                PARAMETERS[each][1],
            )
            for each in parameters
        ),
        own={
            each: "\n".join(of_compiled(getattr(compiled_math, each)))
            for each in ("exp", "sin")
        },
        kinds=kinds,
        steady=lines(writer, pieces.steady, W),
        pull=lines(writer, traced(pull), [f"out[{i}]" for i in range(4)]),
        bend=lines(writer, traced(bend), [f"out[{i}]" for i in range(10)]),
        fields=body["fields"],
        search=body["functions"],
        find=body["find"],
        tolerance=body["tolerance"],
        iterations=body["iterations"],
        slip=slip(writer),
        still=writer.constant(cell_twists._AT_REST),
        kappa=writer.constant(KAPPA),
    )


def lines(writer: Writer, block: Any, outputs: list[str]) -> str:
    return "\n".join(writer.lines(block, outputs))


def numbers(trace: Trace, *names: str) -> Any:
    return tuple(Number(trace, each) for each in names)


def pull(trace: Trace) -> Any:
    """Speed of disc k at a twist `v`, and its friction W/S as the derivatives of its power by the twist."""
    x, y, spin = numbers(trace, "place_x[k]", "place_y[k]", "gyration[k]")
    return sliding(numbers(trace, "v[0]", "v[1]", "v[2]"), (-y, x, spin))[:4]


def bend(trace: Trace) -> Any:
    """The same at a scaled twist, and the second derivatives (xx, xy, xs, yy, ys, ss)."""
    x, y, spin = numbers(trace, "place_x[k]", "place_y[k]", "gyration[k]")
    cx, cy, radius = numbers(trace, "centre_x", "centre_y", "contact_radius")
    by_spin = (cy - y) / radius, (x - cx) / radius, spin / radius
    return sliding(numbers(trace, "v[0]", "v[1]", "v[2]"), by_spin)


def sliding(v: Any, by_spin: Any) -> Any:
    """What a disc does that sees `by_spin` of a unit spin."""
    along = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), by_spin
    u = twin(plus)(twin(times)(v[2], by_spin), 1.0, (v[0], v[1], 0.0))
    pull, tape = twin(cell_twists._FORTH)(u)
    bends = [twin(cell_twists._BACK)(tape, each)[0] for each in along]
    second = [twin(dot)(bends[i], along[j]) for i in range(3) for j in range(i, 3)]
    return twin(norm)(u), *(twin(dot)(pull, each) for each in along), *second


def slip(writer: Writer) -> dict[str, Any]:
    """The steps of the search for the twist of a wrench, as `planarfriction.export.slip` traces them for a table."""
    axes = [f"c[{i}]" for i in range(9)]
    search = [f"s[{i}]" for i in range(len(twists.Search._fields))]

    def three(trace: Trace, name: str, first: int = 0) -> tuple[Any, ...]:
        return tuple(Number(trace, f"{name}[{first + i}]") for i in range(3))

    def frame(trace: Trace) -> Any:
        return [Number(trace, f"frame[{i}]") for i in range(21)]

    def at(trace: Trace) -> tuple[Any, twists.Search]:
        place = (three(trace, "c"), three(trace, "c", 3), three(trace, "c", 6))
        return place, twists.Search(*(Number(trace, each) for each in search))  # pyright: ignore[reportArgumentType]

    def target(trace: Trace) -> Any:
        return twin(twists.target_of)(frame(trace), three(trace, "w"))

    def begin(trace: Trace) -> Any:
        return twin(twists.begin_search)(three(trace, "t"), three(trace, "g"))

    def place(trace: Trace) -> Any:
        own, s = at(trace)
        return twin(twists.place_of)(own, s.ta, s.tb)

    def attempt(trace: Trace) -> Any:
        own, s = at(trace)
        bends = *three(trace, "h", 3), *three(trace, "h", 6)
        known = lambda *_: (three(trace, "h"), bends)
        lean = (0.0, 0.0, 0.0)
        found = twin(twists.try_place)(
            known, None, lean, own, twists.FINE, s, [0.0] * 9
        )
        return found._replace(going=Mathematics.where(found.going, 1.0, 0.0))

    def end(trace: Trace) -> Any:
        own, s = at(trace)
        twist = [0.0] * 3
        v = twin(twists.place_of)(own, s.a, s.b)
        twin(twists.put_twist)(frame(trace), v, s.power, twist)
        return (*twist, s.angle)

    outputs = {
        target: ["t[0]", "t[1]", "t[2]"],
        begin: [*axes, *search],
        place: ["v[0]", "v[1]", "v[2]"],
        attempt: search,
        end: ["twist[0]", "twist[1]", "twist[2]", "*angle"],
    }
    texts = {
        each.__name__: lines(writer, traced(each), names)
        for each, names in outputs.items()
    }
    angle = writer.constant(LARGEST_ANGLE[""])
    return texts | {"trials": twists.MOST_TRIALS, "angle": angle}


def compiled(text: str) -> bytes | None:
    """The module of a C source; None without clang, a linker and a C library for WebAssembly."""
    clang = next(filter(None, map(shutil.which, COMPILERS)), None)
    if clang is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "kernels.c")
        module = file.with_suffix(".wasm")
        command = [clang, str(file), "-o", str(module), *FLAGS]
        file.write_text("#include <math.h>\n", encoding="utf-8")
        if subprocess.run(command, check=False, stderr=subprocess.DEVNULL).returncode:
            return None
        file.write_text(text, encoding="utf-8")
        subprocess.run(command, check=True)
        return module.read_bytes()


# ---------------------------------------------------------------------- the pages


def data() -> str:
    """The module, the discs of the shapes, and the colours of the library's plots, as constants of a script."""
    with warnings.catch_warnings(action="ignore"):  # of patches that are as wide as 2 m
        patches = {name: make().discs(24) for name, make in SHAPES.items()}
    shapes = {
        name: np.column_stack([each.positions, each.radii, each.weights()])
        .round(12)
        .tolist()
        for name, each in patches.items()
    }
    pressures = style.PRESSURE_MAP(np.linspace(0.0, 1.0, 32))
    constants = {
        "MODULE": base64.b64encode(MODULE.read_bytes()).decode(),
        "SHAPES": shapes,
        "COLOURS": {name: to_hex(each) for name, each in COLOURS.items()},
        "PRESSURES": [to_hex(each) for each in pressures],
    }
    return "\n".join(
        f"const {name} = {json.dumps(each, separators=(',', ':'))};"
        for name, each in constants.items()
    )


def page(name: str) -> str:
    """A page with its style and its scripts in it."""

    def script(found: re.Match[str]) -> str:
        name = found[1]
        text = data() if name == "data.js" else (BROWSER / name).read_text("utf-8")
        return f"<script>\n{text.strip()}\n</script>"

    text = (BROWSER / name).read_text("utf-8")
    look = (BROWSER / "look.css").read_text("utf-8")
    text = text.replace(LOOK, f"<style>\n{look.strip()}\n</style>")
    return re.sub(r'<script src="([\w.]+)"></script>', script, text)


def main(parts: list[str]) -> None:
    if "module" in parts:
        module = compiled(source())
        if module is None:
            raise SystemExit("needs clang, wasm-ld and the C library of WASI")
        MODULE.write_bytes(module)
    for name in PAGES:
        (DOCS / "static" / name).write_text(page(name), "utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
