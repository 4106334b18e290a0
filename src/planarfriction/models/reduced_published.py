"""The reduced model as published: three bristles and a limit surface."""

from __future__ import annotations

import functools
from dataclasses import dataclass

from planarfriction import validation
from planarfriction.compiled.published import PUBLISHED
from planarfriction.errors import InvalidValueError
from planarfriction.laws.base import refuse_rate_law
from planarfriction.limit_surface import LimitSurface, LimitSurfaceTablePublished
from planarfriction.models.published_shapes import PublishedShape, PublishedShapes
from planarfriction.models.three_states import ThreeStateModel
from planarfriction.patch.metric import refuse_cell_metrics, same_metric

ON_LOAD_CHANGE = ("rebuild", "rescale", "keep")
"""Choices of `ReducedModelPublished.on_load_change`."""


@dataclass(frozen=True, eq=False)
class ReducedModelPublished(ThreeStateModel):
    """Reduced LuGre friction: three bristles, conjugate to the wrench at the centre of pressure, and a limit surface.

    With `S = diag(1, 1, r)`, `V_S = S V`, `v_n = |V_S|` and `h(V)` the direction of the sliding wrench: `zdot = S h v_n
    - beta sigma_0 v_n / g(v_n) z`, `W = -(sigma_0 z + sigma_1 zdot + sigma_2 U V) f_N`, `U = diag(1, 1, <rho^2>)`.
    State: `(z_x, z_y, z_tau)` [m, m, m^2].

    For a patch that depends on the load, `on_load_change="rebuild"` recomputes everything for each load, `"rescale"`
    keeps the limit surface and `<rho^2>` of `surface.normal_force` and updates only `r` (and the centre of pressure),
    and `"keep"` keeps everything. The raw state is kept when `r` changes. If one cell carries all but a millionth of
    the load, the contact is a point without torque about it; `z_tau` then keeps its value, without effect.

    Raises InvalidValueError if `surface` is not a limit surface, and if it lacks the `normal_force` that
    `on_load_change` needs.

    Source: Waltersson and Karayiannidis 2024, section IV.
    """

    _kind = PUBLISHED
    state_units = "m, m, m^2"

    surface: LimitSurface = None  # pyright: ignore[reportAssignmentType]
    """Limit surface; None uses the published table of the patch."""
    on_load_change: str = "rebuild"
    """Update of the shape when the load changes: "rebuild", "rescale" or "keep"."""

    def __post_init__(self) -> None:
        super().__post_init__()
        refuse_rate_law(self.law, "ReducedModelPublished")
        validation.choice("on_load_change", self.on_load_change, ON_LOAD_CHANGE)
        if self.surface is None:
            object.__setattr__(self, "surface", LimitSurfaceTablePublished(self.patch))
        if not isinstance(self.surface, LimitSurface):
            raise InvalidValueError("surface", "be a limit surface", self.surface)
        self._check_directions()
        if self.patch.depends_on_load and self.on_load_change != "rebuild" and self.surface.normal_force is None:
            raise InvalidValueError(
                "surface", f"have a normal_force when on_load_change={self.on_load_change!r}", "none"
            )

    def _check_directions(self) -> None:
        by = type(self).__name__
        refuse_cell_metrics(self.patch, by)
        for patch in (self.patch, self.surface.patch):
            if patch.asymmetric:
                raise InvalidValueError("patch", f"have the same friction forwards and backwards for {by}", "asymmetry")
        if not same_metric(self.patch, self.surface.patch):
            raise InvalidValueError("surface", "have the friction metric of the patch", self.surface.patch.name)

    def shape_at(self, normal_force: float) -> PublishedShape:
        """Return centre of pressure, `r`, `<rho^2>` and limit surface at a load [N]; recent loads are cached.

        Raises InvalidValueError for a load that is not > 0.
        """
        load = validation.positive_load("normal_force", normal_force) if self.depends_on_load else normal_force
        return self.shapes.shape_at(load)

    @property
    def depends_on_load(self) -> bool:
        """True if the shape of the patch in this model changes with the load."""
        return self.patch.depends_on_load and self.on_load_change != "keep"

    @functools.cached_property
    def shapes(self) -> PublishedShapes:
        """Shapes of the patch at any load."""
        return PublishedShapes(self.surface, self.patch, self.on_load_change)
