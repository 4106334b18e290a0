"""The root of the command line: commands of the library, and those that packages above it add by entry points."""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points

import click

GROUP = "planarfriction.commands"
"""Group of the entry points: name of the command = module:command of click."""

OWN = {
    "bench": "planarfriction_studies.commands.definitions:bench",
    "measured": "planarfriction_studies.commands.definitions:measured",
    "referee": "planarfriction_studies.commands.referee:referee",
    "reproduce": "planarfriction_studies.commands.definitions:reproduce",
    "simulators": "planarfriction_studies.commands.referee:simulators",
    "explore": "planarfriction_explorer.command:explore",
}
"""Entry points of the packages that come with the library, also where an installation of a checkout is older."""


class Commands(click.Group):
    """Group that looks for commands of other packages only where its own do not suffice: a search takes 10 ms."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands that are installed."""
        self.add_installed()
        return super().list_commands(ctx)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command called `cmd_name`, or None."""
        if cmd_name not in self.commands:
            self.add_installed()
        return super().get_command(ctx, cmd_name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return name, command and remaining arguments; a command whose package is missing is a usage error."""
        name = args[0]
        if name in OWN and not ctx.resilient_parsing and self.get_command(ctx, name) is None:
            package = OWN[name].partition(".")[0]
            ctx.fail(
                f"planarfriction {name} needs the package {package}, which comes with planarfriction:"
                " run pip install --force-reinstall --no-deps planarfriction"
            )
        return super().resolve_command(ctx, args)

    def add_installed(self) -> None:
        """Add the commands of other packages, without those whose package cannot be imported."""
        own = [EntryPoint(name, value, GROUP) for name, value in OWN.items()]
        for entry in (*own, *entry_points(group=GROUP)):
            if entry.name not in self.commands:
                try:
                    self.add_command(entry.load(), entry.name)
                except ImportError:
                    continue
