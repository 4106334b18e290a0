"""Default patch and law of each ready scene at the command line."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from planarfriction.cli.patches import WIDTH

if TYPE_CHECKING:
    from planarfriction.laws import LuGre
    from planarfriction.patch import ContactPatch


class Usual(NamedTuple):
    """Patch and law of a ready scene."""

    width: float = WIDTH
    """Width of a patch given by its name [m]."""
    patch: Callable[[], ContactPatch] | None = None
    """Makes the patch; None for a disc."""
    law: Callable[[], LuGre] | None = None
    """Makes the law; None for the published one."""


def usual(name: str) -> Usual:
    """Return patch and law of the ready scene `name`; those of most where it has none of its own."""
    return _USUAL.get(name, Usual())


def published_law() -> LuGre:
    """Return the law of the published experiments."""
    from planarfriction.laws import ElastoPlastic, LuGre

    return LuGre(mu_s=1.2, elasto_plastic=ElastoPlastic(0.9))


def _fingertip() -> ContactPatch:
    """Make a soft finger on a disc that it fills at 8 N: Hertz contact, of radius 6 mm at 1 N."""
    from planarfriction.patch import ContactPatch, SoftFinger

    return ContactPatch.disc(0.012, pressure=SoftFinger(c=0.006, n=1 / 3, k=2.0, radius_max=0.012))


def _running_band() -> ContactPatch:
    """Make the ring that a curling stone stands on, 6 mm wide and 123 mm across."""
    from planarfriction.patch import ContactPatch

    return ContactPatch.ring(0.0585, 0.0645)


def _ice() -> LuGre:
    """Return the law of granite on pebbled ice: bristles of 0.1 um, no viscous friction, which is for centimetres/s."""
    from planarfriction.laws import LuGre

    return LuGre(mu_c=0.01, sigma_0=1e5, sigma_1=10.0, sigma_2=0.0)


_USUAL = {
    "drift": Usual(width=0.05),  # as published
    "pivot": Usual(width=0.024, patch=_fingertip),
    "foot": Usual(width=0.06),
    "curling": Usual(width=0.13, patch=_running_band, law=_ice),
}
