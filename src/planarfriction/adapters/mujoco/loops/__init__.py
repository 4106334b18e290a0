"""Compiled part of the adapter: contacts, responses and friction of a step, called by MuJoCo itself."""
