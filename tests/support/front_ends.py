"""PyTorch and JAX behind one interface, so that a test is written once for both."""

import importlib

import numpy as np
import pytest


class Torch:
    """PyTorch, in double precision unless a model is single."""

    name = "torch"

    def __init__(self):
        self.library = pytest.importorskip("torch")
        self.models = importlib.import_module("planarfriction.torch")

    def _dtype(self, single):
        return self.library.float32 if single else self.library.float64

    def model(self, patch, law, kind="DistributedModel", single=False, **options):
        made = getattr(self.models, kind)
        return made(patch, law, dtype=self._dtype(single), **options)

    def array(self, value, single=False):
        return self.library.tensor(np.asarray(value), dtype=self._dtype(single))

    def arrays(self, *values, single=False):
        return [self.array(each, single) for each in values]

    def plain(self, array):
        return array.detach().numpy()

    def grad(self, function):
        return self.library.func.grad(function)

    def slopes(self, function, *values):
        """Return derivatives of a function for a batch, by all its arguments."""
        func = self.library.func
        return func.vmap(func.jacrev(function, tuple(range(len(values)))))(*values)

    def forget(self):
        """Forget what was traced: nothing was."""

    def traced(self, function, value):
        """Call a function so that it cannot look at its value."""
        return self.library.vmap(function)(self.array([value]))[0]

    def close(self):
        pass


class Jax:
    """JAX, in the precision of `jax_enable_x64`: double unless a model is single."""

    name = "jax"

    def __init__(self):
        self.library = pytest.importorskip("jax")
        self.models = importlib.import_module("planarfriction.jax")
        self.before = self.library.config.jax_enable_x64
        self._double(True)

    def _double(self, wanted):
        self.library.config.update("jax_enable_x64", wanted)

    def model(self, patch, law, kind="DistributedModel", single=False, **options):
        self._double(not single)
        return getattr(self.models, kind)(patch, law, **options)

    def array(self, value, single=False):
        dtype = "float32" if single else "float64"
        return self.library.numpy.asarray(value, dtype=dtype)

    def arrays(self, *values, single=False):
        return [self.array(each, single) for each in values]

    def plain(self, array):
        return np.asarray(array)

    def grad(self, function):
        """Return the gradient as one program, not operation by operation."""
        return self.library.jit(self.library.grad(function))

    def slopes(self, function, *values):
        """Return derivatives of a function for a batch, by all its arguments."""
        jax = self.library
        every = tuple(range(len(values)))
        return jax.jit(jax.vmap(jax.jacrev(function, every)))(*values)

    def forget(self):
        """Forget what was traced, with the constants that it was traced with."""
        self.library.clear_caches()

    def traced(self, function, value):
        """Call a function so that it cannot look at its value."""
        return self.library.jit(function)(self.array(value))

    def close(self):
        self._double(self.before)
