"""Cells of contacts under loads that are given anew at each step (see `planarfriction.models.cell_loads`)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


class Pressing(NamedTuple):
    """Cells or discs of contacts under given loads; leading axes are those of the loads."""

    load: np.ndarray
    """Loads of the contacts `[...]` [N]."""
    weights: np.ndarray
    """Shares of them that each bears `[..., n]`."""
    numbers: np.ndarray | None = None
    """Numbers of bristles `[..., rows, n]` (see `cells.CellsContact`); None if they stay as they are."""
    kept: np.ndarray | None = None
    """Share of the deflection that stays `[..., n]`; None if all does."""

    def spread(self, batch: tuple[int, ...]) -> Pressing:
        """Return the rows of a batch of contacts, one for each."""
        lead = self.load.ndim
        return Pressing(
            *(
                None
                if each is None
                else np.broadcast_to(each, (*batch, *each.shape[lead:])).reshape(
                    -1, *each.shape[lead:]
                )
                for each in self
            )
        )

    def at(self, step: Any) -> Pressing:
        """Return the rows of a step of a rollout, the last axis of the loads, or of a list of steps."""
        axis = self.load.ndim - 1
        return Pressing(
            *(None if each is None else each.take(step, axis) for each in self)
        )

    def left(self, state: np.ndarray, components: int) -> np.ndarray:
        """Return the state that this pressure leaves of one before: all of it, unless cells of a pad have come."""
        if self.kept is None:
            return state
        left = state.reshape(len(self.kept), -1).copy()
        kept = np.tile(self.kept, components)
        left[:, : kept.shape[1]] *= kept
        return left.reshape(state.shape)
