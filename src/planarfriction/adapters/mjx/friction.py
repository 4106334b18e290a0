# pyright: reportAttributeAccessIssue=false, reportPrivateImportUsage=false
"""Steps of MJX with patch friction, implicit in contact space."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco import mjx

from planarfriction import models
from planarfriction.adapters.mjx import newton, responses
from planarfriction.adapters.mjx.geometry import Places, geometry, places
from planarfriction.adapters.mujoco.patches import Patch, Placed, check_once, words
from planarfriction.coupling import ITERATIONS, TOLERANCE
from planarfriction.errors import InvalidValueError
from planarfriction.jax import DistributedModel, ReducedModel, ReducedModelPublished
from planarfriction.jax.base import FrictionModel

INTEGRATORS = {
    int(mujoco.mjtIntegrator.mjINT_EULER): "Euler",
    int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST): "implicitfast",
}

PASSES = 4
"""How often a step is solved anew where other constraints have become active through it."""

SLACK = 1e-10
"""Speed [m/s] to which the active constraints have to hold."""


class Report(NamedTuple):
    """What a step took, and what came out in the frames of the patches."""

    iterations: jax.Array
    """Newton iterations of all passes."""
    passes: jax.Array
    residual: jax.Array
    """Of the step in contact space [m/s]."""
    slack: jax.Array
    """Largest speed at which a constraint is on the wrong side of its range [m/s]."""
    converged: jax.Array
    twist: jax.Array
    """`[k, 3]` [m/s, m/s, rad/s]"""
    wrench: jax.Array
    """`[k, 3]` [N, N, N m]"""
    normal_force: jax.Array
    """`[k]` [N]"""


@dataclass(frozen=True, eq=False)
class _Fixed:
    """What does not change with parameters: compared by identity, as one function is compiled for it."""

    places: Places
    which: tuple[int, ...]
    """The model of each patch."""
    shapes: tuple[tuple[int, ...], ...]
    """Of the states."""
    radius: np.ndarray
    first: int
    """Where the states begin in `userdata`."""

    @property
    def size(self) -> int:
        """Numbers of all states."""
        return sum(math.prod(shape) for shape in self.shapes)


@jax.tree_util.register_pytree_node_class
class Friction:
    """Patch friction for a model that `prepare` has made ready; `step` takes the place of `mjx.step`.

    States live in `userdata` of the data, where `planarfriction.adapters.mujoco` keeps them too. A pytree whose leaves
    are those of its `models` (`planarfriction.jax`), one for each different model of the patches.

    Raises `InvalidValueError` without double precision, for an integrator or a cone that does not fit, noslip
    iterations, too little user data, names that are not in the model, pairs with friction of their own, models that
    JAX does not have and patches whose shape depends on the load.
    """

    def __init__(self, m: Any, patches: Sequence[Patch]) -> None:
        check_once(patches)
        placed = [Placed(m, patch) for patch in patches]
        _check(m, patches, placed)
        known = list({id(patch.model): patch.model for patch in patches}.values())
        self.models: tuple[FrictionModel, ...] = tuple(map(_in_jax, known))
        which = tuple(next(i for i, model in enumerate(known) if model is patch.model) for patch in patches)
        radius = np.array([np.sqrt((patch.model.patch.positions**2).sum(1).mean()) for patch in patches])
        shapes = tuple(self.models[i].rest().shape for i in which)
        self._fixed = _Fixed(places(placed), which, shapes, radius, m.nuserdata - words(patches))

    def replace(self, models: Sequence[FrictionModel]) -> Self:
        """The same patches with other models."""
        return self.tree_unflatten(self._fixed, (tuple(models),))

    def tree_flatten(self):
        return (self.models,), self._fixed

    @classmethod
    def tree_unflatten(cls, fixed: _Fixed, leaves) -> Self:
        friction = object.__new__(cls)
        friction._fixed, (friction.models,) = fixed, leaves
        return friction

    # ------------------------------------------------------------------ what the data hold

    def states(self, d: Any) -> list[jax.Array]:
        """State of each patch."""
        fixed, found = self._fixed, []
        first = fixed.first
        for shape in fixed.shapes:
            found.append(d.userdata[..., first : first + math.prod(shape)].reshape(*d.userdata.shape[:-1], *shape))
            first += math.prod(shape)
        return found

    def wrenches(self, d: Any) -> jax.Array:
        """Of the last step `[k, 3]`: the guess of the next."""
        first, count = self._fixed.first + 2 * self._fixed.size, len(self._fixed.which)
        return d.userdata[..., first : first + 3 * count].reshape(*d.userdata.shape[:-1], count, 3)

    def reset(self, d: Any) -> Any:
        """The data with all bristles at rest."""
        return d.replace(userdata=d.userdata.at[..., self._fixed.first :].set(0.0))

    # ------------------------------------------------------------------ a step

    def step(self, m: Any, d: Any) -> Any:
        """`mjx.step` with friction: a pure function for `jit`, `vmap` and `grad`."""
        return self.step_report(m, d)[0]

    def step_report(self, m: Any, d: Any) -> tuple[Any, Report]:
        """`step`, and what it took."""
        if d.qpos.dtype != jnp.float64:
            _refuse_precision(f"data of {d.qpos.dtype}")
        before, applied, dt = d, d.qfrc_applied, m.opt.timestep
        d = _moved(m, d)
        jacobian, rows, touching = geometry(m, d, self._fixed.places)
        guess = jnp.where(touching[:, None], self.wrenches(d), 0.0).ravel()
        states = self.states(d)
        active, found = self._search(*jax.lax.stop_gradient((self.models, m, d, jacobian, rows, states, guess)))
        answer = responses.answer(m, d, jacobian, rows, active)

        def unit(twist):
            return self._evaluate(self.models, states, twist, jnp.ones(len(rows)), dt)[1]

        wrench = newton.fitting(unit, answer.host, found.wrench)
        twist, load = answer.host.twists(wrench), answer.host.loads(wrench)
        new, _ = self._evaluate(self.models, states, twist, load, dt)
        d = self._integrated(m, d, applied, jacobian, wrench, answer)
        # in double precision MJX makes long integers of some that came in short, at which `lax.scan` would stop
        d = jax.tree.map(lambda after, given: after.astype(given.dtype), self._kept(d, new, wrench), before)
        return d, found._replace(twist=twist, wrench=wrench.reshape(-1, 3), normal_force=load)

    def _search(self, models, m, d, jacobian, rows, states, guess) -> tuple[responses.Active, Report]:
        """Which constraints are active in the end, and the wrenches, without derivatives."""
        applied, dt, fixed = d.qfrc_applied, m.opt.timestep, self._fixed

        def unit(twist):
            return self._evaluate(models, states, twist, jnp.ones(len(rows)), dt)[1]

        def body(carry):
            _, report, start = carry
            w = report.wrench
            pushed = mjx.fwd_acceleration(m, d.replace(qfrc_applied=applied + w @ jacobian))
            active = responses.active_rows(mjx.solve(m, pushed.replace(qacc_warmstart=start)))
            answer = responses.answer(m, d, jacobian, rows, active)
            solved = newton.solve(unit, answer.host, w, jnp.asarray(fixed.radius), TOLERANCE, ITERATIONS)
            acceleration = answer.acceleration(solved.wrench)
            slack = responses.slack(d, active, responses.active_at(d, acceleration), acceleration, dt)
            report = Report(
                iterations=report.iterations + solved.iterations,
                passes=report.passes + 1,
                residual=solved.residual,
                slack=slack,
                converged=solved.converged & (slack <= SLACK),
                twist=report.twist,
                wrench=solved.wrench,
                normal_force=report.normal_force,
            )
            return active, report, acceleration

        def unsettled(carry):
            _, report, _ = carry
            return (report.passes == 0) | ((report.slack > SLACK) & (report.passes < PASSES))

        count, none = len(rows), jnp.zeros(d._impl.efc_J.shape[0])
        zero = jnp.asarray(0.0)
        report = Report(
            jnp.asarray(0), jnp.asarray(0), zero, zero, jnp.asarray(False), jnp.zeros((count, 3)), guess,
            jnp.zeros(count),
        )  # fmt: skip
        start = responses.Active(none > 0.0, none), report, d.qacc_warmstart
        active, report, _ = jax.lax.while_loop(unsettled, body, start)
        return active, report

    def _evaluate(self, models, states, twist, load, dt) -> tuple[list[jax.Array], jax.Array]:
        """New states and wrenches of steps; patches of the same model side by side."""
        new: list[Any] = [None] * len(states)
        wrenches: list[Any] = [None] * len(states)
        for number, model in enumerate(models):
            own = [p for p, i in enumerate(self._fixed.which) if i == number]
            index = np.array(own)
            after, wrench = model.step(jnp.stack([states[p] for p in own]), twist[index], load[index], dt)
            for i, p in enumerate(own):
                new[p], wrenches[p] = after[i], wrench[i]
        return new, jnp.stack(wrenches)

    def _integrated(self, m, d, applied, jacobian, wrench, answer: responses.Answer) -> Any:
        """The data after the step; forces of the user are theirs again."""
        d = mjx.fwd_acceleration(m, d.replace(qfrc_applied=applied + wrench @ jacobian))
        force = answer.forces(d, wrench)
        d = d.replace(qacc=answer.acceleration(wrench), qfrc_constraint=force @ d._impl.efc_J)
        d = mjx.sensor_acc(m, d.tree_replace({"_impl.efc_force": force}))
        return responses.integrate(m, d).replace(qfrc_applied=applied)

    def _kept(self, d, new, wrench) -> Any:
        """Put what the next step starts from into the user data."""
        first, size = self._fixed.first, self._fixed.size
        userdata = d.userdata.at[first : first + size].set(jnp.concatenate([z.ravel() for z in new]))
        first += 2 * size
        return d.replace(userdata=userdata.at[first : first + len(wrench)].set(wrench))


def _moved(m: Any, d: Any) -> Any:
    """All of `mjx.forward` up to the constraints' forces, which are without friction of ours."""
    d = mjx.sensor_pos(m, mjx.fwd_position(m, d))
    d = mjx.sensor_vel(m, mjx.fwd_velocity(m, d))
    return mjx.fwd_acceleration(m, mjx.fwd_actuation(m, d))


def _check(m: Any, patches: Sequence[Patch], placed: Sequence[Placed]) -> None:
    if not jax.config.jax_enable_x64:
        _refuse_precision("float32")
    if m.opt.integrator not in INTEGRATORS:
        rule = f"be {', '.join(INTEGRATORS.values())}"
        name = mujoco.mjtIntegrator(m.opt.integrator).name.removeprefix("mjINT_")
        raise InvalidValueError("integrator", rule, name)
    if m.opt.cone != mujoco.mjtCone.mjCONE_PYRAMIDAL:
        rule = "be pyramidal: MJX knows contacts without friction with these alone"
        raise InvalidValueError("cone", rule, mujoco.mjtCone(m.opt.cone).name.removeprefix("mjCONE_").lower())
    if m.opt.noslip_iterations > 0:
        rule = "be 0: they change what has been solved"
        raise InvalidValueError("noslip_iterations", rule, m.opt.noslip_iterations)
    for each in placed:
        each.check_step(m)
    if m.nuserdata < words(patches):
        raise InvalidValueError("nuserdata", f"be at least {words(patches)} (prepare adds them)", m.nuserdata)


def _refuse_precision(given: str) -> None:
    rule = 'be float64, as bristles need: jax.config.update("jax_enable_x64", True) before the data are made'
    raise InvalidValueError("precision", rule, given)


def _in_jax(model: models.FrictionModel) -> FrictionModel:
    """The model of JAX that a model of NumPy is."""
    if model.patch.depends_on_load:
        raise InvalidValueError("patch", "keep its shape at all loads in MJX", "one that depends on the load")
    if isinstance(model, models.ReducedModel):
        return ReducedModel(
            model.patch, model.law, parts=model.parts, segments=model.segments, speeds=model.speeds
        )
    if isinstance(model, models.ReducedModelPublished):
        return ReducedModelPublished(model.patch, model.law, model.surface)
    if isinstance(model, models.DistributedModel):
        return DistributedModel(model.patch, model.law)
    raise InvalidValueError("model", "be one that planarfriction.jax has", type(model).__name__)
