"""Count how often intervals contain the true value: `python docs/make_coverage.py` fills identification-diagnostics.md.

The counts are kept in the file given by `--kept`, so that an interrupted run can be continued.
"""

from __future__ import annotations

import argparse
import json
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import planarfriction as pf
from planarfriction.identify import FitOptions, Log, identify_lugre

PAGE = Path(__file__).parent / "identification-diagnostics.md"
MARK = re.compile(r"<!-- coverage -->\n\n(?:\|.*\n)+")

NAMES = (
    "mu_c",
    "mu_s",
    "v_s",
    "gamma",
    "sigma_0",
    "sigma_1",
    "sigma_2",
    "contact_radius",
)

LAW = pf.LuGre(
    mu_c=0.5,
    mu_s=0.65,
    v_s=2e-3,
    gamma=1.4,
    sigma_0=2e4,
    sigma_1=30.0,
    sigma_2=0.8,
    elasto_plastic=pf.ElastoPlastic(0.9),
)
DISC = pf.ContactPatch.disc(0.01, cells=11)
LOAD, RATE, DURATION, FINER = 2.0, 200, 4.0, 50
SHARE = 0.01
"""Noise of each wrench channel, relative to its root mean square."""


@dataclass(frozen=True)
class Row:
    """One kind of data."""

    words: str
    model: str
    """The model that generates the data and is then fitted."""
    rim_heavy: bool = False
    delay: float = 0.0
    bias: float = 0.0
    drift: float = 0.0
    twist_noise: float = 0.0


ROWS = {
    "exact": Row("same model, nothing else wrong", "reduced-published"),
    "delay": Row("wrench delayed by 2 ms", "reduced-published", delay=2e-3),
    "drift": Row("load cell drifts by 5 %", "reduced-published", drift=0.05),
    "bias": Row("offset of 3 % on each wrench channel", "reduced-published", bias=0.03),
    "twist": Row("1 % noise on the twist", "reduced-published", twist_noise=0.01),
    "distributed": Row("distributed model, same disc", "distributed"),
    "rim": Row(
        "pressure at the rim, a uniform disc is fitted", "distributed", rim_heavy=True
    ),
}


@dataclass
class Count:
    """Counts over the fits of one row."""

    seeds: int = 0
    rejected: int = 0
    inside: dict[str, int] = field(default_factory=lambda: dict.fromkeys(NAMES, 0))
    told: dict[str, int] = field(default_factory=lambda: dict.fromkeys(NAMES, 0))
    inside_told: dict[str, int] = field(default_factory=lambda: dict.fromkeys(NAMES, 0))


def truth(row: Row) -> tuple[np.ndarray, np.ndarray, np.ndarray, dict[str, float]]:
    """Times, twists and wrenches on a grid `FINER` times finer than the samples, and the true parameters."""
    time = np.arange(round(DURATION * RATE) * FINER) / (RATE * FINER)
    grown = np.minimum(1.0, 1.2 * np.exp(3.5 * (time / time[-1] - 1.0)))
    vx = 0.03 * grown * np.sin(2 * np.pi * 2.3 * time)
    vy = (
        0.02
        * grown
        * np.sin(2 * np.pi * 1.7 * time + 1.0)
        * np.minimum(1.0, 5.0 * time)
    )
    twist = np.stack([vx, vy, 2.0 * grown * np.sin(2 * np.pi * 3.1 * time)], -1)
    patch = DISC
    if row.rim_heavy:
        patch = pf.ContactPatch(
            DISC.positions,
            DISC.areas,
            0.2 + (np.linalg.norm(DISC.positions, axis=1) / 0.01) ** 4,
        )
    model = (
        pf.DistributedModel(patch, LAW)
        if row.model == "distributed"
        else pf.ReducedModelPublished(patch, LAW)
    )
    steps = pf.rollout(model, None, 0.5 * (twist[1:] + twist[:-1]), LOAD, time[1])
    values = {name: getattr(LAW, name) for name in NAMES[:-1]}
    radius = (
        model.surface.contact_radius
        if isinstance(model, pf.ReducedModelPublished)
        else patch.contact_radius()
    )
    return (
        time,
        twist,
        np.vstack([np.zeros(3), steps.wrenches]),
        {**values, "contact_radius": float(radius)},
    )


def observed(row: Row, made: tuple, seed: int) -> Log:
    """The log that sensors with the disturbances of this row would record."""
    time, twist, wrench, _ = made
    random = np.random.default_rng(seed)
    late = round(row.delay / time[1])
    wrench = np.vstack(
        [np.repeat(wrench[:1], late, axis=0), wrench[: len(wrench) - late]]
    )[::FINER]
    time = time[::FINER]
    twist = twist[::FINER]
    size = np.sqrt(np.mean(wrench**2, axis=0))
    wrench = wrench + SHARE * size * random.standard_normal(wrench.shape)
    wrench = wrench + row.bias * size * random.choice([-1.0, 1.0], 3)
    load = LOAD * (1.0 + row.drift * time / time[-1])
    spread = row.twist_noise * np.sqrt(np.mean(twist**2, axis=0))
    return Log(time, twist + spread * random.standard_normal(twist.shape), wrench, load)


def counted(row: Row, made: tuple, seed: int, count: Count) -> None:
    """Fit one log and count."""
    found = identify_lugre(
        observed(row, made, seed), DISC, model=row.model, options=FitOptions(starts=1)
    )
    count.seeds += 1
    count.rejected += found.scores[0].rejected
    for name, (low, high) in found.intervals().items():
        inside = low <= made[3][name] <= high
        told = found.identifiable(name)
        count.inside[name] += inside
        count.told[name] += told
        count.inside_told[name] += inside and told


def table(counts: dict[str, Count]) -> str:
    """Rows of the page: one for each kind of data."""
    lines = [
        "| data | fitted model | intervals that contain the truth | rejected |",
        "|---|---|---|---|",
    ]
    for name, count in counts.items():
        row = ROWS[name]
        told = sum(count.told.values())
        share = (
            f"{sum(count.inside_told.values())} of {told}"
            if told
            else "none identifiable"
        )
        lines.append(
            f"| {row.words} | {row.model} | {share} | {count.rejected} of {count.seeds} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Count what is not counted yet, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", default=",".join(ROWS))
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--kept", type=Path, default=Path("coverage.json"))
    options = parser.parse_args()
    kept = json.loads(options.kept.read_text()) if options.kept.exists() else {}
    for name in options.rows.split(","):
        count = Count(**kept.get(name, {}))
        made = truth(ROWS[name])
        while count.seeds < options.seeds:
            counted(ROWS[name], made, count.seeds, count)
            kept[name] = vars(count)
            options.kept.write_text(json.dumps(kept, indent=1))
        print(name, count.rejected, count.told, count.inside, flush=True)
    counts = {name: Count(**kept[name]) for name in ROWS if name in kept}
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(
        MARK.sub(lambda found: f"<!-- coverage -->\n\n{table(counts)}", text),
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
