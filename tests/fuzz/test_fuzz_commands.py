"""Every command with arguments that are wrong: exit code 2 and one line on stderr, or the work is done."""

from __future__ import annotations

import contextlib
import io
import random
import shutil
from pathlib import Path

import click
import matplotlib.pyplot as plt
from attack import attack, folder
from judge import Broken, judge
from test_fuzz_tables import LOGS, MAPS

from planarfriction import FrictionError
from planarfriction.cli import INTERRUPTED, OUT_OF_TOLERANCE, main
from planarfriction.cli.app import app
from planarfriction.cli.identify import plan

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
PLAN = "identify plan"
LEGAL = {
    "run": [
        "in-hand",
        "--model",
        "reduced-published",
        "--patch",
        "Line",
        "--t-end",
        "0.02",
    ],
    "sweep": [
        "driven",
        "--model",
        "reduced-published",
        "--patch",
        "Line",
        "--t-end",
        "0.02",
        "--set",
        "normal_force=1,2",
    ],
    "limit-surface": ["--patch", "Line"],
    "export": ["scene.toml", "--out", "library"],
    "hold": ["--mass", "0.3", "--pad", "12x20mm", "--offset", "60mm", "--mu", "0.8"],
    "identify": ["log.csv", "--patch", "Line", "--parameters", "mu_c", "--starts", "1"],
    PLAN: ["--patch", "Line", "--parameters", "mu_c", "--duration", "0.2"],
    "reproduce": ["--list"],
    "bench": ["--only", "nothing"],
}
"""Arguments that attacks change; commands that are not listed are asked for their help."""

TEXTS = """
    nan inf -inf 0 -1 1 2 0.5 1e-300 5e-324 1e300 1e9 1,2,3 mu_c=1e400 mu_c=nan mu_c=0.5 mu_c,mu_c a= = x - -- --help
    . .. / /dev/null nowhere/x.png picture.png picture.txt table.csv map.csv map.png map.npy log.csv scene.toml
    scene.json empty.csv empty.toml folder.csv folder.toml Circle disc ring --out runs.zarr t_end=0.01
    12mm 12x20mm 1e9x1e-9mm 5mm,-3cm
    body.mass=1:2:3 patch.law.mu_c=0.5,0.8 patch.model=reduced,distributed patch.position=[0,0] t_end=a:b
"""


def text(draw: random.Random) -> str:
    """Something to type."""
    return draw.choice(["", " ", "φ\n", "a" * 5000, "9" * 5000, *TEXTS.split()])


def options(command: click.Command) -> list[str]:
    """All options and flags of a command."""
    return [
        name
        for parameter in command.params
        if isinstance(parameter, click.Option)
        for name in parameter.opts
    ]


def arguments(name: str, draw: random.Random) -> list[str]:
    """The legal ones with up to three changes."""
    result = list(LEGAL.get(name, ["--help"]))
    known = options(plan if name == PLAN else app.commands[name])
    for _ in range(draw.randint(0, 3)):
        change = draw.randrange(4)
        at = draw.randrange(len(result) + 1)
        if change == 0 and result:
            result[min(at, len(result) - 1)] = text(draw)
        elif change == 1:
            del result[at : at + 1]
        elif known:
            result += [draw.choice(known), text(draw)][: draw.choice([1, 2, 2, 2])]
    return result


@attack("commands", 60)
def test_commands(draw: random.Random) -> None:
    name = draw.choice([*app.commands, "run", "limit-surface", "identify", PLAN])
    given = [*name.split(), *arguments(name, draw)]
    if name in (
        "bench",
        "explore",
        "referee",
        "reproduce",
        "simulator-benchmark",
        "simulators",
        "warm",
    ) and not {
        "--list",
        "--help",
        "nothing",
    } & set(given):
        return  # minutes of work, or a server that goes on

    def run() -> None:
        output = io.StringIO()
        errors = io.StringIO()
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
            code = main(given)
        plt.close("all")
        if code in (0, OUT_OF_TOLERANCE, INTERRUPTED):
            return
        lines = [
            line
            for line in errors.getvalue().splitlines(keepends=True)
            if not line.startswith("warning: ")
        ]
        if (
            code != 2
            or not lines
            or not lines[0].startswith("error: ")
            or not lines[-1].endswith("\n")
        ):
            raise Broken(f"exit code {code} and {errors.getvalue()[:200]!r}")
        raise FrictionError("".join(lines)[len("error: ") : -1])

    with folder() as here:
        (here / "log.csv").write_bytes(LOGS[0])
        for path, contents in MAPS.items():
            (here / path).write_bytes(contents[0])
        for path in ("empty.csv", "empty.toml"):
            (here / path).touch()
        for path in ("folder.csv", "folder.toml"):
            (here / path).mkdir()
        shutil.copy(EXAMPLES / "driven.toml", here / "scene.toml")
        try:
            judge("commands", run, compiles=True)
        except Broken as broken:
            raise Broken(
                f"planarfriction {' '.join(given)[:300]!r}: {broken}"
            ) from broken
