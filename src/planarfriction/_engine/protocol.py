"""Compiled functions of one contact, which the solver and steps call by address: all that they ask of a model."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.codegen.definitions import bind
from planarfriction._engine.compiler import entry
from planarfriction._engine.compiler.calls import address_of
from planarfriction._engine.compiler.memory import (
    Doubles,
    Layout,
    offsets_of,
    reader,
    row_of,
)


class ChangeRows(NamedTuple):
    """Twist and wrench of a contact and their changes, [3] each."""

    twist: Doubles
    wrench: Doubles
    d_twist: Doubles
    d_wrench: Doubles


ROWS = Layout(ChangeRows, twist=3, wrench=3, d_twist=3, d_wrench=3).offsets
"""Rows [4, 3] as `ModelFunctions` take them (see `memory.arrays_at`)."""


class Seen(NamedTuple):
    """Twist of a contact, and what else its rates and a contact with an edge (see `cells.edge_cells`) see."""

    twist: Doubles
    """[3]"""
    load: Doubles
    """Load [N], [1]."""
    place: Doubles
    """Place of the body in the contact frame [m], and its angle in the world, [3]."""
    axes: Doubles
    """Cosine and sine of the angle of the contact frame in the world, [2]."""
    covered: Doubles
    """Share of the load of whole cells that lies on the body, to be written where there is an edge; else 1, [1]."""


_SEEN = Layout(Seen, twist=3, load=1, place=3, axes=2, covered=1)


SEEN = _SEEN.offsets
"""Places of `Seen` (see `memory.arrays_at`)."""

SEEN_SIZE = _SEEN.size
"""Size of `Seen` in words."""


class ModelFunctions(NamedTuple):
    """Compiled functions of a kind of model, for the bristles z of one contact, per unit normal load.

    Their first argument is the address of the contact's record, the others are pointers to doubles but for `shift`
    and the two changes. With `z' = f(z, V)`, `D = shift I - df/dz` and the wrench `W(z, V)`:
    """

    evaluate: Any
    """`(contact, z, V, z', W)`: write z' and W; behind V is what `Seen` holds."""
    linearise: Any
    """`(contact, z, V, z', W, lin)`: evaluate, and write the derivatives of f into the workspace `lin`; V as above."""
    factor: Any
    """`(contact, z, shift, lin, S)`: prepare D in `lin`, write S [3, 3] = dW/dV with z eliminated.

    With an edge, dW/dq by the place q of `Seen` is behind it, [3, 3]; there are zeros else."""
    eliminate: Any
    """`(contact, z, shift, r, lin, W)`: write the wrench that the residual r of z' causes."""
    back_substitute: Any
    """`(contact, z, r, dV, lin, out)`: solve `D out = r + df/dV dV`; behind dV is the change of the place, [3]."""
    change: Any = None
    """`(contact, z, z', lin, dz, dz', rows, friction, size)`: write the changes of z' and of the wrench.

    `rows` are `ChangeRows` that hold V, W, dV and take dW. The changes come from `dz`, `dV` and from relative changes
    of all coefficients of friction and of the size of the patch. None: the model takes no part in derivatives of
    scenes."""
    solve_transposed: Any = None
    """`(contact, z, r, lin, out)`: solve `D' out = r` with the D that `factor` prepared."""
    pull_back: Any = None
    """`(contact, z, lin, l, rows, out)`: the transpose of `change`, at held coefficients.

    From `l` of z' and the wrench's `rows.d_wrench` write `(df/dz)' l + (dW/dz)' d_wrench` to `out` and the same by V to
    `rows.d_twist`."""


Addresses = offsets_of(ModelFunctions)
"""Record of the addresses of `ModelFunctions`; 0 of those that are not wanted."""


addresses_at = reader(Addresses)


CALLS = len(Addresses._fields)

ARGUMENTS = ModelFunctions(
    evaluate=5,
    linearise=6,
    factor=5,
    eliminate=6,
    back_substitute=6,
    change=9,
    solve_transposed=5,
    pull_back=6,
)
"""Numbers of arguments, which compiled callers cannot check."""


def functions_of(name: str, templates: tuple, **model: Any) -> ModelFunctions:
    """Return the functions of a model, entry points `<name>_<template>`: templates that are bound to its argument."""
    return ModelFunctions(
        *(bind(each, f"{name}_{each.__name__}", entry, **model) for each in templates)
    )


def calls_of(functions: ModelFunctions, *, change: bool = False) -> np.ndarray:
    """Return the words of `Addresses` of compiled functions of a model, those from `change` on if asked for."""
    wanted = functions[: None if change else ModelFunctions._fields.index("change")]
    return row_of(
        Addresses(
            *(address_of(each) if each else 0 for each in wanted),
            *[0] * (CALLS - len(wanted)),
        )
    )


SLOPES = 12
"""Numbers that `StepFunctions.slopes` writes."""


class StepFunctions(NamedTuple):
    """Compiled steps of a contact with S states.

    Their arguments are `(contact, z, V, dt, new, out)`: the address of the contact's record (with which the solver
    calls its `protocol.ModelFunctions`), a number `dt`, and pointers to doubles; behind V is the load. They write the
    new state to `new` and to `out`, per unit load, the wrench W at the end of the step [3] and derivatives.
    """

    step: Any
    slopes: Any
    """dW/dV [3, 3] as well."""
    jacobian: Any
    """dW/dV, d new/dV [S, 3], dW/dz [3, S] and d new/dz as well; of a pad, d new/dN [S] and dW/dN [3] by the load."""


def step_functions(name: str, templates: tuple, **model: Any) -> StepFunctions:
    """Return the steps of a model, entry points `<name>_step`, ...: templates that are bound to its arguments.

    Slopes and Jacobian are one template, whose argument `whole` tells them apart.
    """
    step, slopes = templates
    return StepFunctions(
        bind(step, f"{name}_step", entry, **model),
        bind(slopes, f"{name}_slopes", entry, **model, whole=False),
        bind(slopes, f"{name}_jacobian", entry, **model, whole=True),
    )
