"""Functions written from other functions: symbols, derivatives, twins, and the vectors that all are written in."""
