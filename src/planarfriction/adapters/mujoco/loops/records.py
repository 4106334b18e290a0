"""Records of MuJoCo for compiled steps: places in its structs, its functions, its constants.

Offsets are in bytes and belong to the version that is installed (`adapters.mujoco.library` finds them).
"""

from __future__ import annotations

from typing import NamedTuple

from planarfriction.compiler.memory import reader


class ModelOffsets(NamedTuple):
    """Offsets of `mjModel`."""

    nv: int
    nuserdata: int
    timestep: int
    integrator: int
    disableflags: int
    dof_damping: int


class DataOffsets(NamedTuple):
    """Offsets of `mjData`."""

    time: int
    ncon: int
    nefc: int
    contact: int
    efc_type: int
    efc_J: int
    efc_J_rownnz: int
    efc_J_rowadr: int
    efc_J_colind: int
    efc_D: int
    efc_R: int
    efc_frictionloss: int
    efc_aref: int
    efc_state: int
    efc_force: int
    qvel: int
    qacc: int
    qacc_warmstart: int
    qfrc_passive: int
    qDeriv: int
    userdata: int
    site_xpos: int
    site_xmat: int


class SlopeOffsets(NamedTuple):
    """Offsets of the sparsity of `qDeriv`, in the model or, in older versions, in the data."""

    in_model: int
    """1 or 0."""
    D_rownnz: int
    D_rowadr: int
    D_colind: int


class ContactOffsets(NamedTuple):
    """Offsets of `mjContact`."""

    size: int
    """Size of a contact."""
    pos: int
    frame: int
    H: int
    dim: int
    geom: int
    efc_address: int


class Functions(NamedTuple):
    """Addresses of MuJoCo's functions."""

    mj_markStack: int
    mj_freeStack: int
    mj_stackAllocNum: int
    mj_fwdActuation: int
    mj_fwdAcceleration: int
    mj_fwdConstraint: int
    mj_constraintUpdate: int
    mj_fullM: int
    mj_jac: int
    mj_isSparse: int
    mjd_smooth_vel: int
    mjd_freeMhat: int
    """0 in versions without."""


class Constants(NamedTuple):
    """Values of MuJoCo's enumerations."""

    SATISFIED: int
    QUADRATIC: int
    LINEARNEG: int
    LINEARPOS: int
    CONE: int
    EQUALITY: int
    FRICTION_DOF: int
    FRICTION_TENDON: int
    ELLIPTIC: int
    EULER: int
    IMPLICIT: int
    IMPLICITFAST: int
    NO_EULERDAMP: int


class Memory(NamedTuple):
    """Places in the user data of what patches remember from step to step, in words."""

    state: int
    """State of all patches at `time`."""
    new: int
    """State of all patches at `next`."""
    guess: int
    """Wrenches at the beginning of the step, [3k]."""
    wrench: int
    """Wrenches of the step, [3k]."""
    twist: int
    """[3k]"""
    load: int
    """[k]"""
    warmstart: int
    """`qacc_warmstart` at the beginning of the step, [nv]."""
    passive: int
    """`qfrc_passive` without friction, [nv]."""
    total: int
    """`qfrc_passive` with friction, [nv]."""
    time: int
    """Time at the beginning of the step [s]."""
    next: int
    """Time at the end of the step [s]."""
    iterations: int
    passes: int
    residual: int
    converged: int


class Host(NamedTuple):
    """A model with patches."""

    nv: int
    nuserdata: int
    count: int
    """Patches k."""
    states: int
    words: int
    """Words of a problem in contact space."""
    problem: int
    """Address of a problem without inputs."""
    patches: int
    """Address of the row of `coupling_rows.Patches`."""
    solve: int
    """Address of `coupling.solve`."""
    plan: int
    """Address of `step.plan`."""
    sites: int
    """Address of the sites of the patches, int [k]; the following fields are addresses too."""
    own: int
    """Geoms on the bodies of the sites."""
    other: int
    own_bodies: int
    other_bodies: int
    at_contact: int
    """Address of flags: 1 where the origin is in the middle of the contacts."""
    free_count: int
    """Number of free joints."""
    free_joints: int
    """Address of the indices of the free joints, int [free_count]."""
    free_dofs: int
    """Address of the first degree of freedom of each free joint, int [free_count]."""
    inertia: int
    """Offset of the inertia that `mj_fullM` wants, -1 where it takes the data."""
    memory: Memory
    model: ModelOffsets
    data: DataOffsets
    slopes: SlopeOffsets
    contact: ContactOffsets
    functions: Functions
    constants: Constants


read = reader(Host)
