"""Derivatives of limit surfaces in scaled coordinates about the centre of pressure, and their differences."""

from __future__ import annotations

import numpy as np


def unit_twists(surface) -> np.ndarray:
    """Return the twists of unit scaled coordinates, as rows."""
    return np.linalg.inv(surface._frame()).T


def scaled_jacobian(surface, twist) -> np.ndarray:
    """Return `dW/dV` in scaled coordinates."""
    units = unit_twists(surface)
    return units @ surface.jacobian(twist) @ units.T


def gradient_error(surface, twist, step: float = 1e-6) -> float:
    """Return the largest difference of wrenches from the slope of the dissipation, by central differences."""
    units = unit_twists(surface)
    slopes = [
        surface.dissipation(twist + step * unit)
        - surface.dissipation(twist - step * unit)
        for unit in units
    ]
    pull = -surface.wrench(twist) @ units.T
    return np.abs(pull - np.stack(slopes, -1) / (2.0 * step)).max()


def jacobian_error(surface, twist, step: float = 1e-6) -> float:
    """Return the largest difference of Jacobians from the slope of the wrench, by central differences."""
    units = unit_twists(surface)
    slopes = [
        surface.wrench(twist + step * unit) - surface.wrench(twist - step * unit)
        for unit in units
    ]
    wanted = units @ np.stack(slopes, -1) / (2.0 * step)
    return np.abs(scaled_jacobian(surface, twist) - wanted).max()
