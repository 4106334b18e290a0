"""Exported C libraries, compiled and loaded, and random inputs for their steps."""

from __future__ import annotations

import ctypes
import functools
import subprocess
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import planarfriction as pf
from tests.support import single_precision

DISC = pf.ContactPatch.disc(0.01)
FEW = pf.ContactPatch.disc(0.01, cells=5)
METRIC = pf.ContactPatch.rectangle(0.02, 0.01).with_friction_metric(
    [[1.0, 0.2], [0.2, 1.5]]
)
LAW = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
MODELS = {
    "few": lambda: pf.ReducedModel(DISC, LAW),
    "plain": lambda: pf.ReducedModel(DISC, pf.LuGre(mu_s=1.2)),
    "distributed": lambda: pf.DistributedModel(METRIC, LAW),
    "discs": lambda: pf.DistributedModel(FEW.discs(), LAW),
    "turned discs": lambda: pf.DistributedModel(
        FEW.with_friction_metric([[1.0, 0.2], [0.2, 1.5]]).discs(), LAW
    ),
    "table": lambda: pf.ReducedModelPublished(DISC, LAW),
    "potential": lambda: pf.ReducedModelPublished(
        METRIC, LAW, surface=pf.LimitSurfaceTable(METRIC)
    ),
    "ellipsoid": lambda: pf.ReducedModelPublished(
        DISC, LAW, surface=pf.LimitSurfaceEllipsoid(DISC)
    ),
    "plain ellipsoid": lambda: pf.ReducedModelPublished(
        DISC, pf.LuGre(mu_s=1.2), surface=pf.LimitSurfaceEllipsoid(DISC)
    ),
}
MAPS = {
    load: np.clip(np.add.outer(np.arange(-4, 5), load * np.arange(-4, 5)), 0.0, None)
    for load in (0.5, 1.0, 3.0)
}
FOLLOWING = {
    "soft": lambda: pf.ReducedModel(
        pf.ContactPatch.disc(
            0.01, pressure=pf.SoftFinger(k=2.0, c=0.009, n=1.0 / 3.0), cells=5
        ),
        LAW,
    ),
    "maps": lambda: pf.DistributedModel(
        pf.ContactPatch.from_pressure(MAPS, cell_size=1e-3), LAW
    ),
}
"""Models whose shape follows the load."""
TURNED = {
    name: functools.partial(pf.DistributedModel, single_precision.PATCHES[name], LAW)
    for name in ("three feet", "feet on a line", "many points")
}
"""Models with cells along lines, of which some lie along no axis."""
_AT_LOAD, _LAYER = pf.Pad.at_load(2.0), pf.Pad.layer(12e6, 2e-3)
"""As stiff as bristles under 2 N, the layer of a disc of 1 cm."""
PADS = {
    "discs at a load": lambda: pf.ReducedModel(DISC, LAW, pad=_AT_LOAD),
    "layer of points": lambda: pf.DistributedModel(FEW, pf.LuGre(mu_s=1.2), pad=_LAYER),
    "metric at a load": lambda: pf.DistributedModel(METRIC, LAW, pad=_AT_LOAD),
}
"""Models on elastic pads."""
_QUIET = pf.LuGre(mu_s=1.2, sigma_1=0.0, elasto_plastic=0.9)
HUNG = {
    "half-space": lambda: pf.ReducedModel(
        FEW, _QUIET, cells=8, pad=pf.Pad.half_space(2e6, 0.4)
    ),
    "measured": lambda: pf.DistributedModel(
        FEW, pf.LuGre(mu_s=1.2, sigma_1=0.0, sigma_2=0.2), pad=pf.Pad.measured(1e5, 0.4)
    ),
}
"""Models on pads whose face hangs on its back."""
FOLLOWING["soft layer"] = lambda: pf.ReducedModel(
    FOLLOWING["soft"]().patch, LAW, pad=_LAYER
)
REDUCED = [name for name in MODELS if name != "distributed"]
KINDS = {"double": np.float64, "float": np.float32}
STRICT = "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror"

VECTOR = (
    "-O3",
    "-march=native",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-ffp-contract=fast",
)
"""Options that a page recommends: cells in vectors."""

DRIVER = """#include "friction.h"

int run(int n, friction_real *state, const friction_real *twist, const friction_real *load, const friction_real *dt,
    friction_real *wrench, friction_slopes *slopes)
{
    int i, code = 0;
    for (i = 0; i < n && code == 0; ++i) {
        friction_real *z = state + (long)i * FRICTION_STATES, *w = wrench + 3 * i;
        code = slopes ? friction_step_slopes(&friction_default, z, twist + 3 * i, load[i], dt[i], w, slopes + i)
                      : friction_step_default(z, twist + 3 * i, load[i], dt[i], w);
    }
    return code;
}

void run_bodies(int n, const friction_body *body, friction_real *state, friction_real *twist, const friction_real *load,
    const friction_real *dt, const friction_real *push, friction_real *wrench, int *codes)
{
    int i;
    for (i = 0; i < n; ++i) {
        friction_real *z = state + (long)i * FRICTION_PATCHES * FRICTION_STATES;
        codes[i] = friction_body_step(&friction_default, body, z, twist + 3 * i, load + (long)i * FRICTION_PATCHES,
            dt[i], push + 3 * i, wrench + 3 * i);
    }
}

int run_steady(int n, const friction_real *twist, const friction_real *load, friction_real *wrench)
{
    int i, code = 0;
    for (i = 0; i < n && code == 0; ++i) {
        code = friction_steady(&friction_default, twist + 3 * i, load[i], wrench + 3 * i);
    }
    return code;
}
"""


class Library(NamedTuple):
    """A model, and its C library as it was written and as it was compiled."""

    model: Any
    folder: Path
    kind: type
    functions: Any


@functools.cache
def _folder() -> tempfile.TemporaryDirectory:
    return tempfile.TemporaryDirectory()


@functools.cache
def library(
    name: str, precision: str = "double", *options: str, patches: int = 1
) -> Library:
    """Compile the model called `name` once, without a warning, and load it."""
    model = (MODELS | FOLLOWING | TURNED | PADS | HUNG)[name]()
    folder = Path(_folder().name) / "-".join([name, precision, str(patches), *options])
    pf.export_c(model, folder, precision=precision, patches=patches)
    (folder / "driver.c").write_text(DRIVER)
    compiled = (
        "gcc",
        *STRICT,
        *(options or ("-O1",)),
        "-fPIC",
        "-c",
        "friction.c",
        "driver.c",
    )
    for command in (
        compiled,
        ("gcc", "-shared", "-o", "friction.so", "friction.o", "driver.o", "-lm"),
    ):
        subprocess.run(command, cwd=folder, check=True)
    return Library(model, folder, KINDS[precision], ctypes.CDLL(folder / "friction.so"))


def samples(model: Any, kind: type, count: int, seed: int = 0) -> list[np.ndarray]:
    """Draw states, twists, loads and steps from rest to slip, rounded to a precision."""
    rng = np.random.default_rng(seed)
    twist = (
        rng.normal(size=(count, 3))
        * [1.0, 1.0, 150.0]
        * 10.0 ** rng.uniform(-6.0, -0.5, (count, 1))
    )
    load = 10.0 ** rng.uniform(-2.0, 2.0, count)
    dt = 10.0 ** rng.uniform(-5.0, -2.0, count)
    load[::50] = 0.0
    twist[::70] = 0.0
    state, _ = model.step(
        np.broadcast_to(model.rest(), (count, *model.state_shape)),
        twist[::-1],
        1.0,
        1e-3,
    )
    # Off the bound of slip.
    state[1::2] *= rng.uniform(
        0.2, 1.1, (len(state[1::2]), *[1] * len(model.state_shape))
    )
    return [
        np.ascontiguousarray(each.astype(kind).astype(float))
        for each in (state, twist, load, dt)
    ]


def slopes_type(model: Any, kind: type) -> np.dtype:
    """Return the record of derivatives of a model."""
    states = int(np.prod(model.state_shape))
    own = model.reduction.patch.bristles if model.pad else model.state_shape[0]
    pad = model.pad
    face = pad is not None and model.compiled.compliance is not None
    count = 6 + bool(model.law.elasto_plastic) - (pad == _LAYER) - 2 * face
    shapes = {
        "wrench_state": (3, states), "wrench_twist": (3, 3), "wrench_load": (3,), "wrench_params": (3, count),
        "state_state": (states, own),
    }  # fmt: skip
    shapes |= {"state_face": (states, 3), "face_state": (3, states)} if face else {}
    shapes |= {"state_twist": (states, 3), "state_params": (states, count)}
    shapes |= {} if pad is None else {"state_load": (states,)}
    return np.dtype([(name, kind, shape) for name, shape in shapes.items()])


def run(
    made: Library, inputs: list[np.ndarray], slopes: bool = False
) -> tuple[Any, ...]:
    """Return new states, wrenches and, if asked for, derivatives of steps in C."""
    state, twist, load, dt = (np.array(each, made.kind, order="C") for each in inputs)
    wrench = np.empty((len(load), 3), made.kind)
    found = np.empty(len(load) if slopes else 0, slopes_type(made.model, made.kind))
    pointers = [
        each.ctypes.data_as(ctypes.c_void_p)
        for each in (state, twist, load, dt, wrench)
    ]
    assert (
        made.functions.run(
            len(load),
            *pointers,
            found.ctypes.data_as(ctypes.c_void_p) if slopes else None,
        )
        == 0
    )
    return (state, wrench, found) if slopes else (state, wrench)


def run_steady(made: Library, twist: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Return the wrenches of steady sliding in C."""
    twist, load, wrench = (
        np.array(twist, made.kind),
        np.array(load, made.kind),
        np.empty(twist.shape, made.kind),
    )
    pointers = [each.ctypes.data_as(ctypes.c_void_p) for each in (twist, load, wrench)]
    assert made.functions.run_steady(len(load), *pointers) == 0
    return wrench
