"""The interface of every friction model, and the checks of its inputs."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._engine.records.base import CompiledModel, StepJacobians
from planarfriction._engine.records.packed import PackedModel
from planarfriction._engine.records.pressing import Pressing
from planarfriction._support import validation
from planarfriction._support.equality import ByValue, by_parts, unusual
from planarfriction._support.pictures import picture
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LIGHTEST
from planarfriction.laws import FrictionLaw
from planarfriction.models.cell_loads import Cells, seen
from planarfriction.pads import Pad
from planarfriction.patch import ContactPatch
from planarfriction.patch.moment_pressure import centre_of, moments_of

BESIDE = "be None if loads of cells are given"
"""Rule for what takes the place of these."""


@by_parts
class ModelJacobians(NamedTuple):
    """Derivatives of the bristle rates and of the wrench; `[*s]` is the shape of the state without batch axes."""

    rate_state: np.ndarray
    """d rate / d state: distributed `[..., 2, 2, N]` (cell by cell), of three states `[..., 3, 3]`."""
    rate_twist: np.ndarray
    """d rate / d twist: distributed `[..., 2, N, 3]`, of three states `[..., 3, 3]`."""
    rate_load: np.ndarray
    """d rate / d normal_force of a fixed shape, `[..., *s]`: zero but for a fixed stiffness."""
    wrench_state: np.ndarray
    """d wrench / d state: distributed `[..., 3, 2, N]`, of three states `[..., 3, 3]`."""
    wrench_twist: np.ndarray
    """d wrench / d twist at a held state, `[..., 3, 3]`."""
    wrench_load: np.ndarray
    """d wrench / d normal_force of a fixed shape, `[..., 3]`."""


@dataclass(frozen=True, eq=False)
class FrictionModel(ByValue):
    """A contact patch with a friction law; the caller keeps the state.

    Twists and wrenches are about the contact frame's origin; the wrench acts on the moving body. Leading batch axes of
    state, twist `[..., 3]`, normal_force `[...]` and dt `[...]` broadcast. Without load (`normal_force == 0`) the
    bristles continue to move if `rate` is integrated, as published; `step` and `simulate` reset them, so that a contact
    that loses its load starts again from rest. Booleans are not accepted as numbers.

    Raises InvalidValueError unless `patch` is a ContactPatch and `law` a law of bristles.
    """

    patch: ContactPatch
    """Geometry of the contact, and how the load is distributed over it."""
    law: FrictionLaw
    """Law of the bristles, such as `LuGre`."""

    pad: ClassVar[Pad | None] = None
    """Pad under the patch, which models with bristles in cells can have (`DistributedModel`, `ReducedModel`)."""

    state_units: ClassVar[str] = "m"
    """Units of the state: one for all components, or one for each."""

    def __post_init__(self) -> None:
        super().__post_init__()
        validation.instance("patch", self.patch, ContactPatch, "a ContactPatch")
        if not isinstance(self.law, FrictionLaw):
            raise InvalidValueError(
                "law", "be a friction law of bristles, such as LuGre", self.law
            )

    def __repr__(self) -> str:
        parts = [f"{self.patch.name!r} of {self.patch.cells} cells", _named(self.law)]
        parts += unusual(self, but=("patch", "law"))
        return f"{type(self).__name__}({', '.join(parts)})"

    def _repr_html_(self) -> str:
        return picture("model in a notebook", self)

    @property
    def reduction(self) -> FrictionModel:
        """Model whose equations and state this one has: itself, but for models that choose one (`ReducedModel`)."""
        return self

    @property
    def state_shape(self) -> tuple[int, ...]:
        """Shape of the state of one contact."""
        raise NotImplementedError

    def rest(self, batch: int | Sequence[int] = ()) -> np.ndarray:
        """Return the state of a contact at rest, with relaxed bristles, or of a `batch`: `[*batch, *state_shape]`.

        Raises InvalidValueError unless `batch` is an integer >= 0 or a sequence of them.
        """
        return np.zeros(validation.batched(batch, self.state_shape))

    def with_law(self, law: FrictionLaw) -> Self:
        """Return the model with another law; both share what was computed of the patch alone."""
        return dataclasses.replace(self, law=law)

    def state_of(self, deflections: ArrayLike, normal_force: ArrayLike) -> np.ndarray:
        """Return the state of a contact at rest with the `deflections` `[2, N]` [m] of its cells under a load > 0 [N].

        Those of a patch of discs are `[3, N]`. The wrench is that of the bristles, `-sum w_i B_i' sigma_0 z_i f_N`,
        whichever state variables a model uses; the face of a pad is displaced by it.

        Raises InvalidValueError for deflections of another shape, a load that is not > 0, and a model that cannot start
        with a load.
        """
        deflections = validation.array(
            "deflections", deflections, (self.patch.bristles, self.patch.cells)
        )
        return self._state_of(
            deflections, validation.positive_load("normal_force", normal_force)
        )

    def _state_of(self, deflections: np.ndarray, load: float) -> np.ndarray:
        raise InvalidValueError(
            "model",
            "support a start under load (it has no _state_of)",
            type(self).__name__,
        )

    # ------------------------------------------------------------------ equations

    def rate(
        self, state: Any, twist: Any, normal_force: Any, *, moments: Any = None
    ) -> np.ndarray:
        """Return the rates of the state, shape `[..., *state_shape]`, in its units per second.

        `moments` as in `step`. Raises InvalidValueError as `step` does.
        """
        return self._evaluated(state, twist, normal_force, moments)[0]

    def wrench(
        self, state: Any, twist: Any, normal_force: Any, *, moments: Any = None
    ) -> np.ndarray:
        """Return the friction wrench on the moving body, shape `[..., 3]` [N, N, N m].

        `moments` as in `step`. Raises InvalidValueError as `step` does.
        """
        return self._evaluated(state, twist, normal_force, moments)[1]

    def _evaluated(
        self, state: Any, twist: Any, normal_force: Any, moments: Any
    ) -> tuple[np.ndarray, np.ndarray]:
        inputs = self._inputs(state, twist, normal_force, moments)
        rate, unit = self.compiled.evaluate(*inputs)
        return rate, inputs[2][..., None] * unit

    def step(
        self,
        state: Any,
        twist: Any,
        normal_force: Any,
        dt: Any,
        *,
        moments: Any = None,
        loads: Any = None,
        cover: Any = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Advance by `dt` [s] at a held twist; return the new state and the wrench at the end. Stable at any `dt`.

        A loop that moves a body by this wrench is not: up to `SlidingBody.largest_step`; `SlidingBody.step` is.

        Plain LuGre is linear in z, and its step is exact. Elasto-plastic bristles use an exponential step with the mean
        of the decay at the start and at the predicted end: second order, and limited to the largest deflection so that
        nothing overshoots.

        With `moments` `[..., 2]` [N m] of the normal forces about the origin, on the moving body, the pressure follows
        them (see `ContactPatch.weights`); bristles keep their deflections. `ReducedModelPublished` moves as a whole to
        the centre of pressure.

        With `loads` `[..., N]` [N] of the N cells of the patch, or of the model's discs, the pressure is given anew;
        `normal_force` is None, as they add up to it. A pad must know which cells were pressed in the step before:
        `loads` is a tuple of two arrays then, (before, now). `cover` `[..., N]` are the pressed shares of the cells, 1
        under load unless given, now or (before, now). See `models.cell_loads`.

        Raises InvalidValueError for shapes that do not fit, numbers that are not finite, a load or time below zero, and
        for `loads` beside another load or in a model without cells.
        """
        compiled = self.compiled
        done: Any = None
        if moments is loads is cover is None:
            done = compiled.step_one(state, twist, normal_force, dt)
            done = done or compiled.step_batch(state, twist, normal_force, dt)
        elif moments is normal_force is None and type(loads) in (np.ndarray, tuple):
            borne = seen(loads, cover)
            done = compiled.step_borne(self._bearing(loads), state, twist, dt, borne)
        return done or compiled.step(
            *self._given(state, twist, normal_force, moments, loads, cover, dt)
        )

    def step_jacobians(
        self,
        state: Any,
        twist: Any,
        normal_force: Any,
        dt: Any,
        moments: Any = None,
        *,
        loads: Any = None,
        cover: Any = None,
    ) -> StepJacobians:
        """Return the analytic derivatives of `step` (see `StepJacobians`); one-sided at kinks.

        With `moments` those at the pressure that they cause, which is held. With `loads` the slopes of the wrench by
        the load are those by the loads of the cells, `wrench_load` `[..., 3, N]`, and `state_load` those of each
        bristle by the load of its cell or disc, or on a pad with a common compliance `[..., states, n]`. The cover is
        held.

        Raises InvalidValueError as `step` does.
        """
        plain = moments is None and loads is None and cover is None
        done = plain and self.compiled.jacobians_one(state, twist, normal_force, dt)
        if done:
            return done
        given = self._given(state, twist, normal_force, moments, loads, cover, dt)
        slopes = self.compiled.step_jacobians(*given)
        if loads is None:
            return slopes
        by_cell = self._bearing(loads).spread(slopes.wrench_load)
        return slopes._replace(wrench_load=by_cell)

    # ------------------------------------------------------------------ pressure given anew

    def _pressing(self, loads: Any, cover: Any) -> Pressing:
        """Return the cells under given loads (see `cell_loads`)."""
        if isinstance(loads, Pressing):
            return loads
        return self._bearing(loads).under(loads, cover)

    def _bearing(self, loads: Any) -> Cells:
        """Return the cells that bear `loads`: those of the patch, or of the model."""
        rule = "be None for a model without cells"
        raise InvalidValueError("loads", rule, type(self).__name__)

    def _given(
        self, state: Any, twist: Any, load: Any, moments: Any, loads: Any, cover: Any, dt: Any
    ) -> list[Any]:  # fmt: skip
        """Return checked inputs of a step, the pressure last."""
        if loads is None and cover is None:
            return self._inputs(state, twist, load, moments, dt=dt)
        for name, value in (("normal_force", load), ("moments", moments)):
            if value is not None:
                raise InvalidValueError(name, BESIDE, value)
        if loads is None:
            raise InvalidValueError("loads", "be given with a cover", "None")
        pressing = self._pressing(loads, cover)
        state, twist, load, dt, _ = self._inputs(state, twist, pressing.load, dt=dt)
        return [state, twist, load, dt, pressing.spread(load.shape)]

    # ------------------------------------------------------------------ machine form

    @property
    def compiled(self) -> CompiledModel:
        """Machine form of the model, made once: fast steps, and what the solver, `coupling` and rollouts read.

        Raises InvalidValueError for a model whose steps are not compiled.
        """
        raise InvalidValueError(
            "model", "have compiled steps (it has no machine form)", type(self).__name__
        )

    def packed(
        self, loads: Sequence[float | None], between: tuple[float, float] | None = None
    ) -> PackedModel:
        """Pack the model at distinct `loads` [N] for the compiled solver; `[None]` if the patch ignores the load.

        A model of one's own needs this to be simulated in a scene; the solver calls its functions by address. A patch
        that depends on the load is packed during the run, in several calls: `between` gives the lowest and the highest
        load of the whole run, which determine the bristles and the nominal values. As many of the first of `loads` are
        packed as `MAX_PACK_BYTES` and `MAX_PACK_SECONDS` allow, so there may be fewer records than loads, but at least
        one. Without `between`, these are all loads of the run, and each has its record.

        Raises InvalidValueError for a model that cannot be simulated in a scene.
        """
        try:
            compiled = self.compiled
        except InvalidValueError:
            rule = "support simulation in a scene (it has no packed(loads))"
            raise InvalidValueError("model", rule, type(self).__name__) from None
        return compiled.packed(loads, between)

    @property
    def depends_on_load(self) -> bool:
        """True if the shape of the patch in this model changes with the load."""
        return self.patch.depends_on_load

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy or another process gets, at one instant: another thread may be about to build something.

        Addresses hold in this process alone: a copy makes its own machine form.
        """
        return {
            name: value
            for name, value in self.__dict__.copy().items()
            if name not in ("compiled", "_cells")
        }

    # ------------------------------------------------------------------ inputs

    def _inputs(
        self,
        state: ArrayLike,
        twist: ArrayLike,
        normal_force: ArrayLike,
        moments: Any = None,
        **more,
    ) -> list[Any]:
        """Check the inputs and broadcast their batch axes against each other; last, the centre of pressure, or None.

        All come out in C order and writable: compiled loops know no other arrays, and sums run the same way.
        """
        held = None if moments is None else moments_of(moments)
        state = validation.numbers("state", state)
        inner = self.state_shape
        if state.shape[state.ndim - len(inner) :] != inner:
            wanted = ", ".join(str(n) for n in inner)
            raise InvalidValueError(
                "state", f"have shape [..., {wanted}]", f"shape {list(state.shape)}"
            )
        twist = validation.vectors("twist", twist, 3)
        scalars = {"normal_force": normal_force, **more}
        arrays = {
            name: validation.numbers(name, value) for name, value in scalars.items()
        }
        batches = {
            state.shape[: state.ndim - len(inner)],
            twist.shape[:-1],
            *(v.shape for v in arrays.values()),
        }
        batches |= set() if held is None else {held.shape[:-1]}
        try:
            batch = (
                batches.pop() if len(batches) == 1 else np.broadcast_shapes(*batches)
            )
        except ValueError:
            shapes = ", ".join(
                str(list(v.shape)) for v in (state, twist, *arrays.values())
            )
            raise InvalidValueError(
                "batch axes", "broadcast", f"shapes {shapes}"
            ) from None
        if math.prod(batch) > validation.MOST_NUMBERS:
            got = f"{list(batch)} of {', '.join(('state', 'twist', *arrays))}"
            raise InvalidValueError(
                "batch axes", f"hold at most {validation.MOST_NUMBERS} contacts", got
            )
        for name, value in {"state": state, "twist": twist, **arrays}.items():
            validation.within_range(
                name, value.min(initial=0.0), value.max(initial=0.0)
            )
        for name, value in arrays.items():
            if (value < 0.0).any():
                raise InvalidValueError(name, "be >= 0", float(value.min()))
        wanted = [batch + inner, (*batch, 3), *(batch for _ in arrays)]
        given = [state, twist, *arrays.values()]
        inputs: list[Any] = [
            a
            if a.shape == shape and a.flags.carray
            else np.broadcast_to(a, shape).copy()
            for a, shape in zip(given, wanted, strict=True)
        ]
        return [
            *inputs,
            None
            if held is None
            else centre_of(np.broadcast_to(held, (*batch, 2)), inputs[2]),
        ]


def refuse_pad(model: FrictionModel, by: str) -> None:
    """Raise InvalidValueError for a model with a pad, which `by` does not know."""
    if model.reduction.pad is not None:
        pad = type(model.reduction.pad).__name__
        raise InvalidValueError(
            "pad", f"be None for {by}, which does not support pads", pad
        )


def softening(model: FrictionModel, loads: np.ndarray) -> np.ndarray:
    """Return `K_i/(sigma_0 N_i)` of the bristles of a model under `loads` `[...]` [N], `[..., N]`; 1 without a pad."""
    pad = model.reduction.pad
    patch = model.reduction.patch
    if pad is None:
        return np.ones((*np.shape(loads), patch.cells))
    stiff = pad.pieces(patch, model.law) / model.law.numbers.sigma_0
    borne = np.asarray(loads)[..., None] * patch.weights(loads)
    return stiff / np.maximum(borne, LIGHTEST * stiff)


def refuse_common(model: FrictionModel, by: str) -> None:
    """Raise InvalidValueError for a pad with a common compliance, which `by` does not know."""
    pad = model.reduction.pad
    if pad is not None and model.compiled.compliance is not None:
        rule = f"have no common compliance for {by}, which has none"
        raise InvalidValueError("pad", rule, type(pad).__name__)


def hung(model: FrictionModel, bristles: np.ndarray) -> np.ndarray:
    """Return the state of a model at rest with bristles `[d, N]` of its reduction, whose load displaces the face."""
    few = model.reduction
    common = model.compiled.compliance
    if few.pad is None or common is None:
        return bristles
    pieces = few.pad.pieces(few.patch, few.law)
    load = np.einsum("n,nda,dn->a", pieces, few.patch.levers(), bristles)
    return np.append(bristles, common @ load)


def lever_of(model: FrictionModel) -> float:
    """Return the lever arm [m] at which spins of a patch count as speeds."""
    return arm_of(model.patch)


def arm_of(patch: ContactPatch) -> float:
    """Return the lever arm [m] at which spins of a patch count as speeds."""
    return math.sqrt(
        float((patch.positions**2).sum(axis=1).mean() + 0.5 * (patch.radii**2).mean())
    )


def _named(law: FrictionLaw) -> str:
    """Return a law in few words, with its friction coefficients."""
    numbers = law.numbers
    static = "" if numbers.mu_s == numbers.mu_c else f", mu_s={numbers.mu_s:g}"
    return f"{type(law).__name__}(mu_c={numbers.mu_c:g}{static}, ...)"
