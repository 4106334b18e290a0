"""Try alarms by incipient slip and by others, and write the table of a page: `python docs/make_incipient.py`."""

from __future__ import annotations

import re
from pathlib import Path

from planarfriction_studies.rig import incipient

PAGE = Path(__file__).parent / "online-trials.md"
"""Page that has the table."""

MARK = re.compile(r"(?<=<!-- incipient slip -->\n\n)(?:\|.*\n)*")
"""Table on the page."""

PARTS = 64
"""Parts that are pulled."""

RESERVES = (1.4, 1.6, 1.8)
"""Reserves for which the lead is given."""


def table() -> str:
    """Return the rows of the page: one for each alarm."""
    model = incipient.fingertip()
    pulls = incipient.Pulls.drawn(PARTS)
    lines = [
        "| alarm by | before gross slip | least reserve |",
        "|---|---:|---:|",
    ]
    for alarm in incipient.ALARMS:
        leads = [incipient.lead(model, pulls, alarm, each) for each in RESERVES]
        early = ", ".join(f"{1e3 * each:.0f}" for each in leads) + " ms"
        reserve = incipient.least_reserve(model, pulls, alarm)
        lines.append(f"| {alarm} | {early} | {reserve:.2f} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the table."""
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(MARK.sub(lambda found: table(), text), encoding="utf-8")


if __name__ == "__main__":
    main()
