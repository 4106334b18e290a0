"""Friction models as C libraries of one header and one source."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction import validation, writing
from planarfriction.errors import InvalidValueError
from planarfriction.export.c_source import Writer
from planarfriction.export.pieces import Pieces, pieces_of
from planarfriction.formulas import LARGEST

PRECISIONS = {"double": LARGEST, "float": 1e9}
"""Largest number that a step takes, by precision."""

LONGEST_NAME = 40
"""Characters of the name of a library: compilers of C99 tell apart names of 63, and files have such names too."""

MEANINGS = {
    "sigma_0": "bristle stiffness per unit normal load [1/m]",
    "sigma_1": "bristle damping per unit normal load [s/m]",
    "sigma_2": "viscous friction per unit normal load [s/m]",
    "mu_c": "Coulomb coefficient",
    "mu_s": "static coefficient, at least mu_c",
    "v_s": "Stribeck speed [m/s]",
    "breakaway_ratio": "share of the largest deflection below which bristles are elastic, below 1",
}
"""Parameters in the words of the header."""

RANGES = {
    "sigma_0": "p->sigma_0 > 0",
    "sigma_1": "p->sigma_1 >= 0",
    "sigma_2": "p->sigma_2 >= 0",
    "mu_c": "p->mu_c > 0",
    "mu_s": "p->mu_s >= p->mu_c",
    "v_s": "p->v_s > 0",
    "breakaway_ratio": "p->breakaway_ratio >= 0 && p->breakaway_ratio < 1",
}
"""Conditions on parameters."""


def export_c(model: Any, folder: Any, *, name: str = "friction", precision: str = "double") -> tuple[Path, Path]:
    """Write a model as C source, `<name>.h` and `<name>.c`, into a folder; return the two files.

    The source is C99 and C++17, calls nothing but `math.h`, allocates nothing and keeps no state of its own. Its step
    is the model's own (see `FrictionModel.step`), traced from the same formulas.

    Raises InvalidValueError for a name that is no C identifier, an unknown precision, and models without source (see
    `pieces_of`); FileError if the folder cannot be written.
    """
    if not (isinstance(name, str) and name.isascii() and name.isidentifier() and len(name) <= LONGEST_NAME):
        raise InvalidValueError("name", f"be a C identifier of at most {LONGEST_NAME} characters", name)
    validation.choice("precision", precision, PRECISIONS)
    folder = validation.path("folder", folder)
    header, source = _texts(model, pieces_of(model), name, precision)
    writing.make_folder(folder)
    files = folder / f"{name}.h", folder / f"{name}.c"
    with writing.replacing(files[0]) as first, writing.replacing(files[1]) as second:  # both can be written, or none is
        first.write(header.encode())
        second.write(source.encode())
    return files


def _texts(model: Any, pieces: Pieces, name: str, precision: str) -> list[str]:
    """Return header and source."""
    import jinja2

    import planarfriction

    writer = Writer(precision)
    states = pieces.count * pieces.states
    first = f"{pieces.spacing} * k" if pieces.spacing > 1 else "k"
    places = [f"next[{first} + {i * pieces.stride}]" for i in range(pieces.states)]
    results = [*places, "w[0]", "w[1]", "w[2]"]
    columns = pieces.states + 3 + len(pieces.parameters)
    cells = [f"rows[{row}][{column}]" for row in range(3 + pieces.states) for column in range(columns)]
    lines = list(writer.lines(pieces.step, results))
    steady = list(writer.lines(pieces.steady, results[-3:]))
    slopes = list(writer.lines(pieces.slopes(), [*results, *cells]))
    tables = {
        table: ("int", numbers.tolist()) if numbers.dtype.kind == "i" else _table(writer, numbers)
        for table, numbers in pieces.tables.items()
        if table == "share" or any(f"{table}[" in line for line in [*lines, *slopes])
    }
    for each in (lines, steady, slopes):
        if not any("[k]" in line or "* k" in line for line in each):
            each.insert(0, "    (void)k;")
    values = {
        "name": name,
        "version": planarfriction.__version__,
        "model": f"{type(model).__name__} of {model.patch.name or 'a patch'}, {type(model.law).__name__}",
        "digest": hashlib.sha256("\n".join([*lines, repr(tables)]).encode()).hexdigest()[:16],
        "pieces": pieces,
        "states": states,
        "precision": precision,
        "parameters": {each: (writer.constant(value), MEANINGS[each]) for each, value in pieces.parameters.items()},
        "ranges": " && ".join(RANGES[each] for each in pieces.parameters),
        "tables": tables,
        "step": "\n".join(lines),
        "steady": "\n".join(steady),
        "slopes": "\n".join(slopes),
        "columns": columns,
        "stride": pieces.stride,
        "first": first,
        "suffix": writer.suffix,
        "largest": writer.constant(PRECISIONS[precision]),
        "zero": writer.constant(0.0),
        "one": writer.constant(1.0),
        "operations": pieces.count * sum("=" in line for line in lines),
        "functions": pieces.count * sum(any(f"{each}{writer.suffix}(" in line for each in _SLOW) for line in lines),
    }
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("planarfriction.export", "."),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
    )
    return [environment.get_template(f"library.{kind}.j2").render(values) for kind in "hc"]


_SLOW = "sqrt", "exp", "sin", "cos", "pow", "atan2"


def _table(writer: Writer, numbers: np.ndarray) -> tuple[str, list[str]]:
    """Return the type and the constants of a table: in single precision where that is how it is stored."""
    single = numbers.dtype == np.float32
    return ("float" if single else "real"), [
        f"{np.float32(each)!s}f" if single else writer.constant(float(each)).strip("()") for each in numbers.ravel()
    ]
