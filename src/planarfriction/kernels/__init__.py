"""Compiled loops: nothing but loops around the formulas, compiled once and cached on disk."""

from __future__ import annotations

import functools
import hashlib
import inspect
from pathlib import Path
from typing import Any

from numba import njit
from numba.extending import register_jitable

from planarfriction import formulas

_OPTIONS = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz", "arcp"}}

jit: Any = functools.partial(njit, cache=True, nogil=True, no_cfunc_wrapper=True, **_OPTIONS)
"""Compile an entry point, callable from Python and from several threads at once.

Sums over cells may be reordered, so that they vectorise.
"""

# Counting references to arrays is atomic: in a step of the reduced model it costs four times the physics. Inner
# functions allocate nothing and keep no array, so they need no counting; they are called from compiled code only.
_INNER = {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}

# Inlined everywhere: a function left standing alone is optimised once by itself and once more in the module of each
# caller. In the process that compiles, the first of these copies is called, and from the cache another: they differ in
# the last bits. It is faster too, a third in the solver on three states.
kernel: Any = functools.partial(njit, forceinline=True, **_INNER, **_OPTIONS)
"""Compile an inner function into each of its callers: no allocation, no array assignments that might need a copy."""

entry: Any = functools.partial(njit, cache=True, **_INNER, **_OPTIONS)
"""Compile a function that compiled code calls by its address (see `kernels.pointers`)."""

for _name, _formula in inspect.getmembers(formulas, inspect.isfunction):
    register_jitable(forceinline=True, **_INNER, **_OPTIONS)(_formula)


def _forget_stale_code() -> None:
    """Drop cached machine code when any source it was made from has changed.

    Numba looks only at the file of the cached function itself, not at the formulas and kernels that it calls.
    """
    here = Path(__file__).parent
    sources = [Path(formulas.__file__), *sorted(here.glob("*.py"))]
    digest = hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()
    stamp = here / "__pycache__" / "kernels.sha256"
    try:
        if stamp.exists() and stamp.read_text() == digest:
            return
        for pattern in ("*.nbi", "*.nbc"):
            for cached in stamp.parent.glob(pattern):
                cached.unlink()
        stamp.parent.mkdir(exist_ok=True)
        stamp.write_text(digest)
    except OSError:  # a read-only installation is compiled into the user's own cache and never edited in place
        return


_forget_stale_code()
