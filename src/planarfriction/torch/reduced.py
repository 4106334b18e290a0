"""The reduced model of bristle moments as a PyTorch module."""

from __future__ import annotations

from collections.abc import Iterable

import torch
from torch import Tensor

from planarfriction import models
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.models import reduced_arrays
from planarfriction.models.reduced_arrays import Held, ReducedNumbers
from planarfriction.patch import ContactPatch
from planarfriction.torch import namespace as xp
from planarfriction.torch.base import FrictionModel, Prepared
from planarfriction.torch.parameters import LAW

PARAMETERS = tuple(name for name in LAW if name != "gamma")
"""Physical parameters, in the order of their vector: the law but gamma, for which the map is made."""


class ReducedModel(FrictionModel):
    """Reduced LuGre friction of bristle moments, differentiable: three states `(z_x, z_y, z_theta)` [m].

    The equations and the numbers of `planarfriction.ReducedModel`; buffers hold its patch with the map of steady
    sliding. `trainable` names the parameters of the law that are `nn.Parameter`s; `gamma` cannot be one, the map is
    made for it. A patch whose shape depends on the load keeps that of `normal_force` [N]; `segments` and `speeds` as in
    `planarfriction.ReducedModel`.
    """

    components = (3,)
    axis = -1
    reference: models.ReducedModel
    factor: Tensor
    quartic: Tensor
    scale: Tensor
    flat: Tensor
    rest_part: Tensor

    def __init__(
        self,
        patch: ContactPatch,
        law: LuGre,
        normal_force: float | None = None,
        *,
        segments: int = 24,
        speeds: int = 14,
        trainable: Iterable[str] = PARAMETERS[:-1],
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ):
        super().__init__(patch, law)
        trainable = tuple(trainable)
        if "gamma" in trainable:
            raise InvalidValueError("trainable", "not name gamma: the map of steady sliding is made for it", trainable)
        kind = {"dtype": dtype or torch.get_default_dtype(), "device": device}
        self.gamma = law.numbers.gamma
        self.reference = models.ReducedModel(patch, law, segments=segments, speeds=speeds)
        shape = self.reference.shape_at(normal_force)
        self._lever = shape.contact_radius
        for name, values in zip(_BUFFERS, reduced_arrays.numbers_of(shape), strict=True):
            self.register_buffer(name, torch.as_tensor(values, **kind).clone())
        numbers = law.numbers._asdict()
        self._adopt({name: numbers[name] for name in PARAMETERS}, trainable, **kind)

    @property
    def lever(self) -> float:
        """Radius of gyration of the pressure [m]."""
        return self._lever

    def law(self) -> LuGre:
        """The law with the present values."""
        now = dict(zip(self.names, self.physical().tolist(), strict=True))
        breakaway = now.pop("breakaway_ratio")
        return LuGre(**now, gamma=self.gamma, elasto_plastic=ElastoPlastic(breakaway) if self.elasto_plastic else None)

    def prepare(self, parameters: Tensor) -> Prepared:
        """The law; the shape is fixed."""
        values = dict(zip(PARAMETERS, parameters[..., None].unbind(-2), strict=True))
        return Prepared(LawNumbers(**values, gamma=self.gamma, elasto_plastic=self.elasto_plastic), ())

    def forward(self, z: Tensor, v: Tensor, f_n: Tensor | float, *, parameters: Tensor | None = None):
        """Rates `z_dot` of the moments and wrench."""
        law = self.prepare(self._vector(parameters)).law
        z, v, load = self._inputs(z, v, f_n)
        by = self._held(law, v)
        rate = reduced_arrays.rate(xp, law, z, by)
        return rate, load[..., None] * reduced_arrays.wrench(xp, law, self._shape, z, rate, by.u)

    def advance(self, prepared: Prepared, z: Tensor, v: Tensor, load: Tensor, dt: Tensor) -> tuple[Tensor, Tensor]:
        """`step` of checked inputs."""
        by = self._held(prepared.law, v)
        new, zdot = self._next(prepared.law, z, by, dt)
        wrench = reduced_arrays.wrench(xp, prepared.law, self._shape, new, zdot, by.u)
        return self._kept(new, load), load[..., None] * wrench

    def roll_out(
        self, parameters: Tensor | None, z: Tensor, v: Tensor, load: Tensor, dt: Tensor
    ) -> tuple[Tensor, Tensor]:
        """`advance` through twists `[..., T, 3]` and loads `[..., T]`: all wrenches `[..., T, 3]` and the last state.

        Only the moments go step by step; the steady states are read, and the wrenches made, for all steps at once.
        """
        values = self._vector(parameters)
        once, steps = self.prepare(values).law, self.prepare(values[..., None, :]).law
        by = self._held(steps, v)
        along = zip(*(_steps(part, v.shape[-2]) for part in by), strict=True)
        states, rates = [], []
        for now, f_n in zip(along, load.unbind(-1), strict=True):
            new, zdot = self._next(once, z, Held(*now), dt)
            states.append(new)
            rates.append(zdot)
            z = self._kept(new, f_n)
        wrenches = reduced_arrays.wrench(xp, steps, self._shape, torch.stack(states, -2), torch.stack(rates, -2), by.u)
        return load[..., None] * wrenches, z

    @property
    def _shape(self) -> ReducedNumbers:
        return ReducedNumbers(*(getattr(self, name) for name in _BUFFERS))

    def _held(self, law, v: Tensor) -> Held:
        return reduced_arrays.held(xp, law, self._shape, v)

    def _next(self, law, z: Tensor, by: Held, dt: Tensor) -> tuple[Tensor, Tensor]:
        return reduced_arrays.advance(xp, law, z, by, dt[..., None], torch.finfo(z.dtype).eps)


_BUFFERS = ("factor", "quartic", "scale", "flat", "rest_part")


def _steps(part: Tensor | float, count: int) -> Iterable[Tensor | float]:
    """What a step holds, for each of the steps."""
    return part.unbind(-2) if isinstance(part, Tensor) else [part] * count
