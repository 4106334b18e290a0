"""What every friction law of bristles offers."""

from __future__ import annotations

from planarfriction.formulas import LawNumbers


class FrictionLaw:
    """A friction law per unit normal load: frozen parameters, which it gives to the formulas by name.

    `zdot = v - k z`, `f = -(sigma_0 z + sigma_1 zdot + sigma_2 v) f_N`, with the decay k of `formulas.bristle_decay`
    and the steady friction `g(v)` of `formulas.stribeck`. A member of the family says what its numbers in them are.
    """

    @property
    def numbers(self) -> LawNumbers:
        """The law as the formulas see it."""
        raise NotImplementedError

    @property
    def largest_deflection(self) -> float:
        """Steady-state deflection at high speed, `mu_c / sigma_0` [m]: the natural scale of a bristle."""
        return self.numbers.mu_c / self.numbers.sigma_0
