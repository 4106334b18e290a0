"""Costs of the runs: the paper's table on this machine, and work against precision for ours and SciPy's solvers."""
