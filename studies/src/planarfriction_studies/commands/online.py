"""`planarfriction online`: trials of the observer and the controllers of a gripper."""

from __future__ import annotations

import json
from pathlib import Path

import click

from planarfriction.cli.options import FILE

WORDS = {
    "slipped": "parts that slipped at the exploration",
    "coverage_95": "95 % intervals that hold mu_c after the first slip",
    "mu_c_within_5_percent": "mu_c within 5 %, or said to be undetermined",
    "mu_c_determined": "mu_c said to be determined",
    "mu_c_median_error": "median relative error of mu_c",
    "mu_s_coverage_95": "95 % intervals that hold mu_s",
    "mu_s_within_5_percent": "mu_s within 5 %, or said to be undetermined",
    "mu_s_determined": "mu_s said to be determined",
    "mu_s_median_error": "median relative error of mu_s",
    "radius_coverage_95": "95 % intervals that hold the radius",
    "radius_within_5_percent": "radius within 5 %, or said to be undetermined",
    "radius_determined": "radius said to be determined",
    "radius_median_error": "median relative error of the radius",
    "detected_within_20_ms": "slips of 0.1 mm detected 20 ms after their samples",
    "false_alarms_per_minute": "false alarms per minute",
    "drops": "parts dropped, observer",
    "rule_drops": "parts dropped, published rule with the true friction",
    "grip_saved": "grip saved by the observer",
    "slips_over_1_mm": "slips over 1 mm in taps and tilts, observer",
    "rule_slips_over_1_mm": "the same, published rule",
    "slide_within": "slides that end within 1 mm, observer",
    "rule_slide_within": "the same, published rule",
    "turn_within": "turns that end within 2 degrees, observer",
    "rule_turn_within": "the same, published rule",
    "hinge_within": "hinges that end within 2 degrees, observer",
    "rule_hinge_within": "the same, published rule",
    "hinge_slide_mm": "median slide of a hinge [mm], observer",
    "rule_hinge_slide_mm": "the same, published rule",
}
"""Rows of the table."""


@click.group(
    short_help="Try the observer and the controllers of a gripper on random parts."
)
def online() -> None:
    """Try the observer and the controllers of a gripper."""


@online.command(short_help="Hold, slide, turn and hinge random parts.")
@click.option(
    "--parts", type=int, default=1000, show_default=True, help="Number of random parts."
)
@click.option(
    "--seed",
    type=int,
    default=0,
    show_default=True,
    help="Random seed of parts and noise.",
)
@click.option(
    "--json", "file", type=FILE, help="File for the numbers of the table (JSON)."
)
def trials(parts: int, seed: int, file: Path | None) -> None:
    """Hold, slide, turn and hinge random parts with unknown friction, and print the results.

    The published controllers do the same tasks, but know the true friction. 100 parts take about three minutes.

    \b
    Example:
      planarfriction online trials --parts 100 --json trials.json
    """
    from planarfriction._support import validation
    from planarfriction._support.writing import check_writable, write_text
    from planarfriction.cli.console import note, print_table, work_progress
    from planarfriction_studies.rig.trials import KINDS, run_trials

    parts = validation.count("--parts", parts, len(KINDS))
    seed = validation.count("--seed", seed, 0)
    if file is not None:
        check_writable(file)
    with work_progress("trials") as progress:
        found = run_trials(parts, seed, progress=progress)
    print_table(
        f"{found['parts']} parts, seed {found['seed']}",
        ["result", "value"],
        rows(found),
    )
    if file is not None:
        write_text(file, json.dumps(found, indent=2) + "\n")
        note(f"wrote {file}")


def rows(found: dict[str, float]) -> list[list[str]]:
    """Return the rows of the table."""
    return [[words, f"{found[name]:g}"] for name, words in WORDS.items()]


@online.command(short_help="Film a part that is held while its friction is found.")
@click.option(
    "--out",
    type=FILE,
    default="hold.gif",
    show_default=True,
    help="Film to write (.gif, .mp4, .html).",
)
@click.option(
    "--seed", type=int, default=0, show_default=True, help="Random seed of the noise."
)
def demo(out: Path, seed: int) -> None:
    """Hold a part of unknown friction, through a tap and a tilt, and film it.

    The film shows the part in the hand, the grip force, and the estimate of mu_c with its 95 % interval.

    \b
    Example:
      planarfriction online demo --out hold.gif
    """
    from planarfriction._support import validation
    from planarfriction._support.writing import check_writable
    from planarfriction.cli.console import note, work_progress
    from planarfriction.plots.film_files import check_kind
    from planarfriction_studies.rig.demo import record_hold
    from planarfriction_studies.rig.pictures import write_grip_film

    seed = validation.count("--seed", seed, 0)
    check_kind(out)
    check_writable(out)
    with work_progress("film") as progress:
        progress("holding the part")
        record = record_hold(seed)
        progress("drawing")
        write_grip_film(out, record)
    note(f"wrote {out}")
