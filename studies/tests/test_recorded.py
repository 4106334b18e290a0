"""Measured data, referee, rig and commands give what was recorded."""

from __future__ import annotations

import pytest

from tests.support.studied import SUBJECTS, check


@pytest.mark.parametrize("name", ["measured", "replayed", "rig", "referee"])
def test_it_gives_what_was_recorded(name):
    check(name, SUBJECTS[name]())


@pytest.mark.mujoco
@pytest.mark.parametrize("name", ["called"])
def test_with_mujoco_it_gives_what_was_recorded(name):
    if name not in SUBJECTS:
        pytest.skip("needs mujoco")
    check(name, SUBJECTS[name]())
