"""Contact patches: cells with areas, and a pressure law that may depend on the normal force."""

from planarfriction.families import PUBLISHED_PATCHES, SHAPES
from planarfriction.patch.contact_patch import ContactPatch
from planarfriction.patch.grid import Grid
from planarfriction.patch.grid_error import GridError
from planarfriction.patch.map_files import MapReading, read_pressure_map
from planarfriction.patch.metric import friction_metric
from planarfriction.patch.pressure import (
    LinearGradient,
    PerCell,
    Pressure,
    SoftFinger,
    Uniform,
)
from planarfriction.patch.pressure_maps import PressureMaps

__all__ = [
    "PUBLISHED_PATCHES",
    "SHAPES",
    "ContactPatch",
    "Grid",
    "GridError",
    "LinearGradient",
    "MapReading",
    "PerCell",
    "Pressure",
    "PressureMaps",
    "SoftFinger",
    "Uniform",
    "friction_metric",
    "read_pressure_map",
    "register",
]

register = SHAPES.register
__dir__ = __all__.copy
