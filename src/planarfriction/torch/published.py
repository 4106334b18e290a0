"""The published reduced model as a PyTorch module."""

from __future__ import annotations

from collections.abc import Iterable

import torch
from torch import Tensor

from planarfriction import models
from planarfriction.laws import LuGre
from planarfriction.limit_surface import LimitSurface
from planarfriction.patch import ContactPatch
from planarfriction.torch import bristle
from planarfriction.torch import namespace as xp
from planarfriction.torch.base import TRAINABLE, FrictionModel, Prepared
from planarfriction.torch.parameters import LAW
from planarfriction.torch.surfaces import surface_of


class ReducedModelPublished(FrictionModel):
    """Reduced LuGre friction, differentiable: three bristles `z = (z_x, z_y, z_tau)` [m, m, m^2] and a limit surface.

    With `S = diag(1, 1, r)`, `V_S = S V`, `v_n = |V_S|`: `zdot = S h(V) v_n - beta sigma_0 v_n/g(v_n) z`,
    `W = -(sigma_0 z + sigma_1 zdot + sigma_2 U V) f_N`; the same numbers as `planarfriction.ReducedModelPublished`.

    `surface` is any limit surface (None: the published table). `trainable` names the physical parameters that are
    `nn.Parameter`s, of the law or of the shape (`contact_radius`, `second_moment`, `centre_x`, `centre_y`); the limit
    surface and all other parameters are buffers. A new contact radius scales the torque and leaves the form of the
    limit surface as it is. The shape does not follow the load: of a patch that depends on it, `surface` fixes the shape
    by its `normal_force`.

    Source: Waltersson and Karayiannidis 2024, section IV.
    """

    components = (3,)
    axis = -1
    reference: models.ReducedModelPublished

    def __init__(
        self,
        patch: ContactPatch,
        law: LuGre,
        surface: LimitSurface | None = None,
        *,
        trainable: Iterable[str] = TRAINABLE,
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ):
        super().__init__(patch, law)
        when = "keep" if surface is not None else "rebuild"
        self.reference = models.ReducedModelPublished(patch, law, surface, on_load_change=when)  # pyright: ignore
        shape = self.reference._reference
        kind = {"dtype": dtype or torch.get_default_dtype(), "device": device}
        self.surface = surface_of(shape.surface, **kind)
        x, y = shape.centre_of_pressure.tolist()
        numbers = law.numbers._asdict()
        values = {name: numbers[name] for name in LAW}
        values |= {"contact_radius": shape.contact_radius, "second_moment": shape.second_moment}
        self._adopt(values | {"centre_x": x, "centre_y": y}, trainable, **kind)

    @property
    def lever(self) -> float:
        """Contact radius of the patch [m]."""
        return float(self.reference._reference.contact_radius)

    def prepare(self, parameters: Tensor) -> Prepared:
        """The law, `S` as a vector, `r`, `<rho^2>` and the centre of pressure."""
        radius, second_moment, x, y = parameters[..., len(LAW) :].split(1, -1)
        scale = torch.cat([torch.ones_like(radius), torch.ones_like(radius), radius], -1)
        return Prepared(self._law(parameters), (scale, radius, second_moment, x, y))

    def _drive(self, prepared: Prepared, v: Tensor) -> tuple[bristle.Drive, Tensor]:
        """What drives the scaled bristle, and `U V`."""
        _, radius, second_moment, x, y = prepared.shape
        vx, vy, omega = v.split(1, -1)
        vx, vy = vx - omega * y, vy + omega * x
        scaled = _joined(vx, vy, radius * omega)
        speed = xp.norm(scaled, -1)
        u = self.surface(scaled, speed)
        u_norm = xp.norm(u, -1)
        slides = u_norm > 0.0
        size = torch.where(slides, u_norm / torch.where(slides, speed, 1.0), 1.0)
        return bristle.drive(prepared.law, u, speed, size), _joined(vx, vy, second_moment * omega)

    def _wrench(self, prepared: Prepared, z: Tensor, zdot: Tensor, velocity: Tensor) -> Tensor:
        """Wrench about the origin, per unit load."""
        _, _, _, x, y = prepared.shape
        fx, fy, tau = bristle.traction(prepared.law, z, zdot, velocity).split(1, -1)
        return _joined(fx, fy, tau + x * fy - y * fx)

    def _scaled(self, prepared: Prepared, z: Tensor) -> Tensor:
        return z / prepared.shape[0]

    def _raw(self, prepared: Prepared, z: Tensor) -> Tensor:
        return z * prepared.shape[0]


def _joined(*components: Tensor) -> Tensor:
    return torch.cat(torch.broadcast_tensors(*components), -1)
