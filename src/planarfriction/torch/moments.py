"""The moments of bristles in the parts of a patch as a PyTorch module."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from typing import Any

import torch
from torch import Tensor

from planarfriction.derivatives.parameters import pack_maps
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.laws import FrictionLaw
from planarfriction.models.map_sizes import maps_of, sizes_of
from planarfriction.models.reduced_map import slip_factor
from planarfriction.patch import ContactPatch
from planarfriction.tensors import reduced
from planarfriction.tensors.steps import Part
from planarfriction.torch.base import Compiled
from planarfriction.torch.reduced import ReducedModel


class MomentModel(ReducedModel):
    """Reduced LuGre friction of bristle moments, differentiable: three states `(z_x, z_y, z_theta)` [m] per part.

    The equations and the numbers of `planarfriction.ReducedModel` in parts; the state of several has shape `[..., P,
    3]`. The patch, with its maps of steady sliding, is stored in buffers. `trainable` names the parameters of the law
    that are `nn.Parameter`s; `gamma` cannot be one, because the maps depend on it. A shape that depends on the load is
    that at `normal_force` [N]; `parts`, `segments` and `speeds` as there.

    Raises InvalidValueError if `trainable` names gamma, or something that is not a parameter of the law.
    """

    equations = reduced
    share: Tensor
    """Share of the load that each part carries, `[P]`."""
    factor: Tensor
    """F of each part, `[P, 3, 3]`."""
    map: Tensor
    """Steady sliding of all parts, one after the other; in single precision, as compiled roll-outs read it."""
    gamma: Tensor
    """Stribeck exponent for which the maps were made [-]."""

    def __init__(
        self,
        patch: ContactPatch,
        law: FrictionLaw,
        normal_force: float | None = None,
        *,
        cells: int = 56,
        parts: int | str = 1,
        segments: int = 24,
        speeds: int = 16,
        trainable: Iterable[str] = reduced.PARAMETERS[:-1],
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ):
        super().__init__(patch, law)
        trainable = tuple(trainable)
        if "gamma" in trainable:
            rule = "not contain gamma: the map of steady sliding depends on it"
            raise InvalidValueError("trainable", rule, trainable)
        kind = {"dtype": dtype or torch.get_default_dtype(), "device": device}
        found = reduced.parts_of(patch, law, normal_force, parts=parts, segments=segments, speeds=speeds)
        self.sizes = found.sizes
        self.register_buffer("share", torch.tensor(found.share, **kind))
        self.register_buffer("factor", torch.tensor(found.factor, **kind))
        self.register_buffer("map", torch.tensor(found.map, device=device))
        numbers = law.numbers._asdict()
        self.register_buffer("gamma", torch.tensor(numbers["gamma"], **kind))
        lever = float(slip_factor(patch, normal_force)[2, 2])
        self._adopt({name: numbers[name] for name in reduced.PARAMETERS}, trainable, lever, **kind)

    def _load_from_state_dict(self, state_dict: dict[str, Any], prefix: str, *rest: Any) -> None:
        shares, maps = (state_dict.get(f"{prefix}{name}") for name in ("share", "map"))
        if shares is not None and len(shares) != len(self.sizes):
            raise InvalidValueError("state_dict", f"hold as many parts as the model, {len(self.sizes)}", len(shares))
        if maps is not None:
            for one, own in zip(maps_of(maps, self.sizes), self.sizes, strict=True):
                if (other := sizes_of(one)) != own:
                    rule = f"hold maps of the same sizes as the model (faces, segments, ...), {tuple(own)}"
                    raise InvalidValueError("state_dict", rule, tuple(other))
        super()._load_from_state_dict(state_dict, prefix, *rest)

    @property
    def state_shape(self) -> tuple[int, ...]:
        """Shape of the state of one contact, `(3,)`, of P parts `(P, 3)`."""
        return (3,) if len(self.sizes) == 1 else (len(self.sizes), 3)

    def compiled(self) -> Compiled:
        """Return the model as compiled rollouts take it."""
        pack = functools.partial(pack_maps, self.elasto_plastic, self.sizes)
        return Compiled(pack, (self.share, self.factor, self.map))

    def _law_values(self) -> dict[str, float]:
        return super()._law_values() | {"gamma": float(self.gamma)}

    def _parts(self, law: LawNumbers, values: Mapping[str, Tensor]) -> tuple[Part, ...]:
        return tuple(Part(law, shape, self.share[k]) for k, shape in enumerate(reduced.numbers_of(self)))
