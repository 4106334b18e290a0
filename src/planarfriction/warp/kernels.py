"""Kernels that step contacts: one thread a contact, or a world."""

# No `from __future__ import annotations` here: Warp reads the types themselves.

import functools
from typing import Any

import warp as wp


@wp.struct
class Batch:
    """Sizes and addresses of what a kernel reads and writes; arrays are contiguous, of the precision of the kernel."""

    contacts: wp.int32
    steps: wp.int32
    rows: wp.int32
    """Rows of `parameters`: 1, or one a contact."""
    dt: wp.float64
    parameters: wp.uint64
    models: wp.int32
    which: wp.uint64
    """Models, and the index of that of each contact."""
    number_count: wp.int32
    """Numbers that belong to each model in `numbers`."""
    numbers: wp.uint64
    state: wp.uint64
    twist: wp.uint64
    normal_force: wp.uint64
    moments: wp.uint64
    """0, or the address of the moments of normal forces."""
    new_state: wp.uint64
    wrench: wp.uint64
    status: wp.uint64


@wp.struct
class Problems:
    """Addresses of the problems of all worlds, as `Batch`; those of `HostStep`, `CoupledStep` and their state."""

    rows: wp.int32
    iterations: wp.int32
    again: wp.int32
    dt: wp.float64
    tolerance: wp.float64
    parameters: wp.uint64
    numbers: wp.uint64
    state: wp.uint64
    twist: wp.uint64
    normal_force: wp.uint64
    wrench: wp.uint64
    twist_response: wp.uint64
    load_response: wp.uint64
    moments: wp.uint64
    new_state: wp.uint64
    new_wrench: wp.uint64
    new_twist: wp.uint64
    new_load: wp.uint64
    rounds: wp.uint64
    residual: wp.uint64
    converged: wp.uint64
    status: wp.uint64
    skip: wp.uint64
    """0, or the address of numbers that are not 0 for worlds to leave out."""


@functools.lru_cache
def kernel_of(source: str, struct: Any) -> Any:
    """Return the kernel of native source with one thread for each contact of a `Batch`, or world of `Problems`."""

    @wp.func_native(source)
    def advance(thread: wp.int32, batch: struct): ...  # pyright: ignore[reportGeneralTypeIssues, reportInvalidTypeForm]

    @wp.kernel(enable_backward=False, module="unique")
    def friction_step(batch: struct):  # pyright: ignore[reportGeneralTypeIssues, reportInvalidTypeForm]
        advance(wp.tid(), batch)

    return friction_step
