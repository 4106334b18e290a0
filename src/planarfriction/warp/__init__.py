"""Friction models for NVIDIA Warp: one kernel steps the contacts of thousands of environments, on GPUs and CPUs.

Needs Warp: `pip install 'planarfriction[warp]'`.
"""

try:
    import warp as _warp  # noqa: F401
except ImportError:
    from planarfriction.errors import MissingExtraError

    raise MissingExtraError("warp-lang", "warp") from None

from planarfriction.warp.coupled import CoupledPatches
from planarfriction.warp.model import Model

__all__ = ["CoupledPatches", "Model"]
