"""Decorators that compile functions with Numba and keep their machine code on disk, under a digest of all sources."""

from __future__ import annotations

import functools
import inspect
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.compiler import Compiler
from numba.extending import register_jitable

from planarfriction import formulas
from planarfriction._engine.compiler import messages  # noqa: F401 (says when the first function is compiled)
from planarfriction._engine.compiler.numba_compat import part
from planarfriction._engine.compiler.sources import Sources

Inner: Any = part("planarfriction._engine.compiler.inlining", "Inner", Compiler)
"""Numba's compiler for inner functions, or its own for all."""

Entry: Any = part("planarfriction._engine.compiler.entries", "Entry", Compiler)
"""Numba's compiler for entry points, or its own for all."""

Sequential: Any = part(
    "planarfriction._engine.compiler.entries", "Sequential", Compiler
)
"""The same for entry points whose loops are short: no vector instructions, no unrolling."""

Wide: Any = part("planarfriction._engine.compiler.entries", "Wide", Compiler)
"""The same for entry points whose time goes into loops over cells with long bodies: the longest vectors."""

kept: Any = part(
    "planarfriction._engine.compiler.machine_code",
    "kept",
    lambda dispatcher, sources: dispatcher,
)
"""Function that keeps the machine code of a dispatcher on disk, as far as Numba lets it."""

missing: Any = part(
    "planarfriction._engine.compiler.machine_code",
    "missing",
    lambda dispatcher, signature: False,
)
"""Function that tells if something has yet to be compiled that can be kept on disk."""

kept_numbers: Any = part(
    "planarfriction._engine.compiler.machine_code",
    "kept_numbers",
    lambda name, origin, make, sources: make(),
)
"""Function that keeps numbers which take long to make on disk."""

FOLDERS = (
    "_engine/compiler",
    "_engine/codegen",
    "_engine/bristles",
    "_engine/protocol",
    "_engine/cells",
    "_engine/published",
    "_engine/coupled",
    "_engine/body",
    "limit_surface/loops",
    "online/loops",
    "joints/loops",
    "adapters/mujoco/loops",
)
"""Folders and modules of the package with compiled code; a compiled function of the package stands in one of them."""


def sources_of(package: Path) -> Sources:
    """Return all sources of the machine code of the package in a folder: the formulas and the files of `FOLDERS`."""
    compiled = [
        file
        for name in FOLDERS
        for end in (".py", "/*.py")
        for file in package.glob(name + end)
    ]
    return Sources(package, [package / "formulas.py", *compiled])


SOURCES = sources_of(Path(__file__).parents[2])
"""Sources of this package."""

_OPTIONS = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz", "arcp"}}


def jit(function: Any, compiler: Any = Entry) -> Any:
    """Compile an entry point, callable from Python and from several threads at once, and keep it on disk.

    Sums over cells may be reordered, so that they vectorise.
    """
    compiled = njit(
        nogil=True, no_cfunc_wrapper=True, pipeline_class=compiler, **_OPTIONS
    )
    return kept(compiled(function), SOURCES)


sequential_jit: Any = functools.partial(jit, compiler=Sequential)
"""Compile an entry point as `jit` does, in a third of the time: for one that has no loop over cells of its own."""

wide_jit: Any = functools.partial(jit, compiler=Wide)
"""Compile an entry point as `jit` does, with the longest vectors: for loops over cells with long bodies."""


# Counting references to arrays is atomic: in a step of the reduced model it costs four times the physics. Inner
# functions allocate nothing and keep no array, so they need no counting; they are called from compiled code only.
_INNER = {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}

# Inlined everywhere: what stands alone is optimised by itself and again in the module of each caller, and rounds in
# the process that compiles otherwise than from the cache. It is faster too, a third in the solver on three states.
kernel: Any = functools.partial(
    njit, forceinline=True, pipeline_class=Inner, **_INNER, **_OPTIONS
)
"""Compile an inner function into each of its callers: no allocation, no closures, no array assignments that copy."""


def entry(function: Any, compiler: Any = Entry) -> Any:
    """Compile a function that compiled code calls by its address (see `compiler.calls`), and keep it on disk."""
    compiled = njit(pipeline_class=compiler, **_INNER, **_OPTIONS)
    return kept(compiled(function), SOURCES)


sequential_entry: Any = functools.partial(entry, compiler=Sequential)
"""Compile a function as `entry` does, in a third of the time: for one that has no loop over cells of its own."""

wide_entry: Any = functools.partial(entry, compiler=Wide)
"""Compile a function as `entry` does, with the longest vectors: for loops with long bodies and no remainder."""


def callback(function: Any) -> Any:
    """Compile a function that C libraries call by its address (see `calls.c_address_of`), and keep it on disk."""
    return kept(
        njit(_nrt=False, no_cpython_wrapper=True, pipeline_class=Entry, **_OPTIONS)(
            function
        ),
        SOURCES,
    )


for _name, _formula in inspect.getmembers(formulas, inspect.isfunction):
    register_jitable(forceinline=True, pipeline_class=Inner, **_INNER, **_OPTIONS)(
        _formula
    )
