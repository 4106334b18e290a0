"""Coulomb: friction of a sliding patch, without memory and without a value at rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction._support.equality import Checked, checked
from planarfriction.errors import InvalidValueError


@dataclass(frozen=True)
class Coulomb(Checked):
    """Coulomb friction: the wrench lies on the limit surface scaled by `mu f_N`.

    Raises InvalidValueError for a `mu` that is not > 0.
    """

    mu: float = checked(validation.positive)
    """Friction coefficient [-]."""

    def wrench(
        self, surface: Any, twist: ArrayLike, normal_force: ArrayLike
    ) -> np.ndarray:
        """Return the friction wrench `mu f_N W(V)` on the sliding body about the contact frame's origin [N, N, N m].

        `surface` is any limit surface, `twist` has shape `[..., 3]` [m/s, m/s, rad/s], `normal_force` `[...]` [N]. At
        rest the wrench is zero: Coulomb's law alone does not determine the force of a sticking contact.

        Raises InvalidValueError unless `surface` is a limit surface and the loads are >= 0 and broadcast with the
        twists.
        """
        load = validation.non_negative_numbers("normal_force", normal_force)
        if not hasattr(surface, "wrench"):
            raise InvalidValueError("surface", "be a limit surface", surface)
        direction = surface.wrench(twist)
        try:
            return self.mu * load[..., None] * direction
        except ValueError:
            shapes = f"shapes {list(load.shape)} and {list(direction.shape[:-1])}"
            raise InvalidValueError(
                "normal_force", "broadcast with the twist", shapes
            ) from None
