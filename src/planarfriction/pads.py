"""Pads: tangential stiffness of a soft face, apart from its pressure (docs/pads.md)."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction import half_space
from planarfriction._support import validation
from planarfriction._support.equality import ByValue, checked
from planarfriction.errors import InvalidValueError
from planarfriction.laws import FrictionLaw
from planarfriction.patch import ContactPatch
from planarfriction.patch.discs import mirrors

LAG = 1e-3
"""Time [s] in which the common part of a pad follows, unless it is known."""

LOCAL = 4.0
"""Stiffness of the pieces of a half-space over that of the whole: three quarters of the compliance are common."""


def _share(name: str, value: Any) -> float:
    value = validation.number(name, value)
    if not 0.0 <= value < 1.0:
        raise InvalidValueError(name, "be in [0, 1)", value)
    return value


def _poisson_ratio(name: str, value: Any) -> float:
    value = validation.number(name, value)
    if not 0.0 <= value <= 0.5:
        raise InvalidValueError(name, "be in [0, 0.5]", value)
    return value


def _bodies(name: str, value: Any) -> int:
    value = validation.count(name, value)
    if value > 2:
        raise InvalidValueError(name, "be 1 or 2", value)
    return value


@dataclass(frozen=True, eq=False)
class Pad(ByValue):
    """Elastic pad under a patch: it deforms where it is soft and slips where its pressure is low.

    Piece i has a stiffness `K_i` [N/m] and carries the load `N_i`, so that a patch slips partly before it
    slips as a whole. All pieces may hang on a compliance C that they have in common, as on a half-space. Make pads with
    `layer`, `half_space`, `measured` and `at_load`.

    Source: Mindlin 1949; Cattaneo 1938; docs/pads.md.
    """

    @staticmethod
    def layer(shear_modulus: float, thickness: float) -> Pad:
        """Return a thin layer bonded to a rigid back: `K_i = G/h` times the area of a piece.

        `shear_modulus` [Pa], `thickness` [m], which must be less than the size of the patch. Points have the area that
        `ContactPatch.points` is given, or a nominal one of 1 mm^2.

        Raises InvalidValueError unless both are > 0.
        """
        return Layer(shear_modulus, thickness)

    @staticmethod
    def half_space(
        shear_modulus: float, poisson_ratio: float = 0.5, *, bodies: int = 1, lag: float = LAG
    ) -> Pad:  # fmt: skip
        """Return a body that is thick compared with the patch, against a rigid face, or two alike (`bodies`).

        Pieces share the stiffness as the tractions of the stuck patch; what they do not explain of its stiffness in
        shift and rotation is common. `shear_modulus` [Pa]; `lag` [s] is that of the material.

        Raises InvalidValueError for a modulus or a lag that is not > 0, a `poisson_ratio` outside [0, 0.5], and other
        numbers of bodies.
        """
        return HalfSpace(shear_modulus, poisson_ratio, bodies, lag)

    @staticmethod
    def measured(stiffness: float, common: float = 0.0, *, lag: float = LAG) -> Pad:
        """Return a pad by the stiffness of a stuck patch in shift [N/m], shared by area.

        `common` is the share of the compliance that all pieces have in common, in shift; in rotation there is none.

        Raises InvalidValueError for a stiffness or a lag that is not > 0, and a `common` outside [0, 1).
        """
        return Measured(stiffness, common, lag)

    @staticmethod
    def at_load(normal_force: float) -> Pad:
        """Return a pad with the stiffness that the law has under a load > 0 [N], at all loads.

        `K_i = sigma_0 w_i f_ref`: deflections follow the load.

        Raises InvalidValueError unless the load is > 0.
        """
        return AtLoad(normal_force)

    lag = LAG
    """Time [s] in which the common part of the pad follows."""

    springs_of_law = False
    """True if the stiffness is that of the law, and not the pad's own."""

    def check(self, patch: ContactPatch, law: FrictionLaw) -> None:
        """Check a patch and a law. Raises InvalidValueError for those that do not go with the pad."""
        if patch.asymmetric:
            raise InvalidValueError(
                "patch", "have no asymmetry for a pad", "an asymmetry"
            )
        if patch.anisotropic and not self.springs_of_law:
            rule = "have no friction metric for a pad with a separate stiffness"
            raise InvalidValueError("patch", rule, "a metric")
        refuse_damping(law.numbers.sigma_1, self.compliance(patch))

    def pieces(self, patch: ContactPatch, law: FrictionLaw) -> np.ndarray:
        """Return the stiffness of the pieces of the pad `[N]` [N/m]."""
        raise NotImplementedError

    def compliance(self, patch: ContactPatch) -> np.ndarray | None:
        """Return the common compliance about the origin `[3, 3]` [m/N, rad/(N m)], or None."""
        return None

    def shares(self, patch: ContactPatch) -> np.ndarray:
        """Return the shares of the cells by which few discs that stand for the pad are chosen, `[N]`."""
        return 0.5 * (patch.areas / patch.areas.sum() + patch.weights())

    def _refuse_loads(self, patch: ContactPatch) -> None:
        if patch.depends_on_load:
            rule = "have a shape that does not depend on the load, for this pad"
            raise InvalidValueError("patch", rule, patch.name or "one that does")


def refuse_damping(sigma_1: float, compliance: np.ndarray | None) -> None:
    """Check that bristles on a pad with a common compliance have no damping. Raises InvalidValueError if they have."""
    if sigma_1 > 0.0 and compliance is not None:
        rule = "be 0 for a pad with a common compliance, whose lag damps"
        raise InvalidValueError("sigma_1", rule, sigma_1)


@dataclass(frozen=True, eq=False)
class Layer(Pad):
    """Thin layer bonded to a rigid back (see `Pad.layer`).

    Raises InvalidValueError for numbers that are not > 0.
    """

    shear_modulus: float = checked(validation.positive)
    """Shear modulus G [Pa]."""
    thickness: float = checked(validation.length)
    """Thickness h [m]."""

    def check(self, patch: ContactPatch, law: FrictionLaw) -> None:
        """See `Pad.check`. Raises InvalidValueError as that does."""
        super().check(patch, law)
        size = math.sqrt(patch.areas.sum())
        if self.thickness >= size:
            rule = f"be less than the size of the patch, {size:.3g} m (take half_space or measured)"
            raise InvalidValueError("thickness", rule, self.thickness)

    def pieces(self, patch: ContactPatch, law: FrictionLaw) -> np.ndarray:
        """See `Pad.pieces`."""
        return self.shear_modulus / self.thickness * patch.areas


@dataclass(frozen=True, eq=False)
class AtLoad(Pad):
    """Stiffness of the law under a load, at all loads (see `Pad.at_load`).

    Raises InvalidValueError for a load that is not > 0.
    """

    normal_force: float = checked(validation.positive_load)
    """Load f_ref [N] at which the law has the stiffness."""

    springs_of_law = True

    def check(self, patch: ContactPatch, law: FrictionLaw) -> None:
        """See `Pad.check`. Raises InvalidValueError as that does."""
        super().check(patch, law)
        self._refuse_loads(patch)

    def pieces(self, patch: ContactPatch, law: FrictionLaw) -> np.ndarray:
        """See `Pad.pieces`."""
        return law.numbers.sigma_0 * self.normal_force * patch.weights()


@dataclass(frozen=True, eq=False)
class Measured(Pad):
    """Pad by the stiffness of a stuck patch (see `Pad.measured`).

    Raises InvalidValueError as `Pad.measured` does.
    """

    stiffness: float = checked(validation.positive)
    """Stiffness of the stuck patch in shift [N/m]."""
    common: float = checked(_share, default=0.0)
    """Share of the compliance that all pieces have in common [-]."""
    lag: float = checked(validation.positive, default=LAG)
    """Time in which that follows [s]."""

    def pieces(self, patch: ContactPatch, law: FrictionLaw) -> np.ndarray:
        """See `Pad.pieces`."""
        return self.stiffness / (1.0 - self.common) * patch.areas / patch.areas.sum()

    def compliance(self, patch: ContactPatch) -> np.ndarray | None:
        """See `Pad.compliance`."""
        shift = self.common / self.stiffness
        return np.diag([shift, shift, 0.0]) if shift > 0.0 else None


@dataclass(frozen=True, eq=False)
class HalfSpace(Pad):
    """Body that is thick beside the patch (see `Pad.half_space`).

    Raises InvalidValueError as `Pad.half_space` does.
    """

    shear_modulus: float = checked(validation.positive)
    """Shear modulus G [Pa]."""
    poisson_ratio: float = checked(_poisson_ratio, default=0.5)
    """Poisson's ratio [-]."""
    bodies: int = checked(_bodies, default=1)
    """Number of elastic bodies: 1 against a rigid face, 2 alike."""
    lag: float = checked(validation.positive, default=LAG)
    """Time in which the common part follows [s]."""

    def check(self, patch: ContactPatch, law: FrictionLaw) -> None:
        """See `Pad.check`. Raises InvalidValueError as that does."""
        self._refuse_loads(patch)
        if not patch.cell_extents().all():
            rule = "have cells with an area for a half-space (take measured)"
            raise InvalidValueError("patch", rule, patch.name)
        if mirrors(patch) < 2:
            rule = "have two mirrors for a half-space (take measured)"
            raise InvalidValueError("patch", rule, patch.name)
        super().check(patch, law)

    def pieces(self, patch: ContactPatch, law: FrictionLaw) -> np.ndarray:
        """See `Pad.pieces`."""
        return self._pieces(patch)

    def _pieces(self, patch: ContactPatch) -> np.ndarray:
        stuck = self._stuck(patch)
        shift = 0.5 * (stuck.stiffness[0, 0] + stuck.stiffness[1, 1])
        return LOCAL * shift * stuck.shares

    def compliance(self, patch: ContactPatch) -> np.ndarray | None:
        """See `Pad.compliance`."""
        levers = patch.levers()
        stiffness = np.repeat(self._pieces(patch)[:, None], patch.bristles, 1)
        own = np.einsum("nd,nda,ndb->ab", stiffness, levers, levers)
        missing = np.linalg.inv(self._stuck(patch).stiffness) - np.linalg.inv(own)
        size, axes = np.linalg.eigh(missing)
        return axes * np.maximum(size, 0.0) @ axes.T

    def shares(self, patch: ContactPatch) -> np.ndarray:
        """See `Pad.shares`."""
        return self._stuck(patch).shares

    def _stuck(self, patch: ContactPatch) -> half_space.Stuck:
        return _stuck(patch, self.shear_modulus / self.bodies, self.poisson_ratio)


@functools.lru_cache(8)
def _stuck(patch: ContactPatch, modulus: float, ratio: float) -> half_space.Stuck:
    sizes = patch.cell_extents()
    return half_space.stuck(patch.positions, patch.areas, sizes, modulus, ratio)


@dataclass(frozen=True, eq=False)
class Pieces(Pad):
    """Pad by the stiffness of each of its pieces."""

    each: Any
    """Stiffness of the pieces `[N]` [N/m]."""
    common: Any = None
    """Common compliance about the origin `[3, 3]`, or None."""
    lag: float = LAG
    """Time in which that follows [s]."""

    def pieces(self, patch: ContactPatch, law: FrictionLaw) -> np.ndarray:
        """See `Pad.pieces`."""
        return self.each

    def compliance(self, patch: ContactPatch) -> np.ndarray | None:
        """See `Pad.compliance`."""
        return self.common
