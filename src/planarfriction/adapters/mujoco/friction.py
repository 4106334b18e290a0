# pyright: reportAttributeAccessIssue=false
# (MuJoCo describes few of its names to type checkers.)
"""Steps of MuJoCo with patch friction, implicit in contact space."""

from __future__ import annotations

import copy
import ctypes
import functools
import warnings
import weakref
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import mujoco
import numpy as np

from planarfriction._engine.compiler.calls import address_of
from planarfriction._engine.compiler.memory import place_of, row_of
from planarfriction._engine.coupled import coupling as kernels
from planarfriction._engine.coupled import placing
from planarfriction.adapters.mujoco.draw import draw_patch
from planarfriction.adapters.mujoco.library import layout, same
from planarfriction.adapters.mujoco.loops import step as loops
from planarfriction.adapters.mujoco.loops.models import HANGS, STIFF
from planarfriction.adapters.mujoco.loops.records import Host, scratch_layout
from planarfriction.adapters.mujoco.patches import (
    PatchContact,
    Placed,
    check_once,
    check_options,
    memory,
    misplaced_line,
    parameters_in,
    place_of_parameters,
)
from planarfriction.coupling import CoupledPatches
from planarfriction.environments import check
from planarfriction.errors import FrictionError, InvalidValueError
from planarfriction.laws.base import is_rate_law
from planarfriction.models.base import FrictionModel
from planarfriction.pads import refuse_damping


class Report(NamedTuple):
    """Statistics of the last step."""

    iterations: int
    """Newton iterations, summed over all passes; negative for a step without friction: -1 for a state that was not
    finite, -2 for options that do not fit (see `Friction`)."""
    passes: int
    """Number of solutions of the step (again after other constraints became active); 0 without contact."""
    residual: float
    """Residual of the step in contact space [m/s]."""
    converged: bool
    """True if the residual is below its tolerance and MuJoCo's constraints stayed as the last pass assumed them."""


class Friction:
    """Patch friction for a model that `prepare` has prepared.

    Either call `step(d)` instead of `mj_step`, or use `with friction.install():`, which adds friction to `mj_step`
    itself, the reader and `mujoco.rollout`. States are stored in the data, in the last numbers of `userdata`: copying
    or restoring these includes the friction. One object serves all data of its model, on any number of threads.

    Raises `InvalidValueError` for an integrator without a fixed metric, noslip iterations, sleeping, too little user
    data, names that are not in the model, pairs with friction of their own, and shapes that change with the load.
    """

    def __init__(self, m: Any, patches: Sequence[PatchContact]) -> None:
        check_once(patches)
        self.m = m
        self.patches = tuple(patches)
        self.placed = [Placed(m, patch) for patch in patches]
        self.coupled = CoupledPatches([patch.model for patch in patches])
        for patch in patches:
            if patch.model.depends_on_load:
                rule = "have a shape that does not change with the load: compiled steps need fixed numbers"
                raise InvalidValueError("model", rule, type(patch.model).__name__)
        self._place = place_of_parameters(m)
        self._check(m)
        self._said: set[str | None] = set()
        self._memory = memory(patches, m.nv, m.nuserdata)
        self._used: list[bool] = []
        self._last: Any = (object(),)
        weakref.finalize(self, _say_unused, self._used)

    def _check(self, m: Any) -> None:
        """Refuse options and parameters of a model that do not fit."""
        check_options(m, "Euler", "implicit", "implicitfast")
        for placed in self.placed:
            placed.check(m)
        self._check_parameters(m)

    def _check_parameters(self, m: Any) -> None:
        parameters = self.parameters(m)
        check(parameters)
        for patch, sigma_1 in zip(self.patches, parameters["sigma_1"], strict=True):
            refuse_damping(sigma_1, patch.model.compiled.compliance)

    # ------------------------------------------------------------------ friction of each environment

    def parameters(self, m: Any = None) -> dict[str, np.ndarray]:
        """Return the parameters of the patches in a copy of the model, or in the model, by name: views `[k]`.

        Write new numbers into them at any time; the next step takes them. Names are those of `pf.randomise`. Laws with
        a rate of their own (`RateLaw`) keep their numbers.
        """
        return parameters_in(self.m if m is None else m, self._place, len(self.patches))

    def copies(self, parameters: Mapping[str, Any]) -> list[Any]:
        """Return copies of the model, one for each of E environments, with these parameters, as `pf.randomise` draws.

        Each is `[E]` or, for patches that differ, `[E, k]`, or a number for all.

        Raises `InvalidValueError` for unknown names, other shapes, numbers that break the rule of a parameter, and
        without an array.
        """
        values = check(parameters)
        counts = [len(value) for value in values.values() if value.ndim]
        if not counts:
            raise InvalidValueError(
                "parameters",
                "hold an array, with a number for each environment",
                "none",
            )
        models = [copy.copy(self.m) for _ in range(counts[0])]
        shapes = (), (len(models),), (len(models), len(self.patches))
        for name, value in values.items():
            if value.shape not in shapes:
                rule = f"have shape {' or '.join(str(list(each)) for each in shapes)}"
                raise InvalidValueError(name, rule, value.shape)
            rows = np.broadcast_to(
                value.reshape(*value.shape, *[1] * (2 - value.ndim)), shapes[2]
            )
            for m, row in zip(models, rows, strict=True):
                self.parameters(m)[name][:] = row
        for m in models:
            self._check_parameters(m)
        return models

    # ------------------------------------------------------------------ what the data hold

    def _own(self, d: Any, first: int, count: int) -> np.ndarray:
        self._say_alone(d)
        return d.userdata[first : first + count]

    def _say_alone(self, d: Any) -> None:
        """Warn, once, if data have moved on by steps without friction."""
        self._used[:] = [True]
        # 0 before the first step: the data may come from elsewhere.
        last = d.userdata[self._memory.next]
        steps = (d.time - last) / d.model.opt.timestep
        if (
            last != 0.0
            and 0.5 < steps < 1e9
            and abs(steps - round(steps)) < 1e-6
            and _ALONE not in self._said
        ):
            self._said.add(_ALONE)
            line = f"the time of these data went on by {round(steps)} steps without patch friction"
            warnings.warn(f"{line}: {_ALONE}", stacklevel=4)

    def state(self, d: Any) -> np.ndarray:
        """Return the state of all patches now, as a view of `userdata`, which `coupled.states` gives its shape."""
        at = self._memory
        stepped = d.time == d.userdata[at.next]
        return self._own(
            d, at.after if stepped else at.state, self.coupled.state_shape[0]
        )

    def wrenches(self, d: Any) -> np.ndarray:
        """Return the last wrenches `[k, 3]` [N, N, N m] on the sites' bodies, in the patches' frames; a view."""
        return self._own(d, self._memory.wrench, 3 * len(self.patches)).reshape(-1, 3)

    def twists(self, d: Any) -> np.ndarray:
        """Return the last mean twists `[k, 3]` [m/s, m/s, rad/s] of the sites' surfaces relative to the others."""
        return self._own(d, self._memory.twist, 3 * len(self.patches)).reshape(-1, 3)

    def loads(self, d: Any) -> np.ndarray:
        """Return the normal forces at the end of the last step `[k]` [N]."""
        return self._own(d, self._memory.load, len(self.patches))

    def frame(self, d: Any, p: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the origin [3] of patch p in the world, and its axes [3, 3] as rows: x, y, normal.

        It is that of the last step; without contact it is the site, and its axes are not numbers.
        """
        placed = self.placed[p]
        at = self._memory.centre + 3 * p
        own = self.parameters(d.model)
        axis = self._memory.axis + 3 * p
        kept = d.userdata[at : at + 3], d.userdata[axis : axis + 3]
        origin, axes = placed.frame(d, *placed.contacts(d), *kept)
        return origin + own["centre_x"][p] * axes[0] + own["centre_y"][p] * axes[
            1
        ], axes

    def misplaced(self, d: Any) -> str | None:
        """Return a line about a patch that did not lie in its contact in the last step, None if all did.

        Its site is so far beside the contact forces that they act beyond the patch, or has its x axis along the normal.
        `step` warns of it once.
        """
        return misplaced_line(self.placed, int(d.userdata[self._memory.misplaced]))

    def report(self, d: Any) -> Report:
        """Return the statistics of the last step."""
        at = self._memory
        u = d.userdata
        return Report(
            int(u[at.iterations]),
            int(u[at.passes]),
            float(u[at.residual]),
            bool(u[at.converged]),
        )

    def reset(self, d: Any) -> None:
        """Relax all bristles."""
        at = self._memory
        d.userdata[at.before : at.converged + 1] = 0.0
        d.userdata[at.next] = d.time

    def draw(self, scene: Any, d: Any) -> None:
        """Add each patch in contact to an `MjvScene`: its outline, its friction, and its centre of rotation.

        Friction forces have the scale of MuJoCo's contact forces, `vis.map.force / stat.meanmass` metres per newton.

        Raises `InvalidValueError` if the scene has no room for more geoms.
        """
        newton = self.m.vis.map.force / self.m.stat.meanmass
        wrenches = self.wrenches(d)
        twists = self.twists(d)
        for p, (placed, wrench, twist) in enumerate(
            zip(self.placed, wrenches, twists, strict=True)
        ):
            chosen, _ = placed.contacts(d)
            if len(chosen):
                origin, axes = self.frame(d, p)
                # between the two surfaces, which overlap by what the contact gives
                middle = origin + axes[2] * (
                    axes[2] @ (d.contact.pos[chosen].mean(axis=0) - origin)
                )
                scale = float(self.parameters(d.model)["scale"][p])
                draw_patch(
                    scene,
                    placed.patch.model.patch,
                    (middle, axes),
                    wrench,
                    twist,
                    newton,
                    scale,
                )

    # ------------------------------------------------------------------ steps

    def step(self, d: Any) -> None:
        """Take a step with patch friction, instead of `mj_step`.

        Raises `InvalidValueError` for data of another model, for options of the model that have been changed to what
        does not fit, before the step, and for a state that is not finite.
        """
        last = self._last
        if d is not last[0]:
            last = self._last = self._found(d)
        _, m, numbers, places = last
        if d.time != numbers[self._memory.next]:
            self._say_alone(d)
        mujoco.mj_step1(m, d)
        if loops.plan_step(*places):
            mujoco.mj_step2(m, d)
            return
        iterations = numbers[self._memory.iterations]
        if iterations == loops.UNFIT:
            self._check(m)
        mujoco.mj_step2(m, d)
        line = self.misplaced(d)
        if line is not None and line not in self._said:
            self._said.add(line)
            warnings.warn(line, stacklevel=2)
        if iterations < 0.0:
            raise InvalidValueError("state", "be finite", "a number that is not")

    def _found(self, d: Any) -> tuple[Any, ...]:
        """Return data with their model, their numbers and the addresses that a step takes: the dear part of a step."""
        m = d.model
        host = place_of(self._row)
        if m is not self.m and not loops.is_served(host, m._address):
            raise InvalidValueError(
                "d",
                "be data of the model of the patches, or of a copy",
                "data of another model",
            )
        self._used[:] = [True]
        return d, m, d.userdata, (host, m._address, d._address)

    @contextmanager
    def install(self) -> Iterator[Friction]:
        """Add friction to `mj_step` within a `with` block, and so to the reader, `mujoco.rollout` and derivatives.

        This applies to all data of this model and of its copies: models of the same names and bodies that were prepared
        for the same patches. MuJoCo calls compiled code, on any number of threads. A step with options that do not fit
        has no friction (see `report`).

        Raises `FrictionError` if another control callback is installed, and at the end of the block `InvalidValueError`
        if options of this model do not fit any more.
        """
        self._check(self.m)
        self._used[:] = [True]
        if mujoco.get_mjcb_control() is not None or loops.INSTALLED[0] != 0:
            raise FrictionError(
                "a control callback is installed already: remove it with mujoco.set_mjcb_control(None)"
            )
        loops.INSTALLED[0] = place_of(self._row)
        mujoco.set_mjcb_control(_callback())
        try:
            yield self
        finally:
            mujoco.set_mjcb_control(None)
            loops.INSTALLED[0] = 0
        self._check(self.m)

    @functools.cached_property
    def _row(self) -> np.ndarray:
        """Record of the model for compiled steps, which are ready then."""
        loops.compile_ahead()
        return self._host_row()

    def _host_row(self) -> np.ndarray:
        packed = self.coupled._packed
        k = len(self.patches)
        problem = self.coupled._blank_problem([each.follows for each in self.placed])
        scratch = scratch_layout(
            packed.layout.size, int(packed.sizes.sum()), k, self.m.nv
        )
        columns = np.array(
            [[getattr(each, name) for each in self.placed] for name in _COLUMNS],
            np.int64,
        )
        joints = np.flatnonzero(self.m.jnt_type == int(mujoco.mjtJoint.mjJNT_FREE))
        free = np.array([joints, self.m.jnt_dofadr[joints]], np.int64)
        extents = np.array(
            [placing.reach_of(each.patch.model.patch) for each in self.placed]
        )
        laws = np.array([_sort_of_law(patch.model) for patch in self.patches], np.int64)
        self._kept = problem, columns, free, packed, extents, laws
        places = {
            name: place_of(columns) + 8 * k * i for i, name in enumerate(_COLUMNS)
        }
        host = Host(
            m=self.m._address, same_count=len(same()), same=place_of(same()),
            nv=self.m.nv, nuserdata=self.m.nuserdata, count=k, states=self.coupled.state_shape[0],
            words=packed.layout.size, scratch_words=scratch.size, problem=place_of(problem),
            patches=packed.patches.address, solve=address_of(kernels.solve), plan=address_of(loops.plan),
            free_count=len(joints), parameters=self._place, laws=place_of(laws), record_words=place_of(packed.sizes),
            free_joints=place_of(free), free_dofs=place_of(free) + 8 * len(joints),
            extents=place_of(extents), memory=self._memory, scratch=scratch.offsets, **places, **layout(),
        )  # fmt: skip
        return row_of(host)


_COLUMNS = (
    "site",
    "own",
    "other",
    "owner",
    "support",
    "pair",
    "centre",
    "curved",
    "carrier",
    "on_box",
)
"""Attributes of `Placed` that compiled steps read, and fields of `Host` with their addresses."""

_ALONE = "mj_step has none by itself; call friction.step(d) instead, or mj_step within friction.install()"


def _sort_of_law(model: FrictionModel) -> int:
    """Return the sort of a patch in `Host.laws`."""
    pad = model.reduction.pad
    if pad is None or pad.springs_of_law:
        return int(not is_rate_law(model.law))
    return STIFF if model.compiled.compliance is None else HANGS


def _say_unused(used: list[bool]) -> None:
    """Warn of friction that no step has had."""
    if not used:
        warnings.warn(f"Friction was made and not used: {_ALONE}", stacklevel=2)


@functools.cache
def _callback() -> Any:
    """Return the compiled control callback."""
    return ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(
        loops.control_address()
    )
