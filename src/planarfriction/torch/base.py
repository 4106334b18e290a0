"""The interface of the models of PyTorch: modules with physical parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, ClassVar

import torch
from torch import Tensor, nn

from planarfriction._support import validation
from planarfriction.derivatives.parameters import PackedRollout
from planarfriction.errors import InvalidValueError
from planarfriction.laws import ElastoPlastic, FrictionLaw, LuGre
from planarfriction.patch import ContactPatch
from planarfriction.tensors import steps
from planarfriction.tensors.pressure import Pressed
from planarfriction.tensors.steps import LAW, TensorModel
from planarfriction.torch.namespace import xp
from planarfriction.torch.parameters import PhysicalParameters

TRAINABLE = LAW[:-1]
"""Parameters that are trainable unless the caller chooses: the law without the breakaway ratio."""


_BRISTLES = {False: "plain", True: "elasto-plastic"}


class FrictionModule(TensorModel, nn.Module):
    """A friction model as a module of PyTorch, whose parameters are physical.

    `parameters` of an evaluation `[..., P]`, in the order of `names`, one row for each contact, replace its own.
    """

    xp = xp
    physical: PhysicalParameters
    physical_type: ClassVar[type[PhysicalParameters]] = PhysicalParameters
    bristles: Tensor
    """1 for elasto-plastic bristles, else 0; a state dict of the other kind is refused."""
    lever: Tensor
    """Lever arm [m]: the ratio of torques to forces."""

    def __init__(self, patch: ContactPatch, law: FrictionLaw) -> None:
        nn.Module.__init__(self)
        self.refuse(patch, law, f"torch.{type(self).__name__}")
        self.patch = patch
        self.elasto_plastic = bool(law.numbers.elasto_plastic)

    def _adopt(
        self,
        values: dict[str, float],
        trainable: Iterable[str],
        lever: float,
        **kind: Any,
    ) -> None:
        """Add the physical parameters, and the other entries of every model's state dict."""
        trainable = tuple(trainable)
        if "breakaway_ratio" in trainable and not self.elasto_plastic:
            raise InvalidValueError(
                "trainable", "not contain breakaway_ratio for plain bristles", trainable
            )
        self.physical = self.physical_type(values, trainable, **kind)
        self.register_buffer(
            "bristles", torch.tensor(self.elasto_plastic, device=kind["device"])
        )
        self.register_buffer("lever", torch.tensor(lever, **kind))

    def _load_from_state_dict(
        self, state_dict: dict[str, Any], prefix: str, *rest: Any
    ) -> None:
        given = state_dict.get(f"{prefix}bristles")
        if given is not None and bool(given) != self.elasto_plastic:
            own, other = (
                _BRISTLES[kind] for kind in (self.elasto_plastic, bool(given))
            )
            raise InvalidValueError("state_dict", f"be that of {own} bristles", other)
        super()._load_from_state_dict(state_dict, prefix, *rest)

    # ------------------------------------------------------------------ parameters

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the physical parameters, in the order of their vector."""
        return self.physical.names

    def value(self, name: str) -> Tensor:
        """Return a physical value, with its gradient."""
        validation.choice("parameter", name, self.names)
        return self.physical()[self.names.index(name)]

    def set(self, **values: float) -> None:
        """Set physical values by name, trainable or not."""
        self.physical.set(
            {name: validation.number(name, value) for name, value in values.items()}
        )

    def law(self) -> LuGre:
        """Return the law with the present values."""
        now = self._law_values()
        breakaway = ElastoPlastic(now.pop("breakaway_ratio"))
        return LuGre(**now, elasto_plastic=breakaway if self.elasto_plastic else None)

    def _law_values(self) -> dict[str, float]:
        now = dict(zip(self.names, self.physical().tolist(), strict=True))
        return {name: value for name, value in now.items() if name in LAW}

    # ------------------------------------------------------------------ evaluation

    def rest(self, batch: int | Sequence[int] = ()) -> Tensor:
        """Return the state of a contact at rest, or of a `batch`: `[*batch, *state_shape]`."""
        return self.physical.values.new_zeros(
            validation.batched(batch, self.state_shape)
        )

    def forward(
        self,
        state: Tensor,
        twist: Tensor,
        normal_force: Tensor | float,
        *,
        moments: Tensor | None = None,
        parameters: Tensor | None = None,
    ) -> tuple[Tensor, Tensor]:
        """Return the rate of the state, and the wrench; `moments` as in `step`."""
        return self._evaluated(state, twist, normal_force, parameters, moments)

    def compiled(
        self,
    ) -> tuple[Callable[..., PackedRollout], tuple[Tensor, ...], tuple[Tensor, ...]]:
        """Return the model as compiled rollouts take it: a function of arrays, its buffers, and the weights of cells.

        The function packs the model from the weights, if there are cells, and the buffers.
        """
        raise NotImplementedError

    def rollout(
        self,
        state: Tensor,
        twist: Tensor,
        normal_force: Tensor,
        dt: Tensor,
        *,
        parameters: Tensor | None = None,
    ) -> tuple[Tensor, Tensor]:
        """Return the last state and the wrenches `[..., T, 3]` of steps through twists `[..., T, 3]` and loads.

        Only the bristles go step by step; their drives and the wrenches are computed for all steps at once. Inputs are
        tensors that have been checked.
        """
        if self.compliance is not None:
            return self._faced(state, twist, normal_force, dt, parameters)
        equations = self.equations
        vector = self._vector(parameters)
        of_step, contact = (
            self._prepared(self._named(values))
            for values in (vector, vector[..., None, :])
        )
        z = equations.wide(xp.widened(state))
        by = equations.drive(xp, *contact, xp.widened(twist))
        drives = zip(*(value.unbind(-3) for value in by), strict=True)
        pulls = []
        for drive, now in zip(drives, normal_force.unbind(-1), strict=True):
            z, pull = steps.advance(
                xp, equations, of_step, z, _like(by, drive), now, dt
            )
            pulls.append(pull)
        wrenches = normal_force[..., None] * equations.wrench(
            xp, contact.shape, torch.stack(pulls, -3)
        )
        given = vector, state, twist
        return xp.narrowed(equations.narrow(z), *given), xp.narrowed(wrenches, *given)

    def _faced(
        self, state: Tensor, twist: Tensor, normal_force: Tensor, dt: Tensor, parameters: Tensor | None
    ) -> tuple[Tensor, Tensor]:  # fmt: skip
        """Return `rollout` of a pad whose face each step looks for."""
        pressed = Pressed(self._contact_at(parameters), None)
        wrenches = []
        for v, load in zip(twist.unbind(-2), normal_force.unbind(-1), strict=True):
            state, wrench = self.step_pressed(pressed, state, v, load, dt)
            wrenches.append(wrench)
        return state, torch.stack(wrenches, -2)

    # ------------------------------------------------------------------ inputs

    def _number(self, name: str, value: Any) -> Tensor:
        return xp.real(name, value, self.physical.values)

    def _values(self, parameters: Tensor | None) -> dict[str, Tensor]:
        return self._named(self._vector(parameters))

    def _named(self, vector: Tensor) -> dict[str, Tensor]:
        return dict(zip(self.names, vector.unbind(-1), strict=True))

    def _vector(self, parameters: Tensor | None) -> Tensor:
        if parameters is None:
            return self.physical()
        vector = self._counted(
            parameters, parameters.shape[-1] if parameters.ndim else 0, parameters.shape
        )
        self._in_range(self._named(vector))
        return vector


def _like(by: Any, values: Any) -> Any:
    """Return values as a record, or a tuple, like `by`."""
    return type(by)(*values) if hasattr(by, "_fields") else values
