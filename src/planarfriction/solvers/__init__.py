"""The structured stiff solver: Rosenbrock methods whose linear algebra costs no more than the right-hand side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader

from planarfriction.solvers.statistics import Statistics

if TYPE_CHECKING:
    from planarfriction.solvers.methods import RODAS3, RODAS4
    from planarfriction.solvers.structured import Integration, integrate

__all__ = ["RODAS3", "RODAS4", "Integration", "Statistics", "integrate"]

# these bring the compiled code
_HOMES = {"methods": ["RODAS3", "RODAS4"], "structured": ["Integration", "integrate"]}
__getattr__, _, _ = lazy_loader.attach(__name__, submod_attrs=_HOMES)
__dir__ = __all__.copy
