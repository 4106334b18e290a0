"""The friction models as PyTorch modules."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Self

import torch
from torch import Tensor, nn

from planarfriction.derivatives.parameters import PARAMETERS, pack_cells, pack_maps, pack_surface
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.laws import FrictionLaw
from planarfriction.limit_surface import LimitSurface
from planarfriction.models import ReducedModel as Reference
from planarfriction.models.reduced_map import maps_of, sizes_of, slip_factor
from planarfriction.patch import ContactPatch
from planarfriction.tensors import distributed, published, reduced
from planarfriction.tensors.steps import LAW, Part
from planarfriction.torch.base import TRAINABLE, Compiled, FrictionModule
from planarfriction.torch.namespace import xp


class DistributedModel(FrictionModule):
    """Distributed LuGre friction, differentiable: a bristle `z_i` [m] in every cell, state `[2, N]`; for small patches.

    `zdot_i = v_i - beta sigma_0 |v_i|/g z_i`, `W = sum w_i f_N [t_i ; rho_i x t_i]`, `t_i = -(sigma_0 z_i + sigma_1
    zdot_i + sigma_2 v_i)`; the same numbers as `planarfriction.DistributedModel`.

    `trainable` names the parameters of the law that are `nn.Parameter`s. With `"weights"` the pressure is trainable
    too: the weights `w_i` of the cells are the softmax of a raw parameter, so that they stay positive and add up to 1.
    If the shape of the patch depends on the load, the shape at `normal_force` [N] is kept.

    Raises InvalidValueError for a parameter that breaks its rule.

    Source: Waltersson and Karayiannidis 2024, section III.
    """

    equations = distributed
    positions: Tensor
    """Positions of the cells `[2, N]` [m]; with a friction metric their levers (see `tensors.distributed.Cells`)."""

    def __init__(
        self,
        patch: ContactPatch,
        law: FrictionLaw,
        normal_force: float | None = None,
        *,
        trainable: Iterable[str] = TRAINABLE,
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ):
        super().__init__(patch, law)
        cells = distributed.cells_of(patch, normal_force, "torch")
        kind = {"dtype": dtype or torch.get_default_dtype(), "device": device}
        numbers, chosen = law.numbers._asdict(), tuple(trainable)
        lever = float(patch.contact_radius(normal_force))
        physical = [name for name in chosen if name != "weights"]
        self._adopt({name: numbers[name] for name in LAW}, physical, lever, **kind)
        self.register_buffer("positions", torch.tensor(cells.levers, **kind))
        raw = torch.tensor(cells.weights, **kind).log()
        if "weights" in chosen:
            self.raw_weights = nn.Parameter(raw)
        else:
            self.register_buffer("raw_weights", raw)

    @property
    def weights(self) -> Tensor:
        """Share of the load on each cell `[N]`, with its gradient."""
        return torch.softmax(self.raw_weights, 0)

    @property
    def state_shape(self) -> tuple[int, ...]:
        """Shape of the state of one contact, `(2, N)`."""
        return 2, self.positions.shape[1]

    def compiled(self) -> Compiled:
        """Return the model as compiled rollouts take it."""
        return Compiled(functools.partial(pack_cells, self.elasto_plastic), (self.positions, self.weights))

    def _parts(self, law: LawNumbers, values: Mapping[str, Tensor]) -> tuple[Part]:
        return (Part(law, distributed.Cells(self.positions, self.weights)),)


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


class ReducedModel(FrictionModule):
    """Reduced LuGre friction, differentiable: bristles on a few cells, or with `parts` the moments of each part.

    The equations and the numbers of `planarfriction.ReducedModel`, with its settings. What is made is a `FewCells` with
    the state `[2, n]` [m] or, with `parts`, a `MomentModel` with `[3]` or `[P, 3]` [m]. `trainable` names the
    parameters of the law that are `nn.Parameter`s. A shape that depends on the load is that at `normal_force` [N].

    Raises InvalidValueError for a parameter that breaks its rule.
    """

    if TYPE_CHECKING:

        def __init__(
            self,
            patch: ContactPatch,
            law: FrictionLaw,
            normal_force: float | None = None,
            *,
            cells: int = 56,
            parts: int | str | None = None,
            segments: int = 24,
            speeds: int = 16,
            trainable: Iterable[str] = TRAINABLE,
            dtype: torch.dtype | None = None,
            device: torch.device | str | None = None,
        ): ...

    def __new__(
        cls, patch: Any = None, law: Any = None, normal_force: Any = None, *, parts: Any = None, **settings: Any
    ) -> Self:
        """Return a module of the member that the settings ask for."""
        if cls is not ReducedModel:
            return super().__new__(cls)

        return super().__new__(FewCells if parts is None else MomentModel)  # pyright: ignore


class FewCells(DistributedModel, ReducedModel):
    """Distributed friction on the few cells of `planarfriction.ReducedModel`, which `ReducedModel` makes by default.

    Raises InvalidValueError as that does.
    """

    def __init__(
        self,
        patch: ContactPatch,
        law: FrictionLaw,
        normal_force: float | None = None,
        *,
        cells: int = Reference.cells,
        segments: int = Reference.segments,
        speeds: int = Reference.speeds,
        parts: None = None,
        **more: Any,
    ):
        self.refuse(patch, law, "torch.ReducedModel")
        few = Reference(patch, law, cells=cells, segments=segments, speeds=speeds).reduction.patch
        super().__init__(few, law, normal_force, **more)
        self.patch = patch


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
