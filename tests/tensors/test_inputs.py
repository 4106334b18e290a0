"""Wrong input to steps and rollouts of PyTorch and JAX: refused in one line, or friction that never drives."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.errors import InvalidValueError
from tests.support.front_ends import Jax
from tests.support.refusals import refused

PATCH = pf.ContactPatch.points(
    [(0.01, 0.0), (-0.01, 0.002), (0.0, 0.012)], [1.0, 2.0, 3.0]
)
LAW = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
TWIST, LOAD, DT = [2e-3, -1e-3, 0.3], 2.0, 1e-3
KINDS = ("DistributedModel", "ReducedModel", "ReducedModelPublished")

WRONG = {
    "twist": [
        ("123", "be an array of numbers"),
        ([1.0, 2.0], r"have shape \[..., 3\]"),
        ([1.0, 2.0, 3.0, 4.0], r"have shape \[..., 3\]"),
        (1.0, r"have shape \[..., 3\]"),
        ([np.nan, 0.0, 0.0], "be finite"),
        ([np.inf, 0.0, 0.0], "be finite"),
        ([1e60, 0.0, 0.0], "be between|be finite"),
        (np.array([1.0, 2.0, 3.0j]), "be an array of numbers and not complex"),
        (
            np.ma.masked_array([1.0, 2.0, 3.0], [0, 1, 0]),
            "be an array of numbers and not masked",
        ),
        (None, "be an array of numbers"),
        ([10**400, 0.0, 0.0], "be"),
    ],
    "normal_force": [
        (-1.0, "be >= 0, got -1"),
        (np.nan, "be finite"),
        ("heavy", "be an array of numbers"),
        (None, "be an array of numbers"),
        (1j, "be an array of numbers"),
    ],
    "dt": [
        (-1e-3, "be >= 0, got -0.001"),
        (np.nan, "be finite"),
        ("now", "be an array"),
        (None, "be an array"),
    ],
    "state": [
        ([0.0], "have shape"),
        (0.0, "have shape"),
        ("soft", "be an array of numbers"),
    ],
}
CASES = [(name, value, rule) for name, pairs in WRONG.items() for value, rule in pairs]
every_kind = pytest.mark.parametrize("kind", KINDS)
every_case = pytest.mark.parametrize(("name", "value", "rule"), CASES)


def refuses(call, name, rule):
    """One line that names the argument."""
    with pytest.raises(InvalidValueError, match=f"^{name} must .*({rule})") as caught:
        call()
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


def made(front, kind):
    return front.model(PATCH, LAW, kind)


def arguments(front, model, **changed):
    """Return legal arguments of a step, some of them changed."""
    usual = {
        "state": model.rest(),
        "twist": front.array(TWIST),
        "normal_force": front.array(LOAD),
        "dt": DT,
    }
    return {**usual, **changed}


@every_kind
@every_case
def test_a_step_refuses(front, kind, name, value, rule):
    model = made(front, kind)
    refuses(lambda: model.step(**arguments(front, model, **{name: value})), name, rule)
    if name != "dt":
        given = arguments(front, model, **{name: value})
        given.pop("dt")
        for call in (model.rate, model.wrench):
            refuses(lambda call=call: call(**given), name, rule)


@pytest.mark.parametrize(
    ("kind", "method"),
    [(kind, method) for kind in KINDS for method in ("eager", "adjoint")],
)
@every_case
def test_a_roll_out_refuses(front, kind, method, name, value, rule):
    model = made(front, kind)
    given = arguments(front, model, twist=front.array([TWIST] * 4))
    if name == "twist":
        if np.ndim(value) != 1 or len(value) != 3:
            return  # the shapes of rollouts have tests of their own
        value = (
            np.ma.stack([value] * 4)
            if isinstance(value, np.ma.MaskedArray)
            else [value] * 4
        )
    given[name] = value
    if name == "state" and method == "adjoint":
        rule += "|be None"
    refuses(lambda: front.models.rollout(model, **given, method=method), name, rule)


@every_kind
def test_batches_that_do_not_match(front, kind):
    model = made(front, kind)
    given = arguments(
        front,
        model,
        twist=front.array(np.zeros((4, 3))),
        normal_force=front.array(np.ones(5)),
    )
    with refused("batch axes must broadcast"):
        model.step(**given)


@every_kind
def test_lists_and_whole_numbers_are_numbers(front, kind):
    model = made(front, kind)
    given = arguments(front, model)
    state, wrench = model.step(**given)
    again, same = model.step(given["state"], TWIST, 2, np.float64(DT))
    np.testing.assert_allclose(front.plain(again), front.plain(state))
    np.testing.assert_allclose(front.plain(same), front.plain(wrench))


@every_kind
def test_where_values_are_unseen_friction_never_drives(front, kind):
    """In `vmap` and `jit` a load or a step below zero counts as zero."""
    model = made(front, kind)
    given = arguments(front, model)

    def wrench(load):
        return model.step(given["state"], given["twist"], load, given["dt"])[1]

    assert not front.plain(front.traced(wrench, -1.0)).any()
    np.testing.assert_allclose(
        front.plain(front.traced(wrench, LOAD)), front.plain(wrench(LOAD)), rtol=1e-12
    )

    def moved(dt):
        return model.step(given["state"], given["twist"], given["normal_force"], dt)[0]

    assert not front.plain(front.traced(moved, -1e-3)).any()

    def last(load):
        sequence = front.array([TWIST] * 4)
        return front.models.rollout(
            model, given["state"], sequence, load, DT, method="eager"
        ).wrenches

    assert not front.plain(front.traced(last, -1.0)).any()
    # at zero the slope is that of the smallest load
    at_zero = front.grad(lambda load: wrench(load)[0])(front.array(0.0))
    np.testing.assert_allclose(
        front.plain(at_zero), front.plain(wrench(LOAD))[0] / LOAD, rtol=1e-12
    )


@pytest.mark.parametrize("name", ["twist", "normal_force", "dt"])
@pytest.mark.parametrize(
    ("kind", "method"),
    [("ReducedModel", "adjoint"), ("ReducedModelPublished", "eager")],
)
def test_nan_in_traced_values_stays_and_spoils_no_other_contact(kind, method, name):
    """Inside `jit` a load of NaN counted as none, and any NaN ended the adjoint in an error of its callback."""
    front = Jax()
    jax = front.library
    model = made(front, kind)
    sequences = front.array(np.multiply.outer([1.0, 2.0, 3.0], [TWIST] * 4))
    bad = {
        "twist": sequences.at[1, 2, 0].set(np.nan),
        "normal_force": front.array([[LOAD], [np.nan], [LOAD]]),
        "dt": front.array(np.nan),
    }
    right = {
        "twist": sequences,
        "normal_force": front.array([[LOAD]] * 3),
        "dt": front.array(DT),
    }

    def wrenches(twist, normal_force, dt):
        return front.models.rollout(
            model, None, twist, normal_force, dt, method=method
        ).wrenches

    def finite(array):
        return np.isfinite(front.plain(array)).all(axis=(1, 2))

    spoilt = finite(jax.jit(wrenches)(**{**right, name: bad[name]}))
    np.testing.assert_array_equal(spoilt, [name != "dt", False, name != "dt"])
    if name == "twist":
        gradient = jax.jit(
            jax.grad(lambda twist: wrenches(twist, right["normal_force"], DT).sum())
        )
        slope = gradient(bad["twist"])
        alone = gradient(sequences)
        np.testing.assert_array_equal(finite(slope), [True, False, True])
        np.testing.assert_allclose(
            front.plain(slope)[::2], front.plain(alone)[::2], rtol=1e-9, atol=1e-12
        )


def test_parameters_are_as_many_as_their_names(front):
    model = made(front, "DistributedModel")
    assert model.names[0] == "sigma_0" and len(model.names) == 8
    with refused(r"parameters must have shape \[..., 8\] \(sigma_0, .*got shape \[3\]"):
        model.rate(**{name: value for name, value in arguments(front, model).items() if name != "dt"},
                   parameters=front.array([1.0, 2.0, 3.0]))  # fmt: skip


OUT_OF_RANGE = {
    "sigma_0": (0.0, "> 0"),
    "sigma_2": (-0.1, ">= 0"),
    "breakaway_ratio": (1.0, r"in \[0, 1\)"),
}


@every_kind
@pytest.mark.parametrize("name", OUT_OF_RANGE)
def test_parameters_have_the_ranges_of_compiled_rollouts(front, kind, name):
    model = made(front, kind)
    (value, rule) = OUT_OF_RANGE[name]
    numbers = LAW.numbers._asdict() | {
        "contact_radius": 0.01,
        "second_moment": 1e-4,
        "centre_x": 0.0,
        "centre_y": 0.0,
    }
    whole = front.array([(numbers | {name: value})[each] for each in model.names])
    refuses(
        lambda: model.step(**arguments(front, model), parameters=whole),
        name,
        f"be {rule}",
    )
    if front.name == "jax":
        record = type(model.parameters)(*whole)
        refuses(lambda: model.replace(parameters=record), name, f"be {rule}")
        model.replace(parameters=type(record)(*[0] * len(record)))  # axes
