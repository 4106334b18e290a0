"""The reduced model of bristle moments as a PyTorch module."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import Any

import numpy as np
import torch
from torch import Tensor

from planarfriction import models
from planarfriction.derivatives.parameters import pack_maps
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.laws import ElastoPlastic, FrictionLaw, LuGre
from planarfriction.models import reduced_arrays
from planarfriction.models.reduced_map import slip_factor
from planarfriction.patch import ContactPatch
from planarfriction.torch.base import Compiled, FrictionModel, Prepared
from planarfriction.torch.parameters import LAW

PARAMETERS = tuple(name for name in LAW if name != "gamma")
"""Physical parameters, in the order of their vector: the law but gamma, for which the map is made."""


class ReducedModel(FrictionModel):
    """Reduced LuGre friction of bristle moments, differentiable: three states `(z_x, z_y, z_theta)` [m] per part.

    The equations and the numbers of `planarfriction.ReducedModel`; with several parts the state has shape `[..., P,
    3]`. The patch, with its maps of steady sliding, is stored in buffers. `trainable` names the parameters of the law
    that are `nn.Parameter`s; `gamma` cannot be one, because the maps depend on it. If the shape of the patch depends on
    the load, the shape at `normal_force` [N] is kept; `parts`, `segments` and `speeds` as in
    `planarfriction.ReducedModel`.

    Raises InvalidValueError if `trainable` names gamma, or something that is not a parameter of the law.
    """

    arrays = reduced_arrays
    axes = 1
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
        parts: int | str = 1,
        segments: int = 24,
        speeds: int = 16,
        trainable: Iterable[str] = PARAMETERS[:-1],
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ):
        super().__init__(patch, law)
        trainable = tuple(trainable)
        if "gamma" in trainable:
            raise InvalidValueError(
                "trainable", "not contain gamma: the map of steady sliding depends on it", trainable
            )
        kind = {"dtype": dtype or torch.get_default_dtype(), "device": device}
        model = models.ReducedModel(patch, law, parts=parts, segments=segments, speeds=speeds, load_error=0.0)
        shares, shapes = zip(*model.parts_at(normal_force), strict=True)
        self.components, self.sizes = model.state_shape, tuple(reduced_arrays.sizes_of(shape.data) for shape in shapes)
        self.register_buffer("share", torch.tensor(shares, **kind))
        self.register_buffer("factor", torch.tensor(np.stack([shape.factor for shape in shapes]), **kind))
        self.register_buffer("map", torch.tensor(np.concatenate([shape.data for shape in shapes]), device=device))
        numbers = law.numbers._asdict()
        self.register_buffer("gamma", torch.tensor(numbers["gamma"], **kind))
        lever = float(slip_factor(patch, normal_force)[2, 2])
        self._adopt({name: numbers[name] for name in PARAMETERS}, trainable, lever, **kind)

    def _load_from_state_dict(self, state_dict: dict[str, Any], prefix: str, *rest: Any) -> None:
        shares, maps = (state_dict.get(f"{prefix}{name}") for name in ("share", "map"))
        if shares is not None and len(shares) != len(self.sizes):
            raise InvalidValueError("state_dict", f"hold as many parts as the model, {len(self.sizes)}", len(shares))
        if maps is not None:
            for start, own in zip(reduced_arrays.starts_of(self.sizes), self.sizes, strict=True):
                if (other := reduced_arrays.sizes_of(maps[start:])) != own:
                    rule = f"hold maps of the same sizes as the model (faces, segments, ...), {tuple(own)}"
                    raise InvalidValueError("state_dict", rule, tuple(other))
        super()._load_from_state_dict(state_dict, prefix, *rest)

    def law(self) -> LuGre:
        """The law with the current values."""
        now = dict(zip(self.names, self.physical().tolist(), strict=True))
        elastic = ElastoPlastic(now.pop("breakaway_ratio"))
        return LuGre(**now, gamma=float(self.gamma), elasto_plastic=elastic if self.elasto_plastic else None)

    def compiled(self) -> Compiled:
        """See `FrictionModel`."""
        pack = functools.partial(pack_maps, self.elasto_plastic, self.sizes)
        return Compiled(pack, (self.share, self.factor, self.map), len(self.components))

    def prepare(self, parameters: Tensor) -> tuple[Prepared, ...]:
        """Prepare the law and the parts for a roll-out; their shapes are fixed."""
        values = dict(zip(PARAMETERS, parameters[..., None].unbind(-2), strict=True))
        law = LawNumbers(**values, gamma=self.gamma, elasto_plastic=self.elasto_plastic)
        shapes = reduced_arrays.parts_of(self.factor, self.map, self.sizes)
        return tuple(Prepared(law, shape, self.share[k]) for k, shape in enumerate(shapes))
