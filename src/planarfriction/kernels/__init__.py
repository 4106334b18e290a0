"""Compiled loops over the formulas: steps, rates, their derivatives, and the solver of scenes."""
