"""The structured stiff solver: Rosenbrock methods whose linear algebra costs no more than the right-hand side."""

from planarfriction.solvers.methods import RODAS3, RODAS4
from planarfriction.solvers.structured import Integration, Statistics, integrate

__all__ = ["RODAS3", "RODAS4", "Integration", "Statistics", "integrate"]
