"""The friction models as PyTorch modules."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import Any

import torch
from torch import Tensor, nn

from planarfriction.derivatives.parameters import PARAMETERS, pack_cells, pack_surface
from planarfriction.errors import InvalidValueError
from planarfriction.laws import FrictionLaw
from planarfriction.limit_surface import LimitSurface
from planarfriction.models import ReducedModel as Reference
from planarfriction.pads import Pad
from planarfriction.patch import ContactPatch
from planarfriction.tensors import distributed, published
from planarfriction.tensors.models import CellsModel, PublishedModel, reference_of
from planarfriction.tensors.steps import LAW
from planarfriction.torch.base import TRAINABLE, FrictionModule


class DistributedModel(FrictionModule, CellsModel):
    """Distributed LuGre friction, differentiable: a bristle `z_i` [m] in every cell, state `[2, N]`; for small patches.

    `zdot_i = v_i - beta sigma_0 |v_i|/g z_i`, `W = sum w_i f_N [t_i ; rho_i x t_i]`, `t_i = -(sigma_0 z_i + sigma_1
    zdot_i + sigma_2 v_i)`; the same numbers as `planarfriction.DistributedModel`.

    `trainable` names the parameters of the law that are `nn.Parameter`s. With `"weights"` the pressure is trainable
    too: the weights `w_i` of the cells are the softmax of a raw parameter, so that they stay positive and add up to 1.
    If the shape of the patch depends on the load, the shape at `normal_force` [N] is kept. The stiffness of a `pad` is
    a buffer; that of `Pad.at_load` follows the weights, which are not trainable with other pads. Behind a common
    compliance, `sigma_1` counts as 0.

    Raises InvalidValueError for a parameter that breaks its rule.

    Source: Waltersson and Karayiannidis 2024, section III.
    """

    positions: Tensor
    remainder: Tensor
    stiffness: Tensor | None
    compliance: Tensor | None

    def __init__(
        self,
        patch: ContactPatch,
        law: FrictionLaw,
        normal_force: float | None = None,
        *,
        pad: Pad | None = None,
        trainable: Iterable[str] = TRAINABLE,
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ):
        super().__init__(patch, law)
        model = reference_of(f"torch.{type(self).__name__}", patch, law, pad)
        kind = {"dtype": dtype or torch.get_default_dtype(), "device": device}
        precision = float if kind["dtype"] == torch.float64 else "f4"
        cells = distributed.cells_of(model, normal_force, precision)
        self.kind = cells.kind
        self.pad = pad
        self.of_law = pad is None or pad.springs_of_law
        stiff = cells.stiff
        if stiff is not None:
            stiff = torch.tensor(stiff, **kind)
        self.register_buffer("stiffness", stiff)
        common = cells.compliance
        if common is not None:
            common = torch.tensor(common, **kind)
        self.register_buffer("compliance", common)
        self.lag = 0.0 if pad is None else pad.lag
        numbers = law.numbers._asdict()
        chosen = tuple(trainable)
        if "weights" in chosen and not self.of_law:
            rule = "not contain weights for a pad with a separate stiffness"
            raise InvalidValueError("trainable", rule, chosen)
        lever = float(patch.contact_radius(normal_force))
        physical = [name for name in chosen if name != "weights"]
        self._adopt({name: numbers[name] for name in LAW}, physical, lever, **kind)
        self.register_buffer("positions", torch.tensor(cells.levers, **kind))
        self.register_buffer(
            "remainder", torch.tensor(cells.remainder, **kind), persistent=False
        )
        raw = torch.tensor(cells.weights, **kind).log()
        if "weights" in chosen:
            self.raw_weights = nn.Parameter(raw)
        else:
            self.register_buffer("raw_weights", raw)

    @property
    def weights(self) -> Tensor:
        """Share of the load on each cell `[N]`, with its gradient."""
        return torch.softmax(self.raw_weights, 0)

    def value(self, name: str) -> Tensor:
        """Return a physical value, or the `weights`, with its gradient."""
        return self.weights if name == "weights" else super().value(name)

    def compiled(self) -> tuple[Any, tuple[Tensor, ...], tuple[Tensor, ...]]:
        """Return the model as compiled rollouts take it (see `FrictionModule.compiled`)."""
        cells = () if self.stiffness is None else (self.stiffness,)
        cells = self.positions, *cells
        weights = (self.weights,)
        pack = functools.partial(
            pack_cells, self.kind, self.elasto_plastic, self.of_law
        )
        return (pack, cells, weights) if self.of_law else (pack, weights + cells, ())


class SurfaceBuffers(nn.Module):
    """The numbers of a limit surface in buffers (see `planarfriction._engine.published.surfaces`)."""

    data: Tensor
    form: Tensor
    """Kind and size of the surface; a state dict of another form is refused."""

    def __init__(self, surface: LimitSurface, **kind) -> None:
        super().__init__()
        self.kind, self.size, data = surface.numbers
        self.register_buffer("data", torch.tensor(data, **kind))
        self.register_buffer(
            "form", torch.tensor([self.kind, self.size], device=kind["device"])
        )

    def _load_from_state_dict(
        self, state_dict: dict[str, Any], prefix: str, *rest: Any
    ) -> None:
        given = state_dict.get(f"{prefix}form")
        if given is not None and given.tolist() != self.form.tolist():
            rule = "hold a limit surface of the same kind and size (kind, segments or cells)"
            raise InvalidValueError(
                "state_dict",
                f"{rule} as the model, {self.form.tolist()}",
                given.tolist(),
            )
        super()._load_from_state_dict(state_dict, prefix, *rest)


class ReducedModelPublished(FrictionModule, PublishedModel):
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

    root: Tensor | None

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
        self.register_buffer(
            "root", None if patch.root is None else torch.tensor(shape.root, **kind)
        )
        values = published.values_of(law, shape)
        self._adopt(
            {name: values[name] for name in PARAMETERS},
            trainable,
            shape.contact_radius,
            **kind,
        )

    def compiled(self) -> tuple[Any, tuple[Tensor, ...], tuple[Tensor, ...]]:
        """Return the model as compiled rollouts take it (see `FrictionModule.compiled`)."""
        pack = functools.partial(
            pack_surface, self.elasto_plastic, self.surface.kind, self.surface.size
        )
        return (
            pack,
            (self.surface.data,)
            if self.root is None
            else (self.surface.data, self.root),
            (),
        )


class ReducedModel(DistributedModel):
    """Reduced LuGre friction, differentiable: distributed friction on the few discs that stand for the patch.

    The equations, the settings and the numbers of `planarfriction.ReducedModel`; all else as in `DistributedModel`.

    Raises InvalidValueError for a parameter that breaks its rule.
    """

    def __init__(
        self,
        patch: ContactPatch,
        law: FrictionLaw,
        normal_force: float | None = None,
        *,
        cells: int = Reference.cells,
        pad: Pad | None = None,
        **options: Any,
    ):
        few = reference_of("torch.ReducedModel", patch, law, pad, cells)
        super().__init__(few.patch, law, normal_force, pad=few.pad, **options)
        self.patch = patch
        self.pad = pad
