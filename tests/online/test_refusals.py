"""What the observer and controllers refuse."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.online import (
    FrictionObserver,
    Hinge,
    Hold,
    Measurement,
    Sensors,
    SlideBy,
    TurnBy,
)
from tests.support.refusals import refusal

PATCH = pf.ContactPatch.disc(0.01, cells=7)
LAW = pf.LuGre(mu_c=0.5, mu_s=0.6, elasto_plastic=0.9)
MODEL = pf.ReducedModel(PATCH, LAW)
LEANING = pf.ReducedModel(PATCH.with_friction_metric(None, (0.1, 0.0)), LAW)


def observer(**options):
    return FrictionObserver(MODEL, **options)


def estimate():
    return observer().update(Measurement(0.0, np.zeros(3), 1.0))


REFUSED = [
    (
        lambda: FrictionObserver(PATCH),
        "model must be a friction model, such as ReducedModel, got ContactPatch('disc', 45 cells",
    ),
    (
        lambda: FrictionObserver(LEANING),
        "model must have symmetric friction, got a patch with an asymmetry",
    ),
    (lambda: observer(tolerance=0.0), "tolerance must be > 0, got 0.0"),
    (
        lambda: observer(sensors=Sensors),
        "sensors must be Sensors, got <class 'planarfriction.online.observer.Sensors'>",
    ),
    (
        lambda: observer(batch=2).update(Measurement(0.0, np.zeros((3, 3)), 1.0)),
        "measurement must hold numbers of the batch [2], got Measurement(time=0.0, wrench=array",
    ),
    (lambda: Sensors(quantum=0.0), "quantum must be > 0, got 0.0"),
    (lambda: estimate().interval(1.0), "probability must be between 0 and 1, got 1.0"),
    (lambda: Hold(None), "observer must be a FrictionObserver, got None"),
    (
        lambda: Hold(observer(), probability=0.7),
        "probability must be between 0 and 0.5, got 0.7",
    ),
    (lambda: SlideBy(observer(), 0.0), "goal must be finite and not zero, got 0.0"),
    (lambda: TurnBy(observer(), []), "goal must have shape [], got shape [0]"),
    (lambda: TurnBy(observer(), 1.0, duration=-1.0), "duration must be > 0, got -1.0"),
    (
        lambda: Hinge(observer()).update(5.0),
        "measurement must be a Measurement, got 5.0",
    ),
    (lambda: Hinge(observer(), reserve=0.0), "reserve must be > 0, got 0.0"),
    *(
        (
            lambda kind=kind, goal=goal: kind(
                observer(sensors=Sensors(slip_rate=0.0)), *goal
            ),
            words,
        )
        for kind, goal, words in (
            (
                SlideBy,
                [0.1],
                "observer must have a slip sensor to let parts slip, got Sensors(force_noise=0.02,",
            ),
            (
                TurnBy,
                [0.1],
                "observer must have a slip sensor to let parts slip, got Sensors(force_noise=0.02,",
            ),
            (
                Hinge,
                [],
                "observer must have a slip sensor to let parts slip, got Sensors(force_noise=0.02,",
            ),
        )
    ),
]
"""Calls, and words of the line that each raises."""


@pytest.mark.parametrize(("call", "words"), REFUSED)
def test_a_mistake_is_refused_in_words(call, words):
    assert words in refusal(call)
