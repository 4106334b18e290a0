"""Tables of where each model lets go: they are those of the stored numbers, and the measurement gives these again."""

import json

import numpy as np
import pytest

from tests.support.repository import script

made = script("docs/make_breakaway.py")


def test_tables_of_the_pages_are_those_of_the_stored_numbers():
    kept = json.loads(made.KEPT.read_text(encoding="utf-8"))
    pages = [path.read_text(encoding="utf-8") for path in made.DOCS.glob("*.md")]
    assert sum(len(made.MARK.findall(page)) for page in pages) == len(made.TABLES)
    assert [made.with_tables(page, kept) == page for page in pages] == [True] * len(
        pages
    )
    assert {key for key, _ in made.measures()} == set(kept)


@pytest.mark.slow
def test_a_patch_lets_go_where_it_is_said_to():
    kept = json.loads(made.KEPT.read_text(encoding="utf-8"))["breakaway narrow pads"]
    found = made.breakaway("narrow pads")
    for name, errors in found.items():
        # loads of slip, known to the tolerance of the simulations: 1e-6 of a load, over 1e-5 m
        np.testing.assert_allclose(errors, kept[name], atol=2e-4, err_msg=name)
    assert max(map(abs, found["default"])) < 2e-3 < max(map(abs, found["published"]))


def test_loads_are_on_the_limit_surface():
    patch = made.SHAPES["T"]()
    wrench = made.wrench_at_limit(patch, np.random.default_rng(0))
    # Cells beside the continuous patch.
    assert made.highest_level(patch, wrench[None]) == pytest.approx(1.0, abs=0.01)
