"""Checks of input, files, equality and help texts, which every part of the library uses."""
