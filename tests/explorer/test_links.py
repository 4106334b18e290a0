"""The state as JSON in a link: it comes back as it was, and what was tampered with is refused in one line."""

import json

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.errors import FrictionError
from planarfriction.laws import LAWS
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction_explorer.drawing import MOST_SIDE, Drawing
from planarfriction_explorer.state import (
    MOST_TEXT,
    State,
    answer,
    from_link,
    to_json,
    to_link,
)
from tests.support.refusals import refused

PAINTED = Drawing.published("Square").painted(
    0.004, 0.002, radius=0.003, pressure=0.1 + 0.2
)


@pytest.mark.parametrize(
    "drawing", [*map(Drawing.published, PUBLISHED_PATCHES), PAINTED, PAINTED.cleared()]
)
def test_a_state_comes_back_from_its_link_to_the_last_bit(drawing):
    state = State(
        drawing, pf.Dahl(mu_c=0.3), 0.1 + 0.2, (1 / 3, -0.0, 1e-7), 0.07, -0.02
    )
    text = to_link(state)
    found = from_link(text)
    assert (
        to_link(found) == text
        and " " not in text
        and found.drawing.name == drawing.name
    )
    np.testing.assert_array_equal(found.drawing.pressures, drawing.pressures)
    if drawing.pressures.any():
        np.testing.assert_array_equal(answer(found).points, answer(state).points)


@pytest.mark.parametrize("kind", LAWS)
def test_every_law_comes_back_from_its_link(kind):
    for law in (
        State().with_law(kind).law,
        State().with_law(kind, mu_c=0.3).law,
        pf.LuGre(sigma_1=0.0),
    ):
        assert from_link(to_link(State(law=law))).law == law


def test_a_link_of_the_most_cells_is_not_too_long():
    pressures = np.random.default_rng(0).random((MOST_SIDE, MOST_SIDE))
    assert 2 * len(to_link(State(Drawing(pressures, 0.1 / 3)))) < MOST_TEXT


def patch(**values):
    return json.dumps({"patch": {"cell_size": 1e-3, "pressures": [[1.0]], **values}})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the link must hold a state as JSON"),
        ("[" * 10**5, "the link must hold a state as JSON"),
        ('{"normal_force": ' + "1" * 5000 + "}", "the link must hold a state as JSON"),
        ("[1]", "the link must be a table"),
        ('{"mas": 1}', "did you mean 'mass'?"),
        ('{"mass": NaN}', "mass must be finite"),
        ('{"mass": 1e999}', "mass must be finite"),
        ('{"mass": "1"}', "mass must be a number"),
        ('{"mass": true}', "mass must be a number"),
        ('{"lever": null}', "lever must be a number"),
        ('{"normal_force": -1}', "normal_force must be > 0"),
        ('{"twist": [0, 1]}', "twist must have shape [3]"),
        ('{"twist": {"x": 1}}', "twist must be an array of numbers"),
        ('{"patch": "Squar"}', "did you mean 'Square'?"),
        ('{"patch": ["Square"]}', "patch must be a table"),
        ('{"patch": {"cell_size": 0.001}}', "patch must have the key 'pressures'"),
        ('{"law": 3}', "must be a table"),
        ('{"law": {"kind": "dal"}}', "did you mean 'dahl'?"),
        ('{"law": {"kind": "dahl", "mu_c": -1}}', "mu_c must be > 0"),
        ('{"law": {"kind": "dahl", "mu_c": [1, 2]}}', "mu_c must be a number"),
        ('{"law": {"kind": "dahl", "v_s": 1}}', "unknown key 'v_s'"),
        (patch(file="/etc/passwd"), "patch key must be one of"),
        (patch(cell_size=0), "cell_size must be > 0"),
        (patch(cell_size=1e200), "cell_size must be at most"),
        (patch(cell_size=1e30), "must be at most"),
        (patch(pressures=[[-1.0]]), "pressures must be >= 0"),
        (patch(pressures=[[1.0], [1.0, 2.0]]), "rows of equal length"),
        (patch(pressures=[[]]), f"have from 1 to {MOST_SIDE} rows and columns"),
        (
            patch(pressures=[[1.0] * (MOST_SIDE + 1)]),
            f"have from 1 to {MOST_SIDE} rows and columns",
        ),
        (patch(pressures=[1.0]), "pressures must have shape [any, any]"),
    ],
)
def test_a_link_that_was_tampered_with_is_one_line(text, words):
    with pytest.raises(FrictionError) as error:
        from_link(text)
    assert (
        words in str(error.value)
        and "\n" not in str(error.value)
        and len(str(error.value)) < 500
    )


def test_a_link_without_end_is_refused_before_it_is_read():
    with refused("at most 300000 characters", FrictionError):
        from_link("#" + "[" * (MOST_TEXT + 1))


def test_what_a_link_leaves_out_has_its_default():
    assert to_json(from_link("#{}")) == to_json(State())
