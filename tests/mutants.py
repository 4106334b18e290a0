"""Mutants: `python -m tests.mutants SEED COUNT [core|rest|PATTERN]` changes lines of the library and runs their tests.

Each mutant has one operator, sign or number changed in a copy of the package, drawn by the seed among all that there
are; the tests that mirror its module run until one fails. One that no test sees is told as NOT SEEN.
"""

from __future__ import annotations

import ast
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "planarfriction"
CORE = "_engine", "models", "coupling.py"
"""Parts of the package of which 19 of 20 mutants are to be seen; of the rest 17."""

LIMIT = float(os.environ.get("MUTANT_SECONDS", "900"))
"""Time after which the tests of a mutant have not seen it [s]."""

SWAPS = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.Pow: ("**", "*"),
    ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="), ast.And: ("and", "or"), ast.Or: ("or", "and"),
}  # fmt: skip
MIRRORS = {
    "_engine/codegen": "_engine/test_derivatives.py _engine/test_rewriting.py _engine/test_steps.py"
    " export/test_trace.py test_formulas.py test_golden.py export/test_c_library.py",
    "_engine/bristles": "_engine/test_steps.py test_formulas.py models/test_rates.py models/test_steps.py"
    " models/test_pads.py models/test_energy.py laws test_golden.py",
    "_engine/cells": "_engine/test_cell_blocks.py _engine/test_discs.py models/test_batches.py models/test_rates.py"
    " models/test_anisotropic.py models/test_pressure_follows.py models/test_pads.py test_golden.py"
    " derivatives/test_rollouts*.py scenes/test_edge.py scenes/test_pressure_follows.py models/test_cell_loads.py"
    " scenes/test_pads.py",
    "_engine/cells/moment_pressure.py": "patch/test_tilt.py models/test_pressure_follows.py"
    " tensors/test_pressure_follows.py models/test_cell_loads.py scenes/test_pressure_follows.py",
    "_engine/published": "_engine/test_steps.py models/test_rates.py models/test_batches.py test_golden.py"
    " limit_surface/test_closed_forms.py derivatives/test_rollouts_of_every_model.py",
    "_engine/body": "solvers/test_structured.py test_golden.py derivatives/test_scene.py scenes derivatives",
    "_engine/coupled": "test_coupling*.py test_sliding_body*.py models/test_pads.py models/test_cell_loads.py"
    " models/test_pressure_follows.py scenes/test_pads.py",
    "_engine/coupled/placing.py": "adapters/test_turning.py adapters/test_mujoco_centres.py"
    " adapters/test_mujoco_wheels.py adapters/test_drake_turning.py adapters/test_mujoco_warp_turning.py",
    "_engine/records": "models/test_batches.py models/test_state_types.py models/test_steps.py test_golden.py models"
    " scenes/test_edge.py scenes/test_pads.py",
    "_engine/compiler": "_engine/compiler",
    "_engine": "_engine test_golden.py models derivatives limit_surface patch test_coupling.py",
    "models": "models test_golden.py derivatives",
    "coupling.py": "test_coupling*.py models/test_pressure_follows.py models/test_cell_loads.py",
    "formulas.py": "test_formulas.py _engine/test_discs.py _support/test_validation.py models/test_rates.py"
    " models/test_extremes.py test_golden.py",
    "sliding_body.py": "test_sliding_body*.py models/test_cell_loads.py",
    "pads.py": "models/test_pads*.py models/test_pad_discs.py scenes/test_pads.py",
    "half_space.py": "models/test_pads*.py test_tactile.py",
    "cli": "cli identify/test_experiments.py sweeps/test_settings.py",
    "torch": "tensors",
    "jax": "tensors",
    "adapters/drake": "adapters/test_drake*.py adapters/test_pressure*.py adapters/test_wheels*.py",
    "adapters/mjx": "adapters/test_mjx*.py adapters/test_turning.py adapters/test_pressure*.py"
    " adapters/test_wheels*.py",
    "adapters/mujoco": "adapters/test_mujoco.py adapters",
    "adapters/mujoco_warp": "adapters/test_mujoco_warp*.py adapters/test_single*.py adapters/test_mjx_surfaces.py",
    "_support/equality.py": "contracts/test_values.py contracts/test_representations.py",
    "_support/described.py": "contracts/test_docstrings.py contracts/test_representations.py",
    "_support/pictures.py": "contracts/test_representations.py",
    "_support/shown.py": "plots/test_figures.py test_errors.py explorer",
    "_support/reading.py": "_support/test_reading.py patch/test_map_kinds.py scenes/test_refusals.py",
    "_support/validation.py": "_support/test_validation.py contracts/test_bad_input.py",
    "extend.py": "contracts/test_docs.py",
}
"""Tests of parts of the package, as files, patterns and folders, where none has their name; the longest counts."""


def places(file: Path) -> Iterator[tuple[int, int, str]]:
    """Yield beginning, end and new text of what can be changed in a file."""
    source = file.read_text(encoding="utf-8")
    starts = [0]
    for line in source.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))

    def of(node: ast.AST) -> tuple[int, int]:
        return starts[node.lineno - 1] + node.col_offset, starts[
            node.end_lineno - 1
        ] + node.end_col_offset

    def between(
        one: ast.AST, operator: ast.AST, other: ast.AST
    ) -> Iterator[tuple[int, int, str]]:
        old, new = SWAPS.get(type(operator), ("", ""))
        begin = of(one)[1]
        end = of(other)[0]
        found = (
            re.search(re.escape(old), source.encode()[begin:end].decode())
            if old
            else None
        )
        if found:
            yield begin + found.start(), begin + found.end(), new

    waiting: list[ast.AST] = [ast.parse(source)]
    while waiting:
        node = waiting.pop()
        # F-strings have no places of their own.
        if isinstance(node, (ast.JoinedStr, ast.Import, ast.ImportFrom)):
            continue
        hints = {id(getattr(node, name, None)) for name in ("annotation", "returns")}
        waiting += [
            each for each in ast.iter_child_nodes(node) if id(each) not in hints
        ]
        if isinstance(node, ast.BinOp):
            yield from between(node.left, node.op, node.right)
        elif isinstance(node, ast.Compare):
            yield from between(node.left, node.ops[0], node.comparators[0])
        elif isinstance(node, ast.BoolOp):
            yield from between(node.values[0], node.op, node.values[1])
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            begin, _ = of(node)
            yield begin, begin + 1, "+"
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            yield (
                *of(node),
                repr(
                    node.value + 1
                    if isinstance(node.value, int)
                    else 2.0 * node.value or 1.0
                ),
            )


def tests_of(name: str) -> list[str]:
    """Return the files of tests that mirror a module, those first that have its name or speak of it most."""
    *folders, stem = name.removesuffix(".py").split("/")
    begins = [each for each in MIRRORS if name == each or name.startswith(f"{each}/")]
    places = MIRRORS[max(begins, key=len)].split() if begins else folders[:1]
    found: list[Path] = [ROOT / "tests" / "/".join(folders) / f"test_{stem}.py"]
    for place in places:
        path = ROOT / "tests" / place
        folder = path.is_dir()
        files = path.rglob("test_*.py") if folder else path.parent.glob(path.name)
        found += sorted(files, key=lambda file: -file.read_text().count(stem))
    # Those that share words with its name first, then in the order of the table.
    words = {*stem.split("_")}
    found.sort(key=lambda file: -len(words & {*file.stem.split("_")}))
    told = [
        file.relative_to(ROOT).as_posix()
        for file in dict.fromkeys(found)
        if file.exists()
    ]
    return told or ["tests/contracts"]


def judged(copy: Path, tests: list[str]) -> str:
    """Return what tests say of the package of a folder: seen by one of them, not seen, or no answer in time."""
    folders = [copy, ROOT / "studies" / "src", ROOT]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, folders))}
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-x",
        "-q",
        "-p",
        "no:cacheprovider",
        *tests,
    ]
    try:
        done = subprocess.run(
            command, cwd=ROOT, env=environment, timeout=LIMIT, capture_output=True
        )
    except subprocess.TimeoutExpired:
        return "no answer"
    if not done.returncode:
        return "NOT SEEN"
    failed = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout.decode(), re.MULTILINE)
    return f"seen by {failed[1] if failed else f'exit {done.returncode}'}"


def main(seed: int, count: int, part: str = "") -> None:
    """Draw mutants, run their tests, and tell which were seen."""
    files = sorted(PACKAGE.rglob("*.py"))
    names = {file.relative_to(PACKAGE).as_posix(): file for file in files}
    wanted = {
        name: file
        for name, file in names.items()
        if part == ("core" if name.startswith(CORE) else "rest")
        or (part not in ("core", "rest") and re.match(part, name))
    }
    every = [
        (name, *place)
        for name, file in wanted.items()
        for place in sorted(places(file))
    ]
    seen = 0
    for name, begin, end, new in random.Random(seed).sample(every, count):
        source = names[name].read_bytes()
        line = source.count(b"\n", 0, begin) + 1
        told = source.splitlines()[line - 1].decode().strip()
        with tempfile.TemporaryDirectory() as folder:
            # With the machine code of all other sources.
            shutil.copytree(PACKAGE.parent, folder, dirs_exist_ok=True)
            (Path(folder) / "planarfriction" / name).write_bytes(
                source[:begin] + new.encode() + source[end:]
            )
            words = judged(Path(folder), tests_of(name))
        seen += words.startswith("seen")
        print(
            f"{words}: {name}:{line}: {told}: {source[begin:end].decode()} -> {new}",
            flush=True,
        )
    print(f"{seen} of {count} mutants were seen")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:])
