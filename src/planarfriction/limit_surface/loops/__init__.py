"""Compiled search for points of limit surfaces: exact sums over shapes, and the twist that has a given wrench."""
