"""planarfriction: friction of contact patches that slide and spin at once.

Describe a contact patch, choose a friction law, get a model; put models into a scene, simulate, look.
Every public name lives here; the modules behind them load on first use, so that the import stays light.
"""

from __future__ import annotations

import importlib
import sys
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOME = {
    "Body": "planarfriction.scenes",
    "Contact": "planarfriction.scenes",
    "ContactPatch": "planarfriction.patch",
    "Coulomb": "planarfriction.laws",
    "CoulombStribeck": "planarfriction.laws",
    "Dahl": "planarfriction.laws",
    "DistributedModel": "planarfriction.models",
    "ElastoPlastic": "planarfriction.laws",
    "FrictionError": "planarfriction.errors",
    "LimitSurfaceCells": "planarfriction.limit_surface",
    "LimitSurfaceEllipsoid": "planarfriction.limit_surface",
    "LimitSurfaceExact": "planarfriction.limit_surface",
    "LimitSurfaceQuartic": "planarfriction.limit_surface",
    "LimitSurfaceTable": "planarfriction.limit_surface",
    "LimitSurfaceTablePublished": "planarfriction.limit_surface",
    "LinearGradient": "planarfriction.patch",
    "LuGre": "planarfriction.laws",
    "PressureMaps": "planarfriction.patch",
    "ReducedModel": "planarfriction.models",
    "ReducedModelPublished": "planarfriction.models",
    "Scene": "planarfriction.scenes",
    "Signal": "planarfriction.scenes",
    "SoftFinger": "planarfriction.patch",
    "Solution": "planarfriction.scenes",
    "Uniform": "planarfriction.patch",
    "friction_metric": "planarfriction.patch",
    "rollout": "planarfriction.derivatives",
    "simulate": "planarfriction.scenes",
    "sweep": "planarfriction.sweeps",
    "warm_up": "planarfriction.warm",
}
_MODULES = (
    "derivatives",
    "coupling",
    "errors",
    "families",
    "formulas",
    "geometry",
    "identify",
    "laws",
    "limit_surface",
    "models",
    "patch",
    "planning",
    "plots",
    "scenes",
    "solvers",
    "sweeps",
)

__all__ = [*_HOME, *_MODULES]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        value = getattr(importlib.import_module(_HOME[name]), name)
    elif name in _MODULES:
        value = importlib.import_module(f"planarfriction.{name}")
    else:
        words = f"module 'planarfriction' has no attribute {name!r}"
        raise AttributeError(words, name=name, obj=sys.modules[__name__])  # Python then asks "Did you mean ...?"
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])


if TYPE_CHECKING:  # for editors and type checkers: the same names as above, public by `as`
    from planarfriction import (
        derivatives as derivatives,
        coupling as coupling,
        errors as errors,
        families as families,
        formulas as formulas,
        geometry as geometry,
        identify as identify,
        laws as laws,
        limit_surface as limit_surface,
        models as models,
        patch as patch,
        planning as planning,
        plots as plots,
        scenes as scenes,
        solvers as solvers,
        sweeps as sweeps,
    )
    from planarfriction.derivatives import rollout as rollout
    from planarfriction.errors import FrictionError as FrictionError
    from planarfriction.laws import (
        Coulomb as Coulomb,
        CoulombStribeck as CoulombStribeck,
        Dahl as Dahl,
        ElastoPlastic as ElastoPlastic,
        LuGre as LuGre,
    )
    from planarfriction.limit_surface import (
        LimitSurfaceCells as LimitSurfaceCells,
        LimitSurfaceEllipsoid as LimitSurfaceEllipsoid,
        LimitSurfaceExact as LimitSurfaceExact,
        LimitSurfaceQuartic as LimitSurfaceQuartic,
        LimitSurfaceTable as LimitSurfaceTable,
        LimitSurfaceTablePublished as LimitSurfaceTablePublished,
    )
    from planarfriction.models import (
        DistributedModel as DistributedModel,
        ReducedModel as ReducedModel,
        ReducedModelPublished as ReducedModelPublished,
    )
    from planarfriction.patch import (
        ContactPatch as ContactPatch,
        LinearGradient as LinearGradient,
        PressureMaps as PressureMaps,
        SoftFinger as SoftFinger,
        Uniform as Uniform,
        friction_metric as friction_metric,
    )
    from planarfriction.scenes import (
        Body as Body,
        Contact as Contact,
        Scene as Scene,
        Signal as Signal,
        Solution as Solution,
        simulate as simulate,
    )
    from planarfriction.sweeps import sweep as sweep
    from planarfriction.warm import warm_up as warm_up
