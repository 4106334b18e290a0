"""A Drake system that adds patch friction to a discrete plant, implicit in contact space."""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue  # pyright: ignore[reportMissingModuleSource]
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import (
    DiagramBuilder,
    LeafSystem,
    PortDataType,
    ValueProducer,
)
from pydrake.systems.primitives import ConstantValueSource, ConstantVectorSource

from planarfriction._support import validation
from planarfriction.adapters.drake.coupled_step import Asking
from planarfriction.adapters.drake.patches import PatchContact, found
from planarfriction.adapters.drake.plant_copy import Shadow
from planarfriction.coupling import CoupledPatches
from planarfriction.errors import InvalidValueError

EXPECTED = 1e-5
"""Difference between predicted and actual velocities [m/s, rad/s] that is not noticed: rounding comes to 1e-7."""

_SURPRISED = """the plant moves otherwise than predicted, by {:.3g}: one of its input ports was fixed after AddToBuilder
(connect a source before it), parameters in its context are not those with which friction was added, or its solver has
not converged""".replace("\n", " ")

_GEOMETRY = "geometry_query"
_FORCE = "applied_generalized_force"


class Report(NamedTuple):
    """Statistics of one step."""

    passes: int
    """Number of evaluations of the plant's step."""
    iterations: int
    """Newton iterations, summed over all passes."""
    residual: float
    """Residual of the step in contact space [m/s]."""
    misfit: float
    """Difference between the twists that were solved for and those of the plant [m/s]. Spins are multiplied by the size
    of the patch; loads count as the speed they could cause."""
    surprise: float
    """Largest difference between the velocities of the plant and those predicted for it in the last step [m/s, rad/s].
    It is large once where a state is set, and in every step where parameters in the plant's context are not those with
    which friction was added."""
    converged: bool
    """True if the step in contact space has converged and the plant did not surprise twice in a row."""


class Friction(LeafSystem):
    """Patch friction for a discrete plant, as a system that `AddToBuilder` adds to a diagram next to the plant.

    The context holds the states of the bristles, the wrenches, twists and loads; the output ports give those of the
    last step. The plant's parameters and shapes are those it has when this system is made; where the plant moves
    otherwise than they predict, `Report.converged` is False, and a warning says so once.

    Raises `InvalidValueError` for plants that are continuous or not finalized, names that are not in the plant, and
    pairs with friction of their own.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        scene_graph: SceneGraph,
        patches: Iterable[PatchContact],
    ) -> None:
        super().__init__()
        self.set_name("patch_friction")
        _check(plant, scene_graph)
        self._placed = found(plant, scene_graph, patches)
        self.patches = tuple(each.patch for each in self._placed)
        self.coupled = CoupledPatches([patch.model for patch in self.patches])
        self._shadow = Shadow(plant, scene_graph, self._placed)
        self._asking = Asking(self._shadow, self.coupled, plant.num_velocities())
        self._size = plant.num_velocities()
        self._said: set[str] = set()
        self._declare_inputs(plant)
        k = len(self.patches)
        states = self.coupled.state_shape[0]
        sizes = {
            "bristles": states, "wrenches": 3 * k, "force": self._size, "owed": 3 * k, "axes": 3 * k, "twists": 3 * k,
            "loads": k, "covers": self._shadow.covers[-1].stop, "answers": k * (1 + 12 * k),
            "velocities": self._size, "report": len(Report._fields),
        }  # fmt: skip
        bounds = np.cumsum([0, *sizes.values()])
        self._parts = {
            name: slice(*ends)
            for name, ends in zip(sizes, itertools.pairwise(bounds), strict=True)
        }
        self.DeclareDiscreteState(int(bounds[-1]))
        producer = ValueProducer(lambda: AbstractValue.Make(()), self._solve)
        tickets = {self.all_input_ports_ticket(), self.xd_ticket()}
        self._solution: Any = self.DeclareCacheEntry("solution", producer, tickets)
        self.DeclareVectorOutputPort(
            "generalized_force",
            self._size,
            self._write_force,
            {self._solution.ticket()},
        )
        for name in ("wrenches", "twists", "loads", "report"):
            self.DeclareVectorOutputPort(
                name, sizes[name], self._writer(name), {self.xd_ticket()}
            )
        # Of the same kind as that of the plant: both are then worked out from the state before either.
        if plant.has_sampled_output_ports():
            self.DeclarePeriodicUnrestrictedUpdateEvent(
                plant.time_step(), 0.0, self._update
            )
        else:
            self.DeclarePeriodicDiscreteUpdateEvent(
                plant.time_step(), 0.0, self._update_discrete
            )

    @staticmethod
    def AddToBuilder(
        builder: DiagramBuilder,
        plant: MultibodyPlant,
        scene_graph: SceneGraph,
        patches: Iterable[PatchContact],
    ) -> Friction:
        """Add patch friction to a builder and connect it; connect all other inputs of the plant before.

        What was connected to the plant's `applied_generalized_force` is added to the friction.

        Raises `InvalidValueError` as the class does, for inputs of the plant that are exported, and for a plant that
        has patch friction already.
        """
        validation.instance("builder", builder, DiagramBuilder, "a DiagramBuilder")
        friction = Friction(plant, scene_graph, patches)
        sources = _sources(builder, plant)
        if _FORCE in sources and isinstance(sources[_FORCE].get_system(), Friction):
            raise InvalidValueError(
                "plant",
                "have no patch friction yet: give all patches in one call",
                "one with it",
            )
        builder.AddSystem(friction)
        builder.Connect(plant.get_state_output_port(), friction.GetInputPort("state"))
        for name in friction._inputs:
            port = plant.GetInputPort(name)
            own = friction.GetInputPort(name)
            if name in sources:
                builder.Connect(sources[name], own)
                if name == _FORCE:
                    builder.Disconnect(sources[name], port)
        builder.Connect(
            friction.GetOutputPort("generalized_force"), plant.GetInputPort(_FORCE)
        )
        _reserve(builder, plant, sources)
        return friction

    # ------------------------------------------------------------------ what a context holds

    def GetBristles(self, context: Any) -> list[np.ndarray]:
        """Return copies of the states of all patches from this system's context, in the shapes of their models."""
        return self.coupled.states(self._read(context, "bristles").copy())

    def GetReport(self, context: Any) -> Report:
        """Return the statistics of the last step, from this system's context."""
        passes, iterations, residual, misfit, surprise, converged = self._read(
            context, "report"
        ).tolist()
        return Report(
            int(passes), int(iterations), residual, misfit, surprise, converged > 0.0
        )

    def get_generalized_force_output_port(self) -> Any:
        """Return the port to connect to the plant: friction plus the generalized forces that others apply `[nv]`."""
        return self.GetOutputPort("generalized_force")

    def get_wrenches_output_port(self) -> Any:
        """Return the wrenches of the last step, patch by patch `[3k]` [N, N, N m]."""
        return self.GetOutputPort("wrenches")

    def get_twists_output_port(self) -> Any:
        """Return the twists at the end of the last step `[3k]` [m/s, m/s, rad/s]."""
        return self.GetOutputPort("twists")

    def get_loads_output_port(self) -> Any:
        """Return the normal forces of the last step `[k]` [N]."""
        return self.GetOutputPort("loads")

    def get_report_output_port(self) -> Any:
        """Return the numbers of `Report` `[6]`."""
        return self.GetOutputPort("report")

    # ------------------------------------------------------------------ a step

    def _declare_inputs(self, plant: Any) -> None:
        """Declare the inputs: the state of the plant, and all that drives the plant."""
        self._state: Any = self.DeclareVectorInputPort(
            "state", plant.num_multibody_states()
        )
        self._inputs: dict[str, Any] = {}
        for i in range(plant.num_input_ports()):
            port = plant.get_input_port(i)
            if port.get_name() == _GEOMETRY:
                continue
            name = port.get_name()
            if port.get_data_type() == PortDataType.kAbstractValued:
                self._inputs[name] = self.DeclareAbstractInputPort(
                    name, plant.AllocateInputAbstract(port)
                )
            elif port.size():
                self._inputs[name] = self.DeclareVectorInputPort(name, port.size())

    def _read(self, context: Any, name: str) -> np.ndarray:
        return context.get_discrete_state_vector().value()[self._parts[name]]

    def _solve(self, context: Any, solution: Any) -> None:
        state = self._state.Eval(context)
        parts = self._parts
        if not math.isfinite(state.sum()):
            raise InvalidValueError(
                "state",
                "be finite",
                f"{state[~np.isfinite(state)][0]} in that of the plant",
            )
        port = self._inputs[_FORCE]
        applied = port.Eval(context) if port.HasValue(context) else np.zeros(self._size)
        ports = {
            name: each
            for name, each in self._inputs.items()
            if name != _FORCE and each.HasValue(context)
        }
        driven = {
            name: self.EvalAbstractInput(context, each.get_index())
            for name, each in ports.items()
        }
        self._shadow.begin(state, driven)
        own = context.get_discrete_state_vector().value()
        before = (
            own[parts[name]]
            for name in (
                "bristles",
                "wrenches",
                "force",
                "owed",
                "axes",
                "answers",
                "covers",
            )
        )
        asked = self._asking.step(applied, *before)
        *report, converged = asked.report
        surprise = self._surprise(state, own)
        last = own[parts["report"]][-2]
        if min(surprise, last) > EXPECTED:
            converged = 0.0
            self._warn(_SURPRISED, _SURPRISED.format(surprise))
        for placed, touching, fault in zip(
            self._placed, asked.touching, self._shadow.faults, strict=True
        ):
            if touching and fault:
                line = placed.misplaced_line(fault)
                self._warn(line, line)
        asked = asked._replace(report=(*report, surprise, converged))
        solution.set_value((applied + asked.force, np.concatenate(asked)))

    def _warn(self, kind: str, line: str) -> None:
        """Warn once of a kind."""
        if kind not in self._said:
            self._said.add(kind)
            warnings.warn(line, stacklevel=3)

    def _surprise(self, state: np.ndarray, own: np.ndarray) -> float:
        """Return how far the plant's velocities are from those predicted in the last step; 0 in the first one."""
        if own[self._parts["report"]][0] == 0.0:
            return 0.0
        return float(
            abs(state[len(state) - self._size :] - own[self._parts["velocities"]]).max(
                initial=0.0
            )
        )

    def _write_force(self, context: Any, output: Any) -> None:
        output.SetFromVector(self._solution.Eval(context)[0])

    def _writer(self, name: str) -> Any:
        return lambda context, output: output.SetFromVector(self._read(context, name))

    def _update(self, context: Any, state: Any) -> None:
        self._update_discrete(context, state.get_mutable_discrete_state())

    def _update_discrete(self, context: Any, state: Any) -> None:
        state.get_mutable_vector(0).SetFromVector(self._solution.Eval(context)[1])


def _check(plant: Any, scene_graph: Any) -> None:
    validation.instance("plant", plant, MultibodyPlant, "a MultibodyPlant")
    validation.instance("scene_graph", scene_graph, SceneGraph, "a SceneGraph")
    if not plant.is_finalized():
        raise InvalidValueError("plant", "be finalized", "one that is not")
    if plant.time_step() == 0.0:
        raise InvalidValueError(
            "time_step", "be > 0: friction is for discrete plants", plant.time_step()
        )
    if not plant.geometry_source_is_registered():
        raise InvalidValueError(
            "plant", "be registered with the scene graph", "one that is not"
        )


def _sources(builder: Any, plant: Any) -> dict[str, Any]:
    """Return the output ports that drive the plant, by the names of its inputs."""
    sources = {}
    for (system, index), (source, output) in builder.connection_map().items():
        if system is plant:
            sources[plant.get_input_port(index).get_name()] = source.get_output_port(
                output
            )
    for i in range(plant.num_input_ports()):
        port = plant.get_input_port(i)
        if builder.IsConnectedOrExported(port) and port.get_name() not in sources:
            raise InvalidValueError(
                "plant",
                "have no exported input (export that of a PassThrough)",
                port.get_name(),
            )
    return sources


def _reserve(builder: Any, plant: Any, sources: dict[str, Any]) -> None:
    """Connect free inputs to nothing, so that Drake refuses later connections, which would not be seen here."""
    for i in range(plant.num_input_ports()):
        port = plant.get_input_port(i)
        name = port.get_name()
        nothing = None
        if name == "applied_spatial_force":
            nothing = ConstantValueSource(plant.AllocateInputAbstract(port))
        elif name.endswith("actuation") and port.size():
            zeros: Any = np.zeros(port.size())
            nothing = ConstantVectorSource(zeros)
        if nothing is not None and name not in sources:
            builder.Connect(builder.AddSystem(nothing).get_output_port(), port)
