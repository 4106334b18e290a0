"""Tables of the Rosenbrock methods: conditions of their orders, stiff accuracy, continuous extensions."""

from typing import NamedTuple

import numpy as np
import pytest

from planarfriction.solvers import RODAS3, RODAS4


class Form(NamedTuple):
    """A method as `k_i = h f(y + sum alpha_ij k_j) + h J sum gamma_ij k_j`, `y_1 = y + sum b_j k_j`."""

    alpha: np.ndarray
    gamma: np.ndarray

    @classmethod
    def of(cls, method):
        gamma = np.linalg.inv(np.eye(len(method.m)) / method.gamma - method.c)
        return cls(method.a @ gamma, gamma)

    def defect(self, m, order, share=1.0):
        """Return the largest defect of the order conditions of `sum m_j k_j` at a share of the step.

        Source: Hairer and Wanner, Solving ODEs II, table IV.7.1.
        """
        beta = self.alpha + self.gamma
        a = self.alpha.sum(axis=1)
        b = beta.sum(axis=1)
        conditions = [
            (1, 1.0, np.ones(len(m))),
            (2, 1.0 / 2.0, b),
            (3, 1.0 / 3.0, a**2),
            (3, 1.0 / 6.0, beta @ b),
            (4, 1.0 / 4.0, a**3),
            (4, 1.0 / 8.0, a * (self.alpha @ b)),
            (4, 1.0 / 12.0, beta @ a**2),
            (4, 1.0 / 24.0, beta @ beta @ b),
        ]
        weights = m @ self.gamma
        return max(
            abs(weights @ tree - share**power * value)
            for power, value, tree in conditions
            if power <= order
        )


every_method = pytest.mark.parametrize(
    ("method", "order", "between"), [(RODAS3, 3, 2), (RODAS4, 4, 3)], ids=repr
)
TABLE = 1e-13
"""Sums of coefficients that are printed to 16 digits."""


@every_method
def test_steps_and_their_estimates_have_their_orders(method, order, between):
    form = Form.of(method)
    assert form.defect(method.m, order) < TABLE
    # The last stage is the estimate.
    assert form.defect(np.append(method.m[:-1], 0.0), order - 1) < TABLE


@every_method
def test_the_continuous_extension_has_its_order(method, order, between):
    form = Form.of(method)
    for share in (0.2, 0.5, 0.9):
        bend = share ** np.arange(len(method.dense)) @ method.dense
        weights = share * (method.m + (1.0 - share) * bend)
        assert form.defect(weights, between, share) < TABLE


@every_method
def test_stages_are_where_they_say_and_the_last_is_the_step(method, order, between):
    """The last row of `alpha + gamma` are the weights: stiffly accurate, so that stiff bristles follow at once."""
    alpha, gamma = form = Form.of(method)
    assert alpha.sum(axis=1) == pytest.approx(method.alpha, abs=TABLE)
    assert gamma.sum(axis=1) == pytest.approx(method.time_gamma, abs=TABLE)
    assert (alpha + gamma)[-1] == pytest.approx(method.m @ gamma, abs=TABLE)
    assert np.diag(form.gamma) == pytest.approx(method.gamma)
