"""Initial states of bristles: under the load of a body that stands still, or as in steady sliding."""

import dataclasses
import functools

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.errors import FileError
from planarfriction.scenes.start import contact_map, first_states
from tests.support.differences import scene_slopes
from tests.support.files import again
from tests.support.refusals import refused

LAW = pf.LuGre(mu_c=0.8, mu_s=1.0, sigma_0=1e5, elasto_plastic=0.9)
COULOMB = pf.LuGre(mu_c=0.5, sigma_0=1e5, sigma_2=0.0, elasto_plastic=0.9)
PATCH = pf.ContactPatch.disc(0.01, cells=7)
SOFT = pf.ContactPatch.rectangle(
    0.02, cells=7, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0)
)
GRAINED = PATCH.with_friction_metric(pf.friction_metric(0.3, 0.7, 1.0))
BRUSHED = PATCH.with_friction_metric(pf.friction_metric(0.3, 0.7, 1.0), (0.2, 0.1))
WEIGHT = 0.2 * 9.81


def model_name(model):
    return f"{type(model).__name__}-{model.state_shape}-{model.patch.name}-{model.law.elasto_plastic is not None}"


PLAIN = dataclasses.replace(LAW, elasto_plastic=None)
MODELS = [
    *(
        kind(PATCH, law)
        for law in (LAW, PLAIN)
        for kind in (pf.DistributedModel, pf.ReducedModel)
    ),
    pf.ReducedModelPublished(PATCH, LAW),
    *(
        kind(SOFT, LAW)
        for kind in (pf.DistributedModel, pf.ReducedModel, pf.ReducedModelPublished)
    ),
    pf.DistributedModel(BRUSHED, LAW),
    pf.ReducedModel(BRUSHED, LAW),
    pf.ReducedModelPublished(GRAINED, LAW, surface=pf.LimitSurfaceEllipsoid(GRAINED)),
]


def held(model, load=6.0, **more):
    """A plate that the grip holds off its centre of mass."""
    scene = pf.scenes.in_hand(
        model, centre_of_mass=(0.015, 0.0), normal_force=load, t_end=0.1
    )
    return dataclasses.replace(scene, **{"start": "equilibrium", **more})


@pytest.mark.parametrize("model", MODELS, ids=model_name)
def test_a_body_in_equilibrium_stays_where_it_is(model):
    """To 1e-12 m, which is 1e-7 of a full deflection; bristles at rest give way by more than 1e-6 m."""
    data = pf.simulate(held(model), t_end=0.05).data
    moved = max(float(abs(data.theta).max()) * 0.01, float(abs(data.y).max()))
    assert moved < 1e-12
    sagged = pf.simulate(held(model, start="rest"), t_end=0.05).data
    assert float(abs(sagged.y).max()) > 1e-6
    wrench = np.array([float(data[name][0, 0]) for name in ("fx", "fy", "tau")])
    assert wrench == pytest.approx([0.0, 0.5 * WEIGHT, 0.5 * WEIGHT * 0.015], abs=1e-12)


def test_contacts_share_the_load_by_their_stiffness():
    """A push along the line between two feet: they take it in proportion to `f_N sigma_0`, the rule that is stated."""
    soft = dataclasses.replace(LAW, sigma_0=0.5e5)
    feet = [
        pf.Contact(
            pf.DistributedModel(PATCH, LAW), 4.0, position=(-0.05, 0.0), name="hard"
        ),
        pf.Contact(
            pf.ReducedModel(PATCH, soft),
            2.0,
            "body",
            position=(0.05, 0.0),
            count=2,
            name="soft",
        ),
    ]
    body = pf.Body(1.0, 1e-3, gravity=(0.0, 0.0))
    scene = pf.Scene(body, feet, 0.02, force=(1.5, 0.0, 0.0), start="equilibrium")
    fx = pf.simulate(scene).data.fx.values
    assert fx[0] == pytest.approx([-1.5 * 4.0 / 6.0, -1.5 * 1.0 / 6.0], rel=1e-9)
    assert fx[-1] == pytest.approx(fx[0], rel=1e-6)


def test_no_bristle_is_bent_further_than_it_can_be():
    """Near the limit the outer cells of the patch are at `mu_s / sigma_0`, the inner ones below, and all balances."""
    scene = held(pf.DistributedModel(PATCH, LAW), load=2.6)
    (state,) = first_states(scene, np.array([2.6]))
    length = np.hypot(*state)
    largest = LAW.mu_s / LAW.sigma_0
    assert length.max() <= largest * (1 + 1e-12)
    assert 0 < np.isclose(length, largest, rtol=1e-9).sum() < len(length)
    wrench = 2 * scene.contacts[0].model.wrench(state, np.zeros(3), 2.6)
    map_ = contact_map(scene, scene.contacts[0])
    assert map_.T @ wrench == pytest.approx([0.0, WEIGHT, 0.0], abs=1e-9)


def test_where_nothing_holds_the_body_one_line_says_so():
    """In translation friction holds `2 mu_s f_N` of the weight: the share in the message is that."""
    scene = pf.scenes.in_hand(
        MODELS[0], centre_of_mass=(0.0, 0.0), normal_force=0.6 * WEIGHT / 2, t_end=0.1
    )
    with refused(r"start must be .*they hold 60 % of the load at most"):
        pf.simulate(dataclasses.replace(scene, start="equilibrium"))
    with refused("do not hold the body"):
        pf.simulate(held(MODELS[0], load=0.0))
    with refused("law that creeps"):
        pf.simulate(held(pf.DistributedModel(PATCH, pf.CoulombStribeck(0.5, 0.5))))


@pytest.mark.parametrize("model", MODELS, ids=model_name)
def test_sliding_bristles_start_in_their_steady_state(model):
    """At a held twist the wrench of the start is that of the end, to the solver's tolerance."""
    scene = pf.scenes.driven(
        model, twist=(0.004, 0.001, 0.3), normal_force=2.0, t_end=0.1
    )
    data = pf.simulate(dataclasses.replace(scene, start="sliding")).data
    for name, scale in (("fx", 2.0), ("fy", 2.0), ("tau", 0.02)):
        assert data[name][0, 0] == pytest.approx(
            float(data[name][-1, 0]), abs=1e-5 * scale
        )
    empty = pf.simulate(scene).data
    assert abs(float(empty.fx[0, 0] - data.fx[0, 0])) > 0.1


def test_a_block_that_slides_goes_as_far_as_friction_lets_it():
    """`v^2 / (2 mu g)`, to a hundredth of a full deflection; the damping of empty bristles would stop it at once."""
    way = {}
    deflection = 0.5 / 1e5
    for start in ("rest", "sliding"):
        scene = pf.scenes.free_slide(
            pf.ReducedModel(PATCH, COULOMB), twist=(0.05, 0.0, 0.0), save_every=1e-4
        )
        data = pf.simulate(
            dataclasses.replace(scene, start=start), t_end=0.02, rtol=1e-8
        ).data
        way[start] = float(data.x.max()) - 0.05**2 / (2 * 0.5 * 9.81)
    assert abs(way["sliding"]) < 0.01 * deflection
    assert abs(way["rest"]) > deflection


def test_files_and_solutions_keep_the_start(tmp_path):
    scene = held(MODELS[0])
    again(scene, tmp_path)
    solution = pf.simulate(scene, t_end=0.02)
    assert (
        pf.Solution.load(solution.save(tmp_path / "run.nc")).scene.start
        == "equilibrium"
    )
    assert "start" not in held(MODELS[0], start="rest").to_dict()
    data = scene.to_dict() | {"start": "slide"}
    with refused("start must be one of rest, equilibrium, sliding", FileError):
        pf.Scene.from_dict(data)


def test_starts_that_make_no_sense_are_refused():
    scene = held(MODELS[0])
    moving = dataclasses.replace(scene.body, velocity=(0.1, 0.0, 0.0))
    with refused("velocity of the body must start at zero"):
        dataclasses.replace(scene, body=moving)
    with refused("not be zero if start is 'sliding'"):
        dataclasses.replace(scene, start="sliding")
    running = dataclasses.replace(scene.contacts[0], support_velocity=(0.1, 0.0, 0.0))
    with refused("support_velocity of contact 'fingers' must start at zero"):
        dataclasses.replace(scene, contacts=[running])
    assert (
        dataclasses.replace(scene, contacts=[running], start="sliding").start
        == "sliding"
    )
    driven = pf.scenes.driven(MODELS[0], t_end=0.1)
    with refused("velocity is prescribed"):
        dataclasses.replace(driven, start="equilibrium")


def held_by_two(change="", by=0.0):
    """A plate in equilibrium on two pads, some of whose cells are bent as far as they can be, that then slips."""
    more = {name: by * (name == change) for name in ("grip", "push", "mass")}
    grip = pf.Signal([0.0, 0.02, 0.06], [2.6 + more["grip"], 1.0, 3.6], "linear")
    pads = [
        pf.Contact(pf.ReducedModel(PATCH, LAW), grip, count=2, name="grip"),
        pf.Contact(
            pf.DistributedModel(PATCH, PLAIN), 0.3, position=(0.05, 0.01), name="other"
        ),
    ]
    body = pf.Body(0.2 * (1.0 + more["mass"]), 4e-4, (0.015, 0.0))
    push = pf.Signal([0.0, 0.06], [[more["push"], 0.0, 0.0], [0.0, 0.0, 0.0]], "linear")
    return pf.Scene(body, pads, 0.06, force=push, save_every=0.06, start="equilibrium")


def test_derivatives_follow_an_equilibrium():
    """Central differences of tight runs, right to 1e-6 of the largest, of a knot at t = 0, a push and the mass."""
    knots = {
        "grip.normal_force": np.array([0.0, 0.02, 0.06]),
        "force": np.array([0.0, 0.06]),
    }
    found = pf.derivatives.scene_sensitivities(
        held_by_two(), ("mass", "inertia"), signals=knots
    )

    for change, name in (
        ("grip", "grip.normal_force[0]"),
        ("push", "force[0].fx"),
        ("mass", "mass"),
    ):
        make = functools.partial(held_by_two, change)
        wanted = scene_slopes(make, 0.0, 1e-5)[0][-1]
        slope = found.d_motion[-1, :, found.names.index(name)]
        assert slope == pytest.approx(wanted, abs=3e-6 * np.abs(wanted).max())


def test_derivatives_to_what_moves_the_start_are_refused():
    scene = held(pf.ReducedModel(PATCH, LAW))
    knots = np.array([0.0, 0.05])
    with refused("start must be 'rest' for the derivative with respect to mu"):
        pf.derivatives.scene_sensitivities(scene, ["mass", "mu"])
    thrown = dataclasses.replace(
        pf.scenes.free_slide(scene.contacts[0].model, twist=(0.1, 0.0, 1.0)),
        start="sliding",
    )
    with refused(r"for the derivative with respect to table.normal_force\[0\]"):
        pf.derivatives.scene_sensitivities(
            thrown, (), signals={"table.normal_force": knots}
        )
    with refused("start must be 'rest' for the derivative with respect to vx"):
        pf.derivatives.scene_gradient(
            scene, lambda time, motion: 0.0 * motion, initial=["vx"]
        )


@pytest.mark.parametrize("load", [5e-324, 1e-310, 1e-300])
def test_loads_too_small_to_divide_by_hold_nothing(load):
    model = pf.ReducedModel(pf.ContactPatch.disc(0.01, cells=5), pf.LuGre())
    scene = pf.scenes.pivot(model, normal_force=load, t_end=0.01)
    with refused("start must be 'rest' or 'sliding' if the contacts do not hold"):
        pf.simulate(scene)
