"""Faults of sensors in the rig: every one ends as the table says."""

import pytest

from planarfriction_studies.rig import faults

ALL = faults.expected()


def wrong(task, found, kinds):
    """Return the faults that ended otherwise than expected, each with the numbers of parts that did so."""
    ends = faults.ends(task, found)
    said = []
    for number, fault in enumerate(kinds):
        own = found[:, 2] == number
        may = faults.TASKS[task] in fault.end
        lost = own & ~ends.kept
        silent = lost & ~ends.flagged
        moves = own & ends.moves
        if ((silent | moves) if may else lost).any():
            numbers = f"{silent.sum()} without a flag, {moves.sum()} did not stop"
            said.append(
                f"{fault.channel} {fault.kind}: {lost.sum()} of {own.sum()}, {numbers}"
            )
    return said


def test_the_table_names_every_channel_and_fault_once():
    assert len(set(ALL)) == len(ALL) == 66
    assert {fault.channel for fault in ALL} == set(faults.CHANNELS)
    assert set("".join(fault.end for fault in ALL if fault.end != "kept")) <= set(
        faults.TASKS.values()
    )


def test_held_parts_stay_where_the_load_the_clock_or_the_slip_sensor_dies():
    names = {
        ("load", "0"),
        ("load", "nan"),
        ("time", "nan"),
        ("slip", "frozen"),
        ("slip_y", "0"),
    }
    kinds = [fault for fault in ALL if (fault.channel, fault.kind) in names]
    found = faults.run_faults("hold", 2, 1, [1], kinds)
    assert len(found) == 2 + 2 * len(kinds) * len(faults.MOMENTS)
    assert wrong("hold", found, kinds) == []
    assert not found[found[:, 2] < 0, 4].any()  # no flag with healthy sensors


@pytest.mark.slow
@pytest.mark.parametrize("kind", range(len(faults.KINDS)))
@pytest.mark.parametrize("task", faults.TASKS)
def test_every_fault_ends_as_the_table_says(task, kind):
    """16 parts of each kind: 64 in all, and three moments; about a minute of processor time for each of the 16."""
    assert wrong(task, faults.run_faults(task, 16, 0, [kind]), ALL) == []
