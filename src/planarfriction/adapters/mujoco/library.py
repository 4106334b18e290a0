# pyright: reportAttributeAccessIssue=false
# (MuJoCo describes few of its names to type checkers.)
"""Layout of the structs of the installed version of MuJoCo, from its own description, for compiled steps."""

from __future__ import annotations

import ctypes
import functools
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from planarfriction.adapters.mujoco.loops import records
from planarfriction.errors import FrictionError

_NUMBERS = {
    "float": ctypes.c_float,
    "char": ctypes.c_char,
    "mjtByte": ctypes.c_ubyte,
    "mjtBool": ctypes.c_bool,
}
_NUMBERS |= dict.fromkeys(
    ("mjtNum", "double", "mjtSize", "size_t", "uint64_t", "uintptr_t"), ctypes.c_double
)
"""Types of C of the size of MuJoCo's; all others, such as enumerations, have that of `int`."""

_FILES = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")


@functools.cache
def _described() -> dict[str, Any]:
    from mujoco.introspect.structs import STRUCTS

    return dict(STRUCTS)


def _type_of(kind: Any) -> Any:
    """Return the type of C that a field, or a struct, is described as."""
    if hasattr(kind, "fields"):
        fields = [(field.name, _type_of(field.type)) for field in kind.fields]
        return type("Struct", (ctypes.Structure,), {"_fields_": fields})
    if hasattr(kind, "extents"):
        return _type_of(kind.inner_type) * int(np.prod(kind.extents))
    if hasattr(kind, "inner_type"):
        return ctypes.c_void_p
    return (
        _type_of(_described()[kind.name])
        if kind.name in _described()
        else _NUMBERS.get(kind.name, ctypes.c_int)
    )


def _offsets(name: str) -> dict[str, int]:
    """Return the offsets of the fields of a struct, and its `size`."""
    struct = _type_of(_described()[name])
    return {field: getattr(struct, field).offset for field, _ in struct._fields_} | {
        "size": ctypes.sizeof(struct)
    }


def _chosen(record: Any, offsets: dict[str, int], **others: int) -> Any:
    return record(
        **{name: others.get(name, offsets.get(name, -1)) for name in record._fields}
    )


@functools.cache
def layout() -> dict[str, Any]:
    """Return the parts of a `Host` that belong to the library alone.

    Raises `FrictionError` for a version whose structs are not as it describes them.
    """
    model, data, contact, option = (
        _offsets(name) for name in ("mjModel", "mjData", "mjContact", "mjOption")
    )
    names = "timestep", "integrator", "disableflags", "enableflags", "noslip_iterations"
    options = {name: model["opt"] + option[name] for name in names}
    in_model = "D_rownnz" in model
    parts = {
        "inertia": data.get("qM", -1),
        "model": _chosen(records.ModelOffsets, model, **options),
        "data": _chosen(records.DataOffsets, data),
        "slopes": _chosen(
            records.SlopeOffsets, model if in_model else data, in_model=int(in_model)
        ),
        "contact": _chosen(records.ContactOffsets, contact),
        "functions": _functions(),
        "constants": _constants(),
    }
    _check(parts)
    return parts


@functools.cache
def same() -> np.ndarray:
    """Return the arrays by which copies of a model are known, int [S, 3]: see `Host.same`."""
    model = _offsets("mjModel")
    rows = [(-1, model[name], 0) for name in ("nv", "nuserdata")]  # counts alone
    rows += [
        (model[array], model[count], size) for array, (count, size) in _SHARED.items()
    ]
    return np.array(rows, np.int64)


_SHARED = {
    "names": ("nnames", 1),
    "names_map": ("nnames_map", 4),
    "body_parentid": ("nbody", 4),
    "jnt_type": ("njnt", 4),
    "geom_bodyid": ("ngeom", 4),
    "site_bodyid": ("nsite", 4),
    "pair_geom1": ("npair", 4),
    "numeric_adr": ("nnumeric", 4),
}
"""Arrays of a model that its copies share, whatever is set at run time, with their counts and the bytes of a number."""


def _functions() -> Any:
    folder = Path(mujoco.__path__[0])
    path = next(each for name in _FILES for each in folder.glob(name))
    library = ctypes.CDLL(str(path))
    names = records.Functions._fields
    found = (getattr(library, name, None) for name in names)
    return records.Functions(
        *((each and ctypes.cast(each, ctypes.c_void_p).value) or 0 for each in found)
    )


def _constants() -> Any:
    state = mujoco.mjtConstraintState
    kind = mujoco.mjtConstraint
    integrator = mujoco.mjtIntegrator
    found = {
        **{
            name: getattr(state, f"mjCNSTRSTATE_{name}", None)
            for name in records.Constants._fields
        },
        **{
            name: getattr(kind, f"mjCNSTR_{name}")
            for name in ("EQUALITY", "FRICTION_DOF", "FRICTION_TENDON")
        },
        "ELLIPTIC": kind.mjCNSTR_CONTACT_ELLIPTIC,
        **{
            name: getattr(integrator, f"mjINT_{name}")
            for name in ("EULER", "IMPLICIT", "IMPLICITFAST")
        },
        "NO_EULERDAMP": mujoco.mjtDisableBit.mjDSBL_EULERDAMP,
        "NO_REFSAFE": mujoco.mjtDisableBit.mjDSBL_REFSAFE,
        "GEOM": mujoco.mjtObj.mjOBJ_GEOM,
        "SLEEP": getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0),
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
    data = parts["data"]
    model = parts["model"]
    contact = parts["contact"]
    right = (
        ctypes.c_double.from_address(m._address + model.timestep).value
        == m.opt.timestep
    )
    right &= ctypes.c_double.from_address(d._address + data.time).value == d.time
    counts = (
        (m, model.nv, m.nv),
        (m, model.nuserdata, 7),
        (d, data.ncon, d.ncon),
        (d, data.nefc, d.nefc),
    )
    right &= all(
        ctypes.c_int.from_address(owner._address + offset).value == count
        for owner, offset, count in counts
    )
    arrays = [(m, model.dof_damping, m.dof_damping), (d, data.contact, d.contact.dist)]
    arrays += [
        (d, getattr(data, name), getattr(d, name))
        for name in data._fields
        if name not in _OTHERWISE
    ]
    for owner, offset, array in arrays:
        right &= (
            ctypes.c_uint64.from_address(owner._address + offset).value
            == array.ctypes.data
        )
    for name in contact._fields[1:]:
        right &= getattr(
            d.contact, name
        ).ctypes.data - d.contact.dist.ctypes.data == getattr(contact, name)
    if not right:
        raise FrictionError(
            f"MuJoCo {mujoco.__version__} stores its data in another way than it documents"
        )


_OTHERWISE = (
    "time",
    "ncon",
    "nefc",
    "contact",
    "efc_J_rownnz",
    "efc_J_rowadr",
    "efc_J_colind",
)
"""Fields that are not checked as arrays; rows of Jacobians are described where these are sparse alone."""
