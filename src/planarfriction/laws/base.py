"""The interface of every friction law that is based on bristles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planarfriction import formulas
from planarfriction._support import validation
from planarfriction._support.equality import Checked
from planarfriction._support.pictures import picture
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers


class FrictionLaw(Checked):
    """A friction law per unit normal load: a frozen record of parameters that enter the formulas by name.

    `zdot = v - k z`, `f = -(sigma_0 z + sigma_1 zdot + sigma_2 v) f_N`, with the decay k of `formulas.bristle_decay`
    and the steady friction `g(v)` of `formulas.stribeck`. Each member of the family only defines which `numbers` enter
    these formulas; models need nothing else.

    `rate` and `force` describe a single bristle without a patch: along a line for arrays of any shape, or in several
    dimensions, where `axis` is the axis of the components.
    """

    def _repr_html_(self) -> str:
        return picture("law in a notebook", self)

    def _settle_static(self: Any) -> None:
        """Set a `mu_s` that is None to `mu_c`; raise for one below it."""
        if self.mu_s is None:
            self._set(mu_s=self.mu_c)
        if self.mu_s < self.mu_c:
            raise InvalidValueError(
                "mu_s", "be >= mu_c", f"mu_s={self.mu_s}, mu_c={self.mu_c}"
            )

    @property
    def numbers(self) -> LawNumbers:
        """The numbers that the law puts into the formulas; a new law of this form must define only this."""
        raise NotImplementedError

    @property
    def largest_deflection(self) -> float:
        """Steady-state deflection at high speed, `mu_c / sigma_0` [m], which is the nominal value of a bristle."""
        return self.numbers.mu_c / self.numbers.sigma_0

    def steady_friction(self, speed: ArrayLike) -> np.ndarray:
        """Return the friction force over normal force [-] in steady sliding at `speed` >= 0 `[...]` [m/s].

        `g(v) v/(v + v_c) + sigma_2 v`; laws without creep (v_c = 0) have `g(0)` at rest.

        Raises InvalidValueError for a speed that is not finite.
        """
        law = self.numbers
        speed = np.abs(validation.finite_numbers("speed", speed))
        share = speed / (speed + law.creep_speed) if law.creep_speed > 0.0 else 1.0
        return formulas.stribeck(np, speed, law) * share + law.sigma_2 * speed

    @property
    def holds_at_rest(self) -> bool:
        """True if a bristle that is not driven keeps its deflection, so that a contact can stick under a load."""
        return self.numbers.creep_speed == 0.0

    def rate(
        self,
        state: ArrayLike,
        velocity: ArrayLike,
        *,
        axis: int | None = None,
    ) -> np.ndarray:
        """Return the rate `zdot` [m/s] of bristles with deflection `state` [m] driven at `velocity` [m/s].

        Both broadcast. Raises InvalidValueError for shapes that do not broadcast.
        """
        z, v = _bristles(state, velocity, axis)
        return self._bristle(z, v, axis)[0]

    def force(
        self,
        state: ArrayLike,
        velocity: ArrayLike,
        normal_force: ArrayLike,
        *,
        axis: int | None = None,
    ) -> np.ndarray:
        """Return the friction force [N] on the moving body; `normal_force` [N] broadcasts with bristles, not with
        components.

        Raises InvalidValueError for a load below zero, and for shapes that do not broadcast.
        """
        z, v = _bristles(state, velocity, axis)
        load = validation.non_negative_numbers("normal_force", normal_force)
        load = load if axis is None else np.expand_dims(load, axis)
        validation.broadcast(state=z, velocity=v, normal_force=load)
        return load * self._bristle(z, v, axis)[1]

    def _bristle(
        self, z: np.ndarray, v: np.ndarray, axis: int | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the rates of bristles and their tractions per unit load; checked arrays that broadcast."""
        law = self.numbers
        length = _norm(z, axis)
        speed = _norm(v, axis)
        product = z * v if axis is None else (z * v).sum(axis=axis, keepdims=True)
        along = product / np.where(length > 0.0, length, 1.0)
        grip = law.sigma_0 / formulas.stribeck(np, speed, law)
        rate = (
            v - formulas.bristle_decay(np, length * grip, along, speed, grip, law) * z
        )
        return rate, formulas.traction(z, rate, v, law)


def _bristles(
    state: Any, velocity: Any, axis: int | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return both inputs as arrays that broadcast and have such an axis."""
    z = validation.finite_numbers("state", state)
    v = validation.finite_numbers("velocity", velocity)
    least = min(z.ndim, v.ndim)
    validation.broadcast(state=z, velocity=v)
    if axis is not None and not (type(axis) is int and -least <= axis < least):
        raise InvalidValueError(
            "axis", f"be None or the axis of the components (of {least} axes)", axis
        )
    return z, v


def refuse_creep(law: Any, by: str) -> None:
    """Raise unless `law` is a law of bristles that keeps what sticks where it is."""
    if not isinstance(law, FrictionLaw):
        raise InvalidValueError(
            "law", "be a friction law of bristles, such as LuGre", law
        )
    if not law.holds_at_rest:
        raise InvalidValueError(
            "law", f"have no creep_speed for {by}: take LuGre or Dahl", law
        )


def is_rate_law(law: Any) -> bool:
    """Return True for a law whose bristles follow a function of their own (`RateLaw`)."""
    return hasattr(law, "bristle_rate")


def refuse_rate_law(law: Any, by: str) -> None:
    """Raise for a law whose bristles follow a function of their own, where only the formulas of bristles will do."""
    if is_rate_law(law):
        rule = f"have the bristles of LuGre for {by}, not a separate rate"
        raise InvalidValueError("law", rule, type(law).__name__)


def _norm(vector: np.ndarray, axis: int | None) -> np.ndarray:
    return (
        np.abs(vector)
        if axis is None
        else np.linalg.norm(vector, axis=axis, keepdims=True)
    )
