"""Limit surfaces: the friction wrench of every sliding twist per unit `mu f_N`, which the shape alone decides."""

from planarfriction.families import SURFACES
from planarfriction.limit_surface.base import LimitSurface
from planarfriction.limit_surface.cells import LimitSurfaceCells
from planarfriction.limit_surface.comparison import SurfaceComparison
from planarfriction.limit_surface.ellipsoid import LimitSurfaceEllipsoid
from planarfriction.limit_surface.exact import LimitSurfaceExact
from planarfriction.limit_surface.quartic import LimitSurfaceQuartic
from planarfriction.limit_surface.table import LimitSurfaceTable
from planarfriction.limit_surface.table_published import LimitSurfaceTablePublished

__all__ = [
    "SURFACES",
    "LimitSurface",
    "LimitSurfaceCells",
    "LimitSurfaceEllipsoid",
    "LimitSurfaceExact",
    "LimitSurfaceQuartic",
    "LimitSurfaceTable",
    "LimitSurfaceTablePublished",
    "SurfaceComparison",
    "register",
]

register = SURFACES.register
__dir__ = __all__.copy
