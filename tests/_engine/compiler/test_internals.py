"""A Numba that lacks some of its internals: everything works, slower, with one warning that names the versions."""

from __future__ import annotations

import os
import subprocess
import sys

import llvmlite
import numba
import pytest

from planarfriction._engine.compiler import numba_compat

PROGRAM = """
import importlib, sys, numba
numba.njit(lambda x: x)(1.0)
owner, name = sys.argv[1:]
delattr(importlib.import_module(owner), name)
from planarfriction._engine.compiler import jit, kernel

@kernel
def square(x):
    return x * x

@jit
def fourth(x):
    return square(square(x))

print(fourth(2.0))
"""


@pytest.mark.parametrize(
    ("owner", "name"),
    [
        ("numba.core.codegen", "JITCodeLibrary"),
        ("numba.core.typed_passes", "NativeLowering"),
        ("numba.core.caching", "NullCache"),
        ("numba.core.serialize", "dumps"),
        ("numba.misc.appdirs", "AppDirs"),
    ],
)
def test_without_it_functions_are_compiled_all_the_same(owner, name):
    command = [
        sys.executable,
        "-W",
        "always::RuntimeWarning",
        "-c",
        PROGRAM,
        owner,
        name,
    ]
    run = subprocess.run(
        command,
        capture_output=True,
        text=True,
        env={**os.environ, "NUMBA_BOUNDSCHECK": "0"},
    )
    assert run.stdout.strip() == "16.0", run.stderr
    (line,) = [line for line in run.stderr.splitlines() if "RuntimeWarning" in line]
    assert name in line and numba.__version__ in line and llvmlite.__version__ in line


def test_what_is_there_is_taken_without_a_word(recwarn):
    assert numba_compat.part("math", "pi", None) == pytest.approx(3.14159265)
    assert not recwarn.list
