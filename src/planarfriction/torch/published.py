"""The published reduced model as a PyTorch module."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from typing import Any

import torch
from torch import Tensor, nn

from planarfriction.derivatives.parameters import PARAMETERS, pack_surface
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.laws import FrictionLaw
from planarfriction.limit_surface import LimitSurface
from planarfriction.patch import ContactPatch
from planarfriction.tensors import published
from planarfriction.tensors.steps import Part
from planarfriction.torch.base import TRAINABLE, Compiled, FrictionModule
from planarfriction.torch.namespace import xp


class SurfaceBuffers(nn.Module):
    """The numbers of a limit surface in buffers (see `planarfriction.kernels.surfaces`)."""

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


class ReducedModelPublished(FrictionModule):
    """Reduced LuGre friction, differentiable: three bristles `z = (z_x, z_y, z_tau)` [m, m, m^2] and a limit surface.

    With `S = diag(1, 1, r)`, `V_S = S V`, `v_n = |V_S|`: `zdot = S h(V) v_n - beta sigma_0 v_n/g(v_n) z`, `W =
    -(sigma_0 z + sigma_1 zdot + sigma_2 U V) f_N`; the same numbers as `planarfriction.ReducedModelPublished`.

    `surface` is any limit surface (None: the published table). `trainable` names the physical parameters that are
    `nn.Parameter`s, of the law or of the shape (`contact_radius`, `second_moment`, `centre_x`, `centre_y`); the limit
    surface and all other parameters are buffers. A new contact radius scales the torque and leaves the form of the
    limit surface unchanged. A shape that depends on the load is that of the `normal_force` of `surface`.

    Raises InvalidValueError for a parameter that breaks its rule.

    Source: Waltersson and Karayiannidis 2024, section IV.
    """

    equations = published
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
        shape = published.shape_of(patch, law, surface)
        kind = {"dtype": dtype or torch.get_default_dtype(), "device": device}
        self.surface = SurfaceBuffers(shape.surface, **kind)
        self.register_buffer("root", None if patch.root is None else torch.tensor(shape.root, **kind))
        values = published.values_of(law, shape)
        self._adopt({name: values[name] for name in PARAMETERS}, trainable, shape.contact_radius, **kind)

    def compiled(self) -> Compiled:
        """Return the model as compiled rollouts take it."""
        pack = functools.partial(pack_surface, self.elasto_plastic, self.surface.kind, self.surface.size)
        return Compiled(pack, (self.surface.data,) if self.root is None else (self.surface.data, self.root))

    def _parts(self, law: LawNumbers, values: Mapping[str, Tensor]) -> tuple[Part]:
        return (Part(law, published.numbers_of(xp, values, self.surface, self.root)),)
