"""Steps of the distributed model where friction depends on the direction: each cell steps as one cell alone would.

In a step the twist is held, and with it the place `c = a g/sigma_0` that a bristle decays towards: `z - c` steps as the
bristle of an isotropic cell driven by `u = L v`, and its traction is that cell's less `sigma_0 c = g a`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction import formulas
from planarfriction.compiled.base import StepJacobians
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import distributed_step as kernels

_ALONE = kernels.Cells(np.zeros(1), np.zeros(1), np.ones((1, 1)))


def cell_numbers(patch: Any, cells: np.ndarray) -> np.ndarray:
    """Return the numbers of the chosen cells, `[7, n]`, as `kernels.cells` reads them."""
    levers, asymmetry = patch.levers()[cells], patch.asymmetries()[cells]
    return np.array([*(levers[:, i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2))), *asymmetry.T])


def centres(law: LawNumbers, asymmetry: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return `c = a g(|u|)/sigma_0` `[..., 2, N]` and `dc/du` `[..., 2, 2, N]` of `a` `[2, N]`, `u` `[..., 2, N]`."""
    speed = np.hypot(velocity[..., 0, :], velocity[..., 1, :])
    g, slope = formulas.stribeck(np, speed, law), formulas.stribeck_slope(np, speed, law)
    heading = velocity / np.where(speed > 0.0, speed, 1.0)[..., None, :]
    along = asymmetry[:, None, :] * heading[..., None, :, :]
    return asymmetry * (g / law.sigma_0)[..., None, :], along * (slope / law.sigma_0)[..., None, None, :]


def step(
    compiled: Any, state: np.ndarray, twist: np.ndarray, load: np.ndarray, dt: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Step the cells of a `CompiledDistributed` (see `CompiledModel.step`)."""
    law, patch = compiled.law.numbers, compiled.patch
    lever, asymmetry = compiled.lever, compiled.asymmetry
    velocity = np.einsum("...d,dcn->...cn", twist, lever)
    centre = 0.0 if asymmetry is None else centres(law, asymmetry, velocity)[0]
    z, u, steps = _alone(state - centre, velocity, dt)
    new, pull = np.empty_like(z), np.empty_like(u)
    ones = np.ones(len(z))
    kernels.step_batch(law, z, u, _ALONE, ones, steps, new, pull)
    loaded = (load > 0.0)[..., None, None]
    traction = _together(pull[:, :2], state) - law.sigma_0 * centre
    share = load[..., None] * patch.weights(load)
    wrench = np.einsum("...cn,dcn->...d", traction * share[..., None, :], lever)
    return np.where(loaded, _together(new, state) + centre, 0.0), wrench


def step_jacobians(
    compiled: Any, state: np.ndarray, twist: np.ndarray, load: np.ndarray, dt: np.ndarray
) -> StepJacobians:
    """Differentiate steps of the cells of a `CompiledDistributed` (see `CompiledModel.step_jacobians`)."""
    law, patch = compiled.law.numbers, compiled.patch
    lever, asymmetry = compiled.lever, compiled.asymmetry
    velocity = np.einsum("...d,dcn->...cn", twist, lever)
    centre, centre_u = 0.0, None
    if asymmetry is not None:
        centre, centre_u = centres(law, asymmetry, velocity)
    z, u, steps = _alone(state - centre, velocity, dt)
    count = len(z)
    slopes = kernels.CellJacobians(
        *(np.zeros((count, *inner)) for inner in ((2, 2, 1), (2, 1, 3), (3, 2, 1), (3, 3), (3,)))
    )
    kernels.jacobians(law, z.reshape(-1, 2, 1), u, _ALONE, np.ones(count), steps, slopes)
    new_z, new_u, pull_z, pull_u, pull = slopes
    new_z, new_u = _together(new_z[..., 0], state), _together(new_u[:, :, 0, :2], state)
    pull_z, pull_u = _together(pull_z[:, :2, :, 0], state), _together(pull_u[:, :2, :2], state)
    if centre_u is not None:
        new_u = new_u + centre_u - np.einsum("...abn,...bcn->...acn", new_z, centre_u)
        pull_u = pull_u - law.sigma_0 * centre_u - np.einsum("...abn,...bcn->...acn", pull_z, centre_u)
    weights, loaded = patch.weights(load), (load > 0.0)[..., None, None, None]
    share = (load[..., None] * weights)[..., None, None, :]
    traction = (_together(pull[:, :2], state) - law.sigma_0 * centre) * weights[..., None, :]
    return StepJacobians(
        np.where(loaded, new_z, 0.0),
        np.where(loaded, np.einsum("...abn,dbn->...and", new_u, lever), 0.0),
        np.einsum("dan,...abn->...dbn", lever, pull_z * share),
        np.einsum("dan,...abn,ebn->...de", lever, pull_u * share, lever),
        np.einsum("...cn,dcn->...d", traction, lever),
    )


def _alone(state: np.ndarray, velocity: np.ndarray, dt: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return bristles `[K, 2]`, twists `[K, 3]` and steps `[K]` of all cells of a batch, each as a contact alone."""
    z = np.ascontiguousarray(np.moveaxis(state, -2, -1).reshape(-1, 2))
    u = np.zeros((len(z), 3))
    u[:, :2] = np.moveaxis(velocity, -2, -1).reshape(-1, 2)
    return z, u, np.ascontiguousarray(np.broadcast_to(dt[..., None], (*dt.shape, state.shape[-1])).reshape(-1))


def _together(values: np.ndarray, state: np.ndarray) -> np.ndarray:
    """Return `[K, ...]` of all cells of a batch as `[batch, ..., N]`."""
    inner = values.shape[1:]
    apart = values.reshape(*state.shape[:-2], state.shape[-1], *inner)
    return np.moveaxis(apart, state.ndim - 2, -1)
