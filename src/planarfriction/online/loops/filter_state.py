"""State of the friction filter: unknowns, the root of their covariance, and what it remembers of samples."""

import numpy as np

from planarfriction.online.loops.square_root import N

TWIST = 3
"""Place of the twist among the unknowns, after what the slip sensor's count left out [m]."""

MU = 6
"""Place of the logarithm of friction."""

RATIO = 7
"""Place of the logarithm of the ratio of static to sliding friction."""

SCALE = 8
"""Place of the logarithm of the scale of the patch."""

BIAS = 9
"""Place of the bias of the wrench."""

STATE = np.dtype(
    [
        ("x", float, N),
        ("root", float, (N, N)),
        *((name, float, 3) for name in ("seen", "place", "sum", "old_sum", "velocity")),
        *(
            (name, float)
            for name in (
                "slip",
                "time",
                "bound",
                "peak",
                "gauge",
                "rest",
                "loads",
                "count",
                "old_loads",
                "old_count",
                "span",
                "chain",
                "back",
                "lever",
                "dissipated",
                "tared",
                "period",
                "steady",
                "misfit",
            )
        ),
    ]
)
"""State of the filter of one part.

- `x`, `root`: unknowns, and the root of their covariance
- `seen`: filtered wrench over load
- `place`: recent displacement
- `sum`, `loads`, `count`: sums of the wrench over load, and of the load, and number of samples since the last velocity
- `old_sum`, `old_loads`, `old_count`: those before the last velocity, with that `velocity` and its time, `span` [s]
- `slip`: probability of slip
- `time`: time of the last sample [s]
- `bound`: log of the largest gauge of the wrench while the part stuck
- `peak`, `gauge`: logs of a recent largest gauge, and of the gauge now
- `rest`: time since the last velocity [s]
- `chain`: number of velocities in a row that were those of sliding
- `back`: number of samples in a row whose time was odd
- `lever`: share of the torque in the gauge of the wrench
- `dissipated`: recent mean of the dissipated power over that of the force times the speed [-]
- `tared`: 1 once the bias is known, as an empty hand showed it, or it is as small as the noise
- `period`: mean time between samples [s], of the number `steady` of them, as far as they count
- `misfit`: recent mean of the squares of the innovations over their variances
"""
