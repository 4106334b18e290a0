"""Steps in contact space of the patches of many worlds, as a Warp kernel (see `planarfriction.coupling`)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import warp as wp

from planarfriction import coupling
from planarfriction._support import validation
from planarfriction.coupling import CoupledStep, HostStep
from planarfriction.errors import InvalidValueError
from planarfriction.export.pieces import pieces_of
from planarfriction.models import FrictionModel
from planarfriction.models.base import lever_of
from planarfriction.warp import arrays
from planarfriction.warp.kernels import Problems, kernel_of
from planarfriction.warp.source import coupled_source_of

WRONG = {1: "parameters", 2: "state and host"}
"""Bits of `CoupledPatches.status`."""


class CoupledPatches:
    """Patches of `worlds` worlds, each coupled through the bodies of a host: a Warp kernel with one thread a world.

    The step is that of `planarfriction.coupling.CoupledPatches`. The search is in double precision; bristles are
    stepped in the precision of the arrays.

    Parameters
    ----------
    models
        Friction models, one for each of the k patches of a world: `ReducedModel`, `DistributedModel` or
        `ReducedModelPublished` with a law of LuGre bristles.
    worlds
        Number of worlds.
    follows
        True for each patch whose pressure follows the moments of a host, by default all.
    parameters
        Numbers of the laws by name, and `scale`, the size of a patch as a multiple of its model's: a number, or arrays
        [worlds] or [worlds, k]. What is not given is the models'.
    device
        Warp device, by default Warp's current one.
    dtype
        `wp.float32` or `wp.float64`, of all arrays.

    Raises InvalidValueError for models without source (see `export_c`), and parameters without that name or shape.
    """

    def __init__(
        self,
        models: Sequence[FrictionModel],
        *,
        worlds: int,
        follows: Sequence[bool] | None = None,
        parameters: Mapping[str, Any] | None = None,
        device: Any = None,
        dtype: Any = wp.float32,
    ) -> None:
        self.models = tuple(models)
        if not self.models:
            raise InvalidValueError("models", "hold at least one", "none")
        precision = arrays.precision_of(dtype)
        self.worlds = validation.count("worlds", worlds, at_most=2**31 - 1)
        self.device = wp.get_device(device)
        self.dtype = dtype
        known = list({id(model): model for model in self.models}.values())
        which = [
            next(i for i, each in enumerate(known) if each is model)
            for model in self.models
        ]
        if follows is not None and len(follows) != len(which):
            raise InvalidValueError(
                "follows", f"hold one for each of {len(which)} models", len(follows)
            )
        pieces = [pieces_of(model, precision) for model in known]
        follows = follows or [True] * len(which)
        radii = [lever_of(model) or 1.0 for model in self.models]
        source = coupled_source_of(pieces, which, follows, radii, precision)
        self.state_shape = (sum(math.prod(model.state_shape) for model in self.models),)
        """Shape of the state of the patches of a world."""
        self.names = tuple((*pieces[kind].parameters, "scale") for kind in which)
        """Parameters of each patch, in the order of the columns of `parameters`, one patch after the other."""
        defaults = [{**pieces[kind].parameters, "scale": 1.0} for kind in which]
        self.parameters = wp.array(
            self._rows(defaults, parameters or {}), dtype=dtype, device=self.device
        )
        """Parameters [worlds or 1, names]; a program may write new ones between steps."""
        self.status = wp.zeros(self.worlds, dtype=wp.int32, device=self.device)
        """Bits of what was wrong since the last `check` [worlds]: 1 in parameters, 2 in what a step was given."""
        self._numbers = wp.array(source.numbers, dtype=dtype, device=self.device)
        self.kernel = kernel_of(source.text, Problems)
        """Kernel of `step`."""
        wp.load_module(self.kernel.module, device=self.device)

    def rest(self) -> wp.array[Any]:
        """Return the state [worlds, states] of patches without memory."""
        return self._zeros(*self.state_shape)

    def results(self) -> Any:
        """Return a `CoupledStep` of Warp's arrays, which `step` can write."""
        k = len(self.models)
        rounds, converged = (
            wp.zeros(self.worlds, dtype=wp.int32, device=self.device) for _ in range(2)
        )
        own: list[Any] = [
            self.rest(),
            *(self._zeros(*shape) for shape in ((k, 3), (k, 3), (k,))),
        ]
        return CoupledStep(*own, rounds, self._zeros(), converged)  # pyright: ignore

    def step(
        self,
        state: wp.array[Any],
        host: HostStep,
        dt: float,
        results: CoupledStep,
        *,
        tolerance: float = coupling.TOLERANCE,
        iterations: int | None = None,
        skip: wp.array[Any] | None = None,
    ) -> None:
        """Solve the steps of all worlds, in one kernel without allocation or synchronisation.

        `state` is [worlds, states], the arrays of `host` have `worlds` as their leading axis, and `results` are written
        (see `results`); its state is another array. Rounding stops a step in single precision at 1e-5 of the speed
        that goes into its twists, if that is more than the `tolerance` [m/s]. A world with numbers that are not finite
        or out of range keeps its state, has no wrenches and -1 `iterations` (see `check`).

        Worlds whose `skip` is not 0 are left out.

        Raises InvalidValueError for arrays of another shape, precision or device, and a step or a tolerance out of
        range.
        """
        if results.state is state:
            raise InvalidValueError(
                "results.state", "be another array than state", "the same"
            )
        k = len(self.models)
        one = Problems()
        one.rows = self.parameters.shape[0]
        one.dt = validation.non_negative("dt", dt)
        one.tolerance = validation.positive("tolerance", tolerance)
        one.iterations = (
            coupling.ITERATIONS
            if iterations is None
            else validation.count("iterations", iterations, 0)
        )
        one.again = int(iterations is None)
        one.state = self._address("state", state, *self.state_shape)
        one.twist = self._address("twist", host.twist, k, 3)
        one.normal_force = self._address("normal_force", host.normal_force, k)
        one.wrench = self._address("wrench", host.wrench, k, 3)
        one.twist_response = self._address(
            "twist_response", host.twist_response, 3 * k, 3 * k
        )
        if host.load_response is not None:
            one.load_response = self._address(
                "load_response", host.load_response, k, 3 * k
            )
        if host.moments is not None:
            one.moments = self._address("moments", host.moments, k, 2)
        if skip is not None:
            one.skip = self._address("skip", skip, dtype=wp.int32)
        one.new_state = self._address("results.state", results.state, *self.state_shape)
        one.new_wrench = self._address("results.wrench", results.wrench, k, 3)
        one.new_twist = self._address("results.twist", results.twist, k, 3)
        one.new_load = self._address("results.normal_force", results.normal_force, k)
        one.residual = self._address("results.residual", results.residual)
        one.rounds = self._address(
            "results.iterations", results.iterations, dtype=wp.int32
        )
        one.converged = self._address(
            "results.converged", results.converged, dtype=wp.int32
        )
        one.parameters = self.parameters.ptr
        one.status = self.status.ptr
        one.numbers = self._numbers.ptr
        wp.launch(self.kernel, dim=self.worlds, inputs=[one], device=self.device)

    def check(self) -> None:
        """Wait for the device, and forget what was wrong.

        Raises InvalidValueError if a world had numbers that were not finite or out of range since the last check.
        """
        arrays.check(self.status, WRONG, "worlds")

    def _zeros(self, *shape: int) -> wp.array[Any]:
        return wp.zeros((self.worlds, *shape), dtype=self.dtype, device=self.device)

    def _address(self, name: str, given: Any, *shape: int, dtype: Any = None) -> int:
        return arrays.address(
            name, given, (self.worlds, *shape), dtype or self.dtype, self.device
        )

    def _rows(
        self, defaults: Sequence[Mapping[str, float]], given: Mapping[str, Any]
    ) -> np.ndarray:
        """Return the parameters of all patches, side by side."""
        validation.keys("parameters", dict(given), (), set().union(*defaults))
        values = {name: np.asarray(value) for name, value in given.items()}
        each = [
            {
                name: value[:, p]
                if value.shape == (self.worlds, len(defaults))
                else value
                for name, value in values.items()
                if name in own
            }
            for p, own in enumerate(defaults)
        ]
        rows = [
            arrays.parameter_rows(own, mine, self.worlds)
            for own, mine in zip(defaults, each, strict=True)
        ]
        count = max(map(len, rows))
        return np.concatenate(
            [np.broadcast_to(row, (count, row.shape[1])) for row in rows], axis=1
        )
