"""When contacts slip, against closed forms and against what the scene does to them."""

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.errors import FileError
from planarfriction.scenes.slip import _stretches, centres, reach, slip_shares
from tests.support.half_space_slip import SlippingHalfSpace
from tests.support.refusals import refused

PATCH = pf.ContactPatch.disc(0.01, cells=7)
LAW = pf.LuGre(mu_c=0.5, sigma_0=1e5, sigma_1=300.0, sigma_2=0.0, elasto_plastic=0.9)
SOFT = pf.ContactPatch.rectangle(
    0.02, cells=7, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0)
)
MODELS = [
    pf.DistributedModel(PATCH, LAW),
    pf.ReducedModel(PATCH, LAW, cells=16),
    pf.ReducedModelPublished(PATCH, LAW),
    pf.DistributedModel(SOFT, LAW),
    pf.ReducedModelPublished(SOFT, LAW),
]
G = 9.81


@pytest.mark.parametrize(
    "model", MODELS, ids=lambda m: f"{type(m).__name__}-{m.state_shape}-{m.patch.name}"
)
def test_a_block_slips_until_it_stops(model):
    """From 0 to v/(mu g) over v^2/(2 mu g): to a recording interval, and to a full deflection of 5 um."""
    scene = pf.scenes.free_slide(
        model, mass=0.5, twist=(0.1, 0.0, 0.0), save_every=1e-4, t_end=0.03
    )
    scene = dataclasses.replace(scene, start="sliding", stop_speed=None)
    (event,) = pf.simulate(scene, bristles="all").slip_events()
    assert (event.contact, event.onset) == ("table", 0.0)
    assert event.end == pytest.approx(0.1 / (0.5 * G), abs=2e-4)
    assert event.path == pytest.approx(0.1**2 / (2 * 0.5 * G), abs=5e-6)
    assert event.angle == pytest.approx(0.0, abs=1e-12)


def test_each_push_beyond_friction_is_one_slip_and_one_below_is_none():
    force = pf.Signal(
        [0.0, 0.02, 0.05, 0.07, 0.1],
        np.outer([0.3, 1.2, 0.3, 1.2, 0.3], [0.5 * G, 0.0, 0.0]),
    )
    body = pf.Body(1.0, 1e-3, gravity=(0.0, 0.0))
    table = pf.Contact(MODELS[0], G, name="table")
    scene = pf.Scene(
        body, [table], 0.2, force=force, save_every=5e-4, start="equilibrium"
    )
    events = pf.simulate(scene, bristles="all").slip_events()
    assert len(events) == 2
    for event, begin, end in zip(events, (0.02, 0.07), (0.05, 0.1), strict=True):
        # After a few milliseconds the bristles are full.
        assert begin < event.onset < begin + 0.005
        # 0.2 mu g for 30 ms less those, and then stopped by 0.7 mu g
        assert end < event.end < end + 0.03 * 0.2 / 0.7 + 1e-3
    shaken = dataclasses.replace(
        scene,
        force=pf.Signal([0.0, 0.02, 0.05], np.outer([0.3, 0.85, 0.3], [0.5 * G, 0, 0])),
    )
    assert pf.simulate(shaken, bristles="all").slip_events() == ()


def test_bristles_that_give_way_are_no_slip():
    """Plain LuGre at 0.7 of what friction holds: most of each small motion is lost, but none goes a full deflection."""
    force = pf.Signal([0.0, 0.02, 0.05], np.outer([0.7, 0.8, 0.7], [0.5 * G, 0.0, 0.0]))
    plain = dataclasses.replace(LAW, elasto_plastic=None)
    table = pf.Contact(pf.ReducedModel(PATCH, plain), G, name="table")
    body = pf.Body(1.0, 1e-3, gravity=(0.0, 0.0))
    scene = pf.Scene(
        body, [table], 0.1, force=force, save_every=5e-4, start="equilibrium"
    )
    assert pf.simulate(scene, bristles="all").slip_events() == ()


def test_slow_is_not_stuck():
    """A contact that is dragged at a hundredth of v_s slips from its first full deflection on."""
    speed = 1e-5
    scene = pf.scenes.driven(
        pf.ReducedModel(PATCH, LAW), twist=(speed, 0.0, 0.0), t_end=3.0
    )
    (event,) = pf.simulate(scene, bristles="all").slip_events()
    full = 0.5 / 1e5 / speed
    assert 0.9 * full < event.onset < full * 1.1
    assert event.end == 3.0
    assert event.path == pytest.approx(speed * (3.0 - event.onset), rel=1e-6)


def test_the_path_of_a_slip_is_that_of_the_centre_of_pressure():
    """A patch whose load lies beside the origin of its frame, about which it turns while it slides along y."""
    patch = pf.ContactPatch.from_pressure([[1.0, 0.0, 5.0], [1.0, 0.0, 0.0]], 4e-3)
    twist = (0.0, 0.01, -2.0)
    (x, y) = patch.centre_of_pressure()
    scene = pf.scenes.driven(
        pf.DistributedModel(patch, LAW), twist=twist, at="origin", t_end=0.5
    )
    (event,) = pf.simulate(scene, bristles="all", save_every=1e-3).slip_events()
    lasts = event.end - event.onset
    assert event.end == 0.5 and event.onset < 0.002
    assert event.path == pytest.approx(
        np.hypot(2.0 * y, 0.01 - 2.0 * x) * lasts, rel=1e-3
    )
    assert event.angle == pytest.approx(-2.0 * lasts, rel=1e-3)
    assert reach(patch) == pytest.approx(
        np.hypot(4e-3 + 4e-3 / 3, 2e-3 - 2e-3 / 3), rel=1e-9
    )


def test_the_share_that_slips_counts_loads():
    """Plain bristles without a damper: one cell at full deflection, of a load of 1 or 3 of 4, and one unbent."""
    law = pf.LuGre(mu_c=0.5, mu_s=0.5, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0)
    model = pf.DistributedModel(pf.ContactPatch.from_pressure([[1.0, 3.0]], 4e-3), law)
    twist = np.array([[0.01, 0.0, 0.0]] * 4)
    full = 0.5 / 1e5
    states = np.zeros((4, 2, 2))
    states[0, 0, 0] = full
    states[1, 0, 1] = full
    states[2, 0] = full
    loads = np.array([2.0, 2.0, 2.0, 0.0])
    share, slipping = slip_shares(model, states, twist, loads)
    assert share == pytest.approx(np.sqrt([0.25, 0.75, 1.0, 1.0]), rel=1e-9)
    assert slipping == pytest.approx([0.25, 0.75, 1.0, 1.0], rel=1e-12)
    for each in slip_shares(model, states, 0.0 * twist, np.ones(4)):
        assert each == pytest.approx(np.zeros(4))


def fingertip(cells):
    """A circle under the pressure of Hertz, p_0 (1 - r^2)^(1/2)."""

    def pressure(x, y):
        return np.maximum(1.0 - (x * x + y * y) / RADIUS**2, 0.0) ** 0.5

    return pf.ContactPatch.disc(RADIUS, cells, pressure=pressure)


RADIUS = 0.01
SHARP = pf.LuGre(mu_c=0.8, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.99)
LAYER = pf.Pad.layer(shear_modulus=0.2e6, thickness=3e-3)


def dragged(model, full):
    """The event of a contact under 3 N that is dragged by 1.3 `full` [m], its times as shares of that."""
    speed = 1e-3
    scene = pf.scenes.driven(
        model, twist=(speed, 0.0, 0.0), normal_force=3.0, t_end=1.3 * full / speed
    )
    run = pf.simulate(scene, bristles="all", save_every=full / speed / 200)
    (event,) = run.slip_events()
    return event.incipient * speed / full, event.onset * speed / full


def test_a_pad_slips_partly_before_it_slips_as_a_whole():
    """A layer under Hertz pressure slips outside the radius c at the displacement `d/d_1 = (1 - c^2)^(1/2)`.

    That ring has the share `(1 - c^2)^(3/2)` of the load, so that a tenth and nine tenths slip at the cube roots of
    these. Cells of the grid and bristles that yield from 0.99 of their limit on blur that.
    """
    full = 0.8 * 1.5 * 3.0 / (np.pi * RADIUS**2) / (0.2e6 / 3e-3)
    model = pf.DistributedModel(fingertip(41), SHARP, pad=LAYER)
    incipient, onset = dragged(model, full)
    assert incipient == pytest.approx(0.1 ** (1 / 3), abs=0.02)
    assert onset == pytest.approx(0.9 ** (1 / 3), abs=0.02)


def test_incipient_slip_of_few_discs_is_coarse_and_early():
    """Each disc of the rim has more than a twentieth of the load: all slips when it does."""
    full = 0.8 * 1.5 * 3.0 / (np.pi * RADIUS**2) / (0.2e6 / 3e-3)
    incipient, onset = dragged(pf.ReducedModel(fingertip(21), SHARP, pad=LAYER), full)
    assert 0.25 < incipient < 0.1 ** (1 / 3) + 0.05
    assert onset == pytest.approx(0.9 ** (1 / 3), abs=0.06)


def test_slip_of_a_half_space_begins_and_ends_as_that_of_cattaneo():
    """A ring outside c slips at `c = (1 - Q/(mu f_N))^(1/3)`, with the share `(1 - c^2)^(3/2)` of the load.

    The pieces of the pad slip outside c at `Q/(mu f_N) = 3 u^2 - 2 u^3` with `u = (1 - c^2)^(1/2)`, later.
    """
    modulus, ratio, load = 0.2e6, 0.49, 3.0
    full = 3.0 * (2.0 - ratio) * 0.8 * load / (16.0 * modulus * RADIUS)
    pad = pf.Pad.half_space(modulus, ratio)
    model = pf.DistributedModel(fingertip(31), SHARP, pad=pad)
    forces = 1.0 - (1.0 - np.array(dragged(model, full))) ** 1.5
    exact = 1.0 - (1.0 - np.array([0.1, 0.9]) ** (2.0 / 3.0)) ** 1.5
    assert exact == pytest.approx([0.305, 0.982], abs=1e-3)
    assert forces == pytest.approx(exact, abs=0.025)


PRESSURES = {
    "circle": lambda x, y: np.maximum(1.0 - x * x - y * y, 0.0) ** 0.5,
    "even circle": lambda x, y: 1.0 * (x * x + y * y < 1.0),
    "square": lambda x, y: (1.0 - x * x) * (1.0 - y * y),
    "even square": lambda x, y: np.ones(x.shape),
}


@pytest.mark.parametrize("axis", [0, 2], ids=["shift", "rotation"])
@pytest.mark.parametrize("pressure", PRESSURES.values(), ids=PRESSURES)
def test_incipient_slip_of_a_half_space_is_that_of_a_boundary_element_method(
    pressure, axis
):
    modulus, ratio, load = 0.2e6, 0.45, 3.0
    x, y = np.meshgrid(*[np.linspace(-0.96, 0.96, 25)] * 2)
    patch = pf.ContactPatch.from_pressure(pressure(x, y), width=2.0 * RADIUS)
    sides = patch.cell_extents()[0]
    exact = SlippingHalfSpace(patch.positions, sides, modulus, ratio)
    limits = 0.8 * load * patch.weights()

    most = 3.0 * 0.8 * load / (modulus * RADIUS) / RADIUS ** (axis / 2)
    shares, wrenches = [], []
    for size in np.linspace(0.005, 0.04, 8) * most:
        q = exact.tractions(size * np.eye(3)[axis], limits)
        slips = np.hypot(*q.T) * exact.area > 0.999 * limits
        shares.append(patch.weights() @ slips)
        wrenches.append(exact.wrench(q)[axis])
    wrench = np.interp(0.1, shares, wrenches)
    model = pf.DistributedModel(patch, SHARP, pad=pf.Pad.half_space(modulus, ratio))
    twist = most * np.eye(3)[axis]
    scene = pf.scenes.driven(model, twist=twist, normal_force=load, t_end=1.0)
    run = pf.simulate(scene, bristles="all", save_every=5e-4)
    found = np.interp(
        run.slip_events()[0].incipient,
        run.data.time,
        -run.data["fx" if axis == 0 else "tau"][:, 0],
    )
    whole = limits @ np.hypot(*patch.positions.T) ** (axis / 2)
    assert found / whole == pytest.approx(wrench / whole, abs=0.055)


@pytest.mark.parametrize("model", MODELS[:3], ids=lambda m: type(m).__name__)
def test_without_a_pad_all_cells_of_a_shift_slip_together(model):
    """Bristles of the law reach their limit at one displacement, mu_c/sigma_0."""
    speed, full = 1e-4, 0.5 / 1e5
    scene = pf.scenes.driven(model, twist=(speed, 0.0, 0.0), t_end=10 * full / speed)
    run = pf.simulate(scene, bristles="all", save_every=full / speed / 20)
    (event,) = run.slip_events()
    assert event.incipient == pytest.approx(event.onset, abs=0.1 * full / speed)


def test_centres_follow_the_load_and_stay_where_there_is_none():
    maps = pf.PressureMaps([1.0, 3.0], [[1.0, 1.0, 0.0], [0.0, 1.0, 1.0]])
    patch = pf.ContactPatch.rectangle(0.03, 0.01, cells=3, pressure=maps)
    found = centres(patch, np.array([0.0, 1.0, 2.0]))
    for place, load in zip(found[1:], (1.0, 2.0), strict=True):
        assert place == pytest.approx(patch.centre_of_pressure(load))
    assert found[0] == pytest.approx(found[2])


def test_what_slip_events_need_is_said_in_one_line(tmp_path):
    solution = pf.simulate(pf.scenes.driven(MODELS[0], t_end=0.02))
    with refused("bristles must be recorded for slip events"):
        solution.slip_events()
    with refused("no scene", FileError):
        dataclasses.replace(solution, scene=None).slip_events()


def test_a_slip_begins_where_the_line_between_two_samples_crosses_zero():
    time = np.array([0.0, 1.0, 3.0, 4.0, 5.0])
    above = np.array([-1.0, 3.0, -1.0, -1.0, 1.0])
    assert _stretches(time, above) == [(0.25, 2.5), (4.5, 5.0)]
    assert _stretches(time, -above) == [(0.0, 0.25), (2.5, 4.5)]
