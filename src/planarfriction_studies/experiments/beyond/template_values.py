"""Values that the template of the experiment beyond the paper names."""

from __future__ import annotations

import statistics
from typing import Any

from planarfriction_studies.experiments.beyond import grooves as grooved
from planarfriction_studies.experiments.beyond.driven import ROUNDS, STATISTICS
from planarfriction_studies.experiments.beyond.in_hand import SHIFT, depends_on_friction
from planarfriction_studies.experiments.beyond.ladder import AUTO
from planarfriction_studies.experiments.beyond.shapes import QUANTITIES
from planarfriction_studies.experiments.beyond.surfaces import QUARTIC_SHAPES
from planarfriction_studies.experiments.runs import IN_WORDS

Numbers = dict[str, Any]


def template_values(numbers: Numbers) -> Numbers:
    """Return the values that the template names."""
    surfaces, ends, grooves = (numbers[name] for name in ("surfaces", "in hand", "grooves"))
    few = [each for each in ends.values() if "degree 5" in each]
    moved = [each for each in numbers["driven"].values() if "degree 5" in each]
    return {
        "nearer": {
            name: [each[f"{kind}/force"]["mean"] / each["table/force"]["mean"] for each in surfaces.values()]
            for name, kind in (("cells", "sum over cells"), ("published", "published table"))
        },
        "quartic_installed": numbers["quartic installed"],
        "fitted": [IN_WORDS[shape] for shape in QUARTIC_SHAPES if shape in surfaces],
        "jump": numbers["jumps"]["Line/sum"],
        "driven": _driven(numbers),
        "step": numbers["step"],
        "rounds": ROUNDS,
        "runs": numbers["run ratios"],
        "unseen": _unseen(numbers["new shapes"]),
        "held": {model: {load: _score(each) for load, each in found.items()}
                 for model, found in numbers["in hand score"].items()},
        "friction": {model: _friction_shares(ends, model) for model in ("reduced", AUTO, "published")},
        "plateaus": numbers["plateaus"],
        "few": {model: max(each[model] for each in few)
                for model in ("degree 5", "published", "reduced", AUTO, "16 parts")},
        "share_of_time": numbers["run costs"]["degree 5"],
        "quartile": [each["degree 5"]["third quartile"] / each["full"]["third quartile"] for each in moved],
        "family": numbers["load family"],
        "grooves": {
            "models": len(grooved.MODELS),
            "miss": max(abs(a - b) for kind in grooved.MODELS
                        for a, b in zip(grooves[kind], grooves["closed form"], strict=True)),
        },
    }  # fmt: skip


def _driven(numbers: Numbers) -> Numbers:
    one, auto, over = (numbers[f"driven ratios{ending}"] for ending in ("", ", auto", ", parts"))
    worse = {IN_WORDS[shape]: [name for name, value in each.items() if value > 1.05] for shape, each in over.items()}
    return {
        "shapes": len(one),
        "one": _by_statistic(one),
        "auto": _by_statistic(auto),
        "worse": {shape: names for shape, names in worse.items() if names},
    }


def _by_statistic(ratios: dict[str, dict[str, float]]) -> dict[str, dict[str, list[float]]]:
    """Return ratios of all shapes by quantity and statistic."""
    return {
        quantity: {name: [each[before + name] for each in ratios.values()] for name in STATISTICS}
        for quantity, before in (("force", ""), ("torque", "torque "))
    }


def _unseen(ratios: Numbers) -> Numbers:
    return {
        "names": list(ratios),
        "twists": len(next(iter(ratios.values()))["reduced"]["force"]),
        "worst": {
            model: {name: max(max(each[model][name]) for each in ratios.values()) for name in QUANTITIES}
            for model in ("reduced", "4 parts", AUTO)
        },
    }


def _score(found: Numbers) -> Numbers:
    """Count the runs in which a model ends nearer than the published one; return those in which it does not, and the
    ratios."""
    ratios = found["ratios"]
    return {
        "nearer": found["nearer"],
        "runs": found["runs"],
        "worse": [case for case, ratio in ratios.items() if ratio >= 1.0],
        "ratios": list(ratios.values()),
        "median": statistics.median(ratios.values()),
    }


def _friction_shares(ends: dict[str, dict[str, float]], model: str) -> tuple[float, float]:
    """Return the median and largest distance of an end, as the share of friction that does the same."""
    shares = sorted(1e-3 * each[model] / each[SHIFT] for each in ends.values() if depends_on_friction(each))
    return shares[len(shares) // 2], shares[-1]
