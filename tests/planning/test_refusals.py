"""What plans of grips and pushes refuse."""

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.planning import (
    Pusher,
    Slider,
    dynamic_holding_load,
    holding_load,
    motion_cone,
    plan_grip,
    plan_push,
    push,
)
from tests.support.refusals import refusal

PATCH = pf.ContactPatch.disc(0.01, cells=7)
LAW = pf.LuGre(mu_c=0.5, mu_s=0.6, elasto_plastic=0.9)
MODEL = pf.ReducedModel(PATCH, LAW)
POINT = pf.ContactPatch.points([(0.0, 0.0)])
SURFACE = pf.LimitSurfaceEllipsoid(PATCH)
SQUARE = [(-0.05, -0.05), (0.05, -0.05), (0.05, 0.05), (-0.05, 0.05)]
HALF = np.radians(30.0)
DOWN = (0.0, 1.0, 0.0)


def plate(**changes):
    """Return a scene of a held plate with changes."""
    scene = pf.scenes.in_hand(
        MODEL, centre_of_mass=(0.025, 0.0), normal_force=4.0, t_end=1.0
    )
    return dataclasses.replace(scene, **changes)


def gripped(goal=None, scene=None, **options):
    return plan_grip(
        plate() if scene is None else scene,
        {"angle": -HALF} if goal is None else goal,
        **options,
    )


def pushed(pusher=None, path=None, **options):
    path = path or pf.Signal.sampled([0.0, 1.0], [[-0.06, 0.0], [0.0, 0.0]], "linear")
    return push(Slider(SURFACE, SQUARE), pusher or Pusher(), path, **options)


REFUSED = [
    (
        lambda: gripped({"angle": HALF}, knots=4),
        "angle must be within reach of the load on the body (it gets at most -86.6 % of the",
    ),
    (
        lambda: gripped({"angle": 1.0, "slide": (0, 1)}),
        "goal must be {\"angle\": radians} or {\"slide\": (dx, dy)}, got {'angle': 1.0, 'slide': (0,",
    ),
    (
        lambda: gripped({"turn": 1.0}),
        "goal key must be one of angle, slide, got 'turn'",
    ),
    (lambda: gripped({"angle": 0.0}), "goal must not be zero, got {'angle': 0.0}"),
    (
        lambda: gripped(
            {"angle": -1.0},
            plate(
                start="equilibrium",
                contacts=[dataclasses.replace(plate().contacts[0], normal_force=2.0)],
            ),
        ),
        "start must be 'rest' or 'sliding' if the contacts do not hold the body (they hold 32.9",
    ),
    (
        lambda: gripped(
            scene=dataclasses.replace(
                pf.scenes.free_slide(MODEL), stop_speed=None, start="sliding"
            )
        ),
        "start must be 'rest' or 'equilibrium' for a grip plan, got sliding",
    ),
    *(
        (lambda given=given: gripped(**given), words)
        for given, words in (
            (
                {"bounds": (0.1, 4.0)},
                "bounds must reach the 10.2 N that hold the body at the end, got [0.1, 4.0]",
            ),
            (
                {"bounds": (4.0, 2.0)},
                "bounds must be the least and the largest normal force, got [4.0, 2.0]",
            ),
            (
                {"knots": [0.0, 0.2, 0.1, 0.4]},
                "knots must be 4 to 200 increasing times >= 0, got [0.0, 0.2, 0.1, 0.4]",
            ),
            ({"aim": "best"}, "aim must be one of nominal, worst, got 'best'"),
            ({"friction": -0.1}, "friction must be >= 0, got -0.1"),
            ({"friction": 1.0}, "friction must be below 1, got 1.0"),
            ({"contact": "thumb"}, "contact must be one of fingers, got 'thumb'"),
            (
                {"scene": pf.scenes.driven(MODEL)},
                "velocity must be None for a body that a grip moves, got Signal(501 samples of 3 values,",
            ),
            ({"scene": 3}, "scene must be a Scene, got 3"),
        )
    ),
    (
        lambda: gripped(
            scene=plate(body=dataclasses.replace(plate().body, gravity=(0.0, 0.0)))
        ),
        "scene must have a load that moves the body, got no gravity and no force",
    ),
    (lambda: holding_load(DOWN, PATCH, 0.0), "mu must be > 0, got 0.0"),
    (
        lambda: holding_load(DOWN, PATCH, 1.0, margin=-0.1),
        "margin must be >= 0, got -0.1",
    ),
    (
        lambda: holding_load((0.0, 1.0), PATCH, 1.0),
        "wrench must have shape [3], got shape [2]",
    ),
    (
        lambda: holding_load((0.0, 1.0, 0.1), POINT, 1.0),
        "patch must have a contact radius > 0 (more than one point), got r=0.0",
    ),
    (lambda: holding_load(DOWN, None, 1.0), "patch must be a ContactPatch, got None"),
    (
        lambda: dynamic_holding_load(DOWN, PATCH),
        "model must be a friction model (DistributedModel, ReducedModel, ReducedModelPublished),",
    ),
    (
        lambda: dynamic_holding_load((0.0, 1.0), MODEL),
        "wrench must have shape [3], got shape [2]",
    ),
    (
        lambda: dynamic_holding_load(
            DOWN, pf.DistributedModel(PATCH, pf.CoulombStribeck(mu_c=1.0))
        ),
        "model must have a law that holds at rest, got CoulombStribeck",
    ),
    (
        lambda: dynamic_holding_load((0.0, 1.0, 0.1), pf.DistributedModel(POINT, LAW)),
        "patch must have a contact radius > 0 (more than one point), got r=0.0",
    ),
    *(
        (lambda given=given: dynamic_holding_load(DOWN, MODEL, **given), words)
        for given, words in (
            (
                {"fall": 1.000000000001},
                "fall must be at least 1.001, got 1.000000000001",
            ),
            ({"ramp": -1.0}, "ramp must be >= 0, got -1.0"),
            ({"mass": 0.0}, "mass must be > 0, got 0.0"),
            ({"inertia": -1.0}, "inertia must be > 0, got -1.0"),
            ({"margin": -1.0}, "margin must be >= 0, got -1.0"),
        )
    ),
    (
        lambda: Slider(SURFACE, [[0, 0], [1, 0], [0.2, 0.2], [0, 1]]),
        "outline must be convex, without three corners on a line: use its convex hull, shapely",
    ),
    (
        lambda: Slider(PATCH, SQUARE),
        "surface must be a limit surface, got ContactPatch('disc', 45 cells of 7 x 7, Uniform",
    ),
    (lambda: Slider(SURFACE, SQUARE[:2]), "outline must have at least 3 points, got 2"),
    (lambda: Pusher(-0.1), "mu must be >= 0, got -0.1"),
    (
        lambda: pushed(
            path=pf.Signal.sampled([0.0, 1.0], [[0.0, 0.0], [0.1, 0.0]], "linear")
        ),
        "path must begin outside the slider, got [0.0, 0.0, 0.0]",
    ),
    (
        lambda: pushed(path=pf.Signal.constant([0.0, 0.0])),
        'path must be a Signal of two samples or more with hold="linear", got',
    ),
    (
        lambda: pushed(pusher=Pusher(0.1, 0.02)),
        "path must have 3 columns: be 3 numbers, or a Signal of them, got a Signal of rows of 2",
    ),
    (lambda: pushed(rtol=0.0), "rtol must be > 0, got 0.0"),
    (
        lambda: motion_cone(SURFACE, (0.0, 0.0), (0.0, 0.0), 0.1),
        "length of normal must be > 0, got 0.0",
    ),
    *(
        (
            lambda given=given: plan_push(
                Slider(SURFACE, SQUARE), *given[0], **given[1]
            ),
            words,
        )
        for given, words in (
            (
                ((Pusher(), (0.1, 0.0, 0.0)), {}),
                "pusher must be a point with friction, for a plan, got Pusher(mu=0.0, width=0.0)",
            ),
            (
                ((Pusher(0.3), (0.0, 0.0, 0.0)), {}),
                "goal must differ from the start, got [0.0, 0.0, 0.0]",
            ),
            (
                ((Pusher(0.3), (0.1, 0.0, 0.0)), {"margin": 1.0}),
                "margin must be >= 0 and < 1, got 1.0",
            ),
            (
                ((Pusher(0.3), (0.1, 0.0, 0.0)), {"edges": [4]}),
                "edges must be at most 3, got 4",
            ),
        )
    ),
]
"""Calls, and words of the line that each raises."""


@pytest.mark.parametrize(("call", "words"), REFUSED)
def test_a_mistake_is_refused_in_words(call, words):
    assert words in refusal(call)
