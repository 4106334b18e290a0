"""Records of MuJoCo for compiled steps: places in its structs, its functions, its constants.

Offsets are in bytes and belong to the version that is installed (`adapters.mujoco.library` finds them).
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction._engine.compiler.memory import (
    Doubles,
    Integers,
    Layout,
    offsets_of,
    reader,
)


def _integers(name: str, fields: str) -> Any:
    """Return a record of integers, named in a text."""
    return NamedTuple(name, [(field, int) for field in fields.split()])


ModelOffsets = _integers(
    "ModelOffsets",
    "nv nuserdata timestep integrator disableflags enableflags noslip_iterations dof_damping pair_dim pair_solref "
    "geom_size geom_surfacevel numeric_data",
)
"""Offsets of `mjModel`; -1 of `geom_surfacevel` in versions without it."""

DataOffsets = _integers(
    "DataOffsets",
    "time ncon nefc contact efc_type efc_J efc_J_rownnz efc_J_rowadr efc_J_colind efc_D efc_R efc_frictionloss "
    "efc_aref efc_state efc_force qvel qacc qacc_warmstart qfrc_passive qDeriv userdata site_xpos site_xmat "
    "geom_xpos geom_xmat",
)
"""Offsets of `mjData`."""

SlopeOffsets = _integers("SlopeOffsets", "in_model D_rownnz D_rowadr D_colind")
"""Offsets of the sparsity of `qDeriv`, in the model (`in_model` is 1) or, in older versions, in the data (0)."""

ContactOffsets = _integers(
    "ContactOffsets", "size dist pos frame H dim geom efc_address"
)
"""Size of an `mjContact`, and its offsets."""

Functions = _integers(
    "Functions",
    "mj_markStack mj_freeStack mj_stackAllocNum mj_fwdActuation mj_fwdAcceleration mj_fwdConstraint "
    "mj_constraintUpdate mj_fullM mj_jac mj_jacDot mj_objectVelocity mj_isSparse mjd_smooth_vel mjd_freeMhat",
)
"""Addresses of MuJoCo's functions; 0 for `mjd_freeMhat` in versions without it."""

Constants = _integers(
    "Constants",
    "SATISFIED QUADRATIC LINEARNEG LINEARPOS CONE EQUALITY FRICTION_DOF FRICTION_TENDON ELLIPTIC EULER IMPLICIT "
    "IMPLICITFAST NO_EULERDAMP NO_REFSAFE SLEEP GEOM",
)
"""Values of MuJoCo's enumerations."""


class Remembered(NamedTuple):
    """Numbers in the user data that patches remember from step to step.

    What is copied at once lies side by side: all of the beginning of a step, and in the same order all of its end.
    """

    before: Doubles
    """x axes of patches at the beginning of the step, in the frames of their sites, [3k]; 0 before any."""
    state: Doubles
    """State of all patches at `time`."""
    guess: Doubles
    """Wrenches at the beginning of the step, [3k]."""
    held: Doubles
    """Origins of patches at the beginning of the step, in the frames of their sites, [3k]; 0 for none."""
    axis: Doubles
    """x axes of patches in the step, [3k]."""
    after: Doubles
    """State of all patches at `next`."""
    wrench: Doubles
    """Wrenches of the step, [3k]."""
    centre: Doubles
    """Origins of patches in the step, [3k]."""
    twist: Doubles
    """[3k]"""
    load: Doubles
    """[k]"""
    warmstart: Doubles
    """`qacc_warmstart` at the beginning of the step, [nv]."""
    passive: Doubles
    """`qfrc_passive` without friction, [nv]."""
    total: Doubles
    """`qfrc_passive` with friction, [nv]."""
    time: Doubles
    """Time at the beginning of the step [s], [1]."""
    next: Doubles
    """Time at the end of the step [s], [1]."""
    iterations: Doubles
    """[1], as all that follows."""
    passes: Doubles
    residual: Doubles
    misplaced: Doubles
    """0, or `FAULTS p + fault` of a patch p that does not lie in its contact (see `placing`)."""
    converged: Doubles


Memory = offsets_of(Remembered)
"""Places in the user data, in words."""


def memory_layout(states: int, k: int, nv: int) -> Layout:
    """Return the layout of `Remembered` for k patches with so many states in all."""
    shapes = (
        dict.fromkeys(Remembered._fields, 1)
        | dict.fromkeys(("state", "after"), states)
        | {"load": k}
    )
    shapes |= dict.fromkeys(
        ("guess", "wrench", "twist", "held", "centre", "before", "axis"), 3 * k
    )
    return Layout(
        Remembered, **shapes | dict.fromkeys(("warmstart", "passive", "total"), nv)
    )


class Scratch(NamedTuple):
    """Memory that a step works with."""

    problem: Doubles
    """Words of a `coupling_rows.ContactSolve`."""
    records: Integers
    """Records of the patches with the laws of the model (see `models.write_laws`)."""
    jacobian: Doubles
    """Jacobian of the twists, [3k, nv]."""
    inertia: Doubles
    """[nv, nv]"""
    stiff: Doubles
    """H, and then the metric of the integrator, [nv, nv]."""
    answers: Doubles
    """H^-1 J' and, last, the acceleration, [nv, 3k + 1]."""
    held: Doubles
    """Velocities that the integrator gains from these answers, [nv, 3k + 1]."""
    moves: Doubles
    """[3, nv]"""
    turns: Doubles
    """[3, nv]"""
    more: Doubles
    """Acceleration that the change of wrenches adds, [nv]."""
    start: Doubles
    """Wrenches where a step in contact space begins, [3k]."""
    goal: Doubles
    """Wrenches where the step ends, [3k]."""
    move: Doubles
    """Twists between, [3k]."""
    block: Doubles
    """[6, 6]"""
    counts: Integers
    """Contacts of each patch, [k]."""
    frames: Doubles
    """Sums over these of normals into the own body; origins, [k, 6]."""
    axes: Doubles
    """x axes of the patches in the world, [k, 3]."""
    carried: Doubles
    """Cosine and sine of the angles from the x axes of the last step, carried along, to these, [k, 2]."""
    drift: Doubles
    """Part of the twists that no wrench of the step changes, of the own body less that of the other, [3k]: those of
    their surfaces (`surfacevel`), and of the turning of both (see `geometry`)."""
    tilts: Doubles
    """Speeds at which the bodies roll or rock on each other [rad/s], [k]."""
    misses: Doubles
    """J qacc - aref, [nefc]; behind them `owners_of` finds the patch of each constraint, -1 of others, and `places_of`
    the points of contacts."""


Places = offsets_of(Scratch)
"""Places of scratch in a block of words."""


def scratch_layout(words: int, records: int, k: int, nv: int) -> Layout:
    """Return the layout of `Scratch` without its rows for constraints, for k patches.

    `words` are those of a problem, `records` those of the records of all patches.
    """
    n = 3 * k
    shapes = {
        "problem": words,
        "records": records,
        "jacobian": n * nv,
        "more": nv,
        "block": 36,
        "frames": 2 * n,
    }
    shapes |= {"counts": k, "tilts": k, "carried": 2 * k, "misses": 0}
    shapes |= dict.fromkeys(("inertia", "stiff"), nv * nv) | dict.fromkeys(
        ("answers", "held"), nv * (n + 1)
    )
    shapes |= dict.fromkeys(("moves", "turns"), 3 * nv) | dict.fromkeys(
        ("start", "goal", "move", "axes", "drift"), n
    )
    return Layout(Scratch, **shapes)


class Host(NamedTuple):
    """A model with patches."""

    m: int
    """Address of the `mjModel`."""
    same_count: int
    same: int
    """Address of offsets in it of arrays that copies share, of their counts, and of their words, [same_count, 3]."""
    nv: int
    nuserdata: int
    count: int
    """Patches k."""
    states: int
    words: int
    """Words of a problem in contact space."""
    scratch_words: int
    """Words of the scratch, without its rows for constraints."""
    problem: int
    """Address of a problem without inputs."""
    patches: int
    """Address of the row of `coupling_rows.Patches`."""
    solve: int
    """Address of `coupling.solve`."""
    plan: int
    """Address of `step.plan`."""
    site: int
    """Address of the sites of the patches, int [k]; the following fields are addresses too."""
    own: int
    """Geoms on the bodies of the sites."""
    other: int
    owner: int
    support: int
    pair: int
    """Contact pairs of the model."""
    centre: int
    """Origins of the patches, as those of `placing`."""
    curved: int
    """Bits of their curved sides, as those of `placing`."""
    carrier: int
    """Address of the geoms along with which the patches go over the others."""
    on_box: int
    """Address of flags: 1 where the other geom is a box, whose faces bear patches as far as they go."""
    extents: int
    """Address of the reach of each patch, [k, 4] [m]."""
    parameters: int
    """Place of the parameters of the patches in the numerics of a model, behind the digest of the patches."""
    laws: int
    """Address of sorts of patches: 0 where a law does not have the numbers of `LawNumbers`, 2 or 3 of pads (see
    `models`), else 1, int [k]."""
    record_words: int
    """Address of the words of the record of each patch, int [count]."""
    free_count: int
    """Number of free joints."""
    free_joints: int
    """Address of the indices of the free joints, int [free_count]."""
    free_dofs: int
    """Address of the first degree of freedom of each free joint, int [free_count]."""
    inertia: int
    """Offset of the inertia that `mj_fullM` wants, -1 where it takes the data."""
    memory: Memory
    scratch: Places
    model: ModelOffsets
    data: DataOffsets
    slopes: SlopeOffsets
    contact: ContactOffsets
    functions: Functions
    constants: Constants


read = reader(Host)
