"""Classics: the experiments of the LuGre paper, each beside an integration without this library."""
