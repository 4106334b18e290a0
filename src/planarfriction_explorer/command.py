"""`planarfriction explore`: the explorer in the browser."""

from __future__ import annotations

import click


@click.command(short_help="Explore the friction of a contact in the browser.")
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=0,
    help="Port on this computer. Default: a free one.",
)
@click.option(
    "--browser/--no-browser", default=True, help="Whether to open the browser."
)
def explore(port: int, browser: bool) -> None:
    """Open a page in the browser: draw or load a pressure map, choose a law, drag a twist, and see the friction.

    The page shows the wrench, the limit surface, the centre of rotation, the error of the ellipsoid, and the Python
    code or scene file to copy. It is for pressure files, all laws, comparisons of models, and scenes: the page
    docs/static/try.html shows the rest without an installation. It can only be reached from this computer. Ctrl-C
    stops it. Needs Panel (pip install 'planarfriction[explore]').

    \b
    Examples:
      planarfriction explore
      planarfriction explore --port 5006 --no-browser
    """
    from planarfriction.cli.console import note
    from planarfriction_explorer.server import serve

    serve(
        port,
        browser=browser,
        ready=lambda address: note(f"the explorer is at {address} (Ctrl-C stops it)"),
    )
