"""planarfriction: friction of contact patches that slide and spin at once.

Describe a contact patch, choose a friction law, get a model; put models into a scene, simulate, look.
The public names stand in `__init__.pyi`; the modules behind them load on first use, so that the import stays light.
"""

from __future__ import annotations

import sys
from typing import Any

import lazy_loader

__version__ = "0.2.0"

_load, _, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name not in __all__:
        words = f"module 'planarfriction' has no attribute {name!r}"
        # Python then asks "Did you mean ...?".
        raise AttributeError(words, name=name, obj=sys.modules[__name__])
    globals()[name] = _load(name)
    return globals()[name]


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
