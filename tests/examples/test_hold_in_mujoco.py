"""The example that holds a plate in MuJoCo: what slips, with how much grip, beside the published rule."""

import numpy as np
import pytest

from tests.support.repository import script

pytest.importorskip(
    "mujoco", reason="needs MuJoCo: pip install 'planarfriction[mujoco]'"
)

pytestmark = pytest.mark.mujoco


def test_a_hand_that_tilts_holds_with_less_grip_than_the_rule():
    found = script("examples/hold_in_mujoco.py").main()
    own = found["Hold"]
    rule = found["published rule"]
    assert own.first < 1e-3 and own.slip < 3e-4 and own.turn < np.radians(5.0)
    assert own.grip < 0.75 * rule.grip
