"""Attack for as long as is asked, with examples that no run had before: `make fuzz MINUTES=60 ATTACKS=coupling`."""

from __future__ import annotations

import importlib
import os
import sys
import time
from pathlib import Path

import matplotlib
from attack import ATTACKS
from judge import CASES

ROUND = 10
"""A round has as many examples of each attack as the run of a minute has, over this."""


def main(minutes: float, chosen: str = "") -> int:
    """Attack with those whose name begins as chosen, print the counts, and return how many findings there are."""
    matplotlib.use("Agg")
    sys.path.append(str(Path(__file__).parents[2]))  # what tests share
    for path in sorted(Path(__file__).parent.glob("test_fuzz_*.py")):
        importlib.import_module(path.stem)
    attacks = {
        name: attack for name, attack in ATTACKS.items() if name.startswith(chosen)
    }
    if not attacks:
        raise SystemExit(
            f"no attack is named {chosen!r}; there are {', '.join(ATTACKS)}"
        )
    end = time.monotonic() + 60.0 * minutes
    found = {}
    rounds = 0
    while time.monotonic() < end:
        rounds += 1
        for name, attack in attacks.items():
            if time.monotonic() > end:
                break
            try:
                attack.again(max(2, attack.examples // ROUND))
            except KeyboardInterrupt:
                end = 0.0
                break
            except BaseException as failure:  # an extra that is missing skips; whatever else fails is a finding
                _note(name, failure, found)
    print(
        f"\n{rounds} rounds, {sum(count for kind, count in CASES.items() if 'refused' not in kind)} cases"
    )
    for kind in sorted(kind for kind in CASES if not kind.endswith(", refused")):
        print(
            f"{CASES[kind]:10,} {kind}, {CASES[f'{kind}, refused']:,} of them refused in one line"
        )
    print(f"{len(found)} findings")
    return len(found)


def _note(name: str, failure: BaseException, found: dict[str, str]) -> None:
    for each in getattr(failure, "exceptions", [failure]):
        text = f"{type(each).__name__}: {each}"
        if type(each).__name__ == "Skipped" or text in found:
            continue
        found[text] = name
        print(
            f"FOUND by {name}\n  {text[:1000]}",
            *getattr(each, "__notes__", ()),
            sep="\n  ",
            flush=True,
        )


if __name__ == "__main__":
    os.environ.setdefault("HYPOTHESIS_NO_PLUGINS", "1")
    sys.exit(
        min(main(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0, *sys.argv[2:]), 100)
    )
