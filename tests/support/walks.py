"""Random steps of many contacts: breakaway, reversal, rest, and loads that vanish."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np


def walk(
    model, contacts: int, rounds: int, kind=np.float64
) -> Iterator[tuple[np.ndarray, ...]]:
    """Yield states, twists and loads, rounded to a precision, and the compiled step's new states and wrenches."""
    rng = np.random.default_rng(0)
    size = model.patch.contact_radius()
    state = np.zeros((contacts, *model.state_shape))
    twist = np.zeros((contacts, 3))
    load = np.ones(contacts)
    for _ in range(rounds):
        choice = rng.random(contacts)[:, None]
        drawn = (
            rng.normal(size=(contacts, 3))
            * [1.0, 1.0, 1.0 / size]
            * 10.0 ** rng.uniform(-6, -1, (contacts, 1))
        )
        twist = np.select(
            [choice < 0.3, choice < 0.5, choice < 0.55],
            [twist, -twist, 0.0 * twist],
            drawn,
        )
        load = np.select(
            [rng.random(contacts) < 0.05],
            [0.0 * load],
            10.0 ** rng.uniform(-2, 2, contacts),
        )
        given = [each.astype(kind).astype(float) for each in (state, twist, load)]
        state, wrench = model.step(*given, 1e-3)
        yield (*given, state, wrench)
