"""Contacts with an edge: only cells on the body carry load, and the contact ends when none is."""

import dataclasses

import numpy as np
import pytest
import shapely

import planarfriction as pf
from planarfriction._engine.cells.edge_cells import covered_part
from planarfriction._engine.compiler import jit
from planarfriction._engine.compiler.memory import doubles, place_of
from planarfriction.derivatives import scene_sensitivities
from planarfriction.scenes import in_hand
from planarfriction.scenes.files import rectangle_outline
from tests.support.files import again
from tests.support.refusals import refused

MU, LOAD, WIDTH = 0.3, 2.0, 0.02
LAW = pf.LuGre(mu_c=MU, mu_s=MU, sigma_2=0.0)
PLATE = rectangle_outline((0.15, 0.08))


def square(cells):
    return pf.DistributedModel(pf.ContactPatch.rectangle(WIDTH, cells=cells), LAW)


PADS = [square(5), square(11), pf.ReducedModel(pf.ContactPatch.rectangle(WIDTH), LAW)]


def slide(
    model,
    velocity,
    t_end=1.0,
    *,
    position=(0.0, 0.0),
    angle=0.0,
    outline=PLATE,
    pad=None,
    **options,
):
    """Return the scene of a plate that slides past a pad, without gravity."""
    body = pf.Body(0.2, 4.8e-4, position, angle, velocity, (0.0, 0.0), outline)
    return pf.Scene(
        body, [pf.Contact(model, LOAD, edge=True, **(pad or {}))], t_end, **options
    )


def end_of(solution):
    return np.array(
        [
            float(solution.data[name][-1])
            for name in ("x", "y", "theta", "vx", "vy", "omega")
        ]
    )


@jit
def _covered(place, corners, x, y, radius):
    return covered_part(doubles(place), corners, x, y, radius)


@pytest.mark.parametrize("corners", [3, 4, 9])
def test_the_covered_part_of_a_disc_is_that_in_its_polygon(corners):
    random = np.random.default_rng(corners)
    for _ in range(100):
        angles = (
            2.0
            * np.pi
            / corners
            * (np.arange(corners) + random.uniform(0.0, 0.9, corners))
        )
        outline = random.uniform(0.2, 1.5, (corners, 1)) * np.column_stack(
            [np.cos(angles), np.sin(angles)]
        )
        (x, y) = random.uniform(-1.0, 1.0, 2)
        radius = random.uniform(0.05, 1.0)
        # A polygon: its area is right to 1e-7.
        disc = shapely.Point(x, y).buffer(radius, quad_segs=2000)
        part = shapely.intersection(disc, shapely.Polygon(outline))
        share, mx, my = _covered(place_of(outline), corners, x, y, radius)
        assert share == pytest.approx(part.area / disc.area, abs=1e-6)
        if share > 1e-3:
            assert (x + mx, y + my) == pytest.approx(
                (part.centroid.x, part.centroid.y), abs=1e-4
            )


@pytest.mark.parametrize("far", [1e2, 1e6, 1e12])
def test_corners_may_be_far_away(far):
    """A half-plane covers a segment of a disc; a triangle whose far corners lie on its lines covers what it does."""
    for depth in (-0.9e-3, -1e-4, 0.0, 5e-4):
        plane = np.array([(-far, -far), (depth, -far), (depth, far), (-far, far)])
        share, mx, my = _covered(place_of(plane), 4, 0.0, 0.0, 1e-3)
        half = np.arccos(-depth / 1e-3)
        area = half - np.sin(half) * np.cos(half)
        assert share == pytest.approx(area / np.pi, rel=1e-12)
        assert mx == pytest.approx(-2e-3 / 3.0 * np.sin(half) ** 3 / area, rel=1e-10)
        assert abs(my) < 1e-15
    corner = np.array([2e-4, 1e-4])
    along = np.array([[-0.6, -0.8], [-0.8, 0.6]])
    found = [
        _covered(
            place_of(np.vstack([corner, corner + size * along])), 3, 0.0, 0.0, 1e-3
        )
        for size in (0.1, far)
    ]
    assert found[1] == pytest.approx(found[0], rel=1e-10)


@pytest.mark.parametrize(
    ("model", "late"), list(zip(PADS, (3e-4, 1.3e-4, 4e-4), strict=True))
)
def test_a_plate_pulled_off_brakes_with_all_of_the_load_to_the_end(model, late):
    """It leaves when it has moved 50 mm; a cell stands for a disc of its area, which reaches 0.064 cells further."""
    solution = pf.simulate(slide(model, (0.0, -1.0, 0.0), start="sliding"))
    data = solution.data.squeeze("contact")
    way = -float(solution.data.y[-1])
    assert np.abs(data.fy[:-1] - MU * LOAD).max() < 1e-9 and float(data.fy[-1]) == 0.0
    assert (data.normal_force[:-1] == LOAD).all() and float(
        data.normal_force[-1]
    ) == 0.0
    assert 0.05 < way < 0.05 + late
    assert float(data.vy[-1]) ** 2 == pytest.approx(
        1.0 - 2.0 * MU * LOAD / 0.2 * way, rel=1e-4
    )
    assert float(data.ended) == float(data.time[-1])
    assert (solution.status, solution.message) == (
        "left its contacts",
        "the body left its last contact",
    )
    assert (
        f"left its contacts: {len(data.time)} samples to t={float(data.time[-1]):g} s"
        in repr(solution)
    )
    assert f"'contact' ended at t={float(data.ended):.4g} s" in repr(solution)


@pytest.mark.parametrize(
    ("model", "off"), list(zip(PADS, (2.5e-4, 6e-5, 1e-4), strict=True))
)
def test_the_torque_is_that_of_the_covered_part(model, off):
    for edge in np.linspace(-0.009, 0.009, 7):
        middle = [(edge, 0.0), (edge, 0.0)]  # twice, and over the centre of a cell
        outline = [(-0.1, -0.05), (edge, -0.05), *middle, (edge, 0.05), (-0.1, 0.05)]
        body = pf.Body(
            1e3, 1e3, velocity=(0.0, -0.1, 0.0), gravity=(0.0, 0.0), outline=outline
        )
        data = pf.simulate(
            pf.Scene(body, [pf.Contact(model, LOAD, edge=True)], 0.01)
        ).data
        assert np.isfinite(data.tau).all()
        assert float(data.tau[-1, 0] / data.fy[-1, 0]) == pytest.approx(
            0.5 * (edge - 0.5 * WIDTH), abs=off
        )


def test_a_plate_of_any_size_moves_as_a_large_one():
    """Only its near edge is at the pad: the steps and the motion are the same."""
    ends = {}
    for far in (0.1, 1e6):
        outline = [(-far, -0.05), (0.004, -0.05), (0.004, 0.05), (-far, 0.05)]
        solution = pf.simulate(slide(PADS[0], (0.0, -0.1, 1.0), 0.05, outline=outline))
        ends[far] = end_of(solution)
        assert solution.statistics.steps < 500
    assert ends[1e6] == pytest.approx(ends[0.1], rel=1e-7)


def test_half_a_disc_spins_as_a_disc_of_half_the_area_about_its_centroid():
    model = pf.DistributedModel(square(11).patch.discs(1), LAW)
    torque = []
    off = 4.0 * model.patch.radii[0] / (3.0 * np.pi)
    for edge, centre in ((0.1, 0.0), (0.0, -off)):
        outline = [(-0.1, -0.05), (edge, -0.05), (edge, 0.05), (-0.1, 0.05)]
        body = pf.Body(
            1e3, 1e3, velocity=(0.0, -centre, 1.0), gravity=(0.0, 0.0), outline=outline
        )
        data = pf.simulate(
            pf.Scene(body, [pf.Contact(model, LOAD, edge=True)], 1e-3)
        ).data.isel(time=-1, contact=0)
        torque.append(float(data.tau - centre * data.fy))
    assert torque[1] == pytest.approx(np.sqrt(0.5) * torque[0], rel=1e-3)


def test_a_contact_without_load_ends_at_the_same_place():
    """No force jumps there, which would shorten the steps: the end is looked for."""
    pulled = slide(square(5), (0.0, -1.0, 0.0), start="sliding")
    light = dataclasses.replace(
        pulled, contacts=[dataclasses.replace(pulled.contacts[0], normal_force=0.0)]
    )
    data = pf.simulate(light).data
    place = float(pf.simulate(pulled).data.y[-1])
    assert float(data.y[-1]) == pytest.approx(place, abs=2e-6)
    assert (
        float(data.ended[0]) == float(data.time[-1]) == pytest.approx(-place, abs=2e-6)
    )


@pytest.mark.parametrize(
    "velocity", [(0.0, -0.3, 20.0), (0.5, 0.2, -8.0), (0.05, -0.25, 0.0)]
)
def test_no_energy_comes_from_the_edge(velocity):
    place = {
        "position": (0.01, -0.03),
        "angle": 0.3,
        "save_every": 1e-3,
        "stop_speed": 1e-4,
    }
    for model in (square(9), PADS[-1]):
        data = pf.simulate(slide(model, velocity, 0.5, **place)).data
        energy = 0.1 * (data.vx**2 + data.vy**2) + 2.4e-4 * data.omega**2
        # What bristles give back.
        assert (
            float(energy.diff("time").max()) < 0.5 * MU * LOAD * LAW.largest_deflection
        )


def test_the_motion_converges_in_few_steps():
    """With the derivatives by the place; without those of the bristles' rates it takes ten times as many steps."""
    scene = in_hand(
        pf.ReducedModel(pf.ContactPatch.disc(0.01), LAW), normal_force=LOAD, edge=True
    )
    runs = [pf.simulate(scene, rtol=rtol) for rtol in (1e-5, 1e-8)]
    assert np.abs(end_of(runs[0]) - end_of(runs[1]))[:3] == pytest.approx(0.0, abs=2e-6)
    assert float(abs(runs[0].data.ended - runs[1].data.ended)[0]) < 1e-6
    assert runs[0].statistics.steps < 500


def test_a_covered_pad_is_one_without_an_edge():
    model = pf.ReducedModel(pf.ContactPatch.disc(0.01), pf.LuGre(mu_s=1.2))
    plain, edge = (pf.simulate(in_hand(model, edge=edge)) for edge in (False, True))
    assert edge.data.drop_vars("ended").drop_attrs().equals(plain.data.drop_attrs())
    assert (
        np.isnan(edge.data.ended).all()
        and edge.status == "success"
        and "ended at" not in repr(edge)
    )


@pytest.mark.parametrize("patch", [square(7).patch, square(7).patch.discs(12)])
def test_it_is_the_same_in_all_frames_and_for_a_friction_metric_of_ones(patch):
    turn = 0.7
    place = np.array([0.01, -0.035])
    velocity = np.array([0.1, -0.3])
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    plain = slide(
        pf.DistributedModel(patch, LAW), (*velocity, 9.0), 0.05, position=place
    )
    # Of ones it is none.
    metric = patch.with_friction_metric(np.diag([1.0, 1.0 + 1e-12]))
    turned = {
        "position": rotation @ place + 0.3,
        "angle": turn,
        "pad": {"position": (0.3, 0.3), "angle": turn},
    }
    turned = slide(
        pf.DistributedModel(metric, LAW),
        (*rotation @ velocity, 9.0),
        0.05,
        outline=PLATE[::-1],
        **turned,
    )
    end, expected = (end_of(pf.simulate(each, rtol=1e-8)) for each in (turned, plain))
    back = np.concatenate(
        [(end[:2] - 0.3) @ rotation, [end[2] - turn], end[3:5] @ rotation, end[5:]]
    )
    assert back == pytest.approx(expected, abs=1e-6)


def test_a_pad_that_moves_off_is_a_plate_that_moves_off():
    pulled = pf.simulate(
        slide(PADS[-1], (0.0, -0.5, 2.0), position=(0.005, -0.04)), rtol=1e-7
    )
    moves = slide(
        PADS[-1],
        (0.0, 0.0, 2.0),
        position=(0.005, -0.04),
        pad={"support_velocity": (0.0, 0.5, 0.0)},
    )
    moved = pf.simulate(moves, rtol=1e-7)
    assert moved.status == pulled.status == "left its contacts"
    assert float(moved.data.ended[0]) == pytest.approx(
        float(pulled.data.ended[0]), abs=1e-6
    )
    assert end_of(moved)[[0, 2, 3, 5]] == pytest.approx(
        end_of(pulled)[[0, 2, 3, 5]], abs=1e-6
    )


def test_a_contact_that_ends_may_begin_again_while_another_holds_on():
    swings = pf.Spring(40.0, anchor=(0.0, -0.03))
    body = pf.Body(0.2, 1.0, gravity=(0.0, 0.0), outline=PLATE)
    weak, far = (
        dataclasses.replace(PADS[-1], law=dataclasses.replace(LAW, mu_c=mu, mu_s=mu))
        for mu in (0.05, 0.01)
    )
    pads = [
        pf.Contact(weak, LOAD, edge=True, name="upper"),
        pf.Contact(far, 0.5, position=(0.0, -0.05), name="lower"),
    ]
    scene = pf.Scene(body, pads, 0.5, springs=swings, save_every=2e-3)
    swinging = pf.simulate(scene)
    load = swinging.data.normal_force.sel(contact="upper")
    y = swinging.data.y
    assert swinging.status == "success" and np.isnan(swinging.data.ended).all()
    assert (load.where(y > -0.0499, LOAD) == LOAD).all() and (
        load.where(y < -0.0505, 0.0) == 0.0
    ).all()
    assert int((load == 0.0).sum()) > 5
    away = pf.simulate(scene, t_end=float(y.time[int(np.argmin(y.values))]))
    assert "'upper' ended at t=" in repr(away) and "'lower' ended" not in repr(away)
    assert (
        pf.simulate(dataclasses.replace(scene, contacts=pads[:1])).status
        == "left its contacts"
    )


def test_files_know_an_edge_and_scenes_without_one_stay_as_they_were(tmp_path):
    scene = slide(PADS[-1], (0.0, -1.0, 0.0))
    assert again(scene, tmp_path).contacts[0].edge
    solution = pf.simulate(scene)
    solution.save(tmp_path / "run.nc")
    assert repr(pf.Solution.load(tmp_path / "run.nc")) == repr(solution)
    assert "edge" not in in_hand(PADS[-1]).to_json()


def test_what_an_edge_cannot_have_is_refused():
    scene = slide(PADS[-1], (0.0, -1.0, 0.0))
    (pad,) = scene.contacts
    still = dataclasses.replace(scene.body, velocity=(0.0, 0.0, 0.0))
    published = pf.ReducedModelPublished(pf.ContactPatch.disc(0.01), LAW)
    with refused("edge of contact 'contact' must be False on the body: only a pad"):
        dataclasses.replace(pad, mounted_on="body")
    with refused("edge of contact 'contact' must be True or False, got 'yes'"):
        dataclasses.replace(pad, edge="yes")
    with refused("must have bristles on cells where the body has an edge"):
        dataclasses.replace(pad, model=published)
    for changes in (
        {"body": dataclasses.replace(scene.body, outline=None)},
        {"velocity": (0.0, 0.1, 0.0)},
    ):
        with refused("must be False unless the body moves freely and has an outline"):
            dataclasses.replace(scene, **changes)
    with refused("start must be 'rest' or 'sliding' if a contact has an edge"):
        dataclasses.replace(scene, body=still, start="equilibrium")
    with refused("edge of contact 'contact' must be False for derivatives of scenes"):
        scene_sensitivities(scene, ["mu"])
    with refused("outline must enclose an area where a contact has an edge"):
        pf.simulate(
            dataclasses.replace(
                scene, body=dataclasses.replace(still, outline=np.ones((3, 2)))
            )
        )
    fixed = dataclasses.replace(PADS[-1], pad=pf.Pad.at_load(1.0))
    with refused("pad must be None for an edge"):
        pf.simulate(
            dataclasses.replace(scene, contacts=[dataclasses.replace(pad, model=fixed)])
        )


@pytest.mark.parametrize("model", PADS[1:])
def test_a_pad_over_an_edge_does_not_see_where_its_frame_is(model):
    """The same pad, drawn beside its origin, ends where the other one does."""
    x = 0.03
    y = -0.02
    patch = model.patch
    beside = type(model)(
        pf.ContactPatch.polygon(
            [(x + i * WIDTH / 2, y + j * WIDTH / 2) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))],
            cells=round(patch.cells**0.5),
        ),
        LAW,
    )  # fmt: skip
    ends = [
        end_of(pf.simulate(slide(each, (0.1, -1.0, 2.0), pad=pad)))
        for each, pad in ((model, {}), (beside, {"position": (-x, -y)}))
    ]
    np.testing.assert_allclose(ends[1], ends[0], rtol=1e-4, atol=1e-7)
