"""Compiled loops over the formulas: steps, rates, their derivatives, and the solver of scenes."""

from planarfriction.compiler import callback as callback
from planarfriction.compiler import compiled_math as compiled_math
from planarfriction.compiler import entry as entry
from planarfriction.compiler import jit as jit
from planarfriction.compiler import kernel as kernel
