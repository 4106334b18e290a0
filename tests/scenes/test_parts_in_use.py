"""The reduced model in parts where it is used: scenes and their sensitivities, files, copies, the command line."""

from __future__ import annotations

import copy
import dataclasses
import pickle

import numpy as np
import pytest
from click.shell_completion import CompletionItem

import planarfriction as pf
from planarfriction import derivatives, scenes
from planarfriction.cli import main
from planarfriction.cli.app import complete_parts
from planarfriction.compiled.rates import rates
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch, SoftFinger
from planarfriction.patch.parts import part_of
from planarfriction.scenes import Scene, simulate

LAW = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
T = PUBLISHED_PATCHES["NonConvex2"](11)
SOFT = ContactPatch.disc(0.01, 11, pressure=SoftFinger(c=0.006, n=1 / 3, k=2.0))
SMALL = {"segments": 8, "speeds": 8}
TIGHT = {"rtol": 1e-8, "atol": 1e-8}


def path_of(scene: Scene) -> np.ndarray:
    data = simulate(scene, **TIGHT).histories
    return np.stack([data[name].values for name in ("x", "y", "theta")], -1)


def test_a_contact_in_parts_is_as_many_contacts_on_the_same_body():
    model = pf.ReducedModel(T, LAW, parts=3)
    together = scenes.in_hand(model, t_end=0.6)
    (contact,) = together.contacts
    load = contact.normal_force
    alone = [
        dataclasses.replace(
            contact,
            model=pf.ReducedModel(part_of(T, model.reduction.labels == k), LAW, parts=1),
            normal_force=dataclasses.replace(load, values=load.values * model.reduction.parts_at(None)[k].share),
            name=f"part {k}",
        )
        for k in range(3)
    ]
    apart = dataclasses.replace(together, contacts=tuple(alone))
    ours, theirs = path_of(together), path_of(apart)
    assert np.abs(ours[-1] - ours[0]).max() > 1e-3
    # both solve the same equations: what is left are errors of the solver, 1e-8 of the way
    np.testing.assert_allclose(ours, theirs, atol=1e-7 * np.abs(ours).max())


@pytest.mark.parametrize("patch", [T, SOFT], ids=["T", "soft"])
def test_what_the_solver_sees_is_what_the_model_says(patch):
    model = pf.ReducedModel(patch, LAW, parts=4, **SMALL)
    loads = [0.02, 0.7, 2.0] if patch.depends_on_load else [None]
    generator = np.random.default_rng(2)
    state, twist = 1e-6 * generator.normal(size=(5, 4, 3)), generator.normal(size=(5, 3)) * [1e-3, 1e-3, 0.1]
    for load in loads:
        packed = model.packed([load])
        rate, unit = rates(packed, state, twist)
        np.testing.assert_allclose(rate, model.rate(state, twist, load or 1.0), rtol=1e-12)
        np.testing.assert_allclose(unit * (load or 1.0), model.wrench(state, twist, load or 1.0), rtol=1e-11)
        assert packed.states == 12
        assert packed.radius == pytest.approx(np.sqrt(patch.second_moment(load)), rel=1e-12)
    if patch.depends_on_load:  # one after another in a run: records of several loads, the lever arm of the highest
        packed = model.packed(loads[:2], (loads[0], loads[-1]))
        assert len(packed.records) in (1, 2)
        rate, _ = rates(packed._replace(records=packed.records[-1:]), state, twist)
        np.testing.assert_allclose(rate, model.rate(state, twist, loads[len(packed.records) - 1]), rtol=1e-12)
        assert packed.radius == pytest.approx(np.sqrt(patch.second_moment(loads[-1])), rel=1e-12)


def test_a_load_that_changes_takes_its_parts_along():
    model = pf.ReducedModel(SOFT, LAW, parts=3, **SMALL)
    signal, steps, dt = pf.scenes.Signal, 400, 1e-4
    scene = scenes.driven(
        model,
        twist=signal([0.0, 0.04], [[1e-3, 0.0, 0.2], [1e-3, 5e-4, 0.2]], "linear"),
        normal_force=signal([0.0, 0.04], [0.7, 1.0], "linear"),
        t_end=0.04,
    )
    data = simulate(scene, **TIGHT).histories
    state, wrench = model.rest(), np.zeros(3)
    for share in (np.arange(steps) + 0.5) / steps:
        state, wrench = model.step(state, (1e-3, 5e-4 * share, 0.2), 0.7 + 0.3 * share, dt)
    found = [data[name].values[-1, 0] for name in ("fx", "fy", "tau")]
    # steps hold twist and load in their middle: the last one lies half a step, 1e-3 of the way, back
    np.testing.assert_allclose(found, wrench, rtol=2e-3, atol=1e-6)


def test_sensitivities_of_a_scene_are_differences_of_scenes():
    def slide(**law) -> Scene:
        return scenes.free_slide(pf.ReducedModel(T, dataclasses.replace(LAW, **law), parts=3), t_end=0.05)

    found = derivatives.scene_sensitivities(slide(), ("mu", "r", "load"))
    ahead, behind = (path_of(slide(mu_c=LAW.mu_c * factor, mu_s=LAW.mu_s * factor)) for factor in (1.0001, 0.9999))
    wanted = (ahead - behind) / 2e-4
    # differences of runs at 1e-8: 1e-4 of the largest
    np.testing.assert_allclose(found.d_motion[:, 3:, 0], wanted, atol=3e-4 * np.abs(wanted).max(0).max())
    one = derivatives.scene_sensitivities(
        scenes.free_slide(pf.ReducedModel(T, LAW, parts=1), t_end=0.05), ("mu", "r", "load")
    )
    largest = np.abs(one.d_motion[:, 3:]).max(0)
    assert (np.abs(found.d_motion[:, 3:] - one.d_motion[:, 3:]).max(0) < 5e-3 * largest.max(0)).all()


def test_states_on_the_way_are_those_of_each_part(tmp_path):
    solution = simulate(scenes.free_slide(pf.ReducedModel(T, LAW, parts=3), t_end=0.05), bristles="all")
    (bristles,) = [variable for name, variable in solution.histories.items() if name.startswith("bristles_")]
    assert bristles.values.shape[1:] == (3, 3)
    solution.save(tmp_path / "slide.nc")
    again = pf.Solution.load(tmp_path / "slide.nc")
    assert again.scene == solution.scene
    (kept,) = [name for name in again.histories if name.startswith("bristles_")]
    np.testing.assert_array_equal(again.histories[kept].values, bristles.values)


@pytest.mark.parametrize("suffix", ["toml", "json"])
def test_scene_files_keep_parts(tmp_path, suffix):
    scene = scenes.free_slide(pf.ReducedModel(T, LAW, parts=3))
    scene.to_file(tmp_path / f"slide.{suffix}")
    again = Scene.from_file(tmp_path / f"slide.{suffix}")
    assert again == scene
    assert again.contacts[0].model.parts == 3


def test_a_scene_file_may_say_auto(tmp_path):
    (tmp_path / "scene.toml").write_text(
        """t_end = 0.01
        [body]
        mass = 0.2
        inertia = 1e-5
        velocity = [0.1, 0.0, 1.0]
        [[contact]]
        mounted_on = "body"
        normal_force = 1.0
        patch = {shape = "line", length = 0.02, cells = 12}
        law = {mu_s = 1.2}
        model = {kind = "reduced", parts = "auto"}
        """
    )
    assert Scene.from_file(tmp_path / "scene.toml").contacts[0].model.parts == 6


def test_copies_and_equality_know_the_parts():
    for patch in (T, SOFT):
        model = pf.ReducedModel(patch, LAW, parts=3, **SMALL)
        wanted = model.step(model.rest(), (1e-3, 0.0, 0.3), 1.3, 1e-3)[1]
        for again in (copy.copy(model), copy.deepcopy(model), pickle.loads(pickle.dumps(model))):
            assert again == model
            assert hash(again) == hash(model)
            np.testing.assert_array_equal(again.step(again.rest(), (1e-3, 0.0, 0.3), 1.3, 1e-3)[1], wanted)
        assert model != dataclasses.replace(model, parts=2)
    assert pf.ReducedModel(T, LAW, parts="auto", **SMALL) == pf.ReducedModel(T, LAW, parts=6, **SMALL)


# ---------------------------------------------------------------------- the command line


def test_run_takes_parts(tmp_path):
    arguments = ["run", "in-hand", "--model", "both", "--patch", "Line", "--t-end", "0.3", "--out", str(tmp_path)]
    assert main([*arguments, "--parts", "3"]) == 0
    solution = pf.Solution.load(tmp_path / "in-hand-reduced.nc")
    model = pf.ReducedModel(PUBLISHED_PATCHES["Line"](), LAW, parts=3)
    assert solution.scene.contacts[0].model == model
    wanted = pf.simulate(scenes.in_hand(model, t_end=0.3))
    np.testing.assert_array_equal(solution.histories["y"].values, wanted.histories["y"].values)


def test_run_puts_parts_into_a_scene_file(tmp_path):
    first = scenes.free_slide(pf.ReducedModel(T, LAW, parts=2, segments=12), t_end=0.02)
    first.to_file(tmp_path / "slide.toml")
    for more, parts, segments in ((["--parts", "auto"], 6, 12), (["--patch", "Line"], 2, 24)):
        out = tmp_path / more[1]
        assert main(["run", str(tmp_path / "slide.toml"), *more, "--out", str(out)]) == 0
        (stored,) = out.glob("*.nc")
        model = pf.Solution.load(stored).scene.contacts[0].model
        assert (model.parts, model.segments) == (parts, segments)


@pytest.mark.parametrize("parts", ["six", "0", "-1", "2.5", "", "9" * 5000, "400", "1e3"])
def test_other_parts_are_one_line(capsys, parts):
    assert main(["run", "in-hand", "--model", "reduced", "--parts", parts]) == 2
    error = capsys.readouterr().err.strip()
    assert "\n" not in error
    assert "parts must be" in error


def test_parts_want_a_model_that_has_some(capsys):
    assert main(["run", "drift", "--model", "reduced-published", "--parts", "4"]) == 2
    assert "(reduced)" in capsys.readouterr().err


def test_completion_knows_auto():
    assert [item.value for item in complete_parts(None, None, "a")] == ["auto"]
    assert isinstance(complete_parts(None, None, "")[0], CompletionItem)
    assert complete_parts(None, None, "4") == []


@pytest.mark.parametrize(
    ("make", "units"),
    [(pf.ReducedModel, "m"), (pf.ReducedModelPublished, "m, m, m^2"), (pf.DistributedModel, "m")],
)
def test_recorded_states_have_the_units_of_their_model(make, units):
    data = simulate(scenes.free_slide(make(T, LAW), t_end=0.01), bristles="all").data
    (name,) = [each for each in data if each.startswith("bristles")]
    assert data[name].attrs["units"] == units
