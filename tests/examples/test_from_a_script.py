"""The example that goes from a script with the paper's model to a contact patch: numbers of its page, its picture."""

from __future__ import annotations

import re

import pytest

from tests.support.repository import ROOT, script

pytest.importorskip("torch", reason="needs PyTorch: pip install 'planarfriction[torch]'")

PAGE = ROOT / "docs" / "from-a-script.md"

pytestmark = pytest.mark.torch


@pytest.fixture(scope="module")
def example():
    return script("examples/from_a_script.py")


def numbers_of_the_page() -> dict[str, list[float]]:
    """Rows of the table: what was fitted, then the errors in per cent."""
    rows = re.findall(r"^\| (fitted, [\w ]+|`ReducedModel`[\w ,]+|the pad) \|(.*)\|$", PAGE.read_text(), re.MULTILINE)
    cells = {name: row.replace("%", "").replace(",", "").split("|") for name, row in rows}
    return {name: [float(cell) for cell in row if cell.strip()] for name, row in cells.items()}


def test_the_page_tells_what_comes_out(example):
    compared = example.run()
    page = numbers_of_the_page()
    assert page.pop("the pad") == pytest.approx(
        [example.LAW.mu_c, example.LAW.sigma_0, 1e3 * example.PAD.contact_radius()], rel=1e-3
    )
    found = {
        f"fitted, {name}": [
            fit.mu_c,
            fit.sigma_0,
            1e3 * fit.radius,
            *100 * example.misfit(fit.wrenches, compared.truth),
        ]
        for name, fit in compared.fits.items()
    }
    found["`ReducedModel` of the pad, nothing fitted"] = [*100 * example.misfit(compared.reduced, compared.truth)]
    assert found.keys() == page.keys()
    for name, values in found.items():
        # the last digit that the page shows, of which half is its rounding
        assert values == pytest.approx(page[name], rel=1e-3, abs=0.06), name
    ellipsoid, exact = (row[-1] for row in page.values() if len(row) == 6)
    assert exact < 0.5 * ellipsoid


def test_it_prints_and_draws(example, tmp_path, capsys):
    example.main(["--out", str(tmp_path), "--steps", "2"])
    assert (tmp_path / "from_a_script.png").stat().st_size > 10_000
    printed = capsys.readouterr().out
    assert printed.count("errors on the unseen movement") == 3
