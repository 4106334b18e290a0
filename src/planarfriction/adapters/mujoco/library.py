# pyright: reportAttributeAccessIssue=false
# (MuJoCo describes few of its names to type checkers.)
"""Layout of the structs of the installed version of MuJoCo, from its own description, for compiled steps."""

from __future__ import annotations

import ctypes
import functools
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np

from planarfriction.adapters.mujoco.loops import records
from planarfriction.errors import FrictionError

_SIZES = {"int": 4, "float": 4, "char": 1, "mjtByte": 1, "mjtBool": 1}
_SIZES |= dict.fromkeys(("mjtNum", "double", "mjtSize", "size_t", "uint64_t", "uintptr_t"), 8)

_FILES = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")

_ENUMERATION = 4
"""Bytes of all other values."""


class _Struct(NamedTuple):
    offsets: dict[str, int]
    size: int
    align: int


@functools.cache
def _described() -> dict[str, Any]:
    from mujoco.introspect.structs import STRUCTS

    return dict(STRUCTS)


def _measure(kind: Any) -> tuple[int, int]:
    """Return the size and alignment of a field."""
    if hasattr(kind, "fields"):
        return _arranged(kind.fields)[1:]
    if hasattr(kind, "extents"):
        size, align = _measure(kind.inner_type)
        return size * int(np.prod(kind.extents)), align
    if hasattr(kind, "inner_type"):
        return 8, 8
    if kind.name in _described():
        return _struct(kind.name)[1:]
    size = _SIZES.get(kind.name, _ENUMERATION)
    return size, size


def _arranged(fields: Any) -> _Struct:
    """Return the offsets of fields as C compilers lay them out."""
    offsets, end, widest = {}, 0, 1
    for field in fields:
        size, align = _measure(field.type)
        offsets[field.name] = -(-end // align) * align
        end, widest = offsets[field.name] + size, max(widest, align)
    return _Struct(offsets, -(-end // widest) * widest, widest)


@functools.cache
def _struct(name: str) -> _Struct:
    return _arranged(_described()[name].fields)


def _chosen(record: Any, offsets: dict[str, int], **others: int) -> Any:
    return record(**{name: others.get(name, offsets.get(name, -1)) for name in record._fields})


@functools.cache
def layout() -> dict[str, Any]:
    """Return the parts of a `Host` that belong to the library alone.

    Raises `FrictionError` for a version whose structs are not as it describes them.
    """
    model, data, contact, option = (_struct(name) for name in ("mjModel", "mjData", "mjContact", "mjOption"))
    first = model.offsets["opt"]
    options = {name: first + option.offsets[name] for name in ("timestep", "integrator", "disableflags")}
    in_model = "D_rownnz" in model.offsets
    slopes = (model if in_model else data).offsets
    parts = {
        "inertia": data.offsets.get("qM", -1),
        "model": _chosen(records.ModelOffsets, model.offsets, **options),
        "data": _chosen(records.DataOffsets, data.offsets),
        "slopes": _chosen(records.SlopeOffsets, slopes, in_model=int(in_model)),
        "contact": _chosen(records.ContactOffsets, contact.offsets, size=contact.size),
        "functions": _functions(),
        "constants": _constants(),
    }
    _check(parts)
    return parts


def _functions() -> records.Functions:
    folder = Path(mujoco.__file__).parent
    path = next(each for name in _FILES for each in folder.glob(name))
    library, names = ctypes.CDLL(str(path)), records.Functions._fields
    found = (getattr(library, name, None) for name in names)
    return records.Functions(*((each and ctypes.cast(each, ctypes.c_void_p).value) or 0 for each in found))


def _constants() -> records.Constants:
    state, kind, integrator = mujoco.mjtConstraintState, mujoco.mjtConstraint, mujoco.mjtIntegrator
    found = {
        **{name: getattr(state, f"mjCNSTRSTATE_{name}", None) for name in records.Constants._fields},
        **{name: getattr(kind, f"mjCNSTR_{name}") for name in ("EQUALITY", "FRICTION_DOF", "FRICTION_TENDON")},
        "ELLIPTIC": kind.mjCNSTR_CONTACT_ELLIPTIC,
        **{name: getattr(integrator, f"mjINT_{name}") for name in ("EULER", "IMPLICIT", "IMPLICITFAST")},
        "NO_EULERDAMP": mujoco.mjtDisableBit.mjDSBL_EULERDAMP,
    }
    return records.Constants(**{name: int(value) for name, value in found.items()})


_PROBE = """<mujoco><size nuserdata="7"/><option timestep="0.00125"/><worldbody><geom type="plane" size="1 1 1"/>
<site name="s"/><body pos="0 0 0.1"><freejoint/><geom size="0.11"/></body></worldbody></mujoco>"""


def _check(parts: dict[str, Any]) -> None:
    """Compare with what MuJoCo's own Python module sees."""
    m = mujoco.MjModel.from_xml_string(_PROBE)
    d = mujoco.MjData(m)
    d.time = 1.25
    mujoco.mj_forward(m, d)
    data, model, contact = parts["data"], parts["model"], parts["contact"]
    right = ctypes.c_double.from_address(m._address + model.timestep).value == m.opt.timestep
    right &= ctypes.c_double.from_address(d._address + data.time).value == d.time
    counts = (m, model.nv, m.nv), (m, model.nuserdata, 7), (d, data.ncon, d.ncon), (d, data.nefc, d.nefc)
    right &= all(ctypes.c_int.from_address(owner._address + offset).value == count for owner, offset, count in counts)
    arrays = [(m, model.dof_damping, m.dof_damping), (d, data.contact, d.contact.dist)]
    arrays += [(d, getattr(data, name), getattr(d, name)) for name in data._fields if name not in _OTHERWISE]
    right &= all(_word(owner, offset) == array.ctypes.data for owner, offset, array in arrays)
    for name in contact._fields[1:]:
        right &= getattr(d.contact, name).ctypes.data - d.contact.dist.ctypes.data == getattr(contact, name)
    if not right:
        raise FrictionError(f"MuJoCo {mujoco.__version__} stores its data in another way than it documents")


_OTHERWISE = ("time", "ncon", "nefc", "contact", "efc_J_rownnz", "efc_J_rowadr", "efc_J_colind")
"""Fields that are not checked as arrays; rows of Jacobians are described where these are sparse alone."""


def _word(owner: Any, offset: int) -> int:
    return ctypes.c_uint64.from_address(owner._address + offset).value
