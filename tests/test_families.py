"""Families: every member by name, one's own members beside them, and scenes whose models cannot be written."""

from __future__ import annotations

import dataclasses
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
import pytest
from click.shell_completion import ShellComplete

import planarfriction as pf
from planarfriction import families
from planarfriction.cli import main
from planarfriction.cli.app import app
from planarfriction.cli.run import build_scenes
from planarfriction.errors import FileError, InvalidValueError
from planarfriction.scenes import Solution, Statistics, in_hand
from planarfriction.scenes.solution import History
from tests.support import files
from tests.support.refusals import refused

DOCS = Path(__file__).parents[1] / "docs"
DISC = pf.ContactPatch.disc(0.01, 7)
LAW = pf.LuGre(mu_c=0.5, elasto_plastic=0.9)
ALL = (
    families.LAWS,
    families.MODELS,
    families.SURFACES,
    families.SHAPES,
    families.PUBLISHED_PATCHES,
    families.SCENES,
)


@dataclass(frozen=True)
class Bronze(pf.laws.FrictionLaw):
    """A law of one's own: dry bristles of bronze."""

    polish: float = 1.0

    @property
    def numbers(self):
        return pf.Dahl(0.2 / self.polish, 1e5).numbers


@dataclass(frozen=True, eq=False)
class Coarse(pf.DistributedModel):
    """A model of one's own."""

    grit: int = 3


@pytest.fixture
def own():
    """Register members of one's own."""
    pf.laws.register("bronze", Bronze, "dry bronze")
    pf.models.register("coarse", Coarse)
    pf.patch.register(
        "tile",
        lambda width, cells=3: pf.ContactPatch.rectangle(
            width, cells=cells, name="tile"
        ),
    )
    pf.scenes.register(
        "still",
        lambda model, t_end=1.0: dataclasses.replace(
            in_hand(model, t_end=t_end), name="still"
        ),
    )


# ---------------------------------------------------------------------- the library's own


@pytest.mark.parametrize("family", ALL, ids=lambda family: family.what)
def test_every_name_makes_what_its_words_say(family):
    for name in family:
        assert callable(family[name]) and family.words(name)
        if isinstance(family[name], type):
            assert family.name_of(object.__new__(family[name])) == name


def test_the_families_are_complete():
    """Every concrete class of a package is a member: a new file that is not registered is found here."""
    for family, package, base in (
        (families.LAWS, pf.laws, pf.laws.FrictionLaw),
        (families.MODELS, pf.models, pf.models.FrictionModel),
        (families.SURFACES, pf.limit_surface, pf.limit_surface.LimitSurface),
    ):
        public = [getattr(package, name) for name in package.__all__]
        classes = {
            each
            for each in public
            if isinstance(each, type) and issubclass(each, base) and each is not base
        }
        # `RateLaw` is another base.
        classes = {each for each in classes if dataclasses.is_dataclass(each)}
        assert classes == set(family.values())


def test_names_are_known_without_loading_anything():
    code = (
        "import sys, planarfriction.families as f\n"
        "list(f.MODELS), f.LAWS.name_of(3)\n"
        "assert 'numpy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_the_tables_of_the_docs_are_those_of_the_families():
    page = (DOCS / "scene-files.md").read_text(encoding="utf-8")
    for family in (families.MODELS, families.SURFACES):
        for name in family:
            assert f"\n| `{name}` | {family.words(name)}" in page


def test_an_unknown_name_gets_all_of_them():
    with pytest.raises(InvalidValueError) as caught:
        families.MODELS.choose("reduced_published")
    known = "distributed, reduced, reduced-published"
    assert (
        str(caught.value)
        == f"model must be one of {known}, got 'reduced_published' (did you mean 'reduced-published'?)"
    )


# ---------------------------------------------------------------------- one's own


def test_a_scene_with_members_of_ones_own_comes_back_from_its_file(own, tmp_path):
    scene = in_hand(Coarse(DISC, Bronze(polish=2.0), grit=5))
    model = files.again(scene, tmp_path).contacts[0].model
    assert type(model) is Coarse
    assert model.grit == 5 and model.law == Bronze(polish=2.0)


def test_the_command_line_knows_members_of_ones_own(own, capsys):
    built = build_scenes("still", ["coarse"], patch="tile", t_end=0.5)
    (scene,) = built.values()
    assert scene.name == "still" and type(scene.contacts[0].model) is Coarse
    assert scene.contacts[0].model.patch.name == "tile"
    assert main(["run", "--help"]) == 0
    assert "coarse" in capsys.readouterr().out
    assert main(["run", "in-hand", "--model", "fine"]) == 2
    assert "coarse" in capsys.readouterr().err


def test_completion_knows_the_members_and_their_words(own):
    command = app.commands["run"]
    model, scene = (
        next(each for each in command.params if each.name == name)
        for name in ("model", "scene")
    )
    context = click.Context(command)
    offered = {item.value: item.help for item in model.shell_complete(context, "")}
    assert offered == {
        **{name: families.MODELS.words(name) for name in families.MODELS},
        "both": None,
    }
    assert "coarse" in offered
    found = scene.shell_complete(context, "dri")
    assert [item.value for item in found] == ["drift", "driven", "dri"] and found[
        -1
    ].type == "file"


def test_what_cannot_be_registered():
    for name, make, message in (
        ("lugre", Bronze, "not be the name of a member of the library, got lugre"),
        (
            "My law",
            Bronze,
            "consist of lower-case letters, digits and hyphens, got 'My law'",
        ),
        ("bronze", Bronze(), "law must be a class, or a function that makes one"),
    ):
        with refused(message):
            pf.laws.register(name, make)


# ---------------------------------------------------------------------- kinds in files


def read(folder, contact):
    text = "t_end = 1.0\nbody = { mass = 1.0, inertia = 1.0 }\n[contact]\nnormal_force = 2.0\n"
    (folder / "scene.toml").write_text(
        f"{text}{contact}patch = {{ shape = 'disc', radius = 0.01, cells = 5 }}\n"
    )
    return pf.Scene.from_file(folder / "scene.toml").contacts[0].model


@pytest.mark.parametrize(
    ("table", "law"),
    [
        ("{ mu_c = 0.3 }", pf.LuGre(mu_c=0.3)),
        (
            "{ kind = 'lugre', mu_c = 0.3, elasto_plastic = 0.8 }",
            pf.LuGre(mu_c=0.3, elasto_plastic=0.8),
        ),
        (
            "{ elasto_plastic = { breakaway_ratio = 0.8 } }",
            pf.LuGre(elasto_plastic=pf.ElastoPlastic(0.8)),
        ),
        ("{ kind = 'dahl', sigma_0 = 2e4 }", pf.Dahl(sigma_0=2e4)),
        (
            "{ kind = 'coulomb-stribeck', mu_c = 0.4, v_s = 0.01 }",
            pf.CoulombStribeck(mu_c=0.4, v_s=0.01),
        ),
    ],
)
def test_laws_by_kind(tmp_path, table, law):
    model = read(tmp_path, f"law = {table}\n")
    assert model.law == law
    scene = in_hand(model)
    assert pf.Scene.from_dict(scene.to_dict()).contacts[0].model.law == law


@pytest.mark.parametrize(
    ("contact", "message"),
    [
        (
            "law = { kind = 'dhal' }\n",
            "[contact.law]: kind must be one of lugre, dahl, coulomb-stribeck, got 'dhal'",
        ),
        ("law = { kind = 'dahl', mu_s = 1.2 }\n", "[contact.law]: unknown key 'mu_s'"),
        (
            "law = {}\nmodel = 'fast'\n",
            "kind must be one of distributed, reduced, reduced-published, got 'fast'",
        ),
        (
            "law = {}\nmodel = { kind = 'reduced-published', surface = 'round' }\n",
            "kind must be one of cells, exact, table, table-published, ellipsoid, quartic, got 'round'",
        ),
        (
            "law = {}\nmodel = { kind = 'reduced', parts = 4 }\n",
            "[contact.model]: unknown key 'parts' (valid: kind, cells)",
        ),
    ],
)
def test_wrong_kinds_get_one_line_with_all_names(tmp_path, contact, message):
    with refused(re.escape(message), FileError):
        read(tmp_path, contact)


@pytest.mark.parametrize("name", families.SURFACES)
def test_every_surface_comes_back_from_a_scene(name):
    surface = families.SURFACES[name](DISC)
    scene = in_hand(pf.ReducedModelPublished(DISC, LAW, surface=surface))
    again = pf.Scene.from_dict(scene.to_dict())
    assert (
        type(again.contacts[0].model.surface) is type(surface)
        and again.digest() == scene.digest()
    )


@pytest.mark.quartic
def test_a_fitted_quartic_comes_back_with_its_numbers():
    pytest.importorskip(
        "cvxpy", reason="cvxpy is not installed: the convex quartic is an extra"
    )
    coefficients = np.zeros(15)
    coefficients[[0, 10, 14]] = 1.0  # x^4, y^4, z^4
    coefficients[[3, 5, 12]] = 2.0  # x^2 y^2, x^2 z^2, y^2 z^2: the sphere
    other = pf.ContactPatch.disc(0.02, 5)
    quartic = pf.LimitSurfaceQuartic(
        other,
        coefficients=coefficients,
        surface=pf.LimitSurfaceTable(other, segments=6),
    )
    scene = in_hand(pf.ReducedModelPublished(DISC, LAW, surface=quartic))
    again = pf.Scene.from_dict(scene.to_dict()).contacts[0].model.surface
    assert (
        np.array_equal(again.coefficients, coefficients) and again.surface.segments == 6
    )
    assert again.patch.contact_radius() == other.contact_radius()


# ---------------------------------------------------------------------- models that cannot be written


def a_solution(model):
    time = np.linspace(0.0, 1.0, 5)
    histories = {
        name: History(("time",), np.zeros(5), {"units": "m"})
        for name in ("x", "y", "theta")
    }
    histories |= {
        name: History(("time",), np.zeros(5), {"units": "m/s"})
        for name in ("vx", "vy", "omega")
    }
    for name, unit in {"fx": "N", "fy": "N", "tau": "N m", "normal_force": "N"}.items():
        histories[name] = History(("time", "contact"), np.ones((5, 1)), {"units": unit})
    histories["time"] = History(("time",), time, {"units": "s"})
    histories["contact"] = History(("contact",), np.array(["fingers"]), {})
    return Solution(
        histories,
        Statistics(steps=1, wall_time=0.1),
        "success",
        "reached t_end",
        in_hand(model),
    )


def test_a_scene_that_cannot_be_written_still_plots_and_saves(tmp_path):
    solution = a_solution(Coarse(DISC, LAW))
    known = "distributed, reduced, reduced-published"
    reason = f"model must be one of {known}, or be registered, to be written to a file, got Coarse"
    assert solution.data.attrs == {"scene": "", "scene_left_out": reason}
    assert solution.plot().axes
    again = pf.Solution.load(solution.save(tmp_path / "run.nc"))
    assert again.scene is None and again.data.attrs == solution.data.attrs
    assert np.array_equal(again.data.fx, solution.data.fx)
    with refused(
        "the file has no scene, which the plot needs: model must be one of", FileError
    ):
        again.plot()
    twice = pf.Solution.load(again.save(tmp_path / "twice.nc"))
    assert twice.data.attrs == again.data.attrs
    with refused("got Coarse"):
        solution.scene.to_file(tmp_path / "scene.toml")


@pytest.mark.parametrize("law", [Bronze(), pf.LuGre(mu_c=0.5)], ids=["own", "LuGre"])
def test_only_what_can_be_written_has_its_scene_in_the_data(law):
    assert bool(
        a_solution(pf.DistributedModel(DISC, law)).data.attrs["scene"]
    ) == isinstance(law, pf.LuGre)


def test_a_parameter_that_is_no_plain_data_is_named(own):
    with refused(r"grit must be an attribute of Coarse and plain data .* got function"):
        in_hand(Coarse(DISC, LAW, grit=lambda: 3)).to_dict()  # pyright: ignore


@pytest.mark.parametrize(
    ("before", "incomplete", "found"),
    [
        (["limit-surface", "--patch"], "non", {"NonConvex1", "NonConvex2", "non"}),
        (["run", "in-hand", "--patch"], "rec", {"rectangle", "rec"}),
        (["identify", "--patch"], "sq", {"Square", "sq"}),
        (["sweep"], "pus", {"pushed", "pus"}),
        (["run"], "pus", {"pushed", "pus"}),
    ],
)
def test_completion_knows_patches_and_scenes(before, incomplete, found):
    shell = ShellComplete(app, {}, "planarfriction", "_PLANARFRICTION_COMPLETE")
    offered = shell.get_completions(before, incomplete)
    assert {item.value for item in offered} == found and offered[-1].type == "file"
