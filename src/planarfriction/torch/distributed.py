"""The distributed model as a PyTorch module."""

from __future__ import annotations

from collections.abc import Iterable

import torch
from torch import Tensor, nn

from planarfriction import models
from planarfriction.errors import InvalidValueError
from planarfriction.laws import LuGre
from planarfriction.patch import ContactPatch
from planarfriction.torch import bristle
from planarfriction.torch import namespace as xp
from planarfriction.torch.base import TRAINABLE, FrictionModel, Prepared
from planarfriction.torch.parameters import LAW


class DistributedModel(FrictionModel):
    """Distributed LuGre friction, differentiable: a bristle `z_i` [m] in every cell, state `[2, N]`; for small patches.

    `zdot_i = v_i - beta sigma_0 |v_i|/g z_i`, `W = sum w_i f_N [t_i ; rho_i x t_i]`,
    `t_i = -(sigma_0 z_i + sigma_1 zdot_i + sigma_2 v_i)`; the same numbers as `planarfriction.DistributedModel`.

    `trainable` names the parameters of the law that are `nn.Parameter`s, and `"weights"` for the pressure: the weights
    `w_i` of the cells are the softmax of a raw parameter, so that they stay positive and add up to 1.

    Source: Waltersson and Karayiannidis 2024, section III.
    """

    axis = -2
    positions: Tensor
    """Positions of the cells `[2, N]` [m]."""

    def __init__(
        self,
        patch: ContactPatch,
        law: LuGre,
        *,
        trainable: Iterable[str] = TRAINABLE,
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ):
        super().__init__(patch, law)
        if patch.depends_on_load:
            raise InvalidValueError("patch", "have a shape that does not depend on the load", patch.name)
        self.reference = models.DistributedModel(patch, law)
        self.components = (2, patch.cells)
        kind = {"dtype": dtype or torch.get_default_dtype(), "device": device}
        numbers, chosen = law.numbers._asdict(), tuple(trainable)
        self._adopt({name: numbers[name] for name in LAW}, [name for name in chosen if name != "weights"], **kind)
        self.register_buffer("positions", torch.as_tensor(patch.positions.T.copy(), **kind))
        raw = torch.as_tensor(patch.weights().copy(), **kind).log()
        if "weights" in chosen:
            self.raw_weights = nn.Parameter(raw)
        else:
            self.register_buffer("raw_weights", raw)

    @property
    def weights(self) -> Tensor:
        """Share of the load on each cell `[N]`, with its gradient."""
        return torch.softmax(self.raw_weights, 0)

    @property
    def lever(self) -> float:
        """Contact radius of the patch [m]."""
        return float(self.patch.contact_radius())

    def prepare(self, parameters: Tensor) -> Prepared:
        """The law and the weights of the cells."""
        return Prepared(self._law(parameters), (self.weights,))

    def _drive(self, prepared: Prepared, v: Tensor) -> tuple[bristle.Drive, Tensor]:
        """What drives the bristles, and the velocities of the cells."""
        x, y = self.positions
        vx, vy, omega = v.split(1, -1)
        velocity = torch.stack([vx - omega * y, vy + omega * x], -2)
        speed = xp.norm(velocity, self.axis)
        return bristle.drive(prepared.law, velocity, speed, torch.ones_like(speed)), velocity

    def _wrench(self, prepared: Prepared, z: Tensor, zdot: Tensor, velocity: Tensor) -> Tensor:
        """Wrench about the origin, per unit load."""
        x, y = self.positions
        fx, fy = (bristle.traction(prepared.law, z, zdot, velocity) * prepared.shape[0]).unbind(-2)
        return torch.stack([fx.sum(-1), fy.sum(-1), (x * fy - y * fx).sum(-1)], -1)
