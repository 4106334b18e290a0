"""States and twists of other types: converted or refused before compiled code sees them, which never compiles again."""

import sys

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

import planarfriction as pf
from planarfriction import derivatives
from tests.support.contacts import ELASTIC as LAW
from tests.support.contacts import FOUR as PATCH
from tests.support.refusals import refused

MODELS = {
    "distributed": pf.DistributedModel(PATCH, LAW),
    "grain": pf.DistributedModel(PATCH.with_friction_metric(np.diag([1.0, 2.0])), LAW),
    "reduced": pf.ReducedModel(PATCH, LAW),
    "published": pf.ReducedModelPublished(PATCH, LAW),
}
TWIST, LOAD, DT = (2e-3, -1e-3, 0.3), 2.0, 1e-4


class Labelled(np.ndarray):
    """A subclass of an array, as libraries of units and of labelled data have them."""


def strided(a):
    """Every other number of a larger array."""
    wide = np.zeros((*a.shape[:-1], 2 * a.shape[-1]))
    wide[..., ::2] = a
    return wide[..., ::2]


def read_only(a):
    """May not be written to."""
    a = a.copy()
    a.flags.writeable = False
    return a


def unaligned(a):
    """A field of a packed record."""
    record = np.zeros(a.shape, np.dtype([("flag", "u1"), ("value", float)]))
    record["value"] = a
    return record["value"]


FORMS = {
    "float32": (lambda a: a.astype(np.float32), 1e-6),
    "float16": (lambda a: a.astype(np.float16), 2e-2),
    "long double": (lambda a: a.astype(np.longdouble), 0.0),
    "strided": (strided, 0.0),
    "backwards": (lambda a: a[..., ::-1].copy()[..., ::-1], 0.0),
    "Fortran order": (np.asfortranarray, 0.0),
    "read-only": (read_only, 0.0),
    "byte-swapped": (lambda a: a.astype(">f8"), 0.0),
    "unaligned": (unaligned, 0.0),
    "subclass": (lambda a: a.view(Labelled), 0.0),
    "list": (lambda a: a.tolist(), 0.0),
}
"""Types of arrays that hold the same numbers, with the relative error of each type."""

every_model = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
every_form = pytest.mark.parametrize("form", FORMS)


def compiled():
    """Return the number of compilations of each kernel."""
    modules = [
        module
        for name, module in sys.modules.items()
        if name.startswith("planarfriction._engine")
    ]
    found = {
        id(value): value
        for module in modules
        for value in vars(module).values()
        if isinstance(value, Dispatcher)
    }
    return {
        f"{each.__module__}.{each.__name__}": len(each.signatures)
        for each in found.values()
    }


def calls(model):
    """All that takes a state, as functions of state and twist."""
    yield lambda state, twist: model.rate(state, twist, LOAD)
    yield lambda state, twist: model.wrench(state, twist, LOAD)
    yield lambda state, twist: model.step(state, twist, LOAD, DT)
    yield lambda state, twist: model.jacobians(state, twist, LOAD)
    yield lambda state, twist: model.step_jacobians(state, twist, LOAD, DT)


def rollouts(model):
    """The same of rollouts, with twists `[T, 3]`."""
    yield lambda state, twist: derivatives.rollout(model, state, twist, LOAD, DT)
    if model is MODELS["reduced"] or model is MODELS["published"]:
        yield lambda state, twist: derivatives.rollout_states(
            model, state, twist, LOAD, DT
        )
        yield lambda state, twist: derivatives.rollout_jacobian(
            model, state, twist, LOAD, DT
        )
        yield lambda state, twist: derivatives.rollout_vjp(
            model, state, twist, LOAD, DT, twist
        )


@pytest.fixture(scope="module", autouse=True)
def everything_is_compiled():
    """One contact and a batch run different loops."""
    for model in MODELS.values():
        for count in ((), (2,)):
            state = np.zeros((*count, *model.state_shape))
            twist = np.broadcast_to(TWIST, (*count, 4, 3))
            for call in calls(model):
                call(state, twist[..., 0, :].copy())
            for call in rollouts(model):
                call(state, twist)


def agree(found, wanted, error):
    """Equal but for the rounding of the inputs; elasto-plastic bristles at 1/3 of breakaway magnify it little."""
    pairs = (
        zip(found, wanted, strict=True)
        if isinstance(found, tuple)
        else [(found, wanted)]
    )
    for a, b in pairs:
        assert np.asarray(a).dtype == float
        np.testing.assert_allclose(
            a,
            b,
            rtol=0.0,
            atol=100.0 * error * (np.abs(b).max() if np.size(b) else 0.0),
        )


@every_model
@every_form
@pytest.mark.parametrize("batch", [(), (2, 3)])
def test_other_types_are_converted_without_compiling(model, form, batch):
    convert, error = FORMS[form]
    one = np.linspace(-3e-7, 3e-7, model.rest().size).reshape(model.state_shape)
    if form == "float16":
        one[:] = 0.0  # deflections are below its numbers
    state = np.broadcast_to(one, (*batch, *one.shape)).copy()
    twist = np.broadcast_to(TWIST, (*batch, 3)).copy()
    sequence = np.stack([twist] * 4, -2)
    for call, held in [(call, twist) for call in calls(model)] + [
        (call, sequence) for call in rollouts(model)
    ]:
        wanted = call(state, held)
        before = compiled()
        found = call(convert(state), convert(held))
        assert compiled() == before
        agree(found, wanted, error)


@every_model
def test_whole_numbers_are_states(model):
    rest = np.zeros(model.state_shape, dtype=int)
    for call in calls(model):
        wanted = call(model.rest(), np.array([1.0, 0.0, 2.0]))
        before = compiled()
        agree(call(rest, np.array([1, 0, 2])), wanted, 0.0)
        agree(call(rest.astype(np.uint8), (1, 0, 2)), wanted, 0.0)
        assert compiled() == before


TWISTS = {
    "text": "123",
    "bytes": b"123",
    "texts": ("1", "2", "3"),
    "dict": {1.0: "a", 2.0: "b", 3.0: "c"},
    "set": {1.0, 2.0, 3.0},
    "complex": np.array([1.0, 2.0, 3.0 + 1.0j]),
    "complex list": [1.0, 2.0, 3.0 + 0.5j],
    "complex numbers": (1.0, 2.0, np.complex128(3.0 + 1.0j)),
    "durations": np.array([1, 2, 3], "m8[s]"),
    "durations in a list": [np.timedelta64(1, "s"), 2.0, 3.0],
    "dates": np.array([1, 2, 3], "M8[s]"),
    "objects": np.array([1.0, 2.0, "3"], dtype=object),
    "text array": np.array(["1", "2", "3"]),
    "masked": np.ma.masked_array([1.0, 2.0, 3.0], [False, True, False]),
    "masked in a list": [1.0, np.ma.masked, 3.0],
    "nothing": (1.0, None, 3.0),
}


@every_model
@pytest.mark.parametrize("kind", TWISTS)
def test_what_is_no_twist_is_refused(model, kind):
    for call in calls(model):
        before = compiled()
        with refused("twist must"):
            call(model.rest(), TWISTS[kind])
        assert compiled() == before


@every_model
@pytest.mark.parametrize("kind", TWISTS)
def test_what_is_no_state_is_refused(model, kind):
    for call in calls(model):
        with refused("state must"):
            call(TWISTS[kind], TWIST)


@every_model
@pytest.mark.parametrize(
    "value",
    [
        "1",
        b"1",
        1.0 + 0.0j,
        np.complex128(1.0 + 1.0j),
        np.timedelta64(1, "s"),
        {1.0},
        None,
        np.ma.masked,
    ],
)
def test_what_is_no_load_or_step_is_refused(model, value):
    for call in (
        lambda x: model.step(model.rest(), TWIST, x, DT),
        lambda x: model.step_jacobians(model.rest(), TWIST, x, DT),
    ):
        before = compiled()
        with refused("normal_force must"):
            call(value)
        assert compiled() == before
    for call in (model.step, model.step_jacobians):
        with refused("dt must"):
            call(model.rest(), TWIST, LOAD, value)
