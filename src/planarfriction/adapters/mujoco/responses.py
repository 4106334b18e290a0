# pyright: reportAttributeAccessIssue=false
# (MuJoCo describes few of its names to type checkers.)
"""How MuJoCo's step answers to wrenches on patches, while the set of active constraints holds.

`H = M + Jc' D Jc` over the constraint rows in their quadratic range, `X = H^-1 J'`; the integrator goes on by
`v + dt Mh^-1 M qacc` with its own metric Mh: twists answer with `dt J Mh^-1 M X`, loads with `-sum D Jc X` over the
rows of their contacts.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco
import numpy as np

_QUADRATIC = int(mujoco.mjtConstraintState.mjCNSTRSTATE_QUADRATIC)
_EULER, _FAST = int(mujoco.mjtIntegrator.mjINT_EULER), int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
_NO_EULER_DAMPING = int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)


class Responses(NamedTuple):
    """At the accelerations and constraint forces that are in the data."""

    velocity: np.ndarray
    """At the end of the step, `[nv]`."""
    twist_response: np.ndarray
    """`[3k, 3k]`"""
    load_response: np.ndarray
    """`[k, 3k]`"""


def responses(m: Any, d: Any, jacobian: np.ndarray, rows: list[np.ndarray]) -> Responses:
    """`jacobian` [3k, nv] of the patches' twists, `rows` of the constraints that are their contacts."""
    dt, inertia = m.opt.timestep, np.zeros((m.nv, m.nv))
    mujoco.mj_fullM(m, d, inertia)
    active = np.flatnonzero(d.efc_state == _QUADRATIC) if d.nefc else np.zeros(0, int)
    constraints = _constraint_rows(m, d)[active]
    stiff = inertia + constraints.T @ (d.efc_D[active][:, None] * constraints)
    moved = np.linalg.solve(stiff, jacobian.T)
    metric = _metric(m, d, inertia)
    held = np.concatenate([d.qacc[:, None], moved], axis=1)
    if metric is not None:
        held = np.linalg.solve(metric, inertia @ held)
    loads = np.zeros((len(rows), len(jacobian)))
    for p, own in enumerate(rows):
        chosen = np.isin(active, own)
        loads[p] = -d.efc_D[active[chosen]] @ constraints[chosen] @ moved
    return Responses(d.qvel + dt * held[:, 0], dt * jacobian @ held[:, 1:], loads)


def _constraint_rows(m: Any, d: Any) -> np.ndarray:
    """Jacobian of the constraints, `[nefc, nv]`."""
    if not d.nefc:
        return np.zeros((0, m.nv))
    if not mujoco.mj_isSparse(m):
        return d.efc_J.reshape(d.nefc, m.nv)
    dense = np.zeros((d.nefc, m.nv))
    for i, (first, count) in enumerate(zip(d.efc_J_rowadr, d.efc_J_rownnz, strict=True)):
        dense[i, d.efc_J_colind[first : first + count]] = d.efc_J.ravel()[first : first + count]
    return dense


def _metric(m: Any, d: Any, inertia: np.ndarray) -> np.ndarray | None:
    """The integrator's metric Mh, None where it is M."""
    dt = m.opt.timestep
    if m.opt.integrator == _EULER:
        if m.opt.disableflags & _NO_EULER_DAMPING or not m.dof_damping.any():
            return None
        return inertia + dt * np.diag(m.dof_damping)
    slopes = np.zeros((m.nv, m.nv))
    for i in range(m.nv):
        own = slice(m.D_rowadr[i], m.D_rowadr[i] + m.D_rownnz[i])
        slopes[i, m.D_colind[own]] = d.qDeriv[own]
    return inertia - dt * (0.5 * (slopes + slopes.T) if m.opt.integrator == _FAST else slopes)
