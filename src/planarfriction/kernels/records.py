"""Records of numbers: read by name in Python and in compiled loops, flat in the rows of a table."""

from __future__ import annotations

from typing import Any

from numba.np.unsafe.ndarray import to_fixed_tuple

from planarfriction.kernels import kernel


def reader(record: Any) -> Any:
    """Compile the function that reads the named tuple `record` from the numbers at the beginning of a row."""
    count = len(record._fields)

    @kernel
    def read(row):
        return record(*to_fixed_tuple(row, count))

    return read
