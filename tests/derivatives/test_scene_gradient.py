"""Derivatives of scenes to the knots of their signals and to their start, forwards and in reverse."""

import dataclasses
import functools

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.derivatives import path, scene_gradient, scene_sensitivities
from planarfriction.scenes import SolverOptions, packing
from tests.derivatives.test_scene import LAW, model_of, slide
from tests.support.differences import MOTION, assert_sensitivities
from tests.support.refusals import refused

KNOTS = np.array([0.0, 0.05, 0.15, 0.3, 0.34])
SIGNALS = {"own.normal_force": KNOTS, "force": KNOTS}
START = {"vx": 1e-5, "omega": 1e-4, "x": 1e-6, "theta": 1e-4}
"""Components of the start, and steps for differences."""


@functools.cache
def pushed(kind):
    """The plate that slides, stops and is pushed off again, its load never zero: it may go down as well as up."""
    scene = slide(kind)
    load = pf.Signal([0.0, 0.2, 0.3, 0.36], [3.0, 2.0, 1.0, 2.5], "linear")
    own = dataclasses.replace(scene.contacts[0], normal_force=load)
    return dataclasses.replace(scene, contacts=[own, scene.contacts[1]])


def with_more(signal, values):
    """A signal plus values at the knots, joined as its own are."""
    times = np.union1d(signal.times, KNOTS)
    more = pf.Signal(KNOTS, values, signal.hold)
    return pf.Signal(times, signal(times) + more(times), signal.hold)


def changed(scene, name, k, component, change):
    """The scene with one knot, or one component of the start, changed."""
    body = scene.body
    if name in START:
        start = np.array([*body.velocity, *body.position, body.angle])
        start[MOTION.index(name)] += change
        moved = dataclasses.replace(
            body, velocity=start[:3], position=start[3:5], angle=start[5]
        )
        return dataclasses.replace(scene, body=moved)
    values = np.zeros((len(KNOTS), 3))
    values[k, component] = change
    if name == "force":
        return dataclasses.replace(scene, force=with_more(scene.force, values))
    own = dataclasses.replace(
        scene.contacts[0],
        normal_force=with_more(scene.contacts[0].normal_force, values[:, 0]),
    )
    return dataclasses.replace(scene, contacts=[own, scene.contacts[1]])


@pytest.mark.parametrize(
    "kind",
    [
        "distributed",
        "ellipsoid",
        "reduced",
        pytest.param("fixed reduced", marks=pytest.mark.slow),
    ],
)
def test_derivatives_to_knots_and_start_are_differences(kind):
    """Differences of order 4 of tight simulations; both sides are right to a few 1e-7 of the largest value.

    Rounding decides which steps derivatives take: of bodies whose masses differ by 1e-13, the slope of the angle by a
    force, which is small, is 2e-6 to 1.2e-5 off.
    Bristles of a fixed stiffness that a falling load brings back are stiffer: forces by a torque differ more.
    """
    scene = pushed(kind)
    found = scene_sensitivities(scene, (), signals=SIGNALS, initial=list(START))
    numbers = [(name, 0, 0, h) for name, h in START.items()]
    numbers += [("own.normal_force", k, 0, 2e-4) for k in (1, 3)]
    numbers += [("force", 2, 1, 1e-4), ("force", 3, 2, 1e-6)]
    most = 5e-5 if "fixed" in kind else 3e-5 if kind == "reduced" else 1e-5
    for name, k, component, h in numbers:
        p = found.columns[name].start + (3 * k + component if name == "force" else k)
        make = functools.partial(changed, scene, name, k, component)
        assert_sensitivities(found, p, make, 0.0, h, most)


def test_a_sliding_block_loses_speed_to_each_knot_of_its_load():
    """`v(T) = v_0 - mu int N dt/m`: a knot's share of the integral is that of its hat, and the start's is whole."""
    law = dataclasses.replace(LAW, mu_s=LAW.mu_c, sigma_2=0.0, sigma_1=1.0)
    model = pf.DistributedModel(pf.ContactPatch.disc(0.01, cells=5), law)
    body = pf.Body(0.5, 1e-3, velocity=(0.6, 0.0, 0.0), gravity=(0.0, 0.0))
    load = pf.Signal([0.0, 0.04, 0.1], [5.0, 4.0, 6.0], "linear")
    contact = pf.Contact(model, load, mounted_on="body")
    scene = pf.Scene(body, [contact], 0.1, save_every=0.05)
    found = scene_sensitivities(
        scene, (), signals={"contact.normal_force": load.times}, initial=["vx"]
    )
    areas = np.array([0.02, 0.05, 0.03])
    # 1e-5 of the velocity is lost while the bristles deflect
    assert found.d_motion[-1, 0] == pytest.approx(
        [1.0, *(-LAW.mu_c / 0.5 * areas)], abs=1e-4
    )
    assert found.names == ("vx", *(f"contact.normal_force[{k}]" for k in range(3)))


def agree(scene, numbers, of_motion, of_wrenches):
    """The reverse against the product with the derivatives forwards, for costs with random slopes.

    Errors are shares of the sum of sizes: of terms of random signs little may be left.
    """
    forwards = scene_sensitivities(scene, **numbers)
    rng = np.random.default_rng(1)
    motion = rng.normal(size=forwards.motion.shape) / np.maximum(
        np.abs(forwards.motion).max(axis=0), 1e-9
    )
    wrenches = rng.normal(size=forwards.wrenches.shape) / np.abs(forwards.wrenches).max(
        axis=(0, 1)
    )
    for slope, wrench_cotangent, allowed in (
        (lambda time, motion_: motion, None, of_motion),
        (None, lambda time, wrenches_: wrenches, of_wrenches),
    ):
        reverse = scene_gradient(
            scene, slope, wrench_cotangent=wrench_cotangent, **numbers
        )
        assert reverse.names == forwards.names
        assert reverse.motion == pytest.approx(forwards.motion, abs=1e-12)
        assert reverse.wrenches == pytest.approx(forwards.wrenches, abs=1e-9)
        of = "mi,mip->p", motion, forwards.d_motion
        if slope is None:
            of = "mci,mcip->p", wrenches, forwards.d_wrenches
        expected = np.einsum(*of)
        sizes = np.einsum(of[0], np.abs(of[1]), np.abs(of[2]))
        for name, here in reverse.columns.items():
            error = (
                np.abs(reverse.gradient[here] - expected[here]).max()
                / sizes[here].max()
            )
            assert error < allowed, (name, slope is None, error)


@pytest.mark.parametrize(
    "kind", ["ellipsoid", "reduced", "fixed reduced", "distributed"]
)
def test_the_reverse_is_the_product_with_the_derivatives_forwards(kind):
    """Two methods of order 4 with steps of their own; through a lost load, stops and a new slip.

    Each is right to a few 1e-7 of the motion; on a pad, whose damping has kinks, to a few 1e-6. Wrenches follow stiff
    bristles: of the ellipsoid 7e-6 to 4e-5 were seen, in programs that differ in last bits, and so in the steps that
    they take.
    """
    numbers = {
        "signals": SIGNALS | {"fixed.normal_force": KNOTS},
        "initial": list(START),
    }
    agree(
        slide(kind),
        numbers | {"parameters": ("mu", "r", "mass", "inertia", "load")},
        1e-5 if kind == "fixed reduced" else 2e-6,
        1e-4,
    )


def test_the_reverse_takes_many_contacts_of_many_cells():
    """Five contacts of 69 cells, 690 bristle states, which dense matrices would not."""
    model = pf.DistributedModel(pf.ContactPatch.disc(0.01, cells=9), LAW)
    body = pf.Body(0.4, 6e-4, velocity=(0.08, 0.03, 3.0), gravity=(0.0, 0.0))
    own = [
        pf.Contact(
            model,
            0.5 + 0.1 * i,
            position=(0.03 * np.cos(i), 0.03 * np.sin(i)),
            mounted_on="body",
            name=f"c{i}",
        )
        for i in range(4)
    ]
    scene = pf.Scene(
        body, [*own, pf.Contact(model, 1.0, name="fixed")], 0.06, save_every=0.02
    )
    numbers = {
        "parameters": ("mu", "r"),
        "signals": {"c2.normal_force": [0.0, 0.03]},
        "initial": ["vx", "theta"],
    }
    agree(scene, numbers, 2e-6, 2e-5)


def test_the_reverse_takes_contacts_that_move():
    """A pad that sways over the body, and a table that turns under it."""
    model = model_of("ellipsoid")
    load = pf.Signal([0.0, 0.1], [2.0, 3.0], "linear")
    sway = pf.Signal(
        [0.0, 0.05, 0.1],
        [(0.02, 0.0, 0.3), (0.0, 0.01, -0.5), (0.01, 0.0, 0.2)],
        "linear",
    )
    contacts = [
        pf.Contact(
            model,
            load,
            position=(0.03, 0.01),
            angle=0.4,
            name="pad",
            support_velocity=sway,
        ),
        pf.Contact(
            model,
            2.0,
            mounted_on="body",
            name="table",
            support_velocity=(0.0, 0.0, 0.5),
        ),
    ]
    body = pf.Body(0.4, 6e-4, velocity=(0.05, 0.0, 0.5), gravity=(0.0, 0.0))
    scene = pf.Scene(body, contacts, 0.1, save_every=0.02)
    numbers = {
        "signals": {"pad.normal_force": [0.0, 0.05, 0.1], "force": [0.02]},
        "initial": ["vx", "y", "theta"],
    }
    agree(scene, numbers | {"parameters": ("mu", "mass", "r")}, 2e-6, 2e-5)


@pytest.mark.parametrize("kind", ["cells", "fixed cells", "both", "root"])
def test_derivatives_through_friction_that_depends_on_the_direction(kind):
    """Cells with metrics and asymmetries of their own, one for all, and the root of a metric around a limit surface."""

    def scene(mu=1.0, r=1.0, load=1.0, vy=0.03):
        law = dataclasses.replace(LAW, mu_c=mu * LAW.mu_c, mu_s=mu * LAW.mu_s)
        patch = pf.ContactPatch.points(
            r
            * np.array([[0.01, 0.0], [-0.008, 0.009], [-0.006, -0.01], [0.002, 0.004]]),
            [1.0, 2.0, 1.5, 0.5],
        )
        metrics = np.array(
            [pf.friction_metric(0.3 * i, along=1.0, across=0.6) for i in range(4)]
        )
        lean = np.array([[0.2, 0.1]])
        if "cells" in kind:
            tilted = None if kind == "fixed cells" else np.tile(lean, (4, 1))
            patch = patch.with_friction_metric(metrics, tilted)
        else:
            patch = patch.with_friction_metric(
                metrics[1], lean[0] if kind == "both" else None
            )
        pad = pf.Pad.at_load(2.0) if kind == "fixed cells" else None
        model = pf.DistributedModel(patch, law, pad=pad)
        if kind == "root":
            model = pf.ReducedModelPublished(
                patch, law, surface=pf.LimitSurfaceEllipsoid(patch)
            )
        body = pf.Body(0.4, 6e-4, velocity=(0.08, vy, 1.5), gravity=(0.0, 0.0))
        contact = pf.Contact(
            model, 3.0 * load, position=(3e-3, 0.0), mounted_on="body", angle=0.3
        )
        return pf.Scene(body, [contact], 0.03, save_every=5e-3)

    numbers = {"parameters": ("mu", "r", "load"), "initial": ["vy"]}
    found = scene_sensitivities(scene(), **numbers)
    for p, (name, at) in enumerate(
        (("mu", 1.0), ("r", 1.0), ("load", 1.0), ("vy", 0.03))
    ):

        def changed(number, name=name):
            return scene(**{name: number})

        assert_sensitivities(found, p, changed, at, 1e-4 * at, 5e-6)
    agree(scene(), numbers, 2e-6, 2e-5)


def test_what_has_no_derivative_is_refused():
    soft = pf.DistributedModel(
        pf.ContactPatch.disc(
            0.01, cells=5, pressure=pf.SoftFinger(c=5e-3, n=1 / 3, k=2.0)
        ),
        LAW,
    )
    scene = pf.Scene(pf.Body(0.4, 6e-4), [pf.Contact(soft, 3.0, name="soft")], 0.1)
    rule = r"must not contain soft.normal_force: the shape of the patch of contact 'soft' changes with the load"
    with refused("signals " + rule):
        scene_sensitivities(scene, (), signals={"soft.normal_force": [0.0]})
    with refused("parameters must not contain load"):
        scene_gradient(scene, lambda time, motion: motion, ["load"])
    assert (
        scene_sensitivities(
            scene, ("mu",), options=SolverOptions(t_end=0.01)
        ).d_motion.shape[2]
        == 1
    )

    class Own(pf.DistributedModel):
        def packed(self, *loads):
            packed = super().packed(*loads)
            return packed._replace(functions=packed.functions._replace(change=None))

    own = Own(pf.ContactPatch.disc(0.01, cells=5), LAW)
    with refused("model of contact 'own' must have all functions"):
        scene_sensitivities(
            pf.Scene(pf.Body(0.4, 6e-4), [pf.Contact(own, 3.0, name="own")], 0.1)
        )


@pytest.mark.parametrize("hold", ["linear", "previous"])
def test_the_reverse_reaches_a_prescribed_velocity(hold):
    """Linear in the knots but for the turning axes; rounding of two integrations."""
    twist = pf.Signal(
        [0.0, 0.1, 0.2], [[0.01, 0.0, 0.5], [0.02, 0.01, -1.0], [0.0, 0.02, 1.0]], hold
    )
    scene = pf.scenes.driven(model_of("reduced"), twist=twist, t_end=0.3)
    numbers = {
        "signals": {"velocity": [0.0, 0.05, 0.1, 0.2]},
        "initial": ["x", "theta"],
    }
    forwards = scene_sensitivities(scene, (), **numbers)
    slope = np.random.default_rng(2).normal(size=forwards.motion.shape)
    reverse = scene_gradient(scene, lambda time, motion: slope, **numbers)
    expected = np.einsum("mi,mip->p", slope, forwards.d_motion)
    assert reverse.gradient == pytest.approx(
        expected, abs=1e-8 * np.abs(expected).max()
    )
    assert np.abs(expected).min() > 0.0


def test_a_held_contact_has_no_say():
    """Below breakaway the load moves nothing: a plan that starts from rest finds no slope there."""
    model = model_of("reduced")
    body = pf.Body(0.4, 6e-4, gravity=(0.0, 0.0))
    scene = pf.Scene(
        body,
        [pf.Contact(model, 5.0, mounted_on="body")],
        0.1,
        force=pf.Signal.constant([0.1, 0.0, 0.0]),
    )
    found = scene_gradient(
        scene,
        lambda time, motion: np.eye(6)[[3] * len(time)] / len(time),
        signals={"contact.normal_force": [0.0, 0.05]},
    )
    # the bristles' length over the load: what the deflection itself changes by
    assert np.abs(found.gradient).max() < LAW.largest_deflection / 5.0


def test_windows_parts_and_a_shorter_motion_leave_no_trace(monkeypatch):
    """The same steps, but where the parts of the path end: to the accuracy of the derivatives."""
    scene = slide("ellipsoid")

    def gradient(end):
        options = SolverOptions(t_end=end)
        return scene_gradient(
            scene,
            lambda _, motion: np.ones_like(motion),
            signals=SIGNALS,
            options=options,
        ).gradient

    whole = gradient(0.4)
    short = gradient(0.1)
    monkeypatch.setattr(packing, "BATCH", 3)
    assert gradient(0.4) == pytest.approx(
        whole, rel=1e-6, abs=1e-7 * np.abs(whole).max()
    )
    monkeypatch.setattr(path, "NUMBERS", 1.0)
    assert gradient(0.4) == pytest.approx(
        whole, rel=1e-6, abs=1e-7 * np.abs(whole).max()
    )
    knots = scene_sensitivities(
        scene, (), signals=SIGNALS, options=SolverOptions(t_end=0.1)
    )
    expected = knots.d_motion.sum(axis=(0, 1))
    assert short == pytest.approx(expected, abs=2e-6 * np.abs(expected).max())
    assert (short[3:5] == 0.0).all()  # knots behind the end


def test_wrong_input_is_named():
    scene = pushed("ellipsoid")
    with refused(
        r"signals must be one of own\.normal_force, fixed\.normal_force, force"
    ):
        scene_sensitivities(scene, signals={"own": KNOTS})
    with refused(r"knots of force must increase, between 0 and 0\.4 s"):
        scene_sensitivities(scene, signals={"force": [0.0, 0.5]})
    with refused("knots of force must be 1 to 1000 times"):
        scene_sensitivities(scene, signals={"force": []})
    with refused("initial must be one of vx, vy, omega, x, y, theta"):
        scene_sensitivities(scene, initial=["angle"])
    with refused("signals must be a table of knots"):
        scene_gradient(scene, lambda time, motion: motion, signals=["force"])
    with refused("cotangent must be a function of time and motion"):
        scene_gradient(scene, np.zeros(6))
    with refused("cotangent must be a function of time and motion"):
        scene_gradient(scene, float)
    with refused("wrench_cotangent must be a function of time and motion, or wrenches"):
        scene_gradient(scene, None, wrench_cotangent=np.zeros(3))
    with refused(r"wrench_cotangent of the cost must have shape"):
        scene_gradient(
            scene,
            None,
            wrench_cotangent=lambda time, wrenches: wrenches[0],
            signals=SIGNALS,
        )
    with refused(r"cotangent of the cost must have shape"):
        scene_gradient(scene, lambda time, motion: motion[0], signals=SIGNALS)
