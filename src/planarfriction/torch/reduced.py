"""The reduced model of bristle moments as a PyTorch module."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import Any

import torch
from torch import Tensor

from planarfriction import models
from planarfriction.autodiff.parameters import pack_map
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.laws import ElastoPlastic, FrictionLaw, LuGre
from planarfriction.models import reduced_arrays
from planarfriction.models.reduced_arrays import ReducedNumbers
from planarfriction.patch import ContactPatch
from planarfriction.torch.base import Compiled, FrictionModel, Prepared
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

    arrays = reduced_arrays
    components = (3,)
    factor: Tensor
    """F `[3, 3]`."""
    map: Tensor
    """Steady sliding, flat; in single precision, as compiled roll-outs read it."""
    gamma: Tensor
    """Stribeck exponent that the map is made for [-]."""

    def __init__(
        self,
        patch: ContactPatch,
        law: FrictionLaw,
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
        shape = models.ReducedModel(patch, law, segments=segments, speeds=speeds, load_error=0.0).shape_at(normal_force)
        self.sizes = reduced_arrays.sizes_of(shape.data)
        self.register_buffer("factor", torch.tensor(shape.factor, **kind))
        self.register_buffer("map", torch.tensor(shape.data, device=device))
        numbers = law.numbers._asdict()
        self.register_buffer("gamma", torch.tensor(numbers["gamma"], **kind))
        self._adopt({name: numbers[name] for name in PARAMETERS}, trainable, shape.contact_radius, **kind)

    def _load_from_state_dict(self, state_dict: dict[str, Any], prefix: str, *rest: Any) -> None:
        given = state_dict.get(f"{prefix}map")
        if given is not None and (other := reduced_arrays.sizes_of(given)) != self.sizes:
            rule = f"hold a map of the same size as the model (faces, segments, ...), {tuple(self.sizes)}"
            raise InvalidValueError("state_dict", rule, tuple(other))
        super()._load_from_state_dict(state_dict, prefix, *rest)

    def law(self) -> LuGre:
        """The law with the present values."""
        now = dict(zip(self.names, self.physical().tolist(), strict=True))
        elastic = ElastoPlastic(now.pop("breakaway_ratio"))
        return LuGre(**now, gamma=float(self.gamma), elasto_plastic=elastic if self.elasto_plastic else None)

    def compiled(self) -> Compiled:
        """See `FrictionModel`."""
        return Compiled(functools.partial(pack_map, self.elasto_plastic), (self.factor, self.map))

    def prepare(self, parameters: Tensor) -> Prepared:
        """The law; the shape is fixed."""
        values = dict(zip(PARAMETERS, parameters[..., None].unbind(-2), strict=True))
        return Prepared(LawNumbers(**values, gamma=self.gamma, elasto_plastic=self.elasto_plastic), self._shape)

    @property
    def _shape(self) -> ReducedNumbers:
        return reduced_arrays.numbers_of(self.factor, self.map, self.sizes)
