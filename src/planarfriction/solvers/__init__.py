"""The structured stiff solver: Rosenbrock methods whose linear algebra costs no more than the right-hand side."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from planarfriction.solvers.statistics import Statistics

if TYPE_CHECKING:
    from planarfriction.solvers.methods import RODAS3, RODAS4
    from planarfriction.solvers.structured import Integration, integrate

__all__ = ["RODAS3", "RODAS4", "Integration", "Statistics", "integrate"]

_HOME = {"RODAS3": "methods", "RODAS4": "methods", "Integration": "structured", "integrate": "structured"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'planarfriction.solvers' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"planarfriction.solvers.{_HOME[name]}"), name)  # brings the compiled code
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
