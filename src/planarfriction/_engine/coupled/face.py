"""Faces of pads that hang on their backs by a compliance common to all pieces (docs/physics.md, "Elastic pads").

The face of a pad, whose twist `V_f` its bristles see, is displaced by b against the back, whose twist V the host knows.
With the compliance C and the lag T of the material, `b' = V - V_f` and `W = -(b + T b')/C`, and at the end of a step

    V_f = V + (b + C W)/h,     h = dt + T,     b <- b + (V - V_f) dt.

To the search the face is the host: the host's response to wrenches gains `C/h`. The last three states of such a patch
are b.
"""

from __future__ import annotations

from planarfriction._engine.codegen.vectors import copy
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles, at
from planarfriction._engine.coupled.coupling_rows import ContactSolve, Patches

HOST = 12
"""Numbers of the host that those of a face take the place of: a block of the response [3, 3], and a twist [3]."""


@kernel
def bent(patches: Patches, p: ContactSolve, k: int, i: int, w: Doubles) -> float:
    """Return element i of `b + C W` of patch k under the wrenches `w` [3k]."""
    off = p.state[patches.firsts[k + 1] - 3 + i]
    for j in range(3):
        off += patches.compliance[9 * k + 3 * i + j] * w[3 * k + j]
    return off


@kernel
def add_faces(patches: Patches, p: ContactSolve, w: Doubles, twist: Doubles) -> None:
    """Turn twists of backs [3k] into those of faces under the wrenches `w` [3k]."""
    for k in range(patches.count):
        if patches.lag[k] > 0.0:
            for i in range(3):
                off = bent(patches, p, k, i, w)
                twist[3 * k + i] += off / (p.dt[0] + patches.lag[k])


@kernel
def _guess(patches: Patches, p: ContactSolve, k: int) -> None:
    """Begin with the wrench of the common part at rest, if none is given."""
    w = at(p.wrench, 3 * k)
    if w[0] != 0.0 or w[1] != 0.0 or w[2] != 0.0:
        return
    last = patches.firsts[k + 1] - 3
    for i in range(3):
        for j in range(3):
            w[i] -= patches.back[9 * k + 3 * i + j] * p.state[last + j]


@kernel
def soften(patches: Patches, p: ContactSolve) -> None:
    """Add the compliances of the faces to the response of the host, and turn its twists into those of faces."""
    n = 3 * patches.count
    for k in range(patches.count):
        if patches.lag[k] > 0.0:
            _guess(patches, p, k)
            for i in range(3):
                row = at(p.response, n * (3 * k + i) + 3 * k)
                for j in range(3):
                    soft = patches.compliance[9 * k + 3 * i + j]
                    row[j] += soft / (p.dt[0] + patches.lag[k])
    add_faces(patches, p, p.guess, p.free_twist)


@kernel
def move_faces(patches: Patches, p: ContactSolve) -> None:
    """Write the new displacements of the faces under the wrenches."""
    for k in range(patches.count):
        if patches.lag[k] > 0.0:
            last = patches.firsts[k + 1] - 3
            for i in range(3):
                off = bent(patches, p, k, i, p.wrench) / (p.dt[0] + patches.lag[k])
                b = p.state[last + i] - off * p.dt[0]
                p.new[last + i] = b if p.load[k] > 0.0 else 0.0


@kernel
def hang(patches: Patches, p: ContactSolve) -> None:
    """Write the faces in place of the host, whose numbers are kept."""
    n = 3 * patches.count
    for k in range(patches.count):
        if patches.lag[k] > 0.0:
            kept = at(p.host, HOST * k)
            for i in range(3):
                row = at(p.response, n * (3 * k + i) + 3 * k)
                copy(row, at(kept, 3 * i), 3)
                kept[9 + i] = p.free_twist[3 * k + i]
    soften(patches, p)


@kernel
def unhang(patches: Patches, p: ContactSolve) -> None:
    """Write the host's numbers back, its twists, and the new displacements of the faces."""
    n = 3 * patches.count
    move_faces(patches, p)
    for k in range(patches.count):
        if patches.lag[k] > 0.0:
            kept = at(p.host, HOST * k)
            for i in range(3):
                copy(at(kept, 3 * i), at(p.response, n * (3 * k + i) + 3 * k), 3)
                p.free_twist[3 * k + i] = kept[9 + i]
                off = bent(patches, p, k, i, p.wrench) / (p.dt[0] + patches.lag[k])
                p.twist[3 * k + i] -= off
