"""Python twins of compiled functions for sources of other compilers, in single precision too (see `kernels.twins`)."""

from __future__ import annotations

from typing import Any

from planarfriction import formulas
from planarfriction.kernels import twins
from planarfriction.kernels.rewriting import Rewriting
from planarfriction.kernels.trace import Mathematics


def _of_decay(own: Any) -> Any:
    """Return the twin of a function of `k dt`, which takes one below zero as zero.

    k is rounded where it vanishes; in single precision a long step makes much of that.
    """
    made = twins.twin(own)
    return lambda xp, decay_dt, *others: made(xp, Mathematics.maximum(decay_dt, 0.0), *others)


_DECAYS = (formulas.relaxation, formulas.relaxation_slope)

twin = Rewriting((*twins.SYMBOLS, *((each, _of_decay(each)) for each in _DECAYS)), twins.NAMES, twins.finished)
"""Twin of a function, a module or a record of functions; anything else is its own twin."""
