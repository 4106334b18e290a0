# pyright: reportAttributeAccessIssue=false, reportPrivateImportUsage=false
"""Steps of MJX with patch friction, implicit in contact space."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np
from mujoco import mjx

from planarfriction import models
from planarfriction._engine.coupled import placing
from planarfriction._support import validation
from planarfriction.adapters.mjx import newton, responses
from planarfriction.adapters.mujoco.friction import Report
from planarfriction.adapters.mujoco.patches import (
    PatchContact,
    Placed,
    check_once,
    check_options,
    memory,
    misplaced_line,
    parameters_in,
    place_of_parameters,
    surface_velocities,
)
from planarfriction.coupling import ITERATIONS, TOLERANCE
from planarfriction.environments import SHAPE, check, defaults
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LIGHTEST
from planarfriction.jax import DistributedModel, ReducedModelPublished
from planarfriction.jax.base import FrictionPytree
from planarfriction.jax.namespace import xp
from planarfriction.models.base import lever_of, refuse_common
from planarfriction.tensors.pressure import twist_at, wrench_from
from planarfriction.tensors.steps import LAW

PASSES = 4
"""Number of new solutions of a step because it has activated other constraints."""

SLACK = {"float64": 1e-10, "float32": 1e-6}
"""Speed [m/s] to which the active constraints have to hold, by precision."""


class _Search(NamedTuple):
    """State from which the search for the active constraints continues."""

    active: responses.Active
    wrench: jax.Array
    """`[3k]`"""
    centre: jax.Array
    """Centres of pressure at the wrenches from which the search began `[k, 2]` [m]."""
    acceleration: jax.Array
    iterations: jax.Array
    passes: jax.Array
    residual: jax.Array
    converged: jax.Array
    """True if the residual in contact space is within the tolerance."""
    slack: jax.Array


class _Own(NamedTuple):
    """Friction of one environment."""

    models: list[FrictionPytree]
    """Model of each group of patches, with their parameters."""
    scale: jax.Array
    """Sizes of the patches as multiples of their models', `[k]`."""
    displaced: jax.Array
    """Displacements of the patches in their frames `[k, 2]` [m]."""


@dataclass(frozen=True, eq=False)
class _Fixed:
    """Parts that do not change with parameters: compared by identity, as one function is compiled for them."""

    placed: list[Placed]
    said: set[str]
    """Warnings that have been given."""
    places: responses.PatchPlaces
    which: tuple[int, ...]
    """The model of each patch."""
    follows: tuple[bool, ...]
    """True for patches whose pressure follows their contact forces."""
    shapes: tuple[tuple[int, ...], ...]
    """Shapes of the states."""
    memory: Any
    """Places of the memory of the patches in `userdata`."""
    nuserdata: int
    numbers: dict[str, np.ndarray]
    """Parameters in the model of MuJoCo, `[k]` each."""


@jax.tree_util.register_pytree_node_class
class Friction:
    """Patch friction for a model that `prepare` has prepared; call `step` instead of `mjx.step`.

    States are stored in the data, in the last numbers of `userdata`, in the same way as by
    `planarfriction.adapters.mujoco`, so that data can be moved from one to the other. This is a pytree whose leaves are
    those of its `models` (`planarfriction.jax`), one for each different model among the patches, and its `parameters`,
    by name, which replace numbers of these models.

    Raises `InvalidValueError` for an unsuitable integrator or cone, noslip iterations, too little user data, names that
    are not in the model, pairs with friction of their own, models that JAX does not have, and shapes that change with
    the load.
    """

    def __init__(self, m: Any, patches: Sequence[PatchContact]) -> None:
        check_once(patches)
        placed = [Placed(m, patch) for patch in patches]
        cone = ": MJX supports contacts without friction only with these"
        check_options(m, "Euler", "implicitfast", cone=cone, sleeps=True)
        for each in placed:
            each.check(m)
        known = list({id(patch.model): patch.model for patch in patches}.values())
        self.models: tuple[FrictionPytree, ...] = tuple(map(_in_jax, known))
        at = memory(patches, m.nv, m.nuserdata)
        which = tuple(
            next(i for i, model in enumerate(known) if model is patch.model)
            for patch in patches
        )
        radius = np.array([lever_of(patch.model) for patch in patches])
        shapes = tuple(self.models[i].state_shape for i in which)
        follows = tuple(each.follows for each in placed)
        numbers = {
            name: view.copy()
            for name, view in parameters_in(
                m, place_of_parameters(m), len(patches)
            ).items()
        }
        made = zip(
            numbers,
            np.array([defaults(patch.model.law) for patch in patches]).T,
            strict=True,
        )
        changed = {
            name: jnp.asarray(numbers[name])
            for name, own in made
            if (numbers[name] != own).any()
        }
        self.parameters: dict[str, jax.Array] = changed
        columns = {
            name: np.array([getattr(each, name) for each in placed])
            for name in responses.PatchPlaces._fields[:8]
        }
        reach = np.array([placing.reach_of(patch.model.patch) for patch in patches])
        places = responses.PatchPlaces(
            **columns,
            reach=reach,
            radius=radius,
            surface=surface_velocities(m, placed),
        )
        self._fixed = _Fixed(
            placed,
            set(),
            places,
            which,
            follows,
            shapes,
            at,
            m.nuserdata,
            check(numbers),
        )

    def replace(self, models: Sequence[FrictionPytree]) -> Self:
        """Return the same patches with other models, which must be of the same kinds in the same order.

        Raises InvalidValueError for models of other kinds.
        """
        kinds, given = (
            [type(model).__name__ for model in each] for each in (self.models, models)
        )
        if given != kinds or not all(
            isinstance(model, FrictionPytree) for model in models
        ):
            rule = f"be models of planarfriction.jax: {', '.join(kinds)}"
            raise InvalidValueError("models", rule, ", ".join(given))
        return self.tree_unflatten(self._fixed, (tuple(models), self.parameters))

    def with_parameters(self, parameters: Mapping[str, Any]) -> Self:
        """Return the same patches with other parameters, by the names of `pf.randomise`: numbers, or `[k]`.

        With an array for each environment, call this in a function for one, under `jax.vmap`. Names that are not given
        stay as they are.

        Raises InvalidValueError for unknown names, other shapes, and, where values can be read, those that break the
        rule of a parameter.
        """
        k = len(self._fixed.which)
        validation.keys("parameters", parameters, (), self._fixed.numbers)
        given = {name: jnp.asarray(value) for name, value in parameters.items()}
        for name, value in given.items():
            if value.shape not in ((), (k,)):
                raise InvalidValueError(
                    name,
                    f"be a number or have shape [{k}]: see jax.vmap",
                    list(value.shape),
                )
        held = {**self._fixed.numbers, **self.parameters, **given}
        check(
            {
                name: np.asarray(value)
                for name, value in held.items()
                if not isinstance(value, jax.core.Tracer)
            }
        )
        return self.tree_unflatten(
            self._fixed, (self.models, {**self.parameters, **given})
        )

    def tree_flatten(self) -> tuple[Any, _Fixed]:
        """Take the pytree apart (called by JAX)."""
        return (self.models, self.parameters), self._fixed

    @classmethod
    def tree_unflatten(cls, fixed: _Fixed, leaves) -> Self:
        """Rebuild the pytree (called by JAX)."""
        friction = object.__new__(cls)
        friction._fixed = fixed
        (friction.models, friction.parameters) = leaves
        return friction

    # ------------------------------------------------------------------ what the data hold

    def states(self, d: Any) -> list[jax.Array]:
        """Return the state of each patch at the current time of the data."""
        at = self._fixed.memory
        sizes = [math.prod(shape) for shape in self._fixed.shapes]
        flat = self._now(d, at.after, at.state, sum(sizes))
        parts = jnp.split(flat, np.cumsum(sizes)[:-1], axis=-1)
        return [
            z.reshape(*z.shape[:-1], *shape)
            for z, shape in zip(parts, self._fixed.shapes, strict=True)
        ]

    def wrenches(self, d: Any) -> jax.Array:
        """Return the wrenches of the last step on the sites' bodies, in the patches' frames `[k, 3]` [N, N, N m]."""
        return self._each(d, self._fixed.memory.wrench, 3)

    def twists(self, d: Any) -> jax.Array:
        """Return the last mean twists `[k, 3]` [m/s, m/s, rad/s] of the sites' bodies relative to the others."""
        return self._each(d, self._fixed.memory.twist, 3)

    def loads(self, d: Any) -> jax.Array:
        """Return the normal forces at the end of the last step `[k]` [N]."""
        return self._each(d, self._fixed.memory.load, 1)[..., 0]

    def report(self, d: Any) -> Report:
        """Return the statistics of the last step."""
        self._warn(d)
        at = self._fixed.memory
        u = d.userdata
        converged = u[..., at.converged] > 0.0
        return Report(
            u[..., at.iterations], u[..., at.passes], u[..., at.residual], converged
        )

    def misplaced(self, d: Any) -> str | None:
        """Return a line about a patch that did not lie in its contact in the last step, None if all did.

        It is that of any environment; see `planarfriction.adapters.mujoco`. What is read from data outside of compiled
        functions, and steps outside of them, warn of it once.
        """
        return misplaced_line(
            self._fixed.placed, int(d.userdata[..., self._fixed.memory.misplaced].max())
        )

    def _warn(self, d: Any) -> None:
        """Warn, once, of a patch that did not lie in its contact, where data can be read."""
        line = None if isinstance(d.userdata, jax.core.Tracer) else self.misplaced(d)
        if line is not None and line not in self._fixed.said:
            self._fixed.said.add(line)
            warnings.warn(line, stacklevel=4)

    def reset(self, d: Any) -> Any:
        """Return the data with all bristles relaxed."""
        at = self._fixed.memory
        return d.replace(
            userdata=d.userdata.at[..., at.before : at.converged + 1].set(0.0)
        )

    def _each(self, d: Any, first: int, count: int) -> jax.Array:
        self._warn(d)
        k = len(self._fixed.which)
        return d.userdata[..., first : first + count * k].reshape(
            *d.userdata.shape[:-1], k, count
        )

    def _now(self, d: Any, after: int, before: int, count: int) -> jax.Array:
        """Return values at the time of the data: those of the end of the last step, or of its beginning, else zeros."""
        at = self._fixed.memory
        u = d.userdata
        ends = d.time == u[..., at.next]
        begins = d.time == u[..., at.time]
        begun = jnp.where(begins[..., None], u[..., before : before + count], 0.0)
        return jnp.where(ends[..., None], u[..., after : after + count], begun)

    # ------------------------------------------------------------------ a step

    def step(self, m: Any, d: Any) -> Any:
        """Take a step with patch friction, a pure function of JAX instead of `mjx.step`.

        Raises InvalidValueError for a model of MJX in another implementation, data of another precision than JAX's own,
        and data without their user data.
        """
        self._check_inputs(m, d)
        given = d
        dt = m.opt.timestep
        at = self._fixed.memory
        states = self.states(d)
        guess = self._now(d, at.wrench, at.guess, 3 * len(self._fixed.which))
        held = self._now(d, at.centre, at.held, 3 * len(self._fixed.which)).reshape(
            -1, 3
        )
        before = self._now(d, at.axis, at.before, 3 * len(self._fixed.which)).reshape(
            -1, 3
        )
        own = self._own()
        d = _moved(m, d)
        begun = states
        where = responses.geometry(m, d, self._fixed.places, held, before)
        states = [where.carry(p, each) for p, each in enumerate(begun)]
        guess = jnp.stack(
            [where.carry(p, each) for p, each in enumerate(guess.reshape(-1, 3))]
        )
        guess = wrench_from(xp, guess, own.displaced).ravel()
        guess = jnp.where(jnp.repeat(where.touching, 3), guess, 0.0)
        found = self._search(*jax.lax.stop_gradient((own, m, d, where, states, guess)))
        answer = responses.answer(m, d, where, found.active)
        # That of the search, with its derivatives.
        centre = where.centres(answer.forces(d, guess))
        shift, pressed = self._pressed(
            own, where, found.centre + centre - jax.lax.stop_gradient(centre)
        )
        unit = self._unit(own, pressed, shift, states, dt)
        wrench = newton.fitting(unit, answer.host, found.wrench)
        twist = answer.host.twists(wrench)
        load = answer.host.loads(wrench)
        new, _ = self._evaluate(own, pressed, shift, states, twist, load, dt)
        d = self._integrated(m, d, where.jacobian, wrench, answer)
        kept = {
            "state": begun,
            "after": new,
            "guess": guess,
            "load": load,
            "held": held,
            "centre": where.moved(shift),
        }
        kept |= {"before": before, "axis": where.axes[:, 0]}
        kept |= {
            "misplaced": where.misplaced(
                load, found.centre - own.displaced, own.scale, self._fixed.places.reach
            )
        }
        shift = shift + own.displaced
        kept |= {
            "wrench": wrench_from(xp, wrench.reshape(-1, 3), -shift),
            "twist": twist_at(xp, twist, shift),
        }
        kept |= {
            "time": given.time,
            "next": d.time,
            "iterations": found.iterations,
            "passes": found.passes,
        }
        holds = found.slack <= SLACK[found.slack.dtype.name]
        kept |= {"residual": found.residual, "converged": found.converged & holds}
        d = d.replace(userdata=self._written(d.userdata, kept))
        self._warn(d)
        # in double precision MJX makes long integers of some that came in short, at which `lax.scan` would stop
        return jax.tree.map(lambda after, before: after.astype(before.dtype), d, given)

    def _check_inputs(self, m: Any, d: Any) -> None:
        """Refuse models and data that a step cannot take."""
        if m.impl != mjx.Impl.JAX:
            raise InvalidValueError(
                "impl", "be JAX's: mjx.put_model(m, impl='jax')", m.impl.value
            )
        if d.qpos.dtype != jnp.result_type(float):
            rule = f"be {jnp.result_type(float)}, that of JAX (see jax_enable_x64)"
            raise InvalidValueError("precision", rule, f"data of {d.qpos.dtype}")
        count = self._fixed.nuserdata
        if d.userdata.shape != (count,):
            rule = f"have shape [{count}]: of one environment, of the model of the patches (see jax.vmap)"
            raise InvalidValueError("userdata", rule, f"shape {list(d.userdata.shape)}")

    def _own(self) -> _Own:
        """Return the friction of the environment."""
        k = len(self._fixed.which)
        models = []
        values = {
            name: jnp.broadcast_to(value, (k,))
            for name, value in self.parameters.items()
        }
        for number, _, own in self._groups():
            model = self.models[number]
            law = self.models[number].parameters
            changed = {
                name: values[name][np.array(own)]
                for name in LAW
                if name in values and name in law._fields
            }
            models.append(
                model.replace(parameters=law._replace(**changed)) if changed else model
            )
        scale, *centre = (
            values.get(name, jnp.full(k, own)) for name, own in SHAPE.items()
        )
        return _Own(models, scale, jnp.stack(centre, axis=1))

    def _search(
        self, own: _Own, m, d, where: responses.Geometry, states, guess
    ) -> _Search:
        """Find the constraints that are active in the end, and the wrenches, without derivatives."""
        applied = d.qfrc_applied
        dt = m.opt.timestep
        radius = own.scale * self._fixed.places.radius

        def body(last: _Search) -> _Search:
            pushed = mjx.fwd_acceleration(
                m, d.replace(qfrc_applied=applied + last.wrench @ where.jacobian)
            )
            active = responses.active_rows(
                mjx.solve(m, pushed.replace(qacc_warmstart=last.acceleration))
            )
            answer = responses.answer(m, d, where, active)
            centre = jnp.where(
                last.passes == 0,
                where.centres(answer.forces(d, last.wrench)),
                last.centre,
            )
            shift, pressed = self._pressed(own, where, centre)
            unit = self._unit(own, pressed, shift, states, dt)
            solved = newton.solve(
                unit, answer.host, last.wrench, radius, TOLERANCE, ITERATIONS
            )
            acceleration = answer.acceleration(solved.wrench)
            slack = responses.slack(
                d, active, responses.active_at(d, acceleration), acceleration, dt
            )
            iterations = last.iterations + solved.iterations
            passes = last.passes + 1
            ends = solved.residual, solved.converged, slack
            return _Search(
                active, solved.wrench, centre, acceleration, iterations, passes, *ends
            )

        def unsettled(last: _Search) -> jax.Array:
            return (last.passes == 0) | (
                (last.slack > SLACK[last.slack.dtype.name]) & (last.passes < PASSES)
            )

        none = jnp.zeros(where.rows.shape[1])
        zero = jnp.asarray(0.0)
        count = jnp.asarray(0)
        active = responses.Active(none > 0.0, none)
        middle = jnp.zeros((len(where.rows), 2))
        start = _Search(
            active,
            guess,
            middle,
            d.qacc_warmstart,
            count,
            count,
            zero,
            zero > 0.0,
            zero,
        )
        return jax.lax.while_loop(unsettled, body, start)

    def _groups(self) -> Iterator[tuple[int, bool, list[int]]]:
        """Yield patches that are evaluated side by side: their model, and True if their pressures follow."""
        kinds = list(zip(self._fixed.which, self._fixed.follows, strict=True))
        for kind in dict.fromkeys(kinds):
            yield *kind, [p for p, each in enumerate(kinds) if each == kind]

    def _pressed(
        self, own: _Own, where: responses.Geometry, centre: jax.Array
    ) -> tuple[jax.Array, list[Any]]:
        """Return displacements towards centres `[k, 2]`, and each group's model that presses there, None if fixed."""
        shift = where.share[:, None] * centre
        rest = (centre - shift - own.displaced) / own.scale[:, None]
        groups = zip(self._groups(), own.models, strict=True)
        return shift, [
            model.pressed(rest[np.array(at)]) if follow else None
            for (_, follow, at), model in groups
        ]

    def _unit(self, own: _Own, pressed, shift, states, dt) -> newton.UnitLoadFriction:
        """Return the friction of steps, per unit load; that of pads depends on the loads."""
        by_load = any(model.stiffness is not None for model in own.models)

        def wrench(twist, load):
            load = jnp.maximum(load, LIGHTEST) if by_load else jnp.ones_like(load)
            return (
                self._evaluate(own, pressed, shift, states, twist, load, dt)[1]
                / load[:, None]
            )

        return newton.UnitLoadFriction(wrench, by_load)

    def _evaluate(
        self, own: _Own, pressed, shift, states, twist, load, dt
    ) -> tuple[list[jax.Array], jax.Array]:
        """Return the new states and wrenches of steps; patches of the same model side by side."""
        shift = shift + own.displaced
        resize = jnp.ones((len(states), 3)).at[:, 2].set(own.scale)
        twist = resize * twist_at(xp, twist, shift)
        new = [jnp.empty(0)] * len(states)
        wrenches = [jnp.empty(0)] * len(states)
        for (_, _, at), model, followed in zip(
            self._groups(), own.models, pressed, strict=True
        ):
            index = np.array(at)
            given = jnp.stack([states[p] for p in at]), twist[index], load[index], dt
            after, wrench = (
                model.step(*given)
                if followed is None
                else model.step_pressed(followed, *given)
            )
            for i, p in enumerate(at):
                new[p] = after[i]
                wrenches[p] = wrench[i]
        return new, wrench_from(xp, resize * jnp.stack(wrenches), shift)

    def _integrated(
        self, m, d, jacobian, wrench, answer: responses.WrenchResponse
    ) -> Any:
        """Return the data after the step, with the forces of the user as they were."""
        applied = d.qfrc_applied
        d = mjx.fwd_acceleration(m, d.replace(qfrc_applied=applied + wrench @ jacobian))
        force = answer.forces(d, wrench)
        d = d.replace(
            qacc=answer.acceleration(wrench), qfrc_constraint=force @ d._impl.efc_J
        )
        d = mjx.sensor_acc(m, d.tree_replace({"_impl.efc_force": force}))
        return responses.integrate(m, d).replace(qfrc_applied=applied)

    def _written(self, userdata: jax.Array, kept: dict[str, Any]) -> jax.Array:
        """Return the user data with the memory for the next step and the results for users."""
        for name, value in kept.items():
            flat = (
                jnp.concatenate([jnp.ravel(each) for each in value])
                if isinstance(value, list)
                else jnp.ravel(value)
            )
            first = getattr(self._fixed.memory, name)
            userdata = userdata.at[first : first + len(flat)].set(
                flat.astype(userdata.dtype)
            )
        return userdata


def _moved(m: Any, d: Any) -> Any:
    """Run `mjx.forward` up to the forces of the constraints, without patch friction."""
    d = mjx.sensor_pos(m, mjx.fwd_position(m, d))
    d = mjx.sensor_vel(m, mjx.fwd_velocity(m, d))
    return mjx.fwd_acceleration(m, mjx.fwd_actuation(m, d))


def _in_jax(model: models.FrictionModel) -> FrictionPytree:
    """Return the JAX form of a model of NumPy."""
    if model.depends_on_load:
        rule = (
            "have a shape that does not change with the load: models of JAX keep theirs"
        )
        raise InvalidValueError("model", rule, type(model).__name__)
    model = model.reduction
    if isinstance(model, models.ReducedModelPublished):
        return ReducedModelPublished(model.patch, model.law, model.surface)
    if isinstance(model, models.DistributedModel):
        refuse_common(model, "MJX")
        return DistributedModel(model.patch, model.law, pad=model.pad)
    raise InvalidValueError(
        "model", "be one that planarfriction.jax has", type(model).__name__
    )
