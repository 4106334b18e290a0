"""Commands print and write what was recorded."""

from tests.support import recorded, shown


def test_commands_print_and_write_what_was_recorded():
    recorded.check(shown.FOLDER / "commands.json", recorded.plain(shown.printed()))
