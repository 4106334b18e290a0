"""Costs of the steps of exported C libraries, called in a loop in C, beside the compiled steps of the library."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction.derivatives import rollout
from planarfriction.export import export_c
from planarfriction.models import ReducedModel, ReducedModelPublished
from planarfriction_studies.bench.measurement import (
    Measurement,
    disc,
    law,
    least,
    line,
    mixed_twists,
)

LOOP = """#define _POSIX_C_SOURCE 200809L
#include "friction.h"
#include <time.h>

int loop(int n, double *state, const double *twists, double *wrench)
{
    int i, code = 0;
    for (i = 0; i < n; ++i) {
        code |= friction_step_default(state, twists + 3 * i, 1.0, 1e-4, wrench);
    }
    return code;
}

int body_loop(int n, double *state, const double *pushes, double *wrench)
{
    const friction_body body = { 0.2, 1e-5, { { 0.0, 0.0, 0.0 } } };
    const double load = 1.0;
    double twist[3] = { 0.0, 0.0, 0.0 };
    int i, code = 0;
    for (i = 0; i < n; ++i) {
        code |= friction_body_step(&friction_default, &body, state, twist, &load, 1e-3, pushes + 3 * i, wrench);
    }
    return code;
}

int each(int n, double *state, const double *twists, double *wrench, double *seconds)
{
    int i, code = 0;
    struct timespec begin, end;
    for (i = 0; i < n; ++i) {
        clock_gettime(CLOCK_MONOTONIC, &begin);
        code |= friction_step_default(state, twists + 3 * i, 1.0, 1e-4, wrench);
        clock_gettime(CLOCK_MONOTONIC, &end);
        seconds[i] = (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
    }
    return code;
}
"""
"""Steps in a row, and steps timed one by one, with the clock's own time."""

COUNTED = """#include "friction.h"
#include <stdio.h>
#include <valgrind/callgrind.h>

int main(void)
{
    static double state[FRICTION_STATES], twist[3], wrench[3];
    while (fread(twist, sizeof twist, 1, stdin) == 1) {
        CALLGRIND_ZERO_STATS;
        if (friction_step_default(state, twist, 1.0, 1e-4, wrench) != FRICTION_OK) {
            return 1;
        }
        CALLGRIND_DUMP_STATS;
    }
    return 0;
}
"""
"""Steps in a row, each counted apart."""

STEPS = 150
"""Steps whose instructions are counted."""

SAMPLES = 1_000_000
"""Steps of which the 99.9th percentile is taken."""

MODELS: dict[str, Any] = {
    "reduced": lambda: ReducedModel(disc(), law()),
    "published": lambda: ReducedModelPublished(disc(), law()),
}
"""Models by the end of the benchmark's name."""

NO_VALGRIND = Measurement("", None, "", "left out: needs gcc and valgrind", None, None)
NO_COMPILER = Measurement("", None, "", "left out: needs gcc", None, None)


VECTOR = "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=fast"
"""Options with which cells are stepped in vectors; NaN and infinity still count."""


def library(model: Any, folder: Path, *options: str) -> ctypes.CDLL:
    """Compile the C library of a model with loops around its step, and load it."""
    export_c(model, folder)
    (folder / "loop.c").write_text(LOOP)
    compiled = (
        "gcc",
        "-std=c99",
        "-O3",
        "-march=native",
        *options,
        "-fPIC",
        "-c",
        "friction.c",
        "loop.c",
    )
    linked = "gcc", "-shared", "-o", "friction.so", "friction.o", "loop.o", "-lm"
    for command in (compiled, linked):
        subprocess.run(command, cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "friction.so"))


def step(full: bool, kind: str, vector: bool = False) -> Measurement:
    """Measure a step in C, in a loop in C, against the same steps in a compiled loop."""
    return _measured(kind, _loop, *(VECTOR if vector else ()))


def body(full: bool) -> Measurement:
    """Measure an implicit step of 1 ms of a block that is pushed to and fro, in C, against a step alone in C."""
    return _measured("reduced", _body, *VECTOR)


def percentile(full: bool, kind: str) -> Measurement:
    """Measure the 99.9th percentile of the time of single steps in C against their median."""
    return _measured(kind, _percentile, *VECTOR)


def instructions(full: bool, kind: str) -> Measurement:
    """Count the most instructions of a step in C against the median step, under valgrind."""
    if (
        shutil.which("gcc") is None
        or not Path("/usr/include/valgrind/callgrind.h").exists()
    ):
        return NO_VALGRIND
    with tempfile.TemporaryDirectory() as folder:
        export_c(MODELS[kind](), folder)
        (Path(folder) / "counted.c").write_text(COUNTED)
        made = (
            "gcc",
            "-std=c99",
            "-O2",
            "friction.c",
            "counted.c",
            "-o",
            "counted",
            "-lm",
        )
        subprocess.run(made, cwd=folder, check=True)
        run = "valgrind", "--tool=callgrind", "--callgrind-out-file=counts", "./counted"
        subprocess.run(
            run,
            cwd=folder,
            check=True,
            input=mixed_twists(STEPS).tobytes(),
            capture_output=True,
        )
        dumps = [each.read_text() for each in Path(folder).glob("counts.*")]
    totals = [re.search(r"^totals: (\d+)", each, re.MULTILINE) for each in dumps]
    counts = [int(each[1]) for each in totals if each]
    return line(
        float(max(counts)),
        "instructions",
        "the median of the same steps",
        float(np.median(counts)),
    )


def _measured(kind: str, measure: Any, *options: str) -> Measurement:
    if shutil.which("gcc") is None:
        return NO_COMPILER
    model = MODELS[kind]()
    with tempfile.TemporaryDirectory() as folder:
        return measure(
            model,
            library(model, Path(folder), *options),
            model.rest().ravel(),
            np.empty(3),
        )


def _pointers(*arrays: np.ndarray) -> list[ctypes.c_void_p]:
    return [each.ctypes.data_as(ctypes.c_void_p) for each in arrays]


def _loop(
    model: Any, made: ctypes.CDLL, state: np.ndarray, wrench: np.ndarray
) -> Measurement:
    twists = mixed_twists(20_000)
    ours, theirs = least(
        lambda: made.loop(len(twists), *_pointers(state, twists, wrench)),
        lambda: rollout(model, None, twists, 1.0, 1e-4),
    )
    per = 1e6 / len(twists)
    return line(ours * per, "us", "the same step in a rollout", theirs * per)


def _body(
    model: Any, made: ctypes.CDLL, state: np.ndarray, wrench: np.ndarray
) -> Measurement:
    twists = mixed_twists(20_000)
    pushes = np.outer(np.sin(np.linspace(0.0, 60.0, 20_000)), [1.2, 0.0, 1e-3])
    ours, theirs = least(
        lambda: made.body_loop(len(pushes), *_pointers(state, pushes, wrench)),
        lambda: made.loop(len(twists), *_pointers(state, twists, wrench)),
    )
    per = 1e6 / len(twists)
    return line(ours * per, "us", "one step in C", theirs * per)


def _percentile(
    model: Any, made: ctypes.CDLL, state: np.ndarray, wrench: np.ndarray
) -> Measurement:
    twists = mixed_twists(SAMPLES)
    seconds = np.empty(SAMPLES)
    made.each(SAMPLES, *_pointers(state, twists, wrench, seconds))
    high = np.quantile(seconds, 0.999)
    middle = np.median(seconds)
    return line(
        float(high) * 1e6, "us", "the median of the same steps", float(middle) * 1e6
    )
