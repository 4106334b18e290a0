"""The friction models over `xp`, without the parameters, which each front end holds in its own way."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from planarfriction import models
from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.laws import FrictionLaw
from planarfriction.pads import Pad
from planarfriction.patch import ContactPatch
from planarfriction.tensors import distributed, faces, published
from planarfriction.tensors.faces import Face
from planarfriction.tensors.pressure import Pressed
from planarfriction.tensors.steps import TensorModel


class CellsModel(TensorModel):
    """The distributed model: a bristle in every cell of a patch."""

    equations = distributed
    positions: Any
    """Positions of the cells `[2, N]` [m]; with a friction metric their levers (see `tensors.distributed.Cells`)."""
    weights: Any
    """Share of the load that each cell carries [-], `[N]`."""
    remainder: Any
    """Digits of the positions that the number type of `positions` has no room for (see `tensors.distributed.Cells`)."""
    stiffness: Any
    """Stiffness of the pieces of a pad `[N]` [N/m]; of `Pad.at_load` its load [N]; None without a pad."""
    compliance: Any
    """Common compliance of the pieces of a pad `[3, 3]`, or None; with one, the face is behind the bristles."""
    lag: float
    """Time in which that follows [s]."""
    kind: tuple[int, bool, str]
    """Key of `cell_loops.KINDS`."""
    of_law: bool
    """True if the stiffness of the pieces is that of the law, by their weights, and not their own."""

    @property
    def state_shape(self) -> tuple[int, ...]:
        """Shape of the state of one contact, `(2, N)` of points, `(3, N)` of discs; flat with a face behind."""
        count = self.positions.shape[1]
        if self.compliance is None:
            return self.kind[0], count
        return (self.kind[0] * count + 3,)

    def parted(self, state: Any) -> tuple[Any, Any]:
        """Return the bristles of a state `[..., d, N]`, and the displacement of the face behind them `[..., 3]`."""
        if self.compliance is None:
            return state, None
        z = state[..., :-3]
        return z.reshape(*z.shape[:-1], self.kind[0], -1), state[..., -3:]

    def step_pressed(
        self, pressed: Pressed, state: Any, twist: Any, load: Any, dt: Any
    ) -> tuple[Any, Any]:
        """See `TensorModel.step_pressed`."""
        if self.compliance is None:
            return super().step_pressed(pressed, state, twist, load, dt)
        xp = self.xp
        given = pressed.contact.law.sigma_0, state, twist
        at = self._face(pressed, xp.widened(state), xp.widened(twist), load, dt)
        new, wrench = faces.step(xp, at)
        return xp.narrowed(new, *given), xp.narrowed(wrench, *given)

    def evaluate_pressed(
        self, pressed: Pressed, state: Any, twist: Any, load: Any
    ) -> tuple[Any, Any]:
        """See `TensorModel.evaluate_pressed`."""
        if self.compliance is None:
            return super().evaluate_pressed(pressed, state, twist, load)
        at = self._face(pressed, state, twist, load, 0.0 * load)
        return faces.evaluate(self.xp, at)

    def _face(self, pressed: Pressed, state: Any, twist: Any, load: Any, dt: Any) -> Face:  # fmt: skip
        """Return the face, whose lag damps in place of the bristles."""
        law, shape = pressed.contact
        law = law._replace(sigma_1=0.0)
        dt = dt[..., None]
        at = *self.parted(state), twist, load[..., None], dt, dt + self.lag
        return Face(law, shape, self.compliance, *at)

    def weighted(self, patch: ContactPatch) -> ContactPatch:
        """Return the `patch` of the model's cells, or its discs if there are fewer, with the present weights.

        Raises InvalidValueError for a patch that has other cells.
        """
        validation.instance("patch", patch, ContactPatch, "a ContactPatch")
        weights = self.xp.to_numpy(self.weights)
        cells = patch if patch.cells <= len(weights) else patch.discs(len(weights))
        if cells.cells != len(weights):
            raise InvalidValueError(
                "patch", f"have the {len(weights)} cells of the model", cells.cells
            )
        return dataclasses.replace(
            cells, pressure=weights / cells.areas, point_shares=None
        )

    def _shape(self, values: Mapping[str, Any]) -> distributed.Cells:
        stiff = self.stiffness
        if stiff is not None and self.of_law:
            stiff = stiff * self.xp.where(self.weights > 0.0, self.weights, 1.0)
        elif stiff is not None:
            stiff = stiff / values["sigma_0"]
        return distributed.Cells(
            self.positions, self.weights, self.remainder, stiff, self.kind
        )


class PublishedModel(TensorModel):
    """The published reduced model: three bristles and a limit surface."""

    equations = published
    surface: Any
    """Numbers of the limit surface: `kind`, `size` and `data` (see `planarfriction._engine.published.surfaces`)."""
    root: Any
    """Symmetric root of the friction metric `[2, 2]`, if the patch has one."""
    stiffness = None
    compliance = None
    """No pad."""

    def _shape(self, values: Mapping[str, Any]) -> published.PublishedNumbers:
        return published.numbers_of(self.xp, values, self.surface, self.root)


def reference_of(
    name: str,
    patch: ContactPatch,
    law: FrictionLaw,
    pad: Pad | None,
    cells: int | None = None,
) -> models.DistributedModel:
    """Return the distributed model that the model `name` computes, of few discs if their number is given.

    Raises InvalidValueError for a patch, a law or a pad that the model cannot be made of.
    """
    TensorModel.refuse(patch, law, name)
    model = models.DistributedModel(patch, law, pad=pad)
    if cells is None:
        return model
    return models.ReducedModel(patch, law, cells=cells, pad=pad).reduction
