"""What the models of JAX share: they are pytrees, made of a patch and a law as those of NumPy."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import ModuleType
from typing import Any, ClassVar, Self

import jax
import jax.numpy as jnp

from planarfriction import validation
from planarfriction.derivatives.parameters import Packed
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.jax import inputs
from planarfriction.jax import namespace as xp
from planarfriction.laws import FrictionLaw
from planarfriction.laws.base import refuse_creep
from planarfriction.patch import ContactPatch


class FrictionModel:
    """A friction model as a pytree; everything is about the contact frame's origin, the caller holds the state.

    Leading axes of state, twist `[..., 3]`, normal_force `[...]` and dt broadcast. `replace` makes a changed model.

    Raises `InvalidValueError` for what is no number and for wrong shapes; outside of `jit`, `vmap` and `grad` also for
    values that are not finite or, of loads and steps, below zero. Inside, a load below zero counts as none (friction
    never drives), and so does a `dt` below zero; NaN stays NaN.
    """

    arrays: ClassVar[ModuleType]
    """The model as `f(xp, ...)`: `held`, `rate`, `advance` and `wrench` of arrays."""
    leaves: ClassVar[tuple[str, ...]]
    """Attributes that JAX maps over and differentiates; `elasto_plastic` is fixed when a function is compiled."""
    axes: ClassVar[int]
    """Of the state of a part."""
    parameters: Any
    """Physical parameters by name, scalars."""
    elasto_plastic: bool

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        jax.tree_util.register_pytree_with_keys(cls, cls._flatten, cls._unflatten)

    def __init__(self, patch: ContactPatch, law: FrictionLaw) -> None:
        validation.instance("patch", patch, ContactPatch, "a ContactPatch")
        refuse_creep(law, f"jax.{type(self).__name__}")
        self.elasto_plastic = law.numbers.elasto_plastic > 0.0

    def replace(self, **leaves: Any) -> Self:
        """A model with other `parameters`, or other leaves by name."""
        for name in leaves:
            if name not in self.leaves:
                raise InvalidValueError("leaf", f"be one of {', '.join(self.leaves)}", repr(name))
        return self._unflatten(self.elasto_plastic, [leaves.get(name, getattr(self, name)) for name in self.leaves])

    def _flatten(self):
        keys = map(jax.tree_util.GetAttrKey, self.leaves)
        return [(key, getattr(self, key.name)) for key in keys], self.elasto_plastic

    @classmethod
    def _unflatten(cls, elasto_plastic: bool, leaves) -> Self:
        model = object.__new__(cls)  # JAX also puts in what a model cannot be made of
        vars(model).update(zip(cls.leaves, leaves, strict=True), elasto_plastic=elasto_plastic)
        return model

    def rest(self) -> jax.Array:
        """State of a contact at rest."""
        raise NotImplementedError

    def rate(self, state, twist, normal_force) -> jax.Array:
        """Rate of the state, of its shape; it does not depend on the load."""
        return self._evaluated(state, twist, normal_force)[0]

    def wrench(self, state, twist, normal_force) -> jax.Array:
        """Friction wrench on the moving body, `[..., 3]` [N, N, N m]."""
        return self._evaluated(state, twist, normal_force)[1]

    def step(self, state, twist, normal_force, dt) -> tuple[jax.Array, jax.Array]:
        """State and wrench after `dt` [s] at a held twist, stable at any `dt`; a contact without load forgets."""
        state, twist, load = self._inputs(state, twist, normal_force)
        dt = self._inner(inputs.non_negative("dt", inputs.real("dt", dt)))
        loaded = self._inner(load) > 0.0

        def step(law, shape, z):
            by = self.arrays.held(xp, law, shape, twist)
            new, rate = self.arrays.advance(xp, law, shape, z, by, dt)
            return jnp.where(loaded, new, 0.0), self.arrays.wrench(xp, law, shape, new, rate, by)

        new, unit = self._summed(state, step)
        return new, load[..., None] * unit

    def roll(self, state, twist, normal_force, dt) -> tuple[jax.Array, jax.Array]:
        """Last state and wrenches `[..., T, 3]` of steps through twists and loads, an operation of JAX each."""

        def one(z, held):
            twist, load = held
            return self.step(z, twist, load, dt)

        # Only the states are kept for the way back; to step again costs less than to store all that a step computes.
        one = jax.checkpoint(one, prevent_cse=False)  # pyright: ignore[reportPrivateImportUsage]
        end, wrenches = jax.lax.scan(one, state, (jnp.moveaxis(twist, -2, 0), jnp.moveaxis(normal_force, -1, 0)))
        return end, jnp.moveaxis(wrenches, 0, -2)

    def compiled(self) -> tuple[Packed, ...] | None:
        """The model, of arrays of NumPy, as compiled roll-outs take it, if they know it; its law is any."""
        return None

    # ------------------------------------------------------------------ inside

    def _inputs(self, state, twist, normal_force) -> tuple[jax.Array, jax.Array, jax.Array]:
        inner = self.rest().shape
        state = inputs.shaped("state", inputs.real("state", state), inner)
        twist = inputs.shaped("twist", inputs.real("twist", twist), (3,))
        load = inputs.real("normal_force", normal_force)
        inputs.broadcasting(
            {"state": state.shape[: -len(inner)], "twist": twist.shape[:-1], "normal_force": load.shape}
        )
        load = inputs.non_negative("normal_force", load)
        return inputs.finite("state", state), inputs.finite("twist", twist), load

    def _parts(self) -> list[tuple[Any, Any]]:
        """Share of the load and numbers of each part of the patch, as the model's arrays know them."""
        raise NotImplementedError

    def _evaluated(self, state, twist, normal_force) -> tuple[jax.Array, jax.Array]:
        """Rate and wrench."""
        state, twist, load = self._inputs(state, twist, normal_force)

        def evaluate(law, shape, z):
            by = self.arrays.held(xp, law, shape, twist)
            rate = self.arrays.rate(xp, law, shape, z, by)
            return rate, self.arrays.wrench(xp, law, shape, z, rate, by)

        rate, unit = self._summed(state, evaluate)
        return rate, load[..., None] * unit

    def _summed(self, state: jax.Array, run: Callable[..., Any]) -> tuple[jax.Array, jax.Array]:
        """What `run` makes of the parts and their states, side by side, and the sum of the wrenches that it gives."""
        law, parts = self._law(), self._parts()
        if len(parts) == 1:
            return run(law, parts[0][1], state)
        found = [run(law, shape, state[..., k, :]) for k, (_, shape) in enumerate(parts)]
        wrenches = [share * wrench for (share, _), (_, wrench) in zip(parts, found, strict=True)]
        return jnp.stack([each for each, _ in found], -2), jnp.stack(wrenches).sum(0)

    def _law(self) -> LawNumbers:
        named = {"gamma": math.nan, **self.parameters._asdict()}  # a map of steady sliding holds its gamma
        law = {name: named[name] for name in LawNumbers._fields if name in named}
        return LawNumbers(**law, elasto_plastic=float(self.elasto_plastic))

    def _inner(self, value: jax.Array) -> jax.Array:
        """One value for each contact beside the components of the state of a part."""
        return value.reshape(value.shape + (1,) * self.axes)
