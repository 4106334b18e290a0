"""What the tensor models share: parameters, checks, and the shapes of inputs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn

from planarfriction import models, validation
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.laws import ElastoPlastic, FrictionLaw, LuGre
from planarfriction.laws.base import refuse_creep
from planarfriction.patch import ContactPatch
from planarfriction.patch.metric import refuse_anisotropy
from planarfriction.torch import bristle
from planarfriction.torch.parameters import LAW, PhysicalParameters

TRAINABLE = LAW[:-1]
"""Trainable unless the caller chooses: the law without the breakaway ratio."""


class Prepared(NamedTuple):
    """A model's numbers, ready for one evaluation or for all steps of a roll-out."""

    law: Any
    """A record of the law's parameters, `Law` for bristles."""
    shape: tuple[Tensor, ...]
    """Of the patch; the model knows what they are."""


class FrictionModel(nn.Module):
    """A friction model of PyTorch: the caller holds the state `z`; everything is about the contact frame's origin.

    Twists `v` `[..., 3]` are `(vx, vy, omega)` of the moving body, wrenches `(fx, fy, tau)` act on it, loads `f_n`
    `[...]` are >= 0; leading batch axes broadcast. `parameters` `[..., P]`, in the order of `names`, takes the place
    of the model's own physical values, one row for each contact if wanted.
    """

    components: tuple[int, ...]
    """Shape of the state of one contact."""
    axis: int
    """Axis of the components of a bristle."""
    physical: PhysicalParameters
    reference: models.FrictionModel
    """The same model in NumPy, with the parameters that this one started with."""

    def __init__(self, patch: ContactPatch, law: FrictionLaw) -> None:
        super().__init__()
        if not isinstance(patch, ContactPatch):
            raise InvalidValueError("patch", "be a ContactPatch", patch)
        refuse_creep(law, f"torch.{type(self).__name__}")
        refuse_anisotropy(patch, type(self).__name__)
        self.patch = patch
        self.elasto_plastic = law.numbers.elasto_plastic

    def _adopt(self, values: dict[str, float], trainable: Iterable[str], **kind: Any) -> None:
        trainable = tuple(trainable)
        if "breakaway_ratio" in trainable and not self.elasto_plastic:
            raise InvalidValueError("trainable", "not name breakaway_ratio for plain bristles", trainable)
        self.physical = PhysicalParameters(values, trainable, **kind)

    # ------------------------------------------------------------------ parameters

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the physical parameters, in the order of their vector."""
        return self.physical.names

    def value(self, name: str) -> Tensor:
        """A physical value, with its gradient."""
        validation.choice("parameter", name, self.names)
        return self.physical()[self.names.index(name)]

    def set(self, **values: float) -> None:
        """Set physical values by name, trainable or not."""
        self.physical.set({name: validation.number(name, value) for name, value in values.items()})

    def law(self) -> LuGre:
        """The law with the present values."""
        now = dict(zip(self.names, self.physical().tolist(), strict=True))
        breakaway = now.pop("breakaway_ratio")
        law = {name: now[name] for name in LAW[:-1]}
        return LuGre(**law, elasto_plastic=ElastoPlastic(breakaway) if self.elasto_plastic else None)

    # ------------------------------------------------------------------ evaluation

    def rest(self, *batch: int) -> Tensor:
        """State of contacts at rest, `[*batch, ...]`."""
        return self.physical.values.new_zeros((*batch, *self.components))

    def forward(self, z: Tensor, v: Tensor, f_n: Tensor | float, *, parameters: Tensor | None = None):
        """Bristle rates `z_dot` and wrench."""
        prepared = self.prepare(self._vector(parameters))
        z, v, load = self._inputs(z, v, f_n)
        by, velocity = self._drive(prepared, v)
        rate = self._raw(prepared, bristle.rate(prepared.law, self._scaled(prepared, z), by, self.axis))
        return rate, load[..., None] * self._wrench(prepared, z, rate, velocity)

    def step(
        self, z: Tensor, v: Tensor, f_n: Tensor | float, dt: Tensor | float, *, parameters: Tensor | None = None
    ) -> tuple[Tensor, Tensor]:
        """Bristles after `dt` [s] of a held twist, and the wrench at the end; a contact without load forgets."""
        prepared = self.prepare(self._vector(parameters))
        z, v, load = self._inputs(z, v, f_n)
        return self.advance(prepared, z, v, load, self._number(dt))

    @property
    def lever(self) -> float:
        """Contact radius of the patch [m]: torques are to forces as it is to 1."""
        raise NotImplementedError

    def prepare(self, parameters: Tensor) -> Prepared:
        """The numbers of the model at given physical parameters `[..., P]`."""
        raise NotImplementedError

    def advance(self, prepared: Prepared, z: Tensor, v: Tensor, load: Tensor, dt: Tensor) -> tuple[Tensor, Tensor]:
        """`step` of checked inputs."""
        by, velocity = self._drive(prepared, v)
        new, zdot = self._advance(prepared, z, by, dt)
        return self._kept(new, load), load[..., None] * self._wrench(prepared, new, zdot, velocity)

    def roll_out(
        self, parameters: Tensor | None, z: Tensor, v: Tensor, load: Tensor, dt: Tensor
    ) -> tuple[Tensor, Tensor]:
        """`advance` through twists `[..., T, 3]` and loads `[..., T]`: all wrenches `[..., T, 3]` and the last state.

        Only the bristles go step by step; what drives them and what they cause is worked out for all steps at once.
        """
        values = self._vector(parameters)
        once, steps = self.prepare(values), self.prepare(values[..., None, :])
        by, velocity = self._drive(steps, v)
        inner = len(self.components)
        drives = zip(*(part.unbind(part.ndim - inner - 1) for part in by), strict=True)
        states, rates = [], []
        for drive, f_n in zip(drives, load.unbind(-1), strict=True):
            new, zdot = self._advance(once, z, bristle.Drive(*drive), dt)
            states.append(new)
            rates.append(zdot)
            z = self._kept(new, f_n)
        along = -inner - 1
        wrenches = self._wrench(steps, torch.stack(states, along), torch.stack(rates, along), velocity)
        return load[..., None] * wrenches, z

    def _advance(self, prepared: Prepared, z: Tensor, by: bristle.Drive, dt: Tensor) -> tuple[Tensor, Tensor]:
        """Bristles and their rates after a step."""
        dt = dt.reshape(dt.shape + (1,) * len(self.components))
        new, zdot = bristle.step(prepared.law, self._scaled(prepared, z), by, dt, self.axis)
        return self._raw(prepared, new), self._raw(prepared, zdot)

    def _kept(self, z: Tensor, load: Tensor) -> Tensor:
        """Bristles that a contact keeps: one without load forgets them."""
        return torch.where((load > 0.0).reshape(load.shape + (1,) * len(self.components)), z, 0.0)

    def _drive(self, prepared: Prepared, v: Tensor) -> tuple[bristle.Drive, Tensor]:
        """What drives the bristles, and the velocity that viscous friction sees."""
        raise NotImplementedError

    def _wrench(self, prepared: Prepared, z: Tensor, zdot: Tensor, velocity: Tensor) -> Tensor:
        """Wrench about the origin, per unit load."""
        raise NotImplementedError

    def _scaled(self, prepared: Prepared, z: Tensor) -> Tensor:
        """Bristles in the coordinates that the equation of a bristle holds in."""
        return z

    def _raw(self, prepared: Prepared, z: Tensor) -> Tensor:
        """Inverse of `_scaled`."""
        return z

    # ------------------------------------------------------------------ inputs

    def _number(self, value: Tensor | float) -> Tensor:
        values = self.physical.values
        return value if isinstance(value, Tensor) else torch.as_tensor(value, dtype=values.dtype, device=values.device)

    def _inputs(self, z, v, f_n) -> tuple[Tensor, Tensor, Tensor]:
        z, v, load = self._number(z), self._number(v), self._number(f_n)
        if z.shape[z.ndim - len(self.components) :] != self.components:
            wanted = ", ".join(map(str, self.components))
            raise InvalidValueError("z", f"have shape [..., {wanted}]", f"shape {list(z.shape)}")
        if v.shape[-1:] != (3,):
            raise InvalidValueError("v", "have shape [..., 3]", f"shape {list(v.shape)}")
        return z, v, load

    def _vector(self, parameters: Tensor | None) -> Tensor:
        if parameters is None:
            return self.physical()
        if parameters.shape[-1:] != (len(self.names),):
            rule = f"have shape [..., {len(self.names)}] ({', '.join(self.names)})"
            raise InvalidValueError("parameters", rule, f"shape {list(parameters.shape)}")
        return parameters

    def _law(self, parameters: Tensor) -> LawNumbers:
        """The law's parameters, broadcasting with norms of bristles."""
        trailing = (1,) * len(self.components)
        values = [value.reshape(value.shape + trailing) for value in parameters[..., : len(LAW)].unbind(-1)]
        return LawNumbers(**dict(zip(LAW, values, strict=True)), elasto_plastic=self.elasto_plastic)
