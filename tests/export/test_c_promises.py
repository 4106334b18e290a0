"""Promises of C libraries to a controller: what they call, keep and need, and that every compiler agrees."""

import platform
import re
import shutil
import subprocess

import numpy as np
import pytest

from tests.support.c_libraries import (
    HUNG,
    MODELS,
    REDUCED,
    STRICT,
    VECTOR,
    library,
    run,
    samples,
)

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")

MATH = {
    "atan2",
    "cos",
    "exp",
    "expm1",
    "fabs",
    "floor",
    "log",
    "pow",
    "sin",
    "sincos",
    "sqrt",
}
"""Functions of math.h that steps call; sincos is gcc's for a sine and a cosine."""

PLAIN = "-fno-tree-loop-distribute-patterns"
"""Option with which gcc does not call memset and memcpy for loops."""

STEP_STACK = 6144
"""Stack of a reduced model's step as most libraries are compiled, with -O2 [bytes]."""

BODY_STACK = 11264
"""Stack of the step of a body with derivatives of its patches [bytes]."""

FACE_STACK = 9216
"""Stack of the step of a pad whose face is looked for [bytes]."""

SLOPES_STACK = 6144
"""Stack of its step with derivatives [bytes]."""

VECTOR_STACK = 11264
"""Stack of its step in vectors [bytes]: gcc takes 6.4 kB with AVX2 and 10.5 kB with AVX-512."""

QUICK = "few", "table"
EACH = [
    pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
    for name in MODELS
]
FACES = [*EACH, next(iter(HUNG))]
REMOTE = "aarch64-linux-gnu-gcc", "qemu-aarch64"
BARE = "arm-none-eabi-gcc"
HEAP = "malloc", "calloc", "realloc"
COMPILERS = {
    "gcc -O0": ["gcc", "-O0"],
    "gcc -O2": ["gcc", "-O2", "-march=native"],
    "gcc -O3": ["gcc", "-O3"],
    "clang -O0": ["clang", "-O0"],
    "clang -O3": ["clang", "-O3"],
    "no heap": ["gcc", "-O2", *(f"-Wl,--wrap={each}" for each in HEAP)],
    "vectors": ["gcc", *VECTOR],
    "sanitizers": [
        "gcc",
        "-O1",
        "-fsanitize=address,undefined",
        "-fno-sanitize-recover=all",
    ],
    "AArch64": [REMOTE[0], "-O2", "-static"],
}
SHORT = "gcc -O0", "no heap", "vectors"

MAIN = """#include "friction.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void *__wrap_malloc(size_t size) { (void)size; abort(); }
void *__wrap_calloc(size_t count, size_t size) { (void)count; (void)size; abort(); }
void *__wrap_realloc(void *old, size_t size) { (void)old; (void)size; abort(); }

static friction_slopes slopes;

int main(void)
{
    friction_real state[FRICTION_STATES], given[5], wrench[3];
    while (fread(state, sizeof state, 1, stdin) == 1 && fread(given, sizeof given, 1, stdin) == 1) {
        friction_real again[FRICTION_STATES], same[3];
        memcpy(again, state, sizeof state);
        if (friction_step_default(state, given, given[3], given[4], wrench) != FRICTION_OK) {
            return 1;
        }
        if (friction_step_slopes(&friction_default, again, given, given[3], given[4], same, &slopes) != FRICTION_OK) {
            return 2;
        }
        fwrite(state, sizeof state, 1, stdout);
        fwrite(wrench, sizeof wrench, 1, stdout);
        fwrite(slopes.wrench_twist, sizeof slopes.wrench_twist, 1, stdout);
    }
    return 0;
}
"""


def objects(name, compiler, *options):
    """Compile a library alone, without a warning; return its folder."""
    folder = library(name).folder
    subprocess.run(
        [compiler, *STRICT, "-Wvla", *options, "-c", "friction.c", "-o", "alone.o"],
        cwd=folder,
        check=True,
    )
    return folder


def symbols(folder):
    """Return the symbols of a compiled library with their kinds."""
    lines = subprocess.run(
        ["nm", "alone.o"], cwd=folder, check=True, capture_output=True, text=True
    ).stdout
    return {line.split()[-1]: line.split()[-2] for line in lines.splitlines()}


def stack_of(frames, words):
    """Return the bytes of stack of the functions with some words in their names, if each calls the next."""
    return sum(int(size) for where, size, _ in frames if re.search(words, where))


@pytest.mark.parametrize("name", FACES)
def test_calls_and_memory(name):
    """No memory is asked for, nothing that changes is kept, and the stack has a known size."""
    folder = objects(name, "gcc", "-O2", PLAIN, "-fstack-usage")
    kinds = symbols(folder)
    called = {each for each, kind in kinds.items() if kind == "U"}
    assert called <= MATH
    # No data that can be written.
    assert {kind.lower() for kind in kinds.values()} <= {
        "u",
        "t",
        "r",
    }
    frames = [
        line.split("\t") for line in (folder / "alone.su").read_text().splitlines()
    ]
    # Bounded: aligned for vectors.
    assert all(kind in ("static", "dynamic,bounded") for *_, kind in frames)
    if name in REDUCED:
        slopes = stack_of(frames, "slopes")
        asked = stack_of(frames, "twist|holding|search|try_|find_|tilt|moments")
        body = stack_of(frames, "body|coupling|patch|small_matrices")
        assert (
            stack_of(frames, "") - slopes - asked - body < STEP_STACK
            and body < BODY_STACK
        )
        assert slopes < SLOPES_STACK and asked < STEP_STACK
    elif name in HUNG:
        search = stack_of(frames, "step_hung|step_patch|coupling|face|small_matrices")
        last = max(stack_of(frames, each) for each in ("slope_patch", "step_with"))
        assert 2048 < search + last < FACE_STACK


TARGETS = {
    "gcc, AVX2": ("gcc", "-march=haswell"),
    "gcc, AVX-512": ("gcc", "-march=skylake-avx512", "-mprefer-vector-width=512"),
    "clang, AVX2": ("clang", "-march=haswell"),
}
"""Compilers and processors of vector code, which is not run: the same on every machine."""


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("name", [each for each in EACH if each.values[0] in REDUCED])
def test_stack_of_vector_code(name, target):
    compiler, *options = TARGETS[target]
    if shutil.which(compiler) is None or platform.machine() != "x86_64":
        pytest.skip(f"needs {compiler} for x86-64")
    vector = [each for each in VECTOR if each != "-march=native"]
    folder = objects(name, compiler, *vector, *options, "-fstack-usage")
    frames = [
        line.split("\t") for line in next(folder.glob("*.su")).read_text().splitlines()
    ]
    assert (
        0
        < stack_of(frames, r"(?<!body_)step(_of|_with|_default)?(\.|$)")
        < VECTOR_STACK
    )


@pytest.mark.parametrize("name", FACES)
def test_loops_and_calls_end(name):
    """Loops count to constants, and functions call only what stands above them."""
    source = (library(name).folder / "friction.c").read_text()
    code = re.sub(
        r"/\*.*?\*/", "", source[source.index("static int in_range") :], flags=re.DOTALL
    )
    assert not re.search(r"\b(while|do|goto)\b", code)
    loops = re.findall(r"\bfor \((.*)\) \{", code)
    counts = r"(\w+) = [^;<>]+; (?:\1 < [^;]+; \+\+\1|\1 > [^;]+; --\1)"
    assert len(loops) > 5 and all(re.fullmatch(counts, each) for each in loops)
    ends = {
        end
        for each in loops
        for end in re.findall(r"\b[a-zA-Z]\w*", each.split(";")[1])[1:]
    }
    # counters of outer loops, n, and the iterations of the step of a body, which its callers count by numbers
    assert all(re.fullmatch(r"FRICTION_\w+|[cknr]|count|most", each) for each in ends)
    assert all(
        re.fullmatch(r"\(\w+ \? \d+ : \d+\)", each)
        for each in re.findall(r"int most = ([^;]+);", code)
    )
    searches = re.findall(
        r"(?:find|search)_of_coupling\(p, (?:tolerance, )?([^,]+), [^;{]*\);", code
    )
    assert searches and all(re.fullmatch(r"\d+|most|steps", each) for each in searches)
    assert all(
        re.fullmatch(r"\(\w+ \? most : \(\d+ \* most\)\)", each)
        for each in re.findall(r"\bsteps = ([^;]+);", code)
    )
    counted = "|".join(re.findall(r"(\w+)\([^()]*, int count\)", code)) or "none"
    for call in re.findall(rf"^ +(?:{counted})\((.*)\);", code, re.MULTILINE):
        assert re.fullmatch(r"\d+|n", call.rpartition(", ")[2]), call
    assert set(re.findall(r"\bn = ([^;=]+);", code)) == {"3"}
    heads = list(
        re.finditer(
            r"^(?:static )?(?:inline )?(?:int|void|real|double) (\w+)\(",
            code,
            re.MULTILINE,
        )
    )
    ends = [*(each.start() for each in heads[1:]), len(code)]
    assert len(heads) >= 9
    for i, (head, end) in enumerate(zip(heads, ends, strict=True)):
        later = {each[1] for each in heads[i:]}
        assert not later & set(re.findall(r"\b(\w+)\(", code[head.end() : end])), head[
            1
        ]


@pytest.mark.parametrize(
    "options", ["", pytest.param("-fno-math-errno", marks=pytest.mark.slow)]
)
def test_cortex_m7(options):
    if shutil.which(BARE) is None:
        pytest.skip(f"needs {BARE}")
    target = "-mcpu=cortex-m7", "-mfpu=fpv5-d16", "-mfloat-abi=hard", "-mthumb", "-O2"
    folder = objects("table", BARE, *target, PLAIN, *options.split())
    assert {each for each, kind in symbols(folder).items() if kind == "U"} <= MATH


CASES = [
    pytest.param(
        name, each, marks=() if name in QUICK and each in SHORT else pytest.mark.slow
    )
    for name in MODELS
    for each in COMPILERS
]


@pytest.mark.parametrize("name, compiler", CASES)
def test_compilers_agree(name, compiler):
    """Steps and derivatives are the same but for rounding, whatever compiles and runs them."""
    needed = REMOTE if compiler == "AArch64" else COMPILERS[compiler][:1]
    missing = [each for each in needed if shutil.which(each) is None]
    if missing:
        pytest.skip(f"needs {' and '.join(missing)}")
    made = library(name)
    (made.folder / "main.c").write_text(MAIN)
    command = [
        *COMPILERS[compiler],
        *STRICT,
        "-Wvla",
        "friction.c",
        "main.c",
        "-o",
        "program",
        "-lm",
    ]
    subprocess.run(command, cwd=made.folder, check=True)
    inputs = [each[1::2] for each in samples(made.model, made.kind, 1000)]
    state, wrench, slopes = run(made, inputs, slopes=True)
    rows = [each.reshape(len(wrench), -1) for each in inputs]
    program = [
        *(REMOTE[1:] if compiler == "AArch64" else ()),
        str(made.folder / "program"),
    ]
    done = subprocess.run(
        program, input=np.hstack(rows).tobytes(), capture_output=True, check=True
    )
    found = np.frombuffer(done.stdout).reshape(len(wrench), -1)
    n = state[0].size
    for own, other in (
        (found[:, :n], state.reshape(-1, n)),
        (found[:, n : n + 3] / inputs[2][:, None], wrench / inputs[2][:, None]),
        (
            found[:, n + 3 :] / inputs[2][:, None],
            slopes["wrench_twist"].reshape(-1, 9) / inputs[2][:, None],
        ),
    ):
        assert np.abs(own - other).max() < 1e-10 * np.abs(other).max()
