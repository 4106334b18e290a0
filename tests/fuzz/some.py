"""Random parts that are legal, over many decades: laws, patches, models, twists, scenes."""

from __future__ import annotations

import functools
import math
import random
from collections.abc import Callable

import numpy as np

import planarfriction as pf

MODELS: dict[str, Callable[..., pf.models.FrictionModel]] = {
    "distributed": pf.DistributedModel,
    "reduced": functools.partial(pf.ReducedModel, cells=8),
    "published": pf.ReducedModelPublished,
}
"""Models by name; the maps of the second are small, for the sake of time."""


def spread(draw: random.Random, low: float, high: float) -> float:
    """A number whose logarithm is spread evenly: from 10^low to 10^high."""
    return 10.0 ** draw.uniform(low, high)


def law(draw: random.Random) -> pf.laws.FrictionLaw:
    """Any law of bristles."""
    mu_c = spread(draw, -4, 2)
    kind = draw.randrange(4)
    if kind == 0:
        return pf.Dahl(mu_c, spread(draw, 0, 9))
    if kind == 1:
        mu_s = mu_c * (1.0 + spread(draw, -4, 1))
        v_s = spread(draw, -7, 1)
        gamma = draw.uniform(0.3, 4.0)
        return pf.CoulombStribeck(
            mu_c, mu_s, v_s, gamma, creep_speed=spread(draw, -8, -3)
        )
    return pf.LuGre(
        mu_c,
        mu_c * draw.choice([1.0, 1.0 + spread(draw, -4, 1)]),
        v_s=spread(draw, -7, 1),
        sigma_0=spread(draw, 0, 9),
        sigma_1=draw.choice([0.0, spread(draw, -3, 6)]),
        sigma_2=draw.choice([0.0, spread(draw, -4, 3)]),
        gamma=draw.uniform(0.3, 4.0),
        elasto_plastic=draw.choice([None, 0.9, draw.uniform(0.01, 0.99)]),
    )


def patch(draw: random.Random, *, follows_load: bool = False) -> pf.ContactPatch:
    """Any patch of a few cells; with `follows_load` one whose pressure changes with the load."""
    size = spread(draw, -4, -1)
    if follows_load:
        finger = pf.SoftFinger(
            c=0.3 * size, n=draw.uniform(0.0, 0.5), k=draw.uniform(1.5, 4.0)
        )
        return pf.ContactPatch.disc(size, draw.randint(4, 9), pressure=finger)
    kind = draw.randrange(6)
    if kind == 0:
        return pf.ContactPatch.disc(size, draw.randint(2, 7))
    if kind == 1:
        cells = draw.randint(1, 5), draw.randint(2, 5)
        return pf.ContactPatch.rectangle(size, size * spread(draw, -2, 2), cells=cells)
    if kind == 2:
        return pf.ContactPatch.line(
            size, draw.randint(2, 9), direction=draw.choice("xy")
        )
    if kind == 3:
        count = draw.randint(2, 6)
        positions = [
            (size * draw.uniform(-1, 1), size * draw.uniform(-1, 1))
            for _ in range(count)
        ]
        return pf.ContactPatch.points(
            positions, [spread(draw, -2, 0) for _ in range(count)]
        )
    if kind == 4:
        gradient = (draw.uniform(-0.9, 0.9) / size, 0.0)
        return pf.ContactPatch.rectangle(
            size, cells=5, pressure=pf.LinearGradient(gradient)
        )
    values = np.array(
        [[draw.choice([0.0, spread(draw, -2, 2)]) for _ in range(4)] for _ in range(4)]
    )
    values[0, 0] = values[-1, -1] = 1.0
    return pf.ContactPatch.from_pressure(values, size / 4)


def twist(draw: random.Random, size: float) -> np.ndarray:
    """Speeds of all decades, and now and then none along an axis."""
    speed = spread(draw, -12, 2) if draw.random() < 0.9 else spread(draw, -300, -12)
    direction = np.array([draw.gauss(0, 1), draw.gauss(0, 1), draw.gauss(0, 1) / size])
    direction *= [draw.random() > 0.2, draw.random() > 0.2, draw.random() > 0.3]
    return speed * direction


def signal(
    draw: random.Random, t_end: float, sample: Callable[[], object]
) -> pf.Signal:
    """A constant, or samples that are held or joined."""
    if draw.random() < 0.4:
        return pf.Signal.constant(sample())
    count = draw.randint(1, 6)
    times = np.sort([draw.uniform(0.0, 1.2 * t_end) for _ in range(count)])
    return pf.Signal.sampled(
        times, [sample() for _ in range(count)], draw.choice(["previous", "linear"])
    )


def model(draw: random.Random) -> pf.models.FrictionModel:
    """Any model; of a patch that follows the load only the ones that need no maps for it."""
    follows = draw.random() < 0.2
    make = MODELS[
        draw.choice(["distributed", "published"] if follows else list(MODELS))
    ]
    return make(patch(draw, follows_load=follows), law(draw))


def scene(draw: random.Random) -> pf.Scene:
    """Any scene of one to three contacts, for a short time."""
    t_end = spread(draw, -3, -1)
    mass = spread(draw, -2, 2)

    def load() -> float:
        return draw.choice([0.0, mass * spread(draw, 0, 2), mass * spread(draw, 0, 2)])

    def contact(number: int) -> pf.Contact:
        options = {
            "mounted_on": draw.choice(["world", "body"]),
            "angle": draw.uniform(-math.pi, math.pi),
        }
        options |= {
            "position": (draw.uniform(-0.1, 0.1), draw.uniform(-0.1, 0.1)),
            "count": draw.randint(1, 3),
        }
        if velocity is None and draw.random() < 0.2:
            options["support_velocity"] = signal(
                draw, t_end, lambda: [draw.uniform(-1, 1), 0.0, draw.uniform(-10, 10)]
            )
        made = model(draw)
        name = f"{draw.choice('aφ')} {number}"
        if count == 1 and isinstance(made.reduction, pf.DistributedModel):
            options |= {
                "mounted_on": "body",
                "pressure": "follows",
                "height": draw.choice([0.0, spread(draw, -3, 0)]),
            }
        return pf.Contact(made, signal(draw, t_end, load), name=name, **options)

    velocity = None
    force = None
    if draw.random() < 0.3:
        velocity = signal(
            draw,
            t_end,
            lambda: [draw.uniform(-1, 1), draw.uniform(-1, 1), draw.uniform(-10, 10)],
        )
    elif draw.random() < 0.5:
        force = signal(
            draw,
            t_end,
            lambda: [mass * draw.uniform(-20, 20), 0.0, mass * draw.uniform(-0.1, 0.1)],
        )
    body = pf.Body(
        mass,
        mass * spread(draw, -5, -1),
        angle=draw.uniform(-10.0, 10.0),
        velocity=(draw.uniform(-1, 1), draw.uniform(-1, 1), draw.uniform(-20, 20)),
        gravity=draw.choice([(0.0, 0.0), (0.0, -9.81)]),
    )
    stop = draw.choice([None, 1e-4]) if velocity is None else None
    count = draw.choice([1, 1, 1, 2, 3])
    contacts = [contact(number) for number in range(count)]
    return pf.Scene(body, contacts, t_end, force, velocity, stop, save_every=t_end / 4)
