"""What the tensor models share: parameters, checks, and the shapes of inputs."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from types import ModuleType
from typing import Any, ClassVar, NamedTuple

import torch
from torch import Tensor, nn

from planarfriction import validation
from planarfriction.derivatives.parameters import Packed
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.laws import ElastoPlastic, FrictionLaw, LuGre
from planarfriction.laws.base import refuse_creep
from planarfriction.patch import ContactPatch
from planarfriction.torch import inputs
from planarfriction.torch import namespace as xp
from planarfriction.torch.parameters import LAW, PhysicalParameters

TRAINABLE = LAW[:-1]
"""Trainable unless the caller chooses: the law without the breakaway ratio."""


class Prepared(NamedTuple):
    """The numbers of a part of a model, ready for one evaluation or for all steps of a roll-out."""

    law: LawNumbers
    """Broadcasts with the lengths of bristles."""
    shape: Any
    """Numbers of the patch as the model's arrays know them."""
    share: Any = 1.0
    """Of the load; most models have one part, which carries all of it."""


class Compiled(NamedTuple):
    """A model as compiled roll-outs take it."""

    pack: Callable[..., tuple[Packed, ...]]
    """Its parts from the `buffers` as arrays of NumPy."""
    buffers: tuple[Tensor, ...]
    """Its own numbers of the patch."""
    axes: int
    """Axes of a state: a model of several parts has two."""


_KIND = {False: "plain", True: "elasto-plastic"}


class FrictionModel(nn.Module):
    """A friction model of PyTorch: the caller holds the state; everything is about the contact frame's origin.

    `twist` `[..., 3]` is `(vx, vy, omega)` of the moving body, the wrench `(fx, fy, tau)` acts on it, `normal_force`
    `[...]` is >= 0; leading batch axes broadcast. `parameters` `[..., P]`, in the order of `names`, takes the place
    of the model's own physical values, one row for each contact if wanted.

    Raises `InvalidValueError` for what is no number, for wrong shapes and for values that are not finite or, of loads
    and steps, below zero, where values can be looked at without a wait. On a device, in `torch.compile` and `vmap` a
    load below zero counts as none (friction never drives), and so does a `dt` below zero; NaN stays NaN.
    """

    arrays: ModuleType
    """The model as `f(xp, ...)`: `held`, `rate`, `advance` and `wrench` of arrays."""
    components: tuple[int, ...]
    """Shape of the state of one contact."""
    axes: int
    """Axes of the state of a part."""
    physical: PhysicalParameters
    physical_type: ClassVar[type[PhysicalParameters]] = PhysicalParameters
    bristles: Tensor
    """1 where they are elasto-plastic, else 0; a state dict of the other kind is refused."""
    lever: Tensor
    """Lever arm [m]: torques are to forces as it is to 1."""

    def __init__(self, patch: ContactPatch, law: FrictionLaw) -> None:
        super().__init__()
        validation.instance("patch", patch, ContactPatch, "a ContactPatch")
        refuse_creep(law, f"torch.{type(self).__name__}")
        self.patch = patch
        self.elasto_plastic = bool(law.numbers.elasto_plastic)

    def _adopt(self, values: dict[str, float], trainable: Iterable[str], lever: float, **kind: Any) -> None:
        """The physical parameters, and what else a state dict holds of every model."""
        trainable = tuple(trainable)
        if "breakaway_ratio" in trainable and not self.elasto_plastic:
            raise InvalidValueError("trainable", "not contain breakaway_ratio for plain bristles", trainable)
        self.physical = self.physical_type(values, trainable, **kind)
        self.register_buffer("bristles", torch.tensor(self.elasto_plastic, device=kind["device"]))
        self.register_buffer("lever", torch.tensor(lever, **kind))

    def _load_from_state_dict(self, state_dict: dict[str, Any], prefix: str, *rest: Any) -> None:
        given = state_dict.get(f"{prefix}bristles")
        if given is not None and bool(given) != self.elasto_plastic:
            own, other = (_KIND[kind] for kind in (self.elasto_plastic, bool(given)))
            raise InvalidValueError("state_dict", f"be that of {own} bristles", other)
        super()._load_from_state_dict(state_dict, prefix, *rest)

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

    def forward(
        self, state: Tensor, twist: Tensor, normal_force: Tensor | float, *, parameters: Tensor | None = None
    ) -> tuple[Tensor, Tensor]:
        """Rate of the state, and wrench."""
        return self._evaluated(state, twist, normal_force, parameters)

    def rate(
        self, state: Tensor, twist: Tensor, normal_force: Tensor | float, *, parameters: Tensor | None = None
    ) -> Tensor:
        """Rate of the state, of its shape."""
        return self._evaluated(state, twist, normal_force, parameters)[0]

    def wrench(
        self, state: Tensor, twist: Tensor, normal_force: Tensor | float, *, parameters: Tensor | None = None
    ) -> Tensor:
        """Friction wrench on the moving body `[..., 3]` [N, N, N m]."""
        return self._evaluated(state, twist, normal_force, parameters)[1]

    def step(
        self,
        state: Tensor,
        twist: Tensor,
        normal_force: Tensor | float,
        dt: Tensor | float,
        *,
        parameters: Tensor | None = None,
    ) -> tuple[Tensor, Tensor]:
        """State after `dt` [s] of a held twist, and the wrench at the end; a contact without load forgets."""
        parts = self.prepare(self._vector(parameters))
        z, v, load = self._inputs(state, twist, normal_force)
        dt = self._inner(inputs.non_negative("dt", self._number("dt", dt)))
        kind = functools.reduce(torch.promote_types, (each.dtype for each in (parts[0].law.sigma_0, z, v)))
        z, v = _wide(z), _wide(v)

        def step(part: Prepared, z: Tensor) -> tuple[Tensor, Tensor]:
            by = self.arrays.held(xp, part.law, part.shape, v)
            new, zdot = self.arrays.advance(xp, part.law, part.shape, z, by, dt)
            return self._kept(new, load), self.arrays.wrench(xp, part.law, part.shape, new, zdot, by)

        new, unit = self._summed(parts, z, step)
        return new.to(kind), (load[..., None] * unit).to(kind)

    def compiled(self) -> Compiled | None:
        """What compiled roll-outs need of the model, if they know it."""
        return None

    def prepare(self, parameters: Tensor) -> tuple[Prepared, ...]:
        """The numbers of the parts of the model at given physical parameters `[..., P]`."""
        raise NotImplementedError

    def roll_out(
        self, parameters: Tensor | None, z: Tensor, v: Tensor, load: Tensor, dt: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Steps through twists `[..., T, 3]` and loads `[..., T]`: the last state and all wrenches `[..., T, 3]`.

        Only the bristles go step by step; what drives them and what they cause is worked out for all steps at once.
        """
        values, dt = self._vector(parameters), self._inner(dt)
        parts = self.prepare(values[..., None, :])
        once = dict(zip(map(id, parts), self.prepare(values), strict=True))
        kind = functools.reduce(torch.promote_types, (each.dtype for each in (values, z, v)))
        z, v = _wide(z), _wide(v)

        def roll(part: Prepared, z: Tensor) -> tuple[Tensor, Tensor]:
            law, shape, _ = once[id(part)]
            by = self.arrays.held(xp, part.law, part.shape, v)
            drives = zip(*(_along(each, v.shape[-2], self.axes) for each in by), strict=True)
            states, rates = [], []
            for drive, now in zip(drives, load.unbind(-1), strict=True):
                new, zdot = self.arrays.advance(xp, law, shape, z, type(by)(*drive), dt)
                states.append(new)
                rates.append(zdot)
                z = self._kept(new, now)
            states, rates = torch.stack(states, -self.axes - 1), torch.stack(rates, -self.axes - 1)
            return z, self.arrays.wrench(xp, part.law, part.shape, states, rates, by)

        end, unit = self._summed(parts, z, roll)
        return end.to(kind), (load[..., None] * unit).to(kind)

    def _evaluated(self, state, twist, normal_force, parameters) -> tuple[Tensor, Tensor]:
        """Rate and wrench."""
        parts = self.prepare(self._vector(parameters))
        z, v, load = self._inputs(state, twist, normal_force)

        def evaluate(part: Prepared, z: Tensor) -> tuple[Tensor, Tensor]:
            by = self.arrays.held(xp, part.law, part.shape, v)
            rate = self.arrays.rate(xp, part.law, part.shape, z, by)
            return rate, self.arrays.wrench(xp, part.law, part.shape, z, rate, by)

        rate, unit = self._summed(parts, z, evaluate)
        return rate, load[..., None] * unit

    def _summed(self, parts: tuple[Prepared, ...], z: Tensor, run: Callable[..., Any]) -> tuple[Tensor, Tensor]:
        """What `run` makes of the parts and their states, side by side, and the sum of the wrenches that it gives."""
        if len(parts) == 1:
            return run(parts[0], z)
        found = [run(part, each) for part, each in zip(parts, z.unbind(-2), strict=True)]
        wrenches = [part.share * wrench for part, (_, wrench) in zip(parts, found, strict=True)]
        return torch.stack([each for each, _ in found], -2), torch.stack(wrenches).sum(0)

    def _kept(self, z: Tensor, load: Tensor) -> Tensor:
        """Bristles that a contact keeps: one without load forgets them."""
        return torch.where(self._inner(load > 0.0), z, 0.0)

    def _inner(self, value: Tensor) -> Tensor:
        """One value for each contact beside the components of the state of a part."""
        return value.reshape(value.shape + (1,) * self.axes)

    # ------------------------------------------------------------------ inputs

    def _number(self, name: str, value: Any) -> Tensor:
        return inputs.real(name, value, self.physical.values)

    def _inputs(self, state, twist, normal_force) -> tuple[Tensor, Tensor, Tensor]:
        z, v = self._number("state", state), self._number("twist", twist)
        load = self._number("normal_force", normal_force)
        if z.shape[max(z.ndim - len(self.components), 0) :] != self.components:
            wanted = ", ".join(map(str, self.components))
            raise InvalidValueError("state", f"have shape [..., {wanted}]", f"shape {list(z.shape)}")
        if v.shape[-1:] != (3,):
            raise InvalidValueError("twist", "have shape [..., 3]", f"shape {list(v.shape)}")
        batches = z.shape[: z.ndim - len(self.components)], v.shape[:-1], load.shape
        try:
            torch.broadcast_shapes(*batches)
        except RuntimeError:
            shapes = ", ".join(str(list(shape)) for shape in batches)
            raise InvalidValueError("batch axes", "broadcast", f"shapes {shapes}") from None
        load = inputs.non_negative("normal_force", load)
        return inputs.finite("state", z), inputs.finite("twist", v), load

    def _vector(self, parameters: Tensor | None) -> Tensor:
        if parameters is None:
            return self.physical()
        if parameters.shape[-1:] != (len(self.names),):
            rule = f"have shape [..., {len(self.names)}] ({', '.join(self.names)})"
            raise InvalidValueError("parameters", rule, f"shape {list(parameters.shape)}")
        return parameters

    def _law(self, parameters: Tensor) -> LawNumbers:
        """The law's parameters, broadcasting with norms of bristles."""
        trailing = (1,) * self.axes
        values = [value.reshape(value.shape + trailing) for value in parameters[..., : len(LAW)].unbind(-1)]
        return LawNumbers(**dict(zip(LAW, values, strict=True)), elasto_plastic=self.elasto_plastic)


def _wide(value: Tensor) -> Tensor:
    """Numbers of a step in double precision, and with them all that follows, where the device has it.

    In steady sliding the rate of a bristle is the difference of two large numbers; sigma_1 times its rounding in single
    precision would be 1e-4 of the load at 1 m/s.
    """
    return value if value.device.type == "mps" else value.double()


def _along(part: Any, steps: int, inner: int) -> Iterable[Any]:
    """What a step holds, for each of the steps; a plain number is the same for all."""
    return part.unbind(part.ndim - inner - 1) if isinstance(part, Tensor) else [part] * steps
