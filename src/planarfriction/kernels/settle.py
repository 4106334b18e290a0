"""States of bristles whose stiffness does not grow with the load, and their steps (see `cell_steps`).

With the stiffness `K = sigma_0 f_ref` [N/m] a patch under the load f is the published one with `sigma_0 l`, `l =
f_ref/f`, in place of `sigma_0`. Rates and tractions per unit load then follow the published law at l times the
deflection, and a step of dt from z is 1/l of a step of `l dt` from `l z`.

At rest a published bristle is never bent further than `mu_s/sigma_0`, seen from `a mu_s/sigma_0` where friction differs
forwards and backwards (see `leaning_cells`). One that a falling load has left beyond is brought back onto that limit,
by steps as they begin (`stepped`), by the solver within a short time (`recovery`).
"""

from __future__ import annotations

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.compiler.calls import call
from planarfriction.compiler.memory import Doubles, Place, at, exists
from planarfriction.formulas import LawNumbers
from planarfriction.kernels.bristle_step import ROUNDING, cap
from planarfriction.kernels.cells import CellsContact, read
from planarfriction.kernels.vectors import Vector, copy, norm, plus, square, times

RECOVERY = 1.0
"""Speed [m/s]: a bristle far beyond its limit returns to it as fast as it would forget while sliding at this speed."""


@kernel
def factor_at(reference: float, load: float) -> float:
    """Return l; 1 of a published law, whose `reference` is 0."""
    fixed = reference > 0.0
    return xp.where(fixed, reference, 1.0) / xp.where(fixed, xp.maximum(load, formulas.LIGHTEST * reference), 1.0)


@kernel
def stiffened(law: LawNumbers, reference: float, load: float) -> LawNumbers:
    """Return a law with the stiffness that it has at a load, per unit load."""
    return LawNumbers(law.sigma_0 * factor_at(reference, load), *law[1:])


@kernel
def softening(law: LawNumbers, reference: float, load: float) -> float:
    """Return the derivative by the load of the `sigma_0` of a `stiffened` law; 0 of a published one, and at no load."""
    moves = load > formulas.LIGHTEST * reference and reference > 0.0
    return xp.where(moves, -law.sigma_0, 0.0) / xp.where(moves, load, 1.0)


@kernel
def within(law: LawNumbers, z: Vector) -> Vector:
    """Return a bristle brought back onto its limit, if it is beyond."""
    return times(cap(norm(z) * law.sigma_0 / law.mu_s, 1.0), z)


@kernel
def recovery(law: LawNumbers, z: Vector, speed: float) -> float:
    """Return the decay [1/s] of a bristle beyond its limit; 0 of others, and of a bristle that slides back as fast."""
    per_limit = law.sigma_0 / law.mu_s
    beyond = 1.0 - 1.0 / xp.maximum(norm(z) * per_limit, 1.0)
    return per_limit * xp.maximum(RECOVERY * beyond - speed, 0.0)


@kernel
def _middle(contact: CellsContact, factor: float, i: int) -> Vector:
    """Return the middle of the limit of bristle i: not zero where friction differs forwards and backwards."""
    n, lean, x, y = contact.count, contact.lean, 0.0, 0.0
    if exists(lean):
        largest = contact.law.mu_s / (factor * contact.law.sigma_0)
        x, y = largest * lean[i], largest * lean[n + i]
    return x, y, 0.0


@kernel
def bring_back(contact: CellsContact, size: int, z: Doubles, factor: float) -> None:
    """Bring bristles of so many components back onto their limits at a load, and leave others as they are."""
    n = contact.count
    for i in range(n):
        beyond, middle = _beyond(contact, size, z, factor, i), _middle(contact, factor, i)
        if beyond > ROUNDING:
            for m in range(size):
                z[m * n + i] = middle[m] + (z[m * n + i] - middle[m]) / beyond


@kernel
def _out(contact: CellsContact, size: int, z: Doubles, factor: float, i: int) -> Vector:
    """Return bristle i as seen from the middle of its limit."""
    n = contact.count
    return plus((z[i], z[n + i], z[2 * n + i] if size == 3 else 0.0), -1.0, _middle(contact, factor, i))


@kernel
def _beyond(contact: CellsContact, size: int, z: Doubles, factor: float, i: int) -> float:
    """Return the deflection of bristle i over its limit."""
    return factor * norm(_out(contact, size, z, factor, i)) * contact.law.sigma_0 / contact.law.mu_s


@kernel
def stepped(
    function: Place, record: Place, size: int, states: int, factor: float, z: Doubles, twist: Doubles, dt: float,
    new: Doubles, out: Doubles,
) -> None:  # fmt: skip
    """Call one of the `steps.StepFunctions` for bristles with a fixed stiffness; `out` follows the published law.

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
    record: Place, size: int, z: Doubles, factor: float, by_twist: Doubles, of_wrench: Doubles, by_state: Doubles
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
        beyond, out = _beyond(contact, size, z, factor, i), _out(contact, size, z, factor, i)
        if beyond > ROUNDING:
            _turn_rows(out, size, n, i, beyond, 3, of_wrench)
            _turn_rows(out, size, n, i, beyond, size, by_state)


@kernel
def _turn_rows(out: Vector, size: int, n: int, i: int, beyond: float, rows: int, by_state: Doubles) -> None:
    """Multiply rows of derivatives by a bristle with its derivatives by the bristle before it was brought back."""
    for k in range(rows):
        row, along = at(by_state, k * size * n), 0.0
        for m in range(size):
            along += row[m * n + i] * out[m]
        for m in range(size):
            row[m * n + i] = (row[m * n + i] - along * out[m] / square(out)) / beyond
