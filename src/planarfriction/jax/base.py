"""The interface of the models of JAX: pytrees, made of a patch and a law as those of NumPy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Self

import jax
import jax.numpy as jnp

from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.jax.namespace import xp
from planarfriction.laws import FrictionLaw
from planarfriction.patch import ContactPatch
from planarfriction.tensors.steps import TensorModel


class FrictionPytree(TensorModel):
    """A friction model as a pytree; `replace` makes a changed model.

    `parameters` of an evaluation, a record like `model.parameters` or an array `[P]` in its order, replace these.
    """

    xp = xp
    leaves: ClassVar[tuple[str, ...]]
    """Attributes that JAX maps over and differentiates."""
    fixed: ClassVar[tuple[str, ...]] = ("elasto_plastic",)
    """Attributes that are fixed when a function is compiled."""
    parameters: Any
    """Physical parameters by name, scalars."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        jax.tree_util.register_pytree_with_keys(cls, cls._flatten, cls._unflatten)

    def __init__(self, patch: ContactPatch, law: FrictionLaw) -> None:
        self.refuse(patch, law, f"jax.{type(self).__name__}")
        self.elasto_plastic = law.numbers.elasto_plastic > 0.0

    def replace(self, **leaves: Any) -> Self:
        """Return a model with other `parameters`, or other leaves by name."""
        for name in leaves:
            if name not in self.leaves:
                raise InvalidValueError(
                    "leaf", f"be one of {', '.join(self.leaves)}", repr(name)
                )
        # Of arrays: `vmap` takes models of axes too.
        if isinstance(leaves.get("parameters"), tuple):
            own = zip(self.names, leaves["parameters"], strict=True)
            self._in_range(
                {name: value for name, value in own if isinstance(value, jax.Array)}
            )
        return self._unflatten(
            self._flatten()[1],
            [leaves.get(name, getattr(self, name)) for name in self.leaves],
        )

    def _flatten(self):
        keys = map(jax.tree_util.GetAttrKey, self.leaves)
        fixed = tuple(getattr(self, name) for name in self.fixed)
        return [(key, getattr(self, key.name)) for key in keys], fixed

    @classmethod
    def _unflatten(cls, fixed: tuple[Any, ...], leaves) -> Self:
        model = object.__new__(cls)  # JAX also puts in what a model cannot be made of
        names = *cls.leaves, *cls.fixed
        vars(model).update(zip(names, (*leaves, *fixed), strict=True))
        return model

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the physical parameters, in the order of their vector."""
        return self.parameters._fields

    def rest(self, batch: int | Sequence[int] = ()) -> jax.Array:
        """Return the state of a contact at rest, or of a `batch`: `[*batch, *state_shape]`."""
        return jnp.zeros(
            validation.batched(batch, self.state_shape),
            jnp.result_type(self.parameters.sigma_0),
        )

    @jax.jit
    def rollout(
        self, state, twist, normal_force, dt, *, parameters: Any = None
    ) -> tuple[jax.Array, jax.Array]:
        """Return the last state and the wrenches `[..., T, 3]` of steps by operations of JAX, compiled once."""

        def one(z, held):
            twist, load = held
            return self.step(z, twist, load, dt, parameters=parameters)

        # Only the states are kept for the way back; to step again costs less than to store all that a step computes.
        one = jax.checkpoint(one, prevent_cse=False)  # pyright: ignore[reportPrivateImportUsage]
        end, wrenches = jax.lax.scan(
            one, state, (jnp.moveaxis(twist, -2, 0), jnp.moveaxis(normal_force, -1, 0))
        )
        return end, jnp.moveaxis(wrenches, 0, -2)

    def _values(self, parameters: Any) -> dict[str, jax.Array]:
        return {
            name: jnp.asarray(value)
            for name, value in self._record(parameters)._asdict().items()
        }

    def _record(self, parameters: Any) -> Any:
        """Return parameters as a record, the model's own if they are None."""
        if parameters is None:
            return self.parameters
        record = type(self.parameters)(
            *self._counted(parameters, len(parameters), (len(parameters),))
        )
        self._in_range(
            {name: xp.real(name, value) for name, value in record._asdict().items()}
        )
        return record


def record_of(kind: Any, values: dict[str, float]) -> Any:
    """Return a record of parameters of its fields' values, as scalars of JAX."""
    return kind(*(jnp.asarray(values[name], dtype=float) for name in kind._fields))
