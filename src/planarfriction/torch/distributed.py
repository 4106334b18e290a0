"""The distributed model as a PyTorch module."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping

import torch
from torch import Tensor, nn

from planarfriction.derivatives.parameters import pack_cells
from planarfriction.formulas import LawNumbers
from planarfriction.laws import FrictionLaw
from planarfriction.patch import ContactPatch
from planarfriction.tensors import distributed
from planarfriction.tensors.steps import LAW, Part
from planarfriction.torch.base import TRAINABLE, Compiled, FrictionModule


class DistributedModel(FrictionModule):
    """Distributed LuGre friction, differentiable: a bristle `z_i` [m] in every cell, state `[2, N]`; for small patches.

    `zdot_i = v_i - beta sigma_0 |v_i|/g z_i`, `W = sum w_i f_N [t_i ; rho_i x t_i]`, `t_i = -(sigma_0 z_i + sigma_1
    zdot_i + sigma_2 v_i)`; the same numbers as `planarfriction.DistributedModel`.

    `trainable` names the parameters of the law that are `nn.Parameter`s. With `"weights"` the pressure is trainable
    too: the weights `w_i` of the cells are the softmax of a raw parameter, so that they stay positive and add up to 1.
    If the shape of the patch depends on the load, the shape at `normal_force` [N] is kept.

    Raises InvalidValueError for a parameter that breaks its rule.

    Source: Waltersson and Karayiannidis 2024, section III.
    """

    equations = distributed
    positions: Tensor
    """Positions of the cells `[2, N]` [m]; with a friction metric their levers (see `tensors.distributed.Cells`)."""

    def __init__(
        self,
        patch: ContactPatch,
        law: FrictionLaw,
        normal_force: float | None = None,
        *,
        trainable: Iterable[str] = TRAINABLE,
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ):
        super().__init__(patch, law)
        cells = distributed.cells_of(patch, normal_force, "torch")
        kind = {"dtype": dtype or torch.get_default_dtype(), "device": device}
        numbers, chosen = law.numbers._asdict(), tuple(trainable)
        lever = float(patch.contact_radius(normal_force))
        physical = [name for name in chosen if name != "weights"]
        self._adopt({name: numbers[name] for name in LAW}, physical, lever, **kind)
        self.register_buffer("positions", torch.tensor(cells.levers, **kind))
        raw = torch.tensor(cells.weights, **kind).log()
        if "weights" in chosen:
            self.raw_weights = nn.Parameter(raw)
        else:
            self.register_buffer("raw_weights", raw)

    @property
    def weights(self) -> Tensor:
        """Share of the load on each cell `[N]`, with its gradient."""
        return torch.softmax(self.raw_weights, 0)

    @property
    def state_shape(self) -> tuple[int, ...]:
        """Shape of the state of one contact, `(2, N)`."""
        return 2, self.positions.shape[1]

    def compiled(self) -> Compiled:
        """Return the model as compiled rollouts take it."""
        return Compiled(functools.partial(pack_cells, self.elasto_plastic), (self.positions, self.weights))

    def _parts(self, law: LawNumbers, values: Mapping[str, Tensor]) -> tuple[Part]:
        return (Part(law, distributed.Cells(self.positions, self.weights)),)
