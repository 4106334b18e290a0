"""Names and units of the columns of logs, as files, sensors and ROS messages write them."""

from __future__ import annotations

import re

ALIASES = {
    **{"time": "t", "time_s": "t", "t_s": "t", "wz": "omega"},
    **{"fn": "normal_force", "fz": "normal_force", "mz": "tau", "tz": "tau"},
}
"""Other names of columns, in small letters."""

MESSAGES = {
    **{"force.x": "fx", "force.y": "fy", "force.z": "normal_force", "torque.z": "tau"},
    **{"linear.x": "vx", "linear.y": "vy", "angular.z": "omega", "position.x": "x", "position.y": "y"},
}
"""Columns by the names of ROS messages; what stands before them, as in wrench.force.x, does not count."""

UNITS = {
    "t": ("s",),
    **dict.fromkeys(("vx", "vy"), ("m/s",)),
    "omega": ("rad/s", "1/s"),
    **dict.fromkeys(("x", "y"), ("m",)),
    "theta": ("rad",),
    **dict.fromkeys(("fx", "fy", "normal_force"), ("n",)),
    "tau": ("nm", "n*m", "n.m", "n·m"),
}
"""Units that may stand in brackets behind a name, or below it, in small letters and without spaces."""

_MESSAGE = re.compile(r"(?:.*[./_])?(force|torque|linear|angular|position)[./_]([xyz])")


def column_name(heading: str) -> str:
    """Return the name of a column without its unit: "contact.vx" with a small vx, or that of a message's number."""
    message = _MESSAGE.fullmatch(heading.lower())
    if message is not None and ".".join(message.groups()) in MESSAGES:
        return MESSAGES[".".join(message.groups())]
    prefix, dot, name = heading.rpartition(".")
    return prefix + dot + name.lower()
