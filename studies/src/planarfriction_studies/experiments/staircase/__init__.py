"""The staircase of a line contact in steady state: plain sum, bilinear smoothing, and the rod that has no steps."""
