"""Friction of chosen contacts inside simulators that people already use, one package each."""
