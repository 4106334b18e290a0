"""Functions of models as the solver calls them."""

import pytest

import planarfriction as pf
from planarfriction._engine.protocol import ARGUMENTS, ModelFunctions, calls_of
from tests.support.refusals import refused

PATCH = pf.ContactPatch.disc(0.01, 7)


@pytest.mark.parametrize("kind", [pf.ReducedModelPublished, pf.DistributedModel])
def test_numbers_of_arguments_are_those_of_the_library(kind):
    functions = kind(PATCH, pf.LuGre()).packed([2.0]).functions
    assert calls_of(functions, change=True).all()


def test_a_function_with_other_arguments_is_refused():
    """Compiled callers would read and write elsewhere."""
    functions = pf.ReducedModelPublished(PATCH, pf.LuGre()).packed([2.0]).functions
    assert ARGUMENTS.linearise != ARGUMENTS.evaluate
    for name in ModelFunctions._fields[:2]:
        other = functions.linearise if name == "evaluate" else functions.evaluate
        with refused(f"{name} must take"):
            calls_of(functions._replace(**{name: other}))
