"""`planarfriction export`: the friction model of a file as C source."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from click import argument, command, option

import planarfriction as pf
from planarfriction.cli.options import FILE, complete_scene
from planarfriction.errors import InvalidValueError


def read_model(file: Path, contact: str | None) -> Any:
    """Return the model of a file that holds one, or that of a contact of a scene.

    Raises FileError for what is neither, InvalidValueError for a contact that is not there, or one that is needed and
    not given.
    """
    from planarfriction._support import validation
    from planarfriction._support.reading import Section
    from planarfriction.scenes.files import read_table
    from planarfriction.scenes.model_files import model_from_dict

    table = read_table(file)
    if "contact" not in table:
        if contact is not None:
            raise InvalidValueError("--contact", "be given only for a scene", contact)
        return model_from_dict(
            Section(table, "", str(file), file.parent).only(
                ["model", "patch", "law", "pad"]
            )
        )
    models = {
        each.name: each.model
        for each in pf.Scene.from_dict(table, file.parent, str(file)).contacts
    }
    if contact is None:
        first, *others = models.values()
        if any(each != first for each in others):
            raise InvalidValueError(
                "--contact", f"be one of {', '.join(models)}", "none"
            )
        return first
    return models[validation.choice("--contact", contact, models)]


@command(short_help="Write the friction model of a file as C source.")
@argument("file", type=FILE, shell_complete=complete_scene)
@option("--out", type=FILE, required=True, help="Folder for the files.")
@option(
    "--name",
    default="friction",
    help="Name of the files, and prefix of the names in them.",
)
@option("--precision", default="double", help="double or float.")
@option(
    "--patches",
    default=1,
    help="Patches of this model below a body.",
)
@option(
    "--contact",
    metavar="NAME",
    help="Contact whose model is exported, if a scene has different ones.",
)
def export(file: Path, out: Path, contact: str | None, **options: Any) -> None:
    """Write the friction model of a file as C source for a controller: NAME.h and NAME.c, C99 and C++17.

    NAME_test.c compares the library with numbers of the model; NAME.cmake has targets for both.

    FILE (.toml, .json) is a scene, or a model alone: patch, law and model, written as for a contact of a scene.

    \b
    Examples:
      planarfriction export model.toml --out friction/
      planarfriction export scene.toml --contact fingers --out src/ --name finger --precision float
    """
    for each in pf.export_c(read_model(file, contact), out, **options):
        print(each)
