"""Bristles on a few cells of a patch as a pytree."""

from __future__ import annotations

from planarfriction.jax.distributed import DistributedModel
from planarfriction.jax.reduced import ReducedModel
from planarfriction.laws import FrictionLaw
from planarfriction.models import ReducedModel as Reference
from planarfriction.patch import ContactPatch


class FewCells(DistributedModel, ReducedModel):
    """Distributed friction on the few cells of `planarfriction.ReducedModel`, which `ReducedModel` makes by default.

    Raises InvalidValueError as that does.
    """

    def __init__(
        self,
        patch: ContactPatch,
        law: FrictionLaw,
        normal_force: float | None = None,
        *,
        cells: int = Reference.cells,
        segments: int = Reference.segments,
        speeds: int = Reference.speeds,
        parts: None = None,
    ) -> None:
        self.refuse(patch, law, "jax.ReducedModel")
        few = Reference(patch, law, cells=cells, segments=segments, speeds=speeds).reduction.patch
        super().__init__(few, law, normal_force)
