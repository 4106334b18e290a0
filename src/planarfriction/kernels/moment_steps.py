"""The step of a contact of three states and its derivatives, for all models (see `steps.StepFunctions`)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction.compiler.memory import Doubles, Place, at
from planarfriction.kernels.vectors import plus, put, three, times


class Contact(NamedTuple):
    """A contact as the functions of a model see it."""

    law: tuple
    shape: tuple
    surface: tuple
    """Kind, offset and size of the limit surface: three integers."""
    data: np.ndarray
    """Numbers of the limit surfaces, flat."""


class Cotangents(NamedTuple):
    """Cotangents of all inputs of a step."""

    state: tuple
    twist: tuple
    law: tuple
    shape: tuple


class StepModel(NamedTuple):
    """Functions of a model of three states, for a contact c, a twist V, a state z and a step dt."""

    shape_of: Any
    """`(row)`: return the shape, from the numbers behind the law."""
    hold: Any
    """`(c, V)`: return the numbers of a step that do not depend on z."""
    hold_slopes: Any
    """`(c, V, work)`: return these numbers, and slopes of the sliding; `work` [9] is scratch."""
    taped_step: Any
    """`(c, drive, z, dt)`: return the step, with `new` state and `wrench` per unit load."""
    pull_back: Any
    """`(c, step, slopes, new, wrench)`: return `Cotangents` from the cotangents of the new state and of the wrench."""


class Framed(NamedTuple):
    """Functions that read the record of a contact that steps in other axes: `V' = T V` goes in, `T' W'` comes out."""

    read: Any
    """`(contact)`: return the record, and the `Contact` that steps."""
    seen: Any
    """`(record, V)`: return `T V`."""
    wrench: Any
    """`(record, W)`: return `T' W`."""
    spins: Any
    """`(record)`: return 1; 0 of a point, whose third state has no effect and keeps its value."""


def step(
    contact: Place, z: Doubles, v: Doubles, dt: float, new: Doubles, out: Doubles, *, frame: Framed, hold: Any,
    taped_step: Any,
) -> None:  # fmt: skip
    """Step a contact (see `steps.StepFunctions`)."""
    (record, framed), z = frame.read(contact), three(z)
    spins = frame.spins(record)
    done = taped_step(framed, hold(framed, frame.seen(record, three(v))), (z[0], z[1], spins * z[2]), dt)
    put(new, (done.new[0], done.new[1], spins * done.new[2] + (1.0 - spins) * z[2]))
    put(out, frame.wrench(record, done.wrench))


def slopes(
    contact: Place, z: Doubles, v: Doubles, dt: float, new: Doubles, out: Doubles, *, frame: Framed, hold_slopes: Any,
    taped_step: Any, pull_back: Any, whole: bool,
) -> None:  # fmt: skip
    """Step a contact with the slopes of the wrench, or with all derivatives, the rows of the wrench first."""
    (record, framed), z = frame.read(contact), three(z)
    spins = frame.spins(record)
    drive, known = hold_slopes(framed, frame.seen(record, three(v)), out)
    done = taped_step(framed, drive, (z[0], z[1], spins * z[2]), dt)
    put(new, (done.new[0], done.new[1], spins * done.new[2] + (1.0 - spins) * z[2]))
    put(out, frame.wrench(record, done.wrench))
    for i in range(6 if whole else 3):
        unit = (1.0 if i % 3 == 0 else 0.0), (1.0 if i % 3 == 1 else 0.0), (1.0 if i % 3 == 2 else 0.0)
        of_wrench, (x, y, s) = times(0.0 if i > 2 else 1.0, unit), times(1.0 if i > 2 else 0.0, unit)
        bar = pull_back(framed, done, known, (x, y, spins * s), frame.seen(record, of_wrench))
        put(at(out, 3 + 3 * i), frame.wrench(record, bar.twist))
        if whole:
            x, y, s = plus((bar.state[0], bar.state[1], spins * bar.state[2]), (1.0 - spins) * s, (0.0, 0.0, 1.0))
            put(at(out, 21 + 3 * i), (x, y, s))


TEMPLATES = step, slopes
