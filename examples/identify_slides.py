"""Friction of a cube from measured slides, without a force sensor: fitted to half of the tosses, tested on the rest.

The data are from motion capture of a cube that was tossed, landed flat, and slid and spun until it stopped
(ContactNets: Pfrommer, Halm, Posa, CoRL 2020). The table comes with the package; FOLDER may contain another one of the
same format. Each of the five fits takes half a minute; --tosses 60 is enough for a first look.

    python examples/identify_slides.py --splits 3 --out out/
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import planarfriction as pf
from planarfriction.cli.console import print_table, work_progress
from planarfriction.errors import FrictionError
from planarfriction.identify import (
    MassProperties,
    Slide,
    identify_motion,
    predict_slide,
)
from planarfriction.plots import style
from planarfriction_studies.measured import Case as Toss
from planarfriction_studies.measured import slides as measured
from planarfriction_studies.measured.scores import rms

BODY = MassProperties(measured.MASS, measured.INERTIA)
SQUARE = measured.face()
CORNERS = pf.ContactPatch.points(
    0.5
    * measured.SIDE
    * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]),
    name="four corners",
)

WINDOW = 8
"""Number of poses from which the initial state of a slide is estimated: 47 ms of about 290 ms."""

START = pf.LuGre(mu_c=0.22, sigma_0=1e6, sigma_1=20.0, sigma_2=0.02, elasto_plastic=0.9)
"""Dry friction that may grow with speed, with bristles so stiff that only the coefficient matters."""


def ellipsoid(patch: pf.ContactPatch, law: pf.LuGre) -> pf.ReducedModelPublished:
    """The reduced model with an ellipsoid as its limit surface."""
    return pf.ReducedModelPublished(patch, law, surface=pf.LimitSurfaceEllipsoid(patch))


@dataclass(frozen=True)
class Case:
    """Fitted quantities: a contact patch, a model of it, and the parameters."""

    name: str
    patch: pf.ContactPatch
    build: object
    parameters: tuple[str, ...]


CASES = (
    Case("square, mu alone", SQUARE, pf.ReducedModelPublished, ("mu_c",)),
    Case(
        "square, mu and r", SQUARE, pf.ReducedModelPublished, ("mu_c", "contact_radius")
    ),
    Case(
        "square, mu(v) and r",
        SQUARE,
        pf.ReducedModelPublished,
        ("mu_c", "sigma_2", "contact_radius"),
    ),
    Case(
        "corners, mu(v) and r",
        CORNERS,
        pf.DistributedModel,
        ("mu_c", "sigma_2", "contact_radius"),
    ),
    Case(
        "ellipsoid, mu(v) and r",
        SQUARE,
        ellipsoid,
        ("mu_c", "sigma_2", "contact_radius"),
    ),
)


def as_slide(toss: Toss) -> Slide:
    """Convert a toss into a `Slide`."""
    return Slide(toss.question.time, toss.answer, name=toss.name)


def split(
    tosses: Sequence[Toss], seed: int, most: int | None = None
) -> tuple[list[Toss], list[Toss]]:
    """Split (at most `most` different) tosses into halves to fit and to test; copies of a toss stay in one half."""
    ids = np.random.default_rng(seed).permutation(
        sorted({toss.group for toss in tosses})
    )[:most]
    halves = set(ids[: len(ids) // 2]), set(ids[len(ids) // 2 :])
    fit, test = ([toss for toss in tosses if toss.group in half] for half in halves)
    return fit, test


def errors(predicted: np.ndarray, slide: Slide, skipped: int) -> list[float]:
    """Position [mm] and yaw error [deg] at the last sample, then their RMS over the samples after `skipped`."""
    off = (predicted - slide.pose)[skipped:]
    position, yaw = 1e3 * np.hypot(off[:, 0], off[:, 1]), np.degrees(np.abs(off[:, 2]))
    return [position[-1], yaw[-1], rms(position), rms(yaw)]


def run(
    fit: Sequence[Slide], test: Sequence[Slide], cases: Sequence[Case], seed: int
) -> list[tuple[str, ...]]:
    """Fit every case to one half and predict the other, starting from a parabola and from the first poses."""
    rows = []
    for case in cases:
        options = {
            "parameters": case.parameters,
            "start": _start(case),
            "model": case.build,
            "samples": WINDOW,
        }
        with work_progress(case.name) as progress:
            found = identify_motion(fit, case.patch, BODY, **options, progress=progress)
        told = ", ".join(
            f"{n} {v:.4g} ± {found.errors[n]:.1g}" for n, v in found.estimates.items()
        )
        for name, samples in (("parabola", None), (f"first {WINDOW} poses", WINDOW)):
            all_errors = [
                errors(
                    predict_slide(found.model, BODY, s, samples=samples),
                    s,
                    samples or 0,
                )
                for s in test
            ]
            rows.append(
                (
                    str(seed),
                    case.name,
                    name,
                    told,
                    *(f"{rms(e):.2f}" for e in np.array(all_errors).T),
                )
            )
        print(
            " | ".join(rows[-2]),
            "\n",
            " | ".join(rows[-1]),
            file=sys.stderr,
            flush=True,
        )
    return rows


def _start(case: Case) -> pf.LuGre:
    """The initial guess; without a viscous term unless that is fitted."""
    from dataclasses import replace

    return START if "sigma_2" in case.parameters else replace(START, sigma_2=0.0)


def friction_of_each(slides: Sequence[Slide]) -> tuple[np.ndarray, np.ndarray]:
    """Initial speed [m/s] and friction coefficient of each slide, identified from that slide alone."""
    found = [
        identify_motion(s, SQUARE, BODY, parameters=("mu_c",), start=_start(CASES[0]))
        for s in slides
    ]
    starts = np.array([each.histories[0]["start"] for each in found])
    return np.hypot(starts[:, 3], starts[:, 4]), np.array(
        [each.estimates["mu_c"] for each in found]
    )


def draw(speed: np.ndarray, mu: np.ndarray) -> style.PlotFigure:
    """Plot the friction of every slide against its initial speed."""
    with style.paper():
        figure = style.new_figure(5.5, 3.0)
        axes = figure.add_subplot()
        axes.plot(speed, mu, ".", color=style.MEASURED, markersize=5)
        middle = np.median(mu)
        axes.axhline(middle, color="black", linewidth=1.2)
        place = {"xytext": (-4, 4), "textcoords": "offset points", "ha": "right"}
        axes.annotate(f"median {middle:.3f}", (speed.max(), middle), **place)
        axes.set(
            xlabel="initial speed [m/s]", ylabel="friction coefficient of the slide"
        )
        style.tidy(axes)
    return figure


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "folder",
        type=Path,
        nargs="?",
        help="folder with the table (default: the one of the package)",
    )
    parser.add_argument("--splits", type=int, default=1, help="number of splits")
    parser.add_argument(
        "--tosses", type=int, help="use at most this many different tosses"
    )
    parser.add_argument(
        "--out", type=Path, help="folder for a picture of the friction of every slide"
    )
    options = parser.parse_args(arguments)
    try:
        tosses = measured.read(options.folder)
        rows = []
        for seed in range(options.splits):
            fit, test = (
                [as_slide(toss) for toss in half]
                for half in split(tosses, seed, options.tosses)
            )
            rows += run(fit, test, CASES, seed)
        headings = [
            "split",
            "model",
            "start from",
            "fitted",
            "end [mm]",
            "end [deg]",
            "way [mm]",
            "way [deg]",
        ]
        print_table(
            "RMS errors on the test half: at the end, and along the way", headings, rows
        )
        if options.out is not None:
            options.out.mkdir(parents=True, exist_ok=True)
            chosen = tosses if options.tosses is None else tosses[: options.tosses]
            speed, mu = friction_of_each([as_slide(toss) for toss in chosen])
            print(
                f"friction of single slides: median {np.median(mu):.4f}, spread {mu.std():.4f}"
            )
            draw(speed, mu).savefig(options.out / "identify_slides.png")
    except (FrictionError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
