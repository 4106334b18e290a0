"""Compiled loops of joints."""
