"""Public objects are values: they compare, copy and pickle; errors travel between processes."""

import concurrent.futures
import copy
import multiprocessing
import pickle

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import errors, identify, solvers
from planarfriction.errors import (
    FileError,
    IdentificationInterrupted,
    InvalidValueError,
    MissingExtraError,
    SimulationInterrupted,
    SolverError,
    SweepError,
    SweepInterrupted,
)
from planarfriction.patch import PerCell
from tests.support.contacts import SOFT as FINGER

SQUARE = pf.ContactPatch.rectangle(0.02, cells=5)
LAW = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
TIMES = np.linspace(0.0, 1.0, 30)


def used(model):
    """A model that has stored what it stores in use."""
    model.step(model.rest(), (0.1, 0.0, 1.0), 1.3, 1e-3)
    return model


def a_solution():
    return pf.simulate(pf.scenes.in_hand(pf.ReducedModel(SQUARE, LAW), t_end=0.05))


def an_identification():
    nothing = np.full(1, np.nan)
    history = {
        "name": "log",
        "time": TIMES,
        "measured": np.ones((30, 3)),
        "predicted": np.zeros((30, 3)),
    }
    model = pf.ReducedModel(SQUARE, LAW)
    return identify.Identification(
        ("mu_c",),
        np.ones(1),
        nothing,
        np.eye(1),
        (),
        nothing,
        (("fx", "N"),),
        (history,),
        LAW,
        model,
        (1, 2),
    )


MODELS = {
    f"{kind.__name__} of a {name}": lambda kind=kind, patch=patch: used(
        kind(patch, LAW)
    )
    for kind in (pf.DistributedModel, pf.ReducedModel, pf.ReducedModelPublished)
    for name, patch in (("square", SQUARE), ("finger", FINGER))
}
SURFACES = {
    kind.__name__: lambda kind=kind: kind(SQUARE)
    for kind in (
        pf.LimitSurfaceCells,
        pf.LimitSurfaceExact,
        pf.LimitSurfaceTable,
        pf.LimitSurfaceTablePublished,
        pf.LimitSurfaceEllipsoid,
        pf.LimitSurfaceQuartic,
    )
}
MAKERS = {
    **MODELS,
    **SURFACES,
    "patch": lambda: pf.ContactPatch.rectangle(0.02, cells=5),
    "disc": lambda: pf.ContactPatch.disc(0.01, 5),
    "polygon": lambda: pf.ContactPatch.polygon([(0, 0), (0.1, 0), (0, 0.1)], 5),
    "outline": lambda: pf.ContactPatch.polygon([(0, 0), (0.1, 0), (0, 0.1)], 5).outline,
    "points": lambda: pf.ContactPatch.points([(0.0, 0.0), (0.1, 0.0)], [1.0, 2.0]),
    "grain": lambda: SQUARE.with_friction_metric(
        pf.friction_metric(0.3, 1.0, 2.0), (0.1, 0.2)
    ),
    "maps": lambda: pf.ContactPatch.from_pressure(
        [np.ones((2, 2)), np.eye(2)], 0.01, loads=[1.0, 2.0]
    ),
    "grid": lambda: pf.ContactPatch.disc(0.01, 6).grid,
    "uniform": pf.Uniform,
    "gradient": lambda: pf.LinearGradient((1.0, 2.0)),
    "soft": lambda: pf.SoftFinger(c=0.01, k=2.0),
    "per cell": lambda: PerCell([1.0, 2.0]),
    "pressure maps": lambda: pf.PressureMaps([1.0, 2.0], [[1.0, 2.0], [2.0, 1.0]]),
    "LuGre": lambda: pf.LuGre(mu_s=1.5),
    "elasto-plastic LuGre": lambda: pf.LuGre(mu_s=1.5, elasto_plastic=0.5),
    "Dahl": pf.Dahl,
    "Coulomb with Stribeck": pf.CoulombStribeck,
    "Coulomb": lambda: pf.Coulomb(0.4),
    "elasto-plastic": lambda: pf.ElastoPlastic(0.5),
    "signal": lambda: pf.Signal([0, 1], [1, 2], "linear"),
    "vector signal": lambda: pf.Signal.constant([1, 2, 3]),
    "body": lambda: pf.Body(1, 1, outline=[[0, 0], [0, 1], [1, 1]]),
    "contact": lambda: pf.Contact(pf.DistributedModel(SQUARE, LAW), 1.0),
    "scene": lambda: pf.scenes.drift(pf.ReducedModel(SQUARE, LAW)),
    "statistics": lambda: solvers.Statistics(steps=3),
    "RODAS4": lambda: copy.deepcopy(solvers.RODAS4),
    "RODAS3": lambda: copy.deepcopy(solvers.RODAS3),
    "comparison": lambda: SURFACES["LimitSurfaceCells"]().compare(
        SURFACES["LimitSurfaceEllipsoid"]()
    ),
    "jacobians": lambda: MODELS["ReducedModelPublished of a square"]().jacobians(
        np.zeros(3), (0.1, 0.0, 0.0), 1.0
    ),
    "step jacobians": lambda: MODELS[
        "ReducedModelPublished of a square"
    ]().step_jacobians(np.zeros(3), (1, 0, 0), 1.0, 1e-3),
    "published shape": lambda: MODELS["ReducedModelPublished of a finger"]().shape_at(
        1.0
    ),
    "surface numbers": lambda: SURFACES["LimitSurfaceTable"]().numbers,
    "rollout": lambda: pf.rollout(
        MODELS["DistributedModel of a square"](), None, np.ones((5, 3)), 1.0, 1e-3
    ),
    "log": lambda: identify.Log(TIMES, np.ones((30, 3)), np.ones((30, 3)), 1.0),
    "slide": lambda: identify.Slide(TIMES, np.ones((30, 3))),
    "mass properties": lambda: identify.MassProperties(1.0, 1.0),
    "identification": an_identification,
    "laws": lambda: pf.families.LAWS,
}


@pytest.mark.parametrize("name", MAKERS)
def test_objects_of_equal_content_are_equal_however_they_came(name):
    made = MAKERS[name]()
    others = {
        "made again": MAKERS[name](),
        "copied": copy.copy(made),
        "copied deeply": copy.deepcopy(made),
        "from a pickle": pickle.loads(pickle.dumps(made)),
    }
    for how, other in others.items():
        assert (made == other) is True and (made != other) is False, how
        if type(made).__hash__ is not None:
            assert hash(made) == hash(other), how


def test_everything_compares_with_everything():
    made = {name: make() for name, make in MAKERS.items()}
    for name, one in made.items():
        for other_name, other in [
            *made.items(),
            ("number", 1.0),
            ("none", None),
            ("text", "x"),
        ]:
            assert (one == other) is (name == other_name), (name, other_name)


def test_what_differs_is_not_equal():
    assert pf.ContactPatch.disc(0.01, 5) != pf.ContactPatch.disc(0.01, 5, name="other")
    assert pf.ContactPatch.points([(0, 0), (0.1, 0)]) != pf.ContactPatch.points(
        [(0, 0), (0.1, 0)], [1.0, 2.0]
    )
    assert pf.Body(1, 1, outline=[[0, 0], [0, 1], [1, 1]]) != pf.Body(1, 1)
    assert pf.ReducedModel(SQUARE, LAW) != pf.ReducedModel(SQUARE, LAW, cells=8)
    assert pf.ReducedModelPublished(SQUARE, LAW) != pf.ReducedModelPublished(
        SQUARE, LAW, surface=SURFACES["LimitSurfaceTable"]()
    )
    assert pf.LimitSurfaceTable(SQUARE) != pf.LimitSurfaceTable(SQUARE, 10)
    assert solvers.RODAS4._replace(a=2.0 * solvers.RODAS4.a) != solvers.RODAS4
    assert pf.Signal([0, 1], [1, 2]) != pf.Signal([0, 1], [1, 2], "linear")
    assert {SQUARE: 1}[pf.ContactPatch.rectangle(0.02, cells=5)] == 1


def test_solutions(tmp_path):
    solution = a_solution()
    for other in (
        copy.deepcopy(solution),
        pickle.loads(pickle.dumps(solution)),
        pf.Solution.load(solution.save(tmp_path / "x.nc")),
    ):
        assert (solution == other) is True and hash(solution) == hash(other)
        other.data.x[-1] += 1.0
        assert (solution == other) is False
    model = pickle.loads(pickle.dumps(solution)).scene.contacts[0].model
    state, wrench = used(model).step(model.rest(), (0.1, 0.0, 1.0), 1.3, 1e-3)
    here = solution.scene.contacts[0].model.step(
        model.rest(), (0.1, 0.0, 1.0), 1.3, 1e-3
    )
    assert state.tolist() == here[0].tolist() and wrench.tolist() == here[1].tolist()


# ---------------------------------------------------------------------- errors

RAISED = {
    "value": InvalidValueError("mu_s", "be >= mu_c", 0.3),
    "array": InvalidValueError("x", "be finite", [1.0, 2.0]),
    "file": FileError("x.csv: no such file"),
    "extra": MissingExtraError("torch", "torch"),
    "solver": SolverError("at t = 1 s: step size fell below", None),
    "interrupted": SimulationInterrupted(None),
    "identification interrupted": IdentificationInterrupted({"mu_c": 0.5}),
    "sweep": SweepError("the executor ended"),
    "sweep interrupted": SweepInterrupted("1 of 2 done", None),
    "base": errors.FrictionError("no"),
}


def test_no_class_of_errors_is_left_out():
    classes = {
        kind
        for kind in vars(errors).values()
        if isinstance(kind, type) and issubclass(kind, BaseException)
    }
    assert {type(error) for error in RAISED.values()} == classes


@pytest.mark.parametrize("name", RAISED)
@pytest.mark.parametrize(
    "way", [copy.copy, copy.deepcopy, lambda error: pickle.loads(pickle.dumps(error))]
)
def test_errors_keep_message_and_attributes(name, way):
    error = RAISED[name]
    again = way(error)
    assert (
        type(again) is type(error)
        and str(again) == str(error)
        and again.args == error.args
    )
    assert vars(again) == vars(error)


def test_errors_keep_what_was_computed():
    solution = a_solution()
    for error in (SolverError("gave up", solution), SimulationInterrupted(solution)):
        assert pickle.loads(pickle.dumps(error)).solution == solution


def test_an_attribute_that_cannot_be_pickled_stays_behind():
    error = pickle.loads(
        pickle.dumps(InvalidValueError("radius", "be a number", lambda: 1.0))
    )
    assert error.value is None and error.name == "radius" and "function" in str(error)


def _radius(radius):
    return float(pf.ContactPatch.disc(radius, 5).contact_radius())


def test_a_bad_parameter_in_a_worker_arrives():
    # Forks copy the threads of other tests.
    spawned = multiprocessing.get_context("spawn")
    with spawned.Pool(1) as pool:
        result = pool.map_async(_radius, [0.01, -1.0, 0.02])
        with pytest.raises(
            InvalidValueError, match=r"radius must be > 0, got -1\.0"
        ) as caught:
            result.get(timeout=120.0)
        assert (caught.value.name, caught.value.rule, caught.value.value) == (
            "radius",
            "be > 0",
            -1.0,
        )
        assert pool.apply_async(_radius, [0.01]).get(timeout=60.0) == _radius(0.01)
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=spawned) as executor:
        futures = [executor.submit(_radius, radius) for radius in ("wide", 0.01)]
        assert isinstance(futures[0].exception(timeout=120.0), InvalidValueError)
        assert futures[1].result(timeout=60.0) == _radius(0.01)
