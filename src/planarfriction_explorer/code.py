"""The state as Python and as a scene file, to be copied: both give the numbers that are on the screen."""

from __future__ import annotations

import dataclasses
from typing import Any

import planarfriction
from planarfriction.laws import ElastoPlastic
from planarfriction.models import DistributedModel
from planarfriction.scenes import Scene, driven
from planarfriction.scenes.files import to_toml
from planarfriction_explorer.drawing import Drawing
from planarfriction_explorer.state import State

T_END = 1.0
"""Duration of the scene [s]: long enough for steady sliding at micrometres a second."""


def python(state: State) -> str:
    """Return a script that prints the wrench of limit surface and ellipsoid, then that of the law in a simulation."""
    law, imported = _law(state.law)
    twist, load = _typed(state)
    return f"""import planarfriction as pf
{imported}
patch = {_patch(state.drawing)}
law = {law}
twist, normal_force = {twist}, {load}

for surface in (pf.LimitSurfaceExact(patch), pf.LimitSurfaceEllipsoid(patch)):
    print(law.numbers.mu_c * normal_force * surface.wrench(twist))

model = pf.DistributedModel(patch, law)
scene = pf.scenes.driven(model, twist=twist, normal_force=normal_force, at="origin", t_end={T_END})
data = pf.simulate(scene).data
print(*(data[name].values[-1, 0] for name in ("fx", "fy", "tau")))
"""


def toml(state: State) -> str:
    """Return a scene file, for `planarfriction run`, that moves the patch with the twist of the state."""
    data = scene(state).to_dict()
    data["contact"][0]["patch"] = _described(state.drawing)
    return to_toml(data)


def scene(state: State) -> Scene:
    """Return the scene that moves the patch with the twist of the state."""
    model = DistributedModel(state.drawing.patch, state.law)
    twist, load = _typed(state)
    return driven(model, twist=twist, normal_force=load, at="origin", t_end=T_END)


def mujoco(state: State) -> str:
    """Return a geom of MuJoCo whose sliding and torsional friction are the half axes of the ellipsoid."""
    mu = state.law.numbers.mu_c
    torsion = state.law.numbers.mu_c * state.drawing.patch.contact_radius()
    return f"""<!-- MuJoCo alone: an ellipsoid with the half axes mu_c f_N and mu_c r f_N -->
<geom condim="4" friction="{mu:.6g} {torsion:.6g} 0"/>

<!-- The limit surface of this patch: planarfriction.adapters.mujoco.PatchContact,
     with patch and law of the Python tab and pf.ReducedModel(patch, law) -->
"""


def _typed(state: State) -> tuple[tuple[float, ...], float]:
    """Return twist and load with the six digits that somebody would type: a drag gives seventeen."""
    twist = tuple(float(f"{each:.6g}") for each in state.twist)
    return twist, float(f"{state.normal_force:.6g}")


def _described(drawing: Drawing) -> dict[str, Any]:
    """Return the patch as a table of a scene file."""
    if drawing.origin == "published":
        return {"shape": "published", "name": drawing.name}
    if drawing.origin == "file":
        return {
            "shape": "pressure-map",
            "file": drawing.name,
            "cell_size": drawing.cell_size,
        }
    return {
        "shape": "pressure-map",
        "cell_size": drawing.cell_size,
        "values": drawing.pressures.tolist(),
    }


def _patch(drawing: Drawing) -> str:
    if drawing.origin == "published":
        return f"pf.patch.PUBLISHED_PATCHES[{drawing.name!r}]()"
    if drawing.origin == "file":
        return f"pf.ContactPatch.from_pressure({drawing.name!r}, cell_size={drawing.cell_size!r})"
    rows = "".join(
        f"    [{', '.join(map(_short, row))}],\n" for row in drawing.pressures.tolist()
    )
    return f"pf.ContactPatch.from_pressure([\n{rows}], cell_size={drawing.cell_size!r})"


def _law(law: Any) -> tuple[str, str]:
    """Return a law with the parameters that are not the defaults, and the line that imports it."""
    kind = type(law)
    given = []
    for each in dataclasses.fields(law):
        value = getattr(law, each.name)
        if value != each.default:
            plain = value.breakaway_ratio if isinstance(value, ElastoPlastic) else value
            given.append(f"{each.name}={plain!r}")
    own = getattr(planarfriction, kind.__name__, None) is not kind
    imported = f"from {kind.__module__} import {kind.__name__}\n" if own else ""
    return f"{'' if own else 'pf.'}{kind.__name__}({', '.join(given)})", imported


def _short(value: float) -> str:
    text = f"{value:g}"
    return text if float(text) == value else repr(value)
