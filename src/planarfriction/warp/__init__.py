"""Friction models for NVIDIA Warp: one kernel steps the contacts of thousands of environments, on GPUs and CPUs.

Needs Warp: `pip install 'planarfriction[warp]'`.
"""

from planarfriction.errors import needing

with needing("warp-lang", "warp"):
    from planarfriction.warp.coupled import CoupledPatches
    from planarfriction.warp.model import Model

__all__ = ["CoupledPatches", "Model"]
