"""The root of the command line: commands of the library, and those that other packages add by entry points."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, distribution, entry_points

import click

GROUP = "planarfriction.commands"
"""Group of the entry points: name of the command = module:command of click."""

STUDIES = "planarfriction-studies"
"""Distribution of experiments, measured data, the referee of simulators, benchmarks, and the rig of grippers."""

ELSEWHERE = f"Experiments, measured data and benchmarks are in {STUDIES} (pip install ./studies)."
"""Line below the commands where that distribution is missing."""


class Commands(click.Group):
    """Group that looks for commands of other packages only where its own do not suffice: a search takes 10 ms."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        self.add_installed()
        return super().list_commands(ctx)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self.commands:
            self.add_installed()
        return super().get_command(ctx, cmd_name)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write where more commands come from, if they are not installed."""
        try:
            distribution(STUDIES)
        except PackageNotFoundError:
            formatter.write_paragraph()
            formatter.write_text(ELSEWHERE)

    def add_installed(self) -> None:
        """Add the commands of other packages, without those whose package cannot be imported."""
        for entry in entry_points(group=GROUP):
            if entry.name not in self.commands:
                try:
                    self.add_command(entry.load(), entry.name)
                except ImportError:
                    continue
