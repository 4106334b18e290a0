"""Convergence of both models in the number of cells, and of the reduced one in the segments of its table."""
