"""Friction of a joint as C source: one function with one state, for the compensation in a controller."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from planarfriction._engine.codegen.symbolic_functions import twin
from planarfriction._engine.codegen.trace import Number, Trace, traced
from planarfriction._support import validation, writing
from planarfriction.export.c_source import Writer, rendered
from planarfriction.export.library import checked_name
from planarfriction.joints import JointFriction
from planarfriction.joints.loops.runs import joint_step


def export_joint_c(
    friction: JointFriction, folder: Any, *, name: str = "friction"
) -> tuple[Path, ...]:
    """Write `<name>.h` and `<name>.c` with the function `<name>_joint_torque`; return the files.

    The source is C99 and C++17 and calls nothing but `math.h`; it is traced from the step that fits use. A rigid joint
    gets bristles that bend by 1 mrad.

    Raises InvalidValueError for a name that is no name of C, FileError if the folder cannot be written.
    """
    import planarfriction

    friction = validation.instance(
        "friction", friction, JointFriction, "a JointFriction"
    )
    checked_name(name)

    def step(trace: Trace) -> Any:
        numbers = (
            Number(trace, each)
            for each in ("(*state)", "speed", "tau_motor", "tau_external", "dt")
        )
        return twin(joint_step)(friction.numbers, *numbers)

    body = "\n".join(Writer().lines(traced(step), ["*state", "torque"]))
    folder = validation.path("folder", folder)
    writing.make_folder(folder)
    files = folder / f"{name}.h", folder / f"{name}.c"
    for file, template in zip(files, ("joint.h", "joint.c"), strict=True):
        words = {"name": name, "version": planarfriction.__version__, "body": body}
        writing.write_text(file, rendered("planarfriction.export", template, **words))
    return files
