"""Wrong input is refused everywhere with one line that names the parameter, the rule and the value."""

import dataclasses
import datetime
import math
import tracemalloc
import warnings
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
import xarray as xr

import planarfriction as pf
from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.patch import Grid, PerCell
from tests.support.contacts import SOFT as FINGER
from tests.support.refusals import refusal, refused

SQUARE = pf.ContactPatch.rectangle(0.02, cells=3)
MODEL = pf.DistributedModel(SQUARE, pf.LuGre())
SIGNAL = pf.Signal([0.0, 1.0], [1.0, 2.0])
ELLIPSOID = pf.LimitSurfaceEllipsoid(SQUARE)


class Unready:
    """Refuses to become an array, as a tensor does that records its derivatives."""

    shape = (3,)
    ndim = 1
    requires_grad = True

    def __array__(self, *arguments, **options):
        raise RuntimeError("call detach first")


class Millimetres:
    """A number with a unit, as of Pint."""

    magnitude = 20.0
    units = "millimeter"

    def __float__(self):
        return self.magnitude


class Talkative:
    def __repr__(self):
        return "line\n" * 5000


def itself():
    result = [1.0]
    result.append(result)
    return result


NEITHER = {
    "text": "soft",
    "text of a number": "21",
    "long text": "long " * 3000,
    "odd text": "\0\ud800\n\x1b[31m",
    "bytes": b"123",
    "none of many digits": 10**400,
    "an integer that cannot be printed": 10**5000,
    "complex": 1.0 + 2.0j,
    "complex of NumPy": np.complex128(1.0),
    "truth value": True,
    "truth value of NumPy": np.True_,
    "time": datetime.timedelta(seconds=1),
    "date": datetime.date(2024, 1, 1),
    "timedelta64": np.timedelta64(1, "s"),
    "datetime64": np.datetime64("2024-01-01"),
    "masked": np.ma.masked,
    "quantity": Millimetres(),
    "tensor": Unready(),
    "table": {"x": 1.0},
    "set": {1.0},
    "generator": (i for i in range(3)),
    "class": float,
    "talkative": Talkative(),
    "itself": itself(),
    "nan": math.nan,
    "inf": np.inf,
    "array of objects": np.array([1.0, None, "x"], dtype=object),
}
"""Neither numbers nor arrays of finite numbers."""

NO_ARRAYS = {
    "texts": ["1", "2", "3"],
    "array of texts": np.array(["1", "2", "3"]),
    "truth values": [True, False, True],
    "array of truth values": np.array([True, False, True]),
    "complex array": np.array([1.0 + 2.0j, 2.0, 3.0]),
    "times": np.array([0, 1, 2], dtype="timedelta64[ms]"),
    "dates": np.array(
        ["2024-01-01", "2024-01-02", "2024-01-03"], dtype="datetime64[D]"
    ),
    "masked array": np.ma.masked_array([1.0, 2.0, 3.0], mask=[False, True, False]),
    "list with a masked array": [1.0, 2.0, np.ma.masked],
    "list with a quantity": [1.0, 2.0, Millimetres()],
    "ragged": [[1.0], [2.0, 3.0]],
    "table of numbers": np.zeros(3, dtype=[("x", float), ("y", float)]),
    "millimetres": xr.DataArray([1.0, 2.0, 3.0], attrs={"units": "mm"}),
    "degrees": xr.DataArray([1.0, 2.0, 3.0], attrs={"units": "deg"}),
}
NUMBERS = {
    "radius": pf.ContactPatch.disc,
    "cells": lambda x: pf.ContactPatch.disc(0.01, x),
    "width": pf.ContactPatch.rectangle,
    "height": lambda x: pf.ContactPatch.rectangle(0.02, x),
    "inner_radius": lambda x: pf.ContactPatch.ring(x, 0.01),
    "length": pf.ContactPatch.line,
    "area": lambda x: pf.ContactPatch.points([(0, 0), (0.01, 0)], area=x),
    "parts": SQUARE.refined,
    "degree": SQUARE.moments,
    "along": lambda x: pf.friction_metric(0.0, x, 1.0),
    "c": lambda x: pf.SoftFinger(c=x, k=2.0),
    "k": lambda x: pf.SoftFinger(c=0.01, k=x),
    "x_min": lambda x: Grid(x, 0.0, 1.0, 1.0, 2, 2),
    "columns": lambda x: Grid.around_origin(1.0, 1.0, x, 2),
    "mu_c": lambda x: pf.LuGre(mu_c=x),
    "sigma_1": lambda x: pf.LuGre(sigma_1=x),
    "elasto_plastic": lambda x: pf.LuGre(elasto_plastic=x),
    "sigma_0": lambda x: pf.Dahl(sigma_0=x),
    "creep_speed": lambda x: pf.CoulombStribeck(creep_speed=x),
    "mu": pf.Coulomb,
    "breakaway_ratio": pf.ElastoPlastic,
    "dt": SIGNAL.held,
    "t_end": lambda x: pf.Signal.sine(1.0, 1.0, 1.0, t_end=x),
    "mass": lambda x: pf.Body(x, 1.0),
    "angle": lambda x: pf.Body(1.0, 1.0, angle=x),
    "count": lambda x: pf.Contact(MODEL, 1.0, count=x),
    "save_every": lambda x: pf.Scene(
        pf.Body(1.0, 1.0), pf.Contact(MODEL, 1.0), 1.0, save_every=x
    ),
    "normal_force": lambda x: pf.LimitSurfaceCells(SQUARE, normal_force=x),
    "segments": lambda x: pf.LimitSurfaceTable(SQUARE, x),
    "samples": lambda x: ELLIPSOID.compare(ELLIPSOID, samples=x),
    "discs": lambda x: pf.ReducedModel(SQUARE, pf.LuGre(), cells=x),
    "n": SQUARE.discs,
}
ARRAYS = {
    "positions": pf.ContactPatch.points,
    "weights": lambda x: pf.ContactPatch.points([(0, 0), (0.01, 0), (0, 0.01)], x),
    "vertices": pf.ContactPatch.polygon,
    "pressure": PerCell,
    "profile": lambda x: pf.ContactPatch.line(0.01, 3, profile=x),
    "cell_size": lambda x: pf.ContactPatch.from_pressure([[1.0]], x),
    "loads": lambda x: pf.ContactPatch.from_pressure(
        [np.ones((2, 2))] * 3, 0.01, loads=x
    ),
    "metric": SQUARE.with_friction_metric,
    "asymmetry": lambda x: SQUARE.with_friction_metric(np.eye(2), x),
    "gradient": pf.LinearGradient,
    "normal_force": FINGER.weights,
    "about": lambda x: SQUARE.moments(2, about=x),
    "state": lambda x: pf.LuGre().force(x, 1.0, 1.0),
    "velocity": lambda x: pf.LuGre().rate(1.0, x),
    "speed": pf.LuGre().steady_friction,
    "times": lambda x: pf.Signal(x, [1.0, 2.0, 3.0]),
    "values": lambda x: pf.Signal([0.0, 1.0, 2.0], x),
    "value": pf.Signal.constant,
    "t": SIGNAL,
    "breaks": SIGNAL.pieces,
    "velocity of a body": lambda x: pf.Body(1.0, 1.0, velocity=x),
    "outline": lambda x: pf.Body(1.0, 1.0, outline=x),
    "force": lambda x: pf.Scene(
        pf.Body(1.0, 1.0), pf.Contact(MODEL, 1.0), 1.0, force=x
    ),
    "twist": ELLIPSOID.wrench,
    "wrench": ELLIPSOID.twist,
    "coefficients": lambda x: pf.LimitSurfaceQuartic(SQUARE, coefficients=x),
}
CALLED = {"discs": "cells", "elasto_plastic": "", "parts": ""}
"""Parameters whose messages may speak of what they are part of: breakaway_ratio, cells."""
MASKS = ("weights", "pressure", "profile")
"""Pressures: an array of truth values is a mask."""


def refuses(name, call, value):
    message = refusal(call, value, kind=InvalidValueError)
    assert (
        name.partition(" of ")[0] in message
        and len(message) <= 300
        and message.isprintable()
    ), message


@pytest.mark.parametrize("name", NUMBERS)
def test_what_is_no_number_is_refused_where_one_is_wanted(name):
    for value in (*NEITHER.values(), *NO_ARRAYS.values(), [[1.0, 2.0]], np.ones(1)):
        refuses(CALLED.get(name, name), NUMBERS[name], value)


@pytest.mark.parametrize("name", ARRAYS)
def test_what_is_no_array_is_refused_where_one_is_wanted(name):
    for kind, value in {**NEITHER, **NO_ARRAYS}.items():
        if (kind, name) != ("class", "profile") and not (
            kind == "array of truth values" and name in MASKS
        ):
            refuses(name, ARRAYS[name], value)


def test_numbers_of_every_kind_are_taken():
    for value in (
        2,
        2.0,
        np.float32(2.0),
        np.int8(2),
        np.array(2.0),
        Fraction(2),
        Decimal(2),
        xr.DataArray(2.0),
    ):
        assert validation.number("x", value) == 2.0
        assert validation.count("x", value) == 2
        assert validation.vector("x", [value, 1.0], 2).tolist() == [2.0, 1.0]
    for array in (
        range(3),
        (0, 1, 2),
        np.arange(3.0)[::1],
        np.arange(3, dtype=">f8"),
        np.ma.masked_array([0, 1, 2]),
    ):
        assert validation.vector("x", array, 3).tolist() == [0.0, 1.0, 2.0]


def test_a_dead_sensor_is_no_pressure_and_a_mask_is_one():
    dead = np.ma.masked_array(
        [[1.0, 2.0], [1e5, 3.0]], mask=[[False, False], [True, False]]
    )
    with refused("pressure must be an array of numbers and not masked"):
        pf.ContactPatch.from_pressure(dead, 0.001)
    alive = np.ma.masked_array([[1.0, 2.0], [1.0, 4.0]], mask=False)
    assert pf.ContactPatch.from_pressure(alive, 0.001).weights().tolist() == [
        0.125,
        0.25,
        0.125,
        0.5,
    ]
    mask = np.array([[True, False], [True, True]])
    assert pf.ContactPatch.from_pressure(mask, 0.001) == pf.ContactPatch.from_pressure(
        1.0 * mask, 0.001
    )


# ---------------------------------------------------------------------- units


@pytest.mark.parametrize(
    "unit", ["m", "m/s", "rad/s", "N m", "1/m", "kg m^2", "s", "1", "-", ""]
)
def test_si_is_taken_as_it_is(unit):
    assert validation.number("x", xr.DataArray(3.0, attrs={"units": unit})) == 3.0
    assert validation.vector(
        "x", xr.DataArray([3.0, 4.0], attrs={"units": unit}), 2
    ).tolist() == [3.0, 4.0]


@pytest.mark.parametrize(
    "unit",
    [
        "mm",
        "cm",
        "deg",
        "degree",
        "°",
        "%",
        "rpm",
        "1/min",
        "ms",
        "g",
        "kN",
        "µm",
        "inch",
    ],
)
def test_other_units_are_refused(unit):
    for value in (
        xr.DataArray(3.0, attrs={"units": unit}),
        [xr.DataArray(3.0, attrs={"units": unit})],
    ):
        with refused("x must be an array of numbers in SI units"):
            validation.numbers("x", value)
    with refused(f"x must be a number in SI units \\({unit} is none"):
        validation.number("x", xr.DataArray(3.0, attrs={"units": unit}))


def test_results_can_be_inputs():
    solution = pf.simulate(pf.scenes.in_hand(MODEL, t_end=0.02))
    again = pf.Signal(solution.data.time, solution.data.vx)
    assert again.values.tolist() == solution.data.vx.values.tolist()


def test_quantities_of_pint():
    pint = pytest.importorskip("pint")
    for quantity in (
        20 * pint.Unit("mm"),
        0.02 * pint.Unit("m"),
        pint.Quantity([1.0, 2.0], "mm"),
    ):
        for call in (
            pf.ContactPatch.disc,
            pf.LinearGradient,
            pf.Signal.constant,
            lambda x: pf.Body(1, 1, position=x),
        ):
            with refused(r"in SI units \((milli)?meter is none that is taken"):
                call(quantity)
    assert pf.ContactPatch.disc(
        (10 * pint.Unit("mm")).to("m").magnitude
    ) == pf.ContactPatch.disc(0.01)


@pytest.mark.torch
def test_tensors_of_torch():
    torch = pytest.importorskip("torch")
    for tensor in (
        torch.tensor(0.01, requires_grad=True),
        torch.ones(3, requires_grad=True),
    ):
        for call in (
            pf.ContactPatch.disc,
            pf.Signal.constant,
            ELLIPSOID.wrench,
            lambda x: pf.Body(1, 1, velocity=[x]),
        ):
            with refused(r"without a gradient \(detach the tensor\)"):
                call(tensor)
    assert pf.ContactPatch.disc(torch.tensor(0.25)) == pf.ContactPatch.disc(0.25)


# ---------------------------------------------------------------------- other things than numbers


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("direction", lambda x: pf.ContactPatch.line(0.01, direction=x)),
        ("hold", lambda x: pf.Signal([0, 1], [1, 2], x)),
        ("mounted_on", lambda x: pf.Contact(MODEL, 1.0, x)),
        (
            "on_load_change",
            lambda x: pf.ReducedModelPublished(SQUARE, pf.LuGre(), on_load_change=x),
        ),
        ("load", lambda x: pf.scenes.drift(MODEL, load=x)),
        ("law", pf.families.LAWS.choose),
    ],
)
def test_a_choice_is_a_text(name, call):
    for value in (
        np.array(["x", "y"]),
        np.zeros((2, 2)),
        ["x"],
        {},
        None,
        1,
        10**5000,
        Unready(),
        "x" * 5000,
    ):
        refuses(name, call, value)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: pf.ContactPatch([(0, 0)], [1e-6], grid=5),
            "grid must be a Grid or None, got 5",
        ),
        (
            lambda: pf.LuGre().rate(1.0, [1.0, 2.0], axis=0),
            "axis must be None or the axis of the components",
        ),
        (lambda: pf.LuGre().rate([1.0], [2.0], axis="x"), "axis must be None or"),
        (
            lambda: pf.LuGre().force([1.0, 2.0], [1.0] * 3, 1.0),
            "state and velocity must broadcast, got shapes",
        ),
        (
            lambda: pf.Coulomb(1.0).wrench(5, (1, 0, 0), 1.0),
            "surface must be a limit surface, got 5",
        ),
        (
            lambda: pf.ContactPatch.disc(0.01, pressure=lambda x: 1.0),
            "pressure must be a function of x and y",
        ),
        (
            lambda: pf.ContactPatch.line(0.01, profile=np.linalg.inv),
            r"profile must be a function of x \[m\]",
        ),
        (
            lambda: pf.LimitSurfaceQuartic.fit(np.eye(3), np.eye(3), patch=5),
            "twist must have as many rows",
        ),
        (
            lambda: pf.LimitSurfaceQuartic.fit(
                np.ones((5, 3)), np.ones((5, 3)), patch=5
            ),
            "patch must be a ContactPatch",
        ),
        (
            lambda: pf.Signal.from_csv("x.csv", value=5),
            "value must be the name of a column, or a list of names, got 5",
        ),
        (lambda: pf.Signal.from_csv(5), "path must be a path"),
        (lambda: pf.Signal.from_dict(1.0, folder=5), "folder must be a path"),
        (
            lambda: Grid(0, 0, 1, 1, 2, 2).locate([1.0, 2.0, 3.0]),
            r"positions must have shape \[..., 2\]",
        ),
        (
            lambda: FINGER.weights(np.ones(1_000_000)),
            r"normal_force must be at most \d+ loads for \d+ cells",
        ),
        (
            lambda: dataclasses.replace(SQUARE, cell_size=(-1e-3, 1e-3)),
            "cell_size must be >= 0, got -0.001",
        ),
        (
            lambda: pf.DistributedModel(FINGER, pf.LuGre(), pad=pf.Pad.at_load(2.0)),
            "patch must have a shape that does not depend on the load, for this pad",
        ),
        (
            lambda: SQUARE.weights(2.0, moments=np.zeros((10**7, 2))),
            "moments must be at most 3333333 pairs for 9 cells",
        ),
        (
            lambda: pf.export_c(
                pf.ReducedModel(
                    SQUARE.with_friction_metric(None, (0.1, 0.0)), pf.LuGre()
                ),
                "pad",
            ),
            "model must have no asymmetry",
        ),
        (lambda: pf.scenes.curling(MODEL, twist=1.0), r"twist must have shape \[3\]"),
        (
            lambda: pf.scenes.free_slide(MODEL, twist=1.0),
            r"twist must have shape \[3\]",
        ),
        (lambda: pf.scenes.driven(MODEL, twist=1.0), "twist must have 3 columns"),
        (
            lambda: pf.scenes.in_hand(MODEL, centre_of_mass=1.0),
            r"centre_of_mass must have shape \[2\]",
        ),
        (lambda: pf.patch.PerCell(1.0), r"pressure values must have shape \[any\]"),
        (
            lambda: pf.PressureMaps([1.0], 1.0),
            r"pressure values must have shape \[1, any\]",
        ),
    ],
)
def test_what_was_unchecked(call, message):
    with pytest.raises(InvalidValueError, match=message) as caught:
        call()
    assert str(caught.value).isprintable()


# ---------------------------------------------------------------------- too large, too many


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: pf.ContactPatch.disc(0.01, 10**5),
            r"cells \(rows x columns\) must be at most 1100000 in all, got 1",
        ),
        (lambda: pf.ContactPatch.ring(0.005, 0.01, 10**5), "cells.* must be at most"),
        (
            lambda: pf.ContactPatch.rectangle(0.01, cells=(10**5, 10**5)),
            "cells.* must be at most",
        ),
        (
            lambda: pf.ContactPatch.rectangle(0.01, cells=10**300),
            "cells.* must be at most",
        ),
        (
            lambda: pf.ContactPatch.polygon([(0, 0), (0.1, 0), (0, 0.1)], 10**5),
            "cells.* must be at most",
        ),
        (lambda: pf.ContactPatch.line(0.01, 10**9), "cells must be at most"),
        (
            lambda: pf.ContactPatch.disc_published(0.01, 10**5 + 1),
            "cells.* must be at most",
        ),
        (
            lambda: pf.families.PUBLISHED_PATCHES["Circle"](10**5),
            "cells.* must be at most",
        ),
        (
            lambda: pf.families.PUBLISHED_PATCHES["NonConvex1"](10**5),
            "cells.* must be at most",
        ),
        (
            lambda: pf.families.PUBLISHED_PATCHES["LineGrad"](10**9),
            "cells.* must be at most",
        ),
        (
            lambda: SQUARE.refined(10**5),
            r"cells \(by parts\) must be at most 1100000 in all",
        ),
        (
            lambda: SQUARE.grid_error(refined=10**5),
            r"cells \(by refined\) must be at most 1100000 in all",
        ),
        (
            lambda: pf.ContactPatch.from_pressure(
                np.broadcast_to(1.0, (10**5, 10**5)), 1e-4
            ),
            "hold at most 30000000 n",
        ),
        (
            lambda: pf.Body(1, 1, velocity=np.broadcast_to(1, (10**5, 10**5))),
            "velocity must hold at most",
        ),
        (lambda: SQUARE.moments(10**5), "degree must be at most 40"),
        (lambda: pf.LimitSurfaceTable(SQUARE, 10**5), "segments must be at most 256"),
        (
            lambda: pf.LimitSurfaceTablePublished(SQUARE, 10**5),
            "segments must be at most",
        ),
        (
            lambda: pf.LimitSurfaceQuartic(SQUARE, segments=10**5),
            "segments must be at most",
        ),
        (
            lambda: pf.ReducedModel(SQUARE, pf.LuGre(), cells=0),
            "cells must be an integer >= 1, got 0",
        ),
        (lambda: SQUARE.discs(0), "n must be an integer >= 1, got 0"),
        (
            lambda: ELLIPSOID.compare(ELLIPSOID, samples=10**9),
            "samples must be at most",
        ),
        (
            lambda: SIGNAL.held(1e-12),
            r"dt must be at least 1e-07 s \(at most 10000000 samples up to t_end, 1 s\), got 1e-12",
        ),
        (lambda: pf.Signal.sine(1, 1, 1, t_end=1e10, dt=1e-3), "dt must be at least"),
        (
            lambda: pf.Signal.sine(1, 1, 1, t_end=1e300),
            "t_end must be at most 1e.50 in size, got 1e.300",
        ),
        (
            lambda: pf.Scene(
                pf.Body(1, 1), pf.Contact(MODEL, 1.0), 1.0, save_every=1e-12
            ),
            "save_every must be at least",
        ),
        (
            lambda: pf.Scene(pf.Body(1, 1), pf.Contact(MODEL, 1.0), 1e300),
            "t_end must be at most",
        ),
        (
            lambda: pf.simulate(pf.scenes.in_hand(MODEL), save_every=1e-12),
            "save_every must be at least",
        ),
        (lambda: pf.scenes.in_hand(MODEL, size=[1e200, 1e200]), "size must be at most"),
        (
            lambda: pf.friction_metric(0.0, 1e200, 1.0),
            "along must be at most 1e.50 in size, got 1e.200",
        ),
        (
            lambda: SQUARE.with_friction_metric([[1e200, 0], [0, 1e200]]),
            "metric must be at most",
        ),
        (
            lambda: pf.ContactPatch.disc(1e-170),
            "radius must be at least 1e-50, got 1e-170",
        ),
        (lambda: pf.LuGre(mu_c=5e-324), "mu_c must be at least"),
        (lambda: pf.SoftFinger(c=0.01, n=1e9, k=2.0), "n must be at most 1"),
        (lambda: ELLIPSOID.wrench((1e300, 0, 0)), "twist must be at most"),
        (lambda: pf.LuGre().rate(1e300, 1.0), "state must be at most"),
        (lambda: SQUARE.pressure_values(1.7e308), "normal_force must be at most"),
    ],
)
def test_limits_are_stated_before_memory_is_asked_for(call, message):
    tracemalloc.start()
    try:
        with refused(message):
            call()
        # Bytes: the patch of a scene and NumPy's own tables.
        assert tracemalloc.get_traced_memory()[1] < 2e6
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("load", [5e-324, 1e-300, 1e40])
def test_soft_fingers_have_a_shape_under_any_load(load):
    for law in (
        pf.SoftFinger(c=0.006, n=1.0, k=2.0),
        pf.SoftFinger(c=0.006, n=1 / 3, k_per_newton=1.0),
    ):
        weights = pf.ContactPatch.rectangle(0.02, cells=9, pressure=law).weights(load)
        assert weights.sum() == pytest.approx(1.0, rel=1e-12)


# ---------------------------------------------------------------------- millimetres for metres


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: pf.ContactPatch.disc(10.0, 3),
            "patch 'disc' is 19.8 m wide, larger than 1 m: are its lengths",
        ),
        (
            lambda: pf.ContactPatch.disc(1e-6, 3),
            "patch 'disc' is 1.98e-06 m wide, smaller than 1e-05 m",
        ),
        (
            lambda: pf.ContactPatch.from_pressure([[1.0, 2.0]], 2.0, name="pad"),
            "patch 'pad' is 4 m wide",
        ),
        (
            lambda: pf.ContactPatch.points([(0, 0), (0, 40)]),
            "patch 'points' is 40 m wide",
        ),
    ],
)
def test_a_patch_that_is_hardly_one_comes_with_a_warning(make, words):
    with pytest.warns(UserWarning, match=words) as caught:
        make()
    assert len(caught) == 1


def test_usual_patches_come_without():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for make in (
            lambda: pf.ContactPatch.disc(0.5, 3),
            lambda: pf.ContactPatch.disc(5.1e-6, 3),
            lambda: pf.ContactPatch.points([(3.0, 4.0)]),
        ):
            make()


REDUCED = pf.ReducedModelPublished(SQUARE, pf.LuGre())
BODY = pf.Body(mass=0.2, inertia=1e-4)


@pytest.mark.parametrize(
    ("mistake", "line"),
    [
        (
            lambda: pf.ReducedModel(pf.LuGre(), SQUARE),
            r"patch must be a ContactPatch, got LuGre\(",
        ),
        (
            lambda: pf.LimitSurfaceExact(REDUCED),
            "patch must be a ContactPatch, got ReducedModelPublished",
        ),
        (lambda: pf.ReducedModel(SQUARE, 0.5), "law must be a friction law .* got 0.5"),
        (
            lambda: pf.simulate(REDUCED),
            "scene must be a Scene, got ReducedModelPublished",
        ),
        (
            lambda: pf.Contact(SQUARE, 5.0),
            r"model .* must be a friction model .* got ContactPatch\(",
        ),
        (
            lambda: pf.Contact(REDUCED, "5 N"),
            "normal_force .* must be a number, or a Signal of numbers, got '5 N'",
        ),
        (
            lambda: pf.Contact(REDUCED, [1.0, 2.0]),
            r"normal_force .* a Signal of numbers, got \[1.0, 2.0\]",
        ),
        (
            lambda: pf.Scene(BODY, [pf.Contact(REDUCED, 5.0)], 1.0, force=3.0),
            "force must have 3 columns: be 3 numbers",
        ),
        (
            lambda: pf.Scene([pf.Contact(REDUCED, 5.0)], BODY, 1.0),
            "body must be a Body, got",
        ),
        (
            lambda: pf.ContactPatch.disc(radius="1 cm"),
            "radius must be a number, got '1 cm'",
        ),
        (
            lambda: pf.ContactPatch.disc(0.01, pressure="uniform"),
            r"pressure must be a law such as Uniform\(\).*'uniform'",
        ),
        (
            lambda: pf.ContactPatch.disc(0.01, pressure=pf.SoftFinger),
            "pressure must be a law .* got <class .*SoftFinger",
        ),
        (
            lambda: REDUCED.step(REDUCED.rest, (0.0, 0.0, 1.0), 1.0, 1e-3),
            "state must be an array of numbers, got <bound",
        ),
        (
            lambda: REDUCED.step(REDUCED.rest(), (0.01, 0.0), 1.0, 1e-3),
            r"twist must have shape \[..., 3\], got shape \[2\]",
        ),
    ],
)
def test_a_first_mistake_gets_a_line_that_says_what_is_wanted(mistake, line):
    with refused(f"^{line}"):
        mistake()


def test_python_can_ask_which_name_was_meant():
    """`Did you mean: 'ContactPatch'?`: it looks through what `dir` lists of the object that the error names."""
    with pytest.raises(
        AttributeError, match="has no attribute 'Contactpatch'"
    ) as raised:
        pf.Contactpatch  # noqa: B018
    assert (
        raised.value.name == "Contactpatch"
        and raised.value.obj is pf
        and "ContactPatch" in dir(pf)
    )
