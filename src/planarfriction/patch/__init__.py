"""Contact patches: cells with areas, and a pressure law that may depend on the normal force."""

from planarfriction.patch.compressed import surface_error
from planarfriction.patch.contact_patch import ContactPatch
from planarfriction.patch.files import read_pressure_map
from planarfriction.patch.grid import Grid
from planarfriction.patch.metric import grain
from planarfriction.patch.pressure import LinearGradient, PerCell, Pressure, SoftFinger, Tabulated, Uniform
from planarfriction.patch.published import PUBLISHED_PATCHES

__all__ = [
    "PUBLISHED_PATCHES",
    "ContactPatch",
    "Grid",
    "LinearGradient",
    "PerCell",
    "Pressure",
    "SoftFinger",
    "Tabulated",
    "Uniform",
    "grain",
    "read_pressure_map",
    "surface_error",
]
