"""Friction of a joint as C source: one function with one state, for the compensation in a controller."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from planarfriction import validation, writing
from planarfriction.export.c_source import Writer
from planarfriction.export.library import checked_name
from planarfriction.export.twins import twin
from planarfriction.joints import JointFriction
from planarfriction.joints.loops.runs import joint_step
from planarfriction.kernels.trace import Number, Trace, traced

HEADER = """/* {name}.h: friction of a joint, written by planarfriction {version}.
 *
 * It allocates nothing and keeps nothing but the caller's state: the bend of bristles [rad], 0 at first.
 */
#ifndef {guard}_H
#define {guard}_H

#ifdef __cplusplus
extern "C" {{
#endif

/* Torque that friction takes [N m], positive along the speed, at the end of a period dt [s] at a held speed [rad/s];
 * tau_motor and tau_external [N m] are the torques of the motor and of all else on the joint. To compensate friction,
 * add it to the command. Returns 0 and leaves the state for a dt that is not positive, and for NaN. */
double {name}_joint_torque(double *state, double speed, double tau_motor, double tau_external, double dt);

#ifdef __cplusplus
}}
#endif

#endif
"""

SOURCE = """/* {name}.c: see {name}.h. Written by planarfriction {version}; write it again instead of changing it. */
#include "{name}.h"

#include <math.h>

typedef double real;

double {name}_joint_torque(double *state, double speed, double tau_motor, double tau_external, double dt)
{{
    double torque;
    if (!(dt > 0.0 && fabs(speed) < 1e50 && fabs(tau_motor) < 1e50 && fabs(tau_external) < 1e50)) {{
        return 0.0;
    }}
{body}
    return torque;
}}
"""


def export_joint_c(friction: JointFriction, folder: Any, *, name: str = "friction") -> tuple[Path, ...]:
    """Write `<name>.h` and `<name>.c` with the function `<name>_joint_torque`; return the files.

    The source is C99 and C++17 and calls nothing but `math.h`; it is traced from the step that fits use. A rigid joint
    gets bristles that bend by 1 mrad.

    Raises InvalidValueError for a name that is no name of C, FileError if the folder cannot be written.
    """
    import planarfriction

    friction = validation.instance("friction", friction, JointFriction, "a JointFriction")
    checked_name(name)

    def step(trace: Trace) -> Any:
        numbers = (Number(trace, each) for each in ("(*state)", "speed", "tau_motor", "tau_external", "dt"))
        return twin(joint_step)(friction.numbers, *numbers)

    body = "\n".join(Writer().lines(traced(step), ["*state", "torque"]))
    words = {"name": name, "guard": name.upper(), "version": planarfriction.__version__, "body": body}
    folder = validation.path("folder", folder)
    writing.make_folder(folder)
    files = folder / f"{name}.h", folder / f"{name}.c"
    for file, template in zip(files, (HEADER, SOURCE), strict=True):
        writing.write_text(file, template.format(**words))
    return files
