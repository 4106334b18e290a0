"""One implicit step of many patches in contact space, for use inside any simulator.

The simulator (host) integrates with a fixed time step, and knows how the twists and loads of its patches at the end of
the step depend on the friction wrenches that act during it. `CoupledPatches.step` finds wrenches that are consistent:
they are those of the models at the twists and loads that they cause. This is stable at any time step and stiffness.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._engine.compiler.memory import places_of
from planarfriction._engine.compiler.threads import share
from planarfriction._engine.coupled import coupling as kernels
from planarfriction._engine.records.packed import PackedModel
from planarfriction._engine.records.patches import PackedPatches, packed_patches
from planarfriction._engine.records.pressing import Pressing
from planarfriction._support import validation
from planarfriction._support.equality import ByValue, by_parts
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LARGEST
from planarfriction.models import FrictionModel
from planarfriction.models.base import lever_of

TOLERANCE = 1e-9
"""Default error of the twists [m/s]: a bristle is off by a thousandth of its largest deflection after a second."""

ITERATIONS = 50
"""Default number of iterations of an attempt."""

PASSES = 10
"""Rounds in which the shapes of patches follow their loads."""

WORTH_A_THREAD = 200
"""Patches below which starting a thread costs more than it saves."""

_INPUTS = (
    "state",
    "dt",
    "twist",
    "normal_force",
    "wrench",
    "twist_response",
    "load_response",
    "moments",
)
_PLACES = (
    "state",
    "dt",
    "free_twist",
    "free_load",
    "guess",
    "response",
    "load_response",
    "moments",
)


@by_parts
class HostStep(NamedTuple):
    """The step of a host for k patches: the outcome for a guess of the wrenches, and how other wrenches change it.

    `V = twist + twist_response (W - wrench)`, `N = max(normal_force + load_response (W - wrench), 0)`, all at the end
    of the step, as flat vectors patch by patch. Leading axes are environments.
    """

    twist: Any
    """Twists of the patches `[..., k, 3]` [m/s, m/s, rad/s], each about its contact frame's origin, in its axes."""
    normal_force: Any
    """Normal forces `[..., k]` [N]."""
    wrench: Any
    """Initial guess of the wrenches, `[..., k, 3]` [N, N, N m]: those of the last step, or zeros."""
    twist_response: Any
    """d twist / d wrench, `[..., 3k, 3k]`: for rigid bodies `dt J M^-1 J'`; `W.twist_response W >= 0`."""
    load_response: Any = None
    """d normal_force / d wrench, `[..., k, 3k]`; None if the loads do not depend on the wrenches."""
    moments: Any = None
    """Moments (m_x, m_y) of the normal forces for the guess, about the patches' origins, `[..., k, 2]` [N m]: pressures
    follow them (see `ContactPatch.weights`) and are held for the step; None if they do not follow."""
    loads: Any = None
    """Loads of the cells of each patch for the guess, a sequence of k entries as in `FrictionModel.step`, or None for
    patches whose pressure is their own; they add up to `normal_force`, which is not read then."""
    cover: Any = None
    """Pressed shares of the cells of each patch, as `loads`."""


@by_parts
class CoupledStep(NamedTuple):
    """The end of a step: `state` and `wrench` are those of the models' `step` at `twist` and `normal_force`."""

    state: np.ndarray
    """State of all patches `[..., states]`."""
    wrench: np.ndarray
    """Wrenches `[..., k, 3]` [N, N, N m]."""
    twist: np.ndarray
    """Twists `[..., k, 3]` [m/s, m/s, rad/s]."""
    normal_force: np.ndarray
    """Normal forces `[..., k]` [N]."""
    iterations: np.ndarray
    """Newton iterations, int `[...]`."""
    residual: np.ndarray
    """Largest difference between the twists and loads and those the wrenches cause, `[...]` [m/s]; loads count as the
    speed they could cause."""
    converged: np.ndarray
    """True where the residual is within the tolerance, or 1e-9 of the speeds that go into it, bool `[...]`."""


@dataclass(frozen=True, eq=False)
class CoupledPatches(ByValue):
    """Patches that are coupled through the bodies of a host and stepped together; different models may be mixed.

    The caller keeps the state: one vector with the states of all patches in order (`states` gives each its shape). A
    patch whose shape depends on the load has the shape for the load at the end of the step.

    Raises `InvalidValueError` unless all `models` are friction models with compiled steps.
    """

    models: Sequence[FrictionModel]
    """Friction models with compiled steps, one for each patch."""

    def __post_init__(self) -> None:
        if isinstance(self.models, FrictionModel | np.ndarray) or not isinstance(
            self.models, Iterable
        ):
            raise InvalidValueError(
                "models",
                "be a list of friction models, one for each patch",
                self.models,
            )
        self._set(models=tuple(self.models))
        for model in self.models:
            validation.instance(
                "models", model, FrictionModel, "friction models, one for each patch"
            )
        if not self.models:
            raise InvalidValueError("models", "hold at least one", "none")
        _ = self._packed

    @property
    def state_shape(self) -> tuple[int, ...]:
        """Shape of the state of all patches, `(states,)`."""
        return (int(self._bounds[-1]),)

    def rest(self, batch: int | Sequence[int] = ()) -> np.ndarray:
        """Return the state of all patches at rest, with relaxed bristles, or of a `batch`: `[*batch, states]`.

        Raises InvalidValueError unless `batch` is a count or counts.
        """
        return np.zeros(validation.batched(batch, self.state_shape))

    def states(self, state: np.ndarray) -> list[np.ndarray]:
        """Return views of the state of each patch in `state` `[..., states]`, each in the shape that its model uses.

        Raises InvalidValueError for a state of another shape.
        """
        if not (isinstance(state, np.ndarray) and state.shape[-1:] == self.state_shape):
            shape = list(np.shape(state))
            raise InvalidValueError(
                "state",
                f"be an array of shape [..., {self._bounds[-1]}]",
                f"shape {shape}",
            )
        ends = zip(self._bounds, self._bounds[1:], self.models, strict=False)
        return [
            state[..., a:b].reshape(*state.shape[:-1], *model.state_shape)
            for a, b, model in ends
        ]

    def step(
        self,
        state: ArrayLike,
        host: HostStep,
        dt: ArrayLike,
        *,
        tolerance: float = TOLERANCE,
        iterations: int | None = None,
    ) -> CoupledStep:
        """Find the wrenches of a host's step: `W = w(V, N)`, with the V and N that they cause (see `HostStep`).

        `w` are the wrenches of the models' steps of `dt` [s] from `state` `[..., states]`. Solved by Newton's method
        for W, starting from the better of the guess and rest; a step that goes too far is shortened, and slopes with
        the wrong sign are left out (docs/embedding.md). Leading axes broadcast; environments run on threads, without
        the interpreter's lock. `tolerance` is that of the twists [m/s], with spins multiplied by the size of the patch;
        1e-9 of the largest speed that goes into a twist is enough, too, since rounding may allow no more.
        What does not converge in 50 iterations is solved again without the guess, by steps that each lower the energy.
        If that fails too, wrenches of the best result are scaled down and its bristles relaxed, as far as they would
        do more work on the host than the bristles give. With `iterations` there is one attempt, and its best result as
        it is.

        Raises `InvalidValueError` for input that is not finite, of the wrong shape, or negative where it must not be.
        """
        if not isinstance(host, HostStep):
            raise InvalidValueError("host", "be a HostStep", type(host).__name__)
        tolerance = validation.positive("tolerance", tolerance)
        most = (
            ITERATIONS
            if iterations is None
            else validation.count("iterations", iterations, 0, 10**9)
        )
        given = dict(zip(_INPUTS, (state, dt, *host[: len(_INPUTS) - 2]), strict=True))
        for name in ("load_response", "moments"):
            if given[name] is None:
                del given[name]
        if host.moments is not None:
            self._check_follows()
        arrays = {
            name: validation.numbers(name, value) for name, value in given.items()
        }
        pressings = self._pressings(host.loads, host.cover)
        if pressings and host.moments is not None:
            rule = "be None if loads of cells are given"
            raise InvalidValueError("moments", rule, host.moments)
        problems, batch = self._problems(arrays, pressings)
        parts = self._parts
        into = problems[:, parts["state"]], problems[:, parts["free_load"]]
        held = self._press(*into, batch, pressings)
        problems[:, parts["tolerance"]] = tolerance
        problems[:, parts["most"]] = most
        problems[:, parts["again"]] = float(iterations is None)
        problems[:, parts["wrench"]] = problems[:, parts["guess"]]
        counts = self._solve(problems, held)
        if (counts < 0).any():
            _refuse(arrays)
        return self._result(problems, counts, batch)

    # ------------------------------------------------------------------ rows

    def _pressings(self, loads: Any, cover: Any) -> dict[int, Pressing]:
        """Return the pressures of patches whose loads are given, by their number."""
        given = {}
        for name, each in (("loads", loads), ("cover", cover)):
            if each is None:
                given[name] = [None] * len(self.models)
            elif isinstance(each, tuple | list) and len(each) == len(self.models):
                given[name] = each
            else:
                rule = (
                    f"be a list of {len(self.models)}, for each patch an array or None"
                )
                raise InvalidValueError(name, rule, type(each).__name__)
        return {
            p: model._pressing(load, part)
            for p, (model, load, part) in enumerate(
                zip(self.models, given["loads"], given["cover"], strict=True)
            )
            if load is not None or part is not None
        }

    def _press(
        self, states: np.ndarray, loads: np.ndarray, batch: tuple[int, ...], pressings: dict[int, Pressing]
    ) -> dict[int, PackedModel]:  # fmt: skip
        """Write given loads `[E, k]`, and the states `[E, states]` that they leave; return what patches are then."""
        held = {}
        for p, pressing in pressings.items():
            each = pressing.spread(batch)
            model = self.models[p].compiled
            own = slice(*self._bounds[p : p + 2])
            states[:, own] = each.left(
                np.ascontiguousarray(states[:, own]), model.components
            )
            loads[:, p] = each.load
            held[p] = model.bristles.under(each)  # pyright: ignore[reportAttributeAccessIssue]
        return held

    def _problems(
        self, arrays: dict[str, np.ndarray], pressings: dict[int, Pressing]
    ) -> tuple[np.ndarray, tuple[int, ...]]:
        """Return a row for each environment, with the inputs written, and the batch axes."""
        k = len(self.models)
        n = 3 * len(self.models)
        inner = {
            "state": self.state_shape, "dt": (), "twist": (k, 3), "normal_force": (k,), "wrench": (k, 3),
            "twist_response": (n, n), "load_response": (k, n), "moments": (k, 2),
        }  # fmt: skip
        axes = {}
        for name, array in arrays.items():
            cut = array.ndim - len(inner[name])
            if cut < 0 or array.shape[cut:] != inner[name]:
                wanted = ", ".join(["...", *map(str, inner[name])])
                raise InvalidValueError(
                    name, f"have shape [{wanted}]", f"shape {list(array.shape)}"
                )
            axes[name] = array.shape[:cut]
        for p, pressing in pressings.items():
            axes[f"loads of patch {p}"] = pressing.load.shape
        batch = axes["state"]
        if any(each != batch for each in axes.values()):
            batch = validation.common_shape("batch axes", axes.values())
        count = math.prod(batch)
        words = self._packed.layout.size
        if count * words > validation.MOST_NUMBERS:
            rule = f"hold at most {validation.MOST_NUMBERS // words} environments of these patches"
            raise InvalidValueError("batch axes", rule, list(batch))
        problems = np.zeros((*batch, words))
        for name, place in zip(_INPUTS, _PLACES, strict=True):
            if name in arrays:
                problems[..., self._parts[place]] = arrays[name].reshape(
                    *axes[name], math.prod(inner[name])
                )
        problems[..., self._parts["follows"]] = float("moments" in arrays)
        return problems.reshape(count, words), batch

    def _check_follows(self, patches: Sequence[int] | None = None) -> None:
        """Raise InvalidValueError for `patches`, all if None, whose pressure cannot follow moments."""
        for p in range(len(self.models)) if patches is None else patches:
            if not follows(self.models[p]):
                rule = "be None: a patch without cells cannot follow them while its shape follows the load"
                raise InvalidValueError(
                    "moments", rule, f"model {p}: {type(self.models[p]).__name__}"
                )

    def _solve(self, problems: np.ndarray, held: dict[int, PackedModel]) -> np.ndarray:
        """Solve all problems; the iterations that each took, negative for invalid ones."""
        packed = self._packed
        parts = self._parts
        places = problems.view(np.int64)[:, parts["records"]]
        places[:] = packed.records
        for p, each in held.items():
            places[:, p] = places_of(each.records)
        if held.keys() >= set(packed.following):
            return self._once(problems)
        total = np.zeros(len(problems), int)
        unsettled = np.arange(len(problems))
        loads = problems[:, parts["free_load"]].copy()
        for i in range(PASSES + 1):
            rows = problems[unsettled]
            records = rows.view(np.int64)[:, parts["records"]]
            kept = self._write_following(records, loads, held)
            if i == PASSES:
                rows[:, parts["most"]] = 0
            taken = self._once(rows)
            del kept
            problems[unsettled] = rows
            total[unsettled] = total[unsettled] + taken
            came_out = rows[:, parts["load"]]
            # each environment on its own, so that it does not matter which others are in the batch
            settled = (
                (came_out == loads).all(axis=1) | (taken < 0) | ((i > 0) & (taken == 0))
            )
            unsettled = unsettled[~settled]
            loads = came_out[~settled]
            if not unsettled.size:
                break
        return total

    def _once(self, problems: np.ndarray) -> np.ndarray:
        """Solve all problems with the shapes that they hold."""
        row = self._packed.patches.words
        most = len(problems) * len(self.models) // WORTH_A_THREAD
        share(
            len(problems),
            most,
            lambda first, last: kernels.solve_batch(row, problems, first, last),
        )
        return problems[:, self._parts["iterations"].start].astype(int)

    def _write_following(
        self, records: np.ndarray, loads: np.ndarray, held: Container[int] = ()
    ) -> list[PackedModel]:
        """Write the records `[E, k]` of patches whose shapes follow their loads, but for those that are held.

        Returns what has to be kept.
        """
        kept = []
        for p in self._packed.following:
            if p in held:
                continue
            chosen = np.flatnonzero((loads[:, p] > 0.0) & (loads[:, p] <= LARGEST))
            records[:, p] = 0
            if chosen.size:
                packed = self.models[p].compiled.bristles.with_all_states(
                    loads[chosen, p]
                )
                records[chosen, p] = places_of(packed.records)
                kept.append(packed)
        return kept

    def _result(
        self, problems: np.ndarray, counts: np.ndarray, batch: tuple[int, ...]
    ) -> CoupledStep:
        names = ("new", "wrench", "twist", "load", "residual", "converged")
        k = len(self.models)
        shapes = self.state_shape, (k, 3), (k, 3), (k,), (), ()
        new, wrench, twist, load, residual, converged = (
            problems[:, self._parts[name]].reshape((*batch, *shape))
            for name, shape in zip(names, shapes, strict=True)
        )
        step = CoupledStep(
            new, wrench, twist, load, counts.reshape(batch), residual, converged > 0.0
        )
        return (
            step
            if len(problems) == 1
            else CoupledStep(*map(np.ascontiguousarray, step))
        )

    def _blank_problem(self, follows: Sequence[bool]) -> np.ndarray:
        """Return the row of a problem without inputs, for compiled hosts, with patches of fixed shape.

        The host gives the moments of those whose pressure `follows` them.
        """
        self._check_follows([p for p, follow in enumerate(follows) if follow])
        row = np.zeros((1, self._packed.layout.size))
        parts = self._parts
        row.view(np.int64)[:, parts["records"]] = self._packed.records
        row[:, parts["tolerance"]] = TOLERANCE
        row[:, parts["most"]] = ITERATIONS
        row[:, parts["follows"]] = follows
        row[:, parts["again"]] = 1.0
        return row

    # ------------------------------------------------------------------ what is packed once

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields for a copy or another process, without addresses, which hold in this process alone."""
        return {"models": self.models}

    @functools.cached_property
    def _bounds(self) -> np.ndarray:
        return np.cumsum([0, *(math.prod(model.state_shape) for model in self.models)])

    @functools.cached_property
    def _packed(self) -> PackedPatches:
        # All cells, whatever load they carry: a lever arm that does not follow the load.
        levers = list(map(lever_of, self.models))
        return packed_patches([model.compiled for model in self.models], levers)

    @property
    def _parts(self) -> dict[str, slice]:
        return self._packed.layout.slices


def follows(model: FrictionModel) -> bool:
    """Return True if the pressure of a patch with this model can follow moments."""
    return len(model.compiled.points()[0]) > 0


def _refuse(arrays: dict[str, np.ndarray]) -> None:
    """Say which input is not finite, or negative where it must not be."""
    for name, value in arrays.items():
        validation.within_range(name, value.min(initial=0.0), value.max(initial=0.0))
    for name in ("dt", "normal_force"):
        if (arrays[name] < 0.0).any():
            raise InvalidValueError(name, "be >= 0", float(arrays[name].min()))
    diagonal = np.diagonal(arrays["twist_response"], axis1=-2, axis2=-1)
    raise InvalidValueError(
        "twist_response", "have a diagonal >= 0", float(diagonal.min())
    )
