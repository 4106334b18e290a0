"""What sweeps and changes of scenes refuse."""

import pytest

import planarfriction as pf
from planarfriction import sweeps
from planarfriction.errors import FrictionError
from planarfriction.sweeps.settings import Settable

PATCH = pf.ContactPatch.disc(0.01, cells=7)
LAW = pf.LuGre(mu_c=0.5, mu_s=0.6, elasto_plastic=0.9)
MODEL = pf.ReducedModel(PATCH, LAW)


def plate(t_end=1.0):
    return pf.scenes.in_hand(
        MODEL, centre_of_mass=(0.025, 0.0), normal_force=4.0, t_end=t_end
    )


def swept(make=None, values=None, **options):
    values = {"grip": [1.0, 2.0]} if values is None else values
    return sweeps.sweep(make or (lambda grip: plate(t_end=0.01)), values, **options)


REFUSED = [
    *(
        (lambda values=values: swept(values=values), words)
        for values, words in (
            (
                {},
                "values must be a mapping from names to lists of values, not empty, got {}",
            ),
            (
                {"": [1.0]},
                "name of a swept quantity in values must be a text that is not empty, is printable, and",
            ),
            (
                {"grip": 1.0},
                "grip must be a list of numbers, texts or booleans (for other values: a mapping from",
            ),
            ({"grip": []}, "grip must have at least one value, got none"),
            ({"grip": [1.0, 1.0]}, "grip must have each value once, got 1.0 2 times"),
            (
                {"grip": [1.0, "a"]},
                "grip must be a list of numbers, texts or booleans (for other values: a mapping from",
            ),
            (
                {"grip": [PATCH]},
                "grip must be a list of numbers, texts or booleans (for other values: a mapping from",
            ),
            (
                {"grop": [1.0]},
                "make_scene must take the swept quantities by name (grop), got one for which missing a",
            ),
        )
    ),
    (
        lambda: swept(lambda status: plate(t_end=0.01), {"status": [1.0]}),
        "name of a swept quantity must not be one of status, failure, run, got status",
    ),
    (
        lambda: swept(lambda time: plate(t_end=0.01), {"time": [1.0]}),
        "name of a swept quantity must not be that of a variable or of its axis, got time",
    ),
    (lambda: swept(lambda grip: 1.0), "make_scene must return a Scene, got float"),
    (
        lambda: swept(3),
        "make_scene must be a function that returns a Scene, a Scene, or a path, got 3",
    ),
    (
        lambda: swept(bristles="some"),
        "bristles must be one of none, all, got 'some'",
    ),
    (
        lambda: swept(measure=3),
        "measure must be a function of a Solution, or None, got 3",
    ),
    (
        lambda: swept(measure=lambda run: {"status": 1.0}),
        "measure must not return anything called status, failure, run, got status",
    ),
    (
        lambda: swept(measure=lambda run: {3: 1.0}),
        "all 2 runs failed; the first: grip=1.0: measure: measure must use texts as names of",
    ),
    (
        lambda: swept(values={"grip": range(1, 10**4), "time": range(10**5)}),
        "values must make at most 100000000 runs, got 999900000",
    ),
    (
        lambda: swept(measure=lambda run: object()),
        "all 2 runs failed; the first: grip=",
    ),
    (
        lambda: swept(progress=float),
        "progress must be a function of a Progress, got TypeError: float() argument must be a",
    ),
    (
        lambda: swept(executor=3),
        "executor must be a concurrent.futures.Executor, or None, got 3",
    ),
    (
        lambda: swept(lambda grip: 1 / 0),
        "all 2 runs failed; the first: grip=1.0: make_scene: ZeroDivisionError: division by zero",
    ),
    (
        lambda: swept(out="runs.zarr"),
        "out must be a folder (the dataset becomes a zarr store by its own method:",
    ),
    (
        lambda: swept(out="a\nb"),
        "out must be a path of printable characters, got 'a\\nb'",
    ),
    *(
        (lambda path=path, value=value: Settable(plate())(**{path: value}), words)
        for path, value, words in (
            (
                "body.mas",
                1.0,
                "body.mas must name a value of the scene: body has mass, inertia, position, angle,",
            ),
            (
                "finger.law.mu_c",
                1.0,
                "finger.law.mu_c must name a value of the scene: the scene has name, t_end, save_every,",
            ),
            (
                "fingers.lwa.mu_c",
                1.0,
                "fingers.lwa.mu_c must name a value of the scene: fingers has name, mounted_on,",
            ),
            (
                "fingers.law.mu",
                1.0,
                "fingers.law.mu must name a value of the scene: fingers.law has kind, mu_c, mu_s, v_s,",
            ),
            (
                "fingers.patch.radios",
                1.0,
                "fingers.patch.radios must name a value of the scene: fingers.patch has shape,",
            ),
            (
                "body.position.2",
                1.0,
                "body.position.2 must be an index from 0 to 1 in body.position, got '2'",
            ),
            (
                "body.position.x",
                1.0,
                "body.position.x must be an index from 0 to 1 in body.position, got 'x'",
            ),
            (
                "body.mass.x",
                1.0,
                "body.mass.x must end at body.mass, which is 0.2, got 'x' after it",
            ),
            (
                "body",
                1.0,
                "body must be one value, not a table of them: body.mass, body.inertia, body.position,",
            ),
            (
                "fingers",
                1.0,
                "fingers must be one value, not a table of them: fingers.name, fingers.mounted_on,",
            ),
            (
                "force.values",
                1.0,
                "force.values must name an existing table: the scene has no 'force', got 'force'",
            ),
            ("body.mass", -1.0, "scene: [body]: mass must be > 0, got -1.0"),
            ("body.mass", "heavy", "scene: [body]: mass must be a number, got 'heavy'"),
            (
                "",
                1.0,
                " must name a value of the scene: the scene has name, t_end, save_every,",
            ),
        )
    ),
    (
        lambda: swept(plate(), {"body.mas": [1.0]}),
        "body.mas must name a value of the scene: body has mass, inertia, position, angle,",
    ),
    (
        lambda: swept(plate(), {"body.mass": [-1.0]}),
        "scene: [body]: mass must be > 0, got -1.0",
    ),
]
"""Calls, and words of the line that each raises."""


@pytest.mark.parametrize(("call", "words"), REFUSED)
def test_a_mistake_is_refused_in_words(call, words):
    with pytest.raises(FrictionError) as caught:
        call()
    assert words in str(caught.value)
