"""Pressure maps measured at several loads."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction.errors import FrictionError
from planarfriction.patch import shared
from tests.support.refusals import refused

LIGHT = np.array([[0.0, 2.0, 0.0], [0.0, 4.0, 2.0]])
HEAVY = np.array([[30.0, 10.0, 0.0], [0.0, 20.0, 40.0]])
LOADS = [2.0, 6.0]


def both():
    return pf.ContactPatch.from_pressure([LIGHT, HEAVY], 0.001, loads=LOADS)


def test_between_two_loads_shares_are_linear_and_beyond_them_they_stay():
    patch = both()
    light, heavy = (
        values.ravel()[[0, 1, 4, 5]] / values.sum() for values in (LIGHT, HEAVY)
    )
    assert patch.cells == 4 and patch.depends_on_load
    for load, weights in (
        (2.0, light),
        (0.1, light),
        (6.0, heavy),
        (99.0, heavy),
        (3.0, 0.75 * light + 0.25 * heavy),
    ):
        np.testing.assert_allclose(patch.weights(load), weights, rtol=1e-14, atol=1e-17)
    np.testing.assert_array_equal(patch.weights([0.0, 3.0])[1], patch.weights(3.0))
    assert not patch.weights(0.0).any()


@settings(deadline=None, max_examples=25)
@given(st.floats(0.01, 100.0), st.floats(1e-300, 1e300))
def test_only_ratios_matter(load, scale):
    one, other = (
        pf.ContactPatch.from_pressure([scale * LIGHT, HEAVY], 0.001, loads=LOADS)
        for scale in (1.0, scale)
    )
    np.testing.assert_allclose(
        one.weights(load), other.weights(load), rtol=1e-12, atol=1e-17
    )


def test_mappings_stacks_and_files_give_the_same_patch(tmp_path):
    np.save(tmp_path / "light.npy", LIGHT)
    np.savetxt(tmp_path / "heavy.csv", HEAVY, delimiter=",")
    files = [tmp_path / "light.npy", str(tmp_path / "heavy.csv")]
    patches = [
        both(),
        pf.ContactPatch.from_pressure(
            np.array([LIGHT, HEAVY]), 0.001, loads=np.array(LOADS)
        ),
        pf.ContactPatch.from_pressure({6.0: HEAVY, 2.0: LIGHT}, 0.001),
        pf.ContactPatch.from_pressure(dict(zip(LOADS, files, strict=True)), 0.001),
        pf.ContactPatch.from_pressure(files, 0.001, loads=LOADS),
        pf.ContactPatch.from_dict(both().to_dict()),
    ]
    for patch in patches[1:]:
        np.testing.assert_array_equal(patch.weights(3.3), patches[0].weights(3.3))
    assert patches[3].name == "light"


def test_finer_cells_carry_what_their_cell_carried():
    fine = both().refined(3)
    np.testing.assert_allclose(
        fine.weights(3.0).reshape(-1, 9).sum(axis=1), both().weights(3.0), rtol=1e-13
    )
    np.testing.assert_allclose(
        fine.centre_of_pressure(3.0), both().centre_of_pressure(3.0), atol=1e-17
    )


def test_one_map_does_not_depend_on_the_load():
    patch = pf.ContactPatch.from_pressure([HEAVY], 0.001, loads=[3.0])
    assert not patch.depends_on_load
    np.testing.assert_allclose(
        patch.weights(),
        pf.ContactPatch.from_pressure(HEAVY, 0.001).weights(),
        rtol=1e-15,
    )


def test_every_model_and_surface_follows_the_maps():
    patch = both()
    twist = (0.0, 0.0, 2.0)
    law = pf.LuGre(mu_c=1.0, mu_s=1.0, sigma_2=0.0)
    for load in (2.0, 3.7, 8.0):
        fixed = pf.ContactPatch(
            patch.positions, patch.areas, patch.weights(load), patch.grid
        )
        for kind in (pf.DistributedModel, pf.ReducedModel):
            ours, theirs = (
                kind(p, law).step(kind(p, law).rest(), twist, load, 10.0)[1]
                for p in (patch, fixed)
            )
            np.testing.assert_allclose(ours, theirs, rtol=5e-3, atol=1e-5 * load)
        for surface in (pf.LimitSurfaceCells, pf.LimitSurfaceExact):
            np.testing.assert_allclose(
                surface(patch, normal_force=load).wrench(twist),
                surface(fixed).wrench(twist),
                rtol=1e-12,
                atol=1e-15,
            )


def test_scene_files(tmp_path):
    np.save(tmp_path / "light.npy", LIGHT)
    np.save(tmp_path / "heavy.npy", HEAVY)
    model = pf.DistributedModel(both(), pf.LuGre(mu_s=1.2))
    pf.scenes.in_hand(model).to_file(tmp_path / "written.toml")
    again = pf.Scene.from_file(tmp_path / "written.toml").contacts[0].model.patch
    np.testing.assert_array_equal(again.weights(3.0), both().weights(3.0))
    for source in (
        'files = ["light.npy", "heavy.npy"]',
        f"values = {[LIGHT.tolist(), HEAVY.tolist()]}",
    ):
        patch = f'[contact.patch]\nshape = "pressure-map"\ncell_size = 0.001\nloads = [2.0, 6.0]\n{source}\n'
        (tmp_path / "own.toml").write_text(
            f"t_end = 1.0\n[body]\nmass = 1.0\ninertia = 1.0\n[contact]\nnormal_force = 3.0\n{patch}[contact.law]\n"
        )
        own = pf.Scene.from_file(tmp_path / "own.toml").contacts[0].model.patch
        np.testing.assert_array_equal(own.weights(3.0), both().weights(3.0))
    (tmp_path / "own.toml").write_text(
        (tmp_path / "own.toml").read_text().replace("values", "files")
    )
    with refused(r"own\.toml", FrictionError):
        pf.Scene.from_file(tmp_path / "own.toml")


@pytest.mark.parametrize(
    ("maps", "loads", "message"),
    [
        ([LIGHT, HEAVY], [6.0, 2.0], "loads must be increasing and > 0"),
        ([LIGHT, HEAVY], [0.0, 2.0], "loads must be increasing and > 0"),
        ([LIGHT, HEAVY], [2.0, 2.0], "loads must be increasing and > 0"),
        (
            [LIGHT, HEAVY],
            [2.0],
            "pressure must have one map for each of 1 loads, got 2",
        ),
        (
            "light.npy",
            [2.0, 6.0],
            "pressure must have one map for each of 2 loads, got 1",
        ),
        (
            [LIGHT, HEAVY[:1]],
            LOADS,
            r"pressure must have the shape of the first, \[2, 3\]",
        ),
        ([LIGHT, -HEAVY], LOADS, "pressure must be >= 0"),
        (
            [LIGHT, 0.0 * HEAVY],
            LOADS,
            "pressure values must have a total > 0 at every load, got 0 at 6 N",
        ),
        ({2.0: LIGHT}, LOADS, "loads must be left out"),
        ({"two": LIGHT}, None, "load of a pressure map must be"),
        ({-1.0: LIGHT}, None, "load of a pressure map must be > 0"),
        ([], [], "loads must be increasing and > 0"),
    ],
)
def test_broken_maps(maps, loads, message):
    with refused(message):
        pf.ContactPatch.from_pressure(maps, 0.001, loads=loads)


def test_maps_for_other_cells_are_refused():
    with refused(r"pressure must have shape \[L, 9\]"):
        pf.ContactPatch.rectangle(
            0.01, cells=3, pressure=pf.PressureMaps([1.0, 2.0], [[1, 2], [3, 4]])
        )


def test_weights_over_all_loads_count_as_the_radius_of_gyration(monkeypatch):
    patch = both()
    monkeypatch.setattr(shared, "loads_of_change", lambda patch: np.array(LOADS))
    sizes = np.sqrt([patch.second_moment(load) for load in LOADS])
    expected = (
        sizes[0] * patch.weights(LOADS[0]) + sizes[1] * patch.weights(LOADS[1])
    ) / sizes.sum()
    np.testing.assert_allclose(shared.mean_weights(patch), expected, rtol=1e-12)
