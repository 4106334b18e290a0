"""`simulate`: run a scene with the structured solver."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from planarfriction._engine.body.integration import Method, Output
from planarfriction._support import validation
from planarfriction.errors import InvalidValueError, SimulationInterrupted, SolverError
from planarfriction.scenes.packing import SegmentBatches, centres_of_pressure
from planarfriction.scenes.scene import MAX_STEPS, Scene, SolverOptions
from planarfriction.scenes.solution import History, Solution
from planarfriction.solvers import RODAS4, integrate
from planarfriction.solvers.structured import compiled_together

BRISTLES = ("none", "all")
"""Choices of `simulate(..., bristles=)`."""

MOST_NUMBERS = 10**9
"""Numbers of bristles that a run records at most: 8 GB."""

_BODY = ("vx", "vy", "omega", "x", "y", "theta")
_CONTACT = ("fx", "fy", "tau", "normal_force")

_QUANTITIES = {
    "time": ("s", "time"),
    "vx": ("m/s", "velocity of the centre of mass, world x"),
    "vy": ("m/s", "velocity of the centre of mass, world y"),
    "omega": ("rad/s", "angular velocity, counter-clockwise"),
    "x": ("m", "position of the centre of mass, world x"),
    "y": ("m", "position of the centre of mass, world y"),
    "theta": ("rad", "orientation, counter-clockwise"),
    "fx": (
        "N",
        "friction on the body along x of the contact frame, one of the identical contacts",
    ),
    "fy": (
        "N",
        "friction on the body along y of the contact frame, one of the identical contacts",
    ),
    "tau": (
        "N m",
        "friction torque on the body about the contact frame's origin, one of the identical contacts",
    ),
    "normal_force": ("N", "normal force of one of the identical contacts"),
    "pressure_x": ("m", "centre of pressure along x of the contact frame"),
    "pressure_y": ("m", "centre of pressure along y of the contact frame"),
    "ended": (
        "s",
        "time since which the contact is beyond the edge of the body; NaN while it touches",
    ),
}
"""Unit and description of what is recorded."""


def simulate(
    scene: Scene,
    *,
    t_end: float | None = None,
    rtol: float | None = None,
    atol: float | None = None,
    save_every: float | None = None,
    bristles: str = "none",
    method: Method = RODAS4,
    progress: Callable[[float], None] | None = None,
    max_steps: int = MAX_STEPS,
) -> Solution:
    """Simulate a scene from its start at t = 0 and record it every `save_every` [s]; returns a `Solution`.

    Each step keeps its error below `rtol |y| + atol y_0`, for every component of the body's motion and for the mean
    over each contact's bristles. The nominal values `y_0` are mu_c/sigma_0 for bristles and positions and a tenth of
    v_s for velocities (a hundredth with the published reduced model); for angles both are divided by the contact
    radius. So `atol` is a share of a full bristle deflection. A step during which the twist of a contact turns is also
    checked between its ends. The solver stops exactly at every break of a signal. The first run after an installation
    compiles the solver; a line on the terminal or in the notebook says so.

    `t_end` [s] is at most the scene's own. The tolerances `rtol` and `atol` [-], > 0, and `save_every` are the scene's
    own by default; if only `rtol` is given, `atol` changes in proportion. The end is always recorded. `bristles="all"`
    also records the state of each contact, as variables `bristles_<contact>`. `method` is
    `planarfriction.solvers.RODAS4` (default) or `RODAS3`, and `progress` is called with the simulated time [s] from
    time to time. At most `max_steps` steps are tried, accepted or rejected: whatever the scene asks for, a run ends.

    Raises InvalidValueError for a parameter that breaks its rule; SolverError, with the solution so far and a remedy,
    where the solver fails or has tried `max_steps` steps; SimulationInterrupted, with the solution so far, after Ctrl-C
    (before anything is recorded, for example during compilation, a plain `KeyboardInterrupt`).
    """
    if not isinstance(scene, Scene):
        raise InvalidValueError("scene", "be a Scene", type(scene).__name__)
    plan = SolverOptions(t_end, rtol, atol, save_every, max_steps).plan(scene)
    validation.choice("bristles", bristles, BRISTLES)
    if not isinstance(method, Method):
        raise InvalidValueError("method", "be solvers.RODAS4 or solvers.RODAS3", method)
    if not (progress is None or callable(progress)):
        raise InvalidValueError(
            "progress", "be a function of the simulated time, or None", progress
        )
    with compiled_together():
        batches = SegmentBatches(scene, plan.end, times=plan.times)
        output = _output(scene, plan.times, batches, bristles)
        scales = plan.atol * batches.state_scale
        limits = {"rtol": plan.rtol, "atol": scales, "max_steps": plan.max_steps}
        run = integrate(
            batches, output, batches.state, method=method, progress=progress, **limits
        )
    cost = replace(
        run.statistics, compile_time=run.statistics.compile_time + batches.loading
    )
    solution = Solution(
        _histories(scene, batches, run.output), cost, run.status, run.message, scene
    )
    if run.status == "interrupted":
        raise SimulationInterrupted(solution)
    if run.status not in ("success", "at rest", "left its contacts"):
        raise SolverError(f"at t = {run.output.time[-1]:g} s: {run.message}", solution)
    return solution


def _output(
    scene: Scene, times: np.ndarray, batches: SegmentBatches, bristles: str
) -> Output:
    count = len(times)
    contacts = len(batches.models)
    states = int(batches.bristles[-1])
    if bristles == "all" and count * states > MOST_NUMBERS:
        given = f"{count} samples of {states} numbers"
        rule = f"be 'none' above {MOST_NUMBERS} numbers (raise save_every)"
        raise InvalidValueError("bristles", rule, given)
    recorded = np.empty((count, states) if bristles == "all" else (0, 0))
    follows = sum(contact.pressure == "follows" for contact in scene.contacts)
    body, wrench, load = map(
        np.empty, ((count, 6), (count, contacts, 3), (count, contacts))
    )
    ended = np.full(
        contacts if any(contact.edge for contact in scene.contacts) else 0, np.nan
    )
    return Output(
        times, body, wrench, load, recorded, np.empty((follows * count, 2)), ended
    )


def _histories(
    scene: Scene, batches: SegmentBatches, output: Output
) -> dict[str, History]:
    """Return what was recorded, by name, with units."""

    def history(name: str, values: np.ndarray) -> History:
        unit, long_name = _QUANTITIES[name]
        if scene.velocity is not None and name in ("vx", "vy"):
            long_name = long_name.replace(
                "centre of mass, world", "origin of the body's axes, body"
            )
        dims = ("time", "contact")[: values.ndim]
        return History(dims, values, {"units": unit, "long_name": long_name})

    histories = {name: history(name, output.body[:, i]) for i, name in enumerate(_BODY)}
    for name, values in zip(
        _CONTACT, (*np.moveaxis(output.wrench, -1, 0), output.load), strict=True
    ):
        histories[name] = history(name, values)
    if scene.contacts[0].pressure == "follows":
        centres = centres_of_pressure(
            scene.contacts[0], output.pressure, output.load[:, 0]
        )
        for i, name in enumerate(("pressure_x", "pressure_y")):
            histories[name] = history(name, centres[:, i : i + 1])
    if len(output.ended):
        histories["ended"] = history("ended", output.ended)._replace(dims=("contact",))
    if len(output.bristles):
        for c, contact in enumerate(scene.contacts):
            cells = batches.cells[c]
            values = output.bristles[:, slice(*batches.bristles[c : c + 2])]
            dims = ("time", "component")
            units = contact.model.state_units
            if cells is not None:
                few = contact.model.reduction
                size = few.patch.bristles
                # Without the place of the pressure.
                bent, behind = np.split(values, [size * cells.sum()], axis=1)
                values = np.zeros((len(bent), size, len(cells)))
                values[:, :, cells] = bent.reshape(len(bent), size, -1)
                axis = "axis" if size == 2 else "component"
                dims = ("time", axis, f"cell_{contact.name}")
                units = "m"
                if few.state_shape != values.shape[1:]:  # with the face of a pad behind
                    values = np.hstack([values.reshape(len(bent), -1), behind])
                    dims = ("time", f"state_{contact.name}")
            name = f"bristles_{contact.name}"
            histories[name] = History(dims, values, {"units": units})
    histories["time"] = history("time", output.time)
    histories["contact"] = History(
        ("contact",), np.array([contact.name for contact in scene.contacts]), {}
    )
    return histories
