"""Wrong contact patches are refused in one clear line."""

import math

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.patch import Grid, LinearGradient, Pressure, Uniform
from tests.support.refusals import refused

SQUARE = pf.ContactPatch.rectangle(0.02, cells=3)
FINGER = pf.ContactPatch.rectangle(
    0.02, cells=21, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0)
)
GOOD = SQUARE.to_dict()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: pf.ContactPatch.disc(0.0), "radius must be > 0, got 0.0"),
        (lambda: pf.ContactPatch.disc(math.nan), "radius must be finite, got nan"),
        (
            lambda: pf.ContactPatch.ring(0.1, 2e27),
            r"outer_radius must be at most 1e\+24, got 2e\+27",
        ),
        (
            lambda: pf.ContactPatch.polygon([(0, 0), (1e25, 0), (0, 1)]),
            r"vertices must be at most 1e\+24 in size",
        ),
        (
            lambda: pf.ContactPatch.disc(0.01, cells=0),
            "cells must be an integer >= 1, got 0",
        ),
        (lambda: pf.ContactPatch.disc_published(0.01, 20), "cells must be odd"),
        (
            lambda: pf.ContactPatch.rectangle(0.02, cells=(3, 2.5)),
            r"cells\[1\] must be an integer >= 1",
        ),
        (
            lambda: pf.ContactPatch.rectangle(0.02, cells=np.zeros(2)),
            r"cells\[0\] must be an integer >= 1, got 0.0",
        ),
        (
            lambda: pf.ContactPatch.rectangle(0.02, cells=(3, 2, 1)),
            r"cells must have shape \[2\]",
        ),
        (
            lambda: pf.ContactPatch.ring(0.02, 0.01),
            "inner_radius must be < outer_radius, got 0.02 and 0.01",
        ),
        (
            lambda: pf.ContactPatch.line(0.02, direction="z"),
            "direction must be one of x, y, got 'z'",
        ),
        (
            lambda: pf.ContactPatch.line(0.02, 3, profile=[1, 2]),
            r"profile must have shape \[3\], got shape \[2\]",
        ),
        (
            lambda: pf.ContactPatch.line(0.02, 3, profile=[1, -2, 1]),
            r"profile must be >= 0, got -2.0 at index \(1,\)",
        ),
        (
            lambda: pf.ContactPatch.line(0.02, 3, profile=lambda s: s),
            "pressure must be >= 0, got -0.00666",
        ),
        (
            lambda: pf.ContactPatch.polygon([(0, 0), (1, 1)]),
            "vertices must hold at least 3 points",
        ),
        (
            lambda: pf.ContactPatch.polygon([(0, 0), (1, 0), (2, 0)]),
            "vertices must enclose an area",
        ),
        (
            lambda: pf.ContactPatch.polygon([(0, 0), (1, 1), (1, 0), (0, 1)]),
            "simple polygon, got Self-intersection",
        ),
        (lambda: pf.ContactPatch.points([]), "positions must have shape"),
        (
            lambda: pf.ContactPatch.points(np.empty((0, 2))),
            "patch must have at least one cell",
        ),
        (
            lambda: pf.ContactPatch.points([(0, 0), (1, math.inf)]),
            r"positions must be finite, got inf at index \(1, 1\)",
        ),
        (
            lambda: pf.ContactPatch.points([(0, 0)], [-1]),
            "weights must be >= 0, got -1.0",
        ),
        (
            lambda: pf.ContactPatch.points([(0, 0)], [0]),
            "pressure must be > 0 on at least one cell",
        ),
        (
            lambda: pf.ContactPatch.rectangle(0.02, pressure=lambda x, y: math.nan),
            "pressure must be finite, got nan",
        ),
        (
            lambda: pf.ContactPatch.rectangle(0.02, pressure=lambda x, y: 0.0),
            "pressure must be > 0 on at least one cell",
        ),
        (
            lambda: pf.ContactPatch.rectangle(
                0.02, cells=3, pressure=LinearGradient((200.0, 0.0))
            ),
            r"pressure must be >= 0, got -0.33\d* at index 0, position \(-0.00666667, 0.00666667\) m",
        ),
        (
            lambda: pf.ContactPatch(np.zeros((2, 2)), [1.0, 0.0]),
            "areas must be > 0, got 0.0 at index 1",
        ),
        (
            lambda: pf.ContactPatch(np.zeros((2, 2)), [1.0]),
            r"areas must have shape \[2\]",
        ),
        (lambda: LinearGradient((1.0,)), r"gradient must have shape \[2\]"),
        (
            lambda: pf.SoftFinger(c=0.01),
            "exactly one of k and k_per_newton, got k=None, k_per_newton=None",
        ),
        (
            lambda: pf.SoftFinger(c=0.01, k=2, k_per_newton=2),
            "exactly one of k and k_per_newton",
        ),
        (lambda: pf.SoftFinger(c=0.01, k=0), "k must be > 0"),
        (lambda: pf.SoftFinger(c=-0.01, k=2), "c must be > 0"),
        (lambda: pf.SoftFinger(c=0.01, n=-1, k=2), "n must be >= 0"),
        (lambda: FINGER.weights(), "normal_force must be given"),
        (lambda: FINGER.contact_radius(), "normal_force must be given"),
        (
            lambda: FINGER.weights(-1.0),
            "normal_force must be finite and >= 0, got -1.0",
        ),
        (
            lambda: SQUARE.weights([1.0, math.nan]),
            "normal_force must be finite and >= 0",
        ),
        (lambda: SQUARE.moments(-1), "degree must be an integer >= 0"),
        (lambda: Grid(0, 0, 1, -1, 3, 3), "cell_height must be > 0"),
        (
            lambda: pf.ContactPatch.from_dict({**GOOD, "postions": []}),
            "did you mean 'positions'",
        ),
        (
            lambda: pf.ContactPatch.from_dict({"areas": [1.0]}),
            "patch must have the key 'positions', got areas",
        ),
        (
            lambda: pf.ContactPatch.from_dict({**GOOD, "shape": "disc"}),
            "patch shape must be one of cells, got 'disc'",
        ),
        (
            lambda: pf.ContactPatch.from_dict({**GOOD, "grid": {"x_min": 0.0}}),
            "grid must have the key 'y_min'",
        ),
        (
            lambda: pf.ContactPatch.from_dict([1, 2]),
            "patch must be a table of keys and values",
        ),
        (lambda: Pressure.from_dict({"law": "unifrom"}), "did you mean 'uniform'"),
        (
            lambda: Pressure.from_dict({"law": "linear_gradient"}),
            "pressure must have the key 'gradient'",
        ),
        (
            lambda: Pressure.from_dict({"law": "soft_finger", "c": 0.01, "kk": 2.0}),
            "did you mean 'k'",
        ),
        (lambda: Pressure.from_dict({}), "pressure must be a table with law"),
    ],
)
def test_every_mistake_gets_one_line(call, message):
    with refused(message):
        call()


def test_a_law_of_ones_own_cannot_make_nan():
    class Vanishing(Uniform):
        @property
        def depends_on_load(self):
            return True

        def relative(self, positions, normal_force=None):
            load = np.asarray(1.0 if normal_force is None else normal_force)[..., None]
            return np.where(load < 2.0, 1.0, 0.0) * np.ones(len(positions))

    patch = pf.ContactPatch.rectangle(0.02, cells=3, pressure=Vanishing())
    assert patch.weights(1.0) == pytest.approx([1 / 9] * 9)
    with refused("pressure must be > 0 on at least one cell at every load"):
        patch.weights(3.0)
