"""Commands print and write what was recorded."""

from tests.support import shown, subjects


def test_commands_print_and_write_what_was_recorded():
    subjects.check("commands", shown.printed())
