"""The step of a contact of three states and its derivatives, for all models (see `steps.StepFunctions`)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction.compiler.memory import at
from planarfriction.kernels.vectors import plus, put, three, times


class Contact(NamedTuple):
    """A contact as the functions of a model see it."""

    law: tuple
    shape: tuple
    surface: tuple
    """Kind, offset and size of the limit surface: three integers."""
    data: np.ndarray
    """Their numbers, flat."""


class Cotangents(NamedTuple):
    """Cotangents of all inputs of a step."""

    state: tuple
    twist: tuple
    law: tuple
    shape: tuple


class StepModel(NamedTuple):
    """Functions of a model of three states, for a contact c, a twist V, a state z and a step dt."""

    shape_of: Any
    """`(row)`: return the shape, from the numbers behind those of the law."""
    hold: Any
    """`(c, V)`: return what a step holds that does not depend on z."""
    hold_slopes: Any
    """`(c, V, work)`: return that, and its slopes; `work` [9] is scratch."""
    taped_step: Any
    """`(c, held, z, dt)`: return the step, with `new` state and `wrench` per unit load."""
    pull_back: Any
    """`(c, step, slopes, new, wrench)`: return `Cotangents` from those of the new state and of the wrench."""


class Framed(NamedTuple):
    """Functions that read the record of a contact that steps in other axes: `V' = T V` goes in, `T' W'` comes out."""

    read: Any
    """`(contact)`: return the record, and the `Contact` that steps."""
    seen: Any
    """`(own, V)`: return `T V`."""
    wrench: Any
    """`(own, W)`: return `T' W`."""
    spins: Any
    """`(own)`: return 1; 0 of a point, whose third state has no effect and keeps its value."""


def step(contact, z, v, dt, new, out, *, frame, hold, taped_step):
    """Step a contact (see `steps.StepFunctions`)."""
    (own, framed), z = frame.read(contact), three(z)
    spins = frame.spins(own)
    done = taped_step(framed, hold(framed, frame.seen(own, three(v))), (z[0], z[1], spins * z[2]), dt)
    put(new, (done.new[0], done.new[1], spins * done.new[2] + (1.0 - spins) * z[2]))
    put(out, frame.wrench(own, done.wrench))


def slopes(contact, z, v, dt, new, out, *, frame, hold_slopes, taped_step, pull_back, whole):
    """Step a contact with the slopes of the wrench, or with all derivatives, the rows of the wrench first."""
    (own, framed), z = frame.read(contact), three(z)
    spins = frame.spins(own)
    held, known = hold_slopes(framed, frame.seen(own, three(v)), out)
    done = taped_step(framed, held, (z[0], z[1], spins * z[2]), dt)
    put(new, (done.new[0], done.new[1], spins * done.new[2] + (1.0 - spins) * z[2]))
    put(out, frame.wrench(own, done.wrench))
    for i in range(6 if whole else 3):
        unit = (1.0 if i % 3 == 0 else 0.0), (1.0 if i % 3 == 1 else 0.0), (1.0 if i % 3 == 2 else 0.0)
        of_wrench, (x, y, s) = times(0.0 if i > 2 else 1.0, unit), times(1.0 if i > 2 else 0.0, unit)
        bar = pull_back(framed, done, known, (x, y, spins * s), frame.seen(own, of_wrench))
        put(at(out, 3 + 3 * i), frame.wrench(own, bar.twist))
        if whole:
            x, y, s = plus((bar.state[0], bar.state[1], spins * bar.state[2]), (1.0 - spins) * s, (0.0, 0.0, 1.0))
            put(at(out, 21 + 3 * i), (x, y, s))


TEMPLATES = step, slopes
