"""The reduced model as a pytree."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Self

from planarfriction.jax.base import FrictionPytree
from planarfriction.laws import FrictionLaw
from planarfriction.patch import ContactPatch


class ReducedModel(FrictionPytree):
    """The reduced model (`planarfriction.ReducedModel`) as a pytree, with its settings.

    What is made is a `FewCells`, bristles on a few cells with the state `[2, n]` [m], or, with `parts`, a `MomentModel`
    with `[3]` or `[P, 3]` [m]. If the shape of the patch depends on the load, that at `normal_force` [N] is kept.

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
        ) -> None: ...

    def __new__(
        cls, patch: Any = None, law: Any = None, normal_force: Any = None, *, parts: Any = None, **settings: Any
    ) -> Self:
        """Return a model of the member that the settings ask for."""
        if cls is not ReducedModel:
            return super().__new__(cls)
        from planarfriction.jax.few_cells import FewCells
        from planarfriction.jax.moments import MomentModel

        return super().__new__(FewCells if parts is None else MomentModel)  # pyright: ignore
