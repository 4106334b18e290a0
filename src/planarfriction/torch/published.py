"""The published reduced model as a PyTorch module."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import Any

import torch
from torch import Tensor, nn

from planarfriction import models
from planarfriction.derivatives.parameters import pack_surface
from planarfriction.errors import InvalidValueError
from planarfriction.laws import FrictionLaw
from planarfriction.limit_surface import LimitSurface, surface_arrays
from planarfriction.models import published_arrays
from planarfriction.models.published_arrays import PublishedNumbers
from planarfriction.patch import ContactPatch
from planarfriction.torch import namespace as xp
from planarfriction.torch.base import TRAINABLE, Compiled, FrictionModel, Prepared
from planarfriction.torch.parameters import LAW


class Surface(nn.Module):
    """A limit surface in a buffer; `forward(scaled, speed)` gives `u = h(V) |V_S|` `[..., 3]`."""

    data: Tensor
    form: Tensor
    """Kind and size of the surface; a state dict of another form is refused."""

    def __init__(self, surface: LimitSurface, **kind) -> None:
        super().__init__()
        self.kind, self.size, data = surface.numbers
        self.register_buffer("data", torch.tensor(data, **kind))
        self.register_buffer("form", torch.tensor([self.kind, self.size], device=kind["device"]))

    def _load_from_state_dict(self, state_dict: dict[str, Any], prefix: str, *rest: Any) -> None:
        given = state_dict.get(f"{prefix}form")
        if given is not None and given.tolist() != self.form.tolist():
            rule = "hold a limit surface of the same kind and size (kind, segments or cells)"
            raise InvalidValueError("state_dict", f"{rule} as the model, {self.form.tolist()}", given.tolist())
        super()._load_from_state_dict(state_dict, prefix, *rest)

    def forward(self, scaled: Tensor, speed: Tensor) -> Tensor:
        """`u` of scaled twists `[..., 3]` and their norms `[..., 1]`."""
        return surface_arrays.sliding(xp, self.kind, self.size, self.data, scaled, speed)


class ReducedModelPublished(FrictionModel):
    """Reduced LuGre friction, differentiable: three bristles `z = (z_x, z_y, z_tau)` [m, m, m^2] and a limit surface.

    With `S = diag(1, 1, r)`, `V_S = S V`, `v_n = |V_S|`: `zdot = S h(V) v_n - beta sigma_0 v_n/g(v_n) z`, `W =
    -(sigma_0 z + sigma_1 zdot + sigma_2 U V) f_N`; the same numbers as `planarfriction.ReducedModelPublished`.

    `surface` is any limit surface (None: the published table). `trainable` names the physical parameters that are
    `nn.Parameter`s, of the law or of the shape (`contact_radius`, `second_moment`, `centre_x`, `centre_y`); the limit
    surface and all other parameters are buffers. A new contact radius scales the torque and leaves the form of the
    limit surface unchanged. The shape does not change with the load: if that of the patch does, it is fixed by the
    `normal_force` of `surface`.

    Raises InvalidValueError for a parameter that breaks its rule.

    Source: Waltersson and Karayiannidis 2024, section IV.
    """

    arrays = published_arrays
    components = (3,)
    axes = 1
    root: Tensor | None
    """Symmetric root of the friction metric `[2, 2]`, if the patch has one."""

    def __init__(
        self,
        patch: ContactPatch,
        law: FrictionLaw,
        surface: LimitSurface | None = None,
        *,
        trainable: Iterable[str] = TRAINABLE,
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ):
        super().__init__(patch, law)
        when = "keep" if surface is not None else "rebuild"
        shape = models.ReducedModelPublished(patch, law, surface, on_load_change=when).shapes.reference  # pyright: ignore
        kind = {"dtype": dtype or torch.get_default_dtype(), "device": device}
        self.surface = Surface(shape.surface, **kind)
        self.register_buffer("root", None if patch.root is None else torch.tensor(shape.root, **kind))
        x, y = shape.centre_of_pressure.tolist()
        numbers = law.numbers._asdict()
        values = {name: numbers[name] for name in LAW}
        values |= {"contact_radius": shape.contact_radius, "second_moment": shape.second_moment}
        self._adopt(values | {"centre_x": x, "centre_y": y}, trainable, shape.contact_radius, **kind)

    def compiled(self) -> Compiled:
        """See `FrictionModel`."""
        pack = functools.partial(pack_surface, self.elasto_plastic, self.surface.kind, self.surface.size)
        return Compiled(pack, (self.surface.data,) if self.root is None else (self.surface.data, self.root), 1)

    def prepare(self, parameters: Tensor) -> tuple[Prepared]:
        """Prepare the law, `r`, `<rho^2>`, the centre of pressure, and the limit surface for a roll-out."""
        radius, second_moment, x, y = parameters[..., len(LAW) :].split(1, -1)
        shape = PublishedNumbers(radius, second_moment, x, y, self.surface, self.root)
        return (Prepared(self._law(parameters), shape),)
