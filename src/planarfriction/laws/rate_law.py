"""Base of laws that are functions of their own: the rate of a bristle as a function, in any form."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._engine.cells import cells, rate_law
from planarfriction._engine.codegen import ratios, vectors
from planarfriction._engine.compiler.calls import address_of
from planarfriction._engine.compiler.memory import place_of, row_of
from planarfriction._engine.coupled import steps
from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.laws.base import FrictionLaw

__all__ = ["RateLaw", "dot", "norm", "plus", "ratio", "times"]

_vectors: Any = vectors  # compiled functions have types of the compiler

dot: Callable[[Any, Any], Any] = _vectors.dot
"""Return `a . b` (`dot(a, b)`)."""
norm: Callable[[Any], Any] = _vectors.norm
"""Return `|a|`, whose slope at zero is zero."""
plus: Callable[[Any, Any, Any], Any] = _vectors.plus
"""Return `a + c b` (`plus(a, c, b)`)."""
times: Callable[[Any, Any], Any] = _vectors.times
"""Return `c a` (`times(c, a)`)."""
ratio: Callable[[Any, Any], Any] = ratios.ratio
"""Return `x/y` for y > 0; 0 at 0 (`ratio(x, y)`)."""

_SPEED = 1e-3
"""Speed [m/s] that solvers measure errors against, where no Stribeck speed is known."""

_COMMON = ("sigma_0", "sigma_1", "sigma_2", "largest_deflection")

_POINT = np.zeros((2, 1))
_ALONE = np.ones(1)


class RateLaw(FrictionLaw):
    """A friction law per unit normal load whose bristles follow a function of their own, `zdot = bristle_rate(...)`.

    A member is a frozen dataclass of numbers with a `largest_deflection` and a static method
    `bristle_rate(xp, law, z, v)` that returns zdot of a bristle z = (x, y) [m] driven at v = (v_x, v_y) [m/s]. That is
    a formula of numbers (`+ - * /`, `xp.exp`, `log`, `sin`, `cos`, `power`, `where`, `minimum`, `maximum`) and of
    vectors (`dot`, `norm`, `plus`, `times`, `ratio`, imported from here), with loops of known length and without `if`.
    `law` has the fields of the record, and `sigma_0`, `sigma_1`, `sigma_2`, `largest_deflection`. The traction is
    `-(sigma_0 z + sigma_1 zdot + sigma_2 v)`, unless there is a static method `bristle_traction(xp, law, z, zdot, v)`.

    Derivatives of both are written from a call with symbols. Steps are linearly implicit, of order 2, and keep bristles
    within the largest deflection. `DistributedModel` takes such laws in NumPy.

    Raises InvalidValueError for a field that is not a number, for a stiffness or largest deflection that is not > 0,
    and for a function that cannot be called with symbols.
    """

    sigma_0: Any
    """Stiffness of the bristles per unit normal load [1/m], a field or a property of the member."""
    sigma_1: Any = 0.0
    """Damping of the bristles per unit normal load [s/m]."""
    sigma_2: Any = 0.0
    """Viscous friction per unit normal load [s/m]."""
    bristle_rate: ClassVar[Callable]
    bristle_traction: ClassVar[Callable] = staticmethod(rate_law.traction)

    def __post_init__(self) -> None:
        super().__post_init__()
        for each in dataclasses.fields(self):  # pyright: ignore[reportArgumentType]
            self._set(
                **{each.name: validation.number(each.name, getattr(self, each.name))}
            )
        validation.positive("sigma_0", self.sigma_0)
        validation.positive("largest_deflection", self.largest_deflection)
        try:
            self.functions(cells.POSITIONS)
        except (TypeError, AttributeError) as error:
            raise InvalidValueError(
                "law", f"be a formula ({error})", type(self).__name__
            ) from None

    @property
    def largest_deflection(self) -> float:
        """Deflection [m] that a bristle never exceeds; a member must define it."""
        raise NotImplementedError

    @functools.cached_property
    def numbers(self) -> LawNumbers:
        """Numbers for scales of deflection, friction and speed; the formulas of LuGre bristles do not apply."""
        mu = self.sigma_0 * self.largest_deflection
        return LawNumbers(self.sigma_0, self.sigma_1, self.sigma_2, mu, mu, _SPEED, 2.0)

    @functools.cached_property
    def holds_at_rest(self) -> bool:
        """True if a bristle that is not driven keeps its deflection and acts by its stiffness alone."""
        z = np.array([[0.5 * self.largest_deflection, 0.0]])
        rate, pull = self._evaluated(z, np.zeros((1, 2)))
        return not rate.any() and np.allclose(
            pull, -self.sigma_0 * z, rtol=1e-12, atol=0.0
        )

    def steady_friction(self, speed: ArrayLike) -> np.ndarray:
        """Return the friction force over normal force [-] in steady sliding at `speed` >= 0 `[...]` [m/s].

        It is the friction of a single bristle after 100 largest deflections; at rest, `sigma_0` times that deflection.

        Raises InvalidValueError for a speed that is not finite.
        """
        speed = np.abs(validation.finite_numbers("speed", speed))
        twist = np.zeros((speed.size, 3))
        twist[:, 0] = speed.reshape(-1)
        dt = (
            0.25
            * self.largest_deflection
            / np.where(twist[:, 0] > 0.0, twist[:, 0], 1.0)
        )
        step = self.functions(cells.POSITIONS).steps.step
        single = self._single()
        table = row_of(
            steps.Stepped(address_of(step), 2, 4, 1, place_of(single), single.size)
        )
        z = np.zeros((speed.size, 2))
        new = np.empty((speed.size, 2))
        pull = np.empty((speed.size, 3))
        for _ in range(400):
            steps.ready(steps.step_many)(
                table, z, twist, _ALONE, dt, new, pull, np.empty(steps.SCRATCH)
            )
            z, new = new, z
        return np.where(
            speed > 0.0, -pull[:, 0].reshape(speed.shape), self.numbers.mu_c
        )

    def _bristle(
        self, z: np.ndarray, v: np.ndarray, axis: int | None
    ) -> tuple[np.ndarray, np.ndarray]:
        z, v = (
            np.atleast_1d(each)[..., None]
            if axis is None
            else np.moveaxis(each, axis, -1)
            for each in (z, v)
        )
        z, v = np.broadcast_arrays(z, v)
        shape = z.shape
        size = z.shape[-1]
        if size > 2:
            raise InvalidValueError(
                "axis",
                f"be that of one or two components for {type(self).__name__}",
                size,
            )
        count = z.size // size
        found = self._evaluated(z.reshape(count, size), v.reshape(count, size))
        parts = (each[:, :size].reshape(shape) for each in found)
        rate, pull = (
            each[..., 0] if axis is None else np.moveaxis(each, -1, axis)
            for each in parts
        )
        return rate, pull

    def _evaluated(self, z: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return rates and tractions `[B, 2]` of bristles of one or two components `[B, 1 or 2]`."""
        state = np.zeros((len(z), 2))
        twist = np.zeros((len(z), 3))
        state[:, : z.shape[1]] = z
        twist[:, : v.shape[1]] = v
        rate = np.empty_like(state)
        pull = np.empty_like(twist)
        function = address_of(self.functions(cells.POSITIONS).rates.evaluate)
        steps.rates_many(function, self._single(), state, twist, rate, pull)
        return rate, pull[:, :2]

    # ------------------------------------------------------------------ machine form

    @classmethod
    @functools.cache
    def functions(cls, lever: cells.Lever) -> rate_law.CellFunctions:
        """Return the compiled functions of contacts with this law whose cells have a lever.

        Raises `NotStraightError`, a TypeError, for functions that cannot be traced.
        """
        names = [each.name for each in dataclasses.fields(cls)]  # pyright: ignore[reportArgumentType]
        names += [name for name in _COMMON if name not in names]
        record = NamedTuple(f"{cls.__name__}Numbers", [(name, float) for name in names])  # pyright: ignore
        mark = rate_law.fingerprint(names, cls.bristle_rate, cls.bristle_traction)
        name = f"{cls.__name__}_{mark}{'' if lever is cells.POSITIONS else '_turned'}"
        return rate_law.cell_functions(
            rate_law.element_of(name, cls.bristle_rate, cls.bristle_traction),
            record,
            lever,
        )

    def contact(
        self, lever: cells.Lever, numbers: np.ndarray, weights: np.ndarray
    ) -> Any:
        """Return the record of a contact of n cells with these `numbers` and `weights` `[n]`, which compiled code
        reads; the caller keeps both alive."""
        record = self.functions(lever).record
        law = record.__annotations__["law"]
        return record(
            law(*(float(getattr(self, name)) for name in law._fields)),
            numbers.shape[1],
            numbers,
            weights,
        )

    def _single(self) -> np.ndarray:
        """Return the words of a contact of one cell; they hold addresses of this process, so no law keeps them."""
        return row_of(self.contact(cells.POSITIONS, _POINT, _ALONE))[None]
