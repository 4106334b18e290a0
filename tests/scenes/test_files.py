"""Scene files: the friendly forms, the examples, exact round trips, and one line for every mistake."""

import dataclasses
import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction import FrictionError, Scene, Signal
from planarfriction.scenes import drift, in_hand, published_velocity
from planarfriction.scenes.files import to_toml
from tests.support.files import again
from tests.support.refusals import refusal, refused

EXAMPLES = Path(__file__).parents[2] / "examples"
CSV_DIGITS = 1e-11  # the tables of the examples are printed with 12 digits

GOOD = """
t_end = 1.0
[body]
mass = 1.0
inertia = 1.0
[[contact]]
normal_force = 2.0
[contact.patch]
shape = "disc"
radius = 0.01
cells = 5
[contact.law]
mu_c = 0.5
mu_s = 0.6
"""


def read(folder, text, name="scene.toml"):
    (folder / name).write_text(text)
    return Scene.from_file(folder / name)


def one_line(folder, text):
    """The message that a scene file gets, without the folder it happens to be in."""
    return refusal(read, folder, text).replace(f"{folder}/", "")


# ---------------------------------------------------------------------- forms


def test_a_short_file_means_what_it_says(tmp_path):
    scene = read(tmp_path, GOOD)
    (contact,) = scene.contacts
    assert (scene.t_end, scene.body.mass, scene.body.gravity) == (
        1.0,
        1.0,
        (0.0, -9.81),
    )
    assert isinstance(contact.model, pf.DistributedModel)
    assert contact.model.law == pf.LuGre(mu_c=0.5, mu_s=0.6)
    assert contact.model.patch.to_dict() == pf.ContactPatch.disc(0.01, 5).to_dict()
    assert contact.normal_force == Signal.constant(2.0)
    assert contact.name == "contact"


def test_several_contacts_get_names(tmp_path):
    table = GOOD[GOOD.index("[[contact]]") :]
    scene = read(tmp_path, GOOD + table)
    assert [contact.name for contact in scene.contacts] == ["contact 1", "contact 2"]


def test_the_size_of_a_rectangle_gives_inertia_and_outline(tmp_path):
    scene = read(tmp_path, GOOD.replace("inertia = 1.0", "size = [0.3, 0.4]"))
    assert scene.body.inertia == pytest.approx(0.25 / 12, rel=1e-15)
    assert scene.body.outline.max(axis=0).tolist() == [0.15, 0.2]


@pytest.mark.parametrize(
    ("table", "patch"),
    [
        (
            'shape = "rectangle"\nwidth = 0.02\ncells = [3, 2]\nheight = 0.01',
            {"cells": 6},
        ),
        (
            'shape = "ring"\ninner_radius = 0.005\nouter_radius = 0.01\ncells = 8',
            {"name": "ring"},
        ),
        (
            'shape = "line"\nlength = 0.02\ndirection = "x"\nprofile = [1, 1, 1, 1, 6]\ncells = 5',
            {"cells": 5},
        ),
        (
            'shape = "polygon"\nvertices = [[0, 0], [1, 0], [0, 1]]\ncells = 4',
            {"name": "polygon"},
        ),
        (
            'shape = "points"\npositions = [[0, 0], [1, 0], [0, 1]]\nweights = [1, 2, 3]',
            {"cells": 3},
        ),
        ('shape = "published"\nname = "NonConvex1"', {"cells": 18}),
        (
            'shape = "pressure-map"\nvalues = [[1, 2], [0, 3]]\ncell_size = 0.001',
            {"cells": 3},
        ),
        (
            'shape = "pressure-map"\nfile = "map.csv"\ncell_size = [0.001, 0.002]',
            {"name": "map"},
        ),
        (
            'shape = "disc"\nradius = 0.1\ncells = 5\npressure = "uniform"',
            {"depends_on_load": False},
        ),
        (
            'shape = "disc"\nradius = 0.1\npressure = { law = "soft_finger", c = 0.03, n = 0.3, k = 2 }',
            {},
        ),
        (
            'shape = "disc"\nradius = 0.5\npressure = { law = "linear_gradient", gradient = [0.5, 0.1] }',
            {},
        ),
    ],
)
def test_every_shape_by_name(tmp_path, table, patch):
    (tmp_path / "map.csv").write_text("0,1,1\n0,1,1\n")
    start = GOOD.index('shape = "disc"')
    end = GOOD.index("[contact.law]")
    scene = read(tmp_path, f"{GOOD[:start]}{table}\n{GOOD[end:]}")
    made = scene.contacts[0].model.patch
    assert {name: getattr(made, name) for name in patch} == patch
    assert Scene.from_dict(scene.to_dict()).digest() == scene.digest()


def test_a_map_in_a_file_has_its_top_row_first(tmp_path):
    (tmp_path / "map.csv").write_text("3,3\n1,1\n")
    start = GOOD.index('shape = "disc"')
    end = GOOD.index("[contact.law]")
    table = 'shape = "pressure-map"\nfile = "map.csv"\ncell_size = 0.002\n'
    patch = read(tmp_path, GOOD[:start] + table + GOOD[end:]).contacts[0].model.patch
    # (3 - 1)/4 of 1 mm, upwards.
    assert patch.centre_of_pressure() == pytest.approx([0.0, 0.0005], abs=1e-18)


@pytest.mark.parametrize(
    ("line", "check"),
    [
        ('model = "distributed"', lambda model: isinstance(model, pf.DistributedModel)),
        (
            'model = "reduced-published"',
            lambda model: isinstance(model.surface, pf.LimitSurfaceTablePublished),
        ),
        (
            'model = { kind = "reduced-published", surface = "ellipsoid" }',
            lambda model: isinstance(model.surface, pf.LimitSurfaceEllipsoid),
        ),
        (
            'model = { kind = "reduced-published", surface = { kind = "table", segments = 7 } }',
            lambda model: (
                isinstance(model.surface, pf.LimitSurfaceTable)
                and model.surface.segments == 7
            ),
        ),
        (
            'model = { kind = "reduced-published", on_load_change = "keep" }',
            lambda model: model.on_load_change == "keep",
        ),
    ],
)
def test_every_model_by_name(tmp_path, line, check):
    scene = read(
        tmp_path, GOOD.replace("normal_force = 2.0", f"normal_force = 2.0\n{line}")
    )
    assert check(scene.contacts[0].model)


# ---------------------------------------------------------------------- examples


def test_the_in_hand_example_is_the_published_experiment():
    scene = Scene.from_file(EXAMPLES / "in_hand.toml")
    ready = in_hand(scene.contacts[0].model)
    assert isinstance(scene.contacts[0].model, pf.ReducedModel)
    assert scene.body == ready.body
    assert scene.contacts[0].count == 2
    t = np.arange(201) * 0.01 + 0.005
    assert (
        np.abs(
            scene.contacts[0].normal_force(t) - ready.contacts[0].normal_force(t)
        ).max()
        < CSV_DIGITS
    )


def test_the_drift_example_is_the_published_experiment():
    scene = Scene.from_file(EXAMPLES / "drift.toml")
    ready = drift(scene.contacts[0].model)
    t = np.arange(500) * 0.01 + 0.005
    assert np.abs(scene.force(t) - ready.force(t)).max() < CSV_DIGITS
    assert (scene.body.mass, scene.body.inertia, scene.t_end) == (
        ready.body.mass,
        ready.body.inertia,
        ready.t_end,
    )
    patch = scene.contacts[0].model.patch
    # 0.05 m wide.
    assert (patch.cells, patch.second_moment()) == (
        317,
        pytest.approx(6.25 * 4.5815e-5, rel=1e-6),
    )


def test_the_driven_example_has_the_published_velocity():
    scene = Scene.from_file(EXAMPLES / "driven.toml")
    t = np.arange(500) * 0.01 + 0.005
    assert np.abs(scene.velocity(t) - published_velocity()(t)).max() < 1e-14  # rounding
    assert scene.contacts[0].model.patch.depends_on_load


def test_the_free_slide_example_reads_its_pressure_map():
    scene = Scene.from_file(EXAMPLES / "free_slide.toml")
    patch = scene.contacts[0].model.patch
    values = np.loadtxt(EXAMPLES / "pad_pressure.csv", delimiter=",")
    assert patch.cells == np.count_nonzero(values)
    rows = 5.5 - np.arange(12)
    expected = (values.sum(axis=1) @ rows) / values.sum() * 1e-3
    assert patch.centre_of_pressure()[1] == pytest.approx(expected, rel=1e-12)
    assert scene.stop_speed == 1e-4


# ---------------------------------------------------------------------- round trips


@pytest.mark.parametrize(
    "example", sorted(path.name for path in EXAMPLES.glob("*.toml"))
)
def test_files_round_trip_to_the_bit(tmp_path, example):
    again(Scene.from_file(EXAMPLES / example), tmp_path)


TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
PLAIN = st.recursive(
    TEXTS
    | st.booleans()
    | st.integers(-(2**62), 2**62)
    | st.floats(allow_nan=False, allow_infinity=False),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(TEXTS.filter(bool), inner, max_size=3)
    ),
    max_leaves=12,
)


@given(data=st.dictionaries(TEXTS.filter(bool), PLAIN, max_size=4))
@settings(deadline=None, max_examples=100)
def test_toml_text_reads_back_as_written(data):
    assert tomllib.loads(to_toml(data)) == data


def test_unusual_names_survive(tmp_path):
    scene = read(tmp_path, GOOD)
    contact = dataclasses.replace(scene.contacts[0], name='Finger "ü" φ \\ / 1')
    renamed = dataclasses.replace(scene, contacts=[contact], name="Gleitprüfung")
    assert again(renamed, tmp_path).contacts[0].name == contact.name


# ---------------------------------------------------------------------- mistakes


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "mu_c = 0.5",
            "mu_cc = 0.5",
            "scene.toml: [contact.law]: unknown key 'mu_cc' (did you mean 'mu_c'?)",
        ),
        (
            "mass",
            "masss",
            "scene.toml: [body]: unknown key 'masss' (did you mean 'mass'?)",
        ),
        ("mass = 1.0", "", "scene.toml: [body]: missing key 'mass'"),
        ("inertia = 1.0", "", "scene.toml: [body]: missing key 'inertia' (or size"),
        ("t_end", "t_ende", "scene.toml: unknown key 't_ende' (did you mean 't_end'?)"),
        ("t_end = 1.0", "", "scene.toml: missing key 't_end'"),
        ("t_end = 1.0", "t_end = -1.0", "scene.toml: t_end must be > 0, got -1.0"),
        (
            "t_end = 1.0",
            "t_end = 1.0\nforce = [1, 2]",
            "scene.toml: force must have 3 columns",
        ),
        (
            "mu_s = 0.6",
            "mu_s = 0.4",
            "scene.toml: [contact.law]: mu_s must be >= mu_c, got mu_s=0.4, mu_c=0.5",
        ),
        (
            "mu_s = 0.6",
            "mu_s = nan",
            "scene.toml: [contact.law]: mu_s must be finite, got nan",
        ),
        (
            "mu_s = 0.6",
            "elasto_plastic = 2",
            "scene.toml: [contact.law]: elasto_plastic must be in",
        ),
        (
            "radius = 0.01",
            "radius = -1",
            "scene.toml: [contact.patch]: radius must be > 0, got -1.0",
        ),
        ("radius = 0.01", "", "scene.toml: [contact.patch]: missing key 'radius'"),
        (
            "radius",
            "raduis",
            "scene.toml: [contact.patch]: unknown key 'raduis' (did you mean 'radius'?)",
        ),
        ('"disc"', '"disk"', "scene.toml: [contact.patch]: shape must be one of disc,"),
        ('"disc"', '"disk"', "got 'disk' (did you mean 'disc'?)"),
        (
            "radius = 0.01",
            "radius = 0.01\npressure = 'soft'",
            "scene.toml: [contact.patch.pressure]: ",
        ),
        ("normal_force = 2.0", "", "scene.toml: [contact]: missing key 'normal_force'"),
        ("normal_force = 2.0", "normal_force = -2.0", "got -2.0 at t = 0 s"),
        (
            "normal_force = 2.0",
            "normal_force = 'x'",
            "scene.toml: [contact.normal_force]: must be a number, a list",
        ),
        (
            "normal_force = 2.0",
            "normal_force = { times = [0, 1], values = [1, -1], hold = 'linear' }",
            "scene.toml: [contact]: normal_force of contact 'contact' must be >= 0, got -1.0 at t = 1 s",
        ),
        (
            "normal_force = 2.0",
            "normal_force = { times = [1, 0], values = [1, 1] }",
            "scene.toml: [contact.normal_force]: times must increase, got 1 s, then 0 s at index 1 (unsorted)",
        ),
        (
            "normal_force = 2.0",
            "normal_force = { cvs = 'load.csv' }",
            "scene.toml: [contact.normal_force]: unknown key 'cvs' (did you mean 'csv'?)",
        ),
        (
            "normal_force = 2.0",
            "normal_force = { csv = 'none.csv' }",
            "scene.toml: [contact.normal_force]: none.csv: no such file",
        ),
        (
            "normal_force = 2.0",
            "normal_force = { csv = 'load.csv', value = 3 }",
            "scene.toml: [contact.normal_force]: value must be the name of a column, or a list of names, got 3",
        ),
        (
            "normal_force = 2.0",
            "normal_force = { sine = { offset = 1, amplitude = 1, frequncy = 2, t_end = 1 } }",
            "scene.toml: [contact.normal_force.sine]: unknown key 'frequncy' (did you mean 'frequency'?)",
        ),
        (
            "normal_force = 2.0",
            "normal_force = 2.0\nmodel = 'distribted'",
            "scene.toml: [contact.model]: kind must be one of distributed, reduced, reduced-published, "
            "got 'distribted'",
        ),
        (
            "normal_force = 2.0",
            "normal_force = 2.0\nmodel = { kind = 'reduced-published', surface = { kind = 'cells', segments = 3 } }",
            "scene.toml: [contact.model.surface]: unknown key 'segments'",
        ),
        (
            "normal_force = 2.0",
            "normal_force = 2.0\ncount = 0",
            "scene.toml: [contact]: count of contact 'contact'",
        ),
        ("[[contact]]", "[[contacts]]", "scene.toml: "),
        (
            "[contact.law]",
            "[contact.lwa]",
            "scene.toml: [contact]: unknown key 'lwa' (did you mean 'law'?)",
        ),
        (
            "mass = 1.0",
            "mass = = 1.0",
            "scene.toml: not valid TOML: Invalid value (at line 4, column 8)",
        ),
        ("mass = 1.0", "mass = '1.0", "scene.toml: not valid TOML: "),
        (
            "[body]\nmass = 1.0\ninertia = 1.0",
            "body = 3",
            "scene.toml: [body]: must be a table of keys and values",
        ),
    ],
)
def test_mistakes_get_one_line_with_file_table_and_remedy(tmp_path, old, new, message):
    assert old in GOOD
    assert message in one_line(tmp_path, GOOD.replace(old, new, 1))


def test_mistakes_in_one_of_several_contacts_say_which(tmp_path):
    table = GOOD[GOOD.index("[[contact]]") :]
    message = one_line(tmp_path, GOOD + table.replace("mu_c", "mu_cc"))
    assert (
        message
        == "scene.toml: [contact.2.law]: unknown key 'mu_cc' (did you mean 'mu_c'?)"
    )


def test_bad_pressure_maps_say_scene_and_map(tmp_path):
    start = GOOD.index('shape = "disc"')
    end = GOOD.index("[contact.law]")
    for name, content in (
        ("none.csv", None),
        ("zero.csv", "0,0\n0,0\n"),
        ("below.csv", "1,-1\n"),
        ("map.txt", "1"),
    ):
        if content is not None:
            (tmp_path / name).write_text(content)
        table = f'shape = "pressure-map"\nfile = "{name}"\ncell_size = 0.001\n'
        message = one_line(tmp_path, GOOD[:start] + table + GOOD[end:])
        assert message.startswith("scene.toml: [contact.patch]: ")
        assert name in message


def test_a_prescribed_velocity_needs_no_body(tmp_path):
    moved = GOOD.replace(
        "[body]\nmass = 1.0\ninertia = 1.0", "velocity = [0.01, 0.0, 1.0]"
    )
    assert read(tmp_path, moved).velocity == Signal.constant([0.01, 0.0, 1.0])
    assert "missing key 'body'" in one_line(
        tmp_path, GOOD.replace("[body]\nmass = 1.0\ninertia = 1.0", "")
    )


def test_files_of_the_wrong_kind_get_one_line(tmp_path):
    cases = {
        "none.toml": None,
        "picture.toml": b"\x89PNG\xff\x00",
        "scene.yaml": b"t_end: 1",
        "list.json": b"[1, 2]",
    }
    cases |= {"broken.json": b'{"t_end": ', "empty.toml": b""}
    for name, content in cases.items():
        if content is not None:
            (tmp_path / name).write_bytes(content)
        with refused(re.escape(name), FrictionError):
            Scene.from_file(tmp_path / name)
    with refused("is a folder", FrictionError):
        (tmp_path / "folder.toml").mkdir()
        Scene.from_file(tmp_path / "folder.toml")


def test_writing_says_why_it_cannot(tmp_path):
    scene = read(tmp_path, GOOD)
    with refused(r"must end in \.toml or \.json", FrictionError):
        scene.to_file(tmp_path / "scene.yaml")
    with refused("cannot be written", FrictionError):
        scene.to_file(tmp_path / "nowhere" / "scene.toml")


def test_the_written_json_is_plain(tmp_path):
    scene = read(tmp_path, GOOD)
    scene.to_file(tmp_path / "again.json")
    data = json.loads((tmp_path / "again.json").read_text())
    assert data == scene.to_dict()
    assert list(data) == [
        "name",
        "t_end",
        "save_every",
        "rtol",
        "atol",
        "body",
        "contact",
    ]


@pytest.mark.parametrize("name", ["a", '"a b"', "'a.b'"])
def test_a_key_of_many_names_is_refused_at_once(tmp_path, name):
    """The reader of the standard library would take minutes and gigabytes."""
    path = tmp_path / "scene.toml"
    path.write_text(f"{'.'.join([name] * 50_000)} = 1\n")
    with refused(
        r"scene\.toml: not valid TOML: a key of more than 100 names$", pf.FrictionError
    ):
        pf.Scene.from_file(path)


@pytest.mark.parametrize(
    "name",
    ["a" * 1_000_000, '"' * 1_000_001, " a" * 500_000, "a." * 99 + "b" * 1_000_000],
)
def test_long_names_are_looked_at_once(tmp_path, name):
    path = tmp_path / "scene.toml"
    path.write_text(f"[{name} x")
    with refused(r"scene\.toml: not valid TOML", pf.FrictionError):
        pf.Scene.from_file(path)


@pytest.mark.parametrize("width", ['"0.02"', "[0.02]", "true"])
def test_published_patches_check_their_width(tmp_path, width):
    path = tmp_path / "scene.toml"
    patch = f'{{ shape = "published", name = "Circle", width = {width} }}'
    contact = f"[[contact]]\nnormal_force = 1.0\nlaw = {{}}\npatch = {patch}\n"
    path.write_text(f"t_end = 0.1\n[body]\nmass = 1.0\ninertia = 1.0\n{contact}")
    with refused(r"\[contact\.patch\]: width must be a number", pf.FrictionError):
        pf.Scene.from_file(path)


def test_maps_in_scene_files_take_the_options_of_maps(tmp_path):
    (tmp_path / "map.csv").write_text(",a,b\nx,9,1\ny,0,5\n\n,a,b\nx,1,1\ny,1,9\n")
    start = GOOD.index('shape = "disc"')
    end = GOOD.index("[contact.law]")
    table = 'shape = "pressure-map"\nfile = "map.csv"\nwidth = 0.004\nframe = 1\nthreshold = 0.5\n'
    patch = read(tmp_path, GOOD[:start] + table + GOOD[end:]).contacts[0].model.patch
    assert patch.positions.tolist() == [[0.001, -0.001]]
    with refused("frame must be one of the 2 frames", FrictionError):
        read(tmp_path, GOOD[:start] + table.replace("frame = 1\n", "") + GOOD[end:])
