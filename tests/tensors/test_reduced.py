"""The reduced model in PyTorch and JAX: the numbers of NumPy's, and one line for the options that it had."""

import importlib

import pytest

import planarfriction as pf

FRONTS = [
    pytest.param(name, marks=getattr(pytest.mark, name)) for name in ("jax", "torch")
]
LAW = pf.LuGre(mu_c=0.3, mu_s=0.4, elasto_plastic=0.9)


@pytest.fixture(params=FRONTS)
def front(request):
    pytest.importorskip(request.param)
    return importlib.import_module(f"planarfriction.{request.param}")
