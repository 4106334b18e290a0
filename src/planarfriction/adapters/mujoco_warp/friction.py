# pyright: reportAttributeAccessIssue=false
"""Steps of MuJoCo Warp with patch friction, implicit in contact space."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import mujoco
import mujoco_warp as mjw
import numpy as np
import warp as wp

from planarfriction._engine.coupled import placing
from planarfriction._support import validation
from planarfriction.adapters.mujoco.friction import Report
from planarfriction.adapters.mujoco.patches import (
    PatchContact,
    Placed,
    check_once,
    check_options,
    layout_of,
    memory,
    misplaced_line,
    parameters_in,
    place_of_parameters,
    surface_velocities,
)
from planarfriction.adapters.mujoco_warp.loops import arcs, centres, geometry, responses
from planarfriction.coupling import HostStep
from planarfriction.errors import InvalidValueError
from planarfriction.models.base import lever_of
from planarfriction.warp import CoupledPatches

DISPLACEMENT = "centre_x", "centre_y"
"""Parameters of a displacement (see `pf.randomise`)."""

PASSES = 3
"""Solutions of a step at most: again where the first has activated other constraints."""


class Friction:
    """Patch friction for `worlds` environments of a model that `prepare` has prepared.

    Either call `step()` instead of `mujoco_warp.step`, or use `with friction.install():`, which adds friction to
    `mujoco_warp.step(friction.model, friction.data)` itself, and to CUDA graphs of it. States are stored in the data,
    in the last numbers of `userdata`, in the same way as by `planarfriction.adapters.mujoco`: `mujoco_warp.reset_data`
    resets them too, of single worlds if asked. Bristles take the time step that `m` has at the start: one that is set
    later in `friction.model` is not followed.

    Raises `InvalidValueError` for an unsuitable integrator or cone, noslip iterations, sleeping, disabled actuation,
    too little user data, names that are not in the model, pairs with friction of their own, and models without source
    (see `export_c`).

    Parameters
    ----------
    m
        A model of MuJoCo.
    patches
        Patches in it.
    worlds
        Number of environments.
    parameters
        Numbers of the laws for each environment, and `scale` (see `planarfriction.warp.CoupledPatches`).
    model, data
        Those of MuJoCo Warp, if they are made already; else they are made from `m`, at its initial state.
    nconmax, njmax
        Contacts and constraints of a world at most, if the data are made here.
    """

    def __init__(
        self,
        m: Any,
        patches: Sequence[PatchContact],
        *,
        worlds: int = 1,
        parameters: Mapping[str, Any] | None = None,
        model: Any = None,
        data: Any = None,
        nconmax: int | None = None,
        njmax: int | None = None,
    ) -> None:
        check_once(patches)
        self.m = m
        self.patches = tuple(patches)
        self.placed = [Placed(m, each, unprepared=True) for each in patches]
        _check(m, self.placed)
        worlds = data.nworld if data is not None else validation.count("worlds", worlds)
        models = [patch.model for patch in patches]
        own = _parameters(m, self.placed, worlds)
        # A stiffness of pads alone does not feel that of laws.
        if not any(getattr(each.compiled, "springs", 1.0) for each in models):
            del own["sigma_0"]
        own |= dict(parameters or {})
        follows = [each.follows for each in self.placed]
        self.coupled = CoupledPatches(
            models, worlds=worlds, follows=follows, parameters=own
        )
        self.model = mjw.put_model(m) if model is None else model
        """Model of MuJoCo Warp."""
        self.data: Any = data
        """Data of all environments, of MuJoCo Warp."""
        if data is None:
            d = mujoco.MjData(m)
            mujoco.mj_forward(m, d)
            self.data = mjw.put_data(m, d, nworld=worlds, nconmax=nconmax, njmax=njmax)
        prepared = m.nuserdata if any(each.pair >= 0 for each in self.placed) else 0
        size = layout_of(patches, m.nv).size
        self._memory = (
            self.data.userdata if prepared else wp.zeros((worlds, size), dtype=float)
        )
        self._at = memory(patches, m.nv, prepared or size)
        self._said: set[str] = set()
        self._steps = 0
        self._make(worlds)

    # ------------------------------------------------------------------ what the data hold

    def states(self) -> wp.array[Any]:
        """Return the states of all patches at the ends of the last steps, a view [worlds, states]."""
        return self._kept(self._at.after, self.coupled.state_shape[0])

    def wrenches(self) -> wp.array[Any]:
        """Return the last wrenches on the sites' bodies, in the patches' frames, a view [worlds, 3k] [N, N, N m]."""
        return self._kept(self._at.wrench, 3 * len(self.patches))

    def twists(self) -> wp.array[Any]:
        """Return the last twists of the sites' bodies relative to the others, a view [worlds, 3k] [m/s, m/s, rad/s]."""
        return self._kept(self._at.twist, 3 * len(self.patches))

    def loads(self) -> wp.array[Any]:
        """Return the normal forces at the ends of the last steps, a view [worlds, k] [N]."""
        return self._kept(self._at.load, len(self.patches))

    def report(self) -> Report:
        """Wait for the device; return the statistics of the last step, arrays [worlds]."""
        self._warn()
        u: Any = self._memory.numpy().copy()
        at = self._at
        rounds = u[:, at.iterations].astype(int)
        passes = u[:, at.passes].astype(int)
        return Report(rounds, passes, u[:, at.residual], u[:, at.converged] > 0.0)

    def misplaced(self) -> str | None:
        """Wait for the device; return a line about a patch that did not lie in its contact in the last step.

        It is that of any world, and None if all lay there; see `planarfriction.adapters.mujoco`. `report` warns of it
        once, and `step`, which looks after 1, 2, 4, 8 and so on steps.
        """
        return misplaced_line(
            self.placed, int(self._memory.numpy()[:, self._at.misplaced].max())
        )

    def _warn(self) -> None:
        """Warn, once, of a patch that did not lie in its contact."""
        line = self.misplaced()
        if line is not None and line not in self._said:
            self._said.add(line)
            warnings.warn(line, stacklevel=3)

    def reset(self) -> None:
        """Relax all bristles."""
        self._kept(self._at.before, self._at.converged + 1 - self._at.before).zero_()

    def _kept(self, first: int, count: int) -> Any:
        return self._memory[:, first : first + count]

    # ------------------------------------------------------------------ steps

    def step(self) -> None:
        """Take a step of all environments with patch friction, instead of `mujoco_warp.step`.

        Raises InvalidValueError if `model` or `data` have been replaced.
        """
        with self.install():
            mjw.step(self.model, self.data)
        self._steps += 1
        if (
            self._steps & (self._steps - 1) == 0
            and not self._memory.device.is_capturing  # pyright: ignore[reportOptionalMemberAccess]
        ):
            self._warn()

    @contextmanager
    def install(self) -> Iterator[Friction]:
        """Add friction to `mujoco_warp.step` of the model within a `with` block, after a control callback, if any.

        Raises InvalidValueError, in a step, for data of another model or made elsewhere.
        """
        callbacks = self.model.callback
        before = callbacks.control

        def control(m: Any, d: Any) -> None:
            if before is not None:
                before(m, d)
            self.plan(m, d)

        callbacks.control = control
        try:
            yield self
        finally:
            callbacks.control = before

    def plan(self, m: Any, d: Any) -> None:
        """Add friction to the passive forces for the step from where the data are (a control callback).

        Raises InvalidValueError for another model and other data than `model` and `data`.
        """
        host = self._bound(m, d)
        patches = self._patches
        frames = self._frames
        scratch = self._scratch
        problem = self._problem
        results = self._results
        host.timestep = m.opt.timestep

        def launch(kernel: Any, *inputs: Any) -> None:
            wp.launch(kernel, dim=d.nworld, inputs=inputs)

        launch(
            geometry.recall, patches, self._places, host, frames, problem, self._memory
        )
        launch(geometry.place, patches, host, frames, problem)
        mjw.fwd_actuation(m, d)
        mjw.fwd_acceleration(m, d, factorize=True)
        mjw.solve(m, d)
        launch(
            centres.follow_centres,
            patches,
            host,
            frames,
            problem,
            self.coupled.parameters,
        )
        launch(arcs.bend, patches, host, frames)
        if host.implicit == 2:
            mjw.deriv_smooth_vel(m, d, self._metric)
        for i in range(PASSES):
            launch(
                responses.respond, patches, host, frames, scratch, problem, int(i == 0)
            )
            self.coupled.step(
                self._state, self._host, self._dt, results, skip=scratch.done
            )
            launch(
                responses.settle,
                host,
                frames,
                scratch,
                problem,
                results.wrench,
                results.iterations,
            )
        found = *results[:4], results.residual, results.converged
        launch(
            responses.remember,
            patches,
            self._places,
            host,
            frames,
            scratch,
            problem,
            *found,
            self._memory,
        )

    # ------------------------------------------------------------------ what is made once

    def _make(self, worlds: int) -> None:
        """Make the arrays that steps work with."""
        m = self.m
        k = len(self.patches)
        nv = self.m.nv
        n = 3 * len(self.patches)
        njmax = self.data.efc.force.shape[1]

        def zeros(
            struct: Any, others: tuple[int, ...], **shapes: tuple[int, ...]
        ) -> Any:
            """Return a struct with arrays of zeros, of these shapes behind the axis of worlds."""
            made = struct()
            device = self.coupled.device
            for name, each in struct.vars.items():
                shape = worlds, *shapes.get(name, others)
                setattr(
                    made, name, wp.zeros(shape, dtype=each.type.dtype, device=device)
                )
            return made

        self._dt = float(m.opt.timestep)
        self._places, self._patches = (
            _filled(geometry.Places(), self._at._asdict()),
            self._numbers(),
        )
        self._frames = zeros(
            geometry.Frames, (k,), owner=(njmax,), lever=(njmax,), jacobian=(n, nv)
        )
        both = {
            "answers": (nv, n + 1),
            "gains": (nv, n + 1),
            "stiff": (nv, nv),
            "acceleration": (nv,),
        }
        self._scratch = zeros(
            responses.Scratch, (), active=(njmax,), pressed=(k,), **both
        )
        wide = {
            "response": (n, n),
            "load_response": (k, n),
            "moments": (k, 2),
            "state": self.coupled.state_shape,
        }
        self._problem = p = zeros(
            geometry.ContactSolveArrays, (k, 3), load=(k,), **wide
        )
        self._host = HostStep(
            p.twist, p.load, p.guess, p.response, p.load_response, p.moments
        )
        self._state = p.state
        self._results = self.coupled.results()
        self._metric = wp.zeros(
            (worlds, self.model.nC), dtype=float, device=self.coupled.device
        )
        damped = bool(m.dof_damping.any()) and not m.opt.disableflags & int(
            mujoco.mjtDisableBit.mjDSBL_EULERDAMP
        )
        self._implicit = (
            int(damped) if m.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER else 2
        )

    def _numbers(self) -> Any:
        """Return the numbers of the patches for kernels."""
        shapes = [each.model.state_shape for each in self.patches]
        names = (
            "site",
            "own",
            "other",
            "owner",
            "support",
            "centre",
            "curved",
            "carrier",
        )
        found = {
            name: [int(getattr(each, name)) for each in self.placed] for name in names
        }
        found |= {"bristles": [math.prod(shape[1:]) for shape in shapes]}
        found |= {"first": np.cumsum([0, *map(math.prod, shapes)])[:-1].tolist()}
        found |= {"radius": [lever_of(each.model) for each in self.patches]}
        found |= {
            "reach": [placing.reach_of(each.model.patch) for each in self.patches]
        }
        found |= {
            "scale": [
                end - 1
                for end in np.cumsum(
                    [len(names) for names in self.coupled.names]
                ).tolist()
            ]
        }
        found |= {"surface": surface_velocities(self.m, self.placed).astype(np.float32)}
        kinds = geometry.PatchArrays.vars
        device = self.coupled.device
        arrays = {
            name: wp.array(each, dtype=kinds[name].type.dtype, device=device)
            for name, each in found.items()
        }
        return _filled(
            geometry.PatchArrays(),
            arrays | {"count": len(shapes), "states": self.coupled.state_shape[0]},
        )

    def _bound(self, m: Any, d: Any) -> Any:
        """Return the arrays of model and data for kernels."""
        if m is not self.model or d is not self.data:
            raise InvalidValueError("model, data", "be those of the friction", "others")
        if not hasattr(self, "_arrays"):
            efc = d.efc
            c = d.contact
            own = ("time", "site_xpos", "site_xmat", "geom_xpos", "geom_xmat", "qvel")
            arrays = {name: getattr(d, name) for name in own}
            arrays |= {
                "passive": d.qfrc_passive,
                "smooth": d.qfrc_smooth,
                "warmstart": d.qacc_warmstart,
            }
            arrays |= {
                "nefc": d.nefc,
                "type": efc.type,
                "id": efc.id,
                "force": efc.force,
            }
            arrays |= {"geom": c.geom, "frame": c.frame, "pos": c.pos}
            arrays |= {
                "sparse": int(m.is_sparse), "nnz": efc.J_rownnz, "first": efc.J_rowadr, "column": efc.J_colind,
                "jacobian": efc.J, "stiffness": efc.D, "aref": efc.aref, "loss": efc.frictionloss, "inertia": d.M,
                "metric": self._metric, "inertia_nnz": m.M_rownnz, "inertia_first": m.M_rowadr,
                "inertia_column": m.M_colind, "damping": m.dof_damping, "implicit": self._implicit,
            }  # fmt: skip
            arrays |= {
                "root": m.body_rootid,
                "ancestor": m.body_isdofancestor,
                "centre": d.subtree_com,
                "axis": d.cdof,
            }
            arrays |= {"turned": d.cdof_dot, "velocity": d.cvel}
            self._arrays = _filled(geometry.Host(), arrays)
        return self._arrays


def _parameters(m: Any, placed: Sequence[Placed], worlds: int) -> dict[str, np.ndarray]:
    """Return the parameters of patches that stand in a prepared model, for all worlds; refuse displaced patches."""
    if any(each.pair < 0 for each in placed):
        return {}
    found = parameters_in(m, place_of_parameters(m), len(placed))
    for name in DISPLACEMENT:
        if found[name].any():
            raise InvalidValueError(
                name, "be 0: in Warp patches lie at their sites", found[name].tolist()
            )
    own = {
        name: np.tile(values, (worlds, 1))
        for name, values in found.items()
        if name not in DISPLACEMENT
    }
    if not any(each.patch.model.law.numbers.elasto_plastic for each in placed):
        del own["breakaway_ratio"]
    return own


def _filled(struct: Any, values: Mapping[str, Any]) -> Any:
    """Return a struct of Warp with these values."""
    for name, value in values.items():
        setattr(struct, name, value)
    return struct


def _check(m: Any, placed: Sequence[Placed]) -> None:
    """Refuse options of a model that do not fit."""
    check_options(
        m,
        "Euler",
        "implicitfast",
        cone=", where constraints are linear in their ranges",
    )
    if m.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_ACTUATION):
        rule = "be enabled: MuJoCo Warp calls control callbacks with it alone"
        raise InvalidValueError("actuation", rule, "disabled")
    for each in placed:
        if each.pair >= 0:
            each.check(m)
