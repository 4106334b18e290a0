"""Compiled loops of the observer and of the controllers."""
