"""The reduced model of bristle moments as a PyTorch module."""

from __future__ import annotations

from collections.abc import Iterable

import torch
from torch import Tensor

from planarfriction import models
from planarfriction.autodiff.parameters import pack_shape
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.laws import ElastoPlastic, FrictionLaw, LuGre
from planarfriction.models import reduced_arrays
from planarfriction.models.reduced_arrays import ReducedNumbers
from planarfriction.patch import ContactPatch
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

    arrays = reduced_arrays
    components = (3,)
    reference: models.ReducedModel
    factor: Tensor
    quartic: Tensor
    scale: Tensor
    flat: Tensor
    rest_part: Tensor

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
        self.gamma = law.numbers.gamma
        self.reference = models.ReducedModel(patch, law, segments=segments, speeds=speeds, load_error=0.0)
        shape = self.reference.shape_at(normal_force)
        self.compiled = pack_shape(law.numbers, shape)
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
        return Prepared(LawNumbers(**values, gamma=self.gamma, elasto_plastic=self.elasto_plastic), self._shape)

    @property
    def _shape(self) -> ReducedNumbers:
        return ReducedNumbers(*(getattr(self, name) for name in _BUFFERS))


_BUFFERS = ("factor", "quartic", "scale", "flat", "rest_part")
