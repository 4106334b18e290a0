"""Trials of alarms: shares of the load against closed forms, the order of alarms, and what they prevent."""

import numpy as np
import pytest

from planarfriction_studies.rig import incipient

MODEL = incipient.fingertip()


def pull(most, duration, count=1):
    return incipient.Pulls(np.full(count, most), np.full(count, duration))


def test_a_slow_pull_slips_partly_where_the_closed_form_says():
    """On a half-space of pieces, the share u^3 of the load slips at `Q/(mu f_N) = 3 u^2 - 2 u^3` (docs/tactile.md)."""
    reserve, slow = 2.0, pull(1.0, 0.9)
    found = incipient.trial(MODEL, slow, reserve, "incipient slip", raises=False)
    force = (incipient.WEIGHT + slow.at(found.alarm[0])[0]) / (
        reserve * incipient.WEIGHT
    )
    u = incipient.ALARMS["incipient slip"] ** (1.0 / 3.0)
    assert force == pytest.approx(3.0 * u**2 - 2.0 * u**3, abs=0.12)


def test_alarms_come_in_order_and_hold_what_slides_without_them():
    hard = pull(0.9, 0.3)
    times = [
        incipient.trial(MODEL, hard, 1.7, each, raises=False)
        for each in incipient.ALARMS
    ]
    alarms = [each.alarm[0] for each in times]
    assert alarms[0] <= alarms[1] < alarms[2] < incipient.END
    held = incipient.trial(MODEL, hard, 1.7, "incipient slip")
    assert held.slid[0] < incipient.LONGEST < times[1].slid[0]


def test_a_part_that_is_hardly_pulled_gives_no_alarm():
    weak = pull(0.05, 0.3)
    for each in incipient.ALARMS:
        found = incipient.trial(MODEL, weak, 1.8, each)
        assert np.isinf(found.alarm[0]) and found.slid[0] < incipient.LONGEST
