"""Texts about an experiment: a template beside its code, filled with the numbers of a run.

A template is Markdown with formulas between dollar signs. Its parts begin with `## verdict`, `## asked`, `## found` and
`## figures`, which lists a caption in one line for each figure, `- NAME: CAPTION`. `## left out` may name a published
curve that is not compared.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from planarfriction_studies.experiments.experiment import Picture, Result

if TYPE_CHECKING:
    import jinja2


def report(
    home: str,
    figures: Mapping[str, Any],
    numbers: Mapping[str, Any],
    values: Mapping[str, Any] | None = None,
    **rest: Any,
) -> Result:
    """Return a result with the words of the template `findings.md.j2` in the folder `home`.

    The template names `numbers` of the run, each by itself too, and further `values`; `figures` are by name, and
    `rest` are other fields of the result.
    """
    text = (
        environment()
        .get_template(f"{home}/findings.md.j2")
        .render({**numbers, "numbers": numbers, **(values or {})})
    )
    _, *pieces = re.split(r"^## (.+)\n", text, flags=re.M)
    parts = {
        heading.strip(): re.sub(r"\n{3,}", "\n\n", body.strip())
        for heading, body in zip(pieces[::2], pieces[1::2], strict=True)
    }
    captions = dict(
        line.removeprefix("- ").split(": ", 1)
        for line in parts["figures"].splitlines()
        if line
    )
    pictures = [
        Picture(name, captions[name], figure) for name, figure in figures.items()
    ]
    found = parts["found"].split("\n\n")
    words = {
        name: parts.get(name.replace("_", " "), "")
        for name in ("asked", "verdict", "left_out")
    }
    return Result(found, pictures, numbers=numbers, **words, **rest)


@functools.cache
def environment() -> jinja2.Environment:
    """Return the environment of all templates, with filters for numbers; an unknown name is an error."""
    import jinja2

    made = jinja2.Environment(
        loader=jinja2.PackageLoader("planarfriction_studies.experiments", ""),
        autoescape=lambda name: bool(name and name.endswith(".html.j2")),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= {
        "fmt": fmt,
        "short": short,
        "power": power,
        "span": span,
        "number": number,
    }
    return made


def fmt(value: Any, spec: str) -> str:
    """Return a number in a format of Python's; no zero has a sign."""
    text = format(value, spec)
    return text if re.search("[1-9]", text) else text.lstrip("+-")


def short(value: float, digits: int = 3) -> str:
    """Return a number with so many digits, without an exponent where it reads well without."""
    return fmt(float(f"{value:.{digits}g}"), "g")


def power(value: float, digits: int = 0) -> str:
    """Return a number with a power of ten, as a formula."""
    if value == 0.0:
        return "0"
    mantissa, exponent = f"{value:.{digits}e}".split("e")
    factor = "" if mantissa == "1" else rf"{mantissa} \times "
    return rf"${factor}10^{{{int(exponent)}}}$"


def span(values: Sequence[float], spec: str = ".2f", factor: float = 1) -> str:
    """Write a range from the smallest to the largest number; once where both read the same."""
    low, high = (fmt(factor * choose(values), spec) for choose in (min, max))
    return low if low == high else f"{low} to {high}"


def number(value: Any) -> str:
    """Return a number as text with four digits; other things as they are; nothing for None."""
    if value is None:
        return ""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value)
    return f"{value:d}" if isinstance(value, int) else fmt(value, ".4g")
