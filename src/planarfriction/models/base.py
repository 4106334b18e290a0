"""The interface of every friction model, and the checks of its inputs."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from planarfriction import validation
from planarfriction.equality import ByValue, by_parts, unusual
from planarfriction.errors import InvalidValueError
from planarfriction.laws import FrictionLaw
from planarfriction.patch import ContactPatch


@by_parts
class ModelJacobians(NamedTuple):
    """Derivatives of the bristle rates and of the wrench; `[*s]` is the shape of the state without batch axes."""

    rate_state: np.ndarray
    """d rate / d state: distributed `[..., 2, 2, N]` (cell by cell), reduced `[..., 3, 3]`, of P parts
    `[..., P, 3, 3]` (part by part)."""
    rate_twist: np.ndarray
    """d rate / d twist: distributed `[..., 2, N, 3]`, reduced `[..., 3, 3]`, of P parts `[..., P, 3, 3]`."""
    rate_load: np.ndarray
    """d rate / d normal_force of a fixed shape: zero, `[..., *s]`."""
    wrench_state: np.ndarray
    """d wrench / d state: distributed `[..., 3, 2, N]`, reduced `[..., 3, 3]`, of P parts `[..., 3, P, 3]`."""
    wrench_twist: np.ndarray
    """d wrench / d twist at a held state, `[..., 3, 3]`."""
    wrench_load: np.ndarray
    """d wrench / d normal_force of a fixed shape, `[..., 3]`."""


@by_parts
class StepJacobians(NamedTuple):
    """Derivatives of the results of `step`: the new state, and the wrench at the end of the step.

    The shape of the patch is held fixed. Without load a step resets its bristles: all derivatives are zero except
    `wrench_load`, which is the wrench per unit load in the limit of a small load.
    """

    state_state: np.ndarray
    """d new state / d state: distributed `[..., 2, 2, N]` (cell by cell), reduced `[..., 3, 3]`, of P parts
    `[..., P, 3, 3]` (part by part)."""
    state_twist: np.ndarray
    """d new state / d twist: distributed `[..., 2, N, 3]`, reduced `[..., 3, 3]`, of P parts `[..., P, 3, 3]`."""
    wrench_state: np.ndarray
    """d wrench / d state: distributed `[..., 3, 2, N]`, reduced `[..., 3, 3]`, of P parts `[..., 3, P, 3]`."""
    wrench_twist: np.ndarray
    """d wrench / d twist, `[..., 3, 3]`; an implicit simulator adds this, times `dt`, to its mass matrix."""
    wrench_load: np.ndarray
    """d wrench / d normal_force, `[..., 3]`."""


MAX_PACK_BYTES = 64e6
"""Bytes of shapes that a model packs at a time, if that is more than one shape."""

MAX_PACK_SECONDS = 0.25
"""Time [s] for which a model builds the shapes that it packs at a time, if that is more than one shape."""


VELOCITY_SCALE = 0.1
"""Natural scale of the velocity of a body on a patch, as a share of v_s [-] (see `PackedModel`)."""


@by_parts
class PackedModel(NamedTuple):
    """A model at R loads, in the form that the compiled solver reads."""

    functions: Any
    """Its `kernels.contacts.ModelFunctions`."""
    records: np.ndarray
    """Data of the contact for these functions, a row of words for each load, `[R, words]` (`kernels.records`)."""
    states: int
    """Number of bristle states of a contact."""
    workspace: int
    """Number of values that a linearisation needs."""
    state_scale: np.ndarray
    """Natural scale of each state, `[states]`: its value at full deflection."""
    radius: float
    """Lever arm [m] that turns the spin of the patch into a speed."""
    keepalive: tuple[np.ndarray, ...]
    """Arrays whose addresses are in the records; the caller of the functions must keep them alive."""
    cells: np.ndarray | None = None
    """Which cells of the model have bristles here, bool `[N]`, where states are those of cells."""
    velocity_scale: float = VELOCITY_SCALE
    """Natural scale of the body's velocity, as a share of v_s [-].

    A body that is about to slip, or has just stopped, creeps at 1e-4 to 1e-2 of v_s, and friction depends on the
    direction of its twist however slow it is. If errors were measured against v_s itself, that direction would be
    noise, and a patch that just holds could give way, or the other way round.
    """


@by_parts
class PackedSteps(NamedTuple):
    """A model at R loads, in the form that `coupling` reads, in P parts that share the twist and the load."""

    records: np.ndarray
    """Data of each part for the model's function of `kernels.step_slopes`, `[R, P, words]`."""
    shares: np.ndarray
    """Share of the load that each part carries, `[R, P]`."""
    keepalive: tuple[np.ndarray, ...]
    """As in `PackedModel`."""


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

    state_units: ClassVar[str] = "m"
    """Units of the state: one for all components, or one for each."""

    def __post_init__(self) -> None:
        validation.instance("patch", self.patch, ContactPatch, "a ContactPatch")
        if not isinstance(self.law, FrictionLaw):
            raise InvalidValueError("law", "be a friction law of bristles, such as LuGre", self.law)

    def __getstate__(self) -> dict[str, Any]:
        """What a copy or another process gets, at one instant: another thread may be about to build something."""
        return dict(self.__dict__)

    def __repr__(self) -> str:
        parts = [f"{self.patch.name!r} of {self.patch.cells} cells", _named(self.law)]
        parts += unusual(self, but=("patch", "law"))
        return f"{type(self).__name__}({', '.join(parts)})"

    @property
    def state_shape(self) -> tuple[int, ...]:
        """Shape of the state of one contact."""
        raise NotImplementedError

    def rest(self) -> np.ndarray:
        """State of a contact at rest, with relaxed bristles."""
        return np.zeros(self.state_shape)

    def with_law(self, law: FrictionLaw) -> Self:
        """The same model with another law; precomputed properties of the patch that do not depend on the law are
        shared."""
        return dataclasses.replace(self, law=law)

    def state_of(self, deflections: ArrayLike, normal_force: ArrayLike) -> np.ndarray:
        """State of a contact at rest whose bristles have the `deflections` `[2, N]` [m] under a load > 0 [N].

        Its wrench is that of the bristles, `-sum w_i B_i' sigma_0 z_i f_N`, whichever state variables a model uses.

        Raises InvalidValueError for deflections of another shape, a load that is not > 0, and a model that cannot start
        with a load.
        """
        deflections = validation.array("deflections", deflections, (2, len(self.patch.positions)))
        return self._state_of(deflections, validation.positive_load("normal_force", normal_force))

    def _state_of(self, deflections: np.ndarray, load: float) -> np.ndarray:
        raise InvalidValueError("model", "support a start under load (it has no _state_of)", type(self).__name__)

    def packed(self, loads: Sequence[float | None], between: tuple[float, float] | None = None) -> PackedModel:
        """The model at distinct `loads` [N] for the compiled solver; `[None]` if the patch does not depend on the load.

        A model needs this to be simulated in a scene; the solver calls its functions by address. A patch that depends
        on the load is packed during the run, in several calls: `between` gives the lowest and the highest load of the
        whole run, which determine the bristles and the natural scales. As many of the first of `loads` are packed as
        `MAX_PACK_BYTES` and `MAX_PACK_SECONDS` allow, so there may be fewer records than loads, but at least one.
        Without `between`, these are all loads of the run, and each has its record.

        Raises InvalidValueError for a model that cannot be simulated in a scene.
        """
        rule = "support simulation in a scene (it has no packed(loads))"
        raise InvalidValueError("model", rule, type(self).__name__)

    @property
    def step_function(self) -> Any:
        """The model's function of `kernels.step_slopes`.

        Raises InvalidValueError for a model whose steps are not compiled.
        """
        raise InvalidValueError("model", "have compiled steps (it has no step_function)", type(self).__name__)

    def packed_steps(self, loads: Sequence[float | None]) -> PackedSteps:
        """The model at `loads` > 0 [N], with all of its states, for `coupling`; `[None]` if the patch ignores the
        load."""
        raise NotImplementedError

    @property
    def _pieces(self) -> int:
        """Parts of `packed_steps`, of as many states each."""
        return 1

    @property
    def depends_on_load(self) -> bool:
        """Whether what the model knows of its patch changes with the load."""
        return self.patch.depends_on_load

    def _inputs(self, state: ArrayLike, twist: ArrayLike, normal_force: ArrayLike, **more) -> list[np.ndarray]:
        """Check the inputs and broadcast their batch axes against each other.

        All come out in C order and writable: compiled loops know no other arrays, and sums run the same way.
        """
        state, twist = validation.numbers("state", state), validation.numbers("twist", twist)
        inner = self.state_shape
        if state.shape[state.ndim - len(inner) :] != inner:
            wanted = ", ".join(str(n) for n in inner)
            raise InvalidValueError("state", f"have shape [..., {wanted}]", f"shape {list(state.shape)}")
        if twist.shape[-1:] != (3,):
            raise InvalidValueError("twist", "have shape [..., 3]", f"shape {list(twist.shape)}")
        scalars = {"normal_force": normal_force, **more}
        arrays = {name: validation.numbers(name, value) for name, value in scalars.items()}
        batches = {state.shape[: state.ndim - len(inner)], twist.shape[:-1], *(v.shape for v in arrays.values())}
        try:
            batch = batches.pop() if len(batches) == 1 else np.broadcast_shapes(*batches)
        except ValueError:
            shapes = ", ".join(str(list(v.shape)) for v in (state, twist, *arrays.values()))
            raise InvalidValueError("batch axes", "broadcast", f"shapes {shapes}") from None
        if math.prod(batch) > validation.MOST_NUMBERS:
            raise InvalidValueError("batch axes", f"hold at most {validation.MOST_NUMBERS} contacts", list(batch))
        for name, value in {"state": state, "twist": twist, **arrays}.items():
            validation.within_range(name, value.min(initial=0.0), value.max(initial=0.0))
        for name, value in arrays.items():
            if (value < 0.0).any():
                raise InvalidValueError(name, "be >= 0", float(value.min()))
        wanted = [batch + inner, (*batch, 3), *(batch for _ in arrays)]
        given = [state, twist, *arrays.values()]
        return [
            a if a.shape == shape and a.flags.carray else np.broadcast_to(a, shape).copy()
            for a, shape in zip(given, wanted, strict=True)
        ]


def _named(law: FrictionLaw) -> str:
    """A law in few words: what it is, and how much friction there is."""
    numbers = law.numbers
    static = "" if numbers.mu_s == numbers.mu_c else f", mu_s={numbers.mu_s:g}"
    return f"{type(law).__name__}(mu_c={numbers.mu_c:g}{static}, ...)"
