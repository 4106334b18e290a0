"""`planarfriction doctor`: the installation, its machine code and its processor, and a self-test with known numbers."""

from __future__ import annotations

import platform
import statistics
import sys
import timeit
from collections.abc import Callable, Iterator
from functools import partial
from importlib import metadata
from typing import TYPE_CHECKING, Any, NamedTuple

import click

import planarfriction as pf
from planarfriction.errors import one_line
from planarfriction.families import MODELS, PUBLISHED_PATCHES

if TYPE_CHECKING:
    from packaging.requirements import Requirement

FEATURES = ("sse4.2", "avx", "avx2", "fma", "avx512f", "neon", "sve")
"""Features of processors on which the speed of compiled loops depends, by LLVM's names."""

_CALLS = 200
"""Calls of a step in a round."""

_ROUNDS = 25
"""Rounds whose median is shown."""


class Check(NamedTuple):
    """One number of the self-test."""

    words: str
    """Quantity and unit."""
    found: Callable[[], Any]
    expected: float
    tolerance: float
    """Largest error, in the same unit."""

    def outcome(self) -> tuple[str, bool]:
        """Return the number beside the expected one in words, and True if it is within its tolerance."""
        try:
            found = float(self.found())
        except Exception as error:  # whatever is broken here is what the report is for
            return one_line(f"FAILS, {type(error).__name__}: {error}"), False
        right = abs(found - self.expected) <= self.tolerance
        wanted = f"expected {self.expected:.9g} to {self.tolerance:.2g}"
        return f"{'holds' if right else 'FAILS'}, {found:.9g} ({wanted})", right


def checks() -> list[Check]:
    """Return the numbers of the self-test: closed forms, and scenes that other solvers have converged.

    Closed forms hold to rounding; scenes end within 2 um and 2e-5 rad of converged ones at the default tolerances.
    """
    exact = pf.LimitSurfaceExact
    rectangle = pf.ContactPatch.rectangle(0.03, 0.04)
    disc = pf.ContactPatch.disc(0.01)
    corner = (0.02, -0.015, 1.0)
    plain = pf.ReducedModel(disc, pf.LuGre())
    slid = plain.rest(), (1e-3, 0.0, 0.0), 1.0, 1e-3
    found = [
        # 2 R/3: contact radius of an evenly pressed disc
        Check(
            "torque of a spinning disc [m]",
            lambda: -exact(disc).wrench((0.0, 0.0, 1.0))[2],
            0.02 / 3.0,
            1e-12,
        ),
        # [2 a b d + a^3 asinh(b/a) + b^3 asinh(a/b)]/(6 a b), d^2 = a^2 + b^2: mean distance from the corner
        Check(
            "rectangle rotated about its corner [m]",
            lambda: exact(rectangle).dissipation(corner),
            0.026947771,
            1e-9,
        ),
        # mu_c (1 - e) + sigma_1 v e + sigma_2 v, e = exp(-sigma_0 v dt/mu_c)
        Check(
            "force of plain LuGre after a step [N]",
            lambda: -plain.step(*slid)[1][0],
            0.926624112,
            1e-9,
        ),
    ]
    # converged by fine-step Runge-Kutta
    for name, y, angle in (
        ("distributed", -0.0194834713, -0.1259959191),
        ("reduced-published", -0.0197103377, -0.1260840893),
    ):
        found += [
            Check(f"in-hand plate, {name}, y [m]", partial(_end, name, "y"), y, 2e-6),
            Check(
                f"in-hand plate, {name}, angle [rad]",
                partial(_end, name, "theta"),
                angle,
                2e-5,
            ),
        ]
    return found


def _model(name: str) -> Any:
    """Return a model of the published disc and friction."""
    law = pf.LuGre(mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.9))
    return MODELS[name](PUBLISHED_PATCHES["Circle"](), law)


def _end(name: str, coordinate: str) -> float:
    """Return a coordinate at the end of the published in-hand run with load 2."""
    scene = pf.scenes.in_hand(_model(name), normal_force=pf.scenes.in_hand_load(2))
    return float(pf.simulate(scene).data[coordinate][-1])


def requirements() -> Iterator[tuple[str, list[Requirement]]]:
    """Yield each extra of the installed distribution with its packages; first "", what the library always needs."""
    from packaging.requirements import Requirement

    try:
        installed = metadata.metadata("planarfriction")
    except metadata.PackageNotFoundError:  # sources that nobody has installed
        return
    every = [Requirement(line) for line in installed.get_all("Requires-Dist") or ()]
    needed = lambda each, extra: (
        each.marker is None or each.marker.evaluate({"extra": extra})
    )
    for extra in ("", *(installed.get_all("Provides-Extra") or ())):
        own = [
            each
            for each in every
            if needed(each, extra) and (not extra or not needed(each, ""))
        ]
        yield extra, [each for each in own if each.name != "planarfriction"]


def state_of(requirement: Requirement) -> tuple[str, bool]:
    """Return a package with its installed version in words, and True if that version is one that is needed."""
    try:
        version = metadata.version(requirement.name)
    except metadata.PackageNotFoundError:
        return f"{requirement.name} is missing", False
    right = requirement.specifier.contains(version, prereleases=True)
    needs = "" if right else f" (needs {requirement.specifier})"
    return f"{requirement.name} {version}{needs}", right


def processor() -> list[tuple[str, str]]:
    """Return lines about the processor, for which LLVM compiles."""
    from planarfriction._engine.compiler.machine_code import target
    from planarfriction._engine.compiler.threads import processors

    name, have = target()
    return [
        ("processor", f"{platform.machine()}, {name}, {processors()} for this process"),
        (
            "features",
            ", ".join(each for each in FEATURES if each in have)
            or "none of those that matter",
        ),
    ]


def machine_code() -> list[tuple[str, str]]:
    """Return lines about the machine code on disk that belongs to these sources."""
    from planarfriction._engine.compiler import SOURCES
    from planarfriction._engine.compiler.machine_code import folders, whole

    rows = []
    for folder in folders(SOURCES):
        files = [file for file in folder.glob("*.machine") if file.is_file()]
        size = sum(file.stat().st_size for file in files)
        damaged = sum(not whole(file) for file in files)
        kept = (
            f"{len(files)} functions, {size / 1e6:.1f} MB, {damaged} damaged"
            if files
            else "none"
        )
        rows.append((f"machine code in {folder}", kept))
    return rows


def step_times() -> list[tuple[str, str]]:
    """Return lines with the median time of a step of each model, called from Python."""
    rows = []
    for name in ("reduced", "reduced-published", "distributed"):
        model = _model(name)
        call = partial(model.step, model.rest(), (0.01, 0.0, 1.0), 1.0, 1e-4)
        times = timeit.repeat(call, number=_CALLS, repeat=_ROUNDS)
        rows.append(
            (f"step, {name}", f"{1e6 * statistics.median(times) / _CALLS:.2f} us")
        )
    return rows


@click.command(short_help="Check this installation; the output belongs in bug reports.")
def doctor() -> int:
    """Check this installation: versions, extras, machine code on disk, processor, time of a step, and a self-test.

    The self-test compares a few results with known numbers. It takes some ten seconds where code has to be compiled.
    The exit code is 1 if a number is out of its tolerance or a needed package is missing or too old.
    Please copy the output into bug reports.
    """
    from planarfriction.cli import OUT_OF_TOLERANCE
    from planarfriction.cli.console import work_progress

    extras = dict(requirements())
    packages = [state_of(each) for each in extras.pop("", [])]
    outcomes = []
    with work_progress("checking") as progress:
        for check in checks():
            progress(check.words)
            outcomes.append((check.words, *check.outcome()))
        progress("time of a step")
        times = step_times()
    lines = [
        ("planarfriction", f"{pf.__version__} in {pf.__path__[0]}"),
        ("Python", f"{platform.python_version()} in {sys.prefix}"),
        ("system", platform.platform()),
        (
            "packages",
            ", ".join(words for words, _ in packages)
            or "unknown, planarfriction is not installed",
        ),
        *(
            (f"extra {name}", ", ".join(state_of(each)[0] for each in those))
            for name, those in extras.items()
        ),
        *processor(),
        *machine_code(),
        *times,
        *((f"self-test, {words}", outcome) for words, outcome, _ in outcomes),
    ]
    for name, words in lines:
        print(f"{name}: {words}")
    good = all(right for _, right in packages) and all(right for *_, right in outcomes)
    print(
        "everything is as it should be"
        if good
        else "something is wrong: see FAILS, missing and needs above"
    )
    return 0 if good else OUT_OF_TOLERANCE
