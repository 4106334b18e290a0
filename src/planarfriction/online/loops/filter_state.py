"""Layout of the state of the friction filter: unknowns, root of their covariance, and what it remembers of samples."""

from __future__ import annotations

from planarfriction.online.loops.square_root import ROOT, N

TWIST = 3
"""Place of the twist, after the remainder of the count [m], which is the error of a
place."""

MU = 6
"""Place of the logarithm of friction."""

RATIO = 7
"""Place of the ratio of static to sliding friction."""

SCALE = 8
"""Place of the scale of the patch."""

BIAS = 9
"""Place of the bias of the wrench."""

# Places of what the filter remembers:
SLIP = ROOT + N * N  # the probability of slip, the first after the root
TIME = SLIP + 1  # the time [s]
BOUND = TIME + 1  # the log of the largest gauge of the wrench while it stuck
PEAK = BOUND + 1  # the log of a recent largest gauge
GAUGE = PEAK + 1  # the log of the gauge now
SEEN = GAUGE + 1  # the filtered wrench over load (3)
PLACE = SEEN + 3  # the recent displacement (3)
REST = PLACE + 3  # the time since the last velocity [s]
SUM = REST + 1  # the sum of the wrench over load since the last velocity (3)
LOADS = SUM + 3  # the sum of the load since the last velocity
COUNT = LOADS + 1  # the number of samples since the last velocity
# Sum (3), loads and count of the samples before the last velocity, with that velocity (3) and its time.
OLD = COUNT + 1
CHAIN = OLD + 9  # the number of velocities in a row that were those of sliding
BACK = CHAIN + 1  # the number of samples in a row whose time was odd
LEVER = BACK + 1  # the share of the torque in the gauge of the wrench
# The recent mean of the dissipated power over that of the force times the speed [-].
DISSIPATED = LEVER + 1
# 1 once the bias is known: an empty hand showed it, or it is as small as the noise.
TARED = DISSIPATED + 1
PERIOD = TARED + 1  # the mean time between samples [s]
# The number of samples of which it is the mean, as far as they count.
STEADY = PERIOD + 1
# The recent mean of the squares of the innovations over their variances.
MISFIT = STEADY + 1
STATE = MISFIT + 1  # length of the state
