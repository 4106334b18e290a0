"""Solver of a planar body on contacts, with the tangent and the adjoint of its motion."""
