"""What the runs cost: the paper's table on this machine, and work against precision for ours and SciPy's solvers."""
