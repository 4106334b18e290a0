"""The paper's reduced model built from plain numbers, for scripts that use it under this name.

The same model as `planarfriction.torch.ReducedModelPublished`, without a contact patch: eight trainable numbers, and
the ellipsoid as limit surface. With another limit surface it is the corrected model of the library.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import torch
from torch import Tensor

from planarfriction import formulas
from planarfriction._support import validation
from planarfriction.errors import FrictionError, InvalidValueError
from planarfriction.laws import LuGre
from planarfriction.limit_surface import LimitSurface, LimitSurfaceEllipsoid
from planarfriction.patch import ContactPatch
from planarfriction.tensors import published
from planarfriction.torch.base import TRAINABLE
from planarfriction.torch.models import ReducedModelPublished
from planarfriction.torch.namespace import xp
from planarfriction.torch.parameters import PhysicalParameters
from planarfriction.torch.rollout import rollout
from planarfriction.torch.rollout import tracking_loss as weighted_loss

RADIUS = 0.05
"""Contact radius of a model that is given neither radius nor surface [m]."""


class _OneSize(PhysicalParameters):
    """The second moment follows the contact radius: a contact that grows keeps its form."""

    def set(self, values: Mapping[str, float]) -> None:
        """Set physical values by name; raises InvalidValueError for one out of its range."""
        if "contact_radius" in values and "second_moment" not in values:
            now = dict(zip(self.names, self._physical().tolist(), strict=True))
            growth = values["contact_radius"] / now["contact_radius"]
            values = {**values, "second_moment": now["second_moment"] * growth**2}
        super().set(values)

    def _named(self) -> dict[str, Tensor]:
        now = super()._named()
        set_last = dict(zip(self.names, self.values.unbind(), strict=True))
        growth = now["contact_radius"] / set_last["contact_radius"]
        return now | {"second_moment": set_last["second_moment"] * growth**2}


class ReducedPlanarLuGre(ReducedModelPublished):
    """Reduced LuGre friction of a contact given by its radius, with eight trainable numbers.

    With `S = diag(1, 1, r)`, `v_s = S v`: `z_dot = S h |v_s| - sigma_0 |v_s|/g(|v_s|) z`,
    `w = -(sigma_0 z + sigma_1 z_dot + sigma_2 U v) f_n`, `U = diag(1, 1, <rho^2>)`.

    Bristles `z` `[..., 3]` [m, m, m^2] are conjugate to the wrench: start from zeros, or `steady_state_z`. Twists `v`
    `[..., 3]` are `(vx, vy, omega)` [m/s, m/s, rad/s], wrenches `(fx, fy, tau)` [N, N, N m] act on the moving body,
    loads `f_n` `[...]` [N] are >= 0; leading batch axes broadcast.

    `radius` is the contact radius `r` [m], the mean distance of the load from its centre: a spin has the torque
    `g f_n r`. Without a `surface` the contact is a ring, `<rho^2> = r^2`, and the limit surface the ellipsoid,
    `h = v_s/|v_s|`. With one, the contact has the form of its patch, scaled to `radius`, or of its own size if that is
    left out. `mu_c`, ..., `radius` are attributes, the present values; what an optimiser moves, `parameters()`, cannot
    leave the valid range (see `planarfriction.torch.parameters`), and `set(mu_c=0.8, contact_radius=0.04)` sets values.

    Raises `InvalidValueError` for a number out of its range, and for wrong shapes.

    Source: Waltersson and Karayiannidis 2024, section IV.
    """

    physical_type = _OneSize

    def __init__(
        self,
        mu_c: float = 1.0,
        mu_s: float = 1.2,
        v_s: float = 1e-3,
        gamma: float = 2.0,
        sigma_0: float = 1e6,
        sigma_1: float = 8e2,
        sigma_2: float = 0.2,
        radius: float = RADIUS,
        surface: LimitSurface | None = None,
        *,
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ) -> None:
        law = LuGre(
            mu_c=mu_c,
            mu_s=mu_s,
            v_s=v_s,
            gamma=gamma,
            sigma_0=sigma_0,
            sigma_1=sigma_1,
            sigma_2=sigma_2,
        )
        # the very object: a radius that was left out, and not one that happens to be as large
        own_size = surface is not None and radius is RADIUS
        self._given = None if own_size else validation.positive("radius", radius)
        if surface is None:
            surface = LimitSurfaceEllipsoid(_ring(radius))
        if not isinstance(surface, LimitSurface):
            raise InvalidValueError("surface", "be a limit surface", surface)
        trainable = (*TRAINABLE, "contact_radius")
        super().__init__(
            surface.patch, law, surface, trainable=trainable, dtype=dtype, device=device
        )

    def _adopt(
        self,
        values: dict[str, float],
        trainable: Iterable[str],
        lever: float,
        **kind: Any,
    ) -> None:
        radius = lever if self._given is None else self._given
        size = {
            "contact_radius": radius,
            "second_moment": values["second_moment"] * (radius / lever) ** 2,
        }
        super()._adopt(values | size, trainable, radius, **kind)

    # ------------------------------------------------------------------ the present values

    mu_c = property(lambda self: self.value("mu_c"), doc="Coulomb coefficient [-].")
    mu_s = property(
        lambda self: self.value("mu_s"), doc="Static coefficient [-], at least `mu_c`."
    )
    v_s = property(lambda self: self.value("v_s"), doc="Stribeck speed [m/s].")
    gamma = property(lambda self: self.value("gamma"), doc="Stribeck exponent [-].")
    sigma_0 = property(
        lambda self: self.value("sigma_0"), doc="Bristle stiffness per unit load [1/m]."
    )
    sigma_1 = property(
        lambda self: self.value("sigma_1"), doc="Bristle damping per unit load [s/m]."
    )
    sigma_2 = property(
        lambda self: self.value("sigma_2"), doc="Viscous friction per unit load [s/m]."
    )
    radius = property(
        lambda self: self.value("contact_radius"), doc="Contact radius r [m]."
    )

    # ------------------------------------------------------------------ the interface

    def g(self, speed: Tensor | float) -> Tensor:
        """Return the friction coefficient in steady sliding, `g = mu_c + (mu_s - mu_c) exp(-|v/v_s|^gamma)` [-].

        Raises InvalidValueError for what is not a tensor of numbers.
        """
        law = self._contact_at(None).law
        given = self._number("speed", speed)
        return formulas.stribeck(xp, given[..., None, None].abs(), law)[..., 0, 0]

    def steady_state_z(self, v_scaled: Tensor) -> Tensor:
        """Return the bristles of steady sliding, `z_ss = S h g/sigma_0` `[..., 3]`, zero at rest.

        `v_scaled` `[..., 3]` [m/s] is the twist at the centre of pressure, `(vx, vy, r omega)`.

        Raises InvalidValueError for what is not a tensor `[..., 3]`.
        """
        v_scaled = self._number("v_scaled", v_scaled)
        law, shape = self._contact_at(None)
        speed = xp.norm(v_scaled, -1)
        # Zero at rest.
        h = shape.surface(v_scaled, speed) / torch.where(speed > 0.0, speed, 1.0)
        most = formulas.stribeck(xp, published.wide(speed), law) / law.sigma_0
        return published.narrow(published.raw(xp, shape, published.wide(h) * most))

    def bristle_rate(self, z: Tensor, v: Tensor) -> Tensor:
        """Return `z_dot = S h |v_s| - sigma_0 |v_s|/g z` `[..., 3]` [m/s, m/s, m^2/s]."""
        return self.forward(z, v, 1.0)[0]

    def force(self, z: Tensor, z_dot: Tensor, v: Tensor, f_n: Tensor | float) -> Tensor:
        """Return the wrench `w = -(sigma_0 z + sigma_1 z_dot + sigma_2 U v) f_n` `[..., 3]` [N, N, N m].

        Raises InvalidValueError for tensors whose shapes do not fit.
        """
        law, shape = self._contact_at(None)
        z, v, load = self._inputs(z, v, f_n)
        by = published.drive(xp, law, shape, v)
        z, rate = (
            published.scaled(xp, shape, published.wide(each))
            for each in (z, self._number("z_dot", z_dot))
        )
        return load[..., None] * published.wrench(
            xp, shape, formulas.traction(z, rate, by.viscous, law)
        )

    def step(
        self, z: Tensor, v: Tensor, f_n: Tensor | float, dt: Tensor | float
    ) -> tuple[Tensor, Tensor]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return the bristles after `dt` [s] of a constant twist, and the wrench at the end. Stable at any `dt`."""
        return super().step(z, v, f_n, dt)

    def forward(
        self, z: Tensor, v: Tensor, f_n: Tensor | float
    ) -> tuple[Tensor, Tensor]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return `bristle_rate` and `force`: `(z_dot, wrench)`."""
        return super().forward(z, v, f_n)


def _ring(radius: float) -> ContactPatch:
    """Return four points at one distance, with `r = radius` and `<rho^2> = radius^2`."""
    points = [[radius, 0.0], [0.0, radius], [-radius, 0.0], [0.0, -radius]]
    return ContactPatch.points(points, name="ring")


def simulate(
    model: ReducedPlanarLuGre,
    v_profile: Tensor,
    f_n: Tensor | float,
    dt: Tensor | float = 1e-4,
) -> Tensor:
    """Return the wrenches `[T, 3]` at the end of each of the steps `dt` [s] of `v_profile` `[T, 3]`, from rest.

    Batches `[..., T, 3]` and loads `[T]` are possible, as in `planarfriction.torch.rollout`, which chooses the method.
    """
    return rollout(model, None, v_profile, f_n, dt).wrenches


def tracking_loss(
    model: ReducedPlanarLuGre,
    v_profile: Tensor,
    reference: Tensor,
    f_n: Tensor | float,
    dt: Tensor | float = 1e-4,
) -> Tensor:
    """Return the mean squared error of `simulate` against wrenches `[T, 3]`, relative to the load.

    Torques are divided by load and radius. See `planarfriction.torch.tracking_loss`; the radius is that of the start.
    """
    return weighted_loss(model, None, v_profile, f_n, dt, reference)


def smoke_test() -> None:
    """Slide and spin for a moment, and print one line; raise `FrictionError` if what comes out cannot be right.

    Everything is finite, every number has a gradient, and the torque of a steady spin stays below `mu_s f_n r`.
    """
    model = ReducedPlanarLuGre(dtype=torch.float64)
    f_n = 2.0
    t = torch.linspace(0.0, 0.2, 2000, dtype=torch.float64)
    v_profile = torch.stack(
        [1e-2 * torch.sin(40.0 * t), 5e-3 * torch.cos(30.0 * t), torch.sin(25.0 * t)],
        -1,
    )
    wrenches = simulate(model, v_profile, f_n)
    wrenches.square().sum().backward()
    gradients = {name: raw.grad for name, raw in model.named_parameters()}
    lost = [
        name
        for name, slope in gradients.items()
        if slope is None or not slope.isfinite() or slope == 0.0
    ]
    if lost or not wrenches.isfinite().all():
        raise FrictionError(
            f"ReducedPlanarLuGre has no finite wrench, or no gradient to {', '.join(lost)}"
        )
    spin = torch.tensor([0.0, 0.0, 0.02], dtype=torch.float64).expand(100, 3)
    torque = simulate(model, spin, f_n, 1e-2)[-1, 2].abs().item()
    bound = (model.mu_s * model.radius).item() * f_n
    if not torque <= bound:
        raise FrictionError(
            f"the torque of a steady rotation is {torque} N m, above mu_s f_n r = {bound} N m"
        )
    print(
        f"ReducedPlanarLuGre: {len(t)} steps, gradients to {len(gradients)} numbers; steady torque {torque:.4f} N m,"
        f" at most {bound:.4f} N m"
    )
