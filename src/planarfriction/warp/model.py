"""Friction models whose contacts are stepped by a Warp kernel."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import warp as wp

from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.export.pieces import pieces_of
from planarfriction.models import FrictionModel
from planarfriction.warp import arrays
from planarfriction.warp.kernels import Batch, kernel_of
from planarfriction.warp.source import source_of

WRONG = {1: "parameters", 2: "state, twist and normal_force"}
"""Bits of `Model.status`."""


class Model:
    """A friction model for `contacts` contacts: a Warp kernel with one thread a contact.

    The step is the model's own (`FrictionModel.step`), traced from the same formulas. Twists (vx, vy, omega) [m/s,
    rad/s] and wrenches (fx, fy, tau) [N, N m] are about the origin of the contact frame.

    Parameters
    ----------
    model
        A `ReducedModel`, `DistributedModel` or `ReducedModelPublished` with a law of LuGre bristles; or several that
        are stepped by the same code, as `ReducedModel` of any patches is: those of fewer cells have cells without load
        behind their own, and states for these.
    contacts
        Number of contacts.
    which
        Index of the model of each contact [contacts], if there are several.
    parameters
        Numbers of the law for each contact, by name (see `names`): a number, or an array [contacts]. `scale` is the
        size of the patch as a multiple of the model's: lengths of patch and lever arms, not of bristles, nor the
        stiffness of a pad. What is not given is the model's.
    device
        Warp device, by default Warp's current one.
    dtype
        `wp.float32` or `wp.float64`, of all arrays.

    Raises InvalidValueError for models without source (see `export_c`) or of several sources, and parameters without
    that name or shape.
    """

    def __init__(
        self,
        model: FrictionModel | Sequence[FrictionModel],
        *,
        contacts: int,
        which: Any = None,
        parameters: Mapping[str, Any] | None = None,
        device: Any = None,
        dtype: Any = wp.float32,
    ) -> None:
        models = list(model) if isinstance(model, Sequence) else [model]
        if not models:
            raise InvalidValueError("model", "hold at least one", "none")
        self.contacts = validation.count("contacts", contacts, at_most=2**31 - 1)
        self.device = wp.get_device(device)
        self.dtype = dtype
        kinds = self._indices(which, len(models))
        precision = arrays.precision_of(dtype)
        most = max((each.state_shape for each in models), key=math.prod)
        pieces = [
            pieces_of(each, precision, count=most[-1] if len(most) > 1 else 0)
            for each in models
        ]
        sources = [source_of(each, precision) for each in pieces]
        if any(each.text != sources[0].text for each in sources):
            raise InvalidValueError(
                "model",
                "have one source, as all of `ReducedModel(patch, law)` do",
                "several",
            )
        numbers = [{**each.parameters, "scale": 1.0} for each in pieces]
        self.names = tuple(numbers[0])
        """Parameters in the order of the columns of `parameters`."""
        self.state_shape = (self.contacts, *most)
        columns = {
            name: np.array([each[name] for each in numbers]) for name in self.names
        }
        differ = {
            name: each[kinds]
            for name, each in columns.items()
            if (each != each[0]).any()
        }
        rows = arrays.parameter_rows(
            numbers[0], differ | dict(parameters or {}), self.contacts
        )
        self.parameters = wp.array(rows, dtype=dtype, device=self.device)
        """Parameters [contacts or 1, names]; a program may write new ones between steps."""
        self.which = wp.array(kinds, dtype=wp.int32, device=self.device)
        """Index of the model of each contact [contacts]; a program may write new ones between steps."""
        self.status = wp.zeros(self.contacts, dtype=wp.int32, device=self.device)
        """Bits of what was wrong since the last `check` [contacts]: 1 in parameters, 2 in state, twist or load."""
        self._numbers = wp.array(
            np.stack([each.numbers for each in sources]),
            dtype=dtype,
            device=self.device,
        )
        self.kernel = kernel_of(sources[0].text, Batch)
        """Kernel of `step` and `rollout`."""
        wp.load_module(self.kernel.module, device=self.device)

    def rest(self) -> wp.array[Any]:
        """Return the state `[contacts, *model.state_shape]` of contacts without memory."""
        return wp.zeros(self.state_shape, dtype=self.dtype, device=self.device)

    def step(
        self,
        state: wp.array[Any],
        twist: wp.array[Any],
        normal_force: wp.array[Any],
        dt: float,
        new_state: wp.array[Any],
        wrench: wp.array[Any],
        *,
        moments: wp.array[Any] | None = None,
    ) -> None:
        """Advance all contacts by dt [s] at held twists, in one kernel without allocation or synchronisation.

        `twist` [contacts, 3], `normal_force` [contacts] [N]; written are `new_state`, which may be `state`, and
        `wrench` [contacts, 3] at the end of the step. A contact without normal force forgets its state. A contact with
        numbers that are not finite or out of range keeps its state and has no wrench (see `check`).

        The pressure follows the `moments` [contacts, 2] [N m] of the normal forces about the origin (see
        `FrictionModel.step`).

        Raises InvalidValueError for arrays of another shape, precision or device, and a step that is negative.
        """
        self._launch((), state, twist, normal_force, dt, new_state, wrench, moments)

    def rollout(
        self,
        state: wp.array[Any],
        twists: wp.array[Any],
        normal_forces: wp.array[Any],
        dt: float,
        new_state: wp.array[Any],
        wrenches: wp.array[Any],
        *,
        moments: wp.array[Any] | None = None,
    ) -> None:
        """Step all contacts through given twists, in one kernel without allocation or synchronisation.

        `twists` [steps, contacts, 3], `normal_forces` [steps, contacts] [N]; written are the last state, `new_state`,
        and `wrenches` [steps, contacts, 3] at the end of each step. `moments` [steps, contacts, 2] as in `step`.

        Raises InvalidValueError as `step` does.
        """
        self._launch(
            twists.shape[:1],
            state,
            twists,
            normal_forces,
            dt,
            new_state,
            wrenches,
            moments,
        )

    def check(self) -> None:
        """Wait for the device, and forget what was wrong.

        Raises InvalidValueError if a contact had numbers that were not finite or out of range since the last check.
        """
        arrays.check(self.status, WRONG, "contacts")

    def _launch(
        self,
        steps: tuple[int, ...],
        state: Any,
        twist: Any,
        load: Any,
        dt: float,
        new: Any,
        wrench: Any,
        moments: Any,
    ) -> None:
        along = (*steps, self.contacts)
        batch = Batch()
        batch.contacts, batch.steps, batch.rows = (
            self.contacts,
            *(steps or (1,)),
            self.parameters.shape[0],
        )
        batch.dt = validation.non_negative("dt", dt)
        batch.state = self._address("state", state, self.state_shape)
        batch.twist = self._address("twist", twist, (*along, 3))
        batch.normal_force = self._address("normal_force", load, along)
        batch.moments = (
            0 if moments is None else self._address("moments", moments, (*along, 2))
        )
        batch.new_state = self._address("new_state", new, self.state_shape)
        batch.wrench = self._address("wrench", wrench, (*along, 3))
        batch.parameters = self.parameters.ptr
        batch.status = self.status.ptr
        batch.numbers = self._numbers.ptr
        batch.number_count = self._numbers.shape[1]
        batch.models = self._numbers.shape[0]
        batch.which = self.which.ptr
        wp.launch(self.kernel, dim=self.contacts, inputs=[batch], device=self.device)

    def _indices(self, which: Any, count: int) -> np.ndarray:
        """Return the index of the model of each contact."""
        if which is None and count > 1:
            raise InvalidValueError("which", "name the model of each contact", "none")
        given = np.zeros(self.contacts, int) if which is None else np.asarray(which)
        if (
            given.shape != (self.contacts,)
            or given.dtype.kind not in "iu"
            or not np.isin(given, range(count)).all()
        ):
            raise InvalidValueError(
                "which",
                f"be {self.contacts} whole numbers from 0 to {count - 1}",
                which,
            )
        return given

    def _address(self, name: str, given: Any, shape: tuple[int, ...]) -> int:
        return arrays.address(name, given, shape, self.dtype, self.device)
