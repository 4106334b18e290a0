"""The front ends of tensors that tests run in, one after the other."""

import pytest

from tests.support.front_ends import Jax, Torch

FRONTS = [
    pytest.param(each, marks=getattr(pytest.mark, each.name), id=each.name)
    for each in (Torch, Jax)
]


@pytest.fixture(scope="module", params=FRONTS)
def front(request):
    made = request.param()
    yield made
    made.close()
