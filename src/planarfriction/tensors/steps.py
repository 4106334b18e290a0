"""Evaluations and steps of a model over `xp`, and the interface of every tensor model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any, ClassVar, NamedTuple

from planarfriction._support import validation
from planarfriction.derivatives.parameters import PARAMETERS, check_range
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.laws import FrictionLaw
from planarfriction.laws.base import refuse_creep, refuse_rate_law
from planarfriction.patch import ContactPatch
from planarfriction.tensors.namespace import (
    Namespace,
    broadcast,
    finite,
    non_negative,
    shaped,
)
from planarfriction.tensors.pressure import Pressed, centre_of, follow

LAW = PARAMETERS[:8]
"""Parameters of the friction law; the others describe the shape of the patch."""


class ContactArrays(NamedTuple):
    """A law and a patch, ready for one evaluation or for all steps of a rollout."""

    law: LawNumbers
    """Broadcasts with the components of bristles."""
    shape: Any
    """Numbers of the patch as the model's equations know them."""


def evaluate(
    xp: Any, equations: Any, contact: ContactArrays, state: Any, twist: Any, load: Any
) -> tuple[Any, Any]:
    """Return the rate of the state, and the wrench `[..., 3]`."""
    by = equations.drive(xp, *contact, twist)
    law, shape = contact
    z = equations.wide(state)
    rate, pull = equations.evaluate(xp, law, shape, z, by, inner(load))
    return equations.narrow(rate), load[..., None] * equations.wrench(xp, shape, pull)


def step(
    xp: Any,
    equations: Any,
    contact: ContactArrays,
    state: Any,
    twist: Any,
    load: Any,
    dt: Any,
) -> tuple[Any, Any]:
    """Return the state after `dt` [s] of a constant twist, and the wrench at the end; without load bristles relax."""
    given = (contact.law.sigma_0, state, twist)
    z = equations.wide(xp.widened(state))
    by = equations.drive(xp, *contact, xp.widened(twist))
    new, pull = advance(xp, equations, contact, z, by, load, dt)
    wrench = load[..., None] * equations.wrench(xp, contact.shape, pull)
    return xp.narrowed(equations.narrow(new), *given), xp.narrowed(wrench, *given)


def advance(
    xp: Any, equations: Any, contact: ContactArrays, z: Any, by: Any, load: Any, dt: Any
) -> tuple[Any, Any]:
    """Return the bristles `[..., d, N]` after `dt`, zeros of contacts without load, and the tractions per unit load."""
    load = inner(load)
    new, pull = equations.advance(xp, *contact, z, by, load, inner(dt))
    return xp.where(load > 0.0, new, 0.0), pull


def inner(value: Any) -> Any:
    """Return one value for each contact `[...]` with axes of length 1 for those of its bristles."""
    return value[..., None, None]


class TensorModel:
    """A friction model over `xp`; the caller holds the state, and everything is about the contact frame's origin.

    `twist` `[..., 3]` is `(vx, vy, omega)` of the moving body, the wrench `(fx, fy, tau)` acts on it, `normal_force`
    `[...]` is >= 0; leading batch axes of these, of the state and of `dt` broadcast. `parameters`, physical values by
    number in the model's order, replace the model's own.

    Raises InvalidValueError for inputs that are no numbers and for wrong shapes; where values can be read without
    waiting, also for values that are not finite and for loads and steps below zero. Elsewhere, as on a device and
    inside `jit`, `vmap`, `grad` and `torch.compile`, these count as zero (friction never drives), and NaN stays NaN.
    """

    xp: ClassVar[Namespace]
    equations: ClassVar[ModuleType]
    """Module of the model's `drive`, `evaluate`, `advance` and `wrench`."""
    elasto_plastic: bool
    compliance: Any
    """Common compliance of a pad `[3, 3]`, or None."""

    @staticmethod
    def refuse(patch: ContactPatch, law: FrictionLaw, name: str) -> None:
        """Raise InvalidValueError unless patch and law are ones that the model `name` can be made of."""
        validation.instance("patch", patch, ContactPatch, "a ContactPatch")
        refuse_rate_law(law, name)
        refuse_creep(law, name)

    @property
    def state_shape(self) -> tuple[int, ...]:
        """Shape of the state of one contact."""
        return (3,)

    def rate(
        self,
        state: Any,
        twist: Any,
        normal_force: Any,
        *,
        moments: Any = None,
        parameters: Any = None,
    ) -> Any:
        """Return the rate of the state, of its shape; `moments` as in `step`. Only on a pad the load changes it."""
        return self._evaluated(state, twist, normal_force, parameters, moments)[0]

    def wrench(
        self,
        state: Any,
        twist: Any,
        normal_force: Any,
        *,
        moments: Any = None,
        parameters: Any = None,
    ) -> Any:
        """Return the friction wrench on the moving body, `[..., 3]` [N, N, N m]; `moments` as in `step`."""
        return self._evaluated(state, twist, normal_force, parameters, moments)[1]

    def step(
        self,
        state: Any,
        twist: Any,
        normal_force: Any,
        dt: Any,
        *,
        moments: Any = None,
        parameters: Any = None,
    ) -> tuple[Any, Any]:
        """Return the state after `dt` [s] of a constant twist, and the wrench at the end.

        Stable at any `dt`; the bristles of a contact without load relax. With `moments` `[..., 2]` [N m] the pressure
        follows them, as in `planarfriction.models.FrictionModel.step`.
        """
        inputs, pressed = self._inputs_pressed(
            state, twist, normal_force, parameters, moments
        )
        return self.step_pressed(
            pressed, *inputs, non_negative(self.xp, "dt", self._number("dt", dt))
        )

    def pressed(self, centre: Any, parameters: Any = None) -> Pressed:
        """Return the model with its pressure about `centre` `[..., 2]` [m], for any number of steps."""
        return follow(self.xp, self.equations, self._contact_at(parameters), centre)

    def step_pressed(
        self, pressed: Pressed, state: Any, twist: Any, load: Any, dt: Any
    ) -> tuple[Any, Any]:
        """Return state and wrench after a step of the model that `pressed` has returned, with inputs as arrays."""
        new, wrench = step(
            self.xp,
            self.equations,
            pressed.contact,
            state,
            pressed.seen(self.xp, twist),
            load,
            dt,
        )
        return new, pressed.pull(self.xp, wrench)

    def evaluate_pressed(
        self, pressed: Pressed, state: Any, twist: Any, load: Any
    ) -> tuple[Any, Any]:
        """Return rate and wrench of the model that `pressed` has returned, with inputs as arrays."""
        seen = pressed.seen(self.xp, twist)
        rate, wrench = evaluate(
            self.xp, self.equations, pressed.contact, state, seen, load
        )
        return rate, pressed.pull(self.xp, wrench)

    def _values(self, parameters: Any) -> dict[str, Any]:
        """Return physical values by name, from `parameters` or, if None, the model's own."""
        raise NotImplementedError

    def _shape(self, values: Mapping[str, Any]) -> Any:
        """Return the numbers of the patch; physical values broadcast with the components of bristles."""
        raise NotImplementedError

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the physical parameters, in the order of their vector."""
        raise NotImplementedError

    def _counted(self, parameters: Any, count: int, shape: Sequence[int]) -> Any:
        """Return `parameters`; raise InvalidValueError unless there are as many as names."""
        if count != len(self.names):
            rule = f"have shape [..., {len(self.names)}] ({', '.join(self.names)})"
            raise InvalidValueError("parameters", rule, f"shape {list(shape)}")
        return parameters

    def _in_range(self, values: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return physical values; raise InvalidValueError for one that can be read and is out of its range."""
        for name, value in values.items():
            seen = self.xp.extremes(name, value)
            if seen is not None:
                check_range(name, *seen)
        return values

    def _number(self, name: str, value: Any) -> Any:
        return self.xp.real(name, value)

    def _contact_at(self, parameters: Any) -> ContactArrays:
        return self._prepared(self._values(parameters))

    def _prepared(self, values: Mapping[str, Any]) -> ContactArrays:
        """Return the model at physical values `[...]`."""
        wide = {name: inner(value) for name, value in values.items()}
        law = LawNumbers(
            **{name: wide[name] for name in LAW},
            elasto_plastic=float(self.elasto_plastic),
        )
        return ContactArrays(law, self._shape(wide))

    def _evaluated(
        self, state: Any, twist: Any, normal_force: Any, parameters: Any, moments: Any
    ) -> tuple[Any, Any]:
        inputs, pressed = self._inputs_pressed(
            state, twist, normal_force, parameters, moments
        )
        return self.evaluate_pressed(pressed, *inputs)

    def _inputs_pressed(
        self, state: Any, twist: Any, normal_force: Any, parameters: Any, moments: Any
    ) -> tuple[tuple[Any, Any, Any], Pressed]:
        """Return checked inputs, whose twists have the axes of moments too, and the model under these."""
        z, v, load = self._inputs(state, twist, normal_force)
        if moments is None:
            return (z, v, load), Pressed(self._contact_at(parameters), None)
        held = finite(
            self.xp,
            "moments",
            shaped("moments", self._number("moments", moments), (2,)),
        )
        shapes = {
            "twist": v.shape[:-1],
            "normal_force": load.shape,
            "moments": held.shape[:-1],
        }
        batch = broadcast(self.xp, "batch axes", "broadcast", shapes)
        v = self.xp.broadcast_to(v, (*batch, 3))
        return (z, v, load), self.pressed(centre_of(self.xp, held, load), parameters)

    def _inputs(
        self, state: Any, twist: Any, normal_force: Any
    ) -> tuple[Any, Any, Any]:
        """Return checked state, twist and load as arrays whose batch axes broadcast."""
        z = shaped("state", self._number("state", state), self.state_shape)
        v = shaped("twist", self._number("twist", twist), (3,))
        load = self._number("normal_force", normal_force)
        batch = z.shape[: z.ndim - len(self.state_shape)]
        shapes = {"state": batch, "twist": v.shape[:-1], "normal_force": load.shape}
        broadcast(self.xp, "batch axes", "broadcast", shapes)
        load = non_negative(self.xp, "normal_force", load)
        return finite(self.xp, "state", z), finite(self.xp, "twist", v), load
