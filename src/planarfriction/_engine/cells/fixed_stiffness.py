"""Steps of cells whose stiffness does not grow with the load (see `bristle_limit`)."""

from __future__ import annotations

from planarfriction._engine.bristles.bristle_step import ROUNDING
from planarfriction._engine.cells.cells import CellsContact, read
from planarfriction._engine.codegen.vectors import Vector, copy, norm, plus, square
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.calls import call
from planarfriction._engine.compiler.memory import Doubles, Place, at, exists


@kernel
def _middle(contact: CellsContact, factor: float, i: int) -> Vector:
    """Return the middle of the limit of bristle i: not zero where friction differs forwards and backwards."""
    n = contact.count
    lean = contact.lean
    x = 0.0
    y = 0.0
    if exists(lean):
        largest = contact.law.mu_s / (factor * contact.law.sigma_0)
        x = largest * lean[i]
        y = largest * lean[n + i]
    return x, y, 0.0


@kernel
def bring_back(contact: CellsContact, size: int, z: Doubles, factor: float) -> None:
    """Bring bristles of so many components back onto their limits at a load, and leave others as they are."""
    n = contact.count
    for i in range(n):
        beyond = _beyond(contact, size, z, factor, i)
        middle = _middle(contact, factor, i)
        if beyond > ROUNDING:
            for m in range(size):
                z[m * n + i] = middle[m] + (z[m * n + i] - middle[m]) / beyond


@kernel
def _out(contact: CellsContact, size: int, z: Doubles, factor: float, i: int) -> Vector:
    """Return bristle i as seen from the middle of its limit."""
    n = contact.count
    return plus(
        (z[i], z[n + i], z[2 * n + i] if size == 3 else 0.0),
        -1.0,
        _middle(contact, factor, i),
    )


@kernel
def _beyond(
    contact: CellsContact, size: int, z: Doubles, factor: float, i: int
) -> float:
    """Return the deflection of bristle i over its limit."""
    return (
        factor
        * norm(_out(contact, size, z, factor, i))
        * contact.law.sigma_0
        / contact.law.mu_s
    )


@kernel
def stepped(
    function: Place, record: Place, size: int, states: int, factor: float, z: Doubles, twist: Doubles, dt: float,
    new: Doubles, out: Doubles,
) -> None:  # fmt: skip
    """Call one of the `protocol.StepFunctions` for bristles with a fixed stiffness; `out` follows the published law.

    Slopes by the state and of the new state are to be multiplied: see `unscale`.
    """
    copy(z, new, states)
    bring_back(read(record), size, new, factor)
    for i in range(states):
        new[i] = factor * new[i]
    call(function, (record, new, twist, factor * dt, new, out))
    for i in range(states):
        new[i] = new[i] / factor


@kernel
def unscale(
    record: Place,
    size: int,
    z: Doubles,
    factor: float,
    by_twist: Doubles,
    of_wrench: Doubles,
    by_state: Doubles,
) -> None:
    """Turn derivatives of a published step into derivatives of `stepped`, in place.

    New state by twist [size n, 3], wrench by state [3, size, n], new state by state [size, size, n].
    """
    contact = read(record)
    n = contact.count
    for m in range(3 * size * n):
        by_twist[m] = by_twist[m] / factor
        of_wrench[m] = of_wrench[m] * factor
    for i in range(n):
        beyond = _beyond(contact, size, z, factor, i)
        out = _out(contact, size, z, factor, i)
        if beyond > ROUNDING:
            _turn_rows(out, size, n, i, beyond, 3, of_wrench)
            _turn_rows(out, size, n, i, beyond, size, by_state)


@kernel
def _turn_rows(
    out: Vector, size: int, n: int, i: int, beyond: float, rows: int, by_state: Doubles
) -> None:
    """Multiply rows of derivatives by a bristle with its derivatives by the bristle before it was brought back."""
    for k in range(rows):
        row = at(by_state, k * size * n)
        along = 0.0
        for m in range(size):
            along += row[m * n + i] * out[m]
        for m in range(size):
            row[m * n + i] = (row[m * n + i] - along * out[m] / square(out)) / beyond
