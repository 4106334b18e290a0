"""`planarfriction export`: the friction model of a file as C source."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import planarfriction as pf
from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.scenes.files import read_table
from planarfriction.scenes.model_files import model_from_dict
from planarfriction.scenes.section import Section


def read_model(file: Path, contact: str | None) -> Any:
    """Return the model of a file that holds one, or that of a contact of a scene.

    Raises FileError for what is neither, InvalidValueError for a contact that is not there, or one that is needed and
    not given.
    """
    table = read_table(file)
    if "contact" not in table:
        if contact is not None:
            raise InvalidValueError("--contact", "be given only for a scene", contact)
        return model_from_dict(Section(table, "", str(file), file.parent).only(["model", "patch", "law"]))
    models = {each.name: each.model for each in pf.Scene.from_dict(table, file.parent, str(file)).contacts}
    if contact is None:
        first, *others = models.values()
        if any(each != first for each in others):
            raise InvalidValueError("--contact", f"be one of {', '.join(models)}", "none")
        return first
    return models[validation.choice("--contact", contact, models)]


def export(file: Path, *, contact: str | None, out: Path, name: str, precision: str, patches: int) -> None:
    """Write the model of a file as C source, and print which files hold it."""
    for each in pf.export_c(read_model(file, contact), out, name=name, precision=precision, patches=patches):
        print(each)
