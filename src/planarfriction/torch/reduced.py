"""The reduced model as a PyTorch module."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Self

import torch

from planarfriction.laws import FrictionLaw
from planarfriction.patch import ContactPatch
from planarfriction.torch.base import TRAINABLE, FrictionModule


class ReducedModel(FrictionModule):
    """Reduced LuGre friction, differentiable: bristles on a few cells, or with `parts` the moments of each part.

    The equations and the numbers of `planarfriction.ReducedModel`, with its settings. What is made is a `FewCells` with
    the state `[2, n]` [m] or, with `parts`, a `MomentModel` with `[3]` or `[P, 3]` [m]. `trainable` names the
    parameters of the law that are `nn.Parameter`s. A shape that depends on the load is that at `normal_force` [N].

    Raises InvalidValueError for a parameter that breaks its rule.
    """

    if TYPE_CHECKING:

        def __init__(
            self,
            patch: ContactPatch,
            law: FrictionLaw,
            normal_force: float | None = None,
            *,
            cells: int = 56,
            parts: int | str | None = None,
            segments: int = 24,
            speeds: int = 16,
            trainable: Iterable[str] = TRAINABLE,
            dtype: torch.dtype | None = None,
            device: torch.device | str | None = None,
        ): ...

    def __new__(
        cls, patch: Any = None, law: Any = None, normal_force: Any = None, *, parts: Any = None, **settings: Any
    ) -> Self:
        """Return a module of the member that the settings ask for."""
        if cls is not ReducedModel:
            return super().__new__(cls)
        from planarfriction.torch.few_cells import FewCells
        from planarfriction.torch.moments import MomentModel

        return super().__new__(FewCells if parts is None else MomentModel)  # pyright: ignore
