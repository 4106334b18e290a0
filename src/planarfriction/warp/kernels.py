"""Kernels that step contacts: one thread a contact."""

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
    numbers: wp.uint64
    places: wp.uint64
    state: wp.uint64
    twist: wp.uint64
    normal_force: wp.uint64
    new_state: wp.uint64
    wrench: wp.uint64
    status: wp.uint64


@functools.lru_cache
def kernel_of(source: str) -> Any:
    """Return the kernel of native source (see `source_of`)."""

    @wp.func_native(source)
    def advance(contact: wp.int32, batch: Batch): ...  # pyright: ignore[reportGeneralTypeIssues]

    @wp.kernel(enable_backward=False, module="unique")
    def friction_step(batch: Batch):  # pyright: ignore[reportGeneralTypeIssues]
        advance(wp.tid(), batch)

    return friction_step
