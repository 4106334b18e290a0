"""Parts that lean on internals of Numba, each with a substitute where the installed Numba lacks them."""

from __future__ import annotations

import importlib
import warnings
from typing import Any

import llvmlite
import numba

_warned = False


def part(module: str, name: str, instead: Any) -> Any:
    """Return a part by its name, or `instead` if the installed Numba lacks something that the part needs.

    Everything then works as before, but slower: the user is told once in a process.
    """
    try:
        return getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError) as error:
        global _warned
        if not _warned:
            _warned = True
            warnings.warn(
                f"Numba {numba.__version__} with llvmlite {llvmlite.__version__} differs from the versions that were "
                f"tested ({error}): compiling takes longer, and may take place in each process",
                RuntimeWarning,
                stacklevel=2,
            )
        return instead


def need(owner: Any, *names: str) -> None:
    """Raise ImportError if something of Numba lacks one of the attributes that are used later."""
    for name in names:
        if not hasattr(owner, name):
            raise ImportError(f"{getattr(owner, '__name__', owner)} has no {name}")
