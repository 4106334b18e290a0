"""Rosenbrock methods: tables of coefficients, in the transformed form of Hairer and Wanner (Solving ODEs II, IV.7).

`(I/(h gamma) - J) k_i = f(t + alpha_i h, y + sum a_ij k_j) + sum c_ij k_j / h + g_i h df/dt`, `y_1 = y + sum m_j k_j`.
Both methods are L-stable and stiffly accurate; the last stage is the error estimate.
"""

from __future__ import annotations

import numpy as np

from planarfriction._engine.body.integration import Method
from planarfriction._support.equality import by_parts

by_parts(Method)  # kernels hold loops and nothing else


def _lower(*rows: tuple[float, ...]) -> np.ndarray:
    table = np.zeros((len(rows) + 1, len(rows) + 1))
    for i, row in enumerate(rows, start=1):
        table[i, : len(row)] = row
    return table


RODAS3 = Method(
    gamma=0.5,
    a=_lower((0.0,), (2.0, 0.0), (2.0, 0.0, 1.0)),
    c=_lower((4.0,), (1.0, -1.0), (1.0, -1.0, -8.0 / 3.0)),
    m=np.array([2.0, 0.0, 1.0, 1.0]),
    alpha=np.array([0.0, 0.0, 1.0, 1.0]),
    time_gamma=np.array([0.5, 1.5, 0.0, 0.0]),
    dense=np.array([[3.0, -1.0, 0.0, 0.0]]),
    order=3.0,
)
"""Order 3(2), four stages, three right-hand sides. Source: Sandu et al. 1997, Atmospheric Environment 31."""

_RODAS4_LAST = (
    1.221224509226641,
    6.019134481288629,
    12.53708332932087,
    -0.687886036105895,
)
RODAS4 = Method(
    gamma=0.25,
    a=_lower(
        (1.544,),
        (0.9466785280815826, 0.2557011698983284),
        (3.314825187068521, 2.896124015972201, 0.9986419139977817),
        _RODAS4_LAST,
        (*_RODAS4_LAST, 1.0),
    ),
    c=_lower(
        (-5.6688,),
        (-2.430093356833875, -0.2063599157091915),
        (-0.1073529058151375, -9.594562251023355, -20.47028614809616),
        (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160),
        (
            8.083246795921522,
            -7.981132988064893,
            -31.52159432874371,
            16.31930543123136,
            -6.058818238834054,
        ),
    ),
    m=np.array([*_RODAS4_LAST, 1.0, 1.0]),
    alpha=np.array([0.0, 0.386, 0.21, 0.63, 1.0, 1.0]),
    time_gamma=np.array([0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0]),
    dense=np.array(
        [
            [
                10.12623508344586,
                -7.487995877610167,
                -34.80091861555747,
                -7.992771707568823,
                1.025137723295662,
                0.0,
            ],
            [
                -0.6762803392801253,
                6.087714651680015,
                16.43084320892478,
                24.76722511418386,
                -6.594389125716872,
                0.0,
            ],
        ]
    ),
    order=4.0,
)
"""Order 4(3), six stages and right-hand sides, continuous extension of order 3. Source: Hairer and Wanner, RODAS."""


def _named(self: Method) -> str:
    name = next(
        (
            name
            for name, each in (("RODAS4", RODAS4), ("RODAS3", RODAS3))
            if each == self
        ),
        "one of your own",
    )
    return f"Method({name}, order {self.order:g}, {len(self.m)} stages)"


Method.__repr__ = _named  # tables of coefficients tell a reader nothing
