"""Measure a step of exported C on this processor, estimate it on two others, and write the table of `export-c.md`.

`python docs/make_cycles.py`. Steps for other processors run in QEMU, which counts their instructions and whose results
are those of Python; llvm-mca has the cycles of each straight piece of the program, without branches and without waiting
for memory. Measured cycles are the processor time, the tenth percentile of many runs, over that of an addition in a
chain. Needed: gcc, aarch64-linux-gnu-gcc and arm-none-eabi-gcc with C libraries, qemu-user, llvm-mca.
"""

from __future__ import annotations

import itertools
import re
import subprocess
import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

import planarfriction as pf
from planarfriction_studies.bench.exported import VECTOR
from planarfriction_studies.bench.measurement import disc, law, mixed_twists

DISCS = (8, 16, 24)
"""Discs of the columns."""

STEPS = 30
"""Steps of which the mean is taken, at speeds on both sides of the Stribeck speed."""

LOAD, DT = 2.0, 1e-3
"""Normal force [N] and time step [s]."""

BODY = 0.2, 1e-5
"""Mass [kg] and inertia [kg m^2] of a body that slides."""

PUSH = 2.3, 0.0, 1e-3
"""Wrench on it [N, N, N m]."""

TWIST = 0.1, 0.0, 3.0
"""Twist at its start [m/s, m/s, rad/s]."""

CLOSE = 1e-9
"""Largest distance of a wrench from that of Python, over the largest."""

AGAIN = 10
"""Times that llvm-mca runs each piece."""

TABLE = re.compile(r"(?<=<!-- cycles -->\n\n)(?:\|.*\n)*")
"""Table on the page."""

PROGRAM = """#include "friction.h"

static const double twists[][3] = {
%s
};
static double state[FRICTION_STATES], out[5];
static volatile int place;

__attribute__((noinline)) void steps_begin(void) { place = 1; }
__attribute__((noinline)) void steps_end(void) { place = 2; }

static int steps(void)
{
    const friction_body body = { %s, { { 0.0, 0.0, 0.0 } } };
    const double load = %r, push[] = { %s };
    double twist[] = { %s };
    int i, code = 0;
    friction_rest(state);
    for (i = 0; i < (int)(sizeof twists / sizeof twists[0]); ++i) {
#ifdef BODY
        code |= friction_body_step(&friction_default, &body, state, twist, &load, %r, push, out);
#else
        code |= friction_step_default(state, twists[i], load, %r, out);
#endif
    }
    (void)body;
    (void)push;
    (void)twist;
    return code;
}

#ifdef TIMED
#include <stdlib.h>
#include <time.h>
#define ROUNDS 1000

static void chain(void)
{
    long x = 1; /* sums with constants take no time on some processors */
    int i;
    for (i = 0; i < 2000; ++i) {
        __asm__ volatile("add %%0,%%0\\n add %%0,%%0\\n add %%0,%%0\\n add %%0,%%0\\n add %%0,%%0" : "+r"(x));
    }
}

static int order(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double tenth(int steps_too)
{
    static double times[ROUNDS];
    int k;
    for (k = 0; k < ROUNDS; ++k) {
        struct timespec begin, end;
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &begin);
        if (steps_too) {
            steps();
        } else {
            chain();
        }
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
        times[k] = (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
    }
    qsort(times, ROUNDS, sizeof times[0], order);
    return times[ROUNDS / 10];
}
#endif

int main(void)
{
    int code;
    steps_begin();
    code = steps();
    steps_end();
#ifdef TIMED
    out[3] = tenth(1);
    out[4] = tenth(0) / 10000.0;
#endif
    return code;
}

#ifdef BARE  /* without an operating system's library, but under one */
static long call(long number, long a, long b, long c)
{
    register long r7 __asm__("r7") = number;
    register long r0 __asm__("r0") = a;
    register long r1 __asm__("r1") = b;
    register long r2 __asm__("r2") = c;
    __asm__ volatile("svc 0" : "+r"(r0) : "r"(r7), "r"(r1), "r"(r2) : "memory");
    return r0;
}

void _start(void)
{
    int code = main();
    call(4, 1, (long)out, sizeof out);
    call(1, code, 0, 0);
}
#else
#include <stdio.h>
__attribute__((destructor)) static void write_out(void) { fwrite(out, sizeof out, 1, stdout); }
#endif
"""


class Target(NamedTuple):
    """A processor and options."""

    name: str
    """Words of the table."""
    compiler: tuple[str, ...]
    emulator: tuple[str, ...] = ()
    """Command of QEMU; none for this processor."""
    tools: str = ""
    """Prefix of the names of its tools."""
    model: tuple[str, ...] = ()
    """Options of llvm-mca."""


HERE = ("gcc", "-std=gnu99", "-DTIMED")
TARGETS = (
    Target("x86-64, `-O2`", (*HERE, "-O2")),
    Target("x86-64-v3, options above", (*HERE, "-O3", "-march=x86-64-v3", *VECTOR)),
    Target(
        "Cortex-A53, `-O2`",
        ("aarch64-linux-gnu-gcc", "-O2", "-mcpu=cortex-a53", "-static"),
        ("qemu-aarch64",),
        "aarch64-linux-gnu-",
        ("-mtriple=aarch64", "-mcpu=cortex-a53"),
    ),
    Target(
        "Cortex-M7 with a double-precision unit, `-O2`",
        (
            *("arm-none-eabi-gcc", "-DBARE", "-O2", "-mcpu=cortex-m7", "-mthumb"),
            *("-mfpu=fpv5-d16", "-mfloat-abi=hard", "--specs=nosys.specs"),
            *("-nostartfiles", "-Wl,-Ttext=0x100000"),
        ),
        ("qemu-arm", "-cpu", "max"),
        "arm-none-eabi-",
        ("-mtriple=thumbv7em-none-eabihf", "-mcpu=cortex-m7"),
    ),
)
"""Rows of the table."""

BRANCH = re.compile(
    r"(b|bl|br|blr|bx|blx|ret|cbz|cbnz|tbz|tbnz)(\.[nw])?$|"
    r"b\.?(eq|ne|cs|cc|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)(\.[nw])?$"
)
"""Names of branches of both."""

UNKNOWN = re.compile(r"vcmp|it[te]*$")
"""Names of instructions that llvm-mca does not know."""

CONDITION = re.compile(r"(eq|ne|cs|cc|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)(?=$|\.)")
"""Condition at the end of the name of an instruction behind `it`."""

LINE = re.compile(r"^ *([0-9a-f]+):\t(\S+)(?:\t(.*))?$", re.MULTILINE)
"""Address, name and operands of an instruction."""


def output_of(*command: str | Path) -> bytes:
    """Return what a command prints."""
    return subprocess.run(command, capture_output=True, check=True).stdout


def numbers(values: Sequence[float]) -> str:
    """Return numbers as C has them."""
    return ", ".join(repr(float(each)) for each in values)


def compiled(
    target: Target, model: pf.ReducedModel, slides: bool, folder: Path
) -> Path:
    """Return the program of a target, of steps at given twists or of a body that slides."""
    pf.export_c(model, folder)
    rows = ",\n".join(f"    {{ {numbers(each)} }}" for each in mixed_twists(STEPS))
    body = numbers(BODY), LOAD, numbers(PUSH), numbers(TWIST)
    (folder / "main.c").write_text(PROGRAM % (rows, *body, DT, DT))
    options = ["-DBODY"] if slides else []
    sources = "friction.c", "main.c"
    command = [*target.compiler, *options, *sources, "-o", "program", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    return folder / "program"


def executed(target: Target, program: Path) -> tuple[np.ndarray, Counter[int]]:
    """Run a program in QEMU; return its results, and how often instructions of its steps run, by address."""
    log = program.with_name("log")
    options = "-singlestep", "-d", "exec,nochain", "-D", str(log)
    found = np.frombuffer(output_of(*target.emulator, *options, program))
    names = output_of(f"{target.tools}nm", program).decode().splitlines()
    places = {line.split()[-1]: line.split()[0] for line in names}
    begin, end = (int(places[f"steps_{each}"], 16) for each in ("begin", "end"))
    counts: Counter[int] = Counter()
    inside = False
    with log.open() as lines:
        for line in lines:
            if line.startswith("Trace"):
                address = int(line.split("/", 2)[1], 16)
                inside = (inside or address == begin) and address != end
                counts[address] += inside
    return found, counts


def pieces_of(
    target: Target, program: Path, counts: Counter[int]
) -> list[tuple[int, list[str]]]:
    """Return the straight pieces of a program that ran: how often, and their assembly, with nops for branches."""
    listing = output_of(f"{target.tools}objdump", "-d", "--no-show-raw-insn", program)
    pieces: list[tuple[int, list[str]]] = []
    before = 0
    conditional = 0
    for address, name, operands in LINE.findall(listing.decode()):
        count = counts[int(address, 16)]
        branch = BRANCH.match(name)
        if count and count != before:
            pieces.append((count, []))
        if count:
            if conditional:
                name = CONDITION.sub("", name, count=1)
                conditional -= 1
            if re.match(r"it[te]*$", name):
                conditional = len(name) - 1
            operands = re.sub(r"\s*(;|//|@).*", "", operands)
            operands = re.sub(r"\b[0-9a-f]+ <[^>]*>", "0", operands)
            text = re.sub(r"\.[nw] ", " ", f"{name} {operands}")
            text = re.sub(r"^(vmov\S* d\d+), #\d+$", r"\1, #1.0", text)
            pieces[-1][1].append("nop" if branch or UNKNOWN.match(name) else text)
        before = 0 if branch else count
    return pieces


def cycles(target: Target, pieces: Sequence[tuple[int, list[str]]]) -> float:
    """Return the cycles of all pieces."""
    text = ""
    for i, (_, lines) in enumerate(pieces):
        begin, end = (f"/* LLVM-MCA-{each} p{i} */" for each in ("BEGIN", "END"))
        text += "\n".join([begin, *lines, end, ""])
    command = "llvm-mca", *target.model, f"-iterations={AGAIN}", "-"
    done = subprocess.run(command, input=text, capture_output=True, text=True)
    totals = re.findall(r"^Total Cycles: +(\d+)", done.stdout, re.MULTILINE)
    if len(totals) != len(pieces):
        raise SystemExit(done.stderr)
    both = zip(pieces, totals, strict=True)
    return sum(count * int(total) / AGAIN for (count, _), total in both)


def last_wrench(model: pf.ReducedModel, slides: bool) -> np.ndarray:
    """Return the wrench after the last step in Python."""
    if not slides:
        return pf.rollout(model, None, mixed_twists(STEPS), LOAD, DT)[1][-1]
    body = pf.SlidingBody(*BODY, model)
    state, twist, wrench = body.rest(), TWIST, np.zeros(3)
    for _ in range(STEPS):
        state, twist, wrench = body.step(state, twist, LOAD, DT, PUSH)
    return wrench


def of_step(target: Target, discs: int, slides: bool) -> str:
    """Return the cycles of a step with so many discs, and what is known beside."""
    model = pf.ReducedModel(disc(), law(), cells=discs)
    expected = last_wrench(model, slides)
    with tempfile.TemporaryDirectory() as made:
        program = compiled(target, model, slides, Path(made))
        if target.emulator:
            found, counts = executed(target, program)
            taken = cycles(target, pieces_of(target, program, counts)) / STEPS
            beside = f"{rounded(counts.total() / STEPS)} instructions"
        else:
            found = np.frombuffer(output_of(program))
            taken = found[3] / STEPS / found[4]
            beside = f"{1e6 * found[3] / STEPS:.2g} µs"
    off = np.abs(found[:3] - expected).max() / np.abs(expected).max()
    assert off < CLOSE, (target.name, off)
    return f"{rounded(taken)} cycles, {beside}"


def rounded(value: float) -> str:
    """Return a number with two digits."""
    return f"{int(float(f'{value:.2g}')):,}"


def main() -> None:
    """Write the table."""
    head = ["processor, options", "", *(f"{each} discs" for each in DISCS)]
    rows = [head, ["---"] * len(head)]
    for target, slides in itertools.product(TARGETS, (False, True)):
        name = "the same, `friction_body_step`, sliding" if slides else target.name
        how = "estimated" if target.emulator else "measured"
        rows.append([name, how, *(of_step(target, each, slides) for each in DISCS)])
        print(*rows[-1], sep="; ", flush=True)
    lines = "".join(f"| {' | '.join(row)} |\n" for row in rows)
    page = Path(__file__).with_name("export-c.md")
    page.write_text(TABLE.sub(lambda _: lines, page.read_text("utf-8")), "utf-8")


if __name__ == "__main__":
    main()
